"""Errors that are seen without comparing number by number: a part that a task names, all zero, always the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from course_lib.tasks.core import Case, Task
from course_lib.tasks.diagnosis.forms import NAN_ALWAYS
from course_lib.tasks.plain import Plain, describe, same

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
    # a hook knows answers that people give; where one is more than it can take, the rest of the check goes on
    with suppress(ArithmeticError, ValueError, TypeError, LookupError, AttributeError), np.errstate(all="ignore"):
        return asked(case, answer)
    return None


def all_zero(answers: Sequence[Plain]) -> bool:
    """Whether arrays of numbers hold nothing but 0."""
    return all(
        isinstance(one, np.ndarray) and one.dtype.kind in "iuf" and one.size > 1 and not one.any() for one in answers
    )


def always_the_same(cases: Sequence[Case], answers: Sequence[Plain]) -> Found | None:
    """Whether a function gives one answer whatever it is given, where three cases or more have different truths."""
    if len(answers) < 3 or any(answer is None for answer in answers) or not all("truth" in c.hidden for c in cases):
        return None
    if all_zero(answers):
        return ALL_ZERO
    if all(same(answer, answers[0], 1e-12) for answer in answers) and not all(
        same(case.truth, cases[0].truth, 1e-12) for case in cases
    ):
        if isinstance(answers[0], float) and math.isnan(answers[0]):
            return NAN_ALWAYS
        value = f", {describe(answers[0])}" if isinstance(answers[0], (int, float, str)) else ""
        return "always the same", f"The answer is the same{value} in every case, whatever the function is given."
    return None
