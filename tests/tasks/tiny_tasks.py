"""Small tasks for the tests of the machinery: a sound one, and a way to spoil it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_array, judge_band, judge_number

RIGHT = "def lift(pixels, z, f):\n    return pixels * z / f\n"
NO_FOCAL = Misconception(
    "focal length forgotten", "no division by the focal length", "def lift(pixels, z, f):\n    return pixels * z\n"
)
SHIFTED = Misconception(
    "pixels from one", "pixels counted from 1: subtract 1", "def lift(pixels, z, f):\n    return (pixels + 1) * z / f\n"
)


def cases(rng: np.random.Generator) -> list[Case]:
    drawn = []
    for count in (1, 7):
        pixels = rng.uniform(-300, 300, count)
        pixels[0] = 300.0
        z = rng.uniform(0.5, 4.0, count)
        z[0] = 4.0
        drawn.append(Case({"pixels": pixels, "z": z, "f": 525.0}, {"truth": pixels * z / 525.0}, f"{count} pixels"))
    return drawn


TASK = Task(
    id="90-1",
    title="lift pixels",
    points=2,
    version=1,
    signature="def lift(pixels, z, f)",
    cases=cases,
    judge=lambda case, answer: judge_array(answer, case.truth, 1e-4, "m", what="x"),
    misconceptions=(NO_FOCAL, SHIFTED),
    hides=("course_lib.geometry.transforms.invert", "numpy.linalg.inv"),
    where="lesson 90, section 1",
)
ANSWERS = {"settings": {"level": 3.0}}
OPEN = Task(
    id="90-2",
    title="find the level",
    points=4,
    version=1,
    kind="open",
    signature="def level(values)",
    cases=lambda rng: [_levels(rng)],
    judge=lambda case, answer: _judge_level(case, answer),
    guess=lambda rng: _constant(rng.uniform(-100, 100)),
    where="lesson 90, section 2",
)


def _levels(rng: np.random.Generator) -> Case:
    truth = float(rng.uniform(-5, 5))
    return Case({"values": truth + rng.normal(0, 0.1, 400)}, {"truth": truth})


def _judge_level(case: Case, answer: Any) -> Any:
    number = judge_number(answer, case.truth, 1.0, "m")
    if not np.isfinite(number.error):
        return number
    return judge_band(number.error, ((0.05, 1.0), (0.5, 0.5)), "m", what="the error")


def _constant(value: float) -> Any:
    return lambda values: value


def spoiled(**changes: Any) -> Task:
    """The sound task with some fields changed."""
    return replace(TASK, **changes)
