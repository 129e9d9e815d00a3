"""docs/instructors.md: its commands run as they stand, on the class of twelve, and each student gets what is due."""

from __future__ import annotations

import csv
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from grading_helpers import ROOT, need_sandbox

PAGE = ROOT / "docs" / "instructors.md"
COMMANDS = [
    line
    for block in re.findall(r"```sh\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    for line in block.splitlines()
]
EXPECTED_CODES = {"grade": 1}  # one submission cannot be read, one is in no roster: a person must look


@pytest.fixture(scope="module")
def said(tmp_path_factory) -> tuple[Path, dict[str, str]]:
    """Run every command of the page in an empty folder; what each said."""
    need_sandbox()
    folder = tmp_path_factory.mktemp("instructor")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    told = {}
    for line in COMMANDS:
        if " in to_mark.csv" in line:
            _mark(folder / "to_mark.csv")
        words = shlex.split(line)
        assert words[:2] == ["python3", "course.py"], line
        seed = ["--seed", "7"] if words[2] == "grade" else []  # so that every run of this test grades alike
        command = [sys.executable, "-P", "-m", "course_lib.cli", *words[2:], *seed]
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == EXPECTED_CODES.get(words[2], 0), f"{line}\n{done.stdout}{done.stderr}"
        told[line] = done.stdout
    return folder, told


def _mark(path: Path) -> None:
    """Fill in what a person would: two points, and a comment that a spreadsheet must not run."""
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = list(csv.reader(file))
    place = rows[0].index("points")
    for row in rows[1:]:
        row[place : place + 2] = ["2", "=good"]
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows(rows)


@pytest.mark.slow
def test_every_verb_of_the_page_ran(said):
    verbs = {shlex.split(line)[2] for line in COMMANDS}
    assert verbs >= {"release", "grade", "explain", "adjust", "marks", "feedback", "export", "class-report", "regrade"}
    assert {"viva", "forget"} <= verbs and set(said[1]) == set(COMMANDS)


@pytest.mark.slow
def test_each_student_has_what_is_due(said):
    folder, _ = said
    with open(folder / "grades_moodle.csv", encoding="utf-8-sig", newline="") as file:
        rows = {row["Identifier"]: row for row in csv.DictReader(file)}
    grades = {name.removeprefix("Participant "): row["Grade"] for name, row in rows.items()}
    assert {number: grades[number] for number in ("101", "102", "107", "113")} == dict.fromkeys(
        ("101", "102", "107", "113"), "15"
    )
    assert grades["106"] == "2" and grades["108"] == "13"  # the adjusted one; one task untouched
    assert grades["110"] == "12"  # 15 points, a day late
    assert grades["109"] == "" and rows["Participant 109"]["Status"] == "unreadable"
    assert grades["111"] == "" and rows["Participant 111"]["Status"] == "excused"
    assert grades["112"] == "0"
    for number in ("103", "104", "105"):
        assert 2 < float(grades[number]) < 8


@pytest.mark.slow
def test_what_they_say(said):
    folder, told = said
    explained = next(text for line, text in told.items() if "explain 106" in line)
    assert "adjust 1 points by A. Teacher: right but for the loop" in explained and "task_seconds" in explained
    waiting = next(text for line, text in told.items() if line.endswith("course.py explain"))
    assert "Somebody Else" in waiting and "Iris Blanc" in waiting
    viva = next(text for line, text in told.items() if " viva " in line)
    assert "What comes out?" in viva and "course's solution gives" in viva
    page = next((folder / "grades" / "feedback").glob("103-*.html")).read_text(encoding="utf-8")
    assert "This looks like" in page and "=good" in page
    report = (folder / "class.html").read_text(encoding="utf-8")
    assert "Mistakes that people made" in report and "Iris Blanc" in report


@pytest.mark.slow
def test_the_forgotten_is_gone(said):
    folder, _ = said
    for path in (folder / "grades").rglob("*"):
        if path.is_file() and path.suffix != ".lock":
            assert b"Lea Rossi" not in path.read_bytes(), path
