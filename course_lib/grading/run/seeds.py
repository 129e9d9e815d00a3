"""Drawing the seed of a run: random, but one with which the course's own solution earns everything."""

from __future__ import annotations

import secrets

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.grading.run.grade_submission import load_data

__all__ = ["draw_seed", "is_fair"]

TRIES = 20


def is_fair(lab: str, seed: int) -> bool:
    """Whether the reference earns all points on the inputs of a seed; an open task's best band can be out of reach."""
    for task in tasks.lab(lab):
        if task.kind != "explain":
            function = solutions.answer_function(task)
            cases = tasks.fresh(task, seed, load_data() if task.data else None)
            if tasks.judge_all(task, cases, tasks.run_all(function, cases)).points < task.points:
                return False
    return True


def draw_seed(lab: str) -> int:
    """A seed that nobody can guess and that is fair.

    Raises
    ------
    RuntimeError
        If the reference fails on every one of twenty: then the lab is at fault, not the luck.
    """
    for _ in range(TRIES):
        seed = secrets.randbelow(2**53)
        if is_fair(lab, seed):
            return seed
    raise RuntimeError(f"the solution of lab {lab} does not earn its points on any of {TRIES} seeds.")
