"""Task 5 of lab 02: few points that stand for many, scored by the point that is farthest from a kept one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_band, quantity, refuse
from course_lib.tasks.plain import Plain

_HEAD = "def few(points, n):\n"


def _farthest(update: str, spare: str = "") -> str:
    """One row after the other, the farthest first; `update` is how distances change, `spare` what is not chosen."""
    return (
        f"{_HEAD}    rows = [0]\n"
        "    distances = np.linalg.norm(points - points[0], axis=1)\n"
        "    while len(rows) < n:\n"
        f"{spare}"
        "        rows.append(int(np.argmax(distances)))\n"
        "        new = np.linalg.norm(points - points[rows[-1]], axis=1)\n"
        f"        distances = {update}\n"
        "    return np.array(rows)\n"
    )


_SPARED = ("        distances[rows] = -1\n", "        distances[rows] = 0\n", "        distances[rows] = -np.inf\n")
MISTAKES = (
    Misconception(
        "the lesson's own code",
        "every so-many-th row, as the lesson thins a cloud: that keeps many where the cloud has many, and leaves its "
        "sparse side bare",
        f"{_HEAD}    return np.arange(n) * (len(points) // n)\n",
        variants=(
            f"{_HEAD}    return np.linspace(0, len(points) - 1, n).astype(int)\n",
            f"{_HEAD}    return np.linspace(0, len(points) - 1, n).round().astype(int)\n",
        ),
    ),
    Misconception(
        "the first rows",
        "the first n rows of the list: neighbours in the list are often neighbours in space, the rest stays bare",
        f"{_HEAD}    return np.arange(n)\n",
    ),
    Misconception(
        "the nearest ones",
        "the n points nearest to the middle: the far ends of the shape are left without any",
        f"{_HEAD}    return np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[:n]\n",
    ),
    Misconception(
        "the outermost ones",
        "the n points farthest from the middle: they crowd on the bumps and leave the rest bare",
        f"{_HEAD}    return np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[-n:]\n",
    ),
    Misconception(
        "only the last one asked",
        "each new point chosen far from the last one alone: it must be far from all that are chosen, so keep for every "
        "point the smallest distance to any of them",
        _farthest("new"),
        variants=tuple(_farthest("new", spare) for spare in _SPARED),
    ),
    Misconception(
        "the largest distance kept",
        "the largest distance to a chosen point kept, where the smallest counts: a point is served by its nearest one",
        _farthest("np.maximum(distances, new)"),
        variants=tuple(_farthest("np.maximum(distances, new)", spare) for spare in _SPARED),
    ),
    Misconception(
        "distances added up",
        "distances to all chosen points added up: then the two ends win again and again; a point is served by its "
        "nearest one",
        _farthest("distances + new"),
        variants=tuple(_farthest("distances + new", spare) for spare in _SPARED),
    ),
    Misconception(
        "distances never updated",
        "distances to the first point alone: after each new one, every point's distance to its nearest must be brought "
        "up to date",
        f"{_HEAD}    return np.argsort(-np.linalg.norm(points - points[0], axis=1))[:n]\n",
        variants=(_farthest("distances"), *(_farthest("distances", spare) for spare in _SPARED)),
    ),
    Misconception(
        "the kept one again",
        "the kept point chosen again and again: argmin takes the one that is best served, which is a kept one; argmax "
        "takes the one that needs it most",
        _farthest("np.minimum(distances, new)").replace("argmax", "argmin"),
        alike=("one length for all",),
    ),
    Misconception(
        "one length for all",
        "one length for all points, or one for each column, so that row 0 is the farthest: np.linalg.norm gives a "
        "length for each row with axis=1",
        _farthest("np.minimum(distances, new)").replace(", axis=1", ""),
        alike=("the kept one again",),
        variants=(_farthest("np.minimum(distances, new)").replace("axis=1", "axis=0"),),
    ),
    Misconception(
        "the nearest next",
        "the point that is best served chosen next: the one with the largest distance needs it most (argmax)",
        _farthest("np.minimum(distances, new)", "        distances[rows] = np.inf\n").replace("argmax", "argmin"),
    ),
)


def _shape(rng: np.random.Generator) -> np.ndarray:
    """(1500, 3) float64 metres: a closed bumpy surface 0.5 m long, five times as dense on one side, listed along x."""
    directions = rng.normal(size=(9000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    waves = rng.normal(size=(4, 3)) * 2.5
    radius = 0.1 * (1 + 0.15 * np.sin(directions @ waves.T).sum(axis=1) / 2)
    dense = directions[:, 0] > 0.3
    keep = rng.random(len(directions)) < np.where(dense, 0.5, 0.1)
    points = (directions * radius[:, None] * [2.5, 1, 1])[keep][:1500]
    return points[np.argsort(points[:, 0])]


_KEPT = 60


def _cases(rng: np.random.Generator) -> list[Case]:
    form = {"form": np.arange(_KEPT)}
    return [Case({"points": _shape(rng), "n": _KEPT}, form, "a bumpy shape, denser on one side")]


BARE = 0.15
"""Metres at an end of the shape without a kept point that are called a bare side; its length is about 0.5."""
BANDS = ((0.065, 1.0), (0.080, 2 / 3), (0.100, 1 / 3))  # metres


def coverage(points: np.ndarray, rows: np.ndarray) -> float:
    """How far the loneliest point is from a kept one, in metres."""
    return float(cKDTree(points[rows]).query(points)[0].max())


def _judge(case: Case, answer: Plain) -> Verdict:
    points, n = np.asarray(case.given["points"]), int(case.given["n"])
    shaped = judge_array(answer, np.zeros(n, int), np.inf, what="the row numbers", kind="int")
    if not shaped.passed:
        return refuse(shaped.message, BANDS[0][0], "m")
    rows = np.asarray(answer, int)
    if len(np.unique(rows)) < n or rows.min() < 0 or rows.max() >= len(points):
        twice = n - len(np.unique(rows))
        why = f" ({twice} of these came before)" if twice else ""
        words = f"The row numbers must be {n} different ones from 0 to {len(points) - 1}{why}."
        return refuse(words, BANDS[0][0], "m")
    return judge_band(coverage(points, rows), BANDS, "m", what="the loneliest point's distance")


def _distance(case: Case, a: Plain, b: Plain) -> float:
    """How many rows only one of two choices holds; infinite unless both are n different rows."""
    n = int(case.given["n"])
    a, b = np.asarray(a), np.asarray(b)
    if any(rows.shape != (n,) or len(np.unique(rows)) < n for rows in (a, b)):
        return np.inf
    return float(np.setxor1d(a, b).size)


def _how_spread(case: Case, answer: Plain) -> tuple[str, str] | None:
    """How chosen points lie: in clumps, not on one side, or as dense as the cloud."""
    points, rows = np.asarray(case.given["points"]), np.asarray(answer, int)
    apart = float(np.median(cKDTree(points[rows]).query(points[rows], 2)[0][:, 1]))
    if coverage(points, rows) > 15 * apart:
        return "in clumps", (
            f"The chosen points lie in clumps: half of them have another within {quantity(apart, 'm')}. A new one must "
            "be far from all that are chosen: keep for every point the smallest distance to any of them (np.minimum)."
        )
    bare = np.stack([points[rows].min(axis=0) - points.min(axis=0), points.max(axis=0) - points[rows].max(axis=0)])
    side, axis = np.unravel_index(np.argmax(bare), bare.shape)
    if bare.max() > BARE:
        return "a side left bare", (
            f"No point is kept in the {'last' if side else 'first'} {quantity(float(bare.max()), 'm')} of the shape "
            f"along {'xyz'[axis]}: a whole side is bare. Was a list that is sorted by place cut off after {len(rows)}?"
        )
    spacing = cKDTree(points).query(points, 11)[0][:, -1]
    rank = np.mean(np.searchsorted(np.sort(spacing), spacing[rows])) / len(points)
    if abs(rank - 0.5) < 0.1:
        return "as dense as the cloud", (
            "The chosen points are many where the cloud has many and few where it has few, as when they are drawn at "
            "random or every so-many-th is taken: let distances decide."
        )
    return None


def _guess(rng: np.random.Generator) -> Callable[[np.ndarray, int], np.ndarray]:
    """Rows drawn blindly, or every k-th from a blind start."""
    seed, regular = int(rng.integers(2**31)), rng.random() < 0.5

    def few(points: np.ndarray, n: int) -> np.ndarray:
        if regular:
            return (seed + np.arange(n) * (len(points) // n)) % len(points)
        return np.random.default_rng(seed).choice(len(points), n, replace=False)

    return few


TASK = Task(
    id="02-5",
    title="Few points that stand for many",
    points=3,
    version=2,
    kind="open",
    signature="def few(points, n)",
    cases=_cases,
    judge=_judge,
    distance=_distance,
    anatomy=_how_spread,
    guess=_guess,
    misconceptions=MISTAKES,
    where="lesson 02 gives only the cloud; the idea is in the three hints of task 5",
)
