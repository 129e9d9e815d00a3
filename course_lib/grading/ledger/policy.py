"""When a lab is due, what lateness costs, and which attempt counts.

A late policy is a TOML file. Nothing in it is required; without a due date nothing is late but what the download
itself marks as late::

    timezone = "Europe/Berlin"        # of dates without an offset
    counts = "best"                   # which attempt: last (default), best, first, last-on-time
    grace_minutes = 15                # late by less is not late

    [due]
    "03" = 2026-11-24T23:59:00

    [[steps]]                         # from so many hours late on, so many percent are kept
    hours = 0
    keep = 80
    [[steps]]
    hours = 48
    keep = 0

The time of a submission is what the download's files say. Extensions are a CSV file; a row moves one student's due date
of one lab, or excuses from it, which is not 0::

    student,lab,due
    12345,03,2026-12-01T23:59:00+01:00
    12346,03,excused
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from course_lib.authoring.tree import CourseError, nearest
from course_lib.grading.intake.roster import rows_of, student_id, text_of

__all__ = ["COLUMNS", "Attempt", "Extensions", "Policy", "read_extensions", "read_policy"]

COLUMNS = ("student", "lab", "due")
COUNTS = ("last", "best", "first", "last-on-time")
KEYS = ("timezone", "counts", "grace_minutes", "due", "steps")


@dataclass(frozen=True)
class Attempt:
    """One attempt of a student at a lab: its `points` after lateness, and the `most` it can get."""

    number: int
    late: bool
    points: float
    most: float


@dataclass(frozen=True)
class Extensions:
    """(student, lab) to a new due date as ISO text, or "excused"."""

    rows: dict[tuple[str, str], str] = field(default_factory=dict)

    def excused(self, student: str, lab: str) -> bool:
        """Whether this lab does not count for this student."""
        return self.rows.get((student, lab)) == "excused"


@dataclass(frozen=True)
class Policy:
    """What this module's text describes."""

    due: dict[str, str] = field(default_factory=dict)
    steps: tuple[tuple[float, float], ...] = ()
    grace_minutes: float = 0.0
    counts: str = "last"
    timezone: str = "UTC"

    def kept(self, lab: str, student: str, received: str, late: bool, extensions: Extensions) -> tuple[float, str]:
        """The share of the points that is kept, and why, in one sentence; "" if nothing was late.

        Parameters
        ----------
        received : ISO text, or "" where the download does not tell; then only its mark of lateness is known.
        late : whether the download marks it as late.
        """
        due = extensions.rows.get((student, lab)) or self.due.get(lab, "")
        if due == "excused":
            return 1.0, ""
        if not due or not received:
            if not late or (student, lab) in extensions.rows:
                return 1.0, ""
            return self._keep(
                0.0
            ), f"Marked as late by the download: {100 * self._keep(0.0):g} % of the points are kept."
        over = self._time(received) - self._time(due)
        if over <= timedelta(minutes=self.grace_minutes):
            return 1.0, ""
        hours = over.total_seconds() / 3600
        keep = self._keep(hours)
        return keep, f"Handed in {hours:.1f} h after it was due: {100 * keep:g} % of the points are kept."

    def _keep(self, hours: float) -> float:
        kept = 1.0
        for least, percent in sorted(self.steps):
            if hours >= least:
                kept = percent / 100
        return kept

    def _time(self, text: str) -> datetime:
        time = datetime.fromisoformat(text)
        return time if time.tzinfo else time.replace(tzinfo=ZoneInfo(self.timezone))

    def choose(self, attempts: Sequence[Attempt]) -> int:
        """The place of the attempt that counts; while a person decides, the best is the one that can become it."""
        places = range(len(attempts))
        if self.counts == "first":
            return min(places, key=lambda i: attempts[i].number)
        if self.counts == "best":
            return max(places, key=lambda i: (attempts[i].most, attempts[i].points, attempts[i].number))
        on_time = [i for i in places if not attempts[i].late]
        if self.counts == "last-on-time" and on_time:
            return max(on_time, key=lambda i: attempts[i].number)
        return max(places, key=lambda i: attempts[i].number)


def read_policy(source: Path | str) -> Policy:
    """Read a late policy; see this module for its form.

    Raises
    ------
    CourseError
        Naming the file and what is wrong in it.
    """
    text, name = text_of(source)
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CourseError(f"{name} cannot be read as TOML: {error}.") from None
    for key in values:
        if key not in KEYS:
            raise CourseError(f"{name}: there is no setting {key!r}.{nearest(key, KEYS)}")
    zone = values.get("timezone", "UTC")
    try:
        ZoneInfo(zone)
    except (ZoneInfoNotFoundError, ValueError, TypeError):
        raise CourseError(f"{name}: there is no time zone {zone!r}; one is 'Europe/Berlin'.") from None
    if values.get("counts", "last") not in COUNTS:
        raise CourseError(f"{name}: counts = {values['counts']!r} is none of {', '.join(COUNTS)}.")
    grace = values.get("grace_minutes", 0)
    if isinstance(grace, bool) or not isinstance(grace, (int, float)) or grace < 0:
        raise CourseError(f"{name}: grace_minutes = {grace!r} must be a number of minutes.")
    due = {_lab(name, lab): _due(name, lab, when) for lab, when in values.get("due", {}).items()}
    steps = []
    for step in values.get("steps", []):
        hours, keep = step.get("hours"), step.get("keep")
        if (
            not isinstance(hours, (int, float))
            or not isinstance(keep, (int, float))
            or hours < 0
            or not 0 <= keep <= 100
        ):
            raise CourseError(f"{name}: a step needs hours (0 or more) and keep (0 to 100 percent).")
        steps.append((float(hours), float(keep)))
    return Policy(due, tuple(steps), float(grace), values.get("counts", "last"), zone)


def _lab(where: str, text: str) -> str:
    match = re.match(r"\d\d?", text)
    if not match:
        raise CourseError(f"{where}: {text!r} is no lab; a lab is a number such as 03.")
    return match[0].zfill(2)


def _due(where: str, lab: str, when: Any) -> str:
    if isinstance(when, datetime):
        return when.isoformat()
    try:
        return datetime.fromisoformat(str(when)).isoformat()
    except ValueError:
        raise CourseError(f"{where}: the due date {when!r} of {lab} is no date such as 2026-11-24T23:59:00.") from None


def read_extensions(source: Path | str) -> Extensions:
    """Read extensions; see this module for their form.

    Raises
    ------
    CourseError
        Naming file and line.
    """
    rows, name = {}, text_of(source)[1]
    for line, row in rows_of(source, COLUMNS):
        where = f"{name}, line {line}"
        if not row["student"]:
            raise CourseError(f"{where}: the student is missing.")
        excused = row["due"].lower() == "excused"
        due = "excused" if excused else _due(where, row["lab"], row["due"])
        rows[student_id(row["student"]), _lab(where, row["lab"])] = due
    return Extensions(rows)
