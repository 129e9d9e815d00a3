"""Cases drawn until they tell the truth and all wrong answers of lab 05 apart."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from course_lib.tasks.core import Case, Misconception

_DRAWINGS, _CHOICES = 500, 60


def _answers(misconceptions: tuple[Misconception, ...], function: str, given: tuple) -> list[np.ndarray]:
    """What each wrong answer says."""
    out = []
    for misconception in misconceptions:
        space: dict = {"np": np}
        exec(misconception.source, space)
        out.append(np.asarray(space[function](*given)))
    return out


def telling(
    draw: Callable[[], Case],
    mistakes: tuple[Misconception, ...],
    function: str,
    count: int,
    first: tuple[Case, ...] = (),
) -> list[Case]:
    """Cases that tell the truth and all wrong answers apart, each from each: drawn again until they do.

    Where no drawing of so many does, they are chosen one by one, each for what the others leave together.
    """

    def together(case: Case) -> set[tuple[int, int]]:
        """Pairs of answers, truth among them, that are the same in a case."""
        given = (np.copy(value) if isinstance(value, np.ndarray) else value for value in case.given.values())
        said = [case.truth, *_answers(mistakes, function, tuple(given))]
        return {(i, j) for i in range(len(said)) for j in range(i) if np.array_equal(said[i], said[j])}

    begin = set.intersection(*map(together, first))
    for _ in range(_DRAWINGS):
        cases = [draw() for _ in range(count)]
        if not begin.intersection(*map(together, cases)):
            return [*first, *cases]
    left, cases = begin, []
    for _ in range(count):
        drawn = [(case, left & together(case)) for case in (draw() for _ in range(_CHOICES))]
        case, left = min(drawn, key=lambda one: len(one[1]))
        cases.append(case)
    return [*first, *cases]
