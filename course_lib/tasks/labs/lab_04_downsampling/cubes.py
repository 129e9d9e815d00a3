"""The wrong answers to task 1 of lab 04, the cube of a point, as learner code.

Each source is the plain solution with one thing wrong, or two.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception

_NUMBERS = "np.floor((points - origin) / voxel)"


def _wrong_index(expression: str) -> str:
    return f"def voxel_index(points, voxel, origin):\n    return {expression}\n"


INDEX_MISTAKES = (
    Misconception(
        "int() for floor()",
        "numbers cut off towards zero, which puts both sides of the origin into one cube: round down with np.floor",
        _wrong_index("((points - origin) / voxel).astype(int)"),
    ),
    Misconception(
        "rounding for floor()",
        "numbers rounded to the nearest, which moves every cube by half a voxel: round down with np.floor",
        _wrong_index("np.rint((points - origin) / voxel).astype(int)"),
        variants=(_wrong_index("((points - origin) / voxel + 0.5).astype(int)"),),
    ),
    Misconception(
        "rounded up",
        "numbers rounded up, one cube too far: the cube numbered 0 begins at the origin, so round down",
        _wrong_index("np.ceil((points - origin) / voxel).astype(int)"),
    ),
    Misconception(
        "origin forgotten",
        "cubes counted from the zero of the frame: subtract the origin of the grid first",
        _wrong_index("np.floor(points / voxel).astype(int)"),
    ),
    Misconception(
        "origin added",
        "the origin added where it must be taken away: a point at the origin has number 0",
        _wrong_index("np.floor((points + origin) / voxel).astype(int)"),
    ),
    Misconception(
        "multiplied by the voxel",
        "a product with the voxel where a quotient belongs: smaller cubes make larger numbers",
        _wrong_index("np.floor((points - origin) * voxel).astype(int)"),
    ),
    Misconception(
        "one taken off below zero",
        "cut off towards zero, and one less below it: a point on a face then lies one cube too far; use np.floor",
        _wrong_index("((points - origin) / voxel).astype(int) - (points < origin)"),
        variants=(_wrong_index("np.rint((points - origin) / voxel - 0.5).astype(int)"),),
    ),
    Misconception(
        "rounded before dividing",
        "metres rounded down first and divided then: divide first, then round down",
        _wrong_index("np.floor(points - origin) / voxel"),
        variants=(
            _wrong_index("np.floor(np.floor(points - origin) / voxel)"),
            _wrong_index("np.floor((points - origin).astype(int) / voxel)"),
        ),
    ),
    Misconception(
        "a face to the cube before",
        "a point on a face of two cubes in the one before: it belongs to the cube that begins there (np.floor)",
        _wrong_index("np.ceil((points - origin) / voxel) - 1"),
    ),
    Misconception(
        "origin alone divided",
        "a division that takes the origin alone: put the difference in brackets, (points - origin) / voxel",
        _wrong_index("np.floor(points - origin / voxel)"),
    ),
    Misconception(
        "origin subtracted after dividing",
        "the origin, in metres, subtracted from a number of cubes: subtract first, in brackets, then divide",
        _wrong_index("np.floor(points / voxel - origin)"),
    ),
    Misconception(
        "both rounded before subtracting",
        "points and origin each rounded down to cubes before one is subtracted from the other: the origin lies at the "
        "corner of a cube, so subtract it first and round once",
        _wrong_index("np.floor(points / voxel) - np.floor(origin / voxel)"),
    ),
    Misconception(
        "subtracted the wrong way round",
        "the point subtracted from the origin, so that numbers run backwards: points - origin",
        _wrong_index("np.floor((origin - points) / voxel)"),
        variants=(_wrong_index("((origin - points) / voxel).astype(int)"),),
    ),
    Misconception(
        "grid from the lowest point",
        "cubes counted from the lowest point, or the middle, of the cloud: they begin at `origin`, and beyond it "
        "numbers are negative",
        _wrong_index("np.floor((points - points.min(axis=0)) / voxel)"),
        variants=(
            _wrong_index(f"{_NUMBERS} - {_NUMBERS}.min(axis=0)"),
            _wrong_index("np.floor((points - points.mean(axis=0)) / voxel)"),
        ),
    ),
    Misconception(
        "sizes without their sign",
        "numbers without their sign, so that both sides of the origin share their cubes: leave abs() out",
        _wrong_index("np.floor(np.abs(points - origin) / voxel)"),
        variants=(_wrong_index(f"np.abs({_NUMBERS})"),),
    ),
    Misconception(
        "cut off at 0",
        "every number below 0 made 0: cubes on the other side of the origin have negative numbers",
        _wrong_index(f"np.maximum({_NUMBERS}, 0)"),
        variants=(_wrong_index("np.floor(np.maximum(points - origin, 0) / voxel)"),),
    ),
    Misconception(
        "metres for numbers",
        "the place of a cube in metres: its number is asked, so stop after rounding down",
        _wrong_index(f"{_NUMBERS} * voxel + origin"),
        variants=(_wrong_index(f"{_NUMBERS} * voxel"), _wrong_index(f"({_NUMBERS} + 0.5) * voxel + origin")),
    ),
    Misconception(
        "rest for quotient",
        "the rest of the division, the place in the cube: % gives the rest, / and np.floor the number of the cube",
        _wrong_index("(points - origin) % voxel"),
        variants=(_wrong_index("np.floor((points - origin) % voxel)"), _wrong_index("(points - origin) / voxel % 1")),
    ),
    Misconception(
        "int() for floor() and origin forgotten",
        "two mistakes: the origin is not subtracted, and numbers are cut off towards zero (np.floor rounds down)",
        _wrong_index("(points / voxel).astype(int)"),
    ),
    Misconception(
        "rounding for floor() and origin forgotten",
        "two mistakes: the origin is not subtracted, and numbers are rounded to the nearest (np.floor rounds down)",
        _wrong_index("np.rint(points / voxel)"),
    ),
)
