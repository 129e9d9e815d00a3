"""The wrong answers of lab 04, as learner code: what each looks like, and what to do about it.

Each source is the plain solution with one thing wrong, built from parts, so that nothing else differs.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended, swapped

_GIVEN = {
    "centring": (
        "neighbours",
        "neighbours - neighbours.mean(axis=0)",
        "points counted from the zero of the frame: subtract their mean first",
    ),
    "row": (
        "vectors[0]",
        "vectors[:, 0]",
        "a row of the matrix of eigenvectors, which stand in its columns: take column 0",
    ),
    "sign": (
        "viewpoint",
        "(viewpoint - neighbours.mean(axis=0))",
        "the sign taken from the viewpoint alone: compare with the arrow from the mean to it",
    ),
}


def _wrong_normal(left: tuple[str, ...] = (), column: str = "", sign: str = "< 0", middle: str = "") -> str:
    """The given code with some of its three mistakes still in it."""
    offsets, vector, arrow = mended(_GIVEN, left)
    offsets = f"neighbours - {middle}" if middle else offsets
    return (
        "def normal_of(neighbours, viewpoint):\n"
        f"    offsets = {offsets}\n"
        "    values, vectors = np.linalg.eigh(offsets.T @ offsets)\n"
        f"    normal = {column or vector}\n"
        f"    if normal @ {arrow} {sign}:\n"
        "        normal = -normal\n"
        "    return normal\n"
    )


def _fitted(found: str, normal: str) -> str:
    """A normal from another equation of the plane, with its length and sign right."""
    return (
        "def normal_of(neighbours, viewpoint):\n"
        f"    found = {found}\n"
        f"    normal = {normal}\n"
        "    normal = normal / np.linalg.norm(normal)\n"
        "    return normal if normal @ (viewpoint - neighbours.mean(axis=0)) > 0 else -normal\n"
    )


# Without centring, the smallest eigenvector stands at a right angle on the mean itself, and both signs agree: the
# sign that is left in as well shows after centring.
_COMBINED = (("centring",), ("row",), ("sign",), ("centring", "row"), ("row", "sign"))
NORMAL_MISTAKES = left_in(_GIVEN, _wrong_normal, _COMBINED) + (
    Misconception(
        "nothing mended",
        "the given code as it was: points not centred, a row for a column, and the sign taken from the viewpoint alone",
        _wrong_normal(tuple(_GIVEN)),
    ),
    Misconception(
        "largest eigenvector",
        "the direction in which the points spread most, which lies in the surface: take the smallest eigenvalue's",
        _wrong_normal(column="vectors[:, 2]"),
    ),
    Misconception(
        "middle eigenvector",
        "the eigenvector of the middle eigenvalue, which lies in the surface: eigh sorts ascending, so take column 0",
        _wrong_normal(column="vectors[:, 1]"),
    ),
    Misconception(
        "least squares in z",
        "the plane z = a x + b y + c: an upright wall has none; take the direction in which the points spread least",
        _fitted(
            "np.linalg.lstsq(np.c_[neighbours[:, :2], np.ones(len(neighbours))], neighbours[:, 2], rcond=None)[0]",
            "np.array([-found[0], -found[1], 1.0])",
        ),
    ),
    Misconception(
        "n · p = 1",
        "the plane n · p = 1: one through the origin has none, and near it errors grow; centre the points",
        _fitted("np.linalg.lstsq(neighbours, np.ones(len(neighbours)), rcond=None)[0]", "found"),
    ),
    Misconception(
        "away from the viewpoint",
        "the normal on the far side, turned the wrong way or not at all: it must point to where the sensor stood",
        _wrong_normal(sign="> 0"),
    ),
    *(
        Misconception(
            f"{name} left in and away from the viewpoint",
            f"two mistakes: {_GIVEN[name][2]}; and the normal is turned to the far side: turn it where n · arrow < 0",
            _wrong_normal((name,), sign="> 0"),
        )
        for name in ("centring", "row", "sign")
    ),
    Misconception(
        "centring without axis",
        "a mean without axis=0 subtracted, the same from x, y and z: each needs its own, mean(axis=0)",
        _wrong_normal(middle="neighbours.mean()"),
        variants=(_wrong_normal(middle="neighbours.mean(axis=1, keepdims=True)"),),
    ),
    Misconception(
        "viewpoint as centre",
        "points counted from the viewpoint: their spread is counted from their own mean",
        _wrong_normal(middle="viewpoint"),
    ),
    Misconception(
        "a corner as centre",
        "points counted from their smallest or largest coordinates: spread is counted from their mean",
        _wrong_normal(middle="neighbours.min(axis=0)"),
        variants=(_wrong_normal(middle="neighbours.max(axis=0)"),),
    ),
    Misconception(
        "origin for viewpoint",
        "the side of the frame's zero, or of smaller z, as if the sensor stood there: the arrow leads from the mean to "
        "`viewpoint`",
        _wrong_normal().replace(_GIVEN["sign"][1], "(-neighbours.mean(axis=0))"),
        variants=(_wrong_normal().replace(f"normal @ {_GIVEN['sign'][1]} <", "normal[2] >"),),
    ),
    Misconception(
        "a column of svd's last matrix",
        "a column of the last matrix of svd, which holds its vectors in rows: take its last row",
        _fitted("np.linalg.svd(neighbours - neighbours.mean(axis=0))[2]", "found[:, -1]"),
        variants=(_fitted("np.linalg.svd(neighbours - neighbours.mean(axis=0))[2]", "found[:, 0]"),),
    ),
    Misconception(
        "another row",
        "another row of the matrix of eigenvectors, which stand in its columns: take column 0",
        _wrong_normal(column="vectors[2]"),
        variants=(_wrong_normal(column="vectors[1]"),),
    ),
    Misconception(
        "up for towards",
        "a sign that z alone decides, as if the sensor were always above: compare with the arrow to it",
        _wrong_normal().replace(f"normal @ {_GIVEN['sign'][1]} <", "normal[2] <"),
    ),
    Misconception(
        "the lesson's own code",
        "the lesson's normal_of as it stands, which returns the spreads as well and knows no viewpoint: return the "
        "normal alone, turned towards it",
        "def normal_of(neighbours, viewpoint):\n"
        "    offsets = neighbours - neighbours.mean(axis=0)\n"
        "    values, vectors = np.linalg.eigh(offsets.T @ offsets / len(neighbours))\n"
        "    return vectors[:, 0], np.sqrt(np.maximum(values, 0))\n",
    ),
    Misconception(
        "direction to the viewpoint",
        "the direction to the sensor: it only decides between the normal's two sides",
        "def normal_of(neighbours, viewpoint):\n"
        "    arrow = viewpoint - neighbours.mean(axis=0)\n"
        "    return arrow / np.linalg.norm(arrow)\n",
    ),
)


CAUSES = (
    "int() for floor()",
    "centres of the cubes",
    "twice the voxel",
    "every k-th point",
    "height left out",
)
CAUSE_OF = {
    "A": "height left out",
    "B": "int() for floor()",
    "C": "centres of the cubes",
    "D": "twice the voxel",
    "E": "every k-th point",
}


WHICH_MISTAKES = (
    Misconception(
        "int() for twice the voxel",
        "int() and twice the voxel taken for each other: int() makes only the cubes beside the origin larger",
        swapped(CAUSE_OF, CAUSES[0], CAUSES[2]),
    ),
    Misconception(
        "height for twice the voxel",
        "the missing height and twice the voxel taken for each other: without height, points hang where nothing is",
        swapped(CAUSE_OF, CAUSES[4], CAUSES[2]),
    ),
    Misconception(
        "centres for every k-th",
        "centres and every k-th point taken for each other: centres stand in rows; every k-th point is a measured one",
        swapped(CAUSE_OF, CAUSES[1], CAUSES[3]),
    ),
    Misconception(
        "int() for height",
        "int() and the missing height taken for each other: int() errs only beside the origin, the other everywhere",
        swapped(CAUSE_OF, CAUSES[0], CAUSES[4]),
    ),
)
