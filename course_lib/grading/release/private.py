"""An instructor's own tasks in a lab: their cells for the release, and the copy that a folder of grades keeps."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

from nbformat import NotebookNode

from course_lib import tasks
from course_lib.authoring import notebooks as nbs
from course_lib.authoring import stubs
from course_lib.authoring.tree import CourseError
from course_lib.tasks.private import FOLDER, private_folder, private_tasks

__all__ = ["KEPT", "keep_private", "listing", "use_kept", "use_private", "with_private_cells"]

KEPT = "private_tasks"
"""The folder, among the grades, of the private tasks that they were graded with."""


def use_private(folder: Path | None) -> None:
    """Let the tasks of a folder count from now on, in this process and in those that it starts; None: no others.

    Raises
    ------
    CourseError
        If the folder holds no tasks, or what it holds is of no use.
    """
    if folder is None:
        os.environ.pop(FOLDER, None)
        return
    numbers = [path.stem[4:] for path in sorted(folder.glob("lab_??.py"))]
    if not numbers:
        raise CourseError(f"{folder} holds no private tasks: it needs lab_NN.py and lab_NN_cells.py.")
    os.environ[FOLDER] = str(folder.resolve())
    try:
        for number in numbers:
            tasks.lab(number)
            _cells(number)
    except (ValueError, CourseError) as error:
        os.environ.pop(FOLDER, None)
        raise CourseError(f"the private tasks in {folder} cannot be used: {error}") from error


def keep_private(folder: Path, grades: Path) -> None:
    """Copy private tasks into a folder of grades, so that every later verb knows them, and let the copy count.

    Raises
    ------
    CourseError
        If what the folder holds is of no use.
    """
    use_private(folder)
    kept = grades / KEPT
    if folder.resolve() != kept.resolve():
        shutil.rmtree(kept, ignore_errors=True)
        kept.mkdir(parents=True)
        for path in sorted(folder.glob("*.py")):
            shutil.copyfile(path, kept / path.name)
    use_private(kept)


def use_kept(grades: Path) -> None:
    """Let the private tasks of a folder of grades count, if it keeps some and none were named."""
    if private_folder() is None and (grades / KEPT).is_dir():
        use_private(grades / KEPT)


def with_private_cells(number: str, nb: NotebookNode) -> NotebookNode:
    """The exercise with the cells of private tasks before its last section; as it was where there are none.

    Raises
    ------
    CourseError
        If a private task has no heading, cell and check of its own.
    """
    cells = _cells(number)
    if cells:
        texts = [i for i, cell in enumerate(nb.cells) if cell.cell_type == "markdown" and cell.source.startswith("## ")]
        last = texts[-1] if texts else len(nb.cells)
        nb.cells[last:last] = cells
    return nb


def listing(numbers: list[str]) -> str:
    """What a release tells of private tasks, as JSON: their names and points."""
    return json.dumps(
        {
            task.id: {"label": task.label, "function": task.function, "points": task.points}
            for number in numbers
            for task in private_tasks(number)
        }
    )


def _cells(number: str) -> list[NotebookNode]:
    """The cells of the private tasks of a lab as students get them."""
    wanted = private_tasks(number)
    if not wanted:
        return []
    path = private_folder() / f"lab_{number}_cells.py"
    if not path.is_file():
        raise CourseError(f"{path.name} with the cells of {wanted[0].id} is missing.")
    cells, place = [], None
    found: dict[int, set[str]] = {}
    for cell in nbs.read_source(path).cells:
        if cell.cell_type == "markdown":
            heading = nbs.task_heading(cell.source)
            place = heading or place
        for tag in {"task", "check"} & set(nbs.cell_tags(cell)):
            if place is None:
                raise CourseError(f"{path.name}: a {tag} cell stands before the first '## Task N — title (P points)'.")
            found.setdefault(place.number, set()).add(tag)
            cell.id = f"{tag}-{place.number}"
            if tag == "task":
                cell.source = stubs.exercise_source(cell.source, place.number, place.title, keep_plan=False)
        cells.append(cell)
    for task in wanted:
        if found.get(task.number) != {"task", "check"}:
            raise CourseError(
                f"{path.name}: task {task.number} needs a heading, a cell tagged task and one tagged check."
            )
    return cells
