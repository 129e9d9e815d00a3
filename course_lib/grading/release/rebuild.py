"""From a submitted notebook to the one that is run: the released frame with nothing taken over but answers.

An answer is found by its cell's id, then by its task's heading, then by its function's name. With it come the learner's
own helpers that it uses, wherever they stand. Each statement becomes a cell of its own, so that one that fails costs
only itself. Everything that was not as released is told, and costs nothing.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from nbformat import NotebookNode

from course_lib import MOVED
from course_lib.grading.records import Notice
from course_lib.grading.release.cell_source import bound, imported, normal, parse, plain_python, used, with_decorators

from .released import ReleasedLab, Slot
from .text_answers import heading_of, place_in_text

__all__ = ["Answer", "Piece", "Rebuilt", "older_release", "rebuild"]

MOST_PIECES = 60
"""So many statements of an answer are run one by one; the rest together."""


@dataclass(frozen=True)
class Piece:
    """One cell to run: `task` is "" for the lab's own; `line` of its cell it starts on."""

    task: str
    source: str
    line: int = 1


@dataclass
class Answer:
    """What was handed in for one task.

    Parameters
    ----------
    state : "found", "stub" (as released), "missing", "broken" (not Python), or "text" (it stands in a cell that is
        never run, so that a person must look).
    source : the learner's code for it, helpers first.
    trouble : what is wrong where it is broken or a text.
    pieces : the same as cells to run.
    """

    slot: Slot
    state: str
    source: str = ""
    trouble: str = ""
    pieces: list[Piece] = field(default_factory=list)


@dataclass
class Rebuilt:
    """A notebook to run: the given pieces, then each answer's pieces and probe, in the order of the tasks."""

    given: list[Piece]
    answers: list[Answer]
    notices: list[Notice]


@dataclass(frozen=True)
class _Cell:
    """A submitted code cell: `heading` is the number of the task whose heading stands above it, or 0."""

    place: int
    id: str
    heading: int
    source: str
    tree: ast.Module | None
    trouble: str

    def binds(self, name: str) -> bool:
        if self.tree is None:
            return re.search(rf"^(async\s+)?def\s+{name}\b|^{name}\s*=", self.source, re.M) is not None
        return any(name in bound(statement) for statement in self.tree.body)


def rebuild(nb: NotebookNode, lab: ReleasedLab) -> Rebuilt:
    """Take the answers out of a submitted notebook. Executes nothing; never raises for what a learner wrote."""
    notices: list[Notice] = []
    cells = _cells(nb)
    given_trees = {name: parse(lab.cells[name])[0] for name in lab.given}
    released = {normal(tree) for source in lab.cells.values() if (tree := parse(source)[0]) is not None}
    released_statements = {
        normal(statement) for source in lab.cells.values() for statement in getattr(parse(source)[0], "body", [])
    }
    own = [
        (cell, statement)
        for cell in cells
        if cell.tree is not None and normal(cell.tree) not in released
        for statement in cell.tree.body
        if normal(statement) not in released_statements
    ]
    chosen = [_choose(slot, lab, nb, cells, notices) for slot in lab.slots]
    binding: dict[str, list[tuple[_Cell, ast.stmt]]] = {}
    for cell, statement in own:
        for name in bound(statement):
            binding.setdefault(name, []).append((cell, statement))
    for answer, cell in chosen:
        if cell is not None and cell.tree is not None:
            _fill(answer, cell, binding, notices)
    notices += _frame_notices(cells, lab)
    pieces = [piece for name in lab.given for piece in _split("", lab.cells[name], given_trees[name])]
    return Rebuilt(pieces, [answer for answer, _ in chosen], notices)


