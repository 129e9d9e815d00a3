"""Task 5 of lab 06: the floor of a furnished room, which few points belong to and other planes outnumber.

Five or six planes are larger than the floor, one is smaller and lower: no fixed number of planes finds it everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Verdict
from course_lib.tasks.judges import judge_band, refuse
from course_lib.tasks.labs.lab_06_planes.plane_answers import apart, plane_problem, turned, which_part
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import quantity

_THRESHOLD, _NOISE = 0.015, 0.005  # metres
_FIND_BANDS = ((0.005, 1.0), (0.01, 0.75), (0.025, 0.5), (0.06, 0.25))  # metres, at the rim of the floor
_CAMERA_HEIGHT = 1.4  # metres
_POINTS, _FLOOR = 2200, 235  # one point in ten, and some more
_HIGHER = {"the table's top": 0.74, "the seat of a couch": 0.42, "the shelf's top": 1.25}  # metres above the floor
_UPRIGHT = {"the back wall": (1, 1.0), "the side wall": (0, 1.3), "a cupboard's front": (0, -0.75)}  # axis, metres
_LEAST = 0.1  # the share of the points that surely lie on the floor
_SQUARE = np.cos(np.radians(20))  # level, seen from an up that is 5 degrees off


def furnished(rng: np.random.Generator) -> Case:
    """A floor, 2.4 x 1.8 m, five or six larger planes, things, and below it a reflection and strays."""
    parts = [
        _flat(rng, _FLOOR, (-1.2, 1.2), (-1.0, 0.8), 0.0),
        _flat(rng, 280, (-0.1, 1.1), (-0.3, 0.6), _HIGHER["the table's top"]),
        _flat(rng, 265, (-0.3, 1.2), (-1.0, -0.4), _HIGHER["the seat of a couch"]),
        _upright(rng, 340, (-1.3, 1.3), "the back wall"),
        _upright(rng, 285, (-1.0, 1.0), "the side wall"),
        _upright(rng, 260, (-0.9, 0.4), "a cupboard's front"),
        _flat(rng, 95, (0.3, 0.9), (-0.1, 0.4), -0.6),  # a stool's seat, in the floor as in a mirror
        rng.uniform((-1.2, -0.9, -0.7), (1.2, 0.9, -0.05), (30, 3)),
    ]
    higher = dict(_HIGHER)
    if rng.uniform() < 0.5:
        parts.append(_flat(rng, 255, (-1.2, -0.4), (0.5, 1.0), _HIGHER["the shelf's top"]))
    else:
        del higher["the shelf's top"]
    parts.append(rng.uniform((-1.2, -0.9, 0.02), (1.2, 0.9, 1.6), (_POINTS - sum(map(len, parts)), 3)))
    R = turned(rng, float(rng.uniform(20, 160)), np.array([1.0, rng.uniform(-1, 1), 0.0]))
    tilt, way = np.radians(rng.uniform(3, 5)), rng.uniform(0, 2 * np.pi)
    up = R @ np.array([np.sin(tilt) * np.cos(way), np.sin(tilt) * np.sin(way), np.cos(tilt)])
    at = -_CAMERA_HEIGHT * R[:, 2]
    points = rng.permutation(np.concatenate(parts)) @ R.T + at
    around = np.radians(np.arange(0, 360, 15))
    rim = np.column_stack([np.cos(around), 0.9 * np.sin(around), np.zeros(len(around))]) @ R.T + at
    on = {name: (2, height) for name, height in higher.items()} | _UPRIGHT
    surfaces = {name: np.append(R[:, axis], -R[:, axis] @ at - where) for name, (axis, where) in on.items()}
    truth = np.append(R[:, 2], -R[:, 2] @ at)
    given = {"points": points, "up": up, "threshold": _THRESHOLD}
    return Case(given, {"truth": truth, "around": rim, "surfaces": surfaces}, "a furnished room")


def _upright(rng: np.random.Generator, count: int, along: tuple[float, float], name: str) -> np.ndarray:
    """(count, 3) points of a noisy upright rectangle, from near the floor to 1.9 m."""
    axis, where = _UPRIGHT[name]
    flat = _flat(rng, count, along, (0.1, 1.9), where)
    return flat[:, [2, 0, 1]] if axis == 0 else flat[:, [0, 2, 1]]


def _flat(
    rng: np.random.Generator, count: int, x: tuple[float, float], y: tuple[float, float], height: float
) -> np.ndarray:
    """(count, 3) points of a noisy level rectangle."""
    spread = rng.uniform((x[0], y[0]), (x[1], y[1]), (count, 2))
    return np.column_stack([spread, height + rng.normal(0, _NOISE, count)])


def judge_find(case: Case, answer: Plain) -> Verdict:
    problem = plane_problem(answer, "the plane")
    if problem:
        return refuse(problem, _FIND_BANDS[0][0], "m")
    off = apart(answer, case.truth, case.hidden["around"])
    verdict = judge_band(off, _FIND_BANDS, "m", what="the error at the floor's rim")
    return replace(verdict, message=f"{verdict.message} {_why_off(case, answer, verdict.score)}".rstrip())


def _signed(case: Case, plane: Plain) -> np.ndarray:
    """(N,) distances of a case's points from a plane, metres."""
    return case.given["points"] @ np.asarray(plane)[:3] + np.asarray(plane)[3]


