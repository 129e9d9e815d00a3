"""Lab 01: reading depth images.

All images are drawn here in NumPy: a slanted wall with things before it, so that the truth is known by construction.
"""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Task
from course_lib.tasks.judges import judge_array
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_01_rgbd_images import flying_pixels, resizing
from course_lib.tasks.labs.lab_01_rgbd_images.causes import CAUSE_OF, SIGNS, which_mistakes
from course_lib.tasks.labs.lab_01_rgbd_images.mistakes import ENCODING_MISTAKES, RANGE_MISTAKES
from course_lib.tasks.labs.lab_01_rgbd_images.parts import encoding_anatomy, range_anatomy
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
        if not centred:
            depth[:, :3] = rng.uniform(4.2, 6, (height, 3))  # a far end, where 16-bit floats have steps of 4 mm
        v, u = np.indices(depth.shape)
        rays = np.stack([(u - cx) / f, (v - cy) / f, np.ones(depth.shape)], axis=-1)
        truth = np.linalg.norm(rays * depth[..., None], axis=-1)
        cases.append(Case({"depth": depth, "f": f, "cx": cx, "cy": cy}, {"truth": truth}, name))
    return cases


_TASK_1 = Task(
    id="01-1",
    title="From depth to range",
    points=1,
    version=2,
    kind="fill",
    signature="def range_from_depth(depth, f, cx, cy)",
    cases=_range_cases,
    judge=lambda case, answer: judge_array(answer, case.truth, MILLIMETRE, "m", what="the range"),
    misconceptions=RANGE_MISTAKES,
    anatomy=range_anatomy,
    hides=("course_lib.camera.pinhole.pixel_rays", "course_lib.camera.pinhole.deproject"),
    where="lesson 01, section 2 (depth is z, not range)",
    repeats=True,
)


# Task 2: three encodings


def _encoding_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for encoding, steps in (("tum", 5000), ("realsense", 1000), ("sun", 1000)):
        metres = wall_with_things(rng, 24, 32)
        metres[:, -4:] = rng.uniform(8.3, 9.8, (24, 4))  # a far end: in SUN's files it needs the bits that rotate
        raw = np.rint(metres * steps).astype(np.uint16)
        raw[5, 7], raw[6, 9] = 65535, 60000  # only a RealSense means nothing by the first
        truth = raw / steps
        if encoding == "realsense":
            overflow = rng.random(raw.shape) < 0.03
            overflow[2, 3] = overflow[5, 7] = True
            raw[overflow], truth[overflow] = 65535, 0
        if encoding == "sun":
            raw = (raw << 3) | (raw >> 13)
        cases.append(
            Case({"raw": raw, "encoding": encoding}, {"truth": truth}, f"a raw image of the encoding {encoding!r}")
        )
    return cases


_TASK_2 = Task(
    id="01-2",
    title="Three cameras, one unit",
    points=2,
    version=2,
    kind="real",
    signature="def to_metres(raw, encoding)",
    cases=_encoding_cases,
    judge=lambda case, answer: judge_array(answer, case.truth, 1e-4, "m", what="the depth"),
    misconceptions=ENCODING_MISTAKES,
    anatomy=encoding_anatomy,
    hides=("course_lib.camera.rgbd.decode_depth", "course_lib.camera.rgbd.ENCODINGS"),
    where="lesson 01, section 3 (from stored numbers to metres)",
)


# Task 4: which mistake made this?

_TASK_4 = which_cause(
    "01-4",
    "Which mistake made this?",
    CAUSE_OF,
    "the five error images above",
    which_mistakes(CAUSE_OF),
    "lesson 01, sections 2 to 4 and Break it",
    signs=SIGNS,
    version=2,
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
