"""Kinds of wrong answers that many labs share, as learner code: two causes exchanged, given mistakes left in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import combinations

from course_lib.tasks.core import Misconception

__all__ = ["left_in", "mended", "swapped"]


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


def mended(given: Mapping[str, tuple[str, str, str]], left: Iterable[str]) -> list[str]:
    """The pieces of a given program, in order, with only these mistakes still in it.

    Parameters
    ----------
    given : by a mistake's name, the wrong piece of code, the right one, and what the mistake is.
    """
    return [wrong if name in left else right for name, (wrong, right, _) in given.items()]


def left_in(
    given: Mapping[str, tuple[str, str, str]],
    source: Callable[[tuple[str, ...]], str],
    which: Iterable[tuple[str, ...]] | None = None,
) -> tuple[Misconception, ...]:
    """What is left of a given program's mistakes, by itself and together with others.

    Parameters
    ----------
    given : as in `mended`.
    source : the given program with only these mistakes still in it.
    which : the combinations that answer differently from each other; None for all.
    """
    if which is None:
        which = (left for count in range(1, len(given) + 1) for left in combinations(given, count))
    return tuple(
        Misconception(" and ".join(left) + " left in", "; and ".join(given[name][2] for name in left), source(left))
        for left in which
    )
