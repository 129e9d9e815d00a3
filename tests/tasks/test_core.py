"""Tasks and their registry: what is refused when a task is written, and how tasks are found."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tiny_tasks import OPEN, RIGHT, TASK, cases, spoiled

from course_lib import tasks
from course_lib.tasks.core import Case, Verdict
from course_lib.tasks.judging import band, judge_all
from course_lib.tasks.running import Outcome, run_all


def test_names_of_a_task() -> None:
    assert (TASK.lab, TASK.number, TASK.label) == ("90", 1, "Task 1: lift pixels")
    assert (TASK.function, TASK.arguments) == ("lift", ("pixels", "z", "f"))
    assert spoiled(signature="def f(a: float, b: int) -> float:").arguments == ("a", "b")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"id": "3-2"}, "not of the form '03-2'"),
        ({"kind": "guess"}, "is none of fill, write"),
        ({"points": 0}, "points, version and where"),
        ({"version": 0}, "points, version and where"),
        ({"where": ""}, "points, version and where"),
        ({"kind": "explain"}, "rubric of three lines"),
        ({"rubric": ("a", "b", "c")}, "rubric of three lines"),
        ({"kind": "open"}, "has guess"),
        ({"signature": "lift(pixels)"}, "is not a def line"),
        ({"signature": "class A"}, "is not a def line"),
        ({"misconceptions": TASK.misconceptions * 2}, "same name"),
    ],
)
def test_a_task_that_makes_no_sense_is_refused(changes: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        spoiled(**changes)


def test_cases_follow_from_the_seed() -> None:
    again = replace(TASK)
    assert all(
        np.array_equal(a.given["z"], b.given["z"])
        for a, b in zip(tasks.fresh(TASK, 3), tasks.fresh(again, 3), strict=True)
    )
    assert not np.array_equal(tasks.fresh(TASK, 3)[1].given["z"], tasks.fresh(TASK, 4)[1].given["z"])
    assert TASK.public() is TASK.public()
    assert tasks.public_seed("90-1") != tasks.public_seed("90-2")
    assert len(tasks.fresh(OPEN, 1)) == 7
    assert len(OPEN.public()) == 3


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda rng: [], "drew no case"),
        (lambda rng: [Case({"z": 1, "pixels": 2, "f": 3})], "a case gives"),
        (lambda rng: [Case({"pixels": object(), "z": 2, "f": 3})], "pixels is an object"),
    ],
)
def test_bad_cases_are_refused(draw: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        tasks.fresh(spoiled(cases=draw), 0)


def test_ratio_of_a_verdict() -> None:
    assert Verdict(False, 3.0, 1.5).ratio == 2
    assert Verdict(False).ratio == np.inf
    assert Verdict(True).ratio == 0
    assert Verdict(True).score == 1 and Verdict(False).score == 0 and Verdict(False, score=0.5).score == 0.5


@pytest.mark.parametrize(
    ("ratio", "words"),
    [(0, "well within"), (0.5, "within tol"), (2, "within 3"), (9, "within 10"), (11, "more than 10")],
)
def test_band(ratio: float, words: str) -> None:
    assert band(ratio).startswith(words)


def test_every_case_needs_an_outcome() -> None:
    with pytest.raises(ValueError, match="1 outcomes for 2 cases"):
        judge_all(TASK, TASK.public(), [Outcome("answer", 1)])


def test_a_graders_own_outcomes_are_judged() -> None:
    """A grader hands in what another process answered, and its own reason where nothing came back."""
    public = TASK.public()
    right = [case.given["pixels"] * case.given["z"] / 525.0 for case in public]
    result = judge_all(
        TASK, public, [Outcome("answer", right[0]), Outcome("raised", trouble="It took longer than 10 s.")]
    )
    assert result.status == "raised" and result.points == 0
    assert result.line == "Task 1: lift pixels: It took longer than 10 s."
    assert judge_all(TASK, public, [Outcome("answer", answer) for answer in right]).points == 2


def test_an_open_task_earns_what_the_worst_scene_earns() -> None:
    drawn = tasks.fresh(OPEN, 1)
    outcomes = [Outcome("answer", case.truth) for case in drawn]
    assert judge_all(OPEN, drawn, outcomes).points == 4
    outcomes[2] = Outcome("raised", trouble="It took longer than 10 s.")
    result = judge_all(OPEN, drawn, outcomes)
    assert result.status == "raised" and result.points == 0 and result.worst == 2


def test_a_right_answer_that_changes_what_it_was_given_fails_where_the_task_says_so() -> None:
    def lift(pixels, z, f):
        right = pixels * z / f
        pixels *= 0
        return right

    public = TASK.public()
    outcomes = run_all(lift, public)
    assert judge_all(TASK, public, outcomes).passed
    result = judge_all(replace(TASK, keeps_inputs=True), public, outcomes)
    assert result.status == "failed" and result.score == 0
    assert result.error.startswith("It changes `pixels`, which whoever called it still needs: work on a copy")
    assert result.diagnosis.names == result.diagnosis.counted == ("input overwritten",)
    told = [replace(outcome, overwrote=("rubbish",)) for outcome in outcomes]  # what a kernel made up
    assert judge_all(replace(TASK, keeps_inputs=True), public, told).passed


def test_registry() -> None:
    assert "00" in tasks.lab_numbers()
    assert tasks.get("00-1") is tasks.lab("00")[0]
    assert tasks.get("00-1").function == "metres"


@pytest.mark.parametrize("name", ["00-9", "0-1", "", "99-1", None, 7])
def test_unknown_tasks_get_a_sentence(name: object) -> None:
    with pytest.raises(ValueError, match="there is no task"):
        tasks.get(name)


def test_unknown_lab_gets_a_sentence() -> None:
    with pytest.raises(ValueError, match="there is no lab '99'"):
        tasks.lab("99")


def test_the_task_of_the_guide_is_a_working_example() -> None:
    guide = (Path(__file__).parents[2] / "docs" / "add_a_lesson.md").read_text(encoding="utf-8")
    space: dict = {}
    [code] = [block for block in re.findall(r"```python\n(.*?)```", guide, re.S) if "TASKS" in block]
    exec(code, space)
    (task,) = space["TASKS"]
    wrong = judge_all(task, task.public(), tasks.run_all(lambda pixels, z, f: pixels * z, task.public()))
    assert [m.name for m in wrong.recognised] == ["focal length forgotten"]
    right = judge_all(task, task.public(), tasks.run_all(lambda pixels, z, f: pixels * z / f, task.public()))
    assert right.passed


def test_tiny_tasks_are_sound() -> None:
    assert RIGHT.startswith(TASK.signature)
    assert len(cases(np.random.default_rng(0))) == 2
