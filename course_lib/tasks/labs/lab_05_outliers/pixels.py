"""Task 2 of lab 05: mean distances in pixels at each depth, in a cloud with holes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from course_lib.tasks.core import Case

DISTANCE_TOLERANCE = 1e-3  # pixels


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


def distance_cases(rng: np.random.Generator, load: Callable[[str], Any] | None) -> list[Case]:
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
