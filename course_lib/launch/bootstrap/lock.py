"""One set-up of a folder at a time."""

import contextlib
import errno
import os
import time
from typing import Iterator

from . import places
from .messages import say


@contextlib.contextmanager
def one_at_a_time() -> Iterator[int]:
    """Hold the lock of the set-up. The system lets go of it when the process dies, however it dies."""
    places.PRIVATE.mkdir(exist_ok=True)
    handle = os.open(str(places.PRIVATE / "lock"), os.O_RDWR | os.O_CREAT, 0o644)
    waited = False
    try:
        while not _try_lock(handle):
            if not waited:
                say("Another command is setting up this folder; waiting for it to finish.")
            waited = True
            time.sleep(0.2)
        yield handle
    finally:
        os.close(handle)


def _try_lock(handle: int) -> bool:
    try:
        if os.name == "nt":
            import msvcrt

            os.lseek(handle, 0, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        # A file system without locks (some network shares): better one set-up at a time by luck than none.
        return error.errno in (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)
    return True
