"""Task 5 of lab 03: a focal length from things of known length, a third of which were measured on the background."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Verdict
from course_lib.tasks.judges import judge_band, judge_number, refuse
from course_lib.tasks.plain import Plain, describe

_FOCAL_BANDS = ((0.010, 1.0), (0.014, 0.75), (0.020, 0.5), (0.040, 0.25))  # metres, 1 m beside the axis
_SAME_FOCAL = 2e-4  # relative; two estimates within it are the same
_COUNT, _FIRST, _LAST, _BETWEEN = 50, 7, 6, 2  # things; of these so many miss among the first and last ten, and between


def rods(rng: np.random.Generator) -> Case:
    """Things of known length, each seen by its two end pixels and their measured depths.

    The principal point lies well beside the middle of 640x480 pixels, and of each thing the end that lies farther to
    that side is the farther one, as on a wall seen at a slant: so a wrong principal point does not average out. Pixels
    have 0.25 px of noise, depths 1.5 mm at 1 m (growing with the square of the depth). For 15 things, the first and the
    last of all among them, the depth of one end is that of the background.
    """
    f = float(rng.uniform(350, 900))
    beside = rng.choice([-1.0, 1.0], 2) * rng.uniform((35, 25), (70, 50))
    centre = (319.5, 239.5) + beside
    ends = np.empty((0, 2, 2))
    while len(ends) < _COUNT:
        more = rng.uniform((20, 20), (620, 460), (4 * _COUNT, 2, 2))
        ends = np.concatenate([ends, more[np.linalg.norm(more[:, 0] - more[:, 1], axis=1) > 180]])[:_COUNT]
    away = np.where((ends[:, 1] - ends[:, 0]) @ beside > 0, 1, -1)
    tilt = rng.uniform(0.08, 0.25, _COUNT) * away
    z = rng.uniform(0.7, 2.5, _COUNT)[:, None] * (1 + tilt[:, None] * np.array([-1.0, 1.0]))
    points = np.concatenate([(ends - centre) / f, np.ones((_COUNT, 2, 1))], axis=2) * z[..., None]
    lengths = np.linalg.norm(points[:, 0] - points[:, 1], axis=1)
    measured = z + 0.0015 * z**2 * rng.standard_normal(z.shape)
    first = [0, *(1 + rng.permutation(9)[: _FIRST - 1])]
    last = [_COUNT - 1, *(_COUNT - 2 - rng.permutation(9)[: _LAST - 1])]
    missed = np.array([*first, *last, *(10 + rng.permutation(_COUNT - 20)[:_BETWEEN])])
    measured[missed, rng.integers(2, size=len(missed))] += rng.uniform(0.4, 1.5, len(missed))
    pixels = ends + 0.25 * rng.standard_normal(ends.shape)
    cx, cy = centre.tolist()
    given = {"pixels": pixels, "depths": measured, "lengths": lengths, "cx": cx, "cy": cy}
    return Case(given, {"truth": f}, f"{_COUNT} things of known length")


def focal_distance(case: Case, a: Plain, b: Plain) -> float:
    """How far two estimates are from each other: only the same arithmetic gives the same number."""
    one, other = float(np.asarray(a).reshape(())), float(np.asarray(b).reshape(()))
    return abs(one - other) / (_SAME_FOCAL * max(abs(one), abs(other), 1e-12))


def judge_focal(case: Case, answer: Plain) -> Verdict:
    what = "the error 1 m beside the axis"
    if isinstance(answer, float) and np.isnan(answer):
        message = (
            "The focal length is NaN. Where length² − Δz² is not positive it has no root: leave those things out "
            "before you take a middle. If that leaves out every thing, look at the formula and the units."
        )
        return refuse(message, _FOCAL_BANDS[0][0], "m")
    number = judge_number(answer, case.truth, 1.0, "px", "the focal length")
    if not np.isfinite(number.error):
        return number
    value = float(np.asarray(answer).reshape(()))
    if value <= 0:
        message = f"The focal length is {describe(value)}: expected a positive number of pixels."
        return refuse(message, _FOCAL_BANDS[0][0], "m")
    off = abs(case.truth / value - 1.0)
    return judge_band(off, _FOCAL_BANDS, "m", what=what)


def guess_focal(rng: np.random.Generator):
    """A function that says the same random focal length to everything."""
    said = float(rng.uniform(300, 1000))
    return lambda pixels, depths, lengths, cx, cy: said
