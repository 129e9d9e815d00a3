"""Tasks that every lab has and that differ in their words only: name the cause of what is shown, and explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from course_lib.tasks.choices import judge_choice, judge_words
from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.plain import Plain

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
    signs: Mapping[str, str] | None = None,
    version: int = 1,
) -> Task:
    """The task whose answer `causes()` gives the cause of each thing shown by its letter; two points.

    Parameters
    ----------
    cause_of : the right cause of each letter.
    shown : what the letters name, such as "the six clouds above".
    causes : what may be chosen, in this order; the right ones in order of the alphabet if not given.
    signs : what each cause leaves behind, easiest first: said of the first that is misplaced where several are.
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
        anatomy=lambda case, answer: _misplaced(case.truth, answer, choices, signs or {}),
        where=where,
    )


def _misplaced(
    truth: Mapping[str, str], answer: Plain, choices: Sequence[str], signs: Mapping[str, str]
) -> tuple[str, str] | None:
    """What can be said of causes of which several are wrong, without the key."""
    if not isinstance(answer, Mapping) or set(answer) != set(truth):
        return None
    given = [answer[letter] for letter in truth]
    wrong = {truth[letter] for letter in truth if answer[letter] != truth[letter]}
    first = next((f" Begin with {cause!r}: {sign}." for cause, sign in signs.items() if cause in wrong), "")
    if len(set(given)) < len(set(truth.values())):
        return "a cause used twice", "A cause stands more than once, so another is missing: each occurs once." + first
    if given == list(choices):
        return (
            "in the order of the list",
            "These are the causes in the order of the list: look at the pictures." + first,
        )
    return "several causes", f"{len(wrong)} causes are misplaced, more than one pair." + first


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
