"""What a student is told: one HTML page a lab, with nothing hidden, nothing that runs, nothing of anybody else.

Only these go to a page: names, titles, points, the sentences of the judge (error in physical units, what it looks like,
where to read), what was repaired in the notebook, lateness, and what people decided. No inputs, no truth, no seeds.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from course_lib.grading.records import TaskRecord
from course_lib.grading.safe_text import page_name

from .pages import render, write_text

__all__ = ["feedback_page", "write_feedback"]

_INPUTS = re.compile(r" It was given .*$", re.S)

REPAIRED = ("helpers", "moved", "several", "cells gone", "cells changed", "cells doubled", "cells moved")
"""Codes of notices of what was repaired, which cost nothing; a student is told."""
HAPPENED = ("restarted", "given up")
"""Codes of notices of what happened to the run as a whole; what struck one task stands with that task."""
KIND = {
    "passed": ("good", "Right on all fresh inputs."),
    "failed": ("wrong", ""),
    "raised": ("wrong", "Your code stopped with an error."),
    "not started": ("open", "Not started: its function still raises NotImplementedError. That cost no other points."),
    "by hand": ("open", "Handed in. Your instructor reads this answer and gives the points."),
    "decide again": ("open", "Your instructor gave points to an earlier attempt, and decides on this one again."),
    "missing": ("open", "No answer was found for this task. If you wrote one, tell your instructor where."),
    "refused": ("wrong", "Not counted, because of what it calls."),
    "no answer": ("wrong", "There was no answer to judge."),
}


def write_feedback(standings: Sequence[Any], out: Path) -> list[Path]:
    """Write a page for every student and lab, and index.html.

    Parameters
    ----------
    standings : of those who handed in or were excused; others get no page.
    """
    rows, paths = [], []
    for one in standings:
        if one.status not in ("graded", "excused", "unreadable", "waiting") or not one.student:
            continue
        path = out / page_name(one.student, one.lab)
        write_text(path, feedback_page(one))
        paths.append(path)
        points = "" if one.status != "graded" else f"{one.points:g} of {one.max:g}"
        rows.append({"name": one.name or one.student, "lab": one.lab, "points": points, "file": path.name})
    write_text(out / "index.html", render("index.html", rows=rows))
    return [*paths, out / "index.html"]


def feedback_page(one: Any) -> str:
    """The page of one standing."""
    record = one.record
    return render(
        "feedback.html",
        lab=one.lab,
        lab_title=_lab_title(one.lab),
        name=one.name or one.student,
        excused=one.status == "excused",
        unreadable=_sentence(record["reason"]) if record is not None and one.status == "unreadable" else "",
        waiting=one.status == "waiting",
        points=one.points or 0.0,
        max=one.max,
        to_mark=one.to_mark,
        late=one.late_reason if one.kept < 1 else "",
        tasks=[_task(task) for task in one.tasks],
        repaired=_notices(record, REPAIRED),
        happened=_notices(record, HAPPENED),
    )


def _notices(record: Any, codes: Sequence[str]) -> list[str]:
    """The sentences of some notices, each once and as a sentence begins."""
    found = [n["text"] for n in record["notices"] if n["code"] in codes] if record is not None else []
    return [_sentence(text) for text in dict.fromkeys(found)]


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _lab_title(lab: str) -> str:
    from course_lib.grading.release.released import released_lab

    return released_lab(lab).name[3:].replace("_", " ")


def _task(task: Any) -> dict[str, Any]:
    """What is told of one task."""
    record: TaskRecord = task.record
    status = record["status"]
    tone, state = KIND["decide again" if task.before else status]
    marked = task.by != "grader"
    if marked and task.points >= task.max:
        tone, state = "good", ""
    lines = []
    if status in ("failed", "raised", "refused", "no answer"):
        lines = [_INPUTS.sub("", record["error"]), record["looks_like"], record["where"]]
    elif status == "passed" or record["reason"] == "text cell":
        lines = [record["error"]]
    elif status == "not started":
        lines = [record["where"]]
    if marked:
        lines.append(f"Points given by your instructor: {task.reason}")
    mark = f"{task.points:g} of {task.max:g}"
    if task.open:
        mark = f"up to {task.max:g}, to be marked"
    return {
        "number": task.number,
        "title": task.title,
        "tone": tone,
        "state": state,
        "mark": mark,
        "lines": [line for line in lines if line],
    }
