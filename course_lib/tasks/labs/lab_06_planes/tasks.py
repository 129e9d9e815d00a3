"""Lab 06: how often to try, fitting a plane, heights above a floor, and finding the floor of a furnished room.

A plane is four numbers, n and d of n · x + d = 0. Its sign is free: (n, d) and (-n, -d) are one plane. Truth is found
another way than the lab asks for: counting for logarithms, singular values for eigenvectors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from course_lib.camera import pinhole
from course_lib.cloud import floors
from course_lib.tasks.core import Case, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_number, refuse
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_06_planes.find_mistakes import FIND_MISTAKES
from course_lib.tasks.labs.lab_06_planes.fit_mistakes import FIT_MISTAKES
from course_lib.tasks.labs.lab_06_planes.furnished_floor import furnished, guess_plane, judge_find, what_was_found
from course_lib.tasks.labs.lab_06_planes.mistakes import CAUSE_OF, CAUSES, HEIGHT_MISTAKES, WHICH_MISTAKES
from course_lib.tasks.labs.lab_06_planes.plane_answers import apart, plane_problem, turned, which_part
from course_lib.tasks.labs.lab_06_planes.tries_mistakes import TRIES_MISTAKES
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import measured

# ------------------------------------------------------------------------------------------------------------ 1 tries


def _count_tries(good: float, p: float) -> int:
    """The fewest samples of which one is good with probability p, by counting; 0 where rounding could decide."""
    bad, tries = 1.0, 0
    while bad > 1 - p:
        bad, tries = bad * (1 - good), tries + 1
    close = min(abs(bad - (1 - p)), abs(bad / (1 - good) - (1 - p))) < 1e-9
    return 0 if close else tries


def _chance(shares: Sequence[float], sample: int) -> float:
    """How likely a sample lies on one of the planes."""
    good = 0.0
    for share in shares:
        on_it = 1.0
        for _ in range(sample):
            on_it *= share
        good += on_it
    return good


def _tries_cases(rng: np.random.Generator) -> list[Case]:
    """The lesson's plane, and several planes, in which no two mistakes agree."""
    asked: list[tuple[tuple[float, ...], int, float, str]] = [
        ((0.6,), 3, 0.99, "one plane, with the numbers of the lesson"),
        ((0.45, 0.4), 3, 0.99, "two planes"),  # 27.3 before rounding
        ((0.35, 0.25, 0.2), 2, 0.999, "three lines, two points a sample"),  # 27.1
    ]
    while len(asked) < 5:
        many = len(asked) == 4
        low, high = (0.4, 0.26, 0.1), (0.46, 0.32, 0.14)
        if many:
            low, high = (0.19, 0.15, 0.1, 0.06), (0.22, 0.18, 0.14, 0.09)
        shares = tuple(float(w) for w in (64 * rng.uniform(low, high)).round() / 64)  # 16-bit floats hold 64ths
        sample, p = (4, 0.9) if many else (3, 0.98)  # always more than 255 tries, and fewer
        if _count_tries(_chance(shares, sample), p):
            asked.append((shares, sample, p, "four planes, four points a sample" if many else "three planes"))
    return [
        Case(
            {"shares": np.array(shares), "sample": sample, "confidence": p},
            {"truth": _count_tries(_chance(shares, sample), p)},
            name,
        )
        for shares, sample, p, name in asked
    ]


def _judge_tries(case: Case, answer: Plain) -> Verdict:
    """A whole try off is wrong, as is any more: so a card speaks of the first wrong case, which is done by hand."""
    verdict = judge_number(answer, case.truth, 0.1, "tries", "the number of tries")
    return replace(verdict, error=min(verdict.error, 1.0)) if np.isfinite(verdict.error) else verdict


# -------------------------------------------------------------------------------------------------------------- 2 fit

_TRIES = 100  # until eig puts the smallest eigenvalues of two boards in different places
_PLANE_TOLERANCE = 2e-4  # metres, at the points and beside them


