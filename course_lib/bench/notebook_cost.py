"""`course bench --notebooks`: the seconds and the memory that a lesson takes in a fresh kernel."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

import psutil
from nbformat import NotebookNode

from course_lib.authoring import notebooks as nbs
from course_lib.authoring.kernels import execute
from course_lib.authoring.needed_data import prepare_data
from course_lib.authoring.tree import CourseError, Tree

MOST_SECONDS, MOST_BYTES = 30.0, 2_000_000_000


class _Memory(threading.Thread):
    """Watches the memory of all processes below this one (a kernel and its children) until told to stop."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.peak = 0
        self.done = threading.Event()

    def run(self) -> None:
        while not self.done.wait(0.05):
            total = 0
            for process in psutil.Process().children(recursive=True):
                with contextlib.suppress(psutil.NoSuchProcess):  # one that ends meanwhile counts nothing
                    total += process.memory_info().rss
            self.peak = max(self.peak, total)


def weigh(nb: NotebookNode, tree: Tree) -> tuple[float, int]:
    """Run a notebook in a fresh kernel.

    Returns
    -------
    Seconds from the kernel's start to its end, and the most bytes that it and its children held at once.
    """
    memory = _Memory()
    memory.start()
    started = time.perf_counter()
    try:
        execute(nb, tree.root)
    finally:
        memory.done.set()
        memory.join()
    return time.perf_counter() - started, memory.peak


def weigh_lessons(tree: Tree, only: str, say: Callable[[str], None]) -> int:
    """Run each lesson in a fresh kernel, its data made before, and print its seconds and its peak memory.

    Returns
    -------
    The exit code: 1 if a lesson is over 30 s or 2 GB.
    """
    lessons = [lesson for lesson in tree.lessons() if only in lesson.name]
    if not lessons:
        raise CourseError(f"no lesson has {only!r} in its name.")
    failed = 0
    for lesson in lessons:
        nb = nbs.read_source(lesson.path)
        prepare_data(nb)
        seconds, peak = weigh(nb, tree)
        passed = seconds <= MOST_SECONDS and peak <= MOST_BYTES
        failed += not passed
        say(f"{'PASS' if passed else 'FAIL'}  {seconds:5.1f} s  {peak / 1e9:4.2f} GB  {lesson.name}")
    say(f"bound: {MOST_SECONDS:g} s and {MOST_BYTES / 1e9:g} GB a lesson, in a fresh kernel, its data made before")
    return 1 if failed else 0
