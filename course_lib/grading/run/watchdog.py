"""Looking at a kernel's processes from outside: their memory, their number, their files, their time."""

from __future__ import annotations

import contextlib
import time
from pathlib import Path
from typing import Protocol

import psutil

from .limits import Limits

__all__ = ["watch"]

TICK = 0.05
"""Seconds between two looks."""
SOCKETS = 8
"""A kernel makes five sockets; more entries in their folder are somebody's files."""


class Watched(Protocol):
    """What is asked of a kernel: `watched` while there is something to watch, `sockets` the folder of its sockets."""

    limits: Limits
    process: psutil.Process

    @property
    def watched(self) -> bool: ...

    @property
    def sockets(self) -> Path: ...

    def strike(self, code: str, sentence: str) -> None: ...


def watch(kernel: Watched, end: float) -> None:
    """Look until the kernel ends, and strike where a limit is passed.

    Parameters
    ----------
    end : when the time of the whole submission is up, by the monotonic clock.
    """
    me = psutil.Process()
    mine = me.memory_info().rss
    limits = kernel.limits
    while kernel.watched:
        time.sleep(TICK)
        try:
            family = [kernel.process, *kernel.process.children(recursive=True)]
            memory = threads = 0
            for one in family:
                with contextlib.suppress(psutil.NoSuchProcess, psutil.AccessDenied):
                    memory += one.memory_info().rss
                    threads += one.num_threads()
        except psutil.NoSuchProcess:
            return
        for code, much, most, words in (
            ("memory", memory / 1e6, limits.memory_mb, "memory_mb"),
            ("processes", len(family) - 2, limits.processes, "processes"),
            ("processes", threads, limits.threads, "threads"),
            ("output", (me.memory_info().rss - mine) / 1e6, limits.runner_mb, "runner_mb"),
        ):
            if much > most:
                kernel.strike(code, f"It used more {code} than allowed ({words} = {most:g}).")
                return
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has just ended
            if _crowded(kernel):
                kernel.strike("files", "It wrote files where only the kernel's sockets belong.")
                return
        if time.monotonic() > end:
            kernel.strike(
                "timeout", f"Time for the whole submission was up (total_seconds = {limits.total_seconds:g})."
            )
            return


def _crowded(kernel: Watched) -> bool:
    """Whether more than sockets lie in their folder, or nobody may look there any more."""
    try:
        return sum(1 for _ in kernel.sockets.iterdir()) > SOCKETS
    except PermissionError:
        return True
