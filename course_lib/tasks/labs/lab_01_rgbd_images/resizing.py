"""Task 3 of lab 01: halve a depth image without inventing depths."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, quantity, refuse
from course_lib.tasks.labs.lab_01_rgbd_images.parts import half_anatomy, half_refused
from course_lib.tasks.labs.lab_01_rgbd_images.wall import MILLIMETRE, wall_with_things
from course_lib.tasks.plain import Plain


def _half_cases(rng: np.random.Generator) -> list[Case]:
    things = wall_with_things(rng, 24, 32, holes=0.15)
    lone = np.zeros((6, 8))  # one measured pixel a block at most: picking one of four at random loses it
    for row, column in ((0, 0), (1, 3), (2, 5), (5, 6)):
        lone[row, column] = rng.uniform(1, 3)
    edge = np.where(np.indices((8, 12))[1] < 5, rng.uniform(0.8, 1.2), rng.uniform(2.5, 3.5))
    gaps = wall_with_things(rng, 16, 24, holes=0.1)
    gaps[gaps > 0] += 3  # far away, where 16-bit floats have steps of 4 mm
    gaps[rng.random(gaps.shape) < 0.2] = np.nan
    gaps[4:6, 8:10], gaps[10:12, 2:4] = np.nan, [[0, np.nan], [np.nan, 0]]
    return [
        Case({"depth": things}, {}, "things before a wall, with holes"),
        Case({"depth": lone}, {}, "four lone pixels"),
        Case({"depth": edge}, {}, "an outline without holes"),
        Case({"depth": gaps}, {}, "far things, with holes of 0 and of NaN"),
    ]


def _four(depth: np.ndarray) -> np.ndarray:
    """(H/2, W/2, 4): the depths that each pixel covers."""
    return np.stack([depth[i::2, j::2] for i in (0, 1) for j in (0, 1)], axis=-1)


def _judge_half(case: Case, answer: Plain) -> Verdict:
    four = _four(np.asarray(case.given["depth"]))
    shaped = judge_array(answer, np.zeros(four.shape[:2]), np.inf, "m", what="the small image")
    if not shaped.passed:
        return refuse(shaped.message, MILLIMETRE, "m")
    small = np.asarray(answer, float)
    measured = four > 0
    nearest = np.where(measured, np.abs(four - small[..., None]), np.inf).min(-1)
    error = np.where(measured.any(-1), nearest, np.abs(small))
    row, column = np.unravel_index(np.argmax(error), error.shape)
    worst = float(error[row, column])
    if worst <= MILLIMETRE:
        return Verdict(True, worst, MILLIMETRE, "m", "depth", "Every pixel is one of the four depths that it covers.")
    covered = ", ".join(f"{z:.2f}" for z in four[row, column])
    return Verdict(
        False,
        worst,
        MILLIMETRE,
        "m",
        "depth",
        f"The pixel in row {row}, column {column} is {quantity(float(small[row, column]), 'm')}, "
        f"{quantity(worst, 'm')} from any measured depth that it covers ({covered} m; 0 and nan are no data).",
    )


def _half_distance(case: Case, a: Plain, b: Plain) -> float:
    a, b = np.asarray(a, float), np.asarray(b, float)
    return float(np.abs(a - b).max() / MILLIMETRE) if a.shape == b.shape and a.size else np.inf


_HALF = (
    "def half_size(depth):\n    h, w = depth.shape\n    blocks = np.nan_to_num(depth).reshape(h // 2, 2, w // 2, 2)\n"
)
_AS_GIVEN = _HALF.replace("np.nan_to_num(depth)", "depth")


def _both(*lines: str) -> tuple[str, ...]:
    """The same slip in blocks without NaN, and in those that were given."""
    return tuple(start + line for line in lines for start in (_HALF, _AS_GIVEN))


def _each(calls: str, wheres: tuple[str, ...]) -> tuple[str, ...]:
    """The same slip with each of some calls and axes; in the blocks as given it is NaN nearly everywhere."""
    return tuple(_HALF + f"    return blocks.{call}(axis={where})\n" for call in calls.split() for where in wheres)


def _picked(row: int, column: int) -> str:
    return f"def half_size(depth):\n    return np.nan_to_num(depth)[{row}::2, {column}::2]\n"


_MIXED = _both("    return blocks.mean(axis=(1, 3))\n")
_SMALLEST = _both("    return blocks.min(axis=(1, 3))\n")
_MEDIAN = _both("    return np.median(blocks, axis=(1, 3))\n")
_AXES = _each("max min mean", ("(0, 2)", "(2, 3)", "(0, 1)"))
_ONE_AXIS = _each("max min mean", ("1", "3"))
_MEASURED = (
    "    some = (blocks > 0).any(axis=(1, 3), keepdims=True)\n"
    "    b = np.where(blocks > 0, blocks, np.where(some, np.nan, 0))\n"
)
_OTHER_BLOCKS = tuple(
    "def half_size(depth):\n    h, w = depth.shape\n"
    f"    return {depth}.reshape(h // 2, w // 2, 2, 2).{call}(axis=(2, 3))\n"
    for call in ("max", "min", "mean")
    for depth in ("np.nan_to_num(depth)", "depth")
)
_TWO = tuple(
    f"def half_size(depth):\n    d = np.nan_to_num(depth)\n    return np.maximum(d[::2, ::2], d[{i}::2, {j}::2])\n"
    for i, j in ((1, 0), (0, 1), (1, 1))
)

TASK = Task(
    id="01-3",
    title="Mend the small depth image",
    points=2,
    version=2,
    kind="mend",
    signature="def half_size(depth)",
    cases=_half_cases,
    judge=_judge_half,
    distance=_half_distance,
    anatomy=half_anatomy,
    refused=half_refused,
    misconceptions=(
        Misconception(
            "the lesson's own code",
            "one of the four picked by its place, as the lesson picks: never a mixture, but a hole where a neighbour "
            "was measured; look first which of the four are measured",
            _picked(1, 1),
            variants=(
                *(_picked(i, j) for i, j in ((0, 0), (0, 1), (1, 0))),
                *(_picked(i, j).replace("np.nan_to_num(depth)", "depth") for i in (0, 1) for j in (0, 1)),
            ),
        ),
        Misconception(
            "mixed",
            "an average of four: at an outline it lies between the near and the far thing, where nothing is",
            _MIXED[0],
            variants=_MIXED[1:],
        ),
        Misconception(
            "measured ones mixed",
            "an average of the measured ones: what is no data is left out, but near and far are still mixed",
            _HALF + "    n = (blocks > 0).sum(axis=(1, 3))\n"
            "    return np.where(n > 0, blocks.sum(axis=(1, 3)) / np.maximum(n, 1), 0)\n",
            variants=(
                _AS_GIVEN + "    n = (blocks > 0).sum(axis=(1, 3))\n"
                "    return np.where(n > 0, blocks.sum(axis=(1, 3)) / np.maximum(n, 1), 0)\n",
            ),
        ),
        Misconception(
            "NaN chosen",
            "the largest or smallest of numbers with NaN among them, which is NaN: turn NaN into 0 before you choose",
            _AS_GIVEN + "    return blocks.max(axis=(1, 3))\n",
            variants=(
                _AS_GIVEN + "    b = np.where(blocks == 0, np.inf, blocks).min(axis=(1, 3))\n"
                "    return np.where(np.isinf(b), 0, b)\n",
            ),
        ),
        Misconception(
            "NaN left where nothing was measured",
            "NaN left out in choosing, and still there where all four are NaN: the result is 0 there",
            _AS_GIVEN + "    return np.fmax.reduce(blocks, axis=(1, 3))\n",
            variants=(_AS_GIVEN + "    return np.fmax.reduce(np.where(blocks > 0, blocks, np.nan), axis=(1, 3))\n",),
        ),
        Misconception(
            "blocks with NaN dropped",
            "NaN turned into 0 after the choice: a block with one NaN loses its measured depths, too; turn it before",
            _AS_GIVEN + "    return np.nan_to_num(blocks.max(axis=(1, 3)))\n",
        ),
        Misconception(
            "zero for the nearest",
            "the smallest of four with zeros among them: no data is not near, leave it out first",
            _SMALLEST[0],
            variants=(*_SMALLEST[1:], _AS_GIVEN + "    return np.nan_to_num(np.fmin.reduce(blocks, axis=(1, 3)))\n"),
        ),
        Misconception(
            "median of four",
            "the median of four numbers, which is the mean of the middle two: that mixes again",
            _MEDIAN[0],
            variants=_MEDIAN[1:],
        ),
        Misconception(
            "median of the measured ones",
            "the median of the measured ones: of two or four it is the mean of the middle two, which mixes again",
            _HALF + _MEASURED + "    return np.nanmedian(b, axis=(1, 3))\n",
        ),
        Misconception(
            "infinity left",
            "infinity in the place of no data, never taken back: where nothing was measured the result is 0",
            _HALF + "    return np.where(blocks > 0, blocks, np.inf).min(axis=(1, 3))\n",
        ),
        Misconception(
            "other axes",
            "a choice along other axes: (h/2, 2, w/2, 2) has the four of a pixel on axes 1 and 3",
            _AXES[0],
            variants=_AXES[1:],
        ),
        Misconception(
            "one axis only",
            "a choice along one axis only: the four of a pixel stand on both axes of length 2, 1 and 3",
            _ONE_AXIS[0],
            variants=_ONE_AXIS[1:],
        ),
        Misconception(
            "not its own four",
            "four numbers that follow each other in memory: these lie in one row, so keep (h/2, 2, w/2, 2)",
            _OTHER_BLOCKS[0],
            variants=_OTHER_BLOCKS[1:],
        ),
        Misconception(
            "two of the four",
            "the larger of two of the four: all four are to be asked, or holes stay where a neighbour was measured",
            _TWO[0],
            variants=_TWO[1:],
        ),
        Misconception(
            "not made smaller",
            "the image in its own size: half the height and half the width are asked",
            "def half_size(depth):\n    return depth\n",
            variants=("def half_size(depth):\n    return np.nan_to_num(depth)\n",),
        ),
        Misconception(
            "a quarter cut out",
            "a quarter of the image cut out: every part of it belongs into the small one",
            "def half_size(depth):\n    h, w = depth.shape\n    return depth[:h // 2, :w // 2]\n",
            variants=(
                "def half_size(depth):\n    h, w = depth.shape\n    return np.nan_to_num(depth)[:h // 2, :w // 2]\n",
            ),
        ),
    ),
    hides=("course_lib.camera.rgbd.resize_depth",),
    where='lesson 01, "Break it"',
)
