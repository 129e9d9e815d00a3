"""Errors that are seen without comparing number by number: a part that a task names, or all is zero."""

from __future__ import annotations

from collections.abc import Sequence
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
    # a hook knows answers that people give; where one is more than it can take, the rest of the check goes on
    with suppress(ArithmeticError, ValueError, TypeError, LookupError, AttributeError), np.errstate(all="ignore"):
        return asked(case, answer)
    return None


def all_zero(answers: Sequence[Plain]) -> bool:
    """Whether arrays of numbers hold nothing but 0."""
    return all(
        isinstance(one, np.ndarray) and one.dtype.kind in "iuf" and one.size > 1 and not one.any() for one in answers
    )
