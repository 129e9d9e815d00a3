"""What a disk refuses, in one sentence that names the disk; what was written before stays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from course_lib.authoring.tree import CourseError

__all__ = ["DiskTrouble", "disk_told"]


class DiskTrouble(CourseError):
    """A disk that is full, read-only or broken."""

    exit_code = 2

    def __init__(self, path: Path, why: str) -> None:
        mounts = ["/", *(one.mountpoint for one in psutil.disk_partitions(all=True))]
        disk = max((mount for mount in mounts if path.resolve().is_relative_to(mount)), key=len)
        super().__init__(
            f"{path} cannot be written ({why}), which lies on the disk {disk}: mend that or name another folder, and "
            "run the same command again; what was graded before is kept."
        )


@contextmanager
def disk_told(path: Path) -> Iterator[None]:
    """Turn what the system says when a path is written into that sentence.

    Raises
    ------
    DiskTrouble
        For every OSError within.
    """
    try:
        yield
    except OSError as error:
        raise DiskTrouble(path, (error.strerror or str(error)).lower()) from error
