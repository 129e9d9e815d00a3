"""What stands in the ledger, a row each: runs, submissions, decisions."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass
from datetime import UTC, datetime

from course_lib.grading.intake.intake import Submission

FIELDS = ("student", "named", "lab", "sha256", "path", "received", "late", "attempt", "layout", "trouble", "code")


@dataclass(frozen=True)
class Run:
    """One grading of a lab: the seed of the fresh inputs, and under what they were graded."""

    id: int
    lab: str
    lab_version: str
    environment: str
    grader: str
    seed: int
    per_student: bool
    isolation: str


@dataclass(frozen=True)
class Entry(Submission):
    """A submission as it stands in the ledger; `student` is whom a person gave it to, if one did."""

    id: int = 0


@dataclass(frozen=True)
class Decision:
    """What a person decided: kind "adjust", "mark", "excuse" or "assign" (then `task` is the path)."""

    student: str
    lab: str
    task: str
    kind: str
    points: float | None
    who: str
    reason: str
    added: str


def run_of(row: sqlite3.Row) -> Run:
    return Run(
        row["id"],
        row["lab"],
        row["lab_version"],
        row["environment"],
        row["grader"],
        row["seed"],
        bool(row["per_student"]),
        row["isolation"],
    )


def now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
