"""Disks that are full or cannot be written: one sentence with the disk's name, exit 2, and nothing lost.

The disks are real ones, mounted for the command alone.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from grading_helpers import ROOT, need_sandbox, submission

from course_lib.authoring.tree import CourseError
from course_lib.grading.disks import DiskTrouble, disk_told
from course_lib.grading.ledger.ledger import Ledger

ANSWERS = ("return depth_mm / 1000", "return depth_mm", "return depth_mm // 1000")


@pytest.fixture
def place(tmp_path) -> Path:
    """A class of three, and an empty folder `disk` on which the disk is mounted."""
    need_sandbox()
    for i, answer in enumerate(ANSWERS):
        path = tmp_path / "class" / f"s{i}" / "00_start_here.ipynb"
        path.parent.mkdir(parents=True)
        path.write_bytes(submission("00", {1: f"def metres(depth_mm):\n    {answer}\n"}))
    (tmp_path / "disk").mkdir()
    return tmp_path


def on(mount: list[str], place: Path, *commands: str) -> subprocess.CompletedProcess:
    """Run commands of the course, one after the other, where `place/disk` is mounted so."""
    course = f"{sys.executable} -P -m course_lib.cli"
    script = "; ".join(command.replace("course", course, 1) for command in commands)
    words = ["bwrap", "--dev-bind", "/", "/", *mount, "--chdir", str(place), "sh", "-c", script]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "500"}
    return subprocess.run(words, env=environment, capture_output=True, text=True, timeout=300, check=False)


def refused(done: subprocess.CompletedProcess, place: Path) -> None:
    assert done.returncode == 2, done.stdout + done.stderr
    [line] = done.stderr.strip().splitlines()
    assert f"the disk {place / 'disk'}:" in line and line.endswith("is kept.") and "Traceback" not in done.stdout


GRADE = "course grade class --out disk/grades --workers 1 --seed 3"


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", [GRADE, "course release 00 --out disk/released", "course release --worked-class --out disk/class"]
)
def test_a_disk_that_cannot_be_written(place, command):
    at = str(place / "disk")
    refused(on(["--ro-bind", at, at], place, command), place)


@pytest.mark.slow
@pytest.mark.parametrize(("kilobytes", "kept"), [(1, 0), (60, 0), (100, 0), (160, 1)])
def test_a_full_disk_loses_nothing(place, kilobytes, kept):
    """No room for a folder, for the ledger, for the originals, for all records."""
    at = str(place / "disk")
    done = on(
        ["--size", str(kilobytes * 1024), "--tmpfs", at], place, GRADE, "code=$?; cp -r disk/grades .; exit $code"
    )
    refused(done, place)
    told = [line for line in done.stdout.splitlines() if line.startswith("  s")]
    assert (len(told) > 0) == kept, done.stdout
    again = on([], place, GRADE.replace("disk/grades", "grades"))  # with room, the same command goes on
    assert again.returncode == 0 and "3 graded" in again.stdout, again.stdout + again.stderr
    assert f"{3 - len(told)} to grade" in again.stdout


@pytest.mark.slow
@pytest.mark.parametrize("logged", [False, True], ids=["closed", "killed"])
def test_grades_on_a_disk_that_cannot_be_written_can_be_read(place, logged):
    assert on([], place, GRADE).returncode == 0
    at, grades = str(place / "disk"), place / "disk" / "grades"
    if logged:  # as a killed grader leaves it: what is in the log is not in the file
        with Ledger(grades / "ledger.sqlite") as ledger:
            ledger.set_settings("policy", "")
            for name in ("ledger.sqlite", "ledger.sqlite-wal"):
                shutil.copy(grades / name, place / name)
        for name in ("ledger.sqlite", "ledger.sqlite-wal"):
            shutil.copy(place / name, grades / name)
    mount = ["--ro-bind", at, at]
    read = on(mount, place, "course export --format csv --grades disk/grades --out out.csv")
    if logged:
        refused(read, place)
    else:
        assert read.returncode == 0 and len((place / "out.csv").read_text().splitlines()) == 4, read.stderr
        assert on(mount, place, "course explain s1 00 1 --grades disk/grades").returncode == 0
        refused(on(mount, place, "course feedback --grades disk/grades"), place)
        why = "--by me --reason why --grades disk/grades"
        refused(on(mount, place, f"course adjust s1 00 1 --points 1 {why}"), place)
        refused(on(mount, place, "course regrade --yes --grades disk/grades"), place)
        refused(on(mount, place, "course forget s1 --yes --grades disk/grades"), place)


def test_the_sentence_names_the_mount(tmp_path):
    with pytest.raises(DiskTrouble, match=r"x/y cannot be written \(no space left on device\).* the disk /[^ ]*:"):
        with disk_told(tmp_path / "x" / "y"):
            raise OSError(28, "No space left on device")
    assert issubclass(DiskTrouble, CourseError) and DiskTrouble.exit_code == 2
