"""Errors that are seen without comparing number by number: a part that a task names, all zero, choices exchanged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from course_lib.tasks.core import Case, Task
from course_lib.tasks.plain import Plain

Found = tuple[str, str]
"""The name of what is common, and a sentence."""
ALL_ZERO = ("all zero", "Every value is 0: was a result never written, or cut to whole numbers?")
SIGN_IN_SOME = (
    "sign in some cases",
    "Sizes are right; in some cases every value has the other sign: the side is decided by something else than asked.",
)


def part_of(task: Task, case: Case, answer: Plain, refused: bool = False) -> Found | None:
    """What the task itself says of an answer; of one that its judge refused, where the task knows such."""
    asked = task.refused if refused else task.anatomy
    if asked is None:
        return None
    with suppress(ArithmeticError, ValueError, TypeError, LookupError, AttributeError), np.errstate(all="ignore"):
        return asked(case, answer)
    return None


def all_zero(answers: Sequence[Plain]) -> bool:
    """Whether arrays of numbers hold nothing but 0."""
    return all(
        isinstance(one, np.ndarray) and one.dtype.kind in "iuf" and one.size > 1 and not one.any() for one in answers
    )


def error_of_choices(answer: Plain, truth: Plain) -> Found | None:
    """What is wrong with a dict of choices: its name and a sentence; None where nothing simple is."""
    if not isinstance(truth, Mapping) or not isinstance(answer, Mapping) or set(answer) != set(truth):
        return None
    if not all(isinstance(one, str) for one in (*truth.values(), *answer.values())):
        return None
    wrong = [name for name in truth if answer[name] != truth[name]]
    used, wanted = list(answer.values()), list(truth.values())
    if sorted(used) == sorted(wanted) and len(set(wanted)) == len(wanted):
        ring = [wrong[0]]
        while answer[ring[-1]] != truth[ring[0]]:
            ring.append(next(name for name in truth if truth[name] == answer[ring[-1]]))
        if len(ring) == len(wrong) > 2:
            causes = ", ".join(repr(truth[name]) for name in ring)
            others = " The others are right." if len(ring) < len(truth) else ""
            return "in a ring", f"{len(ring)} choices stand in each other's places: {causes}.{others}"
        return "several exchanged", f"{len(wrong)} choices stand in each other's places; the others are right."
    if len(wrong) == 1 and used.count(answer[wrong[0]]) > 1:
        twice = answer[wrong[0]]
        return "one choice twice", f"All but one are right: of those with {twice!r} one is something else."
    if len(set(used)) < len(used) and len(set(wanted)) == len(wanted):
        return "choices used twice", "Each choice belongs to one only: of those that you used more often, ask which."
    return None
