"""Task 4 of lab 03: the causes of six wrong clouds, what each leaves behind, and which are taken for each other."""

from __future__ import annotations

from collections.abc import Mapping

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import swapped

CAUSES = (
    "another camera's focal length",
    "another camera's depth scale",
    "z taken for range",
    "rows for columns",
    "cut off at 3 m",
    "flip left in",
)
CAUSE_OF = {
    "A": "rows for columns",
    "B": "z taken for range",
    "C": "cut off at 3 m",
    "D": "another camera's depth scale",
    "E": "flip left in",
    "F": "another camera's focal length",
}

SIGNS = {
    "cut off at 3 m": "points are missing, and those that are left lie right",
    "flip left in": "signs have changed, and no length has",
    "another camera's depth scale": "all three axes are multiplied by one number, so the median of z changes",
    "another camera's focal length": "z is right and straight walls stay straight; x and y have one factor",
    "z taken for range": "straight walls are bent, and z is too small, most of all away from the middle",
    "rows for columns": "z is right; x follows the rows of the image and y its columns",
}


def which_mistakes(cause_of: Mapping[str, str]) -> tuple[Misconception, ...]:
    """The pairs that are taken for each other, under the letters of a picture."""
    return (
        Misconception(
            "focal length for scale",
            "scale and focal length taken for each other: a wrong scale changes z as well, a wrong focal length never "
            "does",
            swapped(cause_of, CAUSES[0], CAUSES[1]),
        ),
        Misconception(
            "focal length for range",
            "focal length and range taken for each other: a wrong focal length keeps walls flat, z taken for "
            "range bends them",
            swapped(cause_of, CAUSES[0], CAUSES[2]),
        ),
        Misconception(
            "flip for rows and columns",
            "the flip and exchanged rows and columns taken for each other: the flip changes signs only, never the "
            "length of an axis",
            swapped(cause_of, CAUSES[3], CAUSES[5]),
        ),
        Misconception(
            "scale for truncation",
            "scale and truncation taken for each other: truncation loses points and leaves the others where they were",
            swapped(cause_of, CAUSES[1], CAUSES[4]),
        ),
    )
