"""Lab 02: lists, bytes and frames of point clouds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from course_lib.geometry import transforms
from course_lib.tasks.core import Case, Task, Verdict
from course_lib.tasks.judges import (
    judge_array,
    judge_band,
    judge_number,
    judge_transform,
    quantity,
    refuse,
)
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_02_point_clouds.mistakes import (
    BACK_MISTAKES,
    CAUSE_OF,
    FEW_MISTAKES,
    READER_MISTAKES,
    ROW_MISTAKES,
    WHICH_MISTAKES,
)
from course_lib.tasks.plain import Plain

# Task 1: where is the pixel in the list?


def _row_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, (width, height) in (
        ("a wide image", (int(rng.integers(60, 90)), int(rng.integers(20, 40)))),
        ("a tall image", (int(rng.integers(20, 40)), int(rng.integers(60, 90)))),
    ):
        u, v = int(rng.integers(11, width - 2)), int(rng.integers(3, 10))
        index = np.arange(width * height).reshape(height, width)
        cases.append(Case({"u": u, "v": v, "width": width, "height": height}, {"truth": int(index[v, u])}, name))
    return cases


_TASK_1 = Task(
    id="02-1",
    title="Where is the pixel in the list?",
    points=1,
    version=1,
    kind="fill",
    signature="def row_of(u, v, width, height)",
    cases=_row_cases,
    judge=lambda case, answer: judge_number(answer, case.truth, 0.1, "rows", "the row"),
    misconceptions=ROW_MISTAKES,
    where="lesson 02, section 2 (ordered and unordered)",
)


# Task 2: points out of bytes


def _message_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, step, row_padding, offset, big in (
        ("points packed tightly", 12, 0, 0, False),
        ("PointXYZ with 4 bytes of padding, two points not measured", 16, 0, 0, False),
        ("x behind 8 bytes of other fields, rows with padding", 28, 20, 8, False),
        ("big-endian numbers", 16, 0, 0, True),
    ):
        height, width = int(rng.integers(3, 6)), int(rng.integers(4, 8))
        points = np.round(rng.uniform(-4, 4, (height, width, 3)), 3).astype(np.float32)
        if big or step == 16:  # pixels that saw nothing
            points[rng.integers(height), rng.integers(width)] = np.nan
            points[height - 1, width - 1] = np.nan
        row_step = width * step + row_padding
        # what is not x, y, z is small floats, so that a careless reader sees plausible numbers
        data = np.resize(
            rng.uniform(-4, 4, 64).astype(">f4" if big else "<f4").view(np.uint8), (height, row_step)
        ).copy()
        for column in range(width):
            start = column * step + offset
            block = np.ascontiguousarray(points[:, column], dtype=">f4" if big else "<f4").view(np.uint8)
            data[:, start : start + 12] = block.reshape(height, 12)
        given = {
            "data": data.ravel(),
            "height": height,
            "width": width,
            "point_step": step,
            "row_step": row_step,
            "x_offset": offset,
            "big_endian": big,
        }
        cases.append(Case(given, {"truth": points.reshape(-1, 3).astype(np.float64)}, name))
    return cases


def _judge_points(case: Case, answer: Plain) -> Verdict:
    return judge_array(answer, case.truth, 1e-5, "m", axes="xyz", what="the point")


_TASK_2 = Task(
    id="02-2",
    title="Points out of bytes",
    points=3,
    version=2,
    kind="real",
    signature="def read_points(data, height, width, point_step, row_step, x_offset, big_endian)",
    cases=_message_cases,
    judge=_judge_points,
    misconceptions=READER_MISTAKES,
    may_call=("numpy", "struct"),
    hides=("course_lib.cloud.pointcloud.from_message", "course_lib.cloud.pointcloud.message_to_xyz"),
    where="lesson 02, section 3 (points as bytes)",
)


# Task 3: mend the way back


def _pose(rng: np.random.Generator, least_degrees: float = 40) -> np.ndarray:
    """A pose that turns by 40 to 120 degrees about a slanted axis and shifts by about a metre."""
    axis = rng.normal(size=3)
    axis = np.sign(axis) * np.maximum(np.abs(axis), 0.3)
    axis /= np.linalg.norm(axis)
    turn = np.radians(rng.uniform(least_degrees, 120)) * axis
    R = transforms.exp(np.concatenate([np.zeros(3), turn]))[:3, :3]
    t = rng.choice([-1, 1], 3) * rng.uniform(0.4, 1.2, 3)
    return transforms.from_rotation_translation(R, t)


def _back_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, T in (
        ("a pose that turns and shifts", _pose(rng)),
        ("another one that turns and shifts", _pose(rng)),
        ("a pose that only shifts", transforms.from_rotation_translation(np.eye(3), rng.uniform(0.3, 1, 3))),
    ):
        R, t = T[:3, :3], T[:3, 3]
        truth = np.eye(4)
        truth[:3, :3], truth[:3, 3] = R.T, -(R.T @ t)
        cases.append(Case({"T": T}, {"truth": truth}, name))
    return cases


def _judge_back(case: Case, answer: Plain) -> Verdict:
    """All or nothing: a right turn with a wrong shift is what the learner was given to mend."""
    verdict = judge_transform(answer, case.truth, degrees=0.01, metres=1e-4, what="the inverse")
    return replace(verdict, score=float(verdict.passed))


_TASK_3 = Task(
    id="02-3",
    title="Mend the way back",
    points=2,
    version=2,
    kind="mend",
    signature="def invert(T)",
    cases=_back_cases,
    judge=_judge_back,
    misconceptions=BACK_MISTAKES,
    hides=("course_lib.geometry.transforms.invert", "numpy.linalg.inv"),
    where="lesson 02, section 5 (frames and transforms)",
)


# Task 4: which mistake moved it?

_TASK_4 = which_cause(
    "02-4",
    "Which mistake moved it?",
    CAUSE_OF,
    "the five clouds above",
    WHICH_MISTAKES,
    "lesson 02, sections 3 and 5",
)


# Task 5: few points that stand for many


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


def _few_cases(rng: np.random.Generator) -> list[Case]:
    return [Case({"points": _shape(rng), "n": _KEPT}, {}, "a bumpy shape, denser on one side")]


_FEW_BANDS = ((0.055, 1.0), (0.070, 2 / 3), (0.090, 1 / 3))  # metres


def coverage(points: np.ndarray, rows: np.ndarray) -> float:
    """How far the loneliest point is from a kept one, in metres."""
    return float(cKDTree(points[rows]).query(points)[0].max())


def _judge_few(case: Case, answer: Plain) -> Verdict:
    points, n = np.asarray(case.given["points"]), int(case.given["n"])
    shaped = judge_array(answer, np.zeros(n, int), np.inf, what="the row numbers", kind="int")
    if not shaped.passed:
        return refuse(shaped.message, _FEW_BANDS[0][0], "m")
    rows = np.asarray(answer, int)
    if len(np.unique(rows)) < n or rows.min() < 0 or rows.max() >= len(points):
        twice = n - len(np.unique(rows))
        why = f" ({twice} stand there again: keep the distance to all that are chosen)" if twice else ""
        words = f"The row numbers must be {n} different ones from 0 to {len(points) - 1}{why}."
        return refuse(words, _FEW_BANDS[0][0], "m")
    return judge_band(coverage(points, rows), _FEW_BANDS, "m", what="the loneliest point's distance")


def _few_distance(case: Case, a: Plain, b: Plain) -> float:
    """How many rows only one of two choices holds; infinite unless both are n different rows."""
    n = int(case.given["n"])
    a, b = np.asarray(a), np.asarray(b)
    if any(rows.shape != (n,) or len(np.unique(rows)) < n for rows in (a, b)):
        return np.inf
    return float(np.setxor1d(a, b).size)


def _how_spread(case: Case, answer: Plain) -> tuple[str, str] | None:
    """How chosen points lie: in clumps, or as dense as the cloud."""
    points, rows = np.asarray(case.given["points"]), np.asarray(answer, int)
    apart = float(np.median(cKDTree(points[rows]).query(points[rows], 2)[0][:, 1]))
    if coverage(points, rows) > 15 * apart:
        return "in clumps", (
            f"The chosen points lie in clumps: half of them have another within {quantity(apart, 'm')}. A new one must "
            "be far from all that are chosen: keep for every point the smallest distance to any of them (np.minimum)."
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


_TASK_5 = Task(
    id="02-5",
    title="Few points that stand for many",
    points=3,
    version=1,
    kind="open",
    signature="def few(points, n)",
    cases=_few_cases,
    judge=_judge_few,
    distance=_few_distance,
    anatomy=_how_spread,
    guess=_guess,
    misconceptions=FEW_MISTAKES,
    where="lesson 02 gives only the cloud; the idea is in the three hints of task 5",
)


# Task 6: explain

_TASK_6 = in_words(
    "02-6",
    "Explain",
    (
        "0: neither what NaN saves you from nor what it costs",
        "1: that a zero is taken for a place (at the camera) and a NaN is not, or that the order of the pixels is kept",
        "2: both: a zero is a wrong point at the camera that enters every mean unnoticed; NaN keeps pixels in place",
    ),
    "lesson 02, section 2 (ordered and unordered)",
)

TASKS = (_TASK_1, _TASK_2, _TASK_3, _TASK_4, _TASK_5, _TASK_6)
