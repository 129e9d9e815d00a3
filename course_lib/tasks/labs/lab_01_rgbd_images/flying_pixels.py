"""Task 5 of lab 01: catch the flying pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_band, refuse
from course_lib.tasks.labs.lab_01_rgbd_images.parts import flying_anatomy
from course_lib.tasks.plain import Plain

NOISE = 0.006
"""The spread of the noise is so many metres times z²: of 1 / z it is the same everywhere."""


def flying_scene(rng: np.random.Generator, height: int = 96, width: int = 128) -> tuple[np.ndarray, np.ndarray]:
    """A noisy depth image and the mask of its flying pixels.

    Things from 0.6 m to 2.5 m before a wall about 5 m away; noise of NOISE z², as stereo has it, and holes beside
    outlines. Of the pixels on the far side of an outline 60 % hang between near and far: at least six times the noise
    from both, more of them close to one of the two than midway, and now and then two beside each other at one depth.

    Returns
    -------
    depth : (height, width) float64, metres, 0 = no data.
    flying : (height, width) bool.
    """
    v, u = np.indices((height, width))
    clean = rng.uniform(4.5, 6) + rng.uniform(-1, 1) * u / width + rng.uniform(-1, 1) * v / height
    for _ in range(int(rng.integers(5, 9))):
        z, size = rng.uniform(0.6, 2.5), rng.uniform(0.1, 0.25) * height
        cv, cu = rng.uniform(0, height), rng.uniform(0, width)
        box = rng.random() < 0.5
        inside = np.maximum(abs(v - cv), abs(u - cu)) < size if box else np.hypot(v - cv, u - cu) < size
        clean = np.where(inside & (z < clean), z, clean)
    around = np.pad(clean, 1, mode="edge")
    near = np.min([around[i : i + height, j : j + width] for i in range(3) for j in range(3)], axis=0)
    outline = 1 / near - 1 / clean > 20 * NOISE
    flying = outline & (rng.random(clean.shape) < 0.6)
    share = np.sin(np.pi / 2 * rng.random(clean.shape)) ** 2
    share[:, 1::2] = share[:, ::2]
    nearest, farthest = 1 / near - 6 * NOISE, 1 / clean + 6 * NOISE
    depth = np.where(flying, 1 / (farthest + share * (nearest - farthest)), clean)
    depth += rng.normal(0, NOISE, clean.shape) * depth**2
    holes = (outline & ~flying & (rng.random(clean.shape) < 0.5)) | (rng.random(clean.shape) < 0.02)
    depth[holes] = 0
    return depth, flying & ~holes


def _flying_cases(rng: np.random.Generator) -> list[Case]:
    depth, flying = flying_scene(rng)
    return [Case({"depth": depth}, {"truth": flying}, "things before a wall")]


def _f1(marked: np.ndarray, true: np.ndarray) -> float:
    return 2 * float((marked & true).sum()) / max(float(marked.sum() + true.sum()), 1.0)


_BANDS = ((0.16, 1.0), (0.25, 1 / 3), (0.4, 1 / 6))  # of 1 - F1


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
    if a.shape != b.shape or a.dtype.kind != "b" or b.dtype.kind != "b":
        return np.inf
    other = float((a != b).sum())
    return max(100 * other / a.size, 20 * other / max(float((a | b).sum()), 1.0))  # of all, and of what either marks


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


def _mean(mean: str, limit: str = "0.018 * depth**2") -> str:
    return _FLYING + f"    mean = {mean}\n    return (depth > 0) & (abs(depth - mean) > {limit})\n"


def _support(limit: str, least: str = "support <= 1", reach: int = 1, own: str = " - 1", end: str = "") -> str:
    """The hint's method: too few neighbours within a limit."""
    span = f"range({2 * reach + 1})"
    return (
        f"def flying_pixels(depth):\n    h, w = depth.shape\n    padded = np.pad(depth, {reach})\n"
        f"    windows = [padded[dv:dv + h, du:du + w] for dv in {span} for du in {span}]\n"
        f"    support = sum((abs(z - depth) <= {limit}) & (z > 0) for z in windows){own}\n"
        f"    return {end or '(depth > 0) & '}({least})\n"
    )


