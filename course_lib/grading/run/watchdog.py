"""Looking at a kernel's processes from outside: their memory, their number, their files, their time."""

from __future__ import annotations

import os
import time
from typing import Protocol

import psutil

from .counting import Group, used_by
from .limits import Limits

__all__ = ["watch"]

TICK = 0.05
"""Seconds between two looks."""
SOCKETS = 8
"""A kernel makes five sockets; more entries in their folder are somebody's files."""


class Watched(Protocol):
    """What is asked of a kernel: `watched` while there is something to watch, `sockets` the open folder of its sockets.

    `seconds` is what it may take in all, `age` what it has taken; `processor` is told here: seconds of computing.
    """

    limits: Limits
    process: psutil.Process
    group: Group | None
    sockets: int
    seconds: float
    processor: float

    @property
    def watched(self) -> bool: ...

    def age(self) -> float: ...

    def strike(self, code: str, sentence: str) -> None: ...


def watch(kernel: Watched) -> None:
    """Look until the kernel ends, and strike where a limit is passed."""
    me = psutil.Process()
    mine = me.memory_info().rss
    limits = kernel.limits
    while kernel.watched:
        time.sleep(TICK)
        try:
            family = [kernel.process, *kernel.process.children(recursive=True)]
            used = used_by(family)
            counted = kernel.group.used() if kernel.group is not None else used
            crowded = len(os.listdir(kernel.sockets)) > SOCKETS
        except (psutil.NoSuchProcess, OSError):  # it has just ended
            return
        kernel.processor = max(kernel.processor, counted.processor)
        for code, much, most, words in (
            ("memory", max(used.memory, counted.memory) / 1e6, limits.memory_mb, "memory_mb"),
            ("processes", used.processes - 2, limits.processes, "processes"),
            ("processes", max(used.threads, counted.threads), limits.threads, "threads"),
            ("output", (me.memory_info().rss - mine) / 1e6, limits.runner_mb, "runner_mb"),
        ):
            if much > most:
                kernel.strike(code, f"It used more {code} than allowed ({words} = {most:g}).")
                return
        if crowded:
            kernel.strike("files", "It wrote files where only the kernel's sockets belong.")
            return
        if kernel.age() > kernel.seconds:
            kernel.strike(
                "timeout", f"Time for the whole submission was up (total_seconds = {limits.total_seconds:g})."
            )
            return
