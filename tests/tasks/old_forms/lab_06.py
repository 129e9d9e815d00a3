"""Lab 06 as it was: tries for one plane, a fit in which all points weigh alike, one plane among other things."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_band, judge_number, refuse
from course_lib.tasks.labs.lab_06_planes.plane_answers import apart, plane_problem, turned, which_part
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import measured


def _count_tries(w: float, sample: int, p: float) -> int:
    """The fewest samples of which one is good with probability p, by counting; 0 where rounding could decide."""
    bad, tries = 1.0, 0
    while bad > 1 - p:
        bad, tries = bad * (1 - w**sample), tries + 1
    close = min(abs(bad - (1 - p)), abs(bad / (1 - w**sample) - (1 - p))) < 1e-9
    return 0 if close else tries


def _tries_cases(rng: np.random.Generator) -> list[Case]:
    """The lesson's numbers, and others in which no two mistakes agree."""
    asked = [
        (0.6, 3, 0.99, "the numbers of the lesson"),
        (0.8, 2, 0.999, "few outliers, two points a sample"),
        (0.5, 3, 0.99, "half of the points are inliers"),  # 34.5 before rounding, and a little less
    ]
    while len(asked) < 5:
        few = len(asked) == 4
        w = round(float(rng.uniform(0.25, 0.4) if few else rng.uniform(0.62, 0.75)), 3)
        sample, p = (4, 0.95) if few else (3, 0.98)
        if _count_tries(w, sample, p):
            asked.append((w, sample, p, "many outliers, four points a sample" if few else "another share of inliers"))
    return [
        Case({"inlier_share": w, "sample": s, "confidence": p}, {"truth": _count_tries(w, s, p)}, name)
        for w, s, p, name in asked
    ]


def _wrong_tries(
    good: str = "inlier_share**sample",
    number: str = "np.log(1 - confidence) / np.log(1 - good)",
    rounded: str = "np.ceil",
) -> str:
    return (
        f"def tries_needed(inlier_share, sample, confidence):\n    good = {good}\n    return int({rounded}({number}))\n"
    )


