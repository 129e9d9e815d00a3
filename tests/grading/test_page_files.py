"""docs/instructors.md: every file that it shows is one that the verbs take; real data that lack are nobody's 0."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import nbformat
import pytest
from click.testing import CliRunner
from grading_helpers import ROOT, graded, need_sandbox, submission

from course_lib.authoring import solutions
from course_lib.grading.intake.roster import read_roster
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.ledger.policy import read_extensions, read_policy
from course_lib.grading.release.private import use_private
from course_lib.grading.run import grade_submission
from course_lib.grading.run.limits import read_limits
from course_lib.grading.verbs import grade, release
from course_lib.tasks.labs.lab_00_start_here import tasks as lab_00
from course_lib.tasks.private import FOLDER

PAGE = (ROOT / "docs" / "instructors.md").read_text(encoding="utf-8")
NAME = "00_start_here.ipynb"


def shown(after: str) -> str:
    """The first block of the page after some words."""
    return re.search(r"```\w+\n(.*?)```", PAGE.split(after, 1)[1], re.S)[1]


def written(tmp_path: Path, name: str, after: str) -> Path:
    path = tmp_path / name
    path.write_text(shown(after), encoding="utf-8")
    return path


def test_the_roster(tmp_path):
    people = read_roster(written(tmp_path, "roster.csv", "**Roster**")).people
    assert [(person.id, person.name, person.group) for person in people] == [
        ("101", "Ada Okafor", "A"),
        ("104", "Dora, née Szabó", "A"),
    ]


def test_the_extensions_and_the_late_policy(tmp_path):
    extensions = read_extensions(written(tmp_path, "extensions.csv", "**Extensions**"))
    policy = read_policy(written(tmp_path, "late.toml", "**Late policy**"))
    assert extensions.excused("111", "03") and not extensions.excused("110", "03")
    received = "2026-11-25T23:00:00+01:00"
    assert policy.kept("03", "101", received, False, extensions)[0] == 0.8
    assert policy.kept("03", "110", received, False, extensions)[0] == 1.0
    assert policy.counts == "best" and policy.timezone == "Europe/Berlin"


def test_the_limits(tmp_path):
    limits = read_limits(written(tmp_path, "limits.toml", "**Limits**"))
    assert limits == read_limits().but(task_seconds=60, memory_mb=3000)


@pytest.mark.slow
def test_the_tasks_of_one_s_own(tmp_path, monkeypatch):
    need_sandbox()
    monkeypatch.setenv(FOLDER, "")
    mine = tmp_path / "mine"
    mine.mkdir()
    for name in ("lab_00.py", "lab_00_cells.py"):
        written(mine, name, f"`{name}`:\n")
    words = ["00", "--private-tasks", str(mine), "--out", str(tmp_path / "released")]
    done = CliRunner().invoke(release.release, words)
    assert done.exit_code == 0, done.output
    place = tmp_path / "class" / "ann"
    place.mkdir(parents=True)
    nb = nbformat.read(tmp_path / "released" / "exercises" / NAME, as_version=4)
    for cell in nb.cells:
        if cell.id in ("task-1", "task-2"):
            cell.source = solutions.reference(f"00-{cell.id[-1]}")
    nbformat.write(nb, place / NAME)
    words = [str(tmp_path / "class"), "--private-tasks", str(mine), "--workers", "1", "--out", str(tmp_path / "g")]
    done = CliRunner().invoke(grade.grade, words)
    assert done.exit_code == 0, done.output
    with Ledger(tmp_path / "g" / "ledger.sqlite", write=False) as ledger:
        [record] = [ledger.newest(entry) for entry in ledger.entries()]
    assert [task["points"] for task in record["tasks"]] == [1.0, 2.0]
    use_private(None)


@pytest.mark.slow
def test_data_that_lack_at_the_grader_are_never_scored(monkeypatch):
    need_sandbox()
    task = lab_00.TASKS[0]
    asked = []

    def lacking(name):
        asked.append(name)
        raise FileNotFoundError(f"{name} is not here: course data get {name}")

    def cases(rng, load):
        load("tum_pair")
        return task.cases(rng)

    real = dataclasses.replace(task, kind="real", data=("tum_pair",), cases=cases, version=7)
    monkeypatch.setattr(lab_00, "TASKS", (real,))
    monkeypatch.setattr(grade_submission, "load_data", lambda: lacking)
    record = graded("00", submission("00", solved=True))
    assert (record["status"], record["points"], record["tasks"]) == ("infrastructure", 0.0, [])
    assert "course data get tum_pair" in record["reason"] and asked == ["tum_pair"]
    monkeypatch.setattr(grade_submission, "load_data", lambda: lambda name: None)  # the data are there: it is graded
    assert graded("00", submission("00", solved=True))["points"] == 1
