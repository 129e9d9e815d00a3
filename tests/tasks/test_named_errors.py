"""Errors that are told without comparing number by number, and forms that say least."""

import numpy as np

from course_lib import tasks
from course_lib.tasks.diagnosis.forms import COUNTS, form_problem
from course_lib.tasks.diagnosis.named_errors import all_zero


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

    task = tasks.get("05-3")
    cases = task.public()
    result = tasks.judge_all(task, cases, tasks.run_all(all_kept, cases), by_radius)
    assert result.diagnosis.names == ("all chosen",)
