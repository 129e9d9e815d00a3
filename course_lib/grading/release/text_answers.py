"""Answers that stand in a text cell, which is never run."""

from __future__ import annotations

import re

from nbformat import NotebookNode

from course_lib.authoring.notebooks import task_heading

from .released import ReleasedLab, Slot

__all__ = ["heading_of", "place_in_text"]

MOST_HEADING = 300
"""A longer line is no heading."""


def place_in_text(slot: Slot, nb: NotebookNode, lab: ReleasedLab) -> int | None:
    """The place of a text cell that holds the answer of a task; None where there is none.

    It is the cell that was the task's, or holds its function; of a task to explain also own words below its heading.
    """
    wanted = re.compile(rf"^[ \t]*(async )?def {slot.function}\b", re.M)
    heading = 0
    for place, cell in enumerate(nb.cells):
        heading = heading_of(cell, heading)
        text = cell.source.replace(slot.stub.strip(), "").strip()
        if cell.cell_type == "code" or text in lab.texts or not text:
            continue
        words = slot.task.kind == "explain" and heading == slot.task.number
        if words and not re.search(r"^[ \t]*(#|<details)", text, re.M):
            return place
        if cell.get("id", "") == slot.cell or wanted.search(text):
            return place
    return None


def heading_of(cell: NotebookNode, above: int) -> int:
    """The number of the task whose heading stands in or above a cell."""
    if cell.cell_type != "markdown":
        return above
    seen = task_heading("\n".join(line for line in cell.source.split("\n") if len(line) < MOST_HEADING))
    return seen.number if seen else above
