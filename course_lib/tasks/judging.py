"""From outcomes to a result: verdicts, points, and which misconceptions fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from course_lib.tasks.core import Case, Misconception, Task, Verdict, lowest
from course_lib.tasks.diagnosis.diagnose import UNKNOWN, Diagnosis, diagnose
from course_lib.tasks.running import Outcome, given_text

UNSTEADY = (
    "Asked twice with the same input, it answered differently: it draws at random without a seed, and what it earns is "
    "luck. Draw from `rng = np.random.default_rng(0)`, made inside the function."
)
"""What is said of an answer that draws at random without a seed."""


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
    score : 0 to 1.
    diagnosis : what went wrong; None where nothing did, or nothing can be said.
    unsteady : whether it answered the same question otherwise when it was asked again.
    """

    task: Task
    status: str
    verdicts: tuple[Verdict, ...]
    worst: int
    told: str
    score: float
    diagnosis: Diagnosis | None = None
    unsteady: bool = False

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
    def recognised(self) -> tuple[Misconception, ...]:
        """The registered mistakes that fit; more than one where the cases cannot tell them apart."""
        return self.diagnosis.mistakes if self.diagnosis else ()

    @property
    def looks_like(self) -> str:
        """The second help: "This looks like …", or what the errors have in common; "" where there is nothing to say."""
        if self.diagnosis is None or not self.diagnosis.says:
            return ""
        found = self.diagnosis
        of_one = found.kind in ("form", "anatomy") and not found.names[0].startswith("only in ")
        says = f"In another case: {found.says}" if of_one and self.status == "raised" else found.says
        return f"{says} {UNKNOWN}" if found.kind == "anatomy" else says

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


def judge_all(
    task: Task, cases: Sequence[Case], outcomes: Sequence[Outcome], reference: Callable[..., Any] | None = None
) -> Result:
    """Judge what a function answered to each case.

    Parameters
    ----------
    task, cases : the task and the cases of one `fresh` drawing.
    outcomes : as many, from `run_all` here, or made by a grader from what another process answered.
    reference : a right function, for slips of the inputs; without it they are not diagnosed.
    """
    if len(outcomes) != len(cases) or not cases:
        raise ValueError(f"task {task.id}: {len(outcomes)} outcomes for {len(cases)} cases; one for each is needed.")
    judged = tuple(_verdict(task, case, outcome) for case, outcome in zip(cases, outcomes, strict=True))
    verdicts = tuple(_kept(task, outcome, verdict) for outcome, verdict in zip(outcomes, judged, strict=True))
    score = min(verdict.score for verdict in verdicts)
    passed = score >= 0.5 if task.kind == "open" else all(verdict.passed for verdict in verdicts)
    answers_are_right = all(verdict.passed for verdict in judged)
    worst = _worst(task, outcomes, verdicts if answers_are_right else judged, passed)
    status = "by hand" if task.kind == "explain" else "passed"
    if not passed:
        status = outcomes[worst].kind if outcomes[worst].kind in ("not started", "raised") else "failed"
    silent = status in ("passed", "by hand", "not started")
    diagnosis = None if silent else diagnose(task, cases, outcomes, judged, reference)
    case = cases[worst]
    told = given_text(case.given) + (f" ({case.name})" if case.name else "")
    unsteady = any(outcome.unsteady for outcome in outcomes)
    return Result(task, status, verdicts, worst, told, score, diagnosis, unsteady)


def _verdict(task: Task, case: Case, outcome: Outcome) -> Verdict:
    if outcome.kind == "answer":
        return task.judge(case, outcome.answer)
    return Verdict(False, math.inf, message=outcome.trouble)


def _kept(task: Task, outcome: Outcome, verdict: Verdict) -> Verdict:
    """The verdict, failed where a right answer changed what it was given and the task does not allow it."""
    changed = [name for name in outcome.overwrote if name in task.arguments]
    if not (task.keeps_inputs and changed and verdict.passed):
        return verdict
    name = changed[0]
    message = (
        f"It changes `{name}`, which whoever called it still needs: work on a copy (p = {name} - t makes one, "
        f"{name} -= t does not)."
    )
    return replace(verdict, passed=False, error=math.inf, message=message, score=0.0)


def _worst(task: Task, outcomes: Sequence[Outcome], verdicts: Sequence[Verdict], passed: bool) -> int:
    """The case to speak of: one without an answer, else the farthest off; of an open task the worst scene."""
    if task.kind == "open" and (passed or all(outcome.kind == "answer" for outcome in outcomes)):
        return lowest(verdicts)
    return min(
        range(len(verdicts)), key=lambda i: (outcomes[i].kind == "answer", verdicts[i].passed, -verdicts[i].ratio, i)
    )
