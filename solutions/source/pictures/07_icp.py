"""What lab 07's pictures are drawn from: a step repeated, and where five registrations of a tile ended."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from course_lib.geometry.transforms import apply, exp
from course_lib.notebook import data
from course_lib.registration import icp
from course_lib.tasks.labs.lab_07_icp.scan_mistakes import CAUSE_OF


def arrays() -> dict[str, np.ndarray]:
    """Where task 1's origin ends (2,) in metres, task 3's residuals (25,) in mm, and the rows (6, 4) of task 4."""
    return {"origin_ends": np.array([0.0, 1.0]), "residual": _residual(), "ends": _ends()}


def _residual() -> np.ndarray:
    animal = data.load("bunny_like").cloud.points.astype(float)[::12]
    off = exp(np.r_[0, 0, 0, 0, 0, np.radians(12)])
    off[:3, 3] = 0.008, 0, 0
    moved, near, found = apply(off, animal), cKDTree(animal), []
    for _ in range(25):
        distance, index = near.query(moved)
        found.append(1000 * np.sqrt(np.mean(distance**2)))
        moved = apply(icp.fit_rigid(moved, animal[index]), moved)
    return np.array(found)


def _ends() -> np.ndarray:
    """Determinant, degrees off (NaN of a reflection), middle off and RMSE in mm: the right one, then each letter."""
    rng = np.random.default_rng(4)
    axis = np.array([1, 1, 0.3]) / np.linalg.norm([1, 1, 0.3])
    R, t = exp(np.r_[0, 0, 0, np.radians(30) * axis])[:3, :3], np.array([0.4, -0.2, 0.3])
    lean = exp(np.r_[0, 0, 0, np.radians(20), 0, 0])[:3, :3]
    tile = np.c_[rng.uniform(-0.5, 0.5, (200, 2)), np.zeros(200)] @ lean.T + [0.3, 0.5, 0.8]
    aim = tile @ R.T + t
    middle, goal = tile.mean(axis=0), aim.mean(axis=0)
    across = R @ lean[:, 2]
    flip = (np.eye(3) - 2 * np.outer(across, across)) @ R
    first = icp.fit_rigid(tile, aim[cKDTree(aim).query(tile)[1]])
    made = {
        "right": (R, t),
        "no reflection guard": (flip, goal - flip @ middle),
        "the inverse": (R.T, -R.T @ t),
        "rotation transposed": (R.T, goal - R.T @ middle),
        "stopped after one step": (first[:3, :3], first[:3, 3]),
        "translation without R": (R, goal - middle),
    }
    rows = []
    for cause in ("right", *CAUSE_OF.values()):
        turn, shift = made[cause]
        ends, sign = tile @ turn.T + shift, np.linalg.det(turn)
        angle = np.degrees(np.arccos(np.clip((np.trace(turn.T @ R) - 1) / 2, -1, 1)))
        middle_off = np.linalg.norm(ends.mean(axis=0) - goal)
        rmse = np.sqrt(np.mean(np.sum((ends - aim) ** 2, axis=1)))
        rows.append([np.round(sign), angle if sign > 0 else np.nan, 1000 * middle_off, 1000 * rmse])
    return np.array(rows)
