"""Planes as answers: what is no plane, how far one is from the truth, and turns to lay boards with."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import array_problem


def turned(rng: np.random.Generator, degrees: float, about: np.ndarray) -> np.ndarray:
    """(3, 3) rotation by an angle about a direction in the (x, y) plane, after a random turn about z."""
    a, c = np.radians(degrees), rng.uniform(0, 2 * np.pi)
    k = about / np.linalg.norm(about)
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    R = np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K
    return R @ np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])


def plane_problem(answer: Plain, what: str) -> str:
    """What keeps an answer from being a plane, in one sentence; "" if nothing."""
    if isinstance(answer, list) and len(answer) == 2:
        return "Expected one array of four numbers, got two values, n and d: join them, np.append(n, d)."
    problem = array_problem(answer, np.zeros(4), what, None, None)
    if problem:
        return problem
    plane = np.asarray(answer, dtype=np.float64)
    if not np.isfinite(plane).all():
        return "The plane holds NaN or infinity: expected four finite numbers, n and d."
    length = float(np.linalg.norm(plane[:3])) if np.abs(plane[:3]).max() < 1e6 else np.inf
    if abs(length - 1) > 0.01:
        return f"The normal has length {length:.3g}, expected 1: divide n by it, and d likewise."
    return ""


def apart(answer: Plain, truth: Plain, around: np.ndarray) -> float:
    """The largest difference of two planes' distances at some points, in metres; the sign of a plane is free."""
    a, b = np.asarray(answer, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    first, second = around @ a[:3] + a[3], around @ b[:3] + b[3]
    return float(min(np.abs(first - second).max(), np.abs(first + second).max()))
