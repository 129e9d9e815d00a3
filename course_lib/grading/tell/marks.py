"""Tasks that a person marks: their answers as a CSV with the rubric, and the points from it into the ledger."""

from __future__ import annotations

from pathlib import Path

from course_lib import tasks
from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.roster import rows_of
from course_lib.grading.ledger.attempts import Standing, TaskStanding, standings
from course_lib.grading.ledger.ledger import Decision, Ledger
from course_lib.grading.safe_text import clean, safe_cell

from .export import csv_text
from .pages import write_text

__all__ = ["read_marks", "write_marks"]

COLUMNS = (
    *("student", "submission", "task", "answer", "before", "0 points", "1 point", "2 points", "points", "comment"),
)


def write_marks(ledger: Ledger, lab: str, path: Path) -> int:
    """Write what is to be marked, in the order of the submissions' hashes and without names; how many answers."""
    rows = []
    for one in sorted(standings(ledger, lab), key=lambda one: one.entry.sha256 if one.entry else ""):
        for task in one.tasks:
            if one.status == "graded" and _by_hand(task):
                points = "" if task.by == "grader" else task.points
                text = clean(task.record["text"] or task.record["source"], 5000)
                comment = "" if task.by == "grader" else task.reason
                rubric = tasks.get(task.id).rubric or ("", "", "")
                row = [one.student, one.entry.sha256[:12], task.id, text, task.before, *rubric, points, comment]
                rows.append(row)
    write_text(path, "\ufeff" + csv_text([list(COLUMNS), *rows]))
    return len(rows)


def read_marks(ledger: Ledger, path: Path, who: str) -> int:
    """Take the points of such a file over, all or none; rows without points are left. How many were new.

    Raises
    ------
    CourseError
        Naming the line: a student or task that is not there, an answer that changed since, points out of range.
    """
    decisions = []
    known: dict[str, list[Standing]] = {}
    for line, row in rows_of(path, ("student", "submission", "task", "points")):
        if not row["points"]:
            continue
        where = f"{path.name}, line {line}"
        lab = row["task"][:2]
        if lab not in tasks.lab_numbers():
            raise CourseError(f"{where}: there is no task {row['task']!r}.")
        known.setdefault(lab, standings(ledger, lab))
        one = next((s for s in known[lab] if s.student and safe_cell(s.student) == row["student"]), None)
        if one is None:
            raise CourseError(f"{where}: nobody has the id {row['student']!r}.")
        if one.entry is None or one.entry.sha256[:12] != row["submission"]:
            raise CourseError(f"{where}: {one.student} has handed in again since; write the file once more.")
        task = next((task for task in one.tasks if task.id == row["task"]), None)
        if task is None or not _by_hand(task):
            raise CourseError(f"{where}: task {row['task']} of {one.student} is not one to mark by hand.")
        points = _points(row["points"], task.max, where)
        comment = row.get("comment", "")
        if task.by == "grader" or task.points != points or task.reason != comment:
            decisions.append(Decision(one.student, lab, "mark", who, comment, one.entry.id, task.id, points))
    ledger.decide(*decisions)
    return len(decisions)


def _by_hand(task: TaskStanding) -> bool:
    """Whether a person gives the points, or gave them: for what only people can mark, or is to be decided again."""
    return task.open or task.record["status"] == "by hand"


def _points(text: str, most: float, where: str) -> float:
    try:
        points = float(text.replace(",", "."))
    except ValueError:
        raise CourseError(f"{where}: {text!r} is no number of points.") from None
    if not 0 <= points <= most:
        raise CourseError(f"{where}: {text} points are not between 0 and {most:g}.")
    return points
