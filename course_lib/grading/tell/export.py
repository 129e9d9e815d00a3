"""Grades for an LMS or a spreadsheet: CSV in UTF-8 with a mark at its start, in which nothing runs.

Canvas: the columns of its gradebook import (Student, ID, SIS User ID, SIS Login ID, Section, then one an assignment;
EX is excused). Moodle: an assignment's grading worksheet (Identifier "Participant 123", Full name, Grade, Feedback
comments). csv: one column a task, and everything that stands behind the sum.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from course_lib.grading.safe_text import safe_cell

from .pages import write_text

__all__ = ["FORMATS", "csv_text", "export_text", "write_export"]

FORMATS = ("canvas", "moodle", "csv")
OPEN = ("unreadable", "infrastructure", "waiting")
"""Of these a person must decide first: their cells stay empty, which is not 0."""


def write_export(standings: Sequence[Any], form: str, path: Path) -> int:
    """Write the grades, and say how many rows were left empty because a person must decide first."""
    write_text(path, "\ufeff" + export_text(standings, form))
    return sum(one.status in OPEN or one.to_mark > 0 for one in standings)


def export_text(standings: Sequence[Any], form: str) -> str:
    """The CSV as text, with the line ends that spreadsheets expect."""
    return csv_text({"canvas": _canvas, "moodle": _moodle, "csv": _plain}[form](standings))


def csv_text(rows: Sequence[Sequence[Any]]) -> str:
    """Rows as CSV in which no cell runs."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    for row in rows:
        writer.writerow([safe_cell(value) for value in row])
    return out.getvalue()


def _grade(one: Any, excused: str = "") -> Any:
    if one.status == "excused":
        return excused
    if one.status in OPEN or one.to_mark:
        return ""
    return 0 if one.status == "nothing handed in" else round(one.points, 2)


def _canvas(standings: Sequence[Any]) -> list[list[Any]]:
    """One row a student, one column a lab."""
    labs = sorted({one.lab for one in standings})
    people: dict[str, dict[str, Any]] = {}
    for one in standings:
        people.setdefault(one.student, {})[one.lab] = one
    most = {one.lab: one.max for one in standings}
    rows: list[list[Any]] = [
        ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", *(f"Lab {lab}" for lab in labs)]
    ]
    rows.append(["    Points Possible", "", "", "", "", *(most[lab] for lab in labs)])
    for student, by_lab in people.items():
        if student:
            one = next(iter(by_lab.values()))
            grades = [_grade(by_lab[lab], "EX") if lab in by_lab else "" for lab in labs]
            rows.append([one.name or student, student, "", "", one.group, *grades])
    return rows


def _moodle(standings: Sequence[Any]) -> list[list[Any]]:
    rows: list[list[Any]] = [
        ["Identifier", "Full name", "Lab", "Status", "Grade", "Maximum grade", "Feedback comments"]
    ]
    for one in standings:
        if one.student:
            who = f"Participant {one.student}" if one.student.isdigit() else one.student
            rows.append([who, one.name or one.student, one.lab, one.status, _grade(one), one.max, _comment(one)])
    return rows


def _comment(one: Any) -> str:
    """One line a task, in the words of the feedback page."""
    if one.status in OPEN:
        return one.waits
    parts = [f"Task {task.number}: {_mark(task)}" for task in one.tasks]
    if one.kept < 1 and one.late_reason:
        parts.append(one.late_reason)
    return "; ".join(parts)


def _mark(task: Any) -> str:
    if task.open:
        return f"up to {task.max:g}, to be marked"
    return f"{task.points:g} of {task.max:g}"


def _plain(standings: Sequence[Any]) -> list[list[Any]]:
    ids = sorted({(task.id, task.title) for one in standings for task in one.tasks})
    head = ["id", "name", "group", "lab", "status", "attempt", "of attempts", "still to mark"]
    rows: list[list[Any]] = [
        [*head, *(f"{name} {title}" for name, title in ids), "sum", "kept", "total", "maximum", "late"]
    ]
    for one in standings:
        points = {task.id: task.points for task in one.tasks}
        known = one.status in ("graded",)
        row = [one.student, one.name, one.group, one.lab, one.status, one.attempt, one.attempts, one.to_mark]
        row += [points.get(name, "") if known else "" for name, _ in ids]
        row += [one.raw if known else "", one.kept if known else "", _grade(one), one.max, one.late_reason]
        rows.append(row)
    return rows
