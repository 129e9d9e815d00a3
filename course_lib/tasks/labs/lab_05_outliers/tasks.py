"""Lab 05: a threshold with a cost, distances in pixels, a second view, what wrong settings leave behind, a deep room.

Points are metres in the camera's frame (x right, y down, z forward). A point never counts among its own neighbours, and
a mask `keep` is True where a point stays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_labels, judge_number
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_05_outliers.cleaning import (
    CLEAN_MISTAKES,
    clean_distance,
    desk,
    guess_clean,
    judge_clean,
)
from course_lib.tasks.labs.lab_05_outliers.distances import DISTANCE_MISTAKES
from course_lib.tasks.labs.lab_05_outliers.mistakes import (
    CAUSE_OF,
    CAUSES,
    CUT_MISTAKES,
    MEND_MISTAKES,
    MORE_CUT_MISTAKES,
    MORE_MEND_MISTAKES,
    WHICH_MISTAKES,
)
from course_lib.tasks.labs.lab_05_outliers.parts import part_of_clean, part_of_cut, part_of_radius
from course_lib.tasks.plain import Plain


def _judge_mask(case: Case, answer: Plain) -> Verdict:
    """A mask against the true one; the error is how many points are wrong, and none may be."""
    verdict = judge_labels(answer, case.truth, what="the mask")
    if not np.isfinite(verdict.error):
        return verdict
    wrong = int(np.sum(np.asarray(answer) != case.truth))
    return replace(verdict, error=float(wrong), tolerance=0.1, unit="points")


# ------------------------------------------------------------------------------------------------------ 1 threshold


_CUT_TOLERANCE = 1e-5  # pixels; bins are wider by far


def _where_to_cut(mean: np.ndarray, wrong: np.ndarray, edges: np.ndarray, cost: int) -> float:
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = (low <= mean) & (mean < high)
        if np.sum(inside & wrong) > cost * np.sum(inside & ~wrong):
            return float(low)
    raise ValueError("in no bin the wrong points outweigh the true ones")


_DRAWINGS, _CHOICES = 500, 60


def _answers(misconceptions: tuple[Misconception, ...], function: str, given: tuple) -> list[np.ndarray]:
    """What each wrong answer says."""
    out = []
    for misconception in misconceptions:
        space: dict = {"np": np}
        exec(misconception.source, space)
        out.append(np.asarray(space[function](*given)))
    return out


def _telling(
    draw: Callable[[], Case],
    mistakes: tuple[Misconception, ...],
    function: str,
    count: int,
    first: tuple[Case, ...] = (),
) -> list[Case]:
    """Cases that tell the truth and all wrong answers apart, each from each: drawn again until they do.

    Where no drawing of so many does, they are chosen one by one, each for what the others leave together.
    """

    def together(case: Case) -> set[tuple[int, int]]:
        """Pairs of answers, truth among them, that are the same in a case."""
        given = (np.copy(value) if isinstance(value, np.ndarray) else value for value in case.given.values())
        said = [case.truth, *_answers(mistakes, function, tuple(given))]
        return {(i, j) for i in range(len(said)) for j in range(i) if np.array_equal(said[i], said[j])}

    begin = set.intersection(*map(together, first))
    for _ in range(_DRAWINGS):
        cases = [draw() for _ in range(count)]
        if not begin.intersection(*map(together, cases)):
            return [*first, *cases]
    left, cases = begin, []
    for _ in range(count):
        drawn = [(case, left & together(case)) for case in (draw() for _ in range(_CHOICES))]
        case, left = min(drawn, key=lambda one: len(one[1]))
        cases.append(case)
    return [*first, *cases]


def _cut_case(mean: np.ndarray, wrong: np.ndarray, edges: np.ndarray, cost: int, name: str) -> Case:
    given = {"mean": mean, "wrong": wrong, "edges": edges, "cost": cost}
    return Case(given, {"truth": _where_to_cut(mean, wrong, edges, cost)}, name)


def _counts(rng: np.random.Generator, cost: int) -> np.ndarray:
    """True and wrong points (2, B) of the bins of a histogram in which each rule but the right one cuts elsewhere."""
    hill = [(int(n), int(rng.integers(1, 6))) for n in 400 * np.exp(-(((np.arange(6) - 2.2) / 1.8) ** 2)) + 9]
    hill[0] = hill[0][0], 0
    few, tie, last = (int(n) for n in rng.integers((12, 6, 3), (20, 10, 7)))
    foot = [
        (3 * few, 2 * few),
        (few, few + 2),  # more wrong ones than true ones, and not enough of them
        (few, 2 * few),
        (few, 3),
        (tie, cost * tie),
        (few, few - 2),
        (last, cost * last + 1),
        (last, last + 1),
        (2, 4 * cost + int(rng.integers(60, 90))),
        (0, 0),
        (1, cost),
        (0, int(rng.integers(5, 9))),
        *((int(rng.integers(2, 4)), 0) for _ in range(int(rng.integers(1, 3)))),
    ]
    return np.array(hill + foot).T


def _cut_cases(rng: np.random.Generator) -> list[Case]:
    head = _cut_case(np.array([1, 1, 3, 3, 3, 5.0]), np.arange(6) > 2, np.array([0, 2, 4, 6.0]), 2,
                     "six points in three bins")  # fmt: skip

    def draw() -> Case:
        cost = int(rng.integers(3, 9))
        counts = _counts(rng, cost)
        edges = np.geomspace(rng.uniform(0.8, 1.0), rng.uniform(50, 60), counts.shape[1] + 1)
        low, high = np.repeat(np.tile(edges[:-1], 2), counts.ravel()), np.repeat(np.tile(edges[1:], 2), counts.ravel())
        mean = low + (high - low) * rng.uniform(0.02, 0.98, len(low))
        order = rng.permutation(len(mean))
        return _cut_case(mean[order], (np.arange(len(mean)) >= counts[0].sum())[order], edges, cost,
                         f"{len(mean):,} mean distances")  # fmt: skip

    return _telling(draw, CUT_MISTAKES, "where_to_cut", 3, (head,))


# ------------------------------------------------------------------------------------------------------ 2 distances

_DISTANCE_TOLERANCE = 1e-3  # pixels


def _mean_distances(points: np.ndarray, k: int, fx: float) -> np.ndarray:
    out = np.full(len(points), np.nan)
    for i, point in enumerate(points):
        others = np.delete(points, i, axis=0)
        apart = np.sqrt(np.sum((others[~np.isnan(others[:, 2])] - point) ** 2, axis=1))
        out[i] = fx * np.sort(apart)[:k].mean() / point[2]
    return out


def _real_points(load: Callable[[str], Any]) -> np.ndarray:
    """Every sixth pixel of the upper left part of a real image, as points (N, 3); NaN where nothing was measured."""
    frame = load("tum_pair").frames[0]
    v, u = np.mgrid[40:160:6, 40:160:6]
    z = np.where(frame.depth[v, u] > 0, frame.depth[v, u].astype(float), np.nan)
    camera = frame.camera
    points = np.dstack([(u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z])
    return points.reshape(-1, 3)


def _distance_cases(rng: np.random.Generator, load: Callable[[str], Any] | None) -> list[Case]:
    five = np.array([[0, 0, 2], [1, 0, 2], [3, 0, 2], [9, 0, 2], [10, 0, 2.0]])
    cloud = rng.uniform([-0.5, -0.5, 0.6], [0.5, 0.5, 4.0], (70, 3))
    cloud[rng.choice(70, 12, replace=False)] = np.nan
    twins = rng.uniform([-0.3, -0.3, 0.5], [0.2, 0.2, 1.0], (40, 3))
    twins[20:30] = twins[:10]  # ten points that were measured twice
    twins[[3, 35]] = np.nan
    far = rng.normal(0, 0.1, (50, 3)) + [4.0, -2.0, 7.0]
    real = []
    if load is not None:
        real = [(_real_points(load), 8, 525.0, "400 pixels of a real desk, with holes")]
    return [
        Case({"points": points, "k": k, "fx": fx}, {"truth": _mean_distances(points, k, fx)}, name)
        for points, k, fx, name in (
            (five, 2, 500.0, "the five points of the lesson, 2 m away"),
            (cloud, 6, float(rng.uniform(300, 700)), "70 points from near to far, twelve not measured"),
            (twins, 4, float(rng.uniform(300, 700)), "40 points, ten of them twice, two not measured"),
            *real,
            (far, 1, float(rng.uniform(300, 700)), "50 points, the nearest other only"),
        )
    ]


# ------------------------------------------------------------------------------------------------------------ 3 mend


def _by_radius(points: np.ndarray, others: np.ndarray, radius: float, least: int) -> np.ndarray:
    return np.array([np.sum(np.sqrt(((others - p) ** 2).sum(axis=-1)) <= radius) >= least for p in points])


_FAR_OFF = np.array([-20.0, 8.0, 30.0])  # metres: there floats of 16 bits have steps of centimetres


def _radius_cases(rng: np.random.Generator) -> list[Case]:
    def draw() -> Case:
        n, m = int(rng.integers(50, 80)), int(rng.integers(85, 110))
        while True:
            points, others = (rng.uniform(0, 1, (count, 3)) + _FAR_OFF for count in (n, m))
            radius, least = float(rng.uniform(0.22, 0.3)), int(rng.integers(3, 6))
            distance = np.sqrt(((points[:, None] - others[None]) ** 2).sum(axis=-1))
            if min(np.abs(distance - radius).min(), np.abs(distance - np.sqrt(radius)).min()) > 1e-6:
                truth = _by_radius(points, others, radius, least)
                given = {"points": points, "others": others, "radius": radius, "least": least}
                return Case(given, {"truth": truth}, f"{n} points, and {m} of the other view")

    return _telling(draw, MEND_MISTAKES, "keep_by_radius", 3, (_ties(rng),))


def _ties(rng: np.random.Generator) -> Case:
    """Points on a grid with steps of a quarter, so that many others lie at exactly the radius and some at the place.

    The first and the last of the others decide for a point that lies apart: with them it has exactly `least`.
    """
    radius, least = 0.5, 6
    while True:
        points, others = (rng.integers(0, 5, (count, 3)) / 4 for count in (60, 70))
        squared = ((points[:, None] - others[None]) ** 2).sum(axis=-1)
        without_twins = ((squared <= radius**2) & (squared > 0)).sum(axis=1) >= least
        if (without_twins != _by_radius(points, others, radius, least)).any():  # a twin decides for some
            break
    apart = np.array([[5.0, 0, 0], [-7.0, 0, 0], [0, 9.0, 0], [0, -9.0, 0]])  # the third has two, the fourth none
    others = np.concatenate([
        apart[:1] + [radius, 0, 0],
        np.repeat(apart[:2], least - 1, axis=0) + rng.integers(0, 2, (2 * least - 2, 3)) / 4,
        apart[2] + [[0.25, 0, 0], [0, 0.25, 0]],
        apart[3] + rng.uniform([0, 0, 4], [0.2, 0.2, 5], (least, 3)),
        others,
        apart[1:2] + [0, radius, 0],
    ])  # fmt: skip
    points = np.concatenate([points, apart])
    truth = _by_radius(points, others, radius, least)
    given = {"points": points, "others": others, "radius": radius, "least": least}
    return Case(given, {"truth": truth}, "points on a grid, many others at exactly the radius, some at the very place")


# -------------------------------------------------------------------------------------------------------------- all

TASKS = (
    Task(
        id="05-1",
        title="where to cut",
        points=1,
        version=3,
        kind="fill",
        signature="def where_to_cut(mean, wrong, edges, cost)",
        cases=_cut_cases,
        judge=lambda case, answer: judge_number(answer, case.truth, _CUT_TOLERANCE, "px", "the place to cut"),
        misconceptions=CUT_MISTAKES + MORE_CUT_MISTAKES,
        anatomy=part_of_cut,
        where="lesson 05, section 2 (how far are the neighbours?)",
    ),
    Task(
        id="05-2",
        title="mean distance in pixels",
        points=3,
        version=3,
        kind="write",
        signature="def mean_distances(points, k, fx)",
        cases=_distance_cases,
        judge=lambda case, answer: judge_array(answer, case.truth, _DISTANCE_TOLERANCE, "px", what="the mean distance"),
        misconceptions=DISTANCE_MISTAKES,
        may_call=("numpy", "scipy.spatial"),
        hides=("course_lib.cloud.outliers.mean_distances", "course_lib.cloud.outliers.keep_by_statistics"),
        data=("tum_pair",),
        where="lesson 05, section 2 (how far are the neighbours?) and section 5 (a pipeline, tuned and reported)",
    ),
    Task(
        id="05-3",
        title="mend a filter by a second view",
        points=3,
        version=4,
        kind="mend",
        signature="def keep_by_radius(points, others, radius, least)",
        cases=_radius_cases,
        judge=_judge_mask,
        misconceptions=MEND_MISTAKES + MORE_MEND_MISTAKES,
        anatomy=part_of_radius,
        may_call=("numpy", "scipy.spatial"),
        hides=("course_lib.cloud.outliers.keep_by_radius",),
        where="lesson 05, section 3 (how many neighbours?)",
    ),
    which_cause(
        "05-4",
        "which setting made this",
        CAUSE_OF,
        "the five desks above",
        WHICH_MISTAKES,
        "lesson 05, sections 2 to 4, and Break it",
        causes=CAUSES,
        version=2,
    ),
    Task(
        id="05-5",
        title="clean a desk in a deep room",
        points=4,
        version=3,
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
    in_words(
        "05-6",
        "explain why repeating never ends",
        (
            "0: says that the cloud must be very noisy, or that more passes are needed.",
            "1: gives a cause: the threshold comes from the cloud itself and moves in as the deviation shrinks, or "
            "each pass measures anew, so that whoever lost a neighbour is next; or names a threshold fixed once.",
            "2: both: one of the two causes, and one fixed threshold (metres, multiples of the spacing, a median).",
        ),
        "lesson 05, Break it",
        version=2,
    ),
)