TRIES_MISTAKES = (
    Misconception(
        "w for w to the power of the sample",
        "one good point taken for a good sample: all points of a sample must be inliers at once, so raise the share to "
        "the power of their number",
        _wrong_tries("inlier_share"),
    ),
    Misconception(
        "outlier share",
        "the share of outliers taken for that of inliers: a sample is good when all its points are inliers",
        _wrong_tries("(1 - inlier_share) ** sample"),
    ),
    Misconception(
        "confidence for failure",
        "the logarithm of the confidence: what may be at most 1 - p is the chance that every sample is bad",
        _wrong_tries(number="np.log(confidence) / np.log(1 - good)"),
    ),
    Misconception(
        "rounded down",
        "a number of tries rounded down, which stays just below the confidence: round up",
        _wrong_tries(rounded="np.floor"),
    ),
    Misconception(
        "tries on average",
        "the number of tries until the first good sample on average, without any confidence in it: use both logarithms",
        _wrong_tries(number="1 / good"),
        variants=(_wrong_tries(number="1 / good", rounded="round"),),
    ),
    Misconception(
        "always three points",
        "samples of three points whatever was asked: use the size of the sample that you are given",
        _wrong_tries("inlier_share**3"),
    ),
    Misconception(
        "always 0.99",
        "a confidence of 0.99 whatever was asked: use the confidence that you are given",
        _wrong_tries(number="np.log(0.01) / np.log(1 - good)"),
    ),
    Misconception(
        "not rounded",
        "a number of tries with a fraction: nobody draws half a sample, so round up",
        _wrong_tries(rounded="").replace("int(", "float("),
    ),
    Misconception(
        "rounded to the nearest",
        "a number of tries rounded to the nearest, which may stay just below the confidence: round up",
        _wrong_tries(rounded="round"),
    ),
    Misconception(
        "good for bad samples",
        "the logarithm of the chance of a good sample: a sample is bad with probability 1 minus that",
        _wrong_tries(number="np.log(1 - confidence) / np.log(good)"),
    ),
    Misconception(
        "power of the logarithm",
        "the power taken of the logarithm: w to the power of the sample stands inside it, log(1 - w**sample)",
        _wrong_tries(number="np.log(1 - confidence) / np.log(1 - inlier_share) ** sample"),
        variants=(_wrong_tries(number="np.log(1 - confidence) / abs(np.log(1 - inlier_share)) ** sample"),),
    ),
    Misconception(
        "power outside the bracket",
        "(1 - w)**sample, a sample of outliers only: one bad point spoils a sample already, with chance 1 - w**sample",
        _wrong_tries(number="np.log(1 - confidence) / np.log((1 - inlier_share) ** sample)"),
    ),
    Misconception(
        "times for power",
        "w times the size of the sample: chances that must all come true are multiplied, w**sample",
        _wrong_tries("inlier_share * sample", "np.log(1 - confidence) / np.log(abs(1 - good))"),
    ),
    Misconception(
        "logarithm of the quotient",
        "the logarithm of a quotient, where the quotient of two logarithms is asked",
        _wrong_tries(number="np.log((1 - confidence) / (1 - good))"),
        variants=(_wrong_tries(number="abs(np.log((1 - confidence) / (1 - good)))"),),
    ),
    Misconception(
        "one try always",
        "one try whatever was asked: is the quotient upside down, or were the logarithms forgotten",
        _wrong_tries(number="np.log(1 - good) / np.log(1 - confidence)"),
    ),
    Misconception(
        "tries and confidence exchanged",
        "log(1 - w**sample) divided by the logarithm of the confidence: the quotient is upside down, with p for 1 - p",
        _wrong_tries(number="np.log(1 - good) / np.log(confidence)"),
    ),
    Misconception(
        "percent for share",
        "shares divided by 100 once more: they come as shares of 1, not in percent",
        _wrong_tries("(inlier_share / 100)**sample", "np.log(1 - confidence / 100) / np.log(1 - good)"),
    ),
)


_TRIES = 100  # until eig puts the smallest eigenvalues of two boards in different places
_PLANE_TOLERANCE = 2e-4  # metres, at the points and beside them


def _by_singular_values(points: np.ndarray) -> np.ndarray:
    """(4,) plane of least squares by the singular value decomposition of the centred points."""
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    return np.append(normal, -normal @ middle)


def _board_case(
    rng: np.random.Generator,
    tilt: float,
    size: tuple[float, float],
    middle: tuple[float, float, float],
    noise: float,
    name: str,
) -> Case:
    flat = np.column_stack([rng.uniform(-0.5, 0.5, (120, 2)) * size, np.zeros(120)])
    flat[:3, :2] = np.array([[-0.08, 0.03], [0.09, 0.05], [0.01, -0.07]]) * size  # three close together
    noisy = flat @ turned(rng, tilt, np.array([1.0, 0.4, 0.0])).T + rng.normal(0, noise, flat.shape)
    return _fit_case(noisy + np.asarray(middle) + rng.uniform(-0.05, 0.05, 3), name)


def _fit_case(points: np.ndarray, name: str) -> Case:
    plane = _by_singular_values(points)
    far = points[np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[-12:]]
    around = np.concatenate([far, far + 0.3 * plane[:3], far - 0.3 * plane[:3]])
    return Case({"points": points}, {"truth": plane, "around": around}, name)


def _smallest_of_eig(case: Case) -> int:
    """Where np.linalg.eig, which sorts nothing, puts the smallest eigenvalue of a board."""
    points = case.given["points"]
    return int(np.argmin(np.linalg.eig(np.cov(points.T))[0]))


