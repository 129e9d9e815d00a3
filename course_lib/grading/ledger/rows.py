"""What stands in the ledger, a row each: runs, submissions, decisions."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from typing import Any, TypeVar

from course_lib.grading.intake.intake import Submission

TOLD = tuple(field.name for field in fields(Submission))
"""What the ledger keeps of a submission as it came."""


@dataclass(frozen=True)
class Run:
    """One grading of a lab: the seed of the fresh inputs, and under what they were graded; `limits` are JSON."""

    id: int
    lab: str
    lab_version: str
    environment: str
    grader: str
    seed: int
    per_student: bool
    limits: str
    isolation: str


@dataclass(frozen=True)
class Entry(Submission):
    """A submission as it stands in the ledger.

    Parameters
    ----------
    student : whom a person gave it to, if one did.
    attempt : 1, 2, … of this student at this lab, over all downloads.
    tied : whether nothing tells which of two files of its download is the later one.
    record, run, status : id of the record that counts, of the run that it is of, and its status; None and "" before.
    """

    id: int = 0
    attempt: int = 1
    tied: bool = False
    record: int | None = None
    run: int | None = None
    status: str = ""


@dataclass(frozen=True)
class Decision:
    """What a person decided of an attempt: kind "adjust", "mark", "kept" or "assign"; or of a whole lab: "excuse".

    Parameters
    ----------
    entry : id of the attempt's entry; None for "excuse".
    task : id; "" where it is of no single task.
    """

    student: str
    lab: str
    kind: str
    who: str
    reason: str
    entry: int | None = None
    task: str = ""
    points: float | None = None
    added: str = ""


Row = TypeVar("Row", Run, Entry, Decision)


def row_of(kind: type[Row], row: sqlite3.Row) -> Row:
    """A row of the database as a dataclass, which has its columns."""
    values: dict[str, Any] = {field.name: row[field.name] for field in fields(kind)}
    flags = {name: bool(values[name]) for name in ("late", "tied", "per_student") if name in values}
    return kind(**values | flags)


def now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
