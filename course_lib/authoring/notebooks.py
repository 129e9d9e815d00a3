"""Reading, making and writing notebooks, so that the same source always gives the same bytes."""

from __future__ import annotations

import copy
import hashlib
import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from course_lib.notebook._atomic import atomic_file
from course_lib.notebook._cells import real_datasets
from course_lib.tasks.registry import get, lab_numbers

from .tree import CourseError

KERNELSPEC = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
LANGUAGE = {
    "codemirror_mode": {"name": "ipython", "version": 3},
    "file_extension": ".py",
    "mimetype": "text/x-python",
    "name": "python",
    "nbconvert_exporter": "python",
    "pygments_lexer": "ipython3",
}
_TASK = re.compile(
    r"^##\s+Task\s+(?P<number>\d+)\s*[—–:-]\s*(?P<title>[^\s(].*?)\s*"
    r"\((?P<points>\d+)\s+points?(?:,[^)\n]*)?\)\s*$",
    re.M,
)
_HEADER = re.compile(r"\A# ---\n(?:#.*\n)*?# ---\n")  # jupytext's YAML: the notebook's metadata are ours
GENERATED = re.compile(r"<!-- (\w+) -->.*?<!-- /\1 -->", re.S)
_CHECKED = re.compile(r"\bcheck\(\s*[\"'](\d\d-\d+)[\"']")
_LOADED = re.compile(r"\bdata\.(?:load|describe)\(\s*[\"'](?P<name>[A-Za-z0-9_]+)[\"']")


@dataclass(frozen=True)
class TaskHeading:
    """What the heading of a lab's task says."""

    number: int
    title: str
    points: int


def task_heading(markdown: str) -> TaskHeading | None:
    """Read `## Task N — title (P points)` from a markdown cell; None where there is none."""
    match = _TASK.search(markdown)
    return TaskHeading(int(match["number"]), match["title"], int(match["points"])) if match else None


def with_tasks(cells: Iterable[NotebookNode]) -> Iterator[tuple[NotebookNode, TaskHeading | None]]:
    """Each cell with the heading of the task that it belongs to; None before the first."""
    task: TaskHeading | None = None
    for cell in cells:
        if cell.cell_type == "markdown":
            task = task_heading(cell.source) or task
        yield cell, task


def cell_tags(cell: NotebookNode) -> list[str]:
    """The tags of a cell, in their order."""
    return list(cell.metadata.get("tags", []))


def real_data_of(cell: NotebookNode) -> tuple[str, ...]:
    """The real datasets without which the output of a cell is another: those that it names, and its checked task's."""
    task = _CHECKED.search(cell.source)
    registered = task is not None and task[1][:2] in lab_numbers()
    return (*real_datasets(cell.source), *(get(task[1]).data if registered else ()))


def named_datasets(nb: NotebookNode) -> list[str]:
    """Every dataset that a notebook's code loads by a literal name, in order of appearance."""
    names: list[str] = []
    for cell in nb.cells:
        if cell.cell_type == "code":
            names += [*real_data_of(cell), *(m["name"] for m in _LOADED.finditer(cell.source))]
    return list(dict.fromkeys(names))


def _slug(cell: NotebookNode) -> str:
    line = next((text for text in cell.source.splitlines() if re.search(r"\w", text)), "empty")
    plain = unicodedata.normalize("NFKD", line).encode("ascii", "ignore").decode().lower()
    return "-".join(re.findall(r"[a-z0-9]+", plain))[:28].strip("-") or cell.cell_type


def cell_ids(cells: list[NotebookNode]) -> list[str]:
    """Derive an id for each cell from its own text, so that edits elsewhere do not change it.

    Task and check cells of a lab are named by their task alone: an answer moved between two versions finds its cell.
    """
    ids: list[str] = []
    for cell, task in with_tasks(cells):
        tags = cell_tags(cell)
        kind = next((tag for tag in ("task", "check") if tag in tags), None)
        if task and kind:
            wanted = f"{kind}-{task.number}"
        else:
            own = GENERATED.sub("", cell.source)  # rows that follow from files may change
            digest = hashlib.sha256(f"{cell.cell_type}\n{own}".encode()).hexdigest()[:8]
            wanted = f"{_slug(cell)}-{digest}"
        number, unique = 1, wanted
        while unique in ids:
            number += 1
            unique = f"{wanted}-{number}"
        ids.append(unique)
    return ids


