"""Lab 01 as it was: task 3 with 0 alone for no data, task 4 with its letters in another order."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, quantity, refuse
from course_lib.tasks.kinds import which_cause
from course_lib.tasks.labs.lab_01_rgbd_images.causes import SIGNS, which_mistakes
from course_lib.tasks.labs.lab_01_rgbd_images.parts import half_anatomy
from course_lib.tasks.labs.lab_01_rgbd_images.wall import MILLIMETRE, wall_with_things
from course_lib.tasks.plain import Plain


def _half_cases(rng: np.random.Generator) -> list[Case]:
    things = wall_with_things(rng, 24, 32, holes=0.15)
    lone = np.zeros((6, 8))  # one measured pixel a block at most: picking one of four at random loses it
    for row, column in ((0, 0), (1, 3), (2, 5), (5, 6)):
        lone[row, column] = rng.uniform(1, 3)
    edge = np.where(np.indices((8, 12))[1] < 5, rng.uniform(0.8, 1.2), rng.uniform(2.5, 3.5))
    return [
        Case({"depth": things}, {}, "things before a wall, with holes"),
        Case({"depth": lone}, {}, "four lone pixels"),
        Case({"depth": edge}, {}, "an outline without holes"),
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
        f"{quantity(worst, 'm')} from any measured depth that it covers ({covered} m; 0 is no data).",
    )


def _half_distance(case: Case, a: Plain, b: Plain) -> float:
    a, b = np.asarray(a, float), np.asarray(b, float)
    return float(np.abs(a - b).max() / MILLIMETRE) if a.shape == b.shape and a.size else np.inf


_HALF = "def half_size(depth):\n    h, w = depth.shape\n    blocks = depth.reshape(h // 2, 2, w // 2, 2)\n"


def _each(calls: str, wheres: tuple[str, ...]) -> tuple[str, ...]:
    """The same slip with each of some calls and axes."""
    return tuple(_HALF + f"    return blocks.{call}(axis={where})\n" for call in calls.split() for where in wheres)


_AXES = _each("max min mean", ("(0, 2)", "(2, 3)", "(0, 1)"))
_ONE_AXIS = _each("max min mean", ("1", "3"))
_MEASURED = (
    "    some = (blocks > 0).any(axis=(1, 3), keepdims=True)\n"
    "    b = np.where(blocks > 0, blocks, np.where(some, np.nan, 0))\n"
)
_OTHER_BLOCKS = tuple(
    "def half_size(depth):\n    h, w = depth.shape\n"
    f"    return depth.reshape(h // 2, w // 2, 2, 2).{call}(axis=(2, 3))\n"
    for call in ("max", "min", "mean")
)

_TASK_3 = Task(
    id="01-3",
    title="Mend the small depth image",
    points=2,
    version=1,
    kind="mend",
    signature="def half_size(depth)",
    cases=_half_cases,
    judge=_judge_half,
    distance=_half_distance,
    anatomy=half_anatomy,
    misconceptions=(
        Misconception(
            "mixed",
            "an average of four: at an outline it lies between the near and the far thing, where nothing is",
            _HALF + "    return blocks.mean(axis=(1, 3))\n",
        ),
        Misconception(
            "measured ones mixed",
            "an average of the measured ones: zeros are left out, but near and far are still mixed",
            _HALF + "    n = (blocks > 0).sum(axis=(1, 3))\n"
            "    return np.where(n > 0, blocks.sum(axis=(1, 3)) / np.maximum(n, 1), 0)\n",
        ),
        Misconception(
            "zero for the nearest",
            "the smallest of four with zeros among them: no data is not near, leave it out first",
            _HALF + "    return blocks.min(axis=(1, 3))\n",
        ),
        Misconception(
            "median of four",
            "the median of four numbers, which is the mean of the middle two: that mixes again",
            _HALF + "    return np.median(blocks, axis=(1, 3))\n",
        ),
        Misconception(
            "median of the measured ones",
            "the median of the measured ones: of two or four it is the mean of the middle two, which mixes again",
            _HALF + _MEASURED + "    return np.nanmedian(b, axis=(1, 3))\n",
        ),
        Misconception(
            "infinity left",
            "infinity in the place of zeros, never taken back: where all four are 0 the result is 0",
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
            "def half_size(depth):\n    return np.maximum(depth[::2, ::2], depth[1::2, ::2])\n",
            variants=(
                "def half_size(depth):\n    return np.maximum(depth[::2, ::2], depth[::2, 1::2])\n",
                "def half_size(depth):\n    return np.maximum(depth[::2, ::2], depth[1::2, 1::2])\n",
            ),
        ),
        Misconception(
            "not made smaller",
            "the image in its own size: half the height and half the width are asked",
            "def half_size(depth):\n    return depth\n",
        ),
        Misconception(
            "a quarter cut out",
            "a quarter of the image cut out: every part of it belongs into the small one",
            "def half_size(depth):\n    h, w = depth.shape\n    return depth[:h // 2, :w // 2]\n",
        ),
        Misconception(
            "every second pixel",
            "every second pixel: never a mixture, but a hole where a neighbour was measured",
            "def half_size(depth):\n    return depth[::2, ::2]\n",
            variants=tuple(
                f"def half_size(depth):\n    return depth[{i}::2, {j}::2]\n" for i, j in ((0, 1), (1, 0), (1, 1))
            ),
        ),
    ),
    hides=("course_lib.camera.rgbd.resize_depth",),
    where='lesson 01, "Break it"',
)

SOLUTION_3 = """
def half_size(depth):
    h, w = depth.shape
    blocks = depth.reshape(h // 2, 2, w // 2, 2)
    return blocks.max(axis=(1, 3))
"""

_CAUSE_OF = {"A": "8 bits", "B": "flipped", "C": "range", "D": "mixed", "E": "tum"}
_TASK_4 = which_cause(
    "01-4",
    "Which mistake made this?",
    _CAUSE_OF,
    "the five error images above",
    which_mistakes(_CAUSE_OF),
    "lesson 01, sections 2 to 4 and Break it",
    signs=SIGNS,
)
SOLUTION_4 = f"""
def causes():
    return {_CAUSE_OF}
"""

FORMS = ((_TASK_3, SOLUTION_3), (_TASK_4, SOLUTION_4))
