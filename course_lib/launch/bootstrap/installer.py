"""Running uv with the settings in force, and saying in one sentence why it failed."""

import os
import re
import shutil
import subprocess
import sys
import urllib.request
from typing import Dict, List, Mapping

from . import places
from .disk import disk_full
from .messages import Stop, say, with_variable
from .package_index import PYPI, Index, not_answering, unreachable, without_secret
from .places import cache_folder, existing


def uv_environment(index: Index) -> Dict[str, str]:
    """The environment for uv: the index in force, and nothing that would change what is installed or where."""
    drop = """VIRTUAL_ENV CONDA_PREFIX PYTHONPATH PYTHONHOME UV_PROJECT UV_PROJECT_ENVIRONMENT UV_WORKING_DIRECTORY
        UV_PYTHON UV_SYSTEM_PYTHON UV_FROZEN UV_EXCLUDE_NEWER UV_CONSTRAINT UV_OVERRIDE UV_NO_BINARY UV_ONLY_BINARY
        UV_VENV_SEED UV_TORCH_BACKEND UV_INDEX_URL UV_EXTRA_INDEX_URL"""
    environment = {key: value for key, value in os.environ.items() if key not in drop.split()}
    if index.url != PYPI:
        environment["UV_DEFAULT_INDEX"] = index.url
    if index.extra:
        environment["UV_INDEX"] = " ".join(index.extra)
        environment.setdefault("UV_INDEX_STRATEGY", "unsafe-best-match")  # every file is pinned by its hash
    environment["UV_FIND_LINKS"] = ",".join(index.find_links)
    if index.trusted:
        environment["UV_INSECURE_HOST"] = " ".join(index.trusted)
    if index.certificates:
        environment.setdefault(
            "SSL_CERT_DIR" if os.path.isdir(index.certificates) else "SSL_CERT_FILE", index.certificates
        )
    if index.proxy and not urllib.request.getproxies():
        environment["ALL_PROXY"] = index.proxy
    environment.setdefault("UV_HTTP_TIMEOUT", "120")
    environment["UV_PYTHON_DOWNLOADS"] = "never"
    if not os.access(str(existing(cache_folder(environment))), os.W_OK):
        environment["UV_CACHE_DIR"] = str(places.PRIVATE / "cache")
    if existing(cache_folder(environment)).stat().st_dev != places.ROOT.stat().st_dev:
        environment.setdefault("UV_LINK_MODE", "copy")  # files cannot be linked from another disk
    return environment


def run_uv(words: List[str], index: Index, lock_handle: int) -> None:
    """Run uv: its own progress on a terminal, quiet otherwise; its failure becomes one sentence.

    The child inherits the lock, so that a uv that outlives a killed launcher is waited for by the next one.
    """
    environment = uv_environment(index)
    options = {"env": environment, "cwd": str(places.ROOT), "stdin": subprocess.DEVNULL}  # type: Dict[str, Any]
    if os.name != "nt":
        options["pass_fds"] = (lock_handle,)
    log = places.PRIVATE / "uv.log"
    if sys.stderr.isatty():
        code, said = subprocess.call(words, **options), ""
    else:
        with open(str(log), "wb") as file:
            code = subprocess.call(words, stdout=file, stderr=subprocess.STDOUT, **options)
        said = log.read_text(encoding="utf-8", errors="replace")
    if code:
        raise why_uv_failed(said, code, index, environment)


def why_uv_failed(said: str, code: int, index: Index, environment: Mapping[str, str]) -> Stop:
    """Find the cause of a failed uv among those that have a sentence of their own."""
    folders = [folder for folder in (places.ROOT, cache_folder(environment)) if folder.exists()]
    free, folder = min((shutil.disk_usage(str(folder)).free, folder) for folder in folders)
    if free < 100_000_000 or "No space left" in said or "os error 112" in said:
        return disk_full(folder, free)
    if re.search(r"hash mismatch", said, re.I):
        return Stop(
            "content",
            f"The package index {without_secret(index.url)} serves a file with another hash than uv.lock's.",
            with_variable("UV_DEFAULT_INDEX", PYPI),
        )
    error = None if index.no_index else not_answering(index)
    if error and getattr(error, "code", None) != 404:
        return unreachable(index, error)
    lines = [line.strip() for line in said.splitlines() if line.strip()][-12:]
    if lines:
        say("\n".join("  uv: " + line for line in lines))
    return Stop(
        "install",
        f"uv could not install the packages (its exit code is {code}, its words stand above): run it again, and if it "
        "stays, ask with the text of",
        "python3 course.py doctor",
    )
