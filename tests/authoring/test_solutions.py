"""Reading tasks from the source of a lab."""

from __future__ import annotations

from pathlib import Path

import pytest

from course_lib.authoring import solutions
from course_lib.authoring.tree import CourseError

LAB = """# %% [markdown]
# # Lab 00 Tiny

# %%
# %matplotlib inline
import math
from course_lib.notebook import check
SCALE = 1000
HARD = math.sqrt(2)
print("no")

def helper(x):
    return x / SCALE

# %% [markdown]
# ## Task 1 — millimetres to metres (1 point)
#
# <details><summary>Hint 1: idea</summary>
# one
# </details>

# %% tags=["task"]
def metres(depth_mm):
    # BEGIN SOLUTION
    return helper(depth_mm)
    # END SOLUTION

# %% tags=["check"]
check("00-1", metres)

# %% [markdown]
# <details><summary>Hint 2: call</summary>
# two
# </details>

# %% [markdown]
# ## How to hand in
# <details><summary>Hint 3: not of the task</summary></details>
"""


@pytest.fixture
def root(tmp_path: Path) -> Path:
    folder = tmp_path / "solutions" / "source"
    folder.mkdir(parents=True)
    (folder / "00_tiny.py").write_text(LAB, encoding="utf-8")
    return tmp_path


def test_task_of_a_lab(root: Path) -> None:
    (task,) = solutions.lab_tasks("00", root)
    assert (task.number, task.title, task.points) == (1, "millimetres to metres", 1)
    assert task.hints == 2
    assert task.check == 'check("00-1", metres)'


def test_reference_and_stub(root: Path) -> None:
    space: dict = {}
    exec(solutions.preamble("00", root) + "\n" + solutions.reference("00-1", root), space)
    assert space["metres"](1500) == 1.5
    assert "math" in space and "check" not in space and "HARD" not in space
    assert 'raise NotImplementedError("Task 1: millimetres to metres")' in solutions.stub("00-1", root)


def test_an_edited_source_is_read_again(root: Path) -> None:
    assert solutions.task_of_lab("00-1", root).points == 1
    path = root / "solutions" / "source" / "00_tiny.py"
    path.write_text(LAB.replace("(1 point)", "(3 points)"), encoding="utf-8")
    assert solutions.task_of_lab("00-1", root).points == 3


def test_what_is_missing_is_named(root: Path, tmp_path: Path) -> None:
    with pytest.raises(CourseError, match="one 01_name.py"):
        solutions.source_path("01", root)
    path = root / "solutions" / "source" / "00_tiny.py"
    path.write_text(LAB.replace('tags=["task"]', ""), encoding="utf-8")
    with pytest.raises(CourseError, match="0 cells tagged task"):
        solutions.lab_tasks("00", root)
    path.write_text(LAB.replace("## Task 1", "## Task 7"), encoding="utf-8")
    with pytest.raises(CourseError, match="## Task 1"):
        solutions.task_of_lab("00-1", root)
