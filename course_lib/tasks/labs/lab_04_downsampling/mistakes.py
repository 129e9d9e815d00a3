"""The wrong answers of lab 04, as learner code: what each looks like, and what to do about it.

Each source is the plain solution with one thing wrong, built from parts, so that nothing else differs.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended, swapped


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
    ),
)


def _wrong_grid(
    index: str = "np.floor((points - origin) / voxel)", result: str = "", full: str = "count >= least"
) -> str:
    result = result or "np.array([points[which == i].mean(axis=0) for i in np.flatnonzero(full)])"
    return (
        "def voxel_centroids(points, voxel, origin, least):\n"
        f"    index = {index}\n"
        "    cubes, which, count = np.unique(index, axis=0, return_inverse=True, return_counts=True)\n"
        "    which = which.reshape(-1)\n"
        f"    full = {full}\n"
        "    total, last = np.zeros((len(cubes), 3)), np.zeros((len(cubes), 3))\n"
        "    np.add.at(total, which, points)\n"
        "    last[which] += points\n"
        f"    return {result}\n"
    )


GRID_MISTAKES = (
    Misconception(
        "int() for floor()",
        "numbers cut off towards zero, so that the cubes on both sides of the origin become one: use np.floor",
        _wrong_grid("((points - origin) / voxel).astype(int)"),
    ),
    Misconception(
        "rounding for floor()",
        "numbers rounded to the nearest: that is another grid, half a voxel beside; round down with np.floor",
        _wrong_grid("np.rint((points - origin) / voxel)"),
    ),
    Misconception(
        "origin forgotten",
        "a grid that begins at the zero of the frame: subtract the origin before you divide",
        _wrong_grid("np.floor(points / voxel)"),
    ),
    Misconception(
        "centres of the cubes",
        "the middle of each cube in the place of the mean of its points: nothing was measured there",
        _wrong_grid(result="(cubes[full] + 0.5) * voxel + origin"),
    ),
    Misconception(
        "corners of the cubes",
        "the numbers of the cubes times the voxel, which are their corners: return the mean of the points in each cube",
        _wrong_grid(result="cubes[full] * voxel + origin"),
    ),
    Misconception(
        "first point of each cube",
        "one point of each cube and not their mean: noise is not averaged then",
        _wrong_grid(result="np.array([points[which == i][0] for i in np.flatnonzero(full)])"),
    ),
    Misconception(
        "middle of the extremes",
        "the middle between smallest and largest coordinates of each cube: the centroid is the mean of all its points",
        _wrong_grid(
            result="np.array([(points[which == i].min(axis=0) + points[which == i].max(axis=0)) / 2 "
            "for i in np.flatnonzero(full)])"
        ),
    ),
    Misconception(
        "height left out",
        "columns in the place of cubes, which merge the floor with what stands on it: number the cubes along z, too",
        _wrong_grid("np.floor((points - origin) / voxel)[:, :2]"),
    ),
    Misconception(
        "sums not divided",
        "the sum of the points of each cube: divide it by how many there are",
        _wrong_grid(result="total[full]"),
    ),
    Misconception(
        "+= with repeated indices",
        "total[which] += points, which adds only one of the points of a cube: use np.add.at(total, which, points)",
        _wrong_grid(result="last[full] / count[full][:, None]"),
    ),
    Misconception(
        "counts returned as well",
        "the centroids and the counts in one answer: return the centroids alone",
        _wrong_grid(result="(total[full] / count[full][:, None], count[full])"),
    ),
    Misconception(
        "more than for at least",
        "cubes with exactly `least` points left out: at least means count >= least",
        _wrong_grid(full="count > least"),
    ),
    Misconception(
        "nearly empty cubes kept",
        "every cube that holds a point, so that a stray one counts as much as a full cube: keep count >= least",
        _wrong_grid(full="count >= 1"),
    ),
)


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


def _wrong_normal(left: tuple[str, ...] = (), column: str = "", sign: str = "< 0") -> str:
    """The given code with some of its three mistakes still in it."""
    offsets, vector, arrow = mended(_GIVEN, left)
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
