"""Errors that are told without comparing number by number, and forms that say least."""

import numpy as np
from old_forms import OLD

from course_lib import tasks
from course_lib.tasks.diagnosis.forms import COUNTS, form_problem
from course_lib.tasks.diagnosis.named_errors import all_zero
from course_lib.tasks.judges import judge_array


def test_all_zero():
    assert all_zero([np.zeros(3), np.zeros((2, 2), int)])
    assert not all_zero([np.zeros(3), np.array([0.0, 1.0])])
    assert not all_zero([0.0])


def test_points_and_numbers_where_a_mask_is_asked():
    mask = np.arange(6) > 2
    for answer, name in (
        (np.zeros((4, 3)), "points for a mask"),
        (np.array([3, 1, 4, 1, 5, 9]), "numbers for a mask"),
        (np.array([0, 2, 5]), "row numbers for a mask"),
    ):
        assert form_problem(answer, mask)[0] == name
    assert form_problem(np.zeros((4, 3)), np.zeros((6, 3)))[0] in COUNTS


def right(points, voxel, origin, least):
    cubes = {}
    for point in points:
        cubes.setdefault(tuple(np.floor((point - origin) / voxel)), []).append(point)
    return np.array([np.mean(held, axis=0) for held in cubes.values() if len(held) >= least])


def test_a_slip_that_explains_another_count_is_told_before_the_count():
    def twice_the_voxel(points, voxel, origin, least):
        return right(points, 2 * voxel, origin, least)

    task = tasks.get("04-2")
    cases = task.public()
    result = tasks.judge_all(task, cases, tasks.run_all(twice_the_voxel, cases), right)
    assert result.diagnosis.names == ("voxel doubled",)


def test_a_mask_that_many_slips_explain_is_told_as_what_it_is():
    def all_kept(points, radius, least):
        return np.ones(len(points), bool)

    def by_radius(points, radius, least):
        distance = np.linalg.norm(points[:, None] - points[None], axis=2)
        return (distance <= radius + 1e-12).sum(axis=1) > least

    task = OLD["05-3"]
    cases = task.public()
    result = tasks.judge_all(task, cases, tasks.run_all(all_kept, cases), by_radius)
    assert result.diagnosis.names == ("all chosen",)


def test_a_reshape_is_told_only_where_it_helps_in_every_case():
    """One camera hides what three show: side by side is no reshape, one below the other is."""
    points = np.arange(24.0).reshape(8, 3)
    one, three = np.stack([points]), np.stack([points, points + 30, points + 60])
    below = [(np.vstack(truth), truth) for truth in (one, three)]
    beside = [(np.hstack(truth), truth) for truth in (one, three)]
    assert form_problem(*below[0], below[1:])[1].endswith(
        ".reshape(1, 8, 3) puts them so here; other cases have other sizes."
    )
    assert form_problem(*beside[0], beside[1:])[1].endswith("a reshape alone does not put them in order.")
    assert form_problem(*beside[0])[1].endswith(".reshape(1, 8, 3) puts them so.")


def test_a_judge_asks_for_no_reshape_where_the_form_says_none():
    for shape in ((8, 1, 3), (24,), (8, 3)):
        assert "reshape" not in judge_array(np.zeros(shape), np.zeros((1, 8, 3)), 1.0).message


def reader(**wrong):
    """What an answer of task 02-2 is told: the right one, but wrong in the cases whose names hold these words."""
    task = tasks.get("02-2")
    cases = task.public()
    outcomes = []
    for case in cases:
        made = next((make for words, make in wrong.items() if words in case.name), None)
        outcomes.append(made(case.truth) if made else tasks.Outcome("answer", case.truth))
    return tasks.judge_all(task, cases, outcomes)


def test_cases_that_fail_together_are_named():
    """Where errors have no place in common, the cases that fail may: padding at the end of their rows."""
    noise = np.random.default_rng(0)
    spoil = lambda truth: tasks.Outcome("answer", truth + noise.normal(size=truth.shape))  # noqa: E731
    result = reader(behind=spoil, between=spoil)
    assert result.diagnosis.names == ("only in some cases",)
    assert "2 of 5 cases are wrong, “x behind 5 bytes" in result.looks_like and "“z first" in result.looks_like
    every = reader(packed=spoil, PointXYZ=spoil, behind=spoil, big=spoil, between=spoil)
    assert every.diagnosis.names == ("scattered",)


def test_beside_an_exception_another_case_is_called_so():
    stopped = tasks.Outcome("raised", trouble="Line 3 raised ValueError.")
    result = reader(
        between=lambda truth: stopped, PointXYZ=lambda truth: tasks.Outcome("answer", np.nan_to_num(truth, nan=7.0))
    )
    assert result.line.startswith(
        "Task 2: Points out of bytes: Line 3 raised ValueError. In another case: Where nothing"
    )
