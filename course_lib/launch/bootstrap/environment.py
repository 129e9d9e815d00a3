"""The environment: made exactly what uv.lock says, and known again by its stamp."""

import contextlib
import hashlib
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Dict, Optional

from . import places
from .disk import check_disk
from .installer import run_uv
from .interpreter import PYTHONS
from .messages import say
from .package_index import Index, index_in_force
from .places import site_packages, venv_python
from .platform_facts import Facts
from .uv import found_uv, locked_uv, private_uv

SETUP_VERSION = 1  # raise it when a finished environment of an earlier launcher must be made anew


def stamp() -> Dict[str, Any]:
    """What the finished set-up wrote down; empty where there is none."""
    try:
        return json.loads((places.VENV / ".course.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def expected_stamp(python: str) -> Dict[str, Any]:
    return {
        "setup": SETUP_VERSION,
        "lock": hashlib.sha256(places.LOCK_FILE.read_bytes().replace(b"\r\n", b"\n")).hexdigest(),
        "python": python,
        "base": os.path.realpath(str(venv_python())),  # an upgraded system Python is another file
    }


def is_ready() -> bool:
    """Whether .venv is finished and is what uv.lock says. Reads three small files, starts nothing."""
    found = stamp()
    return venv_python().exists() and bool(found) and found == expected_stamp(found.get("python", ""))


def set_up(known: Facts, lock_handle: int) -> None:
    """Make .venv exactly what uv.lock says. Killed at any point, the next call completes it.

    Raises
    ------
    Stop
        With one sentence, where something outside is in the way.
    """
    check_disk()
    index = index_in_force(os.environ)
    began = time.monotonic()
    say(f"Setting up the course in {places.ROOT} (once; about 1.6 GB).")
    uv = found_uv() or private_uv(locked_uv(places.LOCK_FILE.read_text(encoding="utf-8"), known), index)
    unfinished = places.PRIVATE / "unfinished"
    anew = unfinished.exists() or _version_of(venv_python()) is None
    unfinished.write_text("A set-up began here and has not finished yet.\n", encoding="utf-8")
    with contextlib.suppress(FileNotFoundError):
        (places.VENV / ".course.json").unlink()
    if anew:
        base = os.path.realpath(getattr(sys, "_base_executable", None) or sys.executable)
        make = [uv, "venv", "--quiet", "--clear", "--relocatable", "--python", base, str(places.VENV)]
        run_uv(make, index, lock_handle)
    wanted = places.PRIVATE / "requirements.txt"
    export = [uv, "export", "--quiet", "--frozen", "--no-emit-project", "--format", "requirements.txt"]
    run_uv(export + ["--python", str(venv_python()), "--output-file", str(wanted)], index, lock_handle)
    install(uv, wanted, venv_python(), index, lock_handle)
    packages = site_packages()
    # One relative line, so that the folder may be moved or renamed.
    (packages / "course.pth").write_text(os.path.relpath(str(places.ROOT), str(packages)) + "\n", encoding="ascii")
    part = places.VENV / ".course.json.part"
    part.write_text(json.dumps(expected_stamp(_version_of(venv_python()) or "")), encoding="utf-8")
    os.replace(str(part), str(places.VENV / ".course.json"))
    unfinished.unlink()
    say(f"Set up in {time.monotonic() - began:.0f} s; from now on no network is needed.")


def install(uv: str, wanted: Path, python: Path, index: Index, lock_handle: int) -> None:
    """Bring an environment to exactly a list of hashed requirements, from the index in force.

    `uv sync` would take the addresses of files from uv.lock, whatever index an institution names.
    """
    words = [uv, "pip", "sync", "--require-hashes", "--only-binary", ":all:", "--python", str(python), str(wanted)]
    run_uv(words + (["--no-index"] if index.no_index else []), index, lock_handle)


def _version_of(python: Path) -> Optional[str]:
    """The version of an environment's Python if the course can use it; None where it does not run or is another."""
    try:
        ask = "import platform, sys; print(platform.python_version(), sys.prefix != sys.base_prefix)"
        run = subprocess.run(
            [str(python), "-I", "-c", ask], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=60
        )
    except (OSError, subprocess.SubprocessError):
        return None
    words = run.stdout.decode("ascii", "replace").split()
    if run.returncode or len(words) != 2 or words[1] != "True":
        return None
    return words[0] if PYTHONS[0] <= tuple(int(n) for n in re.findall(r"\d+", words[0])[:2]) <= PYTHONS[1] else None