def _metadata(cell: NotebookNode) -> dict:
    tags = cell_tags(cell)
    hidden = {"prediction": "outputs_hidden", "hide-input": "source_hidden"}
    jupyter = {part: True for tag, part in hidden.items() if tag in tags}
    collapsed = "outputs_hidden" in jupyter  # JupyterLab writes both; with one alone, opening a notebook changes it
    return {key: value for key, value in (("tags", tags), ("jupyter", jupyter), ("collapsed", collapsed)) if value}


def read_source(path: Path) -> NotebookNode:
    """Turn a py:percent file into a notebook without outputs, with derived ids and normal metadata.

    Raises
    ------
    CourseError
        If the file is missing, is not UTF-8, or has no cells.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise CourseError(f"there is no source {path.name}.") from None
    except UnicodeDecodeError:
        raise CourseError(f"{path.name} is not UTF-8: save it as UTF-8.") from None
    import jupytext  # brings parts of Jupyter's server: 0.2 s that a grader's verbs would pay for nothing

    raw = jupytext.reads(_HEADER.sub("", text), fmt="py:percent")
    cells = []
    for cell in raw.cells:
        source = cell.source.strip("\n")
        if source.strip():
            make = getattr(nbformat.v4, f"new_{cell.cell_type}_cell")  # code, markdown or raw
            cells.append(make(source=source, metadata=_metadata(cell)))
    if not cells:
        raise CourseError(f"{path.name} holds no cells: is it jupytext py:percent?")
    for cell, name in zip(cells, cell_ids(cells), strict=True):
        cell.id = name
    return notebook_of(cells)


def notebook_of(cells: list[NotebookNode]) -> NotebookNode:
    """Put cells into a notebook with this course's metadata."""
    metadata = {"kernelspec": dict(KERNELSPEC), "language_info": copy.deepcopy(LANGUAGE)}
    nb = nbformat.v4.new_notebook(cells=cells, metadata=metadata)
    nb.nbformat_minor = 5
    return nb


def line_of_cell(path: Path, cell: NotebookNode) -> int:
    """The line of a source file on which a code cell's text starts; 1 where it cannot be found."""
    text = path.read_text(encoding="utf-8")
    place = text.find(cell.source)
    return text.count("\n", 0, place) + 1 if place >= 0 else 1


def read_notebook(path: Path) -> NotebookNode:
    """Read a notebook of format 4.

    Raises
    ------
    CourseError
        If there is none, or it is not a valid notebook.
    """
    try:
        nb = nbformat.reads(path.read_text(encoding="utf-8"), as_version=4)
        nbformat.validate(nb)
    except FileNotFoundError:
        raise CourseError(f"there is no notebook {path.name}.") from None
    except (nbformat.reader.NotJSONError, nbformat.ValidationError, UnicodeDecodeError, AttributeError) as error:
        first = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise CourseError(f"{path.name} is not a valid notebook: {first}") from error
    return nb


def as_bytes(nb: NotebookNode) -> bytes:
    """The one way in which a notebook is stored: sorted keys, LF, UTF-8, a newline at the end."""
    return (nbformat.writes(nb, version=nbformat.NO_CONVERT).rstrip("\n") + "\n").encode("utf-8")


def write_notebook(path: Path, nb: NotebookNode) -> bool:
    """Write a notebook atomically, and only where its bytes change; say whether they did."""
    new = as_bytes(nb)
    if path.exists() and path.read_bytes() == new:
        return False
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as part:
        part.write_bytes(new)
    return True
