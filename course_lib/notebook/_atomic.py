"""Writing so that a file or folder is either whole or not there: into a temporary one beside it, then renamed.

What several processes may write at once is written under a file lock.
"""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import AcquireReturnProxy, FileLock, Timeout

from course_lib.notebook._errors import ELSEWHERE, CannotWrite, cannot_write, shown

MARGIN_BYTES = 1_000_000
"""Left free on the disk beside what is written: folders and manifests take some too."""


def need_space(folder: Path, n_bytes: int) -> None:
    """Refuse before writing where the disk of a folder has less than this many bytes free.

    Raises
    ------
    CannotWrite
        One sentence with both sizes in MB.
    """
    if not n_bytes:
        return
    free = shutil.disk_usage(folder).free
    if free < n_bytes + MARGIN_BYTES:
        raise CannotWrite(
            f"The disk of {shown(folder)} has {free / 1e6:.0f} MB free and {(n_bytes + MARGIN_BYTES) / 1e6:.0f} MB are "
            f"needed: free some space, or {ELSEWHERE}."
        )


@contextmanager
def atomic_file(path: Path, n_bytes: int = 0) -> Iterator[Path]:
    """Give a temporary path beside `path` to write to; rename it into place if the block succeeds.

    Whatever goes wrong in the block, Ctrl-C included, the temporary file goes and an older `path` stays as it was.

    Parameters
    ----------
    path : where the file shall be; its folder must exist.
    n_bytes : about how large it will be, to refuse a full disk beforehand; 0 where that is not known.

    Raises
    ------
    CannotWrite
        If the folder is missing or read-only, or the disk is full.
    """
    path = Path(path)
    partial = path.with_name(f".{path.stem[:40]}-{secrets.token_hex(4)}.part{path.suffix}")
    try:
        need_space(path.parent, n_bytes)
        partial.touch(exist_ok=False)
    except OSError as error:
        raise cannot_write(path, error) from error
    try:
        yield partial
        os.replace(partial, path)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: Path, n_bytes: int = 0) -> Iterator[Path]:
    """Give an empty folder beside `path` to fill; put it in the place of `path` if the block succeeds.

    The temporary name is always the same, so that what a killed process left is cleared away by the next; callers hold
    a lock.

    Raises
    ------
    CannotWrite
        If the place is read-only or the disk is full.
    """
    path = Path(path)
    partial, old = (path.with_name(f".{path.name}.{word}") for word in ("part", "old"))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for leftover in (partial, old):
            shutil.rmtree(leftover, ignore_errors=True)
        need_space(path.parent, n_bytes)
        partial.mkdir()
        yield partial
        if path.exists():
            os.replace(path, old)
        os.replace(partial, path)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def locked(path: Path, waiting: str, say: Callable[[str], None]) -> AcquireReturnProxy:
    """Take a file lock, which a `with` block releases; say what it waits for where another process holds it.

    Raises
    ------
    CannotWrite
        If the folder is missing or read-only.
    """
    lock = FileLock(path)
    try:
        return lock.acquire(timeout=0.2)
    except Timeout:
        say(waiting)
        return lock.acquire()
    except OSError as error:
        raise cannot_write(path, error) from error
