"""Where the set-up lies: the course, its environment, the private uv, and uv's cache."""

import os
from pathlib import Path
from typing import Mapping

ROOT = Path(__file__).resolve().parents[3]
VENV = ROOT / ".venv"
PRIVATE = ROOT / ".uv"  # the private uv, the lock, logs: everything of the set-up that is not the environment itself
LOCK_FILE = ROOT / "uv.lock"


def venv_python() -> Path:
    return VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def site_packages() -> Path:
    return VENV / "Lib/site-packages" if os.name == "nt" else next((VENV / "lib").glob("python3.*/site-packages"))


def cache_folder(environment: Mapping[str, str]) -> Path:
    """Where uv keeps what it has downloaded."""
    if environment.get("UV_CACHE_DIR"):
        return Path(environment["UV_CACHE_DIR"]).absolute()
    if os.name == "nt":
        return Path(environment.get("LOCALAPPDATA") or str(ROOT)) / "uv/cache"
    return Path(environment.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")).absolute() / "uv"


def existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that is there."""
    return folder if folder.exists() else existing(folder.parent)
