"""Whether there is room for what is to be installed."""

import os
import shutil
from pathlib import Path

from . import places
from .messages import Stop, quoted, with_variable
from .places import cache_folder, existing

BYTES_NEEDED = 2_500_000_000  # measured: 1.6 GB in .venv, and what is in flight


def check_disk(needed: int = BYTES_NEEDED) -> None:
    """Refuse to begin what will not fit."""
    for place in (places.ROOT, existing(cache_folder(os.environ))):
        free = shutil.disk_usage(str(place)).free
        if free < needed:
            raise disk_full(place, free, needed)


def disk_full(place: Path, free: int, needed: int = BYTES_NEEDED) -> Stop:
    """The sentence for a full disk; it names the folder."""
    sentence = f"The disk of {place} has {free / 1e9:.1f} GB free, and the installation needs {needed / 1e9:.1f} GB: "
    sentence += "make room, or "
    if place == places.ROOT:
        move = quoted(["mv" if os.name != "nt" else "move", str(places.ROOT), "/another/disk/"])
        return Stop("disk", sentence + "move the course.", move)
    return Stop("disk", sentence + "put uv's cache elsewhere.", with_variable("UV_CACHE_DIR", "/another/disk/uv-cache"))
