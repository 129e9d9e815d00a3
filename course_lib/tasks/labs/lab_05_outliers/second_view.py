"""Task 3 of lab 05: a point stays if a second view confirms it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Verdict
from course_lib.tasks.judges import judge_labels
from course_lib.tasks.labs.lab_05_outliers.mistakes import MEND_MISTAKES
from course_lib.tasks.labs.lab_05_outliers.telling import telling
from course_lib.tasks.plain import Plain


def judge_mask(case: Case, answer: Plain) -> Verdict:
    """A mask against the true one; the error is how many points are wrong, and none may be."""
    verdict = judge_labels(answer, case.truth, what="the mask")
    if not np.isfinite(verdict.error):
        return verdict
    wrong = int(np.sum(np.asarray(answer) != case.truth))
    return replace(verdict, error=float(wrong), tolerance=0.1, unit="points")


def _by_radius(points: np.ndarray, others: np.ndarray, radius: float, least: int) -> np.ndarray:
    return np.array([np.sum(np.sqrt(((others - p) ** 2).sum(axis=-1)) <= radius) >= least for p in points])


_FAR_OFF = np.array([-20.0, 8.0, 30.0])  # metres: there floats of 16 bits have steps of centimetres


def radius_cases(rng: np.random.Generator) -> list[Case]:
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

    return telling(draw, MEND_MISTAKES, "keep_by_radius", 3, (_ties(rng),))


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