def _fit_cases(rng: np.random.Generator) -> list[Case]:
    """A rectangle and three boards, of which two have their smallest eigenvalue in different places for eig."""
    square = np.array([[0, 0, 2], [1, 0, 2], [0, 0.5, 2], [1, 0.5, 2.0]])
    tilted = _board_case(rng, 20, (1.0, 0.6), (0.2, -0.1, 2.0), 0.005, "a board tilted by 20 degrees")
    for _ in range(_TRIES):
        edge_on = _board_case(rng, 84, (1.2, 0.7), (-0.4, 0.3, 1.5), 0.02, "a board seen almost edge on")
        if _smallest_of_eig(edge_on) != _smallest_of_eig(tilted):
            break
    aside = _board_case(rng, 50, (0.9, 0.5), (3.0, -2.0, 6.0), 0.01, "a board far to one side")
    return [_fit_case(square, "a rectangle two metres ahead, to do in your head"), tilted, edge_on, aside]


def _judge_fit(case: Case, answer: Plain) -> Verdict:
    problem = plane_problem(answer, "the plane")
    if problem:
        return refuse(problem, _PLANE_TOLERANCE, "m")
    off = apart(answer, case.truth, case.hidden["around"])
    return measured(off, _PLANE_TOLERANCE, "m", "the plane", "around the points")


def _wrong_fit(
    scatter: str = "(points - middle).T @ (points - middle)",
    pick: str = "vectors[:, 0]",
    offset: str = "-normal @ middle",
    middle: str = "points.mean(axis=0)",
    solve: str = "eigh",
) -> str:
    return (
        "def fit_plane(points):\n"
        f"    middle = {middle}\n"
        f"    values, vectors = np.linalg.{solve}({scatter})\n"
        f"    normal = {pick}\n"
        f"    return np.append(normal, {offset})\n"
    )


def _through(rows: str) -> str:
    """The plane through three points, by their numbers."""
    return (
        f"def fit_plane(points):\n    a, b, c = points[{rows}]\n    normal = np.cross(b - a, c - a)\n"
        "    normal = normal / np.linalg.norm(normal)\n    return np.append(normal, -normal @ a)\n"
    )


def _along(axis: int, constant: bool = True, end: str = "") -> str:
    """Least squares with errors along one axis, with or without a constant, and what is done at the end."""
    ones = ", np.ones(len(points))" if constant else ""
    return (
        f"def fit_plane(points):\n    others = np.delete(points, {axis}, axis=1)\n"
        f"    columns = np.column_stack([others{ones}])\n"
        f"    fitted = np.linalg.lstsq(columns, points[:, {axis}], rcond=None)[0]\n"
        f"    plane = np.append(np.insert(fitted[:2], {axis}, -1.0), {'fitted[2]' if constant else '0.0'})\n"
        f"{end}    return plane / np.linalg.norm(plane[:3])\n"
    )


