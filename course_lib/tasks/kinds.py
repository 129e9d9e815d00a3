"""Tasks that every lab has and that differ in their words only: name the cause of what is shown, and explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from course_lib.tasks.choices import judge_choice, judge_words
from course_lib.tasks.core import Case, Misconception, Task

MOST_WORDS = 60


def which_cause(
    id: str,
    title: str,
    cause_of: Mapping[str, str],
    shown: str,
    misconceptions: Sequence[Misconception],
    where: str,
    *,
    causes: Sequence[str] = (),
    version: int = 1,
) -> Task:
    """The task whose answer `causes()` gives the cause of each thing shown by its letter; two points.

    Parameters
    ----------
    cause_of : the right cause of each letter.
    shown : what the letters name, such as "the six clouds above".
    causes : what may be chosen, in this order; the right ones in order of the alphabet if not given.
    """
    choices = causes or sorted(cause_of.values())
    return Task(
        id=id,
        title=title,
        points=2,
        version=version,
        kind="which",
        signature="def causes()",
        cases=lambda rng: [Case({}, {"truth": dict(cause_of)}, shown)],
        judge=lambda case, answer: judge_choice(answer, case.truth, choices, "the cause"),
        misconceptions=tuple(misconceptions),
        where=where,
    )


def in_words(id: str, title: str, rubric: tuple[str, str, str], where: str, *, version: int = 1) -> Task:
    """The task whose answer `explain()` gives is a few sentences, marked by a person with a rubric; two points."""
    return Task(
        id=id,
        title=title,
        points=2,
        version=version,
        kind="explain",
        signature="def explain()",
        cases=lambda rng: [Case({}, {}, "your words")],
        judge=lambda case, answer: judge_words(answer, MOST_WORDS),
        rubric=rubric,
        where=where,
    )
