"""A prediction is two cells: one that asks and gives nothing away, and the folded one below it that tells."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from typing import NamedTuple

from nbformat import NotebookNode

from . import notebooks as nbs

ASKED = re.compile(r"(?<!def )\bpredict\(")
FOLDED = {"hide-input", "prediction"}
FIRST_LINE = "# The answer: run this after your guess."
FOLLOWING = 2  # code cells after the answer, in which its number would be read before a guess
_TOLD = re.compile(r"^Answer: (?P<number>[^\s]*\d[^\s]*?)\.?(?=\s|$)", re.M)


class Asked(NamedTuple):
    """The call of a cell that asks: the name that it binds, and whether its guess is still None."""

    name: str
    open: bool


def _asked(source: str) -> Asked | None:
    """Read `name = predict("…", guess=None, unit="m")`, which is all that a cell that asks holds."""
    try:
        body = ast.parse(source).body
    except SyntaxError:
        return None
    if len(body) != 1 or not isinstance(body[0], ast.Assign) or not isinstance(body[0].value, ast.Call):
        return None
    call, target = body[0].value, body[0].targets[0]
    if not isinstance(target, ast.Name) or getattr(call.func, "id", "") != "predict":
        return None
    guess = next((word.value for word in call.keywords if word.arg == "guess"), None)
    return Asked(target.id, isinstance(guess, ast.Constant) and guess.value is None)


def _answers(cell: NotebookNode | None, name: str) -> bool:
    return cell is not None and cell.cell_type == "code" and f"{name}.answer(" in cell.source


def _said(cell: NotebookNode) -> str:
    """The stored texts of a cell."""
    return "\n".join(output.get("text") or output.get("data", {}).get("text/plain", "") for output in cell.outputs)


def gives_away(cells: list[NotebookNode]) -> Iterator[tuple[int, str]]:
    """What tells the answer of a prediction before a guess was made.

    Parameters
    ----------
    cells : of an executed lesson.

    Yields
    ------
    The number of a cell, and what is wrong with it.
    """
    for n, cell in enumerate(cells):
        if cell.cell_type != "code" or not ASKED.search(cell.source):
            continue
        asked = _asked(cell.source)
        if asked is None or not asked.open:
            yield n, 'a cell that asks holds `name = predict("…", guess=None, unit="…")` and nothing else'
            continue
        answer = cells[n + 1] if n + 1 < len(cells) else None
        if not _answers(answer, asked.name):
            yield n, f"the cell after this question must tell: `{asked.name}.answer(truth, why=…)`"
        elif not set(nbs.cell_tags(answer)) >= FOLDED:
            yield n + 1, "it tells a prediction's answer in the open: tag it hide-input and prediction"
        elif not answer.source.startswith("#"):
            yield n + 1, f"JupyterLab shows the first line of what is folded, so let it read: {FIRST_LINE}"
        else:
            yield from _told_after(cells, n + 1)


def _told_after(cells: list[NotebookNode], place: int) -> Iterator[tuple[int, str]]:
    """Where the number of a folded answer stands unfolded in what follows it, in the same part of the lesson."""
    told = _TOLD.search(_said(cells[place]))
    if told is None:
        return
    number = re.compile(rf"(?<![\w.,]){re.escape(told['number'])}(?![\w]|[.,]\d)")
    left = FOLLOWING
    for n in range(place + 1, len(cells)):
        if cells[n].cell_type == "markdown" and re.search(r"^## ", cells[n].source, re.M):
            return
        if cells[n].cell_type != "code":
            continue
        if "prediction" not in nbs.cell_tags(cells[n]) and number.search(_said(cells[n])):
            yield n, f"the answer of the prediction above, {told['number']}, stands here in the open: tag it prediction"
        left -= 1
        if not left:
            return