FIT_MISTAKES = (
    Misconception(
        "mean not subtracted",
        "a scatter of points about the origin, which mostly says where they lie: subtract their mean first",
        _wrong_fit("points.T @ points"),
        variants=(_wrong_fit("points.T @ points", offset="0.0"),),
    ),
    Misconception(
        "largest eigenvector",
        "the direction in which the points spread most, which lies in the plane: take the eigenvector of the smallest "
        "eigenvalue",
        _wrong_fit(pick="vectors[:, 2]"),
    ),
    Misconception(
        "rows for columns",
        "a row of the matrix of eigenvectors: eigh returns them as columns, vectors[:, 0]",
        _wrong_fit(pick="vectors[0]"),
    ),
    Misconception(
        "least squares in z",
        "errors measured along z, not across the plane, so steep planes come out too flat: use the scatter matrix",
        _along(2),
    ),
    Misconception(
        "least squares in x",
        "errors measured along x, not across the plane: use the scatter matrix, which knows no axis",
        _along(0),
    ),
    Misconception(
        "least squares in y",
        "errors measured along y, not across the plane: use the scatter matrix, which knows no axis",
        _along(1),
    ),
    Misconception(
        "z without a constant",
        "z = a x + b y without a constant, as if the plane went through the origin, and errors along z",
        _along(2, constant=False),
        variants=(_along(2, constant=False, end="    plane[3] = -plane[:3] @ points.mean(axis=0)\n"),),
    ),
    Misconception(
        "n · p = 1",
        "least squares of n · p = 1, which measures no distances: far planes weigh less; use the scatter matrix",
        "def fit_plane(points):\n"
        "    normal = np.linalg.lstsq(points, np.ones(len(points)), rcond=None)[0]\n"
        "    return np.append(normal, -1.0) / np.linalg.norm(normal)\n",
    ),
    Misconception(
        "columns of Vt",
        "a column of svd's third result: the directions are its rows, and the last one has the smallest spread",
        _wrong_fit("points - middle", "vectors[:, 2]", solve="svd").replace("values, vectors", "_, values, vectors"),
    ),
    Misconception(
        "median for the mean",
        "the median of the points in the place of their mean: the best plane goes through the mean",
        _wrong_fit(middle="np.median(points, axis=0)"),
    ),
    Misconception(
        "middle of the box",
        "the middle of the smallest and the largest coordinates: the best plane goes through the mean of the points",
        _wrong_fit(middle="(points.min(axis=0) + points.max(axis=0)) / 2"),
    ),
    Misconception(
        "mean of all numbers",
        "one mean of all x, y and z together: axis=0 gives one for each coordinate",
        _wrong_fit(middle="np.full(3, points.mean())"),
    ),
    Misconception(
        "offset of one point",
        "the offset of one noisy point: the plane goes through the mean, d = -n · mean",
        _wrong_fit(offset="-normal @ points[0]"),
        variants=(_wrong_fit(offset="-normal @ points[-1]"),),
    ),
    Misconception(
        "the distance of the mean",
        "the distance of the mean from the origin in the place of d: project the mean on the normal, d = -n · mean",
        _wrong_fit(offset="-np.linalg.norm(middle)"),
        variants=(_wrong_fit(offset="np.linalg.norm(middle)"),),
    ),
    Misconception(
        "axis of least spread",
        "the coordinate that spreads least taken for the normal: boards are seldom parallel to an axis",
        _wrong_fit(pick="np.eye(3)[np.argmin(points.std(axis=0))]"),
    ),
    Misconception(
        "mean not subtracted and wrong sign",
        "a scatter about the origin, and d with the wrong sign: subtract the mean first, and d = -n · mean",
        _wrong_fit("points.T @ points", offset="normal @ middle"),
    ),
    Misconception(
        "offset with the wrong sign",
        "a plane on the other side of the origin: n · x + d is 0 at the mean, so d is minus their product",
        _wrong_fit(offset="normal @ middle"),
    ),
    Misconception(
        "offset forgotten",
        "a plane through the origin: it must go through the mean of the points, so d = -n · mean",
        _wrong_fit(offset="0.0"),
    ),
    Misconception(
        "first three points",
        "the plane through three points only, with all their noise: every point has its say",
        _through(":3"),
        variants=(_through("[0, len(points) // 2, -1]"),),
    ),
)


_THRESHOLD, _NOISE = 0.015, 0.005
_FIND_BANDS = ((0.002, 1.0), (0.005, 0.75), (0.015, 0.5), (0.05, 0.25))  # metres, at the rim of the plane


