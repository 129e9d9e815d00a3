"""The registry of tasks: each lab is a package of `course_lib.tasks.labs` whose module `tasks` holds `TASKS`."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from pathlib import Path

import numpy as np

from course_lib.tasks import labs
from course_lib.tasks.core import Task
from course_lib.tasks.private import private_tasks

__all__ = ["all_tasks", "get", "lab", "lab_numbers"]


def lab_numbers() -> tuple[str, ...]:
    """The labs that have tasks: ("00", "01", …)."""
    return tuple(sorted(_folders()))


def _folders() -> dict[str, str]:
    """The package of each lab, by its number: {"03": "lab_03_depth_to_points"}."""
    return {m.name[4:6]: m.name for m in pkgutil.iter_modules(labs.__path__) if m.name.startswith("lab_")}


def folder(number: str) -> Path:
    """The folder of a lab's package."""
    return Path(next(iter(labs.__path__))) / _folders()[number]


def pictures_file(number: str) -> Path:
    """Where the arrays lie that a lab's pictures are drawn from."""
    return folder(number) / "pictures.npz"


def pictures(number: str) -> dict[str, np.ndarray]:
    """The arrays that a lab's pictures are drawn from, by name; none where there is no such lab or file."""
    if number not in lab_numbers() or not pictures_file(number).is_file():
        return {}
    with np.load(pictures_file(number), allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def lab(number: str) -> tuple[Task, ...]:
    """The tasks of a lab, in order; an instructor's own tasks after the course's (see `private`).

    Raises
    ------
    ValueError
        If there is no such lab, or its package holds tasks that are not its own.
    """
    if number not in lab_numbers():
        raise ValueError(f"there is no lab {number!r}; there are {', '.join(lab_numbers())}.")
    package = _folders()[number]
    tasks = importlib.import_module(f"{labs.__name__}.{package}.tasks").TASKS + private_tasks(number)
    if [task.id for task in tasks] != [f"{number}-{count}" for count in range(1, len(tasks) + 1)]:
        raise ValueError(f"{package}: its tasks must be numbered {number}-1, {number}-2, … in order.")
    return tasks


def get(task_id: str) -> Task:
    """The task of an id such as "03-2".

    Raises
    ------
    ValueError
        If there is none; the nearest is suggested.
    """
    number = task_id[:2] if isinstance(task_id, str) else ""
    for task in lab(number) if number in lab_numbers() else ():
        if task.id == task_id:
            return task
    known = (
        [f"{n}-{count}" for n in lab_numbers() for count in range(1, 10)]
        if number not in lab_numbers()
        else [t.id for t in lab(number)]
    )
    near = difflib.get_close_matches(str(task_id), known, 1, 0.3)
    raise ValueError(f"there is no task {task_id!r}" + (f"; did you mean {near[0]!r}?" if near else "."))


def all_tasks() -> tuple[Task, ...]:
    """Every task of every lab."""
    return tuple(task for number in lab_numbers() for task in lab(number))
