"""The seed of a run, chosen of several: one with which the course's own solution earns everything."""

from __future__ import annotations

from collections.abc import Sequence

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.grading.run.grade_submission import fresh_cases

__all__ = ["draw_seed", "is_fair"]


def is_fair(lab: str, seed: int) -> bool:
    """Whether the reference earns all points on the inputs of a seed; an open task's best band can be out of reach."""
    for task in tasks.lab(lab):
        if task.kind != "explain":
            function, cases = solutions.answer_function(task), fresh_cases(task, seed)
            if tasks.judge_all(task, cases, tasks.run_all(function, cases)).points < task.points:
                return False
    return True


def draw_seed(lab: str, among: Sequence[int]) -> int:
    """The first seed that is fair.

    Raises
    ------
    RuntimeError
        If the reference fails on every one of them: then the lab is at fault, not the luck.
    """
    for seed in among:
        if is_fair(lab, seed):
            return seed
    raise RuntimeError(f"the solution of lab {lab} does not earn its points on any of {len(among)} seeds.")