def cluttered(rng: np.random.Generator) -> Case:
    """A plane, 1.6 x 1.2 m, that two points in ten belong to; a smaller one above it, and things in between."""
    R, at = turned(rng, float(rng.uniform(30, 45)), np.array([1.0, 0.3, 0.0])), np.array([0.2, 0.1, 2.0])
    own = np.column_stack([rng.uniform((-0.8, -0.6), (0.8, 0.6), (400, 2)), rng.normal(0, _NOISE, 400)])
    shelf = np.column_stack([rng.uniform((0.1, -0.5), (0.8, 0.5), (250, 2)), 0.25 + rng.normal(0, _NOISE, 250)])
    things = rng.uniform((-0.3, -0.8, -0.05), (1.0, 0.8, 0.9), (1350, 3))
    points = rng.permutation(np.concatenate([own, shelf, things])) @ R.T + at
    around = np.radians(np.arange(0, 360, 15))
    rim = np.column_stack([0.8 * np.cos(around), 0.8 * np.sin(around), np.zeros(len(around))]) @ R.T + at
    truth = np.append(R[:, 2], -R[:, 2] @ at)
    given = {"points": points, "threshold": _THRESHOLD}
    return Case(given, {"truth": truth, "around": rim}, "a plane among other things")


def judge_find(case: Case, answer: Plain) -> Verdict:
    problem = plane_problem(answer, "the plane")
    if problem:
        return refuse(problem, _FIND_BANDS[0][0], "m")
    off = apart(answer, case.truth, case.hidden["around"])
    verdict = judge_band(off, _FIND_BANDS, "m", what="the error at the plane's rim")
    return replace(verdict, message=f"{verdict.message} {_why_off(case, answer, verdict.score)}".rstrip())


def _why_off(case: Case, answer: Plain, score: float) -> str:
    """What the points say of a plane that is not the best one, in a sentence or two."""
    points, threshold = case.given["points"], case.given["threshold"]
    off, true = (points @ plane[:3] + plane[3] for plane in map(np.asarray, (answer, case.truth)))
    near, most = (int(np.count_nonzero(np.abs(signed) <= threshold)) for signed in (off, true))
    if score == 1:
        return ""
    if score >= 0.25:
        return "A plane through three noisy points leans: fit to its inliers, collect these again, and fit again."
    if near < most:
        return (
            f"Only {near:,} points lie within the threshold of it, and {most:,} of the true one. Are there enough "
            "samples? Is each judged by that count, and the best kept? Has the normal length 1, and has the distance "
            "lost its sign, before you count?"
        )
    return ""


def what_was_found(case: Case, answer: Plain) -> tuple[str, str]:
    """Whether too few points agree with a plane, or which part of it is wrong where they do."""
    points, threshold = case.given["points"], case.given["threshold"]
    off, true = (np.abs(points @ plane[:3] + plane[3]) for plane in map(np.asarray, (answer, case.truth)))
    middle = points[true <= threshold].mean(axis=0)
    name, says = which_part(answer, case.truth, middle, threshold)
    few = 2 * np.count_nonzero(off <= threshold) < np.count_nonzero(true <= threshold)
    if few and name != "only d" and name != "another direction":
        return "few inliers", "Another plane was taken than the one that most points agree with."
    return name, says


def guess_plane(rng: np.random.Generator) -> Callable[[np.ndarray, float], np.ndarray]:
    """A function that says a plane through the middle of the points, turned at random."""
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    return lambda points, threshold: np.append(normal, -normal @ points.mean(axis=0))


_FIT = (
    "    middle = points.mean(axis=0)\n"
    "    vectors = np.linalg.eigh((points - middle).T @ (points - middle))[1]\n"
    "    normal = vectors[:, 0]\n"
    "    return np.append(normal, -normal @ middle)\n"
)


