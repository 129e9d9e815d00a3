"""The ledger is personal data: erasing one student from a folder of grades."""

from __future__ import annotations

from pathlib import Path

from course_lib import tasks
from course_lib.authoring.tree import CourseError, nearest
from course_lib.grading.intake.roster import read_roster
from course_lib.grading.safe_text import page_name

from .ledger import Ledger

__all__ = ["forget"]


def forget(ledger: Ledger, student: str, grades: Path) -> int:
    """Erase rows, originals that nobody else handed in, and feedback pages; how many files went.

    Raises
    ------
    CourseError
        If nothing of such a student is there.
    """
    people = read_roster(text).people if (text := ledger.settings("roster")) else ()
    known = {entry.student for entry in ledger.entries()} | {person.id for person in people}
    if student not in known or not student:
        raise CourseError(f"nobody with the id {student!r} is in {grades}.{nearest(student, known)}")
    files = [grades / "originals" / digest[:2] / digest for digest in ledger.forget(student)]
    files += [grades / "feedback" / page_name(student, lab) for lab in tasks.lab_numbers()]
    index = grades / "feedback" / "index.html"
    gone = 0
    for path in [*files, index]:
        if path.exists():
            path.unlink()
            gone += path != index
    return gone
