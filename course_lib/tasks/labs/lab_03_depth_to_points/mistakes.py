"""The wrong answers of lab 03's tasks 2 and 4, as learner code: what each looks like, and what to do about it.

Each source is the plain solution with one thing wrong, built from parts, so that nothing else differs.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import swapped


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

DEPROJECT_MISTAKES = (
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
DEPROJECT_MISTAKES += tuple(_with_zeros(mistake) for mistake in DEPROJECT_MISTAKES if mistake.name in _ALSO)


CAUSES = (
    "another camera's focal length",
    "another camera's depth scale",
    "z taken for range",
    "rows for columns",
    "cut off at 3 m",
    "flip left in",
)
CAUSE_OF = {
    "A": "z taken for range",
    "B": "another camera's depth scale",
    "C": "flip left in",
    "D": "another camera's focal length",
    "E": "cut off at 3 m",
    "F": "rows for columns",
}

SIGNS = {
    "cut off at 3 m": "points are missing, and those that are left lie right",
    "flip left in": "signs have changed, and no length has",
    "another camera's depth scale": "all three axes are multiplied by one number, so the median of z changes",
    "another camera's focal length": "z is right and straight walls stay straight; x and y have one factor",
    "z taken for range": "straight walls are bent, and z is too small, most of all away from the middle",
    "rows for columns": "z is right; x follows the rows of the image and y its columns",
}

WHICH_MISTAKES = (
    Misconception(
        "focal length for scale",
        "scale and focal length taken for each other: a wrong scale changes z as well, a wrong focal length never does",
        swapped(CAUSE_OF, CAUSES[0], CAUSES[1]),
    ),
    Misconception(
        "focal length for range",
        "focal length and range taken for each other: a wrong focal length keeps walls flat, z taken for "
        "range bends them",
        swapped(CAUSE_OF, CAUSES[0], CAUSES[2]),
    ),
    Misconception(
        "flip for rows and columns",
        "the flip and exchanged rows and columns taken for each other: the flip changes signs only, never the length "
        "of an axis",
        swapped(CAUSE_OF, CAUSES[3], CAUSES[5]),
    ),
    Misconception(
        "scale for truncation",
        "scale and truncation taken for each other: truncation loses points and leaves the others where they were",
        swapped(CAUSE_OF, CAUSES[1], CAUSES[4]),
    ),
)