TASK = Task(
    id="01-5",
    title="Catch the flying pixels",
    points=3,
    version=2,
    kind="open",
    signature="def flying_pixels(depth)",
    cases=_flying_cases,
    judge=_judge_flying,
    distance=_mask_distance,
    anatomy=flying_anatomy,
    guess=_guess,
    misconceptions=(
        Misconception(
            "the lesson's own code",
            "the lesson's 3 % of the depth for a limit: there it was held against the truth; here it is less than the "
            "noise far away, which grows with the square of the depth",
            _support("0.03 * depth"),
            variants=(_support("0.03 * depth", "support < 1"), _support("0.03 * depth", "support <= 4", reach=2)),
        ),
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
            variants=(
                _support("0.018 * depth**2", "support > 1"),
                _support("0.018 * depth**2", "support > 2"),
                _support("0.018 * depth**2", "support > 4", reach=2),
            ),
        ),
        Misconception(
            "whole outlines marked",
            "every pixel beside a jump marked: of these, most lie well on the near or the far thing",
            _FLYING + f"    jump = np.max([abs(z - depth) for z in {_WINDOWS}], axis=0)\n"
            "    return (depth > 0) & (jump > 0.5)\n",
        ),
        Misconception(
            "one limit for all depths",
            "one limit for near and far: the noise grows with the square of the depth, so let the limit grow with it",
            _support("0.018"),
            variants=tuple(_support(limit) for limit in ("0.003", "0.006", "0.01")),
        ),
        Misconception(
            "a limit that grows with z",
            "a limit that grows with the depth and not with its square: far away the noise is marked",
            _support("0.018 * depth"),
            variants=(_support("0.006 * depth"), _support("0.01 * depth")),
        ),
        Misconception(
            "one far neighbour is enough",
            "every pixel marked that has one neighbour at another depth: good ones at outlines have some, too; count "
            "those at its own depth",
            _support("0.018 * depth**2", "support < 8"),
            variants=(_support("0.018 * depth**2", "support < 7"), _support("0.018 * depth**2", "support <= 5")),
        ),
        Misconception(
            "a limit within the noise",
            "a limit of once the noise or less: a third of the good neighbours differ by more, so allow three times it",
            _support("0.006 * depth**2"),
            variants=(_support("0.003 * depth**2"), _support("0.002 * depth**2")),
        ),
        Misconception(
            "a limit far above the noise",
            "a limit far above the noise, so that flying pixels, too, have neighbours within it: three times the noise "
            "is enough",
            _support("0.1 * depth**2"),
            variants=(_support("0.06 * depth**2"), _support("0.018 * depth**3"), _support("0.2 * depth**2")),
        ),
        Misconception(
            "the size of the difference forgotten",
            "a difference without abs(): every neighbour that is much nearer counts as near, too",
            _support("0.018 * depth**2").replace("abs(z - depth)", "(z - depth)"),
            variants=(_support("0.018 * depth**2").replace("abs(z - depth)", "(depth - z)"),),
        ),
        Misconception(
            "too many neighbours asked",
            "pixels marked that have several neighbours at their own depth: at a corner good ones have no more, mark "
            "those with one or none",
            _support("0.018 * depth**2", "support <= 4"),
            variants=(_support("0.018 * depth**2", "support <= 3"),),
        ),
        Misconception(
            "itself counted",
            "the pixel itself counted among its neighbours: it is always near itself, so nearly none is left to it",
            _support("0.018 * depth**2", own=""),
        ),
        Misconception(
            "compared with a mean",
            "each pixel compared with the mean of its neighbours: at an outline that mean hangs in mid-air; count "
            "neighbours at its own depth",
            _mean(f"sum({_WINDOWS}) / 9"),
            variants=(
                _mean(f"(sum({_WINDOWS}) - depth) / 8"),
                _mean(f"sum({_WINDOWS}) / np.maximum(sum((z > 0) for z in {_WINDOWS}), 1)"),
                _mean(f"sum({_WINDOWS}) / 9", "0.1"),
                _mean(f"sum({_WINDOWS}) / 9", "0.05 * depth"),
            ),
        ),
        Misconception(
            "the whole image's mean",
            "depths far from the mean of the whole image: a flying pixel is odd among its neighbours, not among all",
            _FLYING + "    held = depth[depth > 0]\n    off = abs(depth - held.mean()) / held.std()\n"
            "    return (depth > 0) & (off > 2)\n",
            variants=(
                _FLYING + "    held = depth[depth > 0]\n    off = abs(depth - held.mean()) / held.std()\n"
                "    return (depth > 0) & (off > 1)\n",
            ),
        ),
        Misconception(
            "everything marked",
            "every measured pixel marked: recall is perfect and precision is almost nothing",
            "def flying_pixels(depth):\n    return depth > 0\n",
        ),
        Misconception(
            "nothing marked",
            "no pixel marked: is a limit far too wide (6 mm are 0.006 m), or a condition never true",
            "def flying_pixels(depth):\n    return np.zeros(depth.shape, bool)\n",
        ),
    ),
    where="lesson 01, section 5 (holes, flying pixels, and where depth ends), and this task's hints",
)
