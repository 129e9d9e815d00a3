"""What grading one submission says: a small dict of plain JSON; all that the ledger and the reports know of a run.

A record depends on the submitted bytes, the lab's version, the seed, the environment and the grader: not on who handed
it in. Two runs with the same of these agree in everything but `seconds`.
"""

from __future__ import annotations

from typing import Literal, TypedDict

__all__ = ["FORMAT", "Notice", "Record", "Status", "TaskRecord", "TaskStatus", "same_grades"]

FORMAT = 1

Status = Literal["graded", "unreadable", "infrastructure"]
"""graded: every task has its points. unreadable: not a notebook of this lab, so 0 points and a person should look.
infrastructure: the grader failed (a dataset missing, no sandbox); never scored, to be retried."""

TaskStatus = Literal["passed", "failed", "raised", "not started", "by hand", "missing", "refused", "no answer"]
"""passed, failed, raised, not started, by hand: as `course_lib.tasks.judging.Result.status`. missing: no function of
this name was handed in. refused: the answer uses what the task does not allow. no answer: the kernel died, time was up,
or what came back was no single plain answer; `reason` tells which."""


class Notice(TypedDict):
    """Something that was seen, repaired or stopped; `code` is a short fixed word, `text` one sentence for a person."""

    code: str
    task: str
    text: str


class TaskRecord(TypedDict):
    """What one task earned, and what to say about it. Texts may hold the learner's words, and are not escaped."""

    id: str
    number: int
    title: str
    kind: str
    version: int
    max: float
    points: float
    status: TaskStatus
    reason: str
    """A short fixed word for what is not passed: "wrong", "raised", "not started", "missing", "refused", "timeout",
    "memory", "output", "died", "forged", "doubled", "oversized", "not plain", "by hand", "text cell", …; "" if
    passed."""
    error: str
    looks_like: str
    misconceptions: list[str]
    where: str
    told: str
    source: str
    """The learner's code that was run for this task."""
    text: str
    """What the learner wrote, for a task that is marked by hand; else ""."""


class Record(TypedDict):
    """One graded submission."""

    format: int
    submission: str
    """sha256 of the bytes as handed in, in hex."""
    lab: str
    lab_version: str
    seed: int
    environment: str
    grader: str
    isolation: str
    """How the kernel was held, in words: "bwrap 0.8.0: …" or "none"."""
    status: Status
    reason: str
    notices: list[Notice]
    tasks: list[TaskRecord]
    points: float
    max: float
    seconds: dict[str, float]


def same_grades(a: Record, b: Record) -> bool:
    """Whether two records agree in everything but how long it took."""
    return {**a, "seconds": {}} == {**b, "seconds": {}}
