"""Task 5 of lab 01: catch the flying pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_band, refuse
from course_lib.tasks.plain import Plain


def flying_scene(rng: np.random.Generator, height: int = 72, width: int = 96) -> tuple[np.ndarray, np.ndarray]:
    """A noisy depth image and the mask of its flying pixels.

    Things from 0.6 m on before a wall about 5 m away; noise of 0.006 z², as stereo has it, and holes beside outlines.
    Half of the pixels on the far side of an outline hang somewhere between near and far.

    Returns
    -------
    depth : (height, width) float64, metres, 0 = no data.
    flying : (height, width) bool.
    """
    v, u = np.indices((height, width))
    clean = rng.uniform(4.5, 6) + rng.uniform(-1, 1) * u / width + rng.uniform(-1, 1) * v / height
    for _ in range(int(rng.integers(4, 8))):
        z, size = rng.uniform(0.6, 3.5), rng.uniform(0.1, 0.25) * height
        cv, cu = rng.uniform(0, height), rng.uniform(0, width)
        box = rng.random() < 0.5
        inside = np.maximum(abs(v - cv), abs(u - cu)) < size if box else np.hypot(v - cv, u - cu) < size
        clean = np.where(inside & (z < clean), z, clean)
    near = clean.copy()
    for dv in (-1, 0, 1):
        for du in (-1, 0, 1):
            near = np.minimum(near, np.roll(clean, (dv, du), (0, 1)))
    jump = clean - near > 0.5
    flying = jump & (rng.random(clean.shape) < 0.5)
    depth = np.where(flying, near + rng.uniform(0.15, 0.8, clean.shape) * (clean - near), clean)
    depth += rng.normal(0, 0.006, clean.shape) * depth**2
    holes = (jump & ~flying & (rng.random(clean.shape) < 0.5)) | (rng.random(clean.shape) < 0.02)
    depth[holes] = 0
    return depth, flying & ~holes


def _flying_cases(rng: np.random.Generator) -> list[Case]:
    depth, flying = flying_scene(rng)
    return [Case({"depth": depth}, {"truth": flying}, "things before a wall")]


def _f1(marked: np.ndarray, true: np.ndarray) -> float:
    return 2 * float((marked & true).sum()) / max(float(marked.sum() + true.sum()), 1.0)


_BANDS = ((0.15, 1.0), (0.25, 1 / 3), (0.4, 1 / 6))  # of 1 - F1


def _judge_flying(case: Case, answer: Plain) -> Verdict:
    shaped = judge_array(answer, np.zeros(case.truth.shape, bool), np.inf, what="the mask")
    if not shaped.passed:
        return refuse(shaped.message, _BANDS[0][0])
    marked = np.asarray(answer, bool)
    verdict = judge_band(1 - _f1(marked, case.truth), _BANDS, what="1 - F1")
    hits = float((marked & case.truth).sum())
    precision, recall = hits / max(float(marked.sum()), 1.0), hits / max(float(case.truth.sum()), 1.0)
    advice = "you mark too many" if precision < recall else "you mark too few"
    return replace(
        verdict,
        message=f"Precision is {precision:.1f} and recall {recall:.1f}"
        + (f": {advice}. " if verdict.score < 1 else ". ")
        + verdict.message,
    )


def _mask_distance(case: Case, a: Plain, b: Plain) -> float:
    a, b = np.asarray(a), np.asarray(b)
    return float(100 * (a != b).mean()) if a.shape == b.shape and a.size else np.inf


def _guess(rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """One of three plausible methods with settings drawn blindly."""
    method, power = int(rng.integers(3)), int(rng.integers(3))
    limit, least = 10 ** rng.uniform(-3.5, 0), int(rng.integers(0, 9))

    def flying_pixels(depth: np.ndarray) -> np.ndarray:
        h, w = depth.shape
        padded = np.pad(depth, 1)
        off = np.array([np.abs(padded[dv : dv + h, du : du + w] - depth) for dv in range(3) for du in range(3)])
        if method == 0:
            odd = (off < limit * depth**power).sum(axis=0) - 1 <= least
        elif method == 1:
            odd = off.max(axis=0) > limit * depth**power
        else:
            odd = np.median(off, axis=0) > limit * depth**power
        return (depth > 0) & odd

    return flying_pixels


_FLYING = "def flying_pixels(depth):\n    h, w = depth.shape\n    padded = np.pad(depth, 1)\n"
_WINDOWS = "[padded[dv:dv + h, du:du + w] for dv in range(3) for du in range(3)]"

TASK = Task(
    id="01-5",
    title="Catch the flying pixels",
    points=3,
    version=1,
    kind="open",
    signature="def flying_pixels(depth)",
    cases=_flying_cases,
    judge=_judge_flying,
    distance=_mask_distance,
    guess=_guess,
    misconceptions=(
        Misconception(
            "holes marked",
            "the pixels without data marked: a hole was not measured, a flying pixel was, wrongly",
            "def flying_pixels(depth):\n    return depth == 0\n",
        ),
        Misconception(
            "good ones marked",
            "the mask turned round: True is for the flying pixels, the few",
            _FLYING + f"    support = sum((abs(z - depth) < 0.02 * depth**2) & (z > 0) for z in {_WINDOWS}) - 1\n"
            "    return (depth > 0) & (support > 2)\n",
        ),
        Misconception(
            "whole outlines marked",
            "every pixel beside a jump marked: of these, most lie well on the near or the far thing",
            _FLYING + f"    jump = np.max([abs(z - depth) for z in {_WINDOWS}], axis=0)\n"
            "    return (depth > 0) & (jump > 0.5)\n",
        ),
        Misconception(
            "everything marked",
            "every measured pixel marked: recall is perfect and precision is almost nothing",
            "def flying_pixels(depth):\n    return depth > 0\n",
        ),
        Misconception(
            "nothing marked",
            "no pixel marked: precision cannot save a recall of zero",
            "def flying_pixels(depth):\n    return np.zeros(depth.shape, bool)\n",
        ),
    ),
    where="lesson 01, section 5 (holes, flying pixels, and where depth ends), and this task's hints",
)
