"""The wrong answers of lab 03's task 3, as learner code: given mistakes that were left in, and new ones."""

from __future__ import annotations

from itertools import combinations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended

_SIGNS = {"y": "x, -y, z", "z": "x, y, -z"}
_GIVEN_MISTAKES = {
    "scale": ("raw / 1000", "raw / units_per_metre", "a depth scale fixed at 1000: divide by units_per_metre"),
    "truncation": (
        "(depth > 0) & (depth < 3)",
        "depth > 0",
        "everything from 3 m on thrown away without a word: keep every measured pixel",
    ),
    "flip": ("x, -y, -z", "x, y, z", "y and z negated, which belongs to viewers: leave the camera's axes in the data"),
}

_SOME_LEFT = [left for count in (1, 2) for left in combinations(_GIVEN_MISTAKES, count)]


def _wrong_cloud(
    left: tuple[str, ...] = (),
    *,
    x: str = "(u - camera_matrix[0, 2]) * z / camera_matrix[0, 0]",
    y: str = "(v - camera_matrix[1, 2]) * z / camera_matrix[1, 1]",
    depth: str = "",
    keep: str = "",
    axes: str = "",
    pixels: str = "v, u = np.nonzero(keep)",
    colors: str = "color[keep]",
) -> str:
    """The given code with some of its three mistakes still in it, or with others."""
    given_depth, given_keep, given_axes = mended(_GIVEN_MISTAKES, left)
    return (
        "def cloud_from_raw(raw, color, units_per_metre, camera_matrix):\n"
        f"    depth = {depth or given_depth}\n"
        f"    keep = {keep or given_keep}\n"
        f"    {pixels}\n"
        "    z = depth[v, u]\n"
        f"    x = {x}\n"
        f"    y = {y}\n"
        f"    points = np.stack([{axes or given_axes}], axis=1)\n"
        f'    return {{"points": points, "colors": {colors}}}\n'
    )


_HALF_FLIPS = tuple(
    Misconception(
        f"{axis} negated, {' and '.join(left)} left in" if left else f"{axis} still negated",
        "; and ".join(
            (f"{axis} still negated, for a viewer: take this minus out as well", *(_GIVEN_MISTAKES[n][2] for n in left))
        ),
        _wrong_cloud(left, axes=signs),
    )
    for axis, signs in _SIGNS.items()
    for left in ((), ("scale",), ("truncation",), ("scale", "truncation"))
)

_OWN_CODE = (
    "def cloud_from_raw(raw, color, units_per_metre, camera_matrix):\n"
    "    v, u = np.indices(raw.shape)\n"
    "    z = np.where(raw > 0, raw, np.nan)\n"
    "    x = (u - camera_matrix[0, 2]) * z / camera_matrix[0, 0]\n"
    "    y = (v - camera_matrix[1, 2]) * z / camera_matrix[1, 1]\n"
    "    return np.stack([x, y, z], axis=-1)\n"
)

