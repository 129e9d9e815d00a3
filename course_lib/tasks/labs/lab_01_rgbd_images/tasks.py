"""Lab 01: reading depth images.

All images are drawn here in NumPy: a slanted wall with things before it, so that the truth is known by construction.
"""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_array
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_01_rgbd_images import flying_pixels, resizing
from course_lib.tasks.labs.lab_01_rgbd_images.wall import MILLIMETRE, wall_with_things

# Task 1: from depth to range


def _range_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, (height, width), centred in [
        ("a camera with its principal point in the middle", (24, 32), True),
        ("a camera whose principal point is off the middle", (20, 40), False),
    ]:
        f = float(rng.uniform(0.6, 0.9) * width)
        cx, cy = (width - 1) / 2, (height - 1) / 2
        if not centred:
            cx, cy = float(cx + rng.uniform(4, 7)), float(cy - rng.uniform(3, 5))
        depth = wall_with_things(rng, height, width)
        v, u = np.indices(depth.shape)
        rays = np.stack([(u - cx) / f, (v - cy) / f, np.ones(depth.shape)], axis=-1)
        truth = np.linalg.norm(rays * depth[..., None], axis=-1)
        cases.append(Case({"depth": depth, "f": f, "cx": cx, "cy": cy}, {"truth": truth}, name))
    return cases


_RANGE = "def range_from_depth(depth, f, cx, cy):\n    v, u = np.indices(depth.shape)\n    return "

_TASK_1 = Task(
    id="01-1",
    title="From depth to range",
    points=1,
    version=1,
    kind="fill",
    signature="def range_from_depth(depth, f, cx, cy)",
    cases=_range_cases,
    judge=lambda case, answer: judge_array(answer, case.truth, MILLIMETRE, "m", what="the range"),
    misconceptions=(
        Misconception(
            "depth for range",
            "depth handed back as it came: z is one side of the triangle, the string is the long one",
            _RANGE + "depth\n",
        ),
        Misconception(
            "square root forgotten",
            "the squares added up, but no root taken: it would be right for (range / z) squared",
            _RANGE + "depth * (1 + ((u - cx) / f) ** 2 + ((v - cy) / f) ** 2)\n",
        ),
        Misconception(
            "rows for columns",
            "u and v exchanged: u counts columns and goes with cx, v counts rows and goes with cy",
            _RANGE + "depth * np.sqrt(1 + ((v - cx) / f) ** 2 + ((u - cy) / f) ** 2)\n",
        ),
        Misconception(
            "principal point forgotten",
            "pixels counted from the image's corner: subtract cx from u and cy from v first",
            _RANGE + "depth * np.sqrt(1 + (u / f) ** 2 + (v / f) ** 2)\n",
        ),
        Misconception(
            "one direction only",
            "only columns used: the string also runs up or down, so v belongs in the root too",
            _RANGE + "depth * np.sqrt(1 + ((u - cx) / f) ** 2)\n",
        ),
        Misconception(
            "pixels added to metres",
            "pixels squared added to metres squared: divide u - cx and v - cy by f first",
            _RANGE + "np.where(depth > 0, np.sqrt(depth ** 2 + (u - cx) ** 2 + (v - cy) ** 2), 0)\n",
        ),
        Misconception(
            "range to depth",
            "a division where a multiplication belongs: the string is longer than z, never shorter",
            _RANGE + "depth / np.sqrt(1 + ((u - cx) / f) ** 2 + ((v - cy) / f) ** 2)\n",
        ),
    ),
    hides=("course_lib.camera.pinhole.pixel_rays", "course_lib.camera.pinhole.deproject"),
    where="lesson 01, section 2 (depth is z, not range)",
)


# Task 2: three encodings


def _encoding_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for encoding, steps in (("tum", 5000), ("realsense", 1000), ("sun", 1000)):
        metres = wall_with_things(rng, 24, 32)
        metres[:, -4:] = rng.uniform(8.3, 9.8, (24, 4))  # a far end: in SUN's files it needs the bits that rotate
        raw = np.rint(metres * steps).astype(np.uint16)
        truth = raw / steps
        if encoding == "realsense":
            overflow = rng.random(raw.shape) < 0.03
            overflow[2, 3] = True
            raw[overflow], truth[overflow] = 65535, 0
        if encoding == "sun":
            raw = (raw << 3) | (raw >> 13)
        cases.append(
            Case({"raw": raw, "encoding": encoding}, {"truth": truth}, f"a raw image of the encoding {encoding!r}")
        )
    return cases


