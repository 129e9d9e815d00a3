"""Tasks as they were before a lab asked for more: answers that people wrote to them go on being measured.

A module for each lab, `lab_05.py`, with `FORMS`: pairs of an old task, under its id, and the source of its solution.
"""

from __future__ import annotations

import importlib
from pathlib import Path

from course_lib.tasks.core import Task

OLD: dict[str, Task] = {}
SOLUTIONS: dict[str, str] = {}
for _path in sorted(Path(__file__).parent.glob("lab_*.py")):
    for _task, _solution in importlib.import_module(f"{__name__}.{_path.stem}").FORMS:
        OLD[_task.id], SOLUTIONS[_task.id] = _task, _solution
