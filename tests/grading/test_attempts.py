"""Right grades where nobody means harm: which attempt counts, what was decided of it, and what is graded once."""

from __future__ import annotations

import base64
import csv
import io
import json
import os
import sqlite3
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from grading_helpers import submission
from rich.console import Console

from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.roster import Roster
from course_lib.grading.ledger import attempts, database, schema
from course_lib.grading.ledger.attempts import Standing, standings
from course_lib.grading.ledger.ledger import Decision, Ledger
from course_lib.grading.ledger.resolve import find_submission
from course_lib.grading.records import Record
from course_lib.grading.run import regrade
from course_lib.grading.run.grade_submission import unreadable_record
from course_lib.grading.run.limits import read_limits
from course_lib.grading.tell.export import export_text
from course_lib.grading.tell.feedback import feedback_page
from course_lib.grading.verbs import grade as grade_verb
from course_lib.grading.verbs import people
from course_lib.grading.verbs.grade import Settings, grade_folder

take = Ledger.take
NAME = "00_start_here.ipynb"
RIGHT = submission("00", {1: "def metres(depth_mm):\n    return depth_mm / 1000\n"})
WRONG = submission("00", {1: "def metres(depth_mm):\n    return depth_mm\n"})
ADA = "Ada Okafor_101_assignsubmission_file_"
WHY = ("--by", "A. Teacher", "--reason", "a slip")


def put(folder: Path, name: str, data: bytes, second: int = 1000) -> None:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    os.utime(path, (second, second))


