"""A lab as it was released: the frame into which answers are put, and what each of its tasks wants."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from course_lib import tasks
from course_lib.authoring import notebooks as nbs
from course_lib.authoring.tree import CourseError, course_tree

from .private import with_private_cells

__all__ = ["ReleasedLab", "Slot", "lab_of_cells", "released_lab"]


@dataclass(frozen=True)
class Slot:
    """The place of one answer.

    Parameters
    ----------
    task : its definition.
    cell : the id of its cell.
    stub : the source of that cell as released.
    """

    task: tasks.Task
    cell: str
    stub: str

    @property
    def function(self) -> str:
        """The name of the function that is wanted."""
        return self.task.function


@dataclass(frozen=True)
class ReleasedLab:
    """A lab as learners got it.

    Parameters
    ----------
    number, name : "03", "03_depth_to_points".
    cells : id to source of every code cell as released.
    given : ids of the code cells that stand outside tasks and are run before the answers, in order.
    slots : one a task, in order.
    texts : sources of every text cell as released.
    version : of cells, tasks and points; another version may grade differently.
    """

    number: str
    name: str
    cells: dict[str, str]
    given: tuple[str, ...]
    slots: tuple[Slot, ...]
    texts: frozenset[str]
    version: str

    @property
    def points(self) -> float:
        """What the lab is worth."""
        return sum(slot.task.points for slot in self.slots)


def released_lab(number: str, root: Path | None = None) -> ReleasedLab:
    """The lab of a number, from exercises/ and the tasks' definitions.

    Raises
    ------
    CourseError
        If there is no such lab, or a task of it has no cell.
    """
    tree_root = root or course_tree().root
    found = sorted((tree_root / "exercises").glob(f"{number}_*.ipynb"))
    if len(found) != 1 or number not in tasks.lab_numbers():
        raise CourseError(f"there is no lab {number!r} to grade; there are {', '.join(tasks.lab_numbers())}.")
    return _read(found[0], tasks.lab(number), found[0].stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _read(path: Path, wanted: tuple[tasks.Task, ...], _changed: int) -> ReleasedLab:
    """A lab with its tasks; an instructor's own among them bring cells of their own."""
    cells, given, stubs, texts = {}, [], {}, set()
    number = 0
    for cell in with_private_cells(path.stem[:2], nbs.read_notebook(path)).cells:
        if cell.cell_type == "markdown":
            heading = nbs.task_heading(cell.source)
            number = heading.number if heading else number
            texts.add(cell.source.strip())
            continue
        cells[cell.id] = cell.source
        tags = set(nbs.cell_tags(cell))
        if "task" in tags:
            stubs[number] = (cell.id, cell.source)
        elif not tags & {"check", "expected", "real-data"}:
            given.append(cell.id)
    missing = [task.label for task in wanted if task.number not in stubs]
    if missing:
        raise CourseError(f"{path.name} has no cell for {missing[0]}: build it again with `course.py build`.")
    slots = tuple(Slot(task, *stubs[task.number]) for task in wanted)
    said = [list(cells.items()), [[task.id, task.version, task.points, task.signature] for task in wanted]]
    version = hashlib.sha256(json.dumps(said).encode()).hexdigest()[:12]
    return ReleasedLab(path.stem[:2], path.stem, cells, tuple(given), slots, frozenset(texts), version)


def lab_of_cells(sources: list[str]) -> str:
    """The lab whose functions a notebook's code defines most of; "" where none or two fit."""
    text = "\n".join(sources)
    found = []
    for number in tasks.lab_numbers():
        checks = sum(f'check("{task.id}"' in text or f"check('{task.id}'" in text for task in tasks.lab(number))
        names = sum(f"def {task.function}(" in text for task in tasks.lab(number) if task.kind != "explain")
        found.append((3 * checks + names, number))
    found.sort(reverse=True)
    return found[0][1] if found and found[0][0] > (found[1][0] if len(found) > 1 else 0) else ""
