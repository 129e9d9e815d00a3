"""Which registered mistakes explain a wrong answer: it must equal them wherever they are far from the truth."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.diagnosis.agreement import distance, verdict_on_made
from course_lib.tasks.running import Outcome, run

FAR = 5.0
"""A misconception shows in a case where it is at least so many tolerances from the truth."""


@dataclass(frozen=True)
class Wrong:
    """What a mistake or a slip answers to a case.

    Parameters
    ----------
    far, passes : whether it is FAR from the truth, and whether it is right.
    refused : whether a judge refuses it for its form, so that nothing can be compared with it by size.
    """

    outcome: Outcome
    far: bool
    passes: bool
    refused: bool = False


known_of: weakref.WeakKeyDictionary[Case, dict[tuple[str, str], Wrong]] = weakref.WeakKeyDictionary()


def wrong_answer(task: Task, source: str, case: Case) -> Wrong:
    """What the source of a misconception answers to a case; remembered as long as the case lives."""
    known = known_of.setdefault(case, {})
    key = (task.id, source)
    if key not in known:
        known[key] = wrong_of(task, case, run(load_source(source, task.function), case))
    return known[key]


def wrong_of(task: Task, case: Case, outcome: Outcome) -> Wrong:
    """What the outcome of a mistake or slip is to a case."""
    if outcome.kind != "answer":
        return Wrong(outcome, False, False)
    verdict = verdict_on_made(task, case, outcome.answer)
    if verdict is None:
        return Wrong(Outcome("raised"), False, False)
    return Wrong(outcome, is_far(task, verdict), verdict.passed, not math.isfinite(verdict.error))


def is_far(task: Task, verdict: Verdict) -> bool:
    """Whether a wrong answer shows: it is FAR off; in an open task, it earns less than half."""
    return not verdict.passed and (task.kind == "open" or verdict.ratio >= FAR)


def load_source(source: str, name: str) -> Any:
    """The function of a piece of learner code in which `np` and `math` are there, as in a lab's first cell."""
    namespace: dict[str, Any] = {"np": np, "math": math, "__name__": "__main__"}
    exec(compile(source, f"<source of {name}>", "exec"), namespace)
    return namespace[name]


def recognise(
    task: Task, cases: Sequence[Case], outcomes: Sequence[Outcome], verdicts: Sequence[Verdict]
) -> tuple[Misconception, ...]:
    """The misconceptions that explain a wrong answer.

    One explains it if the answer agrees with it, to within the tolerance, in every case where it is far from the truth
    (there must be one), and agrees with it or is right in every other case. Where a misconception has no answer itself,
    the case is left out. So where every case is right, nothing needs to be run.
    """
    if all(verdict.passed for verdict in verdicts):
        return ()
    return tuple(
        m
        for m in task.misconceptions
        if any(
            _explains(task, (wrong_answer(task, source, case) for case in cases), cases, outcomes, verdicts)
            for source in m.sources
        )
    )


def recognise_several(
    task: Task, cases: Sequence[Case], outcomes: Sequence[Outcome], verdicts: Sequence[Verdict]
) -> tuple[Misconception, ...]:
    """Two mistakes at once: what explains the failed cases one by one, each contradicted by no case that is right.

    Nothing if one case stays unexplained, or if all are explained by one alone (which another case then contradicts),
    or if more than two would be needed: so many explain anything. Of several that explain a case, the one that is wrong
    in the fewest cases is named.
    """
    found: dict[str, Misconception] = {}
    for case, outcome, verdict in zip(cases, outcomes, verdicts, strict=True):
        if verdict.passed:
            continue
        fit = [
            m
            for m in task.misconceptions
            for source in m.sources
            if _explains(task, [wrong_answer(task, source, case)], [case], [outcome], [verdict])
            and not any(v.passed and wrong_answer(task, source, c).far for c, v in zip(cases, verdicts, strict=True))
        ]
        if not fit:
            return ()
        if not any(m.name in found for m in fit):
            simplest = min(fit, key=lambda m: sum(wrong_answer(task, m.source, c).far for c in cases))
            found[simplest.name] = simplest
    return tuple(found.values()) if len(found) == 2 else ()


def _explains(
    task: Task,
    wrongs: Iterable[Wrong],
    cases: Sequence[Case],
    outcomes: Sequence[Outcome],
    verdicts: Sequence[Verdict],
) -> bool:
    shown = False
    for wrong, case, outcome, verdict in zip(wrongs, cases, outcomes, verdicts, strict=True):
        if wrong.outcome.kind != "answer":
            continue
        if outcome.kind != "answer" or (wrong.far and verdict.passed):
            return False
        if not verdict.passed and distance(task, case, outcome.answer, wrong.outcome.answer) > 1:
            return False
        shown |= wrong.far
    return shown