class Class:
    """A folder of grades, and a grader that only looks for "/ 1000"; `jobs` are those of the last call."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.out = folder / "grades"
        self.roster = folder / "roster.csv"
        self.roster.write_text("id,name\n101,Ada Okafor\n102,Ben Fischer\n", encoding="utf-8")
        self.jobs: list[dict] = []

    def engine(self, jobs: Sequence[dict], on_record) -> None:
        self.jobs = list(jobs)
        for place, job in enumerate(jobs):
            right = float(b"/ 1000" in base64.b64decode(job["notebook"]))
            record = unreadable_record(job, "", "")
            record.update(status="graded", points=right, notices=[], isolation="none")
            record["tasks"][0].update(
                status="passed" if right else "failed", points=right, source="/ 1000" * bool(right)
            )
            record["tasks"][0].update(error="off", reason="")
            on_record(place, record)

    def grade(self, download: str, **told) -> tuple[int, str]:
        """The exit code, and what was said."""
        self.jobs = []
        said = io.StringIO()
        settings = Settings(self.folder / download, self.out, sandbox="none", roster=self.roster, **told)
        code = grade_folder(settings, self.engine, Console(file=said, width=300))
        return code, said.getvalue()

    def standings(self, student: str | None = "101") -> list[Standing]:
        with Ledger(self.out / "ledger.sqlite", write=False) as ledger:
            return standings(ledger, "00", student)

    def ada(self) -> Standing:
        [one] = self.standings()
        return one

    def exported(self, student: str = "101") -> str:
        rows = csv.DictReader(io.StringIO(export_text(self.standings(None), "csv")))
        return next(row["total"] for row in rows if row["id"] == student)

    def verb(self, name: str, *words: str):
        return CliRunner().invoke(getattr(people, name), [*words, "--grades", str(self.out)])

    def records(self) -> list[Record]:
        with Ledger(self.out / "ledger.sqlite", write=False) as ledger:
            return [record for entry in ledger.entries() for record in ledger.records(entry)]


@pytest.fixture
def one(tmp_path) -> Class:
    return Class(tmp_path)


def view_with(monkeypatch: pytest.MonkeyPatch, old: str, new: str) -> None:
    """Let new ledgers have another view."""
    assert schema.SCHEMA.count(old) == 1
    monkeypatch.setattr(database, "SCHEMA", schema.SCHEMA.replace(old, new))


@pytest.mark.parametrize("seconds", [(1000, 2000), (1000, 1000)])  # unpacked later, or as the LMS set both
@pytest.mark.parametrize("mended", [True, False])
def test_the_later_download_counts(one, monkeypatch, seconds, mended):
    if not mended:  # the control: numbered within a download, as if the others were not there
        view_with(monkeypatch, "PARTITION BY person, lab ORDER BY", "PARTITION BY person, lab, download ORDER BY")
    put(one.folder / "first", f"{ADA}/{NAME}", WRONG, seconds[0])
    put(one.folder / "second", f"{ADA}/{NAME}", RIGHT, seconds[1])
    assert one.grade("first")[0] == one.grade("second")[0] == 0
    ada = one.ada()
    assert ((ada.attempt, ada.attempts, one.exported()) == (2, 2, "1")) == mended


def test_an_older_download_that_is_graded_later_is_the_earlier_attempt(one):
    put(one.folder / "new", f"{ADA}/{NAME}", RIGHT, 2000)
    put(one.folder / "old", f"{ADA}/{NAME}", WRONG, 1000)
    one.grade("new")
    _, said = one.grade("old")
    assert (one.ada().attempt, one.exported()) == (2, "1") and "an attempt of another download counts" in said


def test_the_number_of_a_file_decides_where_times_do_not(one):
    put(one.folder / "class", f"{ADA}/00_start_here-1.ipynb", RIGHT)
    put(one.folder / "class", f"{ADA}/{NAME}", WRONG)
    assert one.grade("class")[0] == 0 and one.exported() == "1"


@pytest.mark.parametrize("chosen", [RIGHT, WRONG])
def test_two_files_of_one_second_wait_for_a_person(one, chosen, monkeypatch):
    put(one.folder / "class", f"{ADA}/00_start_here (2).ipynb", RIGHT)
    put(one.folder / "class", f"{ADA}/{NAME}", WRONG)
    code, said = one.grade("class")
    assert code == 1 and "Files of the same second" in said and one.exported() == ""
    assert "same second" in one.verb("explain").output and "nothing tells which" in feedback_page(one.ada())
    name = "00_start_here (2).ipynb" if chosen is RIGHT else NAME
    again = Class(one.folder)
    again.out = one.folder / "control"
    view_with(monkeypatch, "max(assigned) OVER same IS NULL AS tied", "0 AS tied")
    assert (again.grade("class")[0], again.exported()) == (0, "0")  # the control: the name decided
    assert one.verb("adjust", "101", "00", f"{ADA}/{name}", "--assign", *WHY).exit_code == 0
    assert one.exported() == ("1" if chosen is RIGHT else "0") and "Nothing waits" in one.verb("explain").output


def test_the_same_bytes_twice_are_no_question(one):
    for name in ("a.ipynb", "b.ipynb"):
        put(one.folder / "class", f"{ADA}/{name}", RIGHT)
    assert one.grade("class", lab="00")[0] == 0 and one.exported() == "1"


def test_the_best_of_two_files_of_one_second_is_no_question(one):
    put(one.folder / "class", f"{ADA}/a.ipynb", RIGHT)
    put(one.folder / "class", f"{ADA}/b.ipynb", WRONG)
    (one.folder / "late.toml").write_text('counts = "best"')
    assert one.grade("class", lab="00", late_policy=one.folder / "late.toml")[0] == 0 and one.exported() == "1"


def test_an_id_that_is_not_in_the_roster_waits_whatever_name_stands_beside_it(one, monkeypatch):
    put(one.folder / "class", f"{ADA}/{NAME}", RIGHT)
    put(one.folder / "class", f"Ada Okafor_999_assignsubmission_file_/{NAME}", WRONG, 2000)
    code, said = one.grade("class")
    assert code == 1 and "matches nobody in the roster" in said
    assert (one.exported(), one.ada().attempts) == ("1", 1)
    assert [row.status for row in one.standings("")] == ["waiting"]
    match = Roster.match
    monkeypatch.setattr(Roster, "match", lambda self, who: match(self, replace(who, layout="loose")))
    again = Class(one.folder)
    again.out = one.folder / "control"
    assert (again.grade("class")[0], again.exported()) == (0, "0")  # the control: the name was believed


def test_decisions_belong_to_an_attempt(one, tmp_path, monkeypatch):
    put(one.folder / "first", f"{ADA}/{NAME}", WRONG, 1000)
    one.grade("first")
    assert one.verb("adjust", "101", "00", "1", "--points", "0.5", *WHY).exit_code == 0
    assert one.exported() == "0.5"
    put(one.folder / "second", f"{ADA}/{NAME}", RIGHT, 2000)
    code, said = one.grade("second")
    assert code == 1 and "decide again, an earlier attempt had 0.5 by A. Teacher: a slip" in said
    ada = one.ada()
    assert (ada.tasks[0].points, ada.to_mark, one.exported()) == (1.0, 1, "")  # neither 0.5 nor 1 until then
    with monkeypatch.context() as patch:
        of_one = attempts._tasks
        patch.setattr(attempts, "_tasks", lambda record, own, before: of_one(record, before | own, {}))
        assert one.exported() == "0.5"  # the control: a decision of the student, whatever the attempt says
    assert "decide: Ada Okafor" in one.verb("explain").output
    told = one.verb("explain", "101", "00", "1").output
    assert "attempt 1: adjust 0.5 points" in told and "a person must decide" in told
    page = feedback_page(ada)
    assert "decides on this one again" in page and "up to 1, to be marked" in page and "a slip" not in page
    marks = tmp_path / "marks.csv"
    assert one.verb("marks", "out", "00", "--out", str(marks)).exit_code == 0
    [row] = csv.DictReader(io.StringIO(marks.read_text(encoding="utf-8-sig")))
    assert row["before"] == "0.5 by A. Teacher: a slip" and "/ 1000" in row["answer"] and row["points"] == ""
    assert one.verb("adjust", "101", "00", "1", "--points", "1", *WHY).exit_code == 0
    assert one.exported() == "1" and "Nothing waits" in one.verb("explain").output


def test_a_decision_on_a_later_attempt_does_not_ask_for_one_on_the_first(one):
    put(one.folder / "class", f"{ADA}/{NAME}", RIGHT, 1000)
    put(one.folder / "class", f"{ADA}/00_start_here-1.ipynb", WRONG, 2000)
    one.grade("class")
    one.verb("adjust", "101", "00", "1", "--points", "0.5", *WHY)
    (one.folder / "late.toml").write_text('counts = "first"')
    one.grade("class", late_policy=one.folder / "late.toml")
    assert (one.ada().attempt, one.ada().to_mark, one.exported()) == (1, 0, "1")


def test_the_best_is_open_while_another_attempt_can_become_it(one):
    put(one.folder / "class", f"{ADA}/{NAME}", WRONG, 1000)
    put(one.folder / "class", f"{ADA}/00_start_here-1.ipynb", WRONG + b" ", 2000)
    (one.folder / "late.toml").write_text('counts = "best"')
    one.grade("class", late_policy=one.folder / "late.toml")
    with Ledger(one.out / "ledger.sqlite") as ledger:
        first = ledger.entries("00")[0]
        ledger.decide(Decision("101", "00", "adjust", "me", "why", first.id, "00-1", 0.5))
    assert (one.ada().attempt, one.exported()) == (2, "")  # it could still get 1
    with Ledger(one.out / "ledger.sqlite") as ledger:
        ledger.decide(Decision("101", "00", "adjust", "me", "why", ledger.entries("00")[1].id, "00-1", 0.25))
    assert (one.ada().attempt, one.exported()) == (1, "0.5")


def test_excused_is_of_the_lab_and_outlives_an_attempt(one):
    put(one.folder / "first", f"{ADA}/{NAME}", WRONG, 1000)
    one.grade("first")
    assert one.verb("adjust", "101", "00", "all", "--excuse", *WHY).exit_code == 0
    put(one.folder / "second", f"{ADA}/{NAME}", RIGHT, 2000)
    one.grade("second")
    assert one.ada().status == "excused"


def change_grader(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the grader's own files be others."""
    for module in (grade_verb, regrade):
        monkeypatch.setattr(module, "grader_version", lambda: "mended")


