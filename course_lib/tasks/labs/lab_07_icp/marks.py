"""Marks in two scans, of which some weigh more and some were not found: lab 07's weighted pairs, and their truth."""

from __future__ import annotations

import numpy as np

from course_lib.geometry.transforms import apply
from course_lib.tasks.core import Case
from course_lib.tasks.labs.lab_07_icp.two_scans import motion


def horn(p: np.ndarray, q: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The rigid motion from p to q by the largest eigenvector of Horn's matrix of quaternions; weights (N,)."""
    mean_p, mean_q = (np.average(cloud, axis=0, weights=weights) for cloud in (p, q))
    S = (weights[:, None] * (p - mean_p)).T @ (q - mean_q)
    d = [S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]]
    N = np.empty((4, 4))
    N[0, 0], N[0, 1:], N[1:, 0] = np.trace(S), d, d
    N[1:, 1:] = S + S.T - np.trace(S) * np.eye(3)
    w, x, y, z = np.linalg.eigh(N)[1][:, -1]
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = mean_q - T[:3, :3] @ mean_p
    return T


def _marks(rng: np.random.Generator, source: np.ndarray, degrees: float, metres: float, name: str) -> Case:
    """Marks (N, 3) seen in two scans, the better the more they weigh."""
    weights = rng.uniform(0.2, 5, len(source))
    noise = rng.normal(0, 0.02, source.shape) / np.sqrt(weights)[:, None]
    return _weighted(source, apply(motion(rng, degrees, metres), source) + noise, weights, name)


def _weighted(source: np.ndarray, target: np.ndarray, weights: np.ndarray, name: str) -> Case:
    found = ~np.isnan(source + target).any(axis=1)
    truth = horn(source[found], target[found], weights[found])
    return Case({"source": source, "target": target, "weights": weights}, {"truth": truth}, name)


def _some_not_found(rng: np.random.Generator, case: Case) -> Case:
    """NaN in five rows of the source and in five others of the target."""
    source, target, weights = (case.given[name].copy() for name in ("source", "target", "weights"))
    lost = rng.choice(len(source), 10, replace=False)
    source[lost[:5]], target[lost[5:]] = np.nan, np.nan
    return _weighted(source, target, weights, case.name)


def _some_wrong(rng: np.random.Generator, case: Case) -> Case:
    """Six marks taken for others, and so of weight 0."""
    target, weights = case.given["target"].copy(), case.given["weights"].copy()
    wrong = rng.choice(len(target), 6, replace=False)
    target[wrong] += rng.uniform(0.5, 1.0, (6, 3))
    weights[wrong] = 0
    return _weighted(case.given["source"], target, weights, case.name)


def _is_mirrored(case: Case) -> bool:
    """Whether the SVD alone gives a reflection, and not by rounding: the weakest direction is decided by the noise."""
    p, q, w = (case.given[name] for name in ("source", "target", "weights"))
    p, q = p - w @ p / w.sum(), q - w @ q / w.sum()
    U, sizes, Vt = np.linalg.svd((p * w[:, None]).T @ q)
    return bool(np.linalg.det(Vt.T @ U.T) < 0 and sizes[2] > 1e-5 * sizes[0])


def fit_cases(rng: np.random.Generator) -> list[Case]:
    solid, far = rng.normal(size=(60, 3)) * [0.5, 0.3, 0.2], rng.normal(size=(40, 3)) * 0.3 + [1.5, -2.0, 0.7]
    plane = np.c_[rng.uniform(-1, 1, (30, 2)), rng.normal(0, 0.005, 30)] + [0.3, 0.2, 1.0]
    degrees = rng.uniform(8, 25, 3)
    cases = [
        _marks(rng, solid, degrees[0], 0.3, "marks about the origin"),
        _some_not_found(rng, _marks(rng, far, degrees[1], 0.6, "marks two metres away; some rows are NaN in the source, others in the target")),
        _some_wrong(rng, _marks(rng, solid + [0.4, 0.8, 0], degrees[2], 0.3, "some wrong pairs, of weight 0")),
    ]
    while True:  # of clouds as flat as their noise, half need the guard: draw until this one does
        tilted = apply(motion(rng, 60, 0.0), plane)
        case = _marks(rng, tilted, rng.uniform(8, 25), 0.4, "marks on a wall, which is flat")
        if _is_mirrored(case):
            return [*cases, case]