FIND_MISTAKES = (
    Misconception(
        "n · p = 1 of all points",
        "n · p = 1 solved for all points: all have their say; find out who belongs to the plane first",
        "def find_plane(points, threshold):\n"
        "    normal = np.linalg.lstsq(points, np.ones(len(points)), rcond=None)[0]\n"
        "    return np.append(normal, -1.0) / np.linalg.norm(normal)\n",
    ),
    Misconception(
        "fit to all points",
        "a fit to all points, in which the farthest weigh most: find out who belongs to the plane first",
        "def find_plane(points, threshold):\n" + _FIT,
    ),
    Misconception(
        "least squares in z of all points",
        "least squares in z over all points: errors along z, and of points that do not belong to the plane",
        "def find_plane(points, threshold):\n"
        "    columns = np.column_stack([points[:, :2], np.ones(len(points))])\n"
        "    a, b, c = np.linalg.lstsq(columns, points[:, 2], rcond=None)[0]\n"
        "    return np.array([a, b, -1.0, c]) / np.sqrt(a * a + b * b + 1)\n",
    ),
    Misconception(
        "far from the middle thrown away",
        "points far from the middle of all thrown away before a fit: the plane's own lie far out, too; vote instead",
        "def find_plane(points, threshold):\n"
        "    far = np.linalg.norm(points - np.median(points, axis=0), axis=1)\n"
        "    points = points[far <= np.median(far)]\n" + _FIT,
    ),
)


_TRIES_SOLUTION = """
def tries_needed(inlier_share, sample, confidence):
    # solve (1 - w^s)^n = 1 - p for n, and round up
    return int(np.ceil(np.log(1 - confidence) / np.log(1 - inlier_share**sample)))
"""

_FIT_SOLUTION = """
def fit_plane(points):
    # the plane goes through the mean
    middle = points.mean(axis=0)
    # the scatter about the mean
    scatter = (points - middle).T @ (points - middle)
    # the direction in which the points spread least
    values, vectors = np.linalg.eigh(scatter)
    normal = vectors[:, 0]
    # n · mean + d = 0
    return np.append(normal, -normal @ middle)
"""

_FIND_SOLUTION = """
def find_plane(points, threshold):
    rng = np.random.default_rng(0)
    a, b, c = points[[rng.choice(len(points), 3, replace=False) for _ in range(800)]].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    best = np.zeros(len(points), bool)
    for normal, offset in zip(normals, np.sum(normals * a, axis=1), strict=True):
        inliers = np.abs(points @ normal - offset) <= threshold
        if inliers.sum() > best.sum():
            best = inliers
    for _ in range(4):
        middle = points[best].mean(axis=0)
        normal = np.linalg.eigh((points[best] - middle).T @ (points[best] - middle))[1][:, 0]
        best = np.abs((points - middle) @ normal) <= threshold
    return np.append(normal, -normal @ middle)
"""


FORMS = (
    (
        Task(
            id="06-1",
            title="how often to try",
            points=1,
            version=2,
            kind="fill",
            signature="def tries_needed(inlier_share, sample, confidence)",
            cases=_tries_cases,
            judge=lambda case, answer: judge_number(answer, case.truth, 0.1, "tries", "the number of tries"),
            misconceptions=TRIES_MISTAKES,
            where="lesson 06, section 3 (many points agree, the others do not matter)",
        ),
        _TRIES_SOLUTION,
    ),
    (
        Task(
            id="06-2",
            title="fit a plane",
            points=3,
            version=2,
            kind="write",
            signature="def fit_plane(points)",
            cases=_fit_cases,
            judge=_judge_fit,
            anatomy=lambda case, answer: which_part(answer, case.truth, case.given["points"].mean(axis=0)),
            misconceptions=FIT_MISTAKES,
            where="lesson 06, section 1 (the plane that fits best); least squares in z: section 2",
        ),
        _FIT_SOLUTION,
    ),
    (
        Task(
            id="06-5",
            title="find a plane that few points belong to",
            points=4,
            version=2,
            kind="open",
            signature="def find_plane(points, threshold)",
            cases=lambda rng: [cluttered(rng)],
            judge=judge_find,
            anatomy=what_was_found,
            misconceptions=FIND_MISTAKES,
            guess=guess_plane,
            where="lesson 06, section 3 (many points agree, the others do not matter)",
        ),
        _FIND_SOLUTION,
    ),
)