def _by_singular_values(points: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """(4,) plane of the least squared distances in units of sigma, by singular values."""
    middle = (points / sigma[:, None] ** 2).sum(axis=0) / (1 / sigma**2).sum()
    normal = np.linalg.svd((points - middle) / sigma[:, None], full_matrices=False)[2][2]
    return np.append(normal, -normal @ middle)


def _board_case(
    rng: np.random.Generator,
    tilt: float,
    size: tuple[float, float],
    middle: tuple[float, float, float],
    noise: tuple[float, float],
    name: str,
) -> Case:
    """A board of which a third, at one end, is measured with the second noise, its other points with the first."""
    flat = np.column_stack([rng.uniform(-0.5, 0.5, (120, 2)) * size, np.zeros(120)])
    flat[:3, :2] = np.array([[-0.08, 0.03], [0.09, 0.05], [0.01, -0.07]]) * size  # three close together
    sigma = np.where(flat[:, 0] > size[0] / 6, noise[1], noise[0]) * rng.uniform(0.7, 1.4, 120)
    noisy = flat @ turned(rng, tilt, np.array([1.0, 0.4, 0.0])).T + sigma[:, None] * rng.normal(0, 1, flat.shape)
    return _fit_case(noisy + np.asarray(middle) + rng.uniform(-0.05, 0.05, 3), sigma, name)


def _fit_case(points: np.ndarray, sigma: np.ndarray, name: str) -> Case:
    plane = _by_singular_values(points, sigma)
    far = points[np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[-12:]]
    around = np.concatenate([far, far + 0.3 * plane[:3], far - 0.3 * plane[:3]])
    return Case({"points": points, "sigma": sigma}, {"truth": plane, "around": around}, name)


def _weighted_mean(case: Case) -> np.ndarray:
    """(3,) the point that a case's best plane goes through."""
    points, sigma = case.given["points"], case.given["sigma"]
    return (points / sigma[:, None] ** 2).sum(axis=0) / (1 / sigma**2).sum()


def _smallest_of_eig(case: Case) -> int:
    """Where np.linalg.eig, which sorts nothing, puts the smallest eigenvalue of a board."""
    scatter = np.cov(case.given["points"].T, aweights=1 / case.given["sigma"] ** 2)
    return int(np.argmin(np.linalg.eig(scatter)[0]))


def _fit_cases(rng: np.random.Generator) -> list[Case]:
    """A wall read twice and three boards, of which two have their smallest eigenvalue in different places for eig."""
    wall = np.array([[x, y, z] for z in (2.0, 2.1) for x in (0, 2) for y in (0, 1.0)])
    twice = _fit_case(wall, np.repeat([0.01, 0.02], 4), "a wall read twice, to do in your head")
    tilted = _board_case(rng, 20, (1.0, 0.6), (0.2, -0.1, 2.0), (0.005, 0.04), "a board with a shiny third")
    for _ in range(_TRIES):
        edge_on = _board_case(rng, 84, (1.2, 0.7), (-0.4, 0.3, 1.5), (0.015, 0.05), "a board seen almost edge on")
        if _smallest_of_eig(edge_on) != _smallest_of_eig(tilted):
            break
    aside = _board_case(rng, 50, (0.9, 0.5), (9.0, -6.0, 18.0), (0.01, 0.03), "a board far to one side")
    return [twice, tilted, edge_on, aside]


def _judge_fit(case: Case, answer: Plain) -> Verdict:
    problem = plane_problem(answer, "the plane")
    if problem:
        return refuse(problem, _PLANE_TOLERANCE, "m")
    off = apart(answer, case.truth, case.hidden["around"])
    return measured(off, _PLANE_TOLERANCE, "m", "the plane", "around the points")


# ----------------------------------------------------------------------------------------------------------- 3 heights

_HEIGHT_TOLERANCE = 2e-5  # metres: 16-bit floats are off by more
_FRAMES = (2, 3, 10)  # of realsense_planes: a box on a floor, from a camera that was held level
_STEP = 6  # every so many rows and columns


@lru_cache(maxsize=8)
def _real_floor(load: Callable[[str], Any], number: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) of a real frame and its floor's plane (4,), normal of length 1, positive above the floor."""
    frame = load("realsense_planes").frames[number]
    points = pinhole.deproject(frame.depth, frame.camera, dtype=np.float64)[::_STEP, ::_STEP].reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    floor = floors.find_floor(points, 0.01, up=(0, -1, 0), most_degrees=30)
    plane = np.append(floor.normal, floor.offset)
    return points, plane * np.sign(plane[3])


def _height_case(points: np.ndarray, plane: np.ndarray, name: str) -> Case:
    normal, d = plane[:3], plane[3]
    length, side = float(np.sqrt((normal**2).sum())), 1.0 if d > 0 else -1.0
    truth = np.array([side * (sum(n * x for n, x in zip(normal, point, strict=True)) + d) / length for point in points])
    return Case({"points": points, "plane": plane}, {"truth": truth}, name)


def _height_cases(rng: np.random.Generator, load: Callable[[str], Any] | None) -> list[Case]:
    head = np.array([[0, 0, 5], [0, 2, 5], [1, 1.5, 3], [0, 2.25, 1.0]])
    below = np.array([[0, 0, 2], [0.3, 0.2, 1.5], [-0.5, 0.4, 0.8], [1, -1, 2.125]])
    pit = np.array([[0, 1.9, 3], [0, 3, 3], [1, 2.7, 4], [0.5, 2.9, 2]])
    hung = np.array([[0, 0, 5], [0, -2, 5], [1, -1.5, 3], [0, -2.25, 1]])
    cases = [
        _height_case(head, np.array([0, 2.0, 0, -4.0]), "a floor two metres below the camera, to do in your head"),
        _height_case(below, np.array([0, 0, 3.0, -6.0]), "a camera that looks straight down"),
        _height_case(pit, np.array([0, 2.0, 0, -4.0]), "a pit: most of it is below the floor"),
        _height_case(hung, np.array([0, 2.0, 0, 4.0]), "a camera that hangs upside down"),
    ]
    for i, number in enumerate(_FRAMES if load is not None else ()):
        points, plane = _real_floor(load, number)
        height = points @ plane[:3] + plane[3]
        some = np.concatenate(
            [
                rng.choice(np.flatnonzero(height < -0.004), 10),
                rng.choice(np.flatnonzero(np.abs(height) < 0.004), 30),
                rng.choice(np.flatnonzero(height > 0.1), 40),
            ]
        )
        scale = float(rng.uniform(2.0, 4.0)) * (-1.0 if i % 2 else 1.0)
        cases.append(_height_case(points[some], scale * plane, f"a real floor, frame {number}"))
    return cases


# ---------------------------------------------------------------------------------------------------------------- all

_LIBRARY = (
    "course_lib.cloud.planes.fit_plane",
    "course_lib.cloud.planes.find_plane",
    "course_lib.cloud.planes.find_planes",
)

TASKS = (
    Task(
        id="06-1",
        title="how often to try among several planes",
        points=1,
        version=4,
        kind="fill",
        signature="def tries_needed(shares, sample, confidence)",
        cases=_tries_cases,
        judge=_judge_tries,
        misconceptions=TRIES_MISTAKES,
        hides=("course_lib.cloud.planes.iterations_needed",),
        where="lesson 06, section 3 (many points agree, the others do not matter)",
    ),
    Task(
        id="06-2",
        title="fit a plane to points of unequal noise",
        points=3,
        version=3,
        kind="write",
        signature="def fit_plane(points, sigma)",
        cases=_fit_cases,
        judge=_judge_fit,
        anatomy=lambda case, answer: which_part(answer, case.truth, _weighted_mean(case)),
        misconceptions=FIT_MISTAKES,
        hides=_LIBRARY,
        where="lesson 06, section 1 (the plane that fits best)",
    ),
    Task(
        id="06-3",
        title="mend heights above a real floor",
        points=3,
        version=4,
        kind="mend",
        signature="def heights_above_floor(points, plane)",
        cases=_height_cases,
        judge=lambda case, answer: judge_array(answer, case.truth, _HEIGHT_TOLERANCE, "m", what="the heights"),
        misconceptions=HEIGHT_MISTAKES,
        hides=("course_lib.cloud.floors.heights_above", "course_lib.cloud.floors.remove_floor"),
        data=("realsense_planes",),
        where="lesson 06, section 1 (the plane that fits best), for distances and their sign, and section 4",
    ),
    which_cause(
        "06-4",
        "which mistake made this",
        CAUSE_OF,
        "the six planes above",
        WHICH_MISTAKES,
        "lesson 06, section 2 (what the eigenvalues say, and what least squares in z says)",
        causes=CAUSES,
    ),
    Task(
        id="06-5",
        title="find the floor of a furnished room",
        points=4,
        version=4,
        kind="open",
        signature="def find_plane(points, up, threshold)",
        cases=lambda rng: [furnished(rng)],
        judge=judge_find,
        anatomy=what_was_found,
        misconceptions=FIND_MISTAKES,
        hides=_LIBRARY,
        guess=guess_plane,
        where="lesson 06, sections 3 and 4: section 4 (several planes, and a room without its floor)",
    ),
    in_words(
        "06-6",
        "explain the better fit",
        (
            "0: agrees that more inliers are better, or blames the random samples or the seed.",
            "1: says that with the larger threshold points of the posters count as the wall's and tilt or shift it; or "
            "names what exposes it.",
            "2: both: points of something else were let in, so the plane leans or lies between; and the residuals "
            "expose it: their RMS is clearly more than the noise, or their histogram fills the band or has two humps.",
        ),
        "lesson 06, Break it (more inliers, worse plane)",
    ),
)
