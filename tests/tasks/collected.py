"""All tasks of all labs, for the tests that hold for every one, and so for those to come."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

import pytest
import task_proofs as proofs

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.tasks.core import Task


def _collect() -> tuple[dict[str, str], list[Task]]:
    """What is wrong with each lab's module ("" if nothing), and all tasks of those that can be imported."""
    problems: dict[str, str] = {}
    found: list[Task] = []
    for number in tasks.lab_numbers():
        try:
            found += tasks.lab(number)
            problems[number] = ""
        except Exception as error:  # shown by test_lab_is_sound; the other labs' tests still run
            problems[number] = f"{type(error).__name__}: {error}"
    return problems, found


PROBLEMS, TASKS = _collect()
each_task = pytest.mark.parametrize("task", TASKS, ids=[task.id for task in TASKS])


def loader(task: Task) -> Any:
    """The way to a task's real data; skips the test, with the reason, where they are not here."""
    if not task.data:
        return None
    data = importlib.import_module("course_lib.notebook.data")
    missing = [name for name in task.data if not data.available(name)]
    if missing:
        pytest.skip(f"real data not here: {', '.join(missing)} (python3 course.py data get {' '.join(missing)})")
    return data.load


def reference(task: Task) -> Callable[..., Any]:
    return proofs.defined(solutions.reference(task.id), task.function, solutions.preamble(task.lab))