def _near(case: Case, plane: Plain) -> int:
    """How many points of a case lie within the threshold of a plane."""
    return int(np.count_nonzero(np.abs(_signed(case, plane)) <= case.given["threshold"]))


def _why_off(case: Case, answer: Plain, score: float) -> str:
    """What the points say of a plane that is not the best one, in a sentence or two."""
    if score == 1:
        return ""
    if score >= 0.25:
        return "A plane through three noisy points leans: fit to its inliers, collect these again, and fit again."
    near, every = _near(case, answer), len(case.given["points"])
    least = int(_LEAST * every)
    if near < least and abs(np.asarray(answer)[:3] @ case.given["up"]) > _SQUARE:
        return (
            f"Only {near} of {every:,} points are on your plane; the floor has at least {least}. Ask for that many "
            "before you take the lowest."
        )
    true = _near(case, case.truth)
    return f"{near:,} points lie within the threshold of your plane; {true:,} lie within that of the true floor."


def what_was_found(case: Case, answer: Plain) -> tuple[str, str]:
    """Which surface was taken for the floor; where it is none, what in the search leads there."""
    taken = _surface(case, answer)
    if taken in _HIGHER:
        return "a higher level plane", f"That is {taken}: level, but another level plane lies lower."
    if taken in _UPRIGHT:
        return "an upright plane", f"That is {taken}: many points agree, but it is upright; compare its normal with up."
    plane, true = np.asarray(answer, dtype=np.float64), np.asarray(case.truth)
    plane = plane if plane[:3] @ true[:3] >= 0 else -plane
    middle = case.hidden["around"].mean(axis=0)
    lean, height = float(np.degrees(np.arccos(min(1.0, plane[:3] @ true[:3])))), -float(plane[:3] @ middle + plane[3])
    if lean > 45:
        return "not level", (
            f"It is {lean:.0f}° from level, and no wall. Is the normal of each sample compared with up, and in the "
            "last fit the eigenvector of the smallest eigenvalue taken?"
        )
    if abs(height) < 0.06:
        return which_part(answer, case.truth, middle, case.given["threshold"])
    where = f"It runs {quantity(abs(height), 'm')} {'above' if height > 0 else 'below'} the floor, where no surface is."
    if height < 0 and lean < 12 and _near(case, answer) < _LEAST * len(case.given["points"]):
        return "too little support", (
            f"{where[:-1]}, only a reflection or single points. Stop when less than one point in ten lies on the "
            "next plane, and take the lowest of those before."
        )
    if height < 0:
        return "below the floor", (
            f"{where} Must points enough agree before the lowest is taken? Has the distance lost its sign before you "
            "count? Is d minus the product of normal and mean?"
        )
    return "above the floor", (
        f"{where} Are there samples enough, and planes? Is the normal of length 1, and the distance without "
        "its sign, before you count? Is the lowest kept, and the last fit made to its inliers? Heights grow along up."
    )


def _surface(case: Case, answer: Plain) -> str:
    """The name of the surface, not the floor, that a plane is near to: 3 degrees and 30 mm; "" if none."""
    plane = np.asarray(answer, dtype=np.float64)
    for name, surface in case.hidden["surfaces"].items():
        on = case.given["points"][np.abs(_signed(case, surface)) <= case.given["threshold"]]
        leans = np.linalg.norm(np.cross(plane[:3], surface[:3]))
        if leans < np.sin(np.radians(3)) and np.median(np.abs(on @ plane[:3] + plane[3])) < 0.03:
            return str(name)
    return ""


def guess_plane(rng: np.random.Generator) -> Callable[[np.ndarray, np.ndarray, float], np.ndarray]:
    """A function that says a plane about square to up, at a height drawn from those of the lower half of the points."""
    lean, share = rng.normal(0, np.radians(4), 3), rng.uniform(0, 0.5)

    def guessed(points: np.ndarray, up: np.ndarray, threshold: float) -> np.ndarray:
        normal = (up + lean) / np.linalg.norm(up + lean)
        return np.append(normal, -np.quantile(points @ normal, share))

    return guessed
