"""The wrong answers of tasks 3 and 4 of lab 06, as learner code: what each looks like, and what to do about it.

Each source is the plain solution with one thing wrong, built from parts, so that nothing else differs.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended, swapped

_GIVEN_MISTAKES = {
    "length": (
        "",
        " / np.linalg.norm(normal)",
        "a distance not divided by the length of the normal, which is not 1 here",
    ),
    "offset": ("- d", "+ d", "d subtracted: the plane is n · x + d = 0, so d is added"),
    "side": (
        "np.abs(height)",
        "height * np.sign(d)",
        "heights without a sign, so what lies below the floor stands on it: the camera, at the origin, is above",
    ),
}


def _wrong_heights(left: tuple[str, ...], side: str = "") -> str:
    """The given code with some of its three mistakes still in it."""
    length, offset, sign = mended(_GIVEN_MISTAKES, left)
    return (
        "def heights_above_floor(points, plane):\n"
        "    normal, d = plane[:3], plane[3]\n"
        f"    height = (points @ normal {offset}){length}\n"
        f"    return {side or sign}\n"
    )


_HEIGHTS = (
    "def heights_above_floor(points, plane):\n"
    "    normal, d, length = plane[:3], plane[3], np.linalg.norm(plane[:3])\n"
    "    return {}\n"
)

HEIGHT_MISTAKES = left_in(_GIVEN_MISTAKES, _wrong_heights) + (
    Misconception(
        "the lesson's own code",
        "the side told by the normal's z, as in the lesson's world frame, where z is up: here the points are in the "
        "camera's frame, and the camera, at the origin, is above; nor has the normal length 1",
        "def heights_above_floor(points, plane):\n"
        "    normal, d = plane[:3], plane[3]\n"
        "    return (points @ normal + d) * np.sign(normal[2])\n",
        variants=(_wrong_heights((), "height * np.sign(normal[2])"),),
    ),
    Misconception(
        "side left to the normal",
        "heights on whichever side the normal points to: it may point down; the camera, at the origin, is above",
        _wrong_heights((), "height"),
    ),
    Misconception(
        "side where most points are",
        "heights positive where most points are, which a pit turns over: the camera, at the origin, is above",
        _wrong_heights((), "height * np.sign(np.median(height))"),
        variants=(
            _wrong_heights((), "height * np.sign(height.mean())"),
            _wrong_heights((), "height * np.sign(height.max() + height.min())"),
        ),
    ),
    Misconception(
        "side by the largest component",
        "up taken from the normal's largest component, as if the camera stood upright: the camera is above",
        _wrong_heights((), "-height * np.sign(normal[np.argmax(np.abs(normal))])"),
    ),
    Misconception(
        "level camera",
        "heights along the camera's y, as if it looked straight ahead: measure them along the floor's normal",
        "def heights_above_floor(points, plane):\n"
        "    return np.abs(plane[3]) / np.linalg.norm(plane[:3]) - points[:, 1]\n",
    ),
    Misconception(
        "d not divided",
        "n divided by its length, but not d: both belong to one equation, so divide n · x + d as a whole",
        _HEIGHTS.format("(points @ (normal / length) + d) * np.sign(d)"),
        variants=(_HEIGHTS.format("points @ normal / length * np.sign(d) + np.abs(d)"),),
    ),
    Misconception(
        "length of all four numbers",
        "a distance divided by the length of all four numbers: only n has a say in it, np.linalg.norm(plane[:3])",
        _HEIGHTS.format("(points @ normal + d) / np.linalg.norm(plane) * np.sign(d)"),
    ),
    Misconception(
        "always turned round",
        "heights turned round whatever the normal: it may point down or up; the camera, at the origin, is above",
        _HEIGHTS.format("-(points @ normal + d) / length"),
    ),
    Misconception(
        "side by the normal's y",
        "the side told by the normal's y, as if -y were up: the camera may look down; it is at the origin, above",
        _HEIGHTS.format("-(points @ normal + d) / length * np.sign(normal[1])"),
    ),
)


CAUSES = (
    "mean not subtracted",
    "largest eigenvector",
    "outliers in the fit",
    "least squares in z",
    "offset with the wrong sign",
    "threshold too large",
)
CAUSE_OF = {
    "A": "outliers in the fit",
    "B": "offset with the wrong sign",
    "C": "least squares in z",
    "D": "mean not subtracted",
    "E": "threshold too large",
    "F": "largest eigenvector",
}


WHICH_MISTAKES = (
    Misconception(
        "largest eigenvector for the mean",
        "the largest eigenvector and the missing mean taken for each other: without the mean, the plane goes "
        "through the camera",
        swapped(CAUSE_OF, CAUSES[0], CAUSES[1]),
    ),
    Misconception(
        "outliers for the threshold",
        "outliers in the fit and a large threshold taken for each other: the table says how many points were used",
        swapped(CAUSE_OF, CAUSES[2], CAUSES[5]),
    ),
    Misconception(
        "least squares in z for the threshold",
        "least squares in z and a large threshold taken for each other: the former used the right points and leans all "
        "the same",
        swapped(CAUSE_OF, CAUSES[3], CAUSES[5]),
    ),
    Misconception(
        "least squares in z for outliers",
        "least squares in z and outliers taken for each other: the former used the right points and leans all the same",
        swapped(CAUSE_OF, CAUSES[3], CAUSES[2]),
    ),
    Misconception(
        "least squares in z for the mean",
        "least squares in z and the missing mean taken for each other: without the mean, the plane goes through the "
        "camera; least squares in z goes through the middle of its points",
        swapped(CAUSE_OF, CAUSES[3], CAUSES[0]),
    ),
    Misconception(
        "offset for the mean",
        "the wrong sign of d and the missing mean taken for each other: a wrong sign leaves the normal right and moves "
        "the plane off the board",
        swapped(CAUSE_OF, CAUSES[4], CAUSES[0]),
    ),
    Misconception(
        "offset for the largest eigenvector",
        "the wrong sign of d and the largest eigenvector taken for each other: a wrong sign leaves the normal right",
        swapped(CAUSE_OF, CAUSES[4], CAUSES[1]),
    ),
)
