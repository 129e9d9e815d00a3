"""Lab 00: one line, to rehearse handing in."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_number
from course_lib.tasks.labs.lab_00_start_here.mistakes import MISTAKES
from course_lib.tasks.plain import Plain

_TOLERANCE = 1e-5  # metres; a raw step is 1 mm


def _cases(rng: np.random.Generator) -> list[Case]:
    """One value, then a small image with holes: raw depth of a RealSense, uint16, 1000 units a metre, 0 = no data."""
    value = int(rng.integers(601, 999))
    image = rng.integers(400, 6000, (4, 6)).astype(np.uint16)
    image[rng.random(image.shape) < 0.2] = 0
    image[0, :3] = 0, 1501, 6000
    return [
        Case({"depth_mm": value}, {"truth": value / 1000}, "one pixel, nearer than a metre"),
        Case({"depth_mm": image}, {"truth": image / 1000}, "a small depth image with holes"),
    ]


def _judge(case: Case, answer: Plain) -> Verdict:
    if isinstance(case.truth, float):
        return judge_number(answer, case.truth, _TOLERANCE, "m", "the depth")
    return judge_array(answer, case.truth, _TOLERANCE, "m", what="the depth")


TASKS = (
    Task(
        id="00-1",
        title="millimetres to metres",
        points=1,
        version=1,
        kind="fill",
        signature="def metres(depth_mm)",
        cases=_cases,
        judge=_judge,
        misconceptions=MISTAKES,
        hides=("course_lib.camera.rgbd.decode_depth",),
        where="lesson 00, this lab: the two hints under task 1",
    ),
)