def older_release(nb: NotebookNode, lab: ReleasedLab) -> str:
    """Why a notebook is of a release before modules moved, as a sentence; "" where it is not.

    Such a notebook lacks a given cell as it is released now, and imports a module by the name of before.
    """
    trees = [cell.tree for cell in _cells(nb) if cell.tree is not None]
    given = {normal(parse(lab.cells[name])[0] or ast.Module([], [])) for name in lab.given}
    if given <= {normal(tree) for tree in trees}:
        return ""
    names = set().union(*(imported(tree) for tree in trees))
    for name, now in MOVED.items():
        if f"course_lib.{name}" in names:
            return (
                f"This notebook was released by an earlier version of the course: it imports course_lib.{name}, now "
                f"course_lib.{now}. Grade it with the version that released it, or ask for the answers in a fresh copy."
            )
    return ""


def _cells(nb: NotebookNode) -> list[_Cell]:
    found, heading = [], 0
    for place, cell in enumerate(nb.cells):
        heading = heading_of(cell, heading)
        if cell.cell_type == "code":
            source = plain_python(cell.source)
            tree, trouble = parse(source)
            found.append(_Cell(place, str(cell.get("id", "")), heading, source, tree, trouble))
    return found


def _choose(
    slot: Slot, lab: ReleasedLab, nb: NotebookNode, cells: Sequence[_Cell], notices: list[Notice]
) -> tuple[Answer, _Cell | None]:
    """Find the cell that holds the answer of one task."""
    name, number = slot.function, slot.task.number
    stub = normal(parse(slot.stub)[0] or ast.Module([], []))
    candidates = [cell for cell in cells if cell.binds(name)]
    worked = [cell for cell in candidates if cell.tree is None or normal(cell.tree) != stub]
    others = {other.cell for other in lab.slots} - {slot.cell}
    by_id = [cell for cell in worked if cell.id == slot.cell]
    by_heading = [cell for cell in worked if cell.heading == number and cell.id not in others]
    by_name = [cell for cell in worked if cell.id not in others] or worked
    how, chosen = "", None
    for how, group in (("id", by_id), ("heading", by_heading), ("name", by_name)):  # noqa: B007
        if group:
            whole = [cell for cell in group if cell.tree is not None]
            chosen = (whole or group)[-1]
            break
    if len(worked) > 1 and chosen is not None:
        text = f"{name} is written in {len(worked)} cells; the one that counts is cell {chosen.place + 1}."
        _say(notices, "several", slot, text)
    if chosen is None and (place := place_in_text(slot, nb, lab)) is not None:
        text = f"the answer stands in cell {place + 1}, which is a text cell and is not run: a person looks at it."
        _say(notices, "text cell", slot, text)
        return Answer(slot, "text", nb.cells[place].source, f"Task {slot.task.number}: {text}"), None
    if chosen is None:
        state = "stub" if candidates else "missing"
        if state == "missing":
            _say(notices, "missing", slot, f"no cell defines {name}.")
        return Answer(slot, state, slot.stub if state == "stub" else ""), None
    if how != "id":
        _say(notices, "moved", slot, f"{name} was found by its {how} in cell {chosen.place + 1}.")
    if chosen.tree is None:
        return Answer(slot, "broken", chosen.source, chosen.trouble), chosen
    return Answer(slot, "found", chosen.source), chosen


