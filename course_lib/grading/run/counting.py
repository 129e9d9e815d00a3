"""What the processes of a kernel use, as Linux counts it: never by a text that they could have written.

Where a control group (cgroup v2) can be made, it holds them, so that nothing they do escapes it; elsewhere each process
has its limits (`kernel_imports.rlimits`), and all of them are looked at together.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import psutil

from .limits import Limits

__all__ = ["Group", "Spent", "Used", "new_group", "spent", "used_by"]

PATIENCE = 3
"""A second of waiting counts as so much less than one of computing: it may be a neighbour who computes."""
BUFFER = 212_992
"""Bytes that a socket may hold where nobody raised it (inside, nobody can, see kernel_main.py)."""
GROUPS = Path("/sys/fs/cgroup")
FAMILY = ("memory", "pids")
"""What a control group must count to be of use; where it shares out processors as well, the better."""


@dataclass(frozen=True)
class Spent:
    """Seconds of processor that were used, and the time of day; both matter by their differences."""

    processor: float
    clock: float


def spent(since: Spent, now: Spent) -> float:
    """Seconds that count: of computing, or a part of those that were waited, where these are more."""
    return max(now.processor - since.processor, (now.clock - since.clock) / PATIENCE)


@dataclass
class Used:
    """What a family of processes uses: bytes, counts, seconds of processor."""

    memory: int = 0
    processes: int = 0
    threads: int = 0
    processor: float = 0.0


def used_by(family: Iterable[psutil.Process]) -> Used:
    """Count a family: what its processes hold in memory and may hold in sockets, and what their children have used."""
    used = Used()
    for one in family:
        with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied, ProcessLookupError, FileNotFoundError):
            used.processes += 1
            used.memory += one.memory_info().rss + BUFFER * _entries(one, "fd")
            used.threads += _entries(one, "task")
            used.processor += sum(one.cpu_times()[:4])
    return used


def _entries(one: psutil.Process, what: str) -> int:
    """How many open files (fd) or threads (task) a process has; /proc/PID/status holds a name that it chose."""
    try:
        return len(os.listdir(f"/proc/{one.pid}/{what}"))
    except FileNotFoundError:
        if os.path.isdir(f"/proc/{os.getpid()}"):
            raise
        return one.num_threads() if what == "task" else 0  # not Linux: then nothing is held, either


class Group:
    """A control group for one kernel.

    Parameters
    ----------
    folder : of the group, just made.
    """

    def __init__(self, folder: Path, limits: Limits) -> None:
        self.folder = folder
        wanted = {"memory.max": int(limits.memory_mb * 1e6), "memory.swap.max": 0, "memory.oom.group": 1}
        for name, value in {**wanted, "pids.max": int(limits.threads)}.items():
            with contextlib.suppress(FileNotFoundError):  # a machine without swap has no limit for it
                (folder / name).write_text(str(value))

    def entered(self, words: Sequence[str]) -> list[str]:
        """A command that runs another in the group."""
        return ["/bin/sh", "-c", 'echo 0 > "$0/cgroup.procs" && exec "$@"', str(self.folder), *words]

    def killed(self) -> bool:
        """Whether Linux ended it because of its memory."""
        return _told(self.folder / "memory.events").get("oom_kill", 0) > 0

    def used(self) -> Used:
        """What its processes use together, those that have ended included."""
        seconds = _told(self.folder / "cpu.stat").get("usage_usec", 0) / 1e6
        threads = int((self.folder / "pids.current").read_text())
        return Used(int((self.folder / "memory.current").read_text()), 0, threads, seconds)

    def remove(self) -> None:
        """End whatever is left in it, and the group."""
        with contextlib.suppress(OSError):
            (self.folder / "cgroup.kill").write_text("1")
        for _ in range(100):
            with contextlib.suppress(OSError):
                self.folder.rmdir()
            if not self.folder.exists():
                return
            time.sleep(0.01)


def _told(path: Path) -> dict[str, int]:
    """A file of lines such as `oom_kill 0`."""
    return {name: int(value) for name, value in (line.split() for line in path.read_text().splitlines())}


def new_group(limits: Limits) -> Group | None:
    """A control group of its own for a kernel, or None where this user can make none that counts."""
    above = _above()
    if above is None:
        return None
    folder = above / f"course-{os.getpid()}-{secrets.token_hex(4)}"
    folder.mkdir()
    return Group(folder, limits)


@lru_cache(maxsize=1)
def _above() -> Path | None:
    """The control group below which groups that count can be made: this process's own, or the one above it."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            if line.startswith("0::/"):
                own = GROUPS / line[4:]
                for above in (own, own.parent) if own != GROUPS else (own,):
                    if _counts(above):
                        return above
    return None


def _counts(above: Path) -> bool:
    """Whether a group made there counts memory and processes, and a process can be moved into it."""
    trial = above / f"course-{os.getpid()}-trial"
    try:
        trial.mkdir()
    except OSError:
        return False
    try:
        known = (trial / "cgroup.controllers").read_text().split()
        return set(FAMILY) <= set(known) and os.access(above / "cgroup.procs", os.W_OK)
    except OSError:
        return False
    finally:
        trial.rmdir()
