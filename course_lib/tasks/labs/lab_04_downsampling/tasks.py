"""Lab 04: the cube of a point, a voxel grid, normals, and thinning a cloud without tearing holes.

Truth is computed point by point with plain Python numbers (`_centroids`) or by SVD (`_normal`); the lab asks for the
same in a few lines of NumPy.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Task, Verdict
from course_lib.tasks.judges import judge_array, refuse
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_04_downsampling.cubes import INDEX_MISTAKES
from course_lib.tasks.labs.lab_04_downsampling.grids import GRID_MISTAKES
from course_lib.tasks.labs.lab_04_downsampling.mistakes import CAUSE_OF, CAUSES, NORMAL_MISTAKES, WHICH_MISTAKES
from course_lib.tasks.labs.lab_04_downsampling.parts import part_of_grid, part_of_index, part_of_normal
from course_lib.tasks.labs.lab_04_downsampling.thinning import THIN_MISTAKES, guess_thin, judge_thin, part_of_thin, view
from course_lib.tasks.plain import Plain
from course_lib.tasks.point_sets import judge_points_set
from course_lib.tasks.wording import array_problem, measured

# ----------------------------------------------------------------------------------------------------------- 1 cubes


def _index(points: np.ndarray, voxel: float, origin: np.ndarray) -> np.ndarray:
    """(N, 3) int64 numbers of cubes, one coordinate at a time."""
    return np.array([[math.floor((c - o) / voxel) for c, o in zip(p, origin, strict=True)] for p in points.tolist()])


def _index_case(points: np.ndarray, voxel: float, origin: np.ndarray, name: str) -> Case:
    return Case({"points": points, "voxel": voxel, "origin": origin}, {"truth": _index(points, voxel, origin)}, name)


def _index_cases(rng: np.random.Generator) -> list[Case]:
    hand = np.array([[0.9, 0.1, 0.0], [-0.1, 0.6, 1.2]])
    faces = np.array([[-0.5, 1.0, 0.5], [-1.5, -1.0, 0.0]])  # exact in binary
    room = rng.uniform(-2, 2, (40, 3))
    corner = np.array([300.1, -200.1, 100.1])  # of a map: so far out that 16-bit floats no longer tell cubes apart
    far = rng.uniform(-3, 3, (40, 3)) + corner
    return [
        _index_case(hand, 0.5, np.zeros(3), "two points, to do in your head"),
        _index_case(faces, 0.5, np.zeros(3), "points on faces of cubes: a face belongs to the cube that begins there"),
        _index_case(room, 0.2, rng.uniform(0.3, 0.6, 3), "a room around the origin"),
        _index_case(far, 0.25, corner + rng.uniform(-0.05, 0.05, 3), "a place far out on a map"),
    ]


def _judge_index(case: Case, answer: Plain) -> Verdict:
    """Whole numbers are right or wrong: a wrong one is told beside the right one."""
    verdict = judge_array(answer, case.truth, 0.2, "cubes", axes="xyz", what="the numbers")
    if verdict.passed or not math.isfinite(verdict.error):
        return verdict
    got, truth = np.asarray(answer, dtype=float), np.asarray(case.truth)
    row, axis = np.argwhere(np.abs(got - truth) > 0.2)[0]
    wrong = int((np.abs(got - truth) > 0.2).any(axis=1).sum())
    told = f"Row {row}, {'xyz'[axis]}: expected {truth[row, axis]}, got {got[row, axis]:g}"
    return replace(verdict, message=f"{told} ({wrong:,} of {len(truth):,} rows are wrong).")


# ------------------------------------------------------------------------------------------------------------ 2 grid

_POINT_TOLERANCE = 1e-4  # metres


def _centroids(points: np.ndarray, voxel: float, origin: np.ndarray, least: int) -> np.ndarray:
    """(M, 3) means of the points of each cube that holds at least so many, summed exactly."""
    cubes: dict[tuple[int, ...], list[list[float]]] = {}
    for number, point in zip(_index(points, voxel, origin).tolist(), points.tolist(), strict=True):
        cubes.setdefault(tuple(number), []).append(point)
    full = [held for held in cubes.values() if len(held) >= least]
    return np.array([[math.fsum(axis) / len(axis) for axis in zip(*held, strict=True)] for held in full])


def _floor_and_table(rng: np.random.Generator, count: int) -> np.ndarray:
    """(count, 3) points of a floor around the origin and of a smaller table above it, with a centimetre of noise."""
    points = rng.uniform([-1, -1, -0.4], [1, 1, -0.4], (count, 3))
    on_table = rng.random(count) < 0.4
    points[on_table] = points[on_table] * [0.5, 0.5, 0] + [0, 0, 0.33]
    return points + 0.01 * rng.standard_normal((count, 3))


def _grid_case(points: np.ndarray, voxel: float, origin: np.ndarray, least: int, name: str) -> Case:
    given = {"points": points, "voxel": voxel, "origin": origin, "least": least}
    return Case(given, {"truth": _centroids(points, voxel, origin, least)}, name)


def _grid_cases(rng: np.random.Generator) -> list[Case]:
    x_and_y = [[0.1, 0.1], [0.3, 0.1], [0.1, 0.3], [0.9, 0.1], [0.7, 0.3], [-0.1, 0.1]]
    hand = np.insert(np.array(x_and_y), 2, 0.1, axis=1)
    corner = np.array([300.1, -200.1, 100.1])  # 16-bit floats no longer tell its cubes apart
    far = _floor_and_table(rng, 400) + corner
    return [
        _grid_case(hand, 0.5, np.zeros(3), 2, "six points in three cubes, to do in your head"),
        _grid_case(_floor_and_table(rng, 900), 0.2, rng.uniform(0.03, 0.07, 3), 4, "a floor and a table"),
        _grid_case(far, 0.35, corner + rng.uniform(-0.04, 0.04, 3), 3, "the same, far out on a map"),
    ]


# ---------------------------------------------------------------------------------------------------------- 3 normal

_ANGLE_TOLERANCE = 0.2  # degrees


def _patch(
    rng: np.random.Generator, centre: np.ndarray, normal: np.ndarray, count: int = 40, thick: float = 0.0005
) -> np.ndarray:
    """(count, 3) points of a small piece of surface, 6 cm long, 3 cm wide, up to so thick to either side, metres."""
    normal = normal / np.linalg.norm(normal)
    along = np.cross(normal, rng.standard_normal(3))
    along /= np.linalg.norm(along)
    axes = np.stack([along, np.cross(normal, along), normal])
    return centre + rng.uniform(-1, 1, (count, 3)) * [0.03, 0.015, thick] @ axes


def _normal(neighbours: np.ndarray, viewpoint: np.ndarray) -> np.ndarray:
    """(3,) the direction of least spread, by SVD, towards the viewpoint."""
    middle = neighbours.mean(axis=0)
    normal = np.linalg.svd(neighbours - middle)[2][2]
    return normal if normal @ (viewpoint - middle) > 0 else -normal


def _normal_cases(rng: np.random.Generator) -> list[Case]:
    """Slanted patches, each seen from both of its sides.

    A viewpoint halfway to the patch is on one side of it and one beyond the patch on the other; both are on the same
    side of the plane through the origin. So a sign that is taken from the viewpoint alone is wrong in one of two. The
    upright wall's plane nearly holds the origin and the z axis: neither z = a x + b y + c nor n · p = 1 describes it.
    """
    cases = []
    for name, centre, slant in (
        ("a slanted wall", [0.3, 0.2, 1.5], [0.5, 0.4, -0.9]),
        ("a table top in the world", [1.0, 2.0, 0.7], [0.2, 0.15, 1.0]),
    ):
        normal = np.array(slant) + rng.uniform(-0.05, 0.05, 3)
        neighbours = _patch(rng, np.array(centre), normal)
        for factor, side in ((0.5, "one side"), (1.6, "the other side")):
            viewpoint = factor * np.array(centre) + rng.uniform(-0.03, 0.03, 3)
            given = {"neighbours": neighbours, "viewpoint": viewpoint}
            cases.append(Case(given, {"truth": _normal(neighbours, viewpoint)}, f"{name}, seen from {side}"))
    centre, normal = np.array([1.0, 2.0, 0.7]), np.array([2.0, -1.0, 0.0]) + rng.uniform(-0.02, 0.02, 3)
    sides = ((1.0, "one side"), (-1.0, "the other side"))
    for count, thick, of in ((40, 0.0005, ""), (5, 0.003, "five points of ")):
        neighbours = _patch(rng, centre, normal, count, thick)
        for factor, side in sides:
            given = {"neighbours": neighbours, "viewpoint": centre + factor * normal}
            cases.append(Case(given, {"truth": _normal(**given)}, f"{of}an upright wall, seen from {side}"))
    return cases


def _judge_normal(case: Case, answer: Plain) -> Verdict:
    truth = np.asarray(case.truth, dtype=float)
    problem = array_problem(answer, truth, "the normal", None, None)
    if problem:
        return refuse(problem, _ANGLE_TOLERANCE, "deg")
    normal = np.asarray(answer, dtype=float)
    length = float(np.linalg.norm(normal))
    if not math.isfinite(length) or abs(length - 1) > 1e-2:
        return refuse(f"The normal has the length {length:.3g}; a normal has length 1.", _ANGLE_TOLERANCE, "deg")
    angle = math.degrees(math.atan2(float(np.linalg.norm(np.cross(normal, truth))), float(normal @ truth)))
    return measured(angle, _ANGLE_TOLERANCE, "deg", "the normal", "")


# ------------------------------------------------------------------------------------------------------------ 5 open


# -------------------------------------------------------------------------------------------------------------- all

_GRIDS = (
    "course_lib.cloud.downsample.voxel_grid",
    "course_lib.cloud.downsample.voxel_downsample",
    "course_lib.cloud.grid.cells_of",
    "course_lib.cloud.downsample._centroids_in_threads",
    "course_lib.cloud.downsample._centroids",
)

TASKS = (
    Task(
        id="04-1",
        title="the cube of a point",
        points=1,
        version=4,
        kind="fill",
        repeats=True,
        signature="def voxel_index(points, voxel, origin)",
        cases=_index_cases,
        judge=_judge_index,
        misconceptions=INDEX_MISTAKES,
        anatomy=part_of_index,
        hides=_GRIDS,
        where="lesson 04, section 1 (one point a cube)",
    ),
    Task(
        id="04-2",
        title="a voxel grid",
        points=3,
        version=3,
        kind="write",
        signature="def voxel_centroids(points, voxel, origin, least)",
        cases=_grid_cases,
        judge=lambda case, answer: judge_points_set(answer, case.truth, _POINT_TOLERANCE, "m", what="the centroids"),
        misconceptions=GRID_MISTAKES,
        anatomy=part_of_grid,
        refused=part_of_grid,
        hides=_GRIDS,
        where="lesson 04, section 1 (one point a cube)",
    ),
    Task(
        id="04-3",
        title="mend a normal",
        points=3,
        version=3,
        kind="mend",
        signature="def normal_of(neighbours, viewpoint)",
        cases=_normal_cases,
        judge=_judge_normal,
        misconceptions=NORMAL_MISTAKES,
        anatomy=part_of_normal,
        refused=part_of_normal,
        hides=(
            "course_lib.cloud.normals.estimate_normals",
            "course_lib.cloud.normals.fit_surfels",
            "course_lib.cloud.normals.orient_normals",
            "course_lib.cloud.normals.smallest_eigenvectors",
        ),
        where="lesson 04, sections 3 and 4 (normals, and their sign)",
    ),
    which_cause(
        "04-4",
        "which mistake made this",
        CAUSE_OF,
        "the five clouds above",
        WHICH_MISTAKES,
        "lesson 04, section 1 (one point a cube)",
        causes=CAUSES,
    ),
    Task(
        id="04-5",
        title="thin out without holes",
        points=4,
        version=3,
        kind="open",
        signature="def thin_out(points, count)",
        cases=lambda rng: [view(rng)],
        judge=judge_thin,
        misconceptions=THIN_MISTAKES,
        anatomy=part_of_thin,
        refused=part_of_thin,
        guess=guess_thin,
        hides=("course_lib.cloud.downsample.sample_farthest", *_GRIDS),
        where="lesson 04, Going further (farthest point), then this task's hints",
    ),
    in_words(
        "04-6",
        "explain the smooth cloud",
        (
            "0: says that downsampling removes noise, or that a larger voxel is always better or always worse.",
            "1: says that flat parts are averaged while edges are rounded off; or from what the voxel should follow "
            "(the thinnest thing to keep, or how much may be lost; the noise alone is no rule).",
            "2: both: a mean over a cube can average noise on flat parts, and rounds off edges by a good part of the "
            "voxel; and a rule for the voxel that names the thinnest detail or the error that can be borne.",
        ),
        "lesson 04, Report against reality (noise reduction)",
        version=2,
    ),
)
