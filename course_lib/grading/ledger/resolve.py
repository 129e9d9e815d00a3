"""Which student, lab and task a person means on the command line."""

from __future__ import annotations

import re

from course_lib import tasks
from course_lib.authoring.tree import CourseError, nearest
from course_lib.grading.ledger.attempts import Standing, standings
from course_lib.grading.ledger.ledger import Entry, Ledger
from course_lib.grading.safe_text import clean, shown

__all__ = ["find_lab", "find_standing", "find_submission", "find_task"]


def find_lab(name: str) -> str:
    """The number of a lab from "3", "03" or its name."""
    match = re.match(r"(\d\d?)(?:_|$)", name)
    number = match[1].zfill(2) if match else name
    if number not in tasks.lab_numbers():
        raise CourseError(f"there is no lab {name!r}; there are {', '.join(tasks.lab_numbers())}.")
    return number


def find_task(lab: str, name: str) -> tasks.Task:
    """The task of a lab from "2" or "03-2"."""
    number = name.removeprefix(f"{lab}-")
    for task in tasks.lab(lab):
        if str(task.number) == number:
            return task
    known = ", ".join(task.id for task in tasks.lab(lab))
    raise CourseError(f"lab {lab} has no task {name!r}; it has {known}.")


def find_standing(ledger: Ledger, student: str, lab: str) -> Standing:
    """Where a student stands at a lab."""
    everybody = standings(ledger, lab)
    for one in everybody:
        if one.student == shown(student) and student:
            return one
    people = [clean(name) for one in everybody for name in (one.student, one.name) if name]
    raise CourseError(f"nobody with the id {student!r} is known at lab {lab}.{nearest(student, people)}")


def find_submission(ledger: Ledger, lab: str, name: str) -> Entry:
    """A submission that waits for whose, or which, it is, by its number or by its path as it is shown."""
    waiting = [one for one in ledger.entries(lab) if not one.student or one.tied]
    found = [one for one in waiting if str(one.id) == name] or [one for one in waiting if one.path == shown(name)]
    if len(found) == 1:
        return found[0]
    listed = ", ".join(f"{one.id} ({clean(one.path)})" for one in found or waiting)
    problem = "is the path of several: say its number" if found else "does not wait"
    raise CourseError(f"{name!r} {problem}; waiting are: {listed or 'none'}.")
