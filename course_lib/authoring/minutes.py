"""How many minutes the core of a lesson and a lab take, counted soberly from what is stored."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

from nbformat import NotebookNode

from course_lib.notebook.lessons import lessons

from . import notebooks as nbs
from . import stubs
from .parts import Part, core_of, parts_of
from .predictions import ASKED
from .syntax import logical_lines
from .tree import Tree

LESSON_MINUTES, START_MINUTES, LAB_MINUTES = 60, 20, 60  # at most; START is lesson 00
WORDS_A_MINUTE, LINE_MINUTES = 130, 0.1
TASK_MINUTES, SOLUTION_LINE_MINUTES = 3.0, 0.5  # to understand a task and run its check; to write one line of it
FARTHEST_OFF = 5  # a stated number from the count
WHAT_IS_COUNTED = (
    f"{WORDS_A_MINUTE} words a minute, {60 * LINE_MINUTES:.0f} seconds a line of code, a minute each for a picture, "
    f"a table and a prediction; in a lab also {TASK_MINUTES:.0f} minutes a task, "
    "and half a minute a line of its solution"
)

_RULE = re.compile(r"^[ \t>]*\|?[ \t]*:?-+:?[ \t]*(?:\|[ \t]*:?-+:?[ \t]*)+\|?[ \t]*$", re.M)  # below a table's head


def words_of(markdown: str) -> int:
    """How many words a person reads: no addresses, no tags; a formula counts as one word for each of its parts."""
    text = re.sub(r"<!--.*?-->|<[^>]+>", " ", markdown, flags=re.S)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    return len(re.findall(r"[^\W_][\w.,'’²³-]*", text))


def _tables(part: Part, cells: list[NotebookNode]) -> int:
    """Tables in the text of a part and in what its cells have stored."""
    html = [output.get("data", {}).get("text/html", "") for cell in cells for output in cell.outputs]
    return len(_RULE.findall(part.prose)) + sum("<table" in text for text in html)


def _reading(part: Part) -> float:
    """Minutes for text, pictures, tables, predictions and the code that is shown; a stub counts as it is given."""
    given = [cell for cell in part.code if not {"task", "check"} & set(nbs.cell_tags(cell))]
    shown = [cell.source for cell in part.code if "hide-input" not in nbs.cell_tags(cell)]
    lines = sum(len(logical_lines(_as_given(source))) for source in shown)
    predictions = sum(len(ASKED.findall(cell.source)) for cell in part.code)
    looks = part.figures + _tables(part, given) + predictions
    read = nbs.GENERATED.sub("", part.prose)  # rows that follow from files are looked up: a table and no words
    return (words_of(part.heading) + words_of(read)) / WORDS_A_MINUTE + lines * LINE_MINUTES + looks


def _as_given(source: str) -> str:
    """A cell's code as a learner gets it."""
    return stubs.exercise_source(source, 1, "") if stubs.BEGIN in source else source


def solution_lines(source: str) -> int:
    """How many logical lines of a task's cell are its solution's."""
    blocks = stubs.solution_blocks(source)
    return sum(any(first < line <= last for first, last in blocks) for line in logical_lines(source))


def lesson_minutes(nb: NotebookNode) -> float:
    """Minutes for the core of an executed lesson: all from the title to "To the lab"."""
    return sum(map(_reading, core_of(parts_of(nb))))


def lab_minutes(nb: NotebookNode) -> float:
    """Minutes for a lab, from its executed solution."""
    parts = parts_of(nb)
    tasks = [cell.source for part in parts for cell in part.code if "task" in nbs.cell_tags(cell)]
    writing = sum(TASK_MINUTES + SOLUTION_LINE_MINUTES * solution_lines(source) for source in tasks)
    return writing + sum(map(_reading, parts))


def counted(path: Path, tree: Tree) -> int:
    """Whole minutes, rounded up, of a stored lesson or of a lab's stored solution."""
    count = lab_minutes if path.parent.resolve() == tree.solutions_folder.resolve() else lesson_minutes
    return math.ceil(count(nbs.read_notebook(path)))


def _stated(path: Path, lab: bool, tree: Tree) -> Iterator[tuple[str, int]]:
    """Where minutes are stated, and how many."""
    name = path.stem
    for lesson in lessons(tree.lessons_folder / "source"):
        if lesson.name == name:
            yield f"notebooks/source/{name}.toml", lesson.lab_minutes if lab else lesson.minutes
    notebook = tree.lessons_folder / f"{name}.ipynb"
    parts = parts_of(nbs.read_notebook(notebook)) if notebook.is_file() else []
    card = "\n".join(part.prose for part in parts if part.heading == "Card")
    match = re.search(r"(\d+)[\w ]* for the lab" if lab else r"\bMinutes\W+(\d+)", card)
    if match:
        yield "the lesson's card", int(match[1])
    if lab:
        match = re.search(r"\babout (\d+) minutes", parts_of(nbs.read_notebook(path))[0].prose)
        if match:
            yield "its first cell", int(match[1])


def minutes_findings(path: Path, lab: bool, tree: Tree) -> Iterator[str]:
    """A lesson's core or a lab's solution that takes too long, or longer or shorter than is stated somewhere."""
    count = counted(path, tree)
    most = LAB_MINUTES if lab else START_MINUTES if path.stem[:2] == "00" else LESSON_MINUTES
    what = "minutes" if lab else "minutes for the core"
    others = [f"{place} says {said}" for place, said in _stated(path, lab, tree) if abs(said - count) > FARTHEST_OFF]
    if count > most:
        yield f"{count} {what}, more than {most}"
    elif others:
        yield f"{count} {what}; {', '.join(others)}"
