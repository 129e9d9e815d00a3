"""Lab 03 as it was: task 2 asked for the lesson's deproject, task 4 showed its figure, task 5 leaned anyhow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from course_lib import tasks
from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_array
from course_lib.tasks.kinds import which_cause
from course_lib.tasks.labs.lab_03_depth_to_points.causes import CAUSES, SIGNS, which_mistakes
from course_lib.tasks.labs.lab_03_depth_to_points.parts import deproject_anatomy
from course_lib.tasks.labs.lab_03_depth_to_points.tasks import POINT_TOLERANCE, surface, with_holes
from course_lib.tasks.plain import Plain


def _wrong_deproject(
    x: str = "(u - cx) * z / fx", y: str = "(v - cy) * z / fy", z: str = "z", before: str = "", holes: bool = True
) -> str:
    clear = "    points[depth == 0] = np.nan\n" if holes else ""
    return (
        "def deproject(depth, fx, fy, cx, cy):\n"
        "    v, u = np.indices(depth.shape)\n"
        f"    z = depth.astype(float)\n{before}"
        f"    points = np.stack([{x}, {y}, {z}], axis=-1)\n{clear}"
        "    return points\n"
    )


_RANGE = "    r = z * np.sqrt(1 + ((u - cx) / fx) ** 2 + ((v - cy) / fy) ** 2)\n"

_DEPROJECT_MISTAKES = (
    Misconception(
        "z taken for range",
        "depth taken for the length of the ray, which bends a flat wall into a bowl: depth is z itself, so do not "
        "shorten it",
        _wrong_deproject(before="    z = z / np.sqrt(1 + ((u - cx) / fx) ** 2 + ((v - cy) / fy) ** 2)\n"),
    ),
    Misconception(
        "rows for columns",
        "x computed from rows and y from columns: u counts columns (the second index), v counts rows (the first)",
        _wrong_deproject(x="(v - cx) * z / fx", y="(u - cy) * z / fy"),
    ),
    Misconception(
        "zeros kept",
        "pixels without data turned into points at the camera's own centre: make them NaN",
        _wrong_deproject(holes=False),
    ),
    Misconception(
        "flip left in",
        "y and z negated, as viewers want it: keep y down and z forward in the data, and flip only what you draw",
        _wrong_deproject(y="-(v - cy) * z / fy", z="-z"),
    ),
    Misconception(
        "half a pixel",
        "half a pixel added to u and v, or taken away: here the centres of pixels lie at whole numbers already",
        _wrong_deproject(x="(u + 0.5 - cx) * z / fx", y="(v + 0.5 - cy) * z / fy"),
        variants=(_wrong_deproject(x="(u - 0.5 - cx) * z / fx", y="(v - 0.5 - cy) * z / fy"),),
    ),
    Misconception(
        "principal point forgotten",
        "pixels counted from the corner of the image: subtract cx from u and cy from v",
        _wrong_deproject(x="u * z / fx", y="v * z / fy"),
    ),
    Misconception(
        "principal point from the size",
        "the middle of the image used as principal point: use the cx and cy that you are given",
        _wrong_deproject(x="(u - (depth.shape[1] - 1) / 2) * z / fx", y="(v - (depth.shape[0] - 1) / 2) * z / fy"),
        variants=(
            _wrong_deproject(x="(u - depth.shape[1] / 2) * z / fx", y="(v - depth.shape[0] / 2) * z / fy"),
            _wrong_deproject(x="(u - depth.shape[1] // 2) * z / fx", y="(v - depth.shape[0] // 2) * z / fy"),
            _wrong_deproject(x="(u - depth.shape[0] / 2) * z / fx", y="(v - depth.shape[1] / 2) * z / fy"),
        ),
    ),
    Misconception(
        "one focal length for both",
        "fx used for the rows as well: rows have their own focal length, fy",
        _wrong_deproject(y="(v - cy) * z / fx"),
    ),
    Misconception(
        "multiplied by f",
        "a product with the focal length where a quotient belongs: x is (u - cx) * z / fx",
        _wrong_deproject(x="(u - cx) * z * fx", y="(v - cy) * z * fy"),
    ),
    Misconception(
        "depth forgotten",
        "rays of length about one that were never multiplied by the depth: x and y grow with z",
        _wrong_deproject(x="(u - cx) / fx", y="(v - cy) / fy"),
    ),
    Misconception(
        "brackets forgotten",
        "u - cx * z / fx without brackets, which multiplies cx alone: subtract first, (u - cx) * z / fx",
        _wrong_deproject(x="u - cx * z / fx", y="v - cy * z / fy"),
        variants=(
            _wrong_deproject(x="(u * z - cx) / fx", y="(v * z - cy) / fy"),
            _wrong_deproject(x="(u / fx - cx) * z", y="(v / fy - cy) * z"),
            _wrong_deproject(x="u * z / fx - cx", y="v * z / fy - cy"),
        ),
    ),
    Misconception(
        "x and y the other way",
        "cx - u and cy - v, which mirror both: subtract the principal point from the pixel",
        _wrong_deproject(x="(cx - u) * z / fx", y="(cy - v) * z / fy"),
    ),
    Misconception(
        "another program's axes",
        "axes of a robot or of a viewer, with z up: here x is right, y down and z forward",
        _wrong_deproject(x="z", y="-(u - cx) * z / fx", z="-(v - cy) * z / fy"),
        variants=(
            _wrong_deproject(y="z", z="-(v - cy) * z / fy"),
            _wrong_deproject(x="z", y="(u - cx) * z / fx", z="-(v - cy) * z / fy"),
        ),
    ),
    Misconception(
        "principal point added",
        "the principal point added to the pixel: subtract it, so that the pixel in the middle looks straight ahead",
        _wrong_deproject(x="(u + cx) * z / fx", y="(v + cy) * z / fy"),
    ),
    Misconception(
        "not divided by f",
        "pixels multiplied by the depth and never divided by the focal length: a pixel looks 1 / f to the side",
        _wrong_deproject(x="(u - cx) * z", y="(v - cy) * z"),
    ),
    Misconception(
        "divided by the depth",
        "a quotient by the depth, as when points are projected: from pixel to point, multiply by z",
        _wrong_deproject(x="(u - cx) / z / fx", y="(v - cy) / z / fy", before="    z[z == 0] = 1\n"),
        variants=(_wrong_deproject(x="fx * u / z + cx", y="fy * v / z + cy", before="    z[z == 0] = 1\n"),),
    ),
    Misconception(
        "pixels counted from one",
        "pixels counted from 1: the first column and the first row are number 0",
        _wrong_deproject(x="(u + 1 - cx) * z / fx", y="(v + 1 - cy) * z / fy"),
    ),
    Misconception(
        "range for z",
        "the length of the ray put in the place of z: depth is z already",
        _wrong_deproject(before=_RANGE, z="r"),
        variants=(_wrong_deproject(x="(u - cx) * r / fx", y="(v - cy) * r / fy", z="r", before=_RANGE),),
    ),
    Misconception(
        "1 for z",
        "rays whose z is 1: the depth itself is the third coordinate",
        _wrong_deproject(z="np.ones_like(z)"),
        variants=(_wrong_deproject(x="(u - cx) / fx", y="(v - cy) / fy", z="np.ones_like(z)"),),
    ),
    Misconception(
        "only the measured ones",
        "the measured pixels alone: keep the shape of the image, with NaN where nothing was measured",
        _wrong_deproject().replace("return points", "return points[depth > 0]"),
    ),
    Misconception(
        "a list of points",
        "one row a point: keep the shape of the image, rows, columns, then x, y, z",
        _wrong_deproject().replace("return points", "return points.reshape(-1, 3)"),
    ),
    Misconception(
        "millimetres",
        "a division by 1000 too many: this depth is in metres already",
        _wrong_deproject(before="    z = z / 1000\n"),
    ),
)


def _with_zeros(mistake: Misconception) -> Misconception:
    """The same mistake, and pixels without data kept as well."""
    source = mistake.source.replace("    points[depth == 0] = np.nan\n", "")
    more = "; and pixels without data kept: make them NaN"
    return Misconception(f"{mistake.name}, zeros kept", mistake.message + more, source)


_ALSO = (
    "z taken for range",
    "rows for columns",
    "flip left in",
    "half a pixel",
    "principal point forgotten",
    "one focal length for both",
    "multiplied by f",
    "not divided by f",
    "depth forgotten",
    "x and y the other way",
)
_DEPROJECT_MISTAKES += tuple(_with_zeros(mistake) for mistake in _DEPROJECT_MISTAKES if mistake.name in _ALSO)


def _lift(depth: np.ndarray, fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    """(H, W, 3) float64 points of a depth image in metres; NaN where it is 0."""
    height, width = depth.shape
    points = np.full((height, width, 3), np.nan)
    for u in range(width):
        for v in np.flatnonzero(depth[:, u] > 0):
            z = float(depth[v, u])
            points[v, u] = (u - cx) / fx * z, (v - cy) / fy * z, z
    return points


def _deproject_case(depth: np.ndarray, camera: tuple[float, float, float, float], name: str) -> Case:
    fx, fy, cx, cy = camera
    given = {"depth": depth.astype(np.float32), "fx": fx, "fy": fy, "cx": cx, "cy": cy}
    return Case(given, {"truth": _lift(given["depth"], *camera)}, name)


def _deproject_cases(rng: np.random.Generator) -> list[Case]:
    wide = tuple(rng.uniform((28, 38, 16, 12), (34, 44, 18, 13.5)).tolist())
    tall = tuple(rng.uniform((55, 48, 9, 20), (60, 52, 10, 22)).tolist())
    wall = np.full((3, 5), 2.0)
    return [
        _deproject_case(wall, (4.0, 4.0, 2.0, 1.0), "a flat wall, to do in your head"),
        _deproject_case(surface(rng, 30, 40, 0.8, 3.5), wide, "a wide image without holes"),
        _deproject_case(with_holes(rng, surface(rng, 36, 24, 0.6, 5.0), 0.2), tall, "a tall image with holes"),
    ]


def _deproject_anatomy(case: Case, answer: Plain) -> tuple[str, str] | None:
    """As of a window that begins at the first pixel."""
    return deproject_anatomy(replace(case, given={**case.given, "left": 0, "top": 0}), answer)


def _rods(rng: np.random.Generator, count: int = 40) -> Case:
    """Things of known length, each seen by its two end pixels and their measured depths.

    Pixels have half a pixel of noise, depths 3 mm at 1 m (growing with the square of the depth); for three things in
    ten, the depth of one end is that of the background.
    """
    f = float(rng.uniform(350, 900))
    cx, cy = 319.5 + float(rng.uniform(-8, 8)), 239.5 + float(rng.uniform(-8, 8))
    ends = np.empty((0, 2, 2))
    while len(ends) < count:
        more = rng.uniform((20, 20), (620, 460), (4 * count, 2, 2))
        ends = np.concatenate([ends, more[np.linalg.norm(more[:, 0] - more[:, 1], axis=1) > 180]])[:count]
    tilt = rng.uniform(0.08, 0.25, count) * rng.choice([-1.0, 1.0], count)
    z = rng.uniform(0.7, 2.5, count)[:, None] * (1 + tilt[:, None] * np.array([-1.0, 1.0]))
    points = np.concatenate([(ends - (cx, cy)) / f, np.ones((count, 2, 1))], axis=2) * z[..., None]
    lengths = np.linalg.norm(points[:, 0] - points[:, 1], axis=1)
    measured = z + 0.003 * z**2 * rng.standard_normal(z.shape)
    missed = rng.permutation(count)[: round(0.3 * count)]
    measured[missed, rng.integers(2, size=len(missed))] += rng.uniform(0.3, 1.5, len(missed))
    pixels = ends + 0.5 * rng.standard_normal(ends.shape)
    given = {"pixels": pixels, "depths": measured, "lengths": lengths, "cx": cx, "cy": cy}
    return Case(given, {"truth": f}, f"{count} things of known length")


_DEPROJECT = '''
def deproject(depth, fx, fy, cx, cy):
    """Points (H, W, 3) in metres of a depth image (H, W) in metres; NaN where it is 0."""
    v, u = np.indices(depth.shape)
    z = np.where(depth > 0, depth, np.nan)
    x = (u - cx) * z / fx
    y = (v - cy) * z / fy
    return np.stack([x, y, z], axis=-1)
'''
_ESTIMATE = '''
def estimate_focal(pixels, depths, lengths, cx, cy):
    """Focal length in pixels from things of known length."""
    X, Y = (pixels[..., 0] - cx) * depths, (pixels[..., 1] - cy) * depths
    beside = lengths**2 - (depths[:, 0] - depths[:, 1]) ** 2
    beside = np.sqrt(np.where(beside > 0, beside, np.nan))
    estimates = np.hypot(X[:, 0] - X[:, 1], Y[:, 0] - Y[:, 1]) / beside
    return np.nanmedian(estimates)
'''
_CAUSE_OF = {
    "A": "z taken for range",
    "B": "another camera's depth scale",
    "C": "flip left in",
    "D": "another camera's focal length",
    "E": "cut off at 3 m",
    "F": "rows for columns",
}
_WHICH = which_cause(
    "03-4",
    "which mistake made this",
    _CAUSE_OF,
    "the six clouds above",
    which_mistakes(_CAUSE_OF),
    "lesson 03, section 4 (what goes wrong, in millimetres)",
    causes=CAUSES,
    signs=SIGNS,
)
FORMS = (
    (
        Task(
            id="03-2",
            title="deproject a depth image",
            points=3,
            version=1,
            kind="write",
            signature="def deproject(depth, fx, fy, cx, cy)",
            cases=_deproject_cases,
            judge=lambda case, answer: judge_array(
                answer, case.truth, POINT_TOLERANCE, "m", axes="xyz", what="the image"
            ),
            misconceptions=_DEPROJECT_MISTAKES,
            anatomy=_deproject_anatomy,
            where="lesson 03, section 3 (from a pixel back to a point)",
        ),
        _DEPROJECT,
    ),
    (_WHICH, f"def causes():\n    return {_CAUSE_OF!r}\n"),
    (replace(tasks.get("03-5"), version=1, cases=lambda rng: [_rods(rng)]), _ESTIMATE),
)
