"""What people decide: adjusting, marking, regrading after a judge was mended, and asking why."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from click.testing import CliRunner
from grading_helpers import graded, need_sandbox, submission

from course_lib import tasks
from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.intake import IntakeLimits, read_class
from course_lib.grading.ledger.attempts import standings
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.ledger.resolve import find_lab, find_task
from course_lib.grading.run import seeds
from course_lib.grading.verbs import engine, people
from course_lib.tasks.labs.lab_00_start_here import tasks as lab_00

MILLIMETRES = "def metres(depth_mm):\n    return depth_mm * 1.0\n"


@pytest.fixture(scope="module")
def records():
    need_sandbox()
    return {
        "ann": (submission("00", solved=True), graded("00", submission("00", solved=True))),
        "bob": (submission("00", {1: MILLIMETRES}), graded("00", submission("00", {1: MILLIMETRES}))),
    }


@pytest.fixture
def grades(tmp_path, records) -> Path:
    """A folder of grades of lab 00: ann is right, bob is wrong; cem handed in something broken."""
    folder = tmp_path / "class"
    for who, (data, _) in records.items():
        (folder / who).mkdir(parents=True)
        (folder / who / "00_start_here.ipynb").write_bytes(data)
    out = tmp_path / "grades"
    out.mkdir()
    with Ledger(out / "ledger.sqlite") as ledger:
        example = records["ann"][1]
        keys = {key: example[key] for key in ("lab", "lab_version", "environment", "grader", "isolation")}
        run = ledger.begin(seed=example["seed"], per_student=False, **keys)
        found, _ = read_class(folder, lab=None, roster=None, limits=IntakeLimits(), store=out / "originals")
        for entry in ledger.take(found):
            ledger.record(run, entry, records[entry.student][1])
    return out


def run(verb: str, *words: str, grades: Path):
    return CliRunner().invoke(getattr(people, verb), [*words, "--grades", str(grades)])


def points(grades: Path) -> dict[str, float]:
    with Ledger(grades / "ledger.sqlite", write=False) as ledger:
        return {one.student: one.points for one in standings(ledger)}


@pytest.mark.slow
def test_adjust_appends(grades):
    why = ("--by", "me", "--reason", "because")
    for value in ("0.5", "0.75"):
        assert run("adjust", "bob", "00", "1", "--points", value, *why, grades=grades).exit_code == 0
    assert points(grades) == {"ann": 1.0, "bob": 0.75}
    said = run("explain", "bob", "00", "00-1", grades=grades).output
    assert "adjust 0.5 points by me: because" in said and "Points that count: 0.75 of 1" in said
    assert "depth_mm * 1.0" in said and "left in millimetres" in said


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("bbo", "00", "1", "--points", "1"), "Did you mean bob?"),
        (("bob", "77", "1", "--points", "1"), "no lab '77'"),
        (("bob", "00", "9", "--points", "1"), "no task '9'"),
        (("bob", "00", "1", "--points", "2"), "not between 0 and 1"),
        (("bob", "00", "1", "--points", "-1"), "not between 0 and 1"),
        (("bob", "00", "x.ipynb", "--assign"), "waiting are: none"),
    ],
)
def test_adjust_refuses_in_one_sentence(grades, words, sentence):
    done = run("adjust", *words, "--by", "me", "--reason", "r", grades=grades)
    assert isinstance(done.exception, CourseError) and sentence in str(done.exception)
    assert points(grades) == {"ann": 1.0, "bob": 0.0}


def test_excused_is_not_zero(grades):
    assert run("adjust", "bob", "00", "all", "--excuse", "--by", "me", "--reason", "ill", grades=grades).exit_code == 0
    with Ledger(grades / "ledger.sqlite", write=False) as ledger:
        assert [one.status for one in standings(ledger, student="bob")] == ["excused"]


@pytest.fixture
def mended(monkeypatch):
    """The judge of lab 00 as if it had been mended: now millimetres are right, and the version is 2."""
    task = lab_00.TASKS[0]

    def judge(case, answer):
        return task.judge(case, _scaled(answer))

    def _scaled(answer):
        return answer / 1e3 if not isinstance(answer, list) else answer

    changed = dataclasses.replace(task, version=task.version + 1, judge=judge)
    monkeypatch.setattr(lab_00, "TASKS", (changed,))
    monkeypatch.setattr(engine, "held_by", lambda kind, *own: None)

    def here(jobs, workers, on_record):  # in this process, where the judge is mended
        from course_lib.grading.run.grade_submission import grade_one

        for place, job in enumerate(jobs):
            on_record(place, grade_one(job))

    monkeypatch.setattr(engine, "grade_jobs", here)


@pytest.mark.slow
def test_regrade_lists_before_it_changes(grades, mended):
    done = run("regrade", "--dry-run", grades=grades)
    assert done.exit_code == 0, done.exception
    assert "2 submissions" in done.output and "task version 1 -> 2" in " ".join(done.output.split())
    assert "1 -> 0" in done.output and "0 -> 1" in done.output and "Nothing was changed" in done.output
    assert points(grades) == {"ann": 1.0, "bob": 0.0}
    assert run("regrade", grades=grades).exit_code == 1  # asked, and not answered
    assert points(grades) == {"ann": 1.0, "bob": 0.0}


@pytest.mark.slow
def test_regrade_keeps_what_was(grades, mended):
    assert run("regrade", "--yes", grades=grades).exit_code == 0
    assert points(grades) == {"ann": 0.0, "bob": 1.0}
    with Ledger(grades / "ledger.sqlite", write=False) as ledger:
        assert [len(ledger.records(entry)) for entry in ledger.entries()] == [2, 2]
    assert "0 submissions" in run("regrade", "--yes", grades=grades).output


@pytest.mark.slow
def test_regrade_never_lowers_if_told(grades, mended):
    assert run("regrade", "--yes", "--never-lower", grades=grades).exit_code == 0
    assert points(grades) == {"ann": 1.0, "bob": 1.0}


def test_forget_takes_files_along(grades):
    assert run("forget", "bob", "--yes", grades=grades).exit_code == 0
    assert points(grades) == {"ann": 1.0}
    assert len([path for path in (grades / "originals").rglob("*") if path.is_file()]) == 1
    assert "nobody with the id" in str(run("forget", "bob", "--yes", grades=grades).exception)


@pytest.mark.parametrize("name", ["3", "03", "03_depth_to_points"])
def test_labs_by_any_name(name):
    assert find_lab(name) == "03" and find_task("03", "2").id == find_task("03", "03-2").id == "03-2"


@pytest.mark.slow
@pytest.mark.parametrize("lab", tasks.lab_numbers())
def test_a_drawn_seed_is_fair(lab, monkeypatch):
    lacking = [task.id for task in tasks.lab(lab) if task.data]
    if not lacking:
        assert seeds.is_fair(lab, seeds.draw_seed(lab, range(1000, 1020)))
    monkeypatch.setattr(seeds, "is_fair", lambda lab, seed: False)
    with pytest.raises(RuntimeError, match="any of 20"):
        seeds.draw_seed(lab, range(20))


def test_a_seed_on_which_the_solution_fails_is_not_fair(monkeypatch):
    monkeypatch.setattr(seeds.solutions, "reference", lambda task_id, root: MILLIMETRES)
    assert not seeds.is_fair("00", 7)
