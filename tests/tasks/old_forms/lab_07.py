"""Lab 07 as it was: pairs that all count alike, and two scans near each other, with few strays on both sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from course_lib.geometry.transforms import apply, compose, invert
from course_lib.tasks.core import Case, Task
from course_lib.tasks.labs.lab_07_icp import tasks as now
from course_lib.tasks.labs.lab_07_icp.marks import horn
from course_lib.tasks.labs.lab_07_icp.two_scans import bumps, motion
from course_lib.tasks.registry import get
from old_forms.fit_mistakes_07 import FIT_MISTAKES


def _moved_case(rng: np.random.Generator, points: np.ndarray, degrees: float, metres: float, name: str) -> Case:
    T = motion(rng, degrees, metres)
    return Case({"source": points, "target": apply(T, points)}, {"truth": T}, name)


def _fit_cases(rng: np.random.Generator) -> list[Case]:
    solid = rng.normal(size=(60, 3)) * [0.5, 0.3, 0.2]
    far = rng.normal(size=(40, 3)) * 0.3 + [1.5, -2.0, 0.7]
    cases = [
        _moved_case(rng, solid, rng.uniform(8, 25), 0.3, "a cloud about the origin"),
        _moved_case(rng, far, rng.uniform(8, 25), 0.6, "a cloud two metres from the origin"),
    ]
    noisy = apply(motion(rng, rng.uniform(8, 25), 0.3), solid) + rng.normal(0, 0.02, solid.shape)
    truth = horn(solid, noisy, np.ones(len(solid)))
    cases.append(Case({"source": solid, "target": noisy}, {"truth": truth}, "pairs with 2 cm of noise"))
    plane = np.c_[rng.uniform(-1, 1, (30, 2)), np.zeros(30)] + [0.3, 0.2, 1.0]
    while True:  # of planar clouds, half need the guard: draw until this one does
        case = _moved_case(rng, apply(motion(rng, 60, 0.0), plane), rng.uniform(8, 25), 0.4, "points of one plane")
        p, q = case.given["source"], case.given["target"]
        U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
        if np.linalg.det(Vt.T @ U.T) < 0:
            return [*cases, case]


def _scans_case(rng: np.random.Generator) -> Case:
    target, normals = bumps(rng, 900, 0.0, 1.5)
    clean = bumps(rng, 900, 0.5, 2.0)[0]
    target = target + rng.normal(0, 0.005, target.shape)
    noisy = clean + rng.normal(0, 0.005, clean.shape)
    strays = rng.uniform((0.5, 0, -0.8), (2.0, 2, 0.8), (90, 3))
    middle = np.eye(4)
    middle[:3, 3] = clean.mean(axis=0)
    T = compose(middle, motion(rng, rng.uniform(15, 20), rng.uniform(0.55, 0.65)), invert(middle))
    source = rng.permutation(apply(invert(T), np.vstack([noisy, strays])))
    return Case(
        {"source": source, "target": target, "normals": normals},
        {"truth": T, "surface": apply(invert(T), clean)},
        "two scans that share two thirds",
    )


_FIT = """
def best_rigid(source, target):
    mean_p, mean_q = source.mean(axis=0), target.mean(axis=0)
    U, _, Vt = np.linalg.svd((source - mean_p).T @ (target - mean_q))
    R = Vt.T @ np.diag([1, 1, np.sign(np.linalg.det(Vt.T @ U.T))]) @ U.T
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, mean_q - R @ mean_p
    return T
"""
_REGISTER = """
def register(source, target, normals):
    T, tree = np.eye(4), cKDTree(target)
    for radius in (1.0, 0.3, 0.1, 0.05):
        for _ in range(15):
            moved = source @ T[:3, :3].T + T[:3, 3]
            distance, index = tree.query(moved)
            keep = distance <= radius
            p, q, n = moved[keep], target[index[keep]], normals[index[keep]]
            rows = np.hstack([np.cross(p, n), n])
            x = np.linalg.lstsq(rows, np.sum(n * (q - p), axis=1), rcond=None)[0]
            step = np.eye(4)
            step[:3, :3], step[:3, 3] = turn(x[:3], np.degrees(np.linalg.norm(x[:3]))), x[3:]
            T = step @ T
    return T
"""

FORMS: tuple[tuple[Task, str], ...] = (
    (
        replace(
            get("07-2"),
            title="best rigid motion",
            version=3,
            signature="def best_rigid(source, target)",
            cases=_fit_cases,
            judge=now.judge_T,
            misconceptions=FIT_MISTAKES,
        ),
        _FIT,
    ),
    (
        replace(
            get("07-5"),
            version=2,
            signature="def register(source, target, normals)",
            cases=lambda rng: [_scans_case(rng)],
            judge=now.judge_scans(((0.007, 1.0), (0.011, 0.75), (0.018, 0.5), (0.04, 0.25))),
        ),
        _REGISTER,
    ),
)
