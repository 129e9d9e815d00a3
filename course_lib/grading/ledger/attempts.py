"""What counts now: the attempt that the policy chooses, the newest grade of it, and what people decided since."""

from __future__ import annotations

from dataclasses import dataclass

from course_lib import tasks
from course_lib.grading.intake.roster import Roster
from course_lib.grading.records import Record, TaskRecord
from course_lib.grading.release.released import released_lab

from .ledger import Decision, Entry, Ledger
from .policy import Attempt, Extensions, Policy

__all__ = ["Standing", "TaskStanding", "standings"]


@dataclass(frozen=True)
class TaskStanding:
    """One task: what the grader gave, what counts, and by whom."""

    id: str
    number: int
    title: str
    max: float
    auto: float
    points: float
    by: str
    reason: str
    record: TaskRecord | None


@dataclass(frozen=True)
class Standing:
    """A student at a lab.

    Parameters
    ----------
    status : "graded", "excused", "unreadable", "infrastructure", "nothing handed in", or "waiting" (matches nobody).
    raw : sum of the tasks; `kept` the share that lateness leaves; `points` what counts.
    to_mark : tasks that a person still has to mark.
    """

    student: str
    name: str
    group: str
    lab: str
    status: str
    attempt: int
    attempts: int
    tasks: tuple[TaskStanding, ...]
    raw: float
    kept: float
    late_reason: str
    points: float
    max: float
    to_mark: int
    record: Record | None
    entry: Entry | None


def standings(ledger: Ledger, lab: str | None = None, student: str | None = None) -> list[Standing]:
    """What counts, by lab and then in the order of the roster; whoever is not in it comes after."""
    roster = Roster.from_dict(ledger.settings("roster") or {"people": []})
    policy = Policy.from_dict(ledger.settings("policy") or {})
    extensions = Extensions.from_dict(ledger.settings("extensions") or {})
    entries = [entry for entry in ledger.entries(lab) if entry.lab in tasks.lab_numbers()]
    labs = sorted({entry.lab for entry in entries})
    place = {person.id: i for i, person in enumerate(roster.people)}
    found = []
    for number in labs:
        here = [entry for entry in entries if entry.lab == number]
        people = list(dict.fromkeys([person.id for person in roster.people] + [e.student for e in here if e.student]))
        people.sort(key=lambda who: (place.get(who, len(place)), who))
        for who in people:
            mine = [entry for entry in here if entry.student == who]
            found.append(_standing(ledger, roster, policy, extensions, number, who, mine))
        for entry in here:
            if not entry.student:
                found.append(_standing(ledger, roster, policy, extensions, number, "", [entry]))
    return [one for one in found if student is None or one.student == student]


def _standing(
    ledger: Ledger,
    roster: Roster,
    policy: Policy,
    extensions: Extensions,
    lab: str,
    student: str,
    entries: list[Entry],
) -> Standing:
    person = roster.person(student)
    decisions = ledger.decisions(student, lab) if student else []
    excused = extensions.excused(student, lab) or any(one.kind == "excuse" for one in decisions)
    most = released_lab(lab).points
    options = []
    for entry in entries:
        record = ledger.newest(entry)
        done = _tasks(record, decisions)
        kept, why = policy.kept(lab, student, entry.received, entry.late, extensions)
        raw = round(sum(task.points for task in done), 2)
        options.append((entry, record, done, kept, why, raw))
    attempts = [Attempt(entry.attempt, kept < 1, raw * kept) for entry, _, _, kept, _, raw in options]
    gone = not options
    entry, record, done, kept, why, raw = (None, None, (), 1.0, "", 0.0) if gone else options[policy.choose(attempts)]
    status = "nothing handed in" if gone else record["status"] if record is not None else "infrastructure"
    status = "excused" if excused else "waiting" if not student else status
    to_mark = sum(t.record is not None and t.record["status"] == "by hand" and t.by == "grader" for t in done)
    return Standing(
        student=student,
        name=person.name if person else (student or (entry.named if entry else "")),
        group=person.group if person else "",
        lab=lab,
        status=status,
        attempt=entry.attempt if entry else 0,
        attempts=len(entries),
        tasks=done,
        raw=raw,
        kept=kept,
        late_reason=why,
        points=round(raw * kept, 2),
        max=record["max"] if record is not None else most,
        to_mark=to_mark if status == "graded" else 0,
        record=record,
        entry=entry,
    )


def _tasks(record: Record | None, decisions: list[Decision]) -> tuple[TaskStanding, ...]:
    """Each task with the last that a person decided of it."""
    found = []
    for task in record["tasks"] if record is not None else ():
        decided = [one for one in decisions if one.task == task["id"] and one.kind in ("adjust", "mark", "kept")]
        last = decided[-1] if decided else None
        points = task["points"] if last is None or last.points is None else last.points
        found.append(
            TaskStanding(
                id=task["id"],
                number=task["number"],
                title=task["title"],
                max=task["max"],
                auto=task["points"],
                points=points,
                by="grader" if last is None else last.who,
                reason="" if last is None else last.reason,
                record=task,
            )
        )
    return tuple(found)
