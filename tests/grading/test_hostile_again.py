"""Attacks that a second review of the grader found, each with a control: the same without the defence against it."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest
from grading_helpers import graded, need_sandbox, submission, task
from test_hostile_found import weaken

from course_lib import tasks
from course_lib.grading.run import grade_submission, sandbox
from course_lib.grading.run.sandbox import NoSandbox, probe_sandbox

pytestmark = pytest.mark.slow

# Inputs that can be known before they are asked


def drawn(number: str, seed: int) -> list[float]:
    """The first numbers that a task of lab 03 draws when it is graded."""
    seen: list[float] = []

    def cases(rng: np.random.Generator) -> list[tasks.Case]:
        seen.extend(rng.random(4))
        return [tasks.Case(dict.fromkeys(one.arguments, 0))]

    one = dataclasses.replace(tasks.get(number), cases=cases)
    grade_submission.fresh_cases(one, seed)
    return seen


def test_the_inputs_of_one_task_do_not_tell_those_of_another():
    assert drawn("03-2", 5) == drawn("03-2", 5) != drawn("03-5", 5)


GUESS = """
import numpy as np
def estimate_focal(pixels, depths, lengths, cx, cy):
    for number in range(350):
        rng = np.random.default_rng([number // 7, number % 7])
        f = float(rng.uniform(350, 900))
        if 319.5 + (rng.choice([-1.0, 1.0], 2) * rng.uniform((35, 25), (70, 50)))[0] == cx:
            return f
    raise ValueError("no seed fits")
"""


def test_a_seed_is_not_found_by_trying(monkeypatch):
    need_sandbox()
    one = task(graded("03", submission("03", {5: GUESS}), seed=2, task_seconds=20.0), 5)
    assert one["points"] == 0 and "no seed fits" in one["error"], one["error"]
    weaken(monkeypatch, grade_submission, "fresh_cases", ("fresh(task, own,", "fresh(task, seed,"))
    one = task(graded("03", submission("03", {5: GUESS}), seed=2, task_seconds=20.0), 5)
    assert one["points"] > 0, one["error"]  # the control


# What lies where the sandbox looks


def test_grades_below_a_folder_that_is_seen_inside_are_refused():
    need_sandbox()
    with pytest.raises(NoSandbox, match="/usr/lib/grades lies in /usr/lib, which submitted code can read"):
        probe_sandbox((Path("/usr/lib/grades"),))
    with pytest.raises(NoSandbox, match="which submitted code can read"):
        probe_sandbox((Path(os.__file__).parent / "course",))
    assert probe_sandbox((Path("/usr/src/grades"),)).kind == "bwrap"  # of /usr there are only the libraries


def test_the_probe_looks_for_the_files_of_this_course(monkeypatch):
    need_sandbox()
    held, bound = probe_sandbox(), sandbox._bound()
    assert sandbox._look(held, [sandbox.ROOT]) == ""
    monkeypatch.setattr(sandbox, "_bound", lambda: [*bound, str(sandbox.ROOT)])
    assert f"{sandbox.ROOT}/course.py" in sandbox._look(held, [sandbox.ROOT])
