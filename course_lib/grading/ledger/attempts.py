"""What counts now: the attempt that the policy chooses, the newest grade of it, and what people decided of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from course_lib import tasks
from course_lib.grading.intake.roster import Roster, read_roster
from course_lib.grading.records import Record, TaskRecord
from course_lib.grading.release.released import released_lab

from .ledger import Decision, Entry, Ledger
from .policy import Attempt, Extensions, Policy, read_extensions, read_policy

__all__ = ["Standing", "TaskStanding", "policy_of", "standings"]

POINTS = ("adjust", "mark", "kept")
"""Kinds of decisions that give points to a task; the last counts. "kept" is `regrade --never-lower`, no person."""


@dataclass(frozen=True)
class TaskStanding:
    """One task: what the grader gave, what counts, and by whom.

    Parameters
    ----------
    before : what a person decided of an earlier attempt, where nobody has of this one: to be decided again.
    """

    id: str
    number: int
    title: str
    max: float
    auto: float
    points: float
    by: str
    reason: str
    record: TaskRecord
    before: str = ""

    @property
    def open(self) -> bool:
        """Whether a person still has to give the points."""
        return self.by == "grader" and (self.before != "" or self.record["status"] == "by hand")


@dataclass(frozen=True)
class Standing:
    """A student at a lab.

    Parameters
    ----------
    status : "graded", "excused", "unreadable", "infrastructure", "nothing handed in", or "waiting" (it matches nobody,
        or nobody can tell which of two files is the later one).
    raw : sum of the tasks; `kept` the share that lateness leaves; `points` what counts.
    to_mark : tasks that a person still has to give points for.
    waits : why a person must look, beside marking what only people can mark; "" if none must.
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
    waits: str = ""


@dataclass(frozen=True)
class _Rules:
    """What decides, beside the records: all of it is kept in the ledger."""

    roster: Roster
    policy: Policy
    extensions: Extensions
    decisions: dict[int | None, list[Decision]]


def policy_of(ledger: Ledger) -> Policy:
    """When labs are due, what lateness costs, which attempt counts."""
    return read_policy(ledger.settings("policy"))


def standings(ledger: Ledger, lab: str | None = None, student: str | None = None) -> list[Standing]:
    """What counts, by lab and then in the order of the roster; whoever is not in it comes after."""
    rules = _Rules(
        read_roster(text) if (text := ledger.settings("roster")) else Roster(()),
        policy_of(ledger),
        read_extensions(text) if (text := ledger.settings("extensions")) else Extensions(),
        {},
    )
    for decision in ledger.decisions():
        rules.decisions.setdefault(decision.entry, []).append(decision)
    groups: dict[tuple[str, str, int], list[Entry]] = {}
    for entry in ledger.entries(lab):
        if entry.lab in tasks.lab_numbers():
            groups.setdefault((entry.lab, entry.student, 0 if entry.student else entry.id), []).append(entry)
    for number in {entry.lab for some in groups.values() for entry in some if entry.status == "graded"}:
        for person in rules.roster.people:
            groups.setdefault((number, person.id, 0), [])
    place = {person.id: i for i, person in enumerate(rules.roster.people)}
    order = sorted(groups, key=lambda key: (key[0], key[2], place.get(key[1], len(place)), key[1]))
    return [
        _standing(ledger, rules, number, who, sorted(groups[number, who, stranger], key=lambda one: one.attempt))
        for number, who, stranger in order
        if student is None or who == student
    ]


@dataclass(frozen=True)
class _Option:
    """One attempt, as it would count."""

    entry: Entry
    record: Record | None
    tasks: tuple[TaskStanding, ...]
    kept: float
    late_reason: str

    @property
    def raw(self) -> float:
        return round(sum(task.points for task in self.tasks), 2)

    def attempt(self) -> Attempt:
        """What the policy chooses by."""
        more = sum(task.max - task.points for task in self.tasks if task.open)
        return Attempt(self.entry.attempt, self.kept < 1, self.raw * self.kept, (self.raw + more) * self.kept)


def _standing(ledger: Ledger, rules: _Rules, lab: str, student: str, entries: list[Entry]) -> Standing:
    options, before = [], dict[str, Decision]()
    for entry in entries:
        record = ledger.newest(entry)
        late = rules.policy.kept(lab, student, entry.received, entry.late, rules.extensions)
        mine = {one.task: one for one in rules.decisions.get(entry.id, ()) if one.kind in POINTS}
        options.append(_Option(entry, record, tuple(_tasks(record, mine, before)), *late))
        before |= {task: one for task, one in mine.items() if one.kind != "kept"}
    person = rules.roster.person(student)
    excuses = [one for one in rules.decisions.get(None, ()) if (one.student, one.lab) == (student, lab)]
    one = options[rules.policy.choose([option.attempt() for option in options])] if options else None
    tied = one is not None and one.entry.tied and rules.policy.counts != "best"
    if student and (excuses or rules.extensions.excused(student, lab)):
        status = "excused"
    elif one is None:
        status = "nothing handed in"
    elif not student or tied:
        status = "waiting"
    else:
        status = one.record["status"] if one.record is not None else "infrastructure"
    return Standing(
        student=student,
        name=person.name if person else (student or (one.entry.named if one else "")),
        group=person.group if person else "",
        lab=lab,
        status=status,
        attempt=one.entry.attempt if one else 0,
        attempts=len(entries),
        tasks=one.tasks if one else (),
        raw=one.raw if one else 0.0,
        kept=one.kept if one else 1.0,
        late_reason=one.late_reason if one else "",
        points=round(one.raw * one.kept, 2) if one else 0.0,
        max=one.record["max"] if one and one.record is not None else released_lab(lab).points,
        to_mark=sum(task.open for task in one.tasks) if one and status == "graded" else 0,
        record=one.record if one else None,
        entry=one.entry if one else None,
        waits=" ".join(_waits(one, status, entries)) if one else "",
    )


def _tasks(
    record: Record | None, decisions: dict[str, Decision], before: dict[str, Decision]
) -> Iterator[TaskStanding]:
    """Each task with the last that a person decided of it, or else had decided of an earlier attempt."""
    for task in record["tasks"] if record is not None else ():
        last, earlier = decisions.get(task["id"]), before.get(task["id"])
        yield TaskStanding(
            id=task["id"],
            number=task["number"],
            title=task["title"],
            max=task["max"],
            auto=task["points"],
            points=task["points"] if last is None or last.points is None else last.points,
            by="grader" if last is None else last.who,
            reason="" if last is None else last.reason,
            record=task,
            before=f"{earlier.points:g} by {earlier.who}: {earlier.reason}" if earlier and last is None else "",
        )


def _waits(one: _Option, status: str, entries: list[Entry]) -> Iterator[str]:
    """Why a person must look at the attempt that counts."""
    if status == "waiting" and not one.entry.student:
        yield f"It matches nobody in the roster: `adjust ID {one.entry.lab} {one.entry.id} --assign` says whose it is."
    elif status == "waiting":
        same = [entry for entry in entries if entry.tied and entry.received == one.entry.received]
        files = ", ".join(f"{entry.path} is number {entry.id}" for entry in same)
        yield (
            f"Files of the same second: {files}; `adjust {one.entry.student} {one.entry.lab} NUMBER --assign` says "
            "which is the later one."
        )
    elif status == "unreadable" and one.record is not None:
        yield one.record["reason"]
    elif status == "graded":
        for task in one.tasks:
            if task.open and task.record["reason"] == "text cell":
                yield task.record["error"]
            if task.open and task.before:
                yield f"Task {task.number}: decide again, an earlier attempt had {task.before}."