def test_what_is_graded_is_not_graded_again(one, monkeypatch):
    put(one.folder / "class", f"{ADA}/{NAME}", WRONG)
    one.grade("class", seed=3)
    assert len(one.jobs) == 1
    change_grader(monkeypatch)
    for told in ({}, {"seed": 4}, {"seed_per_student": True}, {"limits": read_limits().but(task_seconds=1)}):
        code, said = one.grade("class", **told)
        assert (code, one.jobs, len(one.records())) == (0, [], 1)
        assert "Graded already: 1, 1 by an earlier version" in said and "regrade 00 --dry-run" in said
    monkeypatch.setattr(Ledger, "take", lambda *told: [replace(entry, status="") for entry in take(*told)])
    one.grade("class")
    assert len(one.jobs) == len(one.records()) - 1 == 1  # the control: what another grader graded was graded again


def test_a_later_attempt_is_graded_as_the_run_before_told_also_by_another_grader(one, monkeypatch):
    put(one.folder / "first", f"{ADA}/{NAME}", WRONG)
    put(one.folder / "second", f"Ben Fischer_102_assignsubmission_file_/{NAME}", WRONG)
    one.grade("first", limits=read_limits().but(task_seconds=4.5))
    before = one.jobs[0]
    change_grader(monkeypatch)
    one.grade("second")
    assert (one.jobs[0]["seed"], one.jobs[0]["limits"]) == (before["seed"], before["limits"])
    assert one.jobs[0]["limits"]["task_seconds"] == 4.5 != read_limits().task_seconds
    put(one.folder / "third", f"Ben Fischer_102_assignsubmission_file_/{NAME}", RIGHT, 3000)
    one.grade("third", limits=read_limits().but(task_seconds=5.5))  # told anew, that counts
    assert one.jobs[0]["limits"]["task_seconds"] == 5.5


