"""Open tasks: the solution and one other method earn full marks in every scene, so the worst of seven is no luck.

The other method of task 05-5 stands in other_methods/05-5.py, as a learner could write it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from collected import TASKS, loader, reference
from how_thorough import sample

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.tasks.core import SCENES, Task
from course_lib.tasks.diagnosis.recognition import load_source
from course_lib.tasks.judging import judge_all
from course_lib.tasks.running import run_all
from course_lib.tasks.sources import forbidden

PARTS = range(sample(10, 1))
"""All 200 seeds, in parts that run side by side; else one part of four seeds."""
SEEDS = sample(20, 4)
OPEN = [task for task in TASKS if task.kind == "open"]
FOLDER = Path(__file__).parent / "other_methods"
each_open = pytest.mark.parametrize("task", OPEN, ids=[task.id for task in OPEN])


def other_method(task: Task) -> Callable[..., Any]:
    """A right function that works otherwise than the solution."""
    source = (FOLDER / f"{task.id}.py").read_text(encoding="utf-8")
    return load_source(f"{solutions.preamble(task.lab)}\n{source}", task.function)


@pytest.mark.slow
@each_open
@pytest.mark.parametrize("method", [reference, other_method], ids=["solution", "other"])
@pytest.mark.parametrize("part", PARTS)
def test_full_marks_in_every_scene(task: Task, method: Callable[[Task], Callable[..., Any]], part: int) -> None:
    load, function = loader(task), method(task)
    assert forbidden(task, function) == ""
    short = []
    for seed in range(2000 + part * SEEDS, 2000 + (part + 1) * SEEDS):
        cases = tasks.fresh(task, seed, load)
        assert len(cases) == SCENES
        result = judge_all(task, cases, run_all(function, cases))
        if result.score < 1:
            short.append((seed, result.points, result.error))
    assert not short, f"not full on {len(short)} of {SEEDS} seeds: {short[:3]}"


@each_open
def test_the_same_input_gives_the_same_answer(task: Task) -> None:
    cases = task.public(loader(task))
    assert not run_all(reference(task), cases[:1], twice=True)[0].unsteady


def test_a_program_that_loses_every_third_scene_seldom_earns_full_marks() -> None:
    task = OPEN[0]
    load, rng = loader(task), np.random.default_rng(1)
    cases = tasks.fresh(task, 1, load)
    outcomes = run_all(reference(task), cases)
    right = [task.judge(case, outcome.answer) for case, outcome in zip(cases, outcomes, strict=True)]
    assert all(verdict.score == 1 for verdict in right)
    full = 0
    for _ in range(200):
        lost = rng.random(SCENES) < 1 / 3
        given = [type(o)("raised", trouble="lost") if gone else o for o, gone in zip(outcomes, lost, strict=True)]
        full += judge_all(task, cases, given).score == 1
    assert full < 0.1 * 200
