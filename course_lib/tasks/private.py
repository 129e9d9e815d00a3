"""An instructor's own tasks: they stand beside the course, in a folder of theirs, and are graded like all others.

The folder holds, for a lab of the course, `lab_03.py` with `TASKS` whose ids go on where the course's stop (03-7, …),
and `lab_03_cells.py` with their text and cells as in solutions/source. Which folder counts stands in the environment,
so that the processes that grade know it, too. What students get names these tasks and does not hold them (`LISTED`).
"""

from __future__ import annotations

import importlib.util
import json
import os
from functools import lru_cache
from pathlib import Path

from course_lib.tasks.core import Task

__all__ = ["FOLDER", "LISTED", "listed", "private_folder", "private_tasks"]

FOLDER = "COURSE_PRIVATE_TASKS"
LISTED = Path(__file__).with_name("private.json")
"""In a release: the private tasks by id, each with its label, its function and its points."""


def private_folder() -> Path | None:
    """The folder of private tasks, None where there is none."""
    name = os.environ.get(FOLDER, "")
    return Path(name) if name else None


def private_tasks(lab: str) -> tuple[Task, ...]:
    """The private tasks of a lab, in order; none where no folder is named or it has none for this lab.

    Raises
    ------
    ValueError
        If the folder is gone, or its module cannot be read or holds no TASKS.
    """
    folder = private_folder()
    if folder is None:
        return ()
    if not folder.is_dir():
        raise ValueError(f"the folder of private tasks {folder} is not there.")
    path = folder / f"lab_{lab}.py"
    return _read(path, path.stat().st_mtime_ns) if path.is_file() else ()


@lru_cache(maxsize=32)
def _read(path: Path, _changed: int) -> tuple[Task, ...]:
    spec = importlib.util.spec_from_file_location(f"private_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise ValueError(f"{path.name} of the private tasks raised {type(error).__name__}: {error}.") from error
    found = getattr(module, "TASKS", None)
    if not isinstance(found, tuple) or not found or not all(isinstance(task, Task) for task in found):
        raise ValueError(f"{path.name} of the private tasks must define TASKS, a tuple of Task.")
    return found


def listed() -> dict[str, dict]:
    """The private tasks that a release names: id to label, function, points."""
    return json.loads(LISTED.read_text(encoding="utf-8")) if LISTED.is_file() else {}