def test_regrade_has_the_seeds_and_limits_of_each_submission(one, monkeypatch):
    put(one.folder / "first", f"{ADA}/{NAME}", WRONG)
    put(one.folder / "second", f"Ben Fischer_102_assignsubmission_file_/{NAME}", RIGHT)
    one.grade("first", seed=3, limits=read_limits().but(task_seconds=4.5))
    one.grade("second", seed=4, seed_per_student=True)
    wanted = {job["submission"]: (job["seed"], job["limits"]) for job in _graded_jobs(one)}
    change_grader(monkeypatch)
    with Ledger(one.out / "ledger.sqlite") as ledger:
        found = regrade.outdated(ledger, ["00"])
        records = regrade.rerun(found, one.out / "originals", "none", one.engine)
        assert {job["submission"]: (job["seed"], job["limits"]) for job in one.jobs} == wanted
        assert regrade.apply(ledger, found, records, never_lower=False) == (2, 0)
        assert regrade.outdated(ledger, ["00"]) == []
        assert [ledger.run(entry.run).grader for entry in ledger.entries()] == ["mended", "mended"]


def _graded_jobs(one: Class) -> list[dict]:
    """What every submission was graded with, as the ledger keeps it."""
    with Ledger(one.out / "ledger.sqlite", write=False) as ledger:
        return [
            {
                "submission": entry.sha256,
                "seed": ledger.newest(entry)["seed"],
                "limits": json.loads(ledger.run(entry.run).limits),
            }
            for entry in ledger.entries()
        ]


def test_what_became_readable_is_regraded_and_what_became_unreadable_is_not(one, monkeypatch):
    put(one.folder / "class", f"{ADA}/{NAME}", RIGHT)
    one.grade("class")
    change_grader(monkeypatch)

    def rerun(status: str) -> str:
        with Ledger(one.out / "ledger.sqlite") as ledger:
            found = regrade.outdated(ledger, ["00"])
            records = [{**old, "status": status, "isolation": ""} for _, _, old in found]
            regrade.apply(ledger, found, records, never_lower=False)
        return one.ada().status

    assert rerun("unreadable") == "graded"
    with Ledger(one.out / "ledger.sqlite") as ledger:
        [entry] = ledger.entries()
        run = ledger.begin_again(replace(ledger.run(entry.run), grader="worse"))
        ledger.record(run, entry, {**ledger.newest(entry), "status": "unreadable"})
    assert one.ada().status == "unreadable" and rerun("graded") == "graded"


HIDDEN = {
    "a bell": "Zo\x07e",
    "a turn": "Zo\u202ee",
    "no width": "Zo\u200be",
    "composed": "Zoe\u0301",
    "no UTF-8": "Zo\udcef",
    "a blank": "Zo\u00a0e",
}


