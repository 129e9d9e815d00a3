"""Records and standings made by hand, for tests of what is told about them."""

from __future__ import annotations

from course_lib.grading.ledger.attempts import Standing, TaskStanding
from course_lib.grading.ledger.ledger import Entry
from course_lib.grading.records import FORMAT, Notice, Record, TaskRecord


def task_record(number: int = 1, **changed) -> TaskRecord:
    values = dict(
        id=f"03-{number}",
        number=number,
        title="lift",
        kind="write",
        version=1,
        max=3.0,
        points=0.0,
        status="failed",
        reason="wrong",
        error="x is off by 3 m.",
        looks_like="This looks like rows for columns.",
        misconceptions=["rows for columns"],
        where="Where to look: lesson 03.",
        told="depth (30, 40), SECRET-INPUT",
        source="SECRET-SOURCE",
        text="",
    )
    return TaskRecord(**values | changed)


def a_record(tasks: list[TaskRecord], **changed) -> Record:
    values = dict(
        format=FORMAT,
        submission="f" * 64,
        lab="03",
        lab_version="v",
        seed=987654321,
        environment="SECRET-MACHINE",
        grader="g",
        isolation="SECRET-FLAGS",
        status="graded",
        reason="",
        notices=[
            Notice(code="garbled", task="", text="SECRET-NOTICE"),
            Notice(code="moved", task="", text="It moved."),
        ],
        tasks=tasks,
        points=sum(task["points"] for task in tasks),
        max=15.0,
        seconds={},
    )
    return Record(**values | changed)


def standing(student: str = "ann", name: str = "Ann", tasks: list[TaskRecord] | None = None, **changed) -> Standing:
    records = [task_record()] if tasks is None else tasks
    record = changed.pop("record", a_record(records))
    entry = Entry(
        student=student,
        named=name,
        lab="03",
        sha256="f" * 64,
        path="SECRET-PATH",
        received="",
        late=False,
        suffix=0,
        layout="folders",
        id=1,
    )
    done = tuple(
        TaskStanding(
            one["id"], one["number"], one["title"], one["max"], one["points"], one["points"], "grader", "", one
        )
        for one in records
    )
    raw = sum(one["points"] for one in records)
    values = dict(
        student=student,
        name=name,
        group="A",
        lab="03",
        status="graded",
        attempt=1,
        attempts=1,
        tasks=done,
        raw=raw,
        kept=1.0,
        late_reason="",
        points=raw,
        max=15.0,
        to_mark=sum(one["status"] == "by hand" for one in records),
        record=record,
        entry=entry,
    )
    return Standing(**values | changed)


def standing_of(record: Record, student: str = "ann") -> Standing:
    """Where a student stands who has this record and nothing else."""
    return standing(student, "Ann", record["tasks"], record=record, lab=record["lab"], max=record["max"])
