"""Planes as answers: what is no plane, how far one is from the truth, and turns to lay boards with."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import array_problem, quantity


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


def which_part(answer: Plain, truth: Plain, middle: np.ndarray, near: float = 1e-3) -> tuple[str, str]:
    """Whether the normal or the offset of a plane is wrong; the offset follows from the normal and the middle.

    Parameters
    ----------
    middle : (3,) metres, the mean of the points that the plane should go through.
    near : metres; a plane that passes it so near goes through it.
    """
    plane, true = np.asarray(answer, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    plane = plane if plane[:3] @ true[:3] >= 0 else -plane
    leans = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(plane[:3], true[:3])), plane[:3] @ true[:3])))
    missed = abs(float(plane[:3] @ middle + plane[3]))
    if leans < 0.01:
        return (
            "only d",
            (f"The normal is right; only d is wrong: the plane misses the middle by {quantity(missed, 'm')}."),
        )
    if leans > 75 and missed < near:
        return "another direction", (
            f"The normal is {leans:.0f}° off, so it lies in the plane, as one of the other two directions. That of the "
            "smallest spread is asked; eigh sorts its eigenvalues, eig does not."
        )
    if missed < near:
        return "only the normal", (
            f"The plane goes through the middle of the points and leans by {leans:.2g}°: the normal is wrong, not d."
        )
    return "the normal first", (
        f"The normal is off by {leans:.2g}°, and the plane misses the middle of the points by {quantity(missed, 'm')}: "
        "mend the normal first, d follows from it and the mean."
    )
