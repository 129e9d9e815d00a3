"""The wrong answers of lab 03, as learner code: what each looks like, and what to do about it.

Each source is the plain solution with one thing wrong, built from parts, so that nothing else differs.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended, swapped


def _wrong_focal(expression: str) -> str:
    return f"def focal_length(fov_degrees, pixels):\n    return {expression}\n"


FOCAL_MISTAKES = (
    Misconception(
        "whole for half angle",
        "the tangent of the whole angle: the triangle has half the image on one side, so halve the angle too",
        _wrong_focal("0.5 * pixels / np.tan(np.radians(fov_degrees))"),
    ),
    Misconception(
        "degrees for radians",
        "degrees given to a tangent that expects radians: convert with np.radians first",
        _wrong_focal("0.5 * pixels / np.tan(fov_degrees / 2)"),
    ),
    Misconception(
        "whole for half image",
        "the whole image over the tangent of half the angle, twice too long: halve the number of pixels as well",
        _wrong_focal("pixels / np.tan(np.radians(fov_degrees) / 2)"),
    ),
    Misconception(
        "tangent upside down",
        "a product with the tangent where a quotient belongs: at 90 degrees the tangent of the half is 1 and hides it",
        _wrong_focal("0.5 * pixels * np.tan(np.radians(fov_degrees) / 2)"),
    ),
    Misconception(
        "angle in proportion",
        "half the angle taken for twice the focal length: a tangent does not grow in proportion, so use np.tan",
        _wrong_focal("0.5 * pixels * 90 / fov_degrees"),
    ),
    Misconception(
        "sine for tangent",
        "a sine where the tangent belongs: f is the side next to the angle, not the longest one",
        _wrong_focal("0.5 * pixels / np.sin(np.radians(fov_degrees) / 2)"),
    ),
)


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
        "half a pixel added to u and v: here the centres of pixels lie at whole numbers already",
        _wrong_deproject(x="(u + 0.5 - cx) * z / fx", y="(v + 0.5 - cy) * z / fy"),
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
        "millimetres",
        "a division by 1000 too many: this depth is in metres already",
        _wrong_deproject(before="    z = z / 1000\n"),
    ),
)


_GIVEN_MISTAKES = {
    "scale": ("raw / 1000", "raw / units_per_metre", "a depth scale fixed at 1000: divide by units_per_metre"),
    "truncation": (
        "(depth > 0) & (depth < 3)",
        "depth > 0",
        "everything from 3 m on thrown away without a word: keep every measured pixel",
    ),
    "flip": ("x, -y, -z", "x, y, z", "y and z negated, which belongs to viewers: leave the camera's axes in the data"),
}


def _wrong_cloud(left: tuple[str, ...]) -> str:
    """The given code with some of its three mistakes still in it."""
    depth, keep, axes = mended(_GIVEN_MISTAKES, left)
    return (
        "def cloud_from_raw(raw, color, units_per_metre, camera_matrix):\n"
        f"    depth = {depth}\n"
        f"    keep = {keep}\n"
        "    v, u = np.nonzero(keep)\n"
        "    z = depth[v, u]\n"
        "    x = (u - camera_matrix[0, 2]) * z / camera_matrix[0, 0]\n"
        "    y = (v - camera_matrix[1, 2]) * z / camera_matrix[1, 1]\n"
        f"    points = np.stack([{axes}], axis=1)\n"
        '    return {"points": points, "colors": color[keep]}\n'
    )


MEND_MISTAKES = left_in(_GIVEN_MISTAKES, _wrong_cloud) + (
    Misconception(
        "units multiplied",
        "stored numbers multiplied by the units of a metre: divide them, a larger number of units makes a smaller step",
        _wrong_cloud(()).replace("raw / units", "raw.astype(float) * units"),
    ),
    Misconception(
        "principal point transposed",
        "cx and cy read from the last row of the camera matrix, where there are zeros: they stand in its last column",
        _wrong_cloud(()).replace("[0, 2]", "[2, 0]").replace("[1, 2]", "[2, 1]"),
    ),
)


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


def _wrong_estimate(
    middle: str = "np.nanmedian",
    z: str = "depths",
    length: str = "np.sqrt(lengths**2 - (depths[:, 0] - depths[:, 1]) ** 2)",
) -> str:
    return (
        "def estimate_focal(pixels, depths, lengths, cx, cy):\n"
        "    with np.errstate(invalid='ignore'):\n"
        f"        beside = {length}\n"
        f"    z = {z}\n"
        f"    x, y = (pixels[..., 0] - cx) * z, (pixels[..., 1] - cy) * z\n"
        f"    return {middle}(np.hypot(x[:, 0] - x[:, 1], y[:, 0] - y[:, 1]) / beside)\n"
    )


def _break_it(middle: str, guess: int = 525) -> str:
    """A guessed f times measured over true length, with the lengths measured in space."""
    return (
        "def estimate_focal(pixels, depths, lengths, cx, cy):\n"
        f"    x, y = (pixels[..., 0] - cx) * depths / {guess}, (pixels[..., 1] - cy) * depths / {guess}\n"
        "    ends = np.stack([x, y, depths], axis=-1)\n"
        "    measured = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)\n"
        f"    return {guess} * {middle}(measured / lengths)\n"
    )


ESTIMATE_MISTAKES = (
    Misconception(
        "mean of all",
        "a mean over things of which some have the depth of the background at one end: use something that outliers do "
        "not move, such as the median",
        _wrong_estimate("np.nanmean"),
    ),
    Misconception(
        "slant forgotten",
        "the whole length compared with what is seen across the image: part of it goes into the difference of the two "
        "depths",
        _wrong_estimate(length="lengths"),
    ),
    Misconception(
        "one depth for both ends",
        "the mean depth used for both ends: each end has its own depth, and their difference is part of the length",
        _wrong_estimate(length="lengths", z="depths.mean(axis=1, keepdims=True)"),
    ),
    Misconception(
        "Break it's rule on slanted things",
        "Break it's rule, which holds for lengths that lie across the image; yours also slant in depth: take Δz out "
        "first",
        _break_it("np.median"),
        variants=(_break_it("np.mean"),),
    ),
)
