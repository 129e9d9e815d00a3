"""Questions to a student about their own code: their answer, one changed input, "what comes out?".

A learner's code is never run here. What should come out is computed by the course's solution.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.ledger.resolve import find_lab, find_standing, find_task
from course_lib.grading.run.grade_submission import load_data
from course_lib.grading.safe_text import clean
from course_lib.tasks.plain import Plain

__all__ = ["questions", "readable"]

MOST_NUMBERS = 24


def questions(grades: Path, student: str, lab: str, number: int | None, seed: int, answers: bool) -> Iterator[str]:
    """The lines to ask from.

    Parameters
    ----------
    number : only this task; None asks about every task that was passed.
    answers : also what should come out.
    """
    lab = find_lab(lab)
    with Ledger(grades / "ledger.sqlite", write=False) as ledger:
        wanted = find_task(lab, str(number)).id if number is not None else None
        one = find_standing(ledger, student, lab)
    asked = 0
    for item in one.tasks:
        task = tasks.get(item.id)
        fits = item.id == wanted if wanted else item.record["status"] == "passed"
        if not fits or task.kind in ("which", "explain"):
            continue
        asked += 1
        case = _smallest(task, seed)
        yield f"{task.label}"
        yield from (f"  | {clean(line)}" for line in item.record["source"].split("\n"))
        yield f"  {case.name or 'A new input'}:"
        yield from (f"    {name} = {readable(value)}" for name, value in case.given.items())
        yield "  What comes out? Why?"
        if answers:
            function = solutions.answer_function(task)
            right = tasks.run(function, case)
            yield f"  (The course's solution gives {readable(right.answer)})"
        yield ""
    if not asked:
        yield f"{student} has passed no task of lab {lab} that one could ask about in this way."


def _smallest(task: tasks.Task, seed: int) -> tasks.Case:
    """The fresh case with the fewest numbers in it."""
    cases = tasks.fresh(task, seed, load_data() if task.data else None)
    return min(cases, key=lambda case: sum(np.size(value) for value in case.given.values()))


def readable(value: Plain) -> str:
    """A value short enough to talk about."""
    if isinstance(value, np.ndarray):
        if value.size <= MOST_NUMBERS:
            return np.array2string(value, precision=4, separator=", ", threshold=10**6).replace("\n", "\n      ")
        first = value if value.ndim < 2 else value.reshape(-1, value.shape[-1])[:2]
        corner = np.array2string(first[..., :4], precision=4, separator=", ").replace("\n", " ")
        return f"{value.shape} {value.dtype}, beginning with {corner}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (bytes, str)) and len(value) > 60:
        return f"{len(value)} of {type(value).__name__}, beginning with {value[:32]!r}"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key!r}: {readable(item)}" for key, item in value.items()) + "}"
    return repr(value)
