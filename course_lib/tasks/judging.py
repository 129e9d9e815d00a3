"""From outcomes to a result: verdicts, points, and which misconceptions fit."""

from __future__ import annotations

import math
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.plain import Plain, same
from course_lib.tasks.running import Outcome, given_text, run

FAR = 5.0
"""A misconception shows in a case where it is at least so many tolerances from the truth."""


@dataclass(frozen=True)
class _Wrong:
    """What a misconception answers to a case; `far` says whether that is FAR from the truth."""

    outcome: Outcome
    far: bool


_known: weakref.WeakKeyDictionary[Case, dict[tuple[str, str], _Wrong]] = weakref.WeakKeyDictionary()


@dataclass(frozen=True)
class Result:
    """What a task earned, and what to say about it.

    Parameters
    ----------
    task : the task.
    status : "passed", "failed", "raised", "not started", or "by hand" (handed in, to be marked).
    verdicts : one a case; a case without an answer has a failed verdict with the reason as its message.
    worst : index of the case to speak of.
    told : what that case gave, in words.
    recognised : the misconceptions that fit; more than one where the cases cannot tell them apart.
    score : 0 to 1.
    several : whether no one misconception fits, but different ones fit different cases.
    """

    task: Task
    status: str
    verdicts: tuple[Verdict, ...]
    worst: int
    told: str
    recognised: tuple[Misconception, ...]
    score: float
    several: bool = False

    @property
    def passed(self) -> bool:
        """Whether nothing is left to do for the learner."""
        return self.status in ("passed", "by hand")

    @property
    def points(self) -> float:
        """Points earned; those marked by hand are still to come."""
        return 0.0 if self.status == "by hand" else round(self.task.points * self.score, 2)

    @property
    def verdict(self) -> Verdict:
        """The verdict to speak of."""
        return self.verdicts[self.worst]

    @property
    def error(self) -> str:
        """The first help: the size of the error, its axis, the worst case."""
        return self.verdict.message

    @property
    def compares(self) -> bool:
        """Whether values were compared: not where an answer's form was refused, which the error already names."""
        return self.status == "failed" and self.task.kind != "explain" and math.isfinite(self.verdict.error)

    @property
    def looks_like(self) -> str:
        """The second help: "This looks like …", or "" where nothing is recognised."""
        if not self.recognised:
            return ""
        between = ", and in another case like " if self.several else ", or like "
        return "This looks like " + between.join(m.message.strip().rstrip(".") for m in self.recognised) + "."

    @property
    def where(self) -> str:
        """The third help: what to read again."""
        return f"Where to look: {self.task.where}."

    @property
    def line(self) -> str:
        """All in one line, for strict mode and graders."""
        if self.status == "not started":
            return self.task.label
        return " ".join(part for part in (f"{self.task.label}:", self.error, self.looks_like) if part)


def band(ratio: float) -> str:
    """The band of an error given in tolerances; coarse, so that nobody descends on the number."""
    for most, words in (
        (0.1, "well within tolerance"),
        (1, "within tolerance"),
        (3, "within 3 times the tolerance"),
        (10, "within 10 times the tolerance"),
    ):
        if ratio <= most:
            return words
    return "more than 10 times the tolerance"


def judge_all(task: Task, cases: Sequence[Case], outcomes: Sequence[Outcome]) -> Result:
    """Judge what a function answered to each case.

    Parameters
    ----------
    task, cases : the task and the cases of one `fresh` drawing.
    outcomes : as many, from `run_all` here, or made by a grader from what another process answered.
    """
    if len(outcomes) != len(cases) or not cases:
        raise ValueError(f"task {task.id}: {len(outcomes)} outcomes for {len(cases)} cases; one for each is needed.")
    verdicts = tuple(_verdict(task, case, outcome) for case, outcome in zip(cases, outcomes, strict=True))
    score = _score(task, verdicts)
    passed = score >= 0.5 if task.kind == "open" else all(verdict.passed for verdict in verdicts)
    worst = _worst(task, outcomes, verdicts, passed)
    status = "by hand" if task.kind == "explain" else "passed"
    if not passed:
        status = outcomes[worst].kind if outcomes[worst].kind in ("not started", "raised") else "failed"
    recognised = () if status in ("passed", "by hand", "not started") else recognise(task, cases, outcomes, verdicts)
    several = False
    if not recognised and status == "failed":
        recognised = recognise_by_case(task, cases, outcomes, verdicts)
        several = len(recognised) > 1
    case = cases[worst]
    told = given_text(case.given) + (f" ({case.name})" if case.name else "")
    return Result(task, status, verdicts, worst, told, recognised, score, several)


def _verdict(task: Task, case: Case, outcome: Outcome) -> Verdict:
    if outcome.kind == "answer":
        return task.judge(case, outcome.answer)
    return Verdict(False, math.inf, message=outcome.trouble)


