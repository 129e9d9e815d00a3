"""Kinds of wrong answers that many labs share, as learner code: two causes exchanged, given mistakes left in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import combinations

from course_lib.tasks.core import Misconception

__all__ = ["left_in", "swapped"]


def swapped(cause_of: Mapping[str, str], a: str, b: str) -> str:
    """Learner code that takes two causes for each other and has the others right.

    Parameters
    ----------
    cause_of : the right cause of each letter.
    a, b : two of the causes.
    """
    other = {a: b, b: a}
    answer = {letter: other.get(cause, cause) for letter, cause in cause_of.items()}
    return f"def causes():\n    return {answer!r}\n"


def left_in(
    messages: Mapping[str, str],
    source: Callable[[tuple[str, ...]], str],
    which: Iterable[tuple[str, ...]] | None = None,
) -> tuple[Misconception, ...]:
    """What is left of a given program's mistakes, by itself and together with others.

    Parameters
    ----------
    messages : what each given mistake is, by its name.
    source : the given program with only these mistakes still in it.
    which : the combinations that answer differently from each other; None for all.
    """
    if which is None:
        which = (left for count in range(1, len(messages) + 1) for left in combinations(messages, count))
    return tuple(
        Misconception(" and ".join(left) + " left in", "; and ".join(messages[name] for name in left), source(left))
        for left in which
    )
