"""`course grade`: the same grades from one worker and two, and from a grader that was killed again and again."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from click.testing import CliRunner
from grading_helpers import ROOT, alive_after, job, need_sandbox, submission
from how_thorough import sample

from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.records import same_grades
from course_lib.grading.run import pool
from course_lib.grading.run.sandbox import NoSandbox, probe_sandbox
from course_lib.grading.verbs import engine
from course_lib.grading.verbs import grade as grade_verb

NAME = "00_start_here.ipynb"
COUNT = sample(24, 12)
KILLS, KILLS_AT_WORK = sample(20, 4), sample(12, 2)


@pytest.fixture(autouse=True)
def _sandbox() -> None:
    need_sandbox()


@pytest.fixture(scope="module")
def submitted(tmp_path_factory) -> Path:
    """Submissions of lab 00: right, wrong in several ways, untouched, broken."""
    folder = tmp_path_factory.mktemp("class") / "class"
    answers = [
        "return depth_mm / 1000",
        "return depth_mm",
        "return depth_mm // 1000",
        "return depth_mm * 1000",
        "raise ValueError('no')",
        "return None",
    ]
    for i in range(COUNT):
        data = submission("00", {1: f"def metres(depth_mm):\n    # number {i}\n    {answers[i % 6]}\n"})
        data = submission("00") if i == 7 else data[:500] if i == 11 else data
        (folder / f"s{i:02}").mkdir(parents=True)
        (folder / f"s{i:02}" / NAME).write_bytes(data)
    return folder


def command(folder: Path, out: Path, *more: str) -> list[str]:
    """Grade with a typed seed, and with the same secret in each ledger: so all are asked the same."""
    if not (out / "ledger.sqlite").exists():
        out.mkdir(parents=True, exist_ok=True)
        with Ledger(out / "ledger.sqlite") as ledger:
            ledger.db.execute("INSERT INTO settings VALUES ('secret', 'of these tests')")
    words = ["grade", str(folder), "--out", str(out), "--seed", "11", *more]
    return [sys.executable, "-P", "-m", "course_lib.cli", *words]


def grade(folder: Path, out: Path, *more: str) -> subprocess.CompletedProcess:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        command(folder, out, *more), env=environment, capture_output=True, text=True, timeout=300, check=False
    )


def grades(out: Path) -> dict[str, dict]:
    with Ledger(out / "ledger.sqlite", write=False) as ledger:
        found = {}
        for entry in ledger.entries():
            records = ledger.records(entry)
            assert len(records) == 1, f"{entry.path} has {len(records)} records"
            found[entry.student] = records[0]
        return found


@pytest.fixture(scope="module")
def expected(submitted, tmp_path_factory) -> dict[str, dict]:
    out = tmp_path_factory.mktemp("one") / "grades"
    done = grade(submitted, out, "--workers", "1")
    assert done.returncode == 1, done.stdout + done.stderr  # one is broken: a person must look
    return grades(out)


@pytest.mark.slow
def test_one_worker_grades_as_expected(expected):
    points = [expected[f"s{i:02}"]["points"] for i in range(COUNT)]
    wanted = [1.0 if i % 6 == 0 else 0.0 for i in range(COUNT)]
    wanted[7] = wanted[11] = 0.0
    assert points == wanted
    assert expected["s11"]["status"] == "unreadable" and expected["s11"]["notices"][0]["code"] == "cut off"


@pytest.mark.slow
@pytest.mark.thorough  # those that are killed below are two workers as well
def test_two_workers_give_the_same(submitted, expected, tmp_path):
    assert grade(submitted, tmp_path, "--workers", "2").returncode == 1
    again = grades(tmp_path)
    assert again.keys() == expected.keys()
    assert all(same_grades(again[student], expected[student]) for student in expected)


@pytest.mark.slow
def test_killed_again_and_again_it_loses_and_doubles_nothing(submitted, expected, tmp_path):
    """Killed while it starts, and in the middle of submissions, at moments drawn from a fixed seed; then resumed.

    All its grades come from two workers, and are those that one gave.
    """
    rng = random.Random(20)
    moments = [("start", rng.uniform(0.3, 1.5)) for _ in range(KILLS - KILLS_AT_WORK)]
    moments += [("work", rng.uniform(0, 0.4)) for _ in range(KILLS_AT_WORK)]
    rng.shuffle(moments)
    out, kept, met_at_work = tmp_path / "0", 0, 0
    for number, moment in enumerate(moments):
        if kept == COUNT:  # a fast machine was done before the last kill: begin again
            out, kept = tmp_path / str(number), 0
        before, kept = kept, _killed(submitted, out, *moment)
        assert kept >= before, "a record was lost"
        met_at_work += kept > before
    assert met_at_work >= KILLS_AT_WORK, "a record was told and not kept"
    assert grade(submitted, out, "--workers", "2").returncode == 1
    again = grades(out)
    assert again.keys() == expected.keys()
    assert all(same_grades(again[student], expected[student]) for student in expected)


def _killed(folder: Path, out: Path, when: str, seconds: float) -> int:
    """Kill a grader so long after its start, or after its first record; the number of records that it leaves."""
    process = subprocess.Popen(
        command(folder, out, "--workers", "2"),
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    if when == "work":
        assert any(line.startswith("  s") for line in process.stdout)
    time.sleep(seconds)
    family = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.SIGKILL)
    process.stdout.close()
    ended = process.wait()
    alive = alive_after(family)
    assert not alive, [one.cmdline() for one in alive]
    kept = len(_records(out)) if (out / "ledger.sqlite").exists() else 0
    assert ended == -signal.SIGKILL or kept == COUNT
    return kept


IMPORTED_BY_A_CHILD = """
import json, sys
from course_lib.grading.run import worker
grade_one = worker.grade_one
def grade(job):
    before = set(sys.modules)
    record = grade_one(job)
    return {"status": record["status"], "new": sorted(set(sys.modules) - before)}
