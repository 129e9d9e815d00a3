"""What a lab's source says of each task: its text, its cell with the solution, its stub, what stands around it."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from course_lib import tasks
from course_lib.authoring import notebooks as nbs
from course_lib.authoring import stubs
from course_lib.authoring.tree import CourseError
from course_lib.tasks.diagnosis.recognition import load_source
from course_lib.tasks.private import private_folder

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class LabTask:
    """A task as it stands in the source of its lab.

    Parameters
    ----------
    number, title, points : of its heading `## Task N — title (P points)`.
    text : the markdown from the heading to the task cell (and after it, to the next heading).
    source : the task cell, with its markers.
    check : the source of its check cell; "" if there is none.
    """

    number: int
    title: str
    points: int
    text: str
    source: str
    check: str

    @property
    def hints(self) -> int:
        """How many hints stand folded in its text."""
        return len(re.findall(r"<summary>\s*Hint\s+\d", self.text))


def source_path(lab: str, root: Path = ROOT) -> Path:
    """The source of a lab: solutions/source/NN_name.py."""
    found = sorted((root / "solutions" / "source").glob(f"{lab}_*.py"))
    if len(found) != 1:
        raise CourseError(f"solutions/source has {len(found)} files for lab {lab}: there must be one {lab}_name.py.")
    return found[0]


def lab_tasks(lab: str, root: Path = ROOT) -> tuple[LabTask, ...]:
    """The tasks in the source of a lab, in order.

    Raises
    ------
    CourseError
        If the source is missing, or a task has no cell tagged `task` of its own.
    """
    path = source_path(lab, root)
    return _lab_tasks(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _lab_tasks(path: Path, _changed: int) -> tuple[LabTask, ...]:
    parts: list[tuple[nbs.TaskHeading | None, list[nbs.NotebookNode]]] = [(None, [])]
    for cell in nbs.read_source(path).cells:
        if cell.cell_type == "markdown":
            heading = nbs.task_heading(cell.source)
            if heading or re.search(r"^#{1,2}\s", cell.source, re.M):
                parts.append((heading, []))
        parts[-1][1].append(cell)
    result = []
    for heading, cells in parts:
        if heading is None:
            continue
        text = "".join(f"{cell.source}\n" for cell in cells if cell.cell_type == "markdown")
        task, check = ([cell.source for cell in cells if tag in nbs.cell_tags(cell)] for tag in ("task", "check"))
        if len(task) != 1:
            raise CourseError(f"{path.name}: task {heading.number} has {len(task)} cells tagged task, not one.")
        result.append(LabTask(heading.number, heading.title, heading.points, text, task[0], check[0] if check else ""))
    return tuple(result)


def task_of_lab(task_id: str, root: Path = ROOT) -> LabTask:
    """The task of an id as it stands in its lab, or in the folder of an instructor's own tasks."""
    number = tasks.get(task_id).number
    own = [] if private_folder() is None else [private_folder() / f"lab_{task_id[:2]}_cells.py"]
    for path in (source_path(task_id[:2], root), *(path for path in own if path.is_file())):
        for task in _lab_tasks(path, path.stat().st_mtime_ns):
            if task.number == number:
                return task
    raise CourseError(f"{source_path(task_id[:2], root).name} has no heading '## Task {number} — title (P points)'.")


def reference(task_id: str, root: Path = ROOT) -> str:
    """The source of a task's cell with the right answer in it."""
    return stubs.reference_source(task_of_lab(task_id, root).source)


def answer_function(task: tasks.Task, root: Path = ROOT) -> Callable[..., Any]:
    """The course's own answer to a task, as a function; CourseError if its lab does not hold it."""
    return load_source(f"{preamble(task.lab, root)}\n{reference(task.id, root)}", task.function)


def right_function(task: tasks.Task, root: Path = ROOT) -> Callable[..., Any] | None:
    """The right function of a task, to try changed inputs on; None for tasks whose answer no input changes.

    Raises
    ------
    CourseError
        If its lab does not hold it.
    """
    if task.kind in ("open", "which", "explain"):
        return None
    return answer_function(task, root)


def stub(task_id: str, root: Path = ROOT) -> str:
    """The source of a task's cell as learners get it."""
    task = task_of_lab(task_id, root)
    return stubs.exercise_source(task.source, task.number, task.title)


def preamble(lab: str, root: Path = ROOT) -> str:
    """What a lab's answers may rely on: its own imports, small functions and constants, outside tagged cells.

    Imports of course_lib.notebook are left out: an answer that needs them could not be graded.
    """
    path = source_path(lab, root)
    return _preamble(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _preamble(path: Path, _changed: int) -> str:
    kept: list[str] = []
    for cell in nbs.read_source(path).cells:
        if cell.cell_type != "code" or {"task", "check", "real-data"} & set(nbs.cell_tags(cell)):
            continue
        lines = [line for line in cell.source.split("\n") if not line.startswith(("%", "!"))]
        kept += [ast.unparse(node) for node in ast.parse("\n".join(lines)).body if _is_given(node)]
    return "\n".join(kept)


def _is_given(node: ast.stmt) -> bool:
    if isinstance(node, ast.ImportFrom):
        return not (node.module or "").startswith("course_lib.notebook")
    if isinstance(node, ast.Import):
        return not any(name.name.startswith("course_lib.notebook") for name in node.names)
    if isinstance(node, ast.Assign):
        return all(isinstance(target, (ast.Name, ast.Tuple)) for target in node.targets) and all(
            isinstance(part, (ast.Constant, ast.Tuple, ast.List, ast.Dict, ast.Load, ast.UnaryOp, ast.USub))
            for part in ast.walk(node.value)
        )
    return isinstance(node, ast.FunctionDef)
