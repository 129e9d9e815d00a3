"""Tasks 1, 2, 3 and 5 of lab 05 as they were: a threshold, distances, radius removal, and a desk to clean.

Distances are metres. A point never counts among its own neighbours, and a mask `keep` is True where a point stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from course_lib.tasks.core import Case, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_labels, judge_number
from course_lib.tasks.labs.lab_05_outliers.telling import telling
from course_lib.tasks.plain import Plain
from old_forms.outliers.cleaning import (
    CLEAN_MISTAKES,
    clean_distance,
    desk,
    guess_clean,
    judge_clean,
)
from old_forms.outliers.distances import DISTANCE_MISTAKES
from old_forms.outliers.mistakes import (
    CUT_MISTAKES,
    MEND_MISTAKES,
    MORE_CUT_MISTAKES,
    MORE_MEND_MISTAKES,
)
from old_forms.outliers.parts import part_of_clean, part_of_cut, part_of_radius


def _judge_mask(case: Case, answer: Plain) -> Verdict:
    """A mask against the true one; the error is how many points are wrong, and none may be."""
    verdict = judge_labels(answer, case.truth, what="the mask")
    if not np.isfinite(verdict.error):
        return verdict
    wrong = int(np.sum(np.asarray(answer) != case.truth))
    return replace(verdict, error=float(wrong), tolerance=0.1, unit="points")


# ------------------------------------------------------------------------------------------------------ 1 threshold


_CUT_TOLERANCE = 1e-5  # metres; bins are wider by far


def _where_to_cut(mean: np.ndarray, wrong: np.ndarray, edges: np.ndarray) -> float:
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = (low <= mean) & (mean < high)
        if np.sum(inside & wrong) > np.sum(inside & ~wrong):
            return float(low)
    raise ValueError("no bin holds more wrong points than true ones")


def _cut_case(mean: np.ndarray, wrong: np.ndarray, edges: np.ndarray, name: str) -> Case:
    given = {"mean": mean, "wrong": wrong, "edges": edges}
    return Case(given, {"truth": _where_to_cut(mean, wrong, edges)}, name)


def _cut_cases(rng: np.random.Generator) -> list[Case]:
    mean = np.array([1, 1, 3, 3, 3, 5]) / 1000
    head = _cut_case(mean, np.arange(6) > 2, np.array([0, 2, 4, 6]) / 1000, "six points in three bins")

    def draw() -> Case:
        edges = np.geomspace(0.002, 0.2, int(rng.integers(25, 35)))
        true = 0.006 * np.exp(rng.normal(0, 0.35, 1500))
        bad = 0.03 * np.exp(rng.normal(0, 0.5, int(rng.integers(90, 140))))
        # true points that lie alone, farther out than all wrong ones
        alone = rng.uniform(edges[-2], edges[-1], 4)
        hidden = rng.choice(true, 4)
        mean = np.concatenate([true, alone, bad, hidden])
        mean = np.clip(mean, edges[0] * 1.001, edges[-1] * 0.999)
        wrong = np.arange(len(mean)) >= len(true) + len(alone)
        order = rng.permutation(len(mean))
        return _cut_case(mean[order], wrong[order], edges, f"{len(mean):,} mean distances")

    return telling(draw, CUT_MISTAKES, "where_to_cut", 3, (head,))


# ------------------------------------------------------------------------------------------------------ 2 distances

_DISTANCE_TOLERANCE = 1e-4  # metres


def _mean_distances(points: np.ndarray, k: int) -> np.ndarray:
    out = np.empty(len(points))
    for i, point in enumerate(points):
        others = np.delete(points, i, axis=0)
        out[i] = np.sort(np.sqrt(np.sum((others - point) ** 2, axis=1)))[:k].mean()
    return out


def _distance_cases(rng: np.random.Generator, load: Callable[[str], Any] | None) -> list[Case]:
    five = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0], [9, 0, 0], [10, 0, 0.0]])
    cloud = rng.uniform(0, [1, 1, 0.2], (60, 3))
    twins = rng.uniform(0, 0.5, (40, 3))
    twins[20:30] = twins[:10]  # ten points that were measured twice
    far = rng.normal(0, 0.1, (50, 3)) + [4.0, -2.0, 7.0]
    real = []
    if load is not None:
        bunny = load("stanford_bunny").clouds["bun_zipper_res4"].points.astype(float)
        real = [(rng.permutation(bunny)[:400], 8, "400 points of the Stanford bunny")]
    return [
        Case({"points": points, "k": k}, {"truth": _mean_distances(points, k)}, name)
        for points, k, name in (
            (five, 2, "the five points of the lesson"),
            (cloud, 6, "60 points in a flat box"),
            (twins, 4, "40 points, ten of them twice"),
            *real,
            (far, 1, "50 points, the nearest other only"),
        )
    ]


# ------------------------------------------------------------------------------------------------------------ 3 mend


def _by_radius(points: np.ndarray, radius: float, least: int) -> np.ndarray:
    distance = np.sqrt(((points[:, None] - points[None]) ** 2).sum(axis=-1))
    np.fill_diagonal(distance, np.inf)
    return (distance <= radius).sum(axis=1) >= least


def _radius_cases(rng: np.random.Generator) -> list[Case]:
    def draw() -> Case:
        n = int(rng.integers(50, 80))
        while True:
            points = rng.uniform(0, 1, (n, 3))
            radius, least = float(rng.uniform(0.22, 0.3)), int(rng.integers(2, 5))
            distance = np.sqrt(((points[:, None] - points[None]) ** 2).sum(axis=-1))
            if min(np.abs(distance - radius).min(), np.abs(distance - np.sqrt(radius)).min()) > 1e-6:
                truth = _by_radius(points, radius, least)
                return Case({"points": points, "radius": radius, "least": least}, {"truth": truth}, f"{n} points")

    while True:
        grid = rng.permutation(rng.integers(0, 5, (200, 3)).astype(float))[:60] / 4  # steps of exactly a quarter
        truth, apart = _by_radius(grid, 0.5, 12), np.linalg.norm(grid[:, None] - grid[None], axis=2)
        if ((((apart <= 0.5) & (apart > 0)).sum(axis=1) >= 12) != truth).any():  # a twin decides for some
            break
    given = {"points": grid, "radius": 0.5, "least": 12}
    ties = Case(given, {"truth": truth}, "60 points on a grid, many at exactly the radius, some twice")
    return telling(draw, MEND_MISTAKES, "keep_by_radius", 3, (ties,))


# -------------------------------------------------------------------------------------------------------------- all

TASKS = (
    Task(
        id="05-1",
        title="where to cut",
        points=1,
        version=2,
        kind="fill",
        signature="def where_to_cut(mean, wrong, edges)",
        cases=_cut_cases,
        judge=lambda case, answer: judge_number(answer, case.truth, _CUT_TOLERANCE, "m", "the place to cut"),
        misconceptions=CUT_MISTAKES + MORE_CUT_MISTAKES,
        anatomy=part_of_cut,
        where="lesson 05, section 2 (how far are the neighbours?)",
    ),
    Task(
        id="05-2",
        title="mean distance to the neighbours",
        points=3,
        version=2,
        kind="write",
        signature="def mean_distances(points, k)",
        cases=_distance_cases,
        judge=lambda case, answer: judge_array(answer, case.truth, _DISTANCE_TOLERANCE, "m", what="the mean distance"),
        misconceptions=DISTANCE_MISTAKES,
        may_call=("numpy", "scipy.spatial"),
        hides=("course_lib.cloud.outliers.mean_distances", "course_lib.cloud.outliers.keep_by_statistics"),
        data=("stanford_bunny",),
        where="lesson 05, section 2 (how far are the neighbours?)",
    ),
    Task(
        id="05-3",
        title="mend a radius filter",
        points=3,
        version=3,
        kind="mend",
        signature="def keep_by_radius(points, radius, least)",
        cases=_radius_cases,
        judge=_judge_mask,
        misconceptions=MEND_MISTAKES + MORE_MEND_MISTAKES,
        anatomy=part_of_radius,
        may_call=("numpy", "scipy.spatial"),
        hides=("course_lib.cloud.outliers.keep_by_radius",),
        where="lesson 05, section 3 (how many neighbours?)",
    ),
    Task(
        id="05-5",
        title="clean a desk",
        points=4,
        version=2,
        kind="open",
        signature="def clean(points)",
        cases=lambda rng: [desk(rng)],
        judge=judge_clean,
        distance=clean_distance,
        misconceptions=CLEAN_MISTAKES,
        anatomy=part_of_clean,
        refused=part_of_clean,
        may_call=("numpy", "scipy.spatial", "scipy.sparse", "scipy.sparse.csgraph"),
        hides=("course_lib.cloud.clusters.euclidean_clusters",),
        guess=guess_clean,
        where="lesson 05, section 4 (islands) and section 5 (a pipeline, tuned and reported)",
    ),
)
