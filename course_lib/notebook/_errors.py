"""Refusals: one sentence that says what was wrong and what to do, shown in a notebook without a traceback."""

from __future__ import annotations

import difflib
import errno
import linecache
import os
import traceback
from collections.abc import Iterable
from pathlib import Path

ELSEWHERE = "choose another folder for the course's data with COURSE_CACHE=/path/to/folder"


class Refusal(ValueError):
    """Something that a person can mend. In a notebook it shows the line of the cell and the sentence, nothing else."""

    exit_code = 1
    """Of a command that ends with it."""

    def _render_traceback_(self) -> list[str]:
        """Say it as IPython prints it."""
        where = None
        for frame, number in traceback.walk_tb(self.__traceback__):
            filename = frame.f_code.co_filename
            if "ipykernel_" in filename or filename.startswith("<ipython-input"):
                where = (number, linecache.getline(filename, number).strip())
        lines = [f"line {where[0]}: {where[1]}"] if where and where[1] else []
        return [*lines, f"{type(self).__name__}: {self}"]


class DataMissing(Refusal):
    """A real dataset that nobody has fetched yet."""


class DataDamaged(Refusal):
    """A file whose bytes are not the ones that the catalogue or the manifest names."""


class CannotWrite(Refusal):
    """A folder that cannot be written, or a disk that is full."""


class NotHere(Refusal, AttributeError):
    """A dataset does not have this; `hasattr` is False."""


def nearest(word: str, known: Iterable[str]) -> str:
    """Say which known word is meant: " Did you mean X?", or "" where nothing is near."""
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f" Did you mean {close[0]}?" if close else ""


def shown(path: str | os.PathLike[str]) -> str:
    """Write a path as a person reads it: from the working folder where it lies below it."""
    path = Path(path)
    try:
        return path.resolve().relative_to(Path.cwd().resolve()).as_posix()
    except (ValueError, OSError):
        return str(path)


def cannot_write(path: Path, error: OSError) -> CannotWrite:
    """Turn the system's error into one sentence about what to do."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return CannotWrite(
            f"The disk is full: {shown(path)} was not written and nothing half-written stays; free some space, or "
            f"{ELSEWHERE}."
        )
    if error.errno in (errno.EROFS, errno.EACCES, errno.EPERM):
        return CannotWrite(f"{shown(path.parent)} may not be written here: save elsewhere, or {ELSEWHERE}.")
    if error.errno in (errno.ENOENT, errno.ENOTDIR, errno.EEXIST):
        return CannotWrite(f"{shown(path.parent)} is not a folder: make it first, or save elsewhere.")
    return CannotWrite(f"{shown(path)} could not be written ({error.strerror or error}): save elsewhere.")