def _fill(
    answer: Answer,
    chosen: _Cell,
    binding: Mapping[str, Sequence[tuple[_Cell, ast.stmt]]],
    notices: list[Notice],
) -> None:
    """Split the chosen cell into pieces, after the learner's own helpers that it uses.

    Every answer brings all of its helpers, shared ones too: the other answer may be refused, or end its kernel.

    Parameters
    ----------
    binding : name to the learner's own statements that give it a value.
    """
    assert chosen.tree is not None
    inside = {name for statement in chosen.tree.body for name in bound(statement)}
    helpers: dict[int, tuple[_Cell, ast.stmt]] = {}
    wanted = set().union(*(used(statement) for statement in chosen.tree.body)) - inside
    itself = {id(statement) for _, statement in binding.get(answer.slot.function, ())}
    seen: set[str] = set()
    waiting = list(wanted)
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        for cell, statement in binding.get(name, ()):
            if cell is not chosen and id(statement) not in itself and id(statement) not in helpers:
                helpers[id(statement)] = (cell, statement)
                waiting += used(statement)
    task = answer.slot.task.id
    ordered = sorted(helpers.values(), key=lambda item: (item[0].place, item[1].lineno))
    sources = {cell.place: cell.source.split("\n") for cell, _ in ordered}
    told = [with_decorators(sources[cell.place], statement) for cell, statement in ordered]
    pieces = [Piece(task, text, statement.lineno) for text, (_, statement) in zip(told, ordered, strict=True)]
    if len(pieces) > MOST_PIECES:
        pieces = [*pieces[:MOST_PIECES], Piece(task, "\n".join(told[MOST_PIECES:]))]
    answer.pieces += pieces
    if told:
        _say(notices, "helpers", answer.slot, _counted(told))
    answer.pieces += _split(answer.slot.task.id, chosen.source, chosen.tree)
    answer.source = "\n".join([*told, chosen.source])


def _counted(told: Sequence[str]) -> str:
    much = "one statement from another cell" if len(told) == 1 else f"{len(told)} statements from other cells"
    return f"{much}, which it uses, came with it."


def _split(task: str, source: str, tree: ast.Module | None) -> list[Piece]:
    """One piece a statement, on the line of the cell where it stood."""
    if tree is None:
        return [Piece(task, source)]
    starts = [
        min([statement.lineno, *(d.lineno for d in getattr(statement, "decorator_list", []))])
        for statement in tree.body
    ]
    if len(set(starts)) < len(starts) or any(
        (before.end_lineno or 0) >= start for before, start in zip(tree.body, starts[1:], strict=False)
    ):
        return [Piece(task, source)]  # several statements on one line: leave them as they are
    lines = source.split("\n")
    pieces = [
        Piece(task, "\n".join(lines[start - 1 : statement.end_lineno]), start)
        for start, statement in zip(starts, tree.body, strict=True)
    ]
    if len(pieces) > MOST_PIECES:
        rest = "\n".join(lines[pieces[MOST_PIECES].line - 1 :])
        pieces = [*pieces[:MOST_PIECES], Piece(task, rest, pieces[MOST_PIECES].line)]
    return pieces


def _frame_notices(cells: Iterable[_Cell], lab: ReleasedLab) -> list[Notice]:
    """What of the frame is not as it was released: told, and put back."""
    found: list[Notice] = []
    ids = [cell.id for cell in cells]
    slots = {slot.cell for slot in lab.slots}
    sources = {cell.id: cell.source for cell in cells}
    gone = [name for name in lab.cells if name not in ids]
    changed = [n for n in lab.cells if n in sources and n not in slots and sources[n].strip() != lab.cells[n].strip()]
    doubled = [name for name, count in Counter(ids).items() if name and count > 1]
    order = [name for name in dict.fromkeys(ids) if name in lab.cells]
    for code, what, names in (
        (
            "cells gone",
            ("of the lab's cells is gone and was put back", "of the lab's cells are gone and were put back"),
            gone,
        ),
        (
            "cells changed",
            ("of the lab's own cells was changed and put back", "of the lab's own cells were changed and put back"),
            changed,
        ),
        ("cells doubled", ("cell stands there twice", "cells stand there twice"), doubled),
    ):
        if names:
            found.append(Notice(code=code, task="", text=f"{len(names)} {what[len(names) > 1]}."))
    if order != [name for name in lab.cells if name in set(order)]:
        found.append(Notice(code="cells moved", task="", text="The cells stand in another order; it was put back."))
    return found


def _say(notices: list[Notice], code: str, slot: Slot, text: str) -> None:
    notices.append(Notice(code=code, task=slot.task.id, text=f"{slot.task.label}: {text}"))