def _worst(task: Task, outcomes: Sequence[Outcome], verdicts: Sequence[Verdict], passed: bool) -> int:
    """The case to speak of: one without an answer, else the farthest off; of an open task the median one."""
    if task.kind == "open" and (passed or all(outcome.kind == "answer" for outcome in outcomes)):
        order = sorted(range(len(verdicts)), key=lambda i: verdicts[i].score)
        return order[(len(order) - 1) // 2 if len(order) % 2 else len(order) // 2]
    return min(
        range(len(verdicts)), key=lambda i: (outcomes[i].kind == "answer", verdicts[i].passed, -verdicts[i].ratio, i)
    )


def _score(task: Task, verdicts: Sequence[Verdict]) -> float:
    scores = np.array([verdict.score for verdict in verdicts])
    if task.kind != "open":
        return float(scores.min())
    if len(scores) % task.draws:
        raise ValueError(f"task {task.id}: an open task draws equally many cases from every seed.")
    return float(np.median(scores.reshape(task.draws, -1).mean(axis=1)))


def wrong_answer(task: Task, source: str, case: Case) -> _Wrong:
    """What the source of a misconception answers to a case; remembered as long as the case lives."""
    known = _known.setdefault(case, {})
    key = (task.id, source)
    if key not in known:
        outcome = run(load_source(source, task.function), case)
        known[key] = _Wrong(outcome, outcome.kind == "answer" and is_far(task, task.judge(case, outcome.answer)))
    return known[key]


def is_far(task: Task, verdict: Verdict) -> bool:
    """Whether a wrong answer shows: it is FAR off; in an open task, it earns less than half."""
    return not verdict.passed and (task.kind == "open" or verdict.ratio >= FAR)


def load_source(source: str, name: str) -> Any:
    """The function of a piece of learner code in which `np` and `math` are there, as in a lab's first cell."""
    namespace: dict[str, Any] = {"np": np, "math": math, "__name__": "__main__"}
    exec(compile(source, f"<source of {name}>", "exec"), namespace)
    return namespace[name]


def distance(task: Task, case: Case, a: Plain, b: Plain) -> float:
    """How far two answers to a case are from each other, in tolerances."""
    if isinstance(b, np.ndarray) and isinstance(a, list):
        a = _as_array(a)
    if same(a, b):
        return 0.0
    if not _comparable(a, b):
        return math.inf
    if task.distance is not None:
        return float(task.distance(case, a, b))
    if "truth" not in case.hidden:
        return math.inf
    return task.judge(replace(case, hidden={**case.hidden, "truth": b}), a).ratio


def _as_array(value: list[Plain]) -> Plain:
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        return value
    return array if array.dtype.kind in "biuf" else value


def _comparable(a: Plain, b: Plain) -> bool:
    """Whether two plain values are of the same form, so that a judge may take one for the truth of the other."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.ndim == b.ndim and a.dtype.names == b.dtype.names
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return isinstance(a, bool) == isinstance(b, bool)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_comparable, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_comparable(a[key], b[key]) for key in a)
    return type(a) is type(b)


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
        if any(_explains(task, source, cases, outcomes, verdicts) for source in m.sources)
    )


def recognise_by_case(
    task: Task, cases: Sequence[Case], outcomes: Sequence[Outcome], verdicts: Sequence[Verdict]
) -> tuple[Misconception, ...]:
    """Two mistakes at once: what explains the failed cases one by one; nothing if one of them stays unexplained."""
    found: dict[str, Misconception] = {}
    for case, outcome, verdict in zip(cases, outcomes, verdicts, strict=True):
        if verdict.passed:
            continue
        fit = [m for m in task.misconceptions if _explains_one(task, m, case, outcome, verdict)]
        if not fit:
            return ()
        if not any(m.name in found for m in fit):
            found[fit[0].name] = fit[0]
    return tuple(found.values())


def _explains_one(task: Task, misconception: Misconception, case: Case, outcome: Outcome, verdict: Verdict) -> bool:
    return any(_explains(task, source, [case], [outcome], [verdict]) for source in misconception.sources)


def _explains(
    task: Task, source: str, cases: Sequence[Case], outcomes: Sequence[Outcome], verdicts: Sequence[Verdict]
) -> bool:
    shown = False
    for case, outcome, verdict in zip(cases, outcomes, verdicts, strict=True):
        wrong = wrong_answer(task, source, case)
        if wrong.outcome.kind != "answer":
            continue
        if outcome.kind != "answer" or (wrong.far and verdict.passed):
            return False
        if not verdict.passed and distance(task, case, outcome.answer, wrong.outcome.answer) > 1:
            return False
        shown |= wrong.far
    return shown
