"""A lab asks for more than the lesson's code: pasted under a task's name it earns less than half, but in two tasks."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from collected import TASKS, loader
from lesson_helpers import lesson_source

from course_lib import tasks
from course_lib.tasks.core import Task
from course_lib.tasks.judging import Result, judge_all
from course_lib.tasks.running import run

MOST_REPEATED, MOST_SHARE = 2, 0.25
OWN_CODE = "the lesson's own code"
ASKED = [task for task in TASKS if task.kind not in ("which", "explain") and task.lab != "00"]
LABS = sorted({task.lab for task in ASKED})
SEEDS = (None, 900, 901)


@lru_cache
def lesson_functions(number: str) -> dict[str, Callable[..., Any]]:
    """The functions that a lesson defines, with its imports and the constants that they rely on."""
    space: dict[str, Any] = {"np": np, "__name__": "lesson"}
    for node in ast.parse(lesson_source(number).read_text(encoding="utf-8")).body:
        kept = isinstance(node, (ast.Import, ast.ImportFrom, ast.FunctionDef)) or (
            isinstance(node, ast.Assign) and not any(isinstance(part, ast.Call) for part in ast.walk(node.value))
        )
        try:
            if kept:
                exec(compile(ast.Module([node], []), f"lesson {number}", "exec"), space)
        except (NameError, TypeError, AttributeError):  # it needs a value that the lesson computes
            continue
    return {name: value for name, value in space.items() if getattr(value, "__module__", "") == "lesson"}


def pasted(task: Task) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Each function of the lesson under the task's name, its arguments chosen from the task's in every order."""
    for name, function in lesson_functions(task.lab).items():
        wanted = function.__code__.co_argcount - len(function.__defaults__ or ())
        for chosen in itertools.permutations(range(len(task.arguments)), wanted):
            words = ", ".join(task.arguments[i] for i in chosen)
            yield f"{name}({words})", lambda *given, f=function, c=chosen: f(*(given[i] for i in c))


def earned(task: Task, function: Callable[..., Any], load: Any) -> Iterator[Result]:
    """What a pasted function earns, seed by seed, as long as it earns half."""
    for seed in SEEDS:
        cases = task.public(load) if seed is None else tasks.fresh(task, seed, load)
        outcomes = []
        for case in cases:
            outcomes.append(run(function, case))
            if outcomes[-1].kind != "answer" or task.judge(case, outcomes[-1].answer).score < 0.5:
                return
        yield judge_all(task, cases, outcomes)


@pytest.mark.parametrize("lab", LABS)
def test_at_most_two_tasks_repeat_the_lesson(lab: str) -> None:
    every = tasks.lab(lab)
    repeated = [task for task in every if task.repeats]
    assert len(repeated) <= MOST_REPEATED
    assert sum(t.points for t in repeated) <= MOST_SHARE * sum(t.points for t in every)


@pytest.mark.parametrize("task", [t for t in ASKED if not t.repeats], ids=lambda task: task.id)
def test_the_lesson_pasted_earns_less_than_half(task: Task) -> None:
    load = loader(task)
    tried = 0
    for name, function in pasted(task):
        tried += 1
        half = [result for result in earned(task, function, load) if result.score >= 0.5]
        assert len(half) < len(SEEDS), f"the lesson's {name} earns {half[0].points:g} of {task.points:g} points"
    assert tried or not lesson_functions(task.lab)


@pytest.mark.parametrize("task", [t for t in ASKED if not t.repeats and t.kind != "fill"], ids=lambda task: task.id)
def test_the_lessons_own_code_is_registered(task: Task) -> None:
    assert OWN_CODE in {mistake.name for mistake in task.misconceptions}