@pytest.mark.parametrize("name", HIDDEN.values(), ids=HIDDEN)
def test_what_is_shown_can_be_typed(one, name):
    folder = os.fsencode(one.folder / "class") + b"/" + os.fsencode(f"{name}_998_assignsubmission_file_")
    os.makedirs(folder)
    with open(folder + b"/00_start_here.ipynb", "wb") as file:
        file.write(RIGHT)
    one.grade("class")
    said = one.verb("explain").output
    typed = said.split(", number 1, ")[1].split(": It matches")[0]
    assert typed.isprintable() and typed.endswith(NAME)
    assert one.verb("adjust", "102", "00", typed, "--assign", *WHY).exit_code == 0
    assert one.exported("102") == "1"


def test_a_number_is_ours_whatever_a_file_is_called(one):
    put(one.folder / "class", "999_x/00_start_here.ipynb", WRONG)
    put(one.folder / "class", f"998_y/{NAME}", RIGHT)
    one.grade("class")
    with Ledger(one.out / "ledger.sqlite") as ledger:
        first, second = sorted(ledger.entries(), key=lambda entry: entry.id)
        ledger.db.execute("UPDATE entries SET path = ? WHERE id = ?", (str(first.id), second.id))
        assert find_submission(ledger, "00", str(first.id)).id == first.id
        ledger.db.execute("UPDATE entries SET path = 'same' || sha256, sha256 = 'x' || id")
        ledger.db.execute("UPDATE entries SET path = 'same'")
        with pytest.raises(CourseError, match="say its number; waiting are: 1 .same., 2 .same."):
            find_submission(ledger, "00", "same")


def test_a_file_of_no_lab_is_listed_until_it_has_one(one):
    put(one.folder / "class", f"{ADA}/mine.ipynb", b'{"cells": [{"cell_type": "code", "source": "1"}]}')
    code, said = one.grade("class")
    assert code == 1 and "say which with --lab NAME" in said
    assert "no lab: Ada Okafor, number 1" in one.verb("explain").output
    one.grade("class", lab="00")
    assert "no lab" not in one.verb("explain").output


def test_nobody_has_0_in_a_lab_of_which_only_a_stray_file_came(one):
    put(one.folder / "class", f"{ADA}/{NAME}", RIGHT)
    put(one.folder / "class", f"{ADA}/01_notes.py", b"x")
    code, said = one.grade("class")
    assert code == 1 and "01_notes.py is no notebook" in said
    with Ledger(one.out / "ledger.sqlite", write=False) as ledger:
        assert [(row.student, row.status) for row in standings(ledger, "01")] == [("101", "unreadable")]


def test_a_ledger_of_thousands_is_told_at_once(one):
    """Attempts, standing and marks are one view; it must not compare each with each."""
    put(one.folder / "class", f"{ADA}/{NAME}", RIGHT)
    one.grade("class")
    with Ledger(one.out / "ledger.sqlite") as ledger:
        [entry] = ledger.entries()
        columns = "named, lab, received, late, suffix, layout, trouble, code, added"
        ledger.db.execute(
            f"WITH RECURSIVE n(i) AS (SELECT 2 UNION ALL SELECT i + 1 FROM n WHERE i < 5000) INSERT INTO entries "
            f"(student, sha256, path, download, {columns}) SELECT 's' || i, i, i, i, {columns} FROM entries, n"
        )
        ledger.db.execute(
            "INSERT INTO records (entry, run, status, record, added) SELECT e.id, r.run, r.status, r.record, r.added "
            "FROM entries e, records r WHERE e.id > 1"
        )
        began = time.process_time()
        assert len(ledger.entries()) == 5000
        assert time.process_time() - began < 1.0


def test_decisions_of_no_attempt_are_refused_by_the_database(one):
    put(one.folder / "class", f"{ADA}/{NAME}", RIGHT)
    one.grade("class")
    with Ledger(one.out / "ledger.sqlite") as ledger, pytest.raises(sqlite3.IntegrityError, match="FOREIGN KEY"):
        ledger.decide(Decision("101", "00", "adjust", "me", "why", 77, "00-1", 0.5))
