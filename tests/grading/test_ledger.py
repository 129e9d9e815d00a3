"""The ledger: nothing is lost or doubled, whatever ends the grader; what was decided stays."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import pytest

from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.intake import Submission
from course_lib.grading.ledger.ledger import Decision, Ledger
from course_lib.grading.records import FORMAT, Record
from course_lib.grading.tell.export import csv_text

UNDER = {"lab": "00", "lab_version": "v1", "environment": "e", "grader": "g", "isolation": "i", "per_student": False}


def one(student: str = "ann", digest: str = "a" * 64, **changed) -> Submission:
    values = dict(
        student=student,
        named=student,
        lab="00",
        sha256=digest,
        path=f"{student}/lab.ipynb",
        received="",
        late=False,
        suffix=0,
        layout="folders",
    )
    return Submission(**values | changed)


def record(seed: int, status: str = "graded", points: float = 1.0, **changed) -> Record:
    values = dict(
        format=FORMAT,
        submission="a" * 64,
        lab="00",
        lab_version="v1",
        seed=seed,
        environment="e",
        grader="g",
        isolation="i",
        status=status,
        reason="",
        notices=[],
        tasks=[],
        points=points,
        max=1.0,
        seconds={},
    )
    return Record(**values | changed)


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "ledger.sqlite"


def test_the_seed_is_kept_before_anything_is_graded(path):
    with Ledger(path) as ledger:
        first = ledger.begin(seed=None, **UNDER)
    with Ledger(path) as ledger:
        assert ledger.begin(seed=None, **UNDER) == first
        other = ledger.begin(seed=7, **UNDER)
        assert other.id != first.id and ledger.begin(seed=7, **UNDER) == other
        assert ledger.begin(seed=None, **UNDER | {"lab_version": "v2"}).id not in (first.id, other.id)


def test_a_submission_is_graded_once(path):
    with Ledger(path) as ledger:
        run = ledger.begin(seed=7, **UNDER)
        [entry] = ledger.take([one()])
        assert ledger.take([one()]) == [entry] and entry.status == ""
        ledger.record(run, entry, record(run.seed, "infrastructure"))
        assert ledger.take([one()])[0].status == "infrastructure"
        ledger.record(run, entry, record(run.seed))
        assert ledger.take([one()])[0].status == "graded"
        with pytest.raises(CourseError, match="graded already"):
            ledger.record(run, entry, record(run.seed, points=0.0))
        assert ledger.newest(entry)["points"] == 1.0


def test_each_student_may_have_inputs_of_their_own(path):
    with Ledger(path) as ledger:
        run = ledger.begin(seed=7, **UNDER | {"per_student": True})
        ann, bob = ledger.take([one("ann"), one("bob", "b" * 64)])
        seeds = {ledger.seed_of(run, ann), ledger.seed_of(run, bob)}
        assert len(seeds) == 2 and run.seed not in seeds
        assert ledger.seed_of(run, ann) in seeds


def test_a_typed_seed_is_mixed_with_what_only_this_ledger_knows(path, tmp_path):
    with Ledger(path) as ledger, Ledger(tmp_path / "other.sqlite") as other:
        seeds = {ledger.begin(seed=number, **UNDER).seed for number in (2, 3)}
        seeds |= {other.begin(seed=number, **UNDER).seed for number in (2, 3)}
        assert len(seeds) == 4 and min(seeds) > 10**6
        drawn = ledger.begin(seed=4, **UNDER, draw=lambda lab, among: among[3])  # the first three are not fair
        assert ledger.begin(seed=4, **UNDER) == drawn


def test_a_later_submission_of_a_student_is_asked_something_else(path):
    with Ledger(path) as ledger:
        run = ledger.begin(seed=None, **UNDER)
        ann, bob, again = ledger.take([one("ann"), one("bob", "b" * 64), one("ann", "c" * 64, path="2.ipynb")])
        assert ledger.seed_of(run, ann) == ledger.seed_of(run, bob) == run.seed != ledger.seed_of(run, again)


def test_records_and_decisions_cannot_be_changed_or_deleted(path):
    with Ledger(path) as ledger:
        run = ledger.begin(seed=7, **UNDER)
        [entry] = ledger.take([one()])
        ledger.record(run, entry, record(run.seed))
        ledger.decide(Decision("ann", "00", "adjust", "me", "because", entry.id, "00-1", 0.5))
        for table in ("records", "decisions"):
            for words in (f"UPDATE {table} SET added = ''", f"DELETE FROM {table}"):
                with pytest.raises(sqlite3.IntegrityError, match="never"):
                    ledger.db.execute(words)
        assert len(ledger.records(entry)) == len(ledger.decisions("ann", "00")) == 1


def test_two_graders_at_once(path):
    with Ledger(path), pytest.raises(CourseError, match="another grader"):
        Ledger(path).__enter__()
    with Ledger(path) as ledger:
        ledger.begin(seed=7, **UNDER)
        with Ledger(path, write=False) as reader:  # who only reads may
            assert reader.entries() == []


@pytest.mark.parametrize("content", [b"", b"not a database at all, but long enough to look like a file" * 20])
def test_a_file_that_is_no_ledger_is_left_alone(path, content):
    path.write_bytes(content)
    with pytest.raises(CourseError, match="left as it is"):
        Ledger(path, write=bool(content)).__enter__()
    assert path.read_bytes() == content


@pytest.mark.parametrize(("version", "sentence"), [(99, "newer version .*update"), (1, "older version .*new folder")])
def test_a_ledger_of_another_course_is_left_alone(path, version, sentence):
    with Ledger(path) as ledger:
        ledger.db.execute("UPDATE about SET version = ?", (version,))
    before = path.read_bytes()
    with pytest.raises(CourseError, match=sentence):
        Ledger(path).__enter__()
    assert path.read_bytes() == before


def test_there_are_no_grades_yet(tmp_path):
    with pytest.raises(CourseError, match="holds no grades"):
        Ledger(tmp_path / "ledger.sqlite", write=False).__enter__()


def test_a_person_says_whose_a_submission_is(path):
    with Ledger(path) as ledger:
        [entry] = ledger.take([one("", named="who?", path="who/lab.ipynb")])
        ledger.decide(Decision("ann", "00", "assign", "me", "she said so", entry.id))
        assert [entry.student for entry in ledger.entries("00")] == ["ann"]


@pytest.mark.parametrize("student", ["ann", 'Zoë, "O\'Neil" 🙂', "مها", "0' OR 1=1; --"])
def test_forgetting_leaves_no_byte(path, student):
    with Ledger(path) as ledger:
        run = ledger.begin(seed=7, **UNDER)
        mine, shared, others = ledger.take(
            [
                one(student, "a" * 64, path="1/x.ipynb"),
                one(student, "b" * 64, path="2/x.ipynb"),
                one("bob", "b" * 64, path="3/x.ipynb"),
            ],
        )
        for entry in (mine, shared, others):
            ledger.record(run, entry, record(run.seed, reason=f"of {entry.student}"))
        ledger.decide(Decision(student, "00", "adjust", "me", f"because {student}", mine.id, "00-1", 1.0))
        ledger.set_settings("roster", csv_text([["id", "name", "group"], [student, student, ""], ["bob", "Bob", ""]]))
        ledger.set_settings("extensions", csv_text([["student", "lab", "due"], [student, "00", "excused"]]))
        assert ledger.forget(student) == ["a" * 64]
        assert "bob,Bob" in ledger.settings("roster")
        assert [entry.student for entry in ledger.entries()] == ["bob"] and ledger.newest(others)["points"] == 1.0
    left = b"".join(file.read_bytes() for file in path.parent.iterdir())
    assert student.encode() not in left and json.dumps(student)[1:-1].encode() not in left


def test_the_full_disk_is_one_sentence(path):
    with Ledger(path) as ledger:
        ledger.db.execute("PRAGMA max_page_count = 20")
        run = ledger.begin(seed=7, **UNDER)
        [entry] = ledger.take([one()])
        with pytest.raises(CourseError, match="cannot be written .*full.* the disk /"):
            ledger.record(run, entry, record(run.seed, reason="x" * 200_000))
        ledger.record(run, entry, record(run.seed))
        assert len(ledger.records(entry)) == 1
