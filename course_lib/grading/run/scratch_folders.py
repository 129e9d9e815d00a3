"""The one folder below which a grader makes everything that it throws away again."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path

import psutil

__all__ = ["private_folder"]

PREFIX = "cg"


@lru_cache(maxsize=1)
def private_folder() -> Path:
    """This grader's own folder: short, for sockets; removed at its end, and by the next grader if it was killed."""
    base = Path(tempfile.gettempdir())
    for old in base.glob(f"{PREFIX}-*-*"):
        number = old.name.split("-")[1]
        if number.isdigit() and not psutil.pid_exists(int(number)) and _is_mine(old):
            shutil.rmtree(old, ignore_errors=True)
    folder = Path(tempfile.mkdtemp(prefix=f"{PREFIX}-{os.getpid()}-", dir=base))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _is_mine(folder: Path) -> bool:
    """Whether a folder is this user's; False for one that another grader has just removed."""
    try:
        return folder.stat().st_uid == os.getuid()
    except FileNotFoundError:
        return False