def _encoding(
    sun: str = "(raw >> 3) | (raw << 13)",
    overflow: str = "np.where(raw == 65535, 0, raw)",
    steps: str = '{"tum": 5000, "sun": 1000, "realsense": 1000}[encoding]',
    divide: str = "/",
) -> str:
    return (
        "def to_metres(raw, encoding):\n"
        f'    if encoding == "sun":\n        raw = {sun}\n'
        f'    if encoding == "realsense":\n        raw = {overflow}\n'
        f"    return raw {divide} {steps}\n"
    )


_TASK_2 = Task(
    id="01-2",
    title="Three cameras, one unit",
    points=2,
    version=1,
    kind="real",
    signature="def to_metres(raw, encoding)",
    cases=_encoding_cases,
    judge=lambda case, answer: judge_array(answer, case.truth, 1e-4, "m", what="the depth"),
    misconceptions=(
        Misconception(
            "TUM read as millimetres",
            "TUM's numbers divided by 1000: TUM stores 5000 steps a metre",
            _encoding(steps="1000"),
        ),
        Misconception(
            "SUN not rotated",
            "SUN's numbers divided without rotating their bits three places to the right",
            _encoding(sun="raw"),
        ),
        Misconception(
            "SUN shifted, not rotated",
            "SUN's numbers shifted right: the three bits that fall out must come back at the top",
            _encoding(sun="raw >> 3"),
        ),
        Misconception(
            "SUN rotated the wrong way",
            "SUN's bits rotated to the left: the file is rotated left already, turn it back right",
            _encoding(sun="(raw << 3) | (raw >> 13)"),
        ),
        Misconception(
            "65535 believed",
            "65535 taken for 65.5 m: it is the largest 16-bit number, an overflow, and means no data",
            _encoding(overflow="raw"),
        ),
        Misconception(
            "left in steps", "raw steps handed on as metres: divide by the steps per metre", _encoding(steps="1")
        ),
        Misconception(
            "whole metres",
            "a division that drops what is behind the point: // keeps whole metres, / keeps millimetres",
            _encoding(divide="//"),
        ),
    ),
    hides=("course_lib.camera.rgbd.decode_depth", "course_lib.camera.rgbd.ENCODINGS"),
    where="lesson 01, section 3 (from stored numbers to metres)",
)


# Task 3: half the size


# Task 4: which mistake made this?

_CAUSES = {"A": "8 bits", "B": "flipped", "C": "range", "D": "mixed", "E": "tum"}

_TASK_4 = which_cause(
    "01-4",
    "Which mistake made this?",
    _CAUSES,
    "the five error images above",
    (
        Misconception(
            "outlines taken for stripes",
            "8 bits and mixing exchanged: 8 bits make stripes on every surface, mixing only errs along outlines",
            'def causes():\n    return {"A": "mixed", "B": "flipped", "C": "range", "D": "8 bits", "E": "tum"}\n',
        ),
        Misconception(
            "scale taken for range",
            "range and scale exchanged: range grows towards the corners, a scale errs by one factor everywhere",
            'def causes():\n    return {"A": "8 bits", "B": "flipped", "C": "tum", "D": "mixed", "E": "range"}\n',
        ),
        Misconception(
            "flip taken for scale",
            "flip and scale exchanged: a flip errs with both signs, a scale with one",
            'def causes():\n    return {"A": "8 bits", "B": "tum", "C": "range", "D": "mixed", "E": "flipped"}\n',
        ),
    ),
    "lesson 01, sections 2 to 4 and Break it",
)


# Task 6: explain

_TASK_6 = in_words(
    "01-6",
    "Explain",
    (
        "0: neither 8 bits nor the mixing of neighbours, or only that the file is worse",
        "1: one of the two with what it does to points, or both without what they do",
        "2: 8 bits (steps of centimetres, staircases) and mixing (points in mid-air at outlines or beside zeros)",
    ),
    "lesson 01, section 4 and Break it",
)

TASKS = (_TASK_1, _TASK_2, resizing.TASK, _TASK_4, flying_pixels.TASK, _TASK_6)
