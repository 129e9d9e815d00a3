"""Task 5 of lab 06: find a plane among other things."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Misconception, Verdict
from course_lib.tasks.judges import judge_band, refuse
from course_lib.tasks.labs.lab_06_planes.plane_answers import apart, plane_problem, turned, which_part
from course_lib.tasks.plain import Plain

_THRESHOLD, _NOISE = 0.015, 0.005
_FIND_BANDS = ((0.002, 1.0), (0.005, 0.75), (0.015, 0.5), (0.05, 0.25))  # metres, at the rim of the plane


def cluttered(rng: np.random.Generator) -> Case:
    """A plane, 1.6 x 1.2 m, that two points in ten belong to; a smaller one above it, and things in between."""
    R, at = turned(rng, float(rng.uniform(30, 45)), np.array([1.0, 0.3, 0.0])), np.array([0.2, 0.1, 2.0])
    own = np.column_stack([rng.uniform((-0.8, -0.6), (0.8, 0.6), (400, 2)), rng.normal(0, _NOISE, 400)])
    shelf = np.column_stack([rng.uniform((0.1, -0.5), (0.8, 0.5), (250, 2)), 0.25 + rng.normal(0, _NOISE, 250)])
    things = rng.uniform((-0.3, -0.8, -0.05), (1.0, 0.8, 0.9), (1350, 3))
    points = rng.permutation(np.concatenate([own, shelf, things])) @ R.T + at
    around = np.radians(np.arange(0, 360, 15))
    rim = np.column_stack([0.8 * np.cos(around), 0.8 * np.sin(around), np.zeros(len(around))]) @ R.T + at
    truth = np.append(R[:, 2], -R[:, 2] @ at)
    given = {"points": points, "threshold": _THRESHOLD}
    return Case(given, {"truth": truth, "around": rim}, "a plane among other things")


def judge_find(case: Case, answer: Plain) -> Verdict:
    problem = plane_problem(answer, "the plane")
    if problem:
        return refuse(problem, _FIND_BANDS[0][0], "m")
    off = apart(answer, case.truth, case.hidden["around"])
    verdict = judge_band(off, _FIND_BANDS, "m", what="the error at the plane's rim")
    return replace(verdict, message=f"{verdict.message} {_why_off(case, answer, verdict.score)}".rstrip())


def _why_off(case: Case, answer: Plain, score: float) -> str:
    """What the points say of a plane that is not the best one, in a sentence or two."""
    points, threshold = case.given["points"], case.given["threshold"]
    off, true = (points @ plane[:3] + plane[3] for plane in map(np.asarray, (answer, case.truth)))
    near, most = (int(np.count_nonzero(np.abs(signed) <= threshold)) for signed in (off, true))
    if score == 1:
        return ""
    if score >= 0.25:
        return "A plane through three noisy points leans: fit to its inliers, collect these again, and fit again."
    if near < most:
        return (
            f"Only {near:,} points lie within the threshold of it, and {most:,} of the true one. Are there enough "
            "samples? Is each judged by that count, and the best kept? Has the normal length 1, and has the distance "
            "lost its sign, before you count?"
        )
    return ""


def what_was_found(case: Case, answer: Plain) -> tuple[str, str]:
    """Whether too few points agree with a plane, or which part of it is wrong where they do."""
    points, threshold = case.given["points"], case.given["threshold"]
    off, true = (np.abs(points @ plane[:3] + plane[3]) for plane in map(np.asarray, (answer, case.truth)))
    middle = points[true <= threshold].mean(axis=0)
    name, says = which_part(answer, case.truth, middle, threshold)
    few = 2 * np.count_nonzero(off <= threshold) < np.count_nonzero(true <= threshold)
    if few and name != "only d" and name != "another direction":
        return "few inliers", "Another plane was taken than the one that most points agree with."
    return name, says


def guess_plane(rng: np.random.Generator) -> Callable[[np.ndarray, float], np.ndarray]:
    """A function that says a plane through the middle of the points, turned at random."""
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    return lambda points, threshold: np.append(normal, -normal @ points.mean(axis=0))


_FIT = (
    "    middle = points.mean(axis=0)\n"
    "    vectors = np.linalg.eigh((points - middle).T @ (points - middle))[1]\n"
    "    normal = vectors[:, 0]\n"
    "    return np.append(normal, -normal @ middle)\n"
)


FIND_MISTAKES = (
    Misconception(
        "n · p = 1 of all points",
        "n · p = 1 solved for all points: all have their say; find out who belongs to the plane first",
        "def find_plane(points, threshold):\n"
        "    normal = np.linalg.lstsq(points, np.ones(len(points)), rcond=None)[0]\n"
        "    return np.append(normal, -1.0) / np.linalg.norm(normal)\n",
    ),
    Misconception(
        "fit to all points",
        "a fit to all points, in which the farthest weigh most: find out who belongs to the plane first",
        "def find_plane(points, threshold):\n" + _FIT,
    ),
    Misconception(
        "least squares in z of all points",
        "least squares in z over all points: errors along z, and of points that do not belong to the plane",
        "def find_plane(points, threshold):\n"
        "    columns = np.column_stack([points[:, :2], np.ones(len(points))])\n"
        "    a, b, c = np.linalg.lstsq(columns, points[:, 2], rcond=None)[0]\n"
        "    return np.array([a, b, -1.0, c]) / np.sqrt(a * a + b * b + 1)\n",
    ),
    Misconception(
        "far from the middle thrown away",
        "points far from the middle of all thrown away before a fit: the plane's own lie far out, too; vote instead",
        "def find_plane(points, threshold):\n"
        "    far = np.linalg.norm(points - np.median(points, axis=0), axis=1)\n"
        "    points = points[far <= np.median(far)]\n" + _FIT,
    ),
)
