"""What `course test` adds to pytest: kernels that cannot meet each other, and what each part of the course cost."""

from __future__ import annotations

import re
import sys
import uuid
from collections import Counter
from pathlib import Path
from typing import Any

import nbval.kernel
import pytest
from jupyter_client.manager import KernelManager
from jupyter_core.paths import jupyter_runtime_dir

from course_lib.tasks.registry import lab_numbers

WIDTH = 44


class PrivateKernel(KernelManager):
    """A kernel that is spoken to over files of its own: of two that start at once, both could take one free port."""

    def __init__(self, **named: Any) -> None:
        if sys.platform != "win32":
            folder = Path(jupyter_runtime_dir())
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            name = str(folder / uuid.uuid4().hex[:12])
            named = {"transport": "ipc", "connection_file": f"{name}.json", "ip": name, **named}
        super().__init__(**named)


def part_of(nodeid: str) -> str:
    """The part of the course that a test proves, by its name: a lesson, its lab, or a room of the library.

    Examples
    --------
    >>> part_of("notebooks/07_icp.ipynb::Cell 3"), part_of("tests/tasks/test_every_task.py::test_x[07-5-a]")
    ('lesson 07', 'lab 07')
    >>> part_of("tests/cloud/test_normals.py::test_x[12-3]")
    'cloud'
    """
    path, _, name = nodeid.partition("::")
    stored = re.search(r"\b(notebooks|solutions)/(\d\d)_\w+\.ipynb", f"{path} {name}")
    if stored:
        return f"{'lesson' if stored[1] == 'notebooks' else 'lab'} {stored[2]}"
    parts = Path(path).parts
    room = parts[parts.index("tests") + 1] if "tests" in parts[:-2] else parts[-1]
    lab = re.match(r"test_lab_(\d\d)", parts[-1]) or re.search(r"\[(\d\d)(?:-\d|_[a-z]|\])", name)
    return f"lab {lab[1]}" if lab and room in ("tasks", "grading", "notebooks") and lab[1] in lab_numbers() else room


def pytest_configure(config: pytest.Config) -> None:
    nbval.kernel.KernelManager = PrivateKernel


class _Cost:
    """Adds up what the workers report."""

    def __init__(self) -> None:
        self.seconds: Counter[str] = Counter()
        self.tests: Counter[str] = Counter()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        part = part_of(report.nodeid)
        self.seconds[part] += report.duration
        self.tests[part] += report.when == "call"

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        terminalreporter.write_line("")
        terminalreporter.write_line("what each part cost, in seconds of one worker:")
        for part in sorted(self.seconds):
            dots = "." * (WIDTH - len(part))
            terminalreporter.write_line(f"{part} {dots} {self.seconds[part]:6.1f} s, {self.tests[part]} tests")


def pytest_sessionstart(session: pytest.Session) -> None:
    if not hasattr(session.config, "workerinput"):
        session.config.pluginmanager.register(_Cost(), "course-cost")
