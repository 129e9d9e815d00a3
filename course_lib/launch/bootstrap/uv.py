"""uv, the installer: found, or installed privately from the wheel that uv.lock names."""

import hashlib
import http.client
import os
import re
import shutil
import subprocess
import time
import urllib.error
import zipfile
from pathlib import Path
from typing import NamedTuple, Optional

from . import places
from .messages import Stop, say, with_variable
from .package_index import PYPI, Index, link_to, open_url, unreachable, without_secret
from .platform_facts import Facts

OLDEST_UV = (0, 8)


class Wheel(NamedTuple):
    """A wheel as uv.lock names it."""

    version: str
    filename: str
    sha256: str


def locked_uv(lock: str, known: Facts) -> Wheel:
    """The wheel of uv in uv.lock for this machine."""
    import tomllib  # here the Python is one that the course can use

    package = next(p for p in tomllib.loads(lock)["package"] if p["name"] == "uv")
    kind = {"Linux": "manylinux", "Darwin": "macosx", "Windows": "win"}[known.system]
    for wheel in package["wheels"]:
        filename = wheel["url"].rpartition("/")[2]
        tags = filename[: -len(".whl")].split("-")[-1].split(".")
        if any(tag.startswith(kind) and tag.endswith("_" + known.machine.lower()) for tag in tags):
            return Wheel(package["version"], filename, wheel["hash"].partition(":")[2])
    raise Stop("install", f"uv.lock names no uv for {known.system} {known.machine}.", "git checkout uv.lock")


def found_uv() -> Optional[str]:
    """A uv on PATH that is recent enough."""
    uv = shutil.which("uv")
    if not uv:
        return None
    try:
        text = subprocess.run([uv, "--version"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=30).stdout
    except (OSError, subprocess.SubprocessError):
        return None
    version = re.search(rb"^uv (\d+)\.(\d+)", text)
    return uv if version and tuple(int(n) for n in version.groups()) >= OLDEST_UV else None


def private_uv(wheel: Wheel, index: Index) -> str:
    """Install uv into .uv/ from its wheel, fetched from the index in force and checked by its hash."""
    name = "uv.exe" if os.name == "nt" else "uv"
    program = places.PRIVATE / f"uv-{wheel.version}" / name
    if program.exists():
        return str(program)
    places.PRIVATE.mkdir(exist_ok=True)
    archive = places.PRIVATE / wheel.filename
    if not (archive.exists() and sha256(archive) == wheel.sha256):
        say(f"Fetching uv {wheel.version} from {without_secret(index.url)}")
        fetch(wheel, archive, index)
    program.parent.mkdir(exist_ok=True)
    part = program.parent / (name + ".part")
    with zipfile.ZipFile(str(archive)) as files, open(str(part), "wb") as target:
        inside = next(n for n in files.namelist() if n.endswith("/scripts/" + name))
        shutil.copyfileobj(files.open(inside), target)
    os.chmod(str(part), 0o755)
    os.replace(str(part), str(program))
    archive.unlink()
    return str(program)


def fetch(wheel: Wheel, target: Path, index: Index) -> None:
    """Fetch a wheel: from a folder of wheels, the index, or an extra one; the first that has it.

    Raises
    ------
    Stop
        If no index can be reached, none has the file, or its bytes are not the ones of uv.lock.
    """
    for folder in index.find_links:
        copy = Path(folder) / wheel.filename
        if copy.is_file() and sha256(copy) == wheel.sha256:
            shutil.copyfile(str(copy), str(target))
            return
    trouble = None  # type: Any
    for place in () if index.no_index else (index.url,) + index.extra:
        page_url = place.rstrip("/") + "/uv/"
        try:
            accept = "application/vnd.pypi.simple.v1+json, text/html;q=0.5"
            with open_url(page_url, index, Accept=accept) as answer:
                page, page_url = answer.read().decode("utf-8"), answer.geturl()
        except urllib.error.HTTPError as error:
            trouble = trouble if error.code == 404 else error
            continue
        except (OSError, http.client.HTTPException) as error:
            trouble = error
            continue
        link = link_to(wheel.filename, page, page_url)
        if link:
            download(link, target, wheel.sha256, index)
            return
    if trouble:
        raise unreachable(index, trouble)
    raise Stop(
        "content",
        f"The package index {without_secret(index.url)} does not hold {wheel.filename}: ask its keeper for it, or name "
        "another index.",
        with_variable("UV_DEFAULT_INDEX", PYPI),
    )


def download(url: str, target: Path, expected: str, index: Index) -> None:
    """Download to `target`, resuming what an earlier run left, and only ever leaving a whole and right file there."""
    part = target.with_name(target.name + ".part")
    trouble = OSError("no answer")  # type: Any
    for attempt in range(4):
        if attempt:
            time.sleep(attempt)
        have = part.stat().st_size if part.exists() else 0
        try:
            with open_url(url, index, **({"Range": f"bytes={have}-"} if have else {})) as answer:
                resumed = answer.status == 206 and have > 0
                with open(str(part), "ab" if resumed else "wb") as file:
                    shutil.copyfileobj(answer, file, 1 << 20)
            if sha256(part) == expected:
                os.replace(str(part), str(target))
                return
            length = answer.headers.get("Content-Length")
            if not length or part.stat().st_size >= int(length) + (have if resumed else 0):
                part.unlink()  # whole, and wrong: perhaps another file was resumed, so once more from its beginning
                trouble = None
                if not resumed:
                    break
        except urllib.error.HTTPError as error:
            trouble = error
            part.unlink() if error.code == 416 else None
        except (http.client.HTTPException, urllib.error.URLError, ConnectionError, TimeoutError) as error:
            trouble = error
    if trouble is not None:
        raise unreachable(index, trouble)
    raise Stop(
        "content",
        f"{without_secret(url)} is not the file that uv.lock names (its sha256 differs): the index, or "
        "something on the way, changed it.",
        with_variable("UV_DEFAULT_INDEX", PYPI),
    )


def sha256(path: Path) -> str:
    with open(str(path), "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()  # here the Python is one that the course can use
