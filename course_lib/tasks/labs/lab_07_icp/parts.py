"""Which part of an answer of lab 07 is wrong, where no registered mistake fits: of one step, of a registration."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from course_lib.geometry.transforms import exp
from course_lib.tasks.core import Case
from course_lib.tasks.judges import quantity, rotation_degrees
from course_lib.tasks.plain import Plain

Found = tuple[str, str]

# ----------------------------------------------------------------------------------------------------- 3 one step


def parts_of_step(case: Case, answer: Plain) -> Found | None:
    """T or the fitness, or both; what gives both of them is named first."""
    T, fitness = np.asarray(answer["T"], dtype=float), float(np.asarray(answer["fitness"]).item())
    turned = rotation_degrees(T[:3, :3], case.truth["T"][:3, :3])
    shifted = float(np.linalg.norm(T[:3, 3] - case.truth["T"][:3, 3]))
    right_T, right_fitness = turned < 0.01 and shifted < 1e-4, abs(fitness - case.truth["fitness"]) < 1e-3
    if right_T:
        words = _of_fitness(case, fitness) or "it comes in after the pairs, so look at the last line only."
        return "only the fitness", f"T is right, and so are the pairs; only the fitness is wrong: {words}"
    words = _of_T(case, T) or (
        f"its rotation is off by {turned:.1f}°, and its shift may only follow from that."
        if turned >= 0.01
        else f"its rotation is right, its shift is off by {quantity(shifted, 'm')}."
    )
    if right_fitness:
        return "only T", f"The fitness is right, and so are the pairs kept; T is wrong: {words}"
    known, more = _of_T(case, T), _of_fitness(case, fitness)
    if known:
        more = more or "it is no share of the source points that were kept."
        return "two mistakes", f"The pairs are right; T and the fitness are not. T: {known} The fitness: {more}"
    if more and fitness != 1:
        return "two mistakes", f"Two separate mistakes, one in T and one in the fitness. T: {words} The fitness: {more}"
    return "T and the fitness", (
        "T and the fitness are both wrong: one mistake in what both come from (moved, distances, `keep`), or two "
        "separate ones, one in T and one in the fitness. "
        f"T: {words}{f' The fitness: {more}' if more else ''}"
    )


def _of_fitness(case: Case, fitness: float) -> str:
    """What a fitness counts, where that can be told."""
    count = case.truth["fitness"] * len(case.given["source"])
    for value, words in (
        (1.0, "it is 1 here: are pairs divided by pairs, or all counted?"),
        (count, "it is the number of pairs, not their share."),
        (count / len(case.given["target"]), "it divides by the target's points."),
        (count / (len(case.given["source"]) + len(case.given["target"])), "it divides by the points of both clouds."),
        (100 * case.truth["fitness"], "it is in percent."),
        (round(case.truth["fitness"], 1), "it was rounded."),
        (round(case.truth["fitness"], 2), "it was rounded."),
    ):
        if abs(fitness - value) < 1e-6:
            return words
    return ""


def _of_T(case: Case, T: np.ndarray) -> str:
    """What a T is made of, where that can be told."""
    before = case.given["T"]
    step = case.truth["T"] @ np.linalg.inv(before)
    other_way = _turned_back(case, step)
    for value, words in (
        (before @ step, "T @ step applies the step first; it stands leftmost."),
        (step, "it is the step alone, without the motion so far."),
        (before, "it is still the T that came in."),
        (case.truth["T"] @ before, "the step was fitted to the source as given, and put onto T again."),
        (np.linalg.inv(step) @ before, "the step goes the wrong way, as its inverse does."),
        (other_way @ before, f"{_TRANSPOSED}."),
        (before @ other_way, f"{_TRANSPOSED}, and step stands left of T."),
    ):
        if np.abs(T - value).max() < 1e-4:
            return words
    return ""


_TRANSPOSED = "the step's rotation is transposed: (U G Vᵀ)ᵀ = V G Uᵀ was right as given, so put `.T` back"


def _turned_back(case: Case, step: np.ndarray) -> np.ndarray:
    """The step with its rotation transposed, and the shift that follows from it."""
    moved = _moved(case.given["T"], case.given["source"])
    kept = moved[cKDTree(case.given["target"]).query(moved)[0] <= case.given["radius"]]
    T = np.eye(4)
    T[:3, :3] = step[:3, :3].T
    T[:3, 3] = _moved(step, kept.mean(axis=0)) - T[:3, :3] @ kept.mean(axis=0)
    return T


# ------------------------------------------------------------------------------------------------- 5 two scans

_HOME, _NEAR, _STILL, _CREEPS = 0.012, 0.15, 0.003, 0.014
"""Over the surface, metres where the ground is 1.5 m by 2 m: home; steps can still come home; a step rests, or creeps."""
_TRY_ONE = (
    "Try your step by itself on a floor that lies 10 cm too high (q on z = 0, n up): it must be −10 cm in z and no "
    "turn, or a sign or a half of x is wrong. Then turn a bumpy target by 5°: the step must turn it back, or look at "
    "p × n, and at degrees for turn(). Then two steps: the second starts from what the first has moved, and stands "
    "leftmost."
)


def parts_of_registration(case: Case, answer: Plain) -> Found | None:
    """Which building block of a registration failed, read off where it came to rest."""
    T, truth, surface = np.asarray(answer, dtype=float), case.truth, case.hidden["surface"]
    start = case.given.get("start", np.eye(4))

    size = case.hidden.get("size", 1.0)

    def apart(one: np.ndarray, other: np.ndarray) -> float:
        return float(np.linalg.norm(_moved(one, surface) - _moved(other, surface), axis=1).mean()) / size

    off, before, needed = apart(T, truth), apart(start, truth), rotation_degrees(start[:3, :3], truth[:3, :3])
    turned = rotation_degrees(start[:3, :3], T[:3, :3])
    if apart(T, start) < 0.1 * before:
        return "nothing moved", (
            "The source stays where it was. Is T ever replaced by step @ T? Is anything kept: does the radius begin as "
            "large as the scans are apart, and do you look from where T has moved the source?"
        )
    if apart(np.linalg.inv(T), truth) < 0.05:
        return "the inverse", "The inverse of what is asked came back: the source is what moves, to the target."
    if apart(T @ start, truth) < 0.05:
        return "start left out", "It is the correction of the start alone: T begins as start, and steps go onto it."
    if turned < 0.5 or (turned < 0.4 * needed and off < 0.95 * before):
        return "hardly turned", (
            f"The source is turned by {turned:.1f}° only, of {needed:.0f}°. Does the turn get into the step, and does "
            "turn() get degrees, np.degrees(np.linalg.norm(w))?"
        )
    if _axes_match(case.given["source"], case.given["target"], T):
        return "principal axes", (
            "The clouds' own axes lie on each other. But the scans overlap in part, so their axes differ, and an axis "
            "has no sign: look for closest points instead."
        )
    return _where_it_rests(case, T, off, before, apart)


def _where_it_rests(
    case: Case, T: np.ndarray, off: float, before: float, apart: Callable[[np.ndarray, np.ndarray], float]
) -> Found:
    """What a right step would do from where an answer ended says what was missing."""
    scale = case.hidden.get("size", 1.0)
    size, begun = quantity(scale * off, "m"), quantity(scale * before, "m")
    if 0.95 * before < off < 1.15 * before:
        return "hardly nearer", (
            f"It ends {size} from home, and began {begun} from it. Is anything kept at first: does the "
            "radius begin as large as the scans are apart? And is each step put onto T, so that the next goes on?"
        )
    if off > before:
        return "farther than before", (
            f"It ends {size} from home, and began {begun} from it: steps go astray. {_TRY_ONE}"
        )
    (all_points, all_planes), (points, planes) = (
        [apart(T, _stepped(case, T, radius, to_planes)) for to_planes in (False, True)] for radius in (np.inf, 0.1 * scale)
    )
    if min(all_points, all_planes) < _STILL:
        return "all pairs pull", (
            f"It ends {size} from home, where a step that keeps every pair rests: what stands above the ground, and "
            "what one scan alone saw, pull. The radius must shrink, to a few spacings at the end."
        )
    if off < _NEAR and apart(_refined(case, T), case.truth) < _HOME:
        return "not yet at the end", (
            f"It ends {size} from home; more steps to planes from there, while the radius shrinks to a few spacings, "
            "would arrive. So: more steps, a smaller last radius, or planes for points."
        )
    if points < _CREEPS and planes > 10 * points:
        return "points hold each other", (
            f"It ends {size} from home. Of points within {quantity(0.1 * scale, 'm')}, a step to points hardly moves them "
            f"from there, {quantity(scale * points, 'm')}, and a step to planes does, {quantity(scale * planes, 'm')}: "
            "measure to planes."
        )
    return "no place to rest", (
        f"It ends {size} from home, and a right step would move on from there: were there enough steps, is return "
        f"outside the loops, does T go on from the last step? {_TRY_ONE}"
    )


def _moved(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ T[:3, :3].T + T[:3, 3]


def _stepped(case: Case, T: np.ndarray, radius: float, to_planes: bool) -> np.ndarray:
    """T after one step; far away where too few pairs are left."""
    p = _moved(T, case.given["source"])
    distance, index = cKDTree(case.given["target"]).query(p)
    keep = distance <= radius
    p, q, n = p[keep], case.given["target"][index[keep]], case.given["normals"][index[keep]]
    step = np.eye(4)
    if len(p) < 30:
        step[:3, 3] = 1e6
    elif to_planes:
        x = np.linalg.lstsq(np.hstack([np.cross(p, n), n]), np.sum(n * (q - p), axis=1), rcond=None)[0]
        step = exp(np.r_[0, 0, 0, x[:3]])
        step[:3, 3] = x[3:]
    else:
        U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
        step[:3, :3] = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T
        step[:3, 3] = q.mean(axis=0) - step[:3, :3] @ p.mean(axis=0)
    return step @ T


def _refined(case: Case, T: np.ndarray) -> np.ndarray:
    """Where steps to planes with a shrinking radius lead from T."""
    for radius in case.hidden.get("size", 1.0) * np.geomspace(0.3, 0.08, 20):
        T = _stepped(case, T, radius, True)
    return T


def _axes_match(source: np.ndarray, target: np.ndarray, T: np.ndarray) -> bool:
    """Whether T lays mean on mean and principal axes on principal axes, whatever their signs."""
    if np.linalg.norm(_moved(T, source).mean(axis=0) - target.mean(axis=0)) > 1e-6:
        return False
    axes = [np.linalg.eigh(np.cov(points.T))[1] for points in (source, target)]
    return bool(np.abs(np.abs(axes[1].T @ T[:3, :3] @ axes[0]) - np.eye(3)).max() < 1e-6)
