"""An instructor's own tasks: released by cells and names only, graded, explained and asked about like all others."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from click.testing import CliRunner
from grading_helpers import need_sandbox

from course_lib import tasks
from course_lib.authoring import notebooks as nbs
from course_lib.authoring.tree import CourseError
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.release.private import use_private
from course_lib.grading.verbs import grade, release
from course_lib.tasks.private import FOLDER

TASKS = """
from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_number

TASKS = (
    Task(
        id="00-2", title="metres to feet", points=2, version=1, kind="write",
        signature="def feet(metres)",
        cases=lambda rng: [Case({"metres": float(x)}, {"truth": float(x) / 0.3048}) for x in rng.uniform(1, 9, 3)],
        judge=lambda case, answer: judge_number(answer, case.truth, 1e-6, "ft", "the length"),
        misconceptions=(
            Misconception("feet for metres", "the inverse: a metre is more than a foot, so divide",
                          "def feet(metres):\\n    return metres * 0.3048\\n"),
        ),
        where="lesson 00",
    ),
)
"""
CELLS = '''# %% [markdown]
# ## Task 2 — metres to feet (2 points)
#
# A foot is 0.3048 m.

# %% tags=["task"]
def feet(metres):
    """A length in feet."""
    # BEGIN SOLUTION
    # how many feet make a metre
    return metres / 0.3048
    # END SOLUTION


# %% tags=["check"]
check("00-2", feet)
'''
NAME = "00_start_here.ipynb"


@pytest.fixture(autouse=True)
def _none_before_or_after(monkeypatch):
    monkeypatch.setenv(FOLDER, "")
    yield
    use_private(None)


@pytest.fixture
def folder(tmp_path) -> Path:
    place = tmp_path / "mine"
    place.mkdir()
    (place / "lab_00.py").write_text(TASKS)
    (place / "lab_00_cells.py").write_text(CELLS)
    return place


def run(command, *words: str):
    done = CliRunner().invoke(command, [str(word) for word in words])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done


@pytest.mark.slow
def test_what_students_get_names_the_task_and_does_not_hold_it(folder, tmp_path):
    out = tmp_path / "labs"
    assert run(release.release, "00", "--out", out, "--private-tasks", folder).exit_code == 0
    nb = nbs.read_notebook(out / "exercises" / NAME)
    sources = [cell.source for cell in nb.cells]
    headings = [text.splitlines()[0] for text in sources if text.startswith("## ")]
    assert headings.index("## Task 2 — metres to feet (2 points)") == len(headings) - 2
    assert 'raise NotImplementedError("Task 2: metres to feet")' in next(text for text in sources if "def feet" in text)
    held = [path for path in out.rglob("*") if path.is_file() and b"/ 0.3048" in path.read_bytes()]
    assert held == [] and not (out / "course_lib" / "tasks" / "lab_00_cells.py").exists()
    slots = json.loads((out / "MANIFEST.json").read_text())["labs"]["00"]["slots"]
    assert [(slot["task"], slot["points"]) for slot in slots] == [("00-1", 1), ("00-2", 2)]
    code = "from course_lib.notebook import check\nprint(check('00-2', lambda metres: 1))\nprint(check('00-2', 3))"
    said = subprocess.run(
        [sys.executable, "-c", code], cwd=out, env={"PYTHONPATH": str(out)}, capture_output=True, text=True, check=True
    ).stdout
    assert "judged when you hand in" in said and "write feet, with no brackets" in said


@pytest.mark.slow
def test_it_is_graded_and_known_to_later_verbs(folder, tmp_path):
    need_sandbox()
    run(release.release, "00", "--out", tmp_path / "labs", "--private-tasks", folder)
    for student, answer in {"ann": "metres / 0.3048", "bob": "metres * 0.3048", "cem": ""}.items():
        nb = nbs.read_notebook(tmp_path / "labs" / "exercises" / NAME)
        for cell in nb.cells:
            if cell.id == "task-2" and answer:
                cell.source = f"def feet(metres):\n    return {answer}\n"
        (tmp_path / "class" / student).mkdir(parents=True)
        (tmp_path / "class" / student / NAME).write_text(nbformat.writes(nb), encoding="utf-8")
    use_private(None)
    grades = tmp_path / "grades"
    done = run(grade.grade, tmp_path / "class", "--out", grades, "--workers", 1, "--private-tasks", folder)
    assert done.exit_code == 0, done.output
    use_private(None)
    with Ledger(grades / "ledger.sqlite", write=False) as ledger:
        found = {entry.student: ledger.newest(entry) for entry in ledger.entries()}
        assert tasks.get("00-2").label == "Task 2: metres to feet"  # the ledger brings its own
    told = {student: record["tasks"][1] for student, record in found.items()}
    assert [(told[s]["id"], told[s]["points"], told[s]["status"]) for s in ("ann", "bob", "cem")] == [
        ("00-2", 2.0, "passed"), ("00-2", 0.0, "failed"), ("00-2", 0.0, "not started"),
    ]  # fmt: skip
    assert told["bob"]["misconceptions"] == ["feet for metres"] and found["ann"]["max"] == 3
    use_private(None)
    asked = run(release.viva, "ann", "00", "--task", 2, "--answers", "--grades", grades)
    assert asked.exit_code == 0 and "metres / 0.3048" in asked.output and "solution gives" in asked.output
    use_private(None)
    again = run(grade.grade, tmp_path / "class", "--out", grades, "--workers", 1)
    assert "0 to grade" in again.output  # nothing changed: the folder of grades remembers the tasks


@pytest.mark.parametrize(
    ("files", "sentence"),
    [
        ({}, "holds no private tasks"),
        ({"lab_00.py": "1 / 0\n"}, "raised ZeroDivisionError"),
        ({"lab_00.py": "TASKS = 3\n"}, "must define TASKS"),
        ({"lab_00.py": TASKS}, "lab_00_cells.py with the cells of 00-2 is missing"),
        ({"lab_00.py": TASKS.replace("00-2", "00-3"), "lab_00_cells.py": CELLS}, "must be numbered 00-1, 00-2"),
        ({"lab_00.py": TASKS, "lab_00_cells.py": CELLS.replace('"check"', '"x"')}, "task 2 needs a heading"),
        ({"lab_00.py": TASKS, "lab_00_cells.py": CELLS.replace("## Task", "# Task")}, "before the first '## Task N"),
    ],
)
def test_a_folder_that_is_of_no_use_says_so(files, sentence, tmp_path):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(CourseError, match=sentence):
        use_private(tmp_path)
    assert tasks.lab("00")[-1].id == "00-1"
