"""The wrong answers of lab 03's task 2, as learner code: what each looks like, and what to do about it.

Each source is the plain solution with one thing wrong, built from parts, so that nothing else differs; but the first,
which is the lesson's.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_deproject(
    x: str = "a * z",
    y: str = "b * z",
    z: str = "z",
    a: str = "(u + left - cx) / fx",
    b: str = "(v + top - cy) / fy",
    depth: str = "r / np.sqrt(1 + a**2 + b**2)",
    holes: bool = True,
) -> str:
    clear = "    points[ranges == 0] = np.nan\n" if holes else ""
    return (
        "def deproject(ranges, fx, fy, cx, cy, left, top):\n"
        "    v, u = np.indices(ranges.shape)\n"
        "    r = ranges.astype(float)\n"
        f"    a = {a}\n    b = {b}\n    z = {depth}\n"
        f"    points = np.stack([{x}, {y}, {z}], axis=-1)\n{clear}"
        "    return points\n"
    )


_OWN_CODE = (
    "def deproject(depth, fx, fy, cx, cy, left, top):\n"
    "    v, u = np.indices(depth.shape)\n"
    "    z = np.where(depth > 0, depth, np.nan)\n"
    "    x = (u - cx) * z / fx\n"
    "    y = (v - cy) * z / fy\n"
    "    return np.stack([x, y, z], axis=-1)\n"
)

DEPROJECT_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "the lesson's deproject as it stands: here a pixel holds the length of its ray, not its z, and the window does "
        "not begin at column 0 and row 0 of the full image",
        _OWN_CODE,
    ),
    Misconception(
        "range taken for z",
        "the length of the ray used as z, which bends a flat wall: divide it by the length of the ray whose z is 1",
        _wrong_deproject(depth="r"),
    ),
    Misconception(
        "window forgotten",
        "a window that begins at the first pixel of the full image: cx and cy are counted in that, so columns "
        "and rows must be, too",
        _wrong_deproject(a="(u - cx) / fx", b="(v - cy) / fy"),
    ),
    Misconception(
        "window left out of the ray's length",
        "left and top added in x and y but not in the length of the ray: use the same full-image column and row in "
        "all three",
        _wrong_deproject(depth="r / np.sqrt(1 + ((u - cx) / fx) ** 2 + ((v - cy) / fy) ** 2)"),
    ),
    Misconception(
        "window left out of x and y",
        "left and top added in the length of the ray but not in x and y: use the same full-image column and row in "
        "all three",
        _wrong_deproject(x="(u - cx) / fx * z", y="(v - cy) / fy * z"),
    ),
    Misconception(
        "window taken away",
        "left and top subtracted: column 0 of the window is column `left` of the full image, so add them to u and v, "
        "or take them off cx and cy",
        _wrong_deproject(a="(u - left - cx) / fx", b="(v - top - cy) / fy"),
    ),
    Misconception(
        "left and top exchanged",
        "top added to columns and left to rows: `left` counts columns, `top` counts rows",
        _wrong_deproject(a="(u + top - cx) / fx", b="(v + left - cy) / fy"),
    ),
    Misconception(
        "lengthened for shortened",
        "the range multiplied where it must be divided: z is shorter than the ray",
        _wrong_deproject(depth="r * np.sqrt(1 + a**2 + b**2)"),
    ),
    Misconception(
        "only z shortened",
        "z shortened, x and y not: once z is known, x and y follow from it",
        _wrong_deproject(x="a * r", y="b * r"),
    ),
    Misconception(
        "only x and y shortened",
        "x and y from the right z, and the range put in the place of z: the third coordinate is z, too",
        _wrong_deproject(z="r"),
    ),
    Misconception(
        "the 1 forgotten",
        "a ray without its third part: its three parts are (u - cx) / fx, (v - cy) / fy and 1",
        _wrong_deproject(depth="r / np.maximum(np.sqrt(a**2 + b**2), 1e-9)"),
    ),
    Misconception(
        "root forgotten",
        "the range divided by the square of the ray's length: take the root",
        _wrong_deproject(depth="r / (1 + a**2 + b**2)"),
    ),
    Misconception(
        "ray measured in pixels",
        "a ray whose sides are pixels and whose third part is 1: divide the pixels by the focal lengths first",
        _wrong_deproject(depth="r / np.sqrt(1 + (u + left - cx) ** 2 + (v + top - cy) ** 2)"),
    ),
    Misconception(
        "ray of columns only",
        "a ray that goes sideways only, or only up and down: its length has all three parts",
        _wrong_deproject(depth="r / np.sqrt(1 + a**2)"),
        variants=(_wrong_deproject(depth="r / np.sqrt(1 + b**2)"),),
    ),
    Misconception(
        "sides added",
        "the parts of a ray added up: its length is the root of the sum of their squares",
        _wrong_deproject(depth="r / (1 + abs(a) + abs(b))"),
        variants=(_wrong_deproject(depth="r / (1 + a + b)"),),
    ),
    Misconception(
        "sides from the range",
        "z from a triangle whose sides are (u - cx) r / fx and (v - cy) r / fy: those belong to a depth, not a range",
        _wrong_deproject(depth="np.sqrt(np.maximum(r**2 - (a * r) ** 2 - (b * r) ** 2, 0))"),
    ),
    Misconception(
        "rows for columns",
        "x computed from rows and y from columns: u counts columns (the second index), v counts rows (the first)",
        _wrong_deproject(a="(v + left - cx) / fx", b="(u + top - cy) / fy"),
    ),
    Misconception(
        "zeros kept",
        "pixels without data turned into points at the camera's own centre: make them NaN",
        _wrong_deproject(holes=False),
    ),
    Misconception(
        "flip left in",
        "y and z negated, as viewers want it: keep y down and z forward in the data, and flip only what you draw",
        _wrong_deproject(y="-b * z", z="-z"),
    ),
    Misconception(
        "half a pixel",
        "half a pixel added to u and v, or taken away: here the centres of pixels lie at whole numbers already",
        _wrong_deproject(a="(u + left + 0.5 - cx) / fx", b="(v + top + 0.5 - cy) / fy"),
        variants=(_wrong_deproject(a="(u + left - 0.5 - cx) / fx", b="(v + top - 0.5 - cy) / fy"),),
    ),
    Misconception(
        "pixels counted from one",
        "pixels counted from 1: the first column and the first row are number 0",
        _wrong_deproject(a="(u + left + 1 - cx) / fx", b="(v + top + 1 - cy) / fy"),
        variants=(_wrong_deproject(a="(u + left - 1 - cx) / fx", b="(v + top - 1 - cy) / fy"),),
    ),
    Misconception(
        "principal point forgotten",
        "pixels counted from the corner of the image: subtract cx from u and cy from v",
        _wrong_deproject(a="(u + left) / fx", b="(v + top) / fy"),
        variants=(_wrong_deproject(a="u / fx", b="v / fy"),),
    ),
    Misconception(
        "principal point from the size",
        "the middle of the window used as principal point: use the cx and cy that you are given",
        _wrong_deproject(a="(u - (ranges.shape[1] - 1) / 2) / fx", b="(v - (ranges.shape[0] - 1) / 2) / fy"),
        variants=(
            _wrong_deproject(a="(u - ranges.shape[1] / 2) / fx", b="(v - ranges.shape[0] / 2) / fy"),
            _wrong_deproject(a="(u - ranges.shape[1] // 2) / fx", b="(v - ranges.shape[0] // 2) / fy"),
        ),
    ),
    Misconception(
        "principal point added",
        "the principal point added to the pixel: subtract it, so that the pixel in the middle looks straight ahead",
        _wrong_deproject(a="(u + left + cx) / fx", b="(v + top + cy) / fy"),
    ),
    Misconception(
        "one focal length for both",
        "fx used for the rows as well: rows have their own focal length, fy",
        _wrong_deproject(b="(v + top - cy) / fx"),
    ),
    Misconception(
        "multiplied by f",
        "a product with the focal length where a quotient belongs: x is (u - cx) * z / fx",
        _wrong_deproject(a="(u + left - cx) * fx", b="(v + top - cy) * fy"),
    ),
    Misconception(
        "x and y the other way",
        "cx - u and cy - v, which mirror both: subtract the principal point from the pixel",
        _wrong_deproject(a="(cx - u - left) / fx", b="(cy - v - top) / fy"),
    ),
    Misconception(
        "depth forgotten",
        "rays that were never multiplied by a depth: x and y grow with z",
        _wrong_deproject(x="a", y="b"),
    ),
    Misconception(
        "1 for z",
        "rays whose z is 1: the third coordinate is the depth itself",
        _wrong_deproject(z="np.ones_like(z)"),
        variants=(_wrong_deproject(x="a", y="b", z="np.ones_like(z)"),),
    ),
    Misconception(
        "another program's axes",
        "axes of a robot or of a viewer, with z up: here x is right, y down and z forward",
        _wrong_deproject(x="z", y="-a * z", z="-b * z"),
        variants=(_wrong_deproject(y="z", z="-b * z"), _wrong_deproject(x="z", y="a * z", z="-b * z")),
    ),
    Misconception(
        "only the measured ones",
        "the measured pixels alone: keep the shape of the image, with NaN where nothing was measured",
        _wrong_deproject().replace("return points", "return points[ranges > 0]"),
    ),
    Misconception(
        "a list of points",
        "one row a point: keep the shape of the image, rows, columns, then x, y, z",
        _wrong_deproject().replace("return points", "return points.reshape(-1, 3)"),
    ),
    Misconception(
        "millimetres",
        "a division by 1000 too many: these ranges are in metres already",
        _wrong_deproject(depth="r / 1000 / np.sqrt(1 + a**2 + b**2)"),
    ),
)


def _with_zeros(mistake: Misconception) -> Misconception:
    """The same mistake, and pixels without data kept as well."""
    source = mistake.source.replace("    points[ranges == 0] = np.nan\n", "")
    more = "; and pixels without data kept: make them NaN"
    return Misconception(f"{mistake.name}, zeros kept", mistake.message + more, source)


_ALSO = (
    "range taken for z",
    "window forgotten",
    "window left out of the ray's length",
    "window left out of x and y",
    "window taken away",
    "only z shortened",
    "rows for columns",
    "flip left in",
    "one focal length for both",
    "x and y the other way",
)
DEPROJECT_MISTAKES += tuple(_with_zeros(mistake) for mistake in DEPROJECT_MISTAKES if mistake.name in _ALSO)