MEND_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "the lesson's deproject as it stands: here steps are stored, not metres, and a cloud of the measured pixels "
        "with their colours is asked for, not an image of points",
        _OWN_CODE,
        variants=(
            _OWN_CODE.replace("raw, np.nan)", "raw / units_per_metre, np.nan)"),
            _OWN_CODE.replace("raw, np.nan)", "raw / 1000, np.nan)"),
        ),
    ),
    *left_in(_GIVEN_MISTAKES, _wrong_cloud, _SOME_LEFT),
    Misconception(
        "scale and truncation and flip left in",
        f"all three mistakes are still in it; begin with {_GIVEN_MISTAKES['scale'][2]}",
        _wrong_cloud(tuple(_GIVEN_MISTAKES)),
    ),
    *_HALF_FLIPS,
    Misconception(
        "units multiplied",
        "stored numbers multiplied by the units of a metre: divide them, a larger number of units makes a smaller step",
        _wrong_cloud(depth="raw.astype(float) * units_per_metre"),
    ),
    Misconception(
        "whole metres",
        "whole metres: // and whole-number types drop what is behind the point; divide with / and keep floats",
        _wrong_cloud(depth="raw // units_per_metre"),
    ),
    Misconception(
        "another fixed scale",
        "a depth scale fixed at another number: recordings differ, divide by units_per_metre",
        _wrong_cloud(depth="raw / 1500"),
        variants=(_wrong_cloud(depth="raw / 5000"), _wrong_cloud(depth="raw / 10000"), _wrong_cloud(depth="raw / 1.0")),
    ),
    Misconception(
        "divided twice",
        "stored numbers divided by 1000 and by units_per_metre: the second alone makes metres",
        _wrong_cloud(depth="raw / 1000 / units_per_metre"),
    ),
    Misconception(
        "the depth turned upside down",
        "units_per_metre divided by the stored number: it is the number that is divided",
        _wrong_cloud(depth="units_per_metre / np.maximum(raw, 1) * (raw > 0)"),
    ),
    Misconception(
        "another cut",
        "measured points still thrown away, by another limit: keep every measured pixel, near or far",
        _wrong_cloud(keep="(depth > 0) & (depth < 5)"),
        variants=(
            _wrong_cloud(keep="(depth > 0) & (depth < 4)"),
            _wrong_cloud(keep="(depth > 0) & (depth < 6)"),
            _wrong_cloud(keep="depth >= 3"),
            _wrong_cloud(keep="depth > 3"),
            _wrong_cloud(keep="depth > 1"),
        ),
    ),
    Misconception(
        "pixels without data kept",
        "pixels without data kept as points at the camera: keep those with depth > 0",
        _wrong_cloud(keep="depth >= 0"),
        variants=(_wrong_cloud(keep="depth < 3"), _wrong_cloud(("flip",), keep="depth >= 0")),
    ),
    Misconception(
        "the whole image",
        "every pixel in the form of the image: give one row for each measured pixel, and none for the others",
        _wrong_cloud(pixels="v, u = np.indices(raw.shape)", colors="color").replace("axis=1", "axis=-1"),
        variants=(
            _wrong_cloud(pixels="v, u = np.indices(raw.shape)").replace("axis=1", "axis=-1"),
            _wrong_cloud(
                pixels="v, u = np.indices(raw.shape)", depth="np.where(raw > 0, raw, np.nan) / units_per_metre"
            )
            .replace("axis=1", "axis=-1")
            .replace("color[keep]", "color"),
        ),
    ),
    Misconception(
        "principal point transposed",
        "cx and cy read from the last row of the camera matrix, where there are zeros: they stand in its last column",
        _wrong_cloud().replace("[0, 2]", "[2, 0]").replace("[1, 2]", "[2, 1]"),
    ),
    Misconception(
        "one focal length for both",
        "fx used for the rows as well: rows have their own focal length, camera_matrix[1, 1]",
        _wrong_cloud(y="(v - camera_matrix[1, 2]) * z / camera_matrix[0, 0]"),
    ),
    Misconception(
        "rows for columns",
        "u and v exchanged: np.nonzero gives rows first, then columns; u, the column, makes x",
        _wrong_cloud(pixels="v, u = np.nonzero(keep)")
        .replace("(u - ", "(w - ")
        .replace("(v - ", "(u - ")
        .replace("(w - ", "(v - "),
    ),
    Misconception(
        "x negated",
        "x with the other sign: that mirrors left and right; leave the camera's axes in the data",
        _wrong_cloud(axes="-x, y, z"),
        variants=(_wrong_cloud(axes="-x, -y, -z"), _wrong_cloud(axes="-x, -y, z")),
    ),
    Misconception(
        "axes in another order",
        "the axes in another order: the camera's are x right, y down, z forward",
        _wrong_cloud(axes="x, z, y"),
        variants=tuple(
            _wrong_cloud(axes=axes) for axes in ("x, z, -y", "z, -x, -y", "y, x, z", "z, y, x", "z, x, y", "y, z, x")
        ),
    ),
    Misconception(
        "every colour kept",
        "the colours of all pixels: pick them out with the same mask as the points, color[keep]",
        _wrong_cloud(colors="color"),
        variants=(_wrong_cloud(colors="color.reshape(-1, 3)"),),
    ),
    Misconception(
        "BGR for RGB",
        "the colours' channels in the opposite order: color is RGB already",
        _wrong_cloud(colors="color[keep][:, ::-1]"),
    ),
    Misconception(
        "column by column",
        "the pixels column by column: they are asked row by row, as np.nonzero(keep) gives them",
        _wrong_cloud(pixels="u, v = np.nonzero(keep.T)", colors="color[v, u]"),
    ),
    Misconception(
        "colours in another order than the points",
        "colours that do not belong to their points: take both with the same rows and columns",
        _wrong_cloud(pixels="u, v = np.nonzero(keep.T)"),
        variants=(
            _wrong_cloud(colors="color.transpose(1, 0, 2)[keep.T]"),
            _wrong_cloud(colors="color.reshape(-1, 3)[:keep.sum()]"),
            _wrong_cloud(colors="color[keep][::-1]"),
        ),
    ),
)