worker.grade_one = grade
print(json.dumps(worker.grade_apart(json.load(sys.stdin))))
"""


@pytest.mark.slow
@pytest.mark.parametrize("lab", ["00", "04"])  # one without SciPy, one with
def test_a_workers_children_import_nothing_of_weight_again(lab):
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED_BY_A_CHILD],
        input=json.dumps(job(lab, submission(lab, solved=True))),
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    told = json.loads(done.stdout)
    assert told["status"] == "graded"
    heavy = {"course_lib", "numpy", "scipy", "nbval", "nbformat", "jupyter_client", "IPython", "zmq"}
    light = {"zmq.utils.garbage"}  # where inputs are too large to be copied
    assert not [name for name in told["new"] if name.split(".")[0] in heavy and name not in light]


@pytest.mark.slow
def test_interrupted_it_says_so_and_ends_with_130(submitted, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        command(submitted, tmp_path, "--workers", "1"),
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    for line in process.stdout:
        if line.startswith("  s"):
            break
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130 and "run the same command to go on" in said
    assert 0 < len(_records(tmp_path)) < COUNT


def _records(out: Path) -> list:
    with Ledger(out / "ledger.sqlite", write=False) as ledger:
        return [record for entry in ledger.entries() for record in ledger.records(entry)]


def run(*words: str):
    return CliRunner().invoke(grade_verb.grade, list(words))


def test_without_a_sandbox_nothing_is_graded(tmp_path, monkeypatch):
    (tmp_path / "class" / "ann").mkdir(parents=True)
    (tmp_path / "class" / "ann" / NAME).write_bytes(submission("00", solved=True))

    def forbidden(kind, *own):
        raise NoSandbox("bubblewrap is not installed: sudo apt-get install bubblewrap.")

    monkeypatch.setattr(engine, "held_by", forbidden)
    done = run(str(tmp_path / "class"), "--out", str(tmp_path / "g"))
    assert done.exit_code == 3 and "install bubblewrap" in done.output
    assert not (tmp_path / "g").exists()


def test_no_sandbox_must_be_said_twice(tmp_path):
    done = run(str(tmp_path), "--out", str(tmp_path / "g"), "--sandbox", "none")
    assert done.exit_code == 2 and "--i-trust-these-submissions" in done.output


@pytest.mark.slow
def test_what_holds_stands_in_the_record(tmp_path):
    (tmp_path / "class" / "ann").mkdir(parents=True)
    (tmp_path / "class" / "ann" / NAME).write_bytes(submission("00", solved=True))
    words = [str(tmp_path / "class"), "--out", str(tmp_path / "g"), "--workers", "1"]
    assert run(*words).exit_code == 0
    trusting = [*words[:2], str(tmp_path / "h"), *words[3:], "--sandbox", "none", "--i-trust-these-submissions"]
    assert run(*trusting).exit_code == 0
    assert next(iter(grades(tmp_path / "g").values()))["isolation"] == probe_sandbox().words
    assert next(iter(grades(tmp_path / "h").values()))["isolation"].startswith("none")


@pytest.mark.slow
def test_an_infrastructure_failure_is_never_scored_and_tried_again(tmp_path, monkeypatch):
    (tmp_path / "class" / "ann").mkdir(parents=True)
    (tmp_path / "class" / "ann" / NAME).write_bytes(submission("00", solved=True))
    words = [str(tmp_path / "class"), "--out", str(tmp_path / "g"), "--workers", "1"]
    real = pool.COMMAND
    monkeypatch.setattr(pool, "COMMAND", ("-c", "raise SystemExit"))
    done = run(*words)
    assert done.exit_code == 4 and "0 graded" in done.output
    monkeypatch.setattr(pool, "COMMAND", real)
    assert run(*words).exit_code == 0
    assert [record["status"] for record in _records(tmp_path / "g")] == ["infrastructure", "graded"]


def test_an_empty_folder_says_so(tmp_path):
    (tmp_path / "class").mkdir()
    done = run(str(tmp_path / "class"), "--out", str(tmp_path / "g"))
    assert done.exit_code == 2 and "holds no submission" in done.output
