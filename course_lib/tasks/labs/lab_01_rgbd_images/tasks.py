"""Lab 01: reading depth images.

All images are drawn here in NumPy: a slanted wall with things before it, so that the truth is known by construction.
"""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_choice, judge_words, quantity, refuse
from course_lib.tasks.labs.lab_01_rgbd_images import flying_pixels
from course_lib.tasks.plain import Plain

_MILLIMETRE = 1e-3


def _wall_with_things(rng: np.random.Generator, height: int, width: int, holes: float = 0.05) -> np.ndarray:
    """(height, width) float64 metres, 0 = no data: a slanted wall behind boxes and discs."""
    v, u = np.indices((height, width))
    depth = rng.uniform(2.2, 3.6) + rng.uniform(-0.4, 0.4) * u / width + rng.uniform(-0.4, 0.4) * v / height
    for _ in range(int(rng.integers(3, 6))):
        z = rng.uniform(0.7, 1.9)
        cv, cu, size = rng.uniform(0, height), rng.uniform(0, width), rng.uniform(0.1, 0.25) * height
        box = rng.random() < 0.5
        inside = np.maximum(abs(v - cv), abs(u - cu)) < size if box else np.hypot(v - cv, u - cu) < size
        depth = np.where(inside & (z < depth), z, depth)
    depth[rng.random(depth.shape) < holes] = 0
    return depth


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
        depth = _wall_with_things(rng, height, width)
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
    judge=lambda case, answer: judge_array(answer, case.truth, _MILLIMETRE, "m", what="the range"),
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
        metres = _wall_with_things(rng, 24, 32)
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


def _half_cases(rng: np.random.Generator) -> list[Case]:
    things = _wall_with_things(rng, 24, 32, holes=0.15)
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
        return refuse(shaped.message, _MILLIMETRE, "m")
    small = np.asarray(answer, float)
    measured = four > 0
    nearest = np.where(measured, np.abs(four - small[..., None]), np.inf).min(-1)
    error = np.where(measured.any(-1), nearest, np.abs(small))
    row, column = np.unravel_index(np.argmax(error), error.shape)
    worst = float(error[row, column])
    if worst <= _MILLIMETRE:
        return Verdict(True, worst, _MILLIMETRE, "m", "depth", "Every pixel is one of the four depths that it covers.")
    covered = ", ".join(f"{z:.2f}" for z in four[row, column])
    return Verdict(
        False,
        worst,
        _MILLIMETRE,
        "m",
        "depth",
        f"The pixel in row {row}, column {column} is {quantity(float(small[row, column]), 'm')}, "
        f"{quantity(worst, 'm')} from any measured depth that it covers ({covered} m; 0 is no data).",
    )


def _half_distance(case: Case, a: Plain, b: Plain) -> float:
    a, b = np.asarray(a, float), np.asarray(b, float)
    return float(np.abs(a - b).max() / _MILLIMETRE) if a.shape == b.shape and a.size else np.inf


_HALF = "def half_size(depth):\n    h, w = depth.shape\n    blocks = depth.reshape(h // 2, 2, w // 2, 2)\n"

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
            "every second pixel",
            "every second pixel: never a mixture, but a hole where a neighbour was measured",
            "def half_size(depth):\n    return depth[::2, ::2]\n",
        ),
    ),
    hides=("course_lib.camera.rgbd.resize_depth",),
    where='lesson 01, "Break it"',
)


# Task 4: which mistake made this?

_CAUSES = {"A": "8 bits", "B": "flipped", "C": "range", "D": "mixed", "E": "tum"}

_TASK_4 = Task(
    id="01-4",
    title="Which mistake made this?",
    points=2,
    version=1,
    kind="which",
    signature="def causes()",
    cases=lambda rng: [Case({}, {"truth": _CAUSES}, "the five error images above")],
    judge=lambda case, answer: judge_choice(answer, case.truth, sorted(_CAUSES.values()), "the cause"),
    misconceptions=(
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
    where="lesson 01, sections 2 to 4 and Break it",
)


# Task 6: explain

_TASK_6 = Task(
    id="01-6",
    title="Explain",
    points=2,
    version=1,
    kind="explain",
    signature="def explain()",
    cases=lambda rng: [Case({}, {"truth": ""})],
    judge=lambda case, answer: judge_words(answer, 60),
    rubric=(
        "0: neither 8 bits nor the mixing of neighbours, or only that the file is worse",
        "1: one of the two with what it does to points, or both without what they do",
        "2: 8 bits (steps of centimetres, staircases) and mixing (points in mid-air at outlines or beside zeros)",
    ),
    where="lesson 01, section 4 and Break it",
)

TASKS = (_TASK_1, _TASK_2, _TASK_3, _TASK_4, flying_pixels.TASK, _TASK_6)
