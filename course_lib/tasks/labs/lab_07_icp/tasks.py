"""Lab 07: rigid motions from pairs, one step of ICP, and a registration with strays and partial overlap.

`T_target_source` maps source coordinates to target coordinates. Truth is known because each case moves a cloud by a
transform drawn at random; what a step of ICP must give is computed here by Horn's quaternions, not by an SVD.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from course_lib.geometry.transforms import apply, compose, invert, rotation_z
from course_lib.tasks.core import Case, Judge, Task, Verdict
from course_lib.tasks.judges import judge_band, judge_number, judge_transform, refuse, worst_of
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_07_icp.mistakes import FIT_MISTAKES
from course_lib.tasks.labs.lab_07_icp.parts import parts_of_registration, parts_of_step
from course_lib.tasks.labs.lab_07_icp.scan_mistakes import CAUSE_OF, CAUSES, OPEN_MISTAKES, WHICH_MISTAKES
from course_lib.tasks.labs.lab_07_icp.step_mistakes import MEND_MISTAKES
from course_lib.tasks.labs.lab_07_icp.total_mistakes import TOTAL_MISTAKES
from course_lib.tasks.labs.lab_07_icp.two_scans import bumps, motion, two_scans
from course_lib.tasks.plain import Plain, describe

_DEGREES, _METRES = 0.01, 1e-4
_EXACT_DEGREES, _EXACT_METRES = 1e-3, 1e-5
"""Of a fit in closed form: so fine that a pair left out shows among forty, and numbers of 16 bits among a hundred."""


def judge_T(case: Case, answer: Plain, degrees: float = _DEGREES, metres: float = _METRES) -> Verdict:
    """A rigid motion against the true one, right or not."""
    return _all_or_nothing(judge_transform(answer, case.truth, degrees=degrees, metres=metres))


def _all_or_nothing(verdict: Verdict) -> Verdict:
    return replace(verdict, score=float(verdict.passed))


# ------------------------------------------------------------------------------------------------------ 1 all steps


def _total_cases(rng: np.random.Generator) -> list[Case]:
    quarter, ahead = rotation_z(np.pi / 2), np.eye(4)
    ahead[0, 3] = 1.0
    cases = []
    for steps, name in (
        ([ahead, quarter], "1 m along x, then a quarter turn: the origin ends at (0, 1, 0)"),
        ([motion(rng, rng.uniform(5, 40), rng.uniform(0.2, 1)) for _ in range(5)], "five steps"),
        ([motion(rng, 30, 0.5)], "a single step"),
    ):
        total = np.eye(4)
        for step in reversed(steps):
            total = total @ step
        cases.append(Case({"steps": np.array(steps)}, {"truth": total}, name))
    return cases


# -------------------------------------------------------------------------------------------------------- 2 the fit


def _marks(rng: np.random.Generator, source: np.ndarray, degrees: float, metres: float, name: str) -> Case:
    """Marks (N, 3) seen in two scans, the better the more they weigh."""
    weights = rng.uniform(0.2, 5, len(source))
    noise = rng.normal(0, 0.02, source.shape) / np.sqrt(weights)[:, None]
    return _weighted(source, apply(motion(rng, degrees, metres), source) + noise, weights, name)


def _weighted(source: np.ndarray, target: np.ndarray, weights: np.ndarray, name: str) -> Case:
    found = ~np.isnan(source + target).any(axis=1)
    truth = horn(source[found], target[found], weights[found])
    return Case({"source": source, "target": target, "weights": weights}, {"truth": truth}, name)


def _some_not_found(rng: np.random.Generator, case: Case) -> Case:
    """NaN in five rows of the source and in five others of the target."""
    source, target, weights = (case.given[name].copy() for name in ("source", "target", "weights"))
    lost = rng.choice(len(source), 10, replace=False)
    source[lost[:5]], target[lost[5:]] = np.nan, np.nan
    return _weighted(source, target, weights, case.name)


def _some_wrong(rng: np.random.Generator, case: Case) -> Case:
    """Six marks taken for others, and so of weight 0."""
    target, weights = case.given["target"].copy(), case.given["weights"].copy()
    wrong = rng.choice(len(target), 6, replace=False)
    target[wrong] += rng.uniform(0.5, 1.0, (6, 3))
    weights[wrong] = 0
    return _weighted(case.given["source"], target, weights, case.name)


def _is_mirrored(case: Case) -> bool:
    """Whether the SVD alone gives a reflection, and not by rounding: the weakest direction is decided by the noise."""
    p, q, w = (case.given[name] for name in ("source", "target", "weights"))
    p, q = p - w @ p / w.sum(), q - w @ q / w.sum()
    U, sizes, Vt = np.linalg.svd((p * w[:, None]).T @ q)
    return bool(np.linalg.det(Vt.T @ U.T) < 0 and sizes[2] > 1e-5 * sizes[0])


def _fit_cases(rng: np.random.Generator) -> list[Case]:
    solid, far = rng.normal(size=(60, 3)) * [0.5, 0.3, 0.2], rng.normal(size=(40, 3)) * 0.3 + [1.5, -2.0, 0.7]
    plane = np.c_[rng.uniform(-1, 1, (30, 2)), rng.normal(0, 0.005, 30)] + [0.3, 0.2, 1.0]
    degrees = rng.uniform(8, 25, 3)
    cases = [
        _marks(rng, solid, degrees[0], 0.3, "marks about the origin"),
        _some_not_found(rng, _marks(rng, far, degrees[1], 0.6, "marks two metres away, some not found")),
        _some_wrong(rng, _marks(rng, solid + [0.4, 0.8, 0], degrees[2], 0.3, "some wrong pairs, of weight 0")),
    ]
    while True:  # of clouds as flat as their noise, half need the guard: draw until this one does
        tilted = apply(motion(rng, 60, 0.0), plane)
        case = _marks(rng, tilted, rng.uniform(8, 25), 0.4, "marks on a wall, which is flat")
        if _is_mirrored(case):
            return [*cases, case]


# ------------------------------------------------------------------------------------------------------------ 3 mend


def horn(p: np.ndarray, q: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The rigid motion from p to q by the largest eigenvector of Horn's matrix of quaternions; weights (N,)."""
    mean_p, mean_q = (np.average(cloud, axis=0, weights=weights) for cloud in (p, q))
    S = (weights[:, None] * (p - mean_p)).T @ (q - mean_q)
    d = [S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]]
    N = np.empty((4, 4))
    N[0, 0], N[0, 1:], N[1:, 0] = np.trace(S), d, d
    N[1:, 1:] = S + S.T - np.trace(S) * np.eye(3)
    w, x, y, z = np.linalg.eigh(N)[1][:, -1]
    T = np.eye(4)
    T[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    T[:3, 3] = mean_q - T[:3, :3] @ mean_p
    return T


def _step_case(rng: np.random.Generator, radius: float, degrees: float, strays: int, name: str) -> Case:
    target = bumps(rng, 200)[0]
    source = np.vstack([bumps(rng, 120)[0], rng.uniform((0, 0, 1), (2, 2, 3), (strays, 3))])
    T = motion(rng, degrees, 0.25)
    return _stepped(apply(invert(compose(motion(rng, 4, 0.05), T)), source), target, T, radius, name)


def _stepped(source: np.ndarray, target: np.ndarray, T: np.ndarray, radius: float, name: str) -> Case:
    """What one step from T must give; the target's first and last points are partners, so that leaving one out shows."""
    moved = apply(T, source)
    near, keep = _partners(moved, target, radius)
    ends = np.unique(near[keep])[[0, -1]]
    target = np.vstack([target[ends[:1]], np.delete(target, ends, axis=0), target[ends[1:]]])
    near, keep = _partners(moved, target, radius)
    step = horn(moved[keep], target[near[keep]], np.ones(keep.sum()))
    truth = {"T": step @ T, "fitness": float(keep.mean())}
    return Case({"source": source, "target": target, "T": T, "radius": radius}, {"truth": truth}, name)


def _partners(moved: np.ndarray, target: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Of each point the nearest of the target, and whether it counts."""
    distances = np.linalg.norm(moved[:, None] - target[None], axis=2)
    return distances.argmin(axis=1), distances.min(axis=1) <= radius


@lru_cache(maxsize=4)
def _scans(load: Callable[[str], Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two raw scans of the bunny, (N, 3) and (M, 3) in metres, and the reference that maps the first to the second."""
    bunny = load("stanford_bunny")
    poses = bunny.reference["scan_poses"]
    source, target = (bunny.clouds[name].points.astype(np.float64) for name in ("bun045", "bun000"))
    return source, target, compose(invert(poses["bun000"]), poses["bun045"])


def _real_step_case(rng: np.random.Generator, load: Callable[[str], Any]) -> Case:
    source, target, reference = _scans(load)
    source, target = (rng.choice(points, count, replace=False) for points, count in ((source, 150), (target, 300)))
    there = np.eye(4)
    there[:3, 3] = apply(reference, source).mean(axis=0)
    off = compose(there, motion(rng, 4, 0.003), invert(there))
    return _stepped(source, target, compose(off, reference), 0.006, "two raw scans of the bunny")


def _step_cases(rng: np.random.Generator, load: Callable[[str], Any] | None) -> list[Case]:
    return [
        _step_case(rng, 0.2, rng.uniform(15, 30), 30, "strays above the surface"),
        _step_case(rng, 0.12, rng.uniform(15, 30), 10, "a small radius"),
        _step_case(rng, 0.3, rng.uniform(30, 45), 60, "a large turn so far, many strays"),
        *([] if load is None else [_real_step_case(rng, load)]),
    ]


def _judge_step(case: Case, answer: Plain) -> Verdict:
    if not isinstance(answer, dict) or set(answer) != {"T", "fitness"}:
        got = f"a dict with {sorted(map(str, answer))}"[:120] if isinstance(answer, dict) else describe(answer)
        missing = ": is the return missing?" if answer is None else "."
        return refuse(f'Expected a dict with the keys "T" and "fitness", got {got}{missing}', _DEGREES, "deg")
    return _all_or_nothing(
        worst_of(
            judge_transform(answer["T"], case.truth["T"], degrees=_EXACT_DEGREES, metres=_EXACT_METRES, what="T"),
            judge_number(answer["fitness"], case.truth["fitness"], 1e-3, "", "the fitness"),
        )
    )


# ------------------------------------------------------------------------------------------------------------ 5 open

_BANDS = ((0.014, 1.0), (0.018, 0.75), (0.025, 0.5), (0.045, 0.25))  # metres, mean over the source's ground


def _open_case(rng: np.random.Generator) -> Case:
    scans = two_scans(rng)
    return Case(
        {"source": scans.source, "target": scans.target, "normals": scans.normals, "start": scans.start},
        {"truth": scans.T_target_source, "surface": scans.surface},
        "two scans that share two thirds",
    )


def judge_scans(bands: Sequence[tuple[float, float]]) -> Judge:
    """A judge of a registration by how far it leaves the source's ground from its true place, in these bands."""

    def judge(case: Case, answer: Plain) -> Verdict:
        form = judge_transform(answer, case.truth, degrees=0.2, metres=0.01)
        if not np.isfinite(form.error):
            return replace(form, tolerance=bands[0][0], unit="m")
        surface, T = case.hidden["surface"], np.asarray(answer, dtype=float)

        def off(motion: np.ndarray) -> float:
            return float(np.linalg.norm(apply(motion, surface) - apply(case.truth, surface), axis=1).mean())

        verdict = judge_band(off(T), bands, "m", what="the mean error over the ground")
        still = np.abs(T - case.given.get("start", np.eye(4))).max() < 1e-3
        return replace(verdict, message=verdict.message + _more_of_scans(T, still, verdict.score, off, bands[-1][0]))

    return judge


def _more_of_scans(
    T: np.ndarray, still: bool, score: float, off: Callable[[np.ndarray], float], least: float
) -> str:
    """What else a judge says of a registration."""
    if still:
        return " That is the start itself: nothing was moved."
    if score > 0:
        return ""
    if off(np.linalg.inv(T)) < least:
        return " Its inverse lies far nearer: return the motion that moves the source."
    return (
        " Three questions: does the radius begin as large as the scans are apart, and shrink? Are the distances those to "
        "planes? Does each new step stand on the left?"
    )


def _guess_open(rng: np.random.Generator):
    """A function that turns and shifts at random, about as far as the start is off."""
    said = motion(rng, float(rng.uniform(0, 22)), float(rng.uniform(0, 0.95)))
    return lambda source, target, normals, start: said @ start


# -------------------------------------------------------------------------------------------------------------- all

_HIDDEN = (
    "course_lib.registration.icp.fit_rigid",
    "course_lib.registration.icp.fit_rigid_to_planes",
    "course_lib.registration.icp.icp",
)

TASKS = (
    Task(
        id="07-1",
        title="put the steps together",
        points=1,
        version=1,
        kind="fill",
        signature="def accumulate(steps)",
        cases=_total_cases,
        judge=judge_T,
        repeats=True,
        misconceptions=TOTAL_MISTAKES,
        hides=("course_lib.geometry.transforms.compose",),
        where="lesson 07, section 2 (closest points, again and again)",
    ),
    Task(
        id="07-2",
        title="best rigid motion of weighted pairs",
        points=3,
        version=4,
        kind="write",
        signature="def best_rigid(source, target, weights)",
        cases=_fit_cases,
        judge=lambda case, answer: judge_T(case, answer, _EXACT_DEGREES, _EXACT_METRES),
        misconceptions=FIT_MISTAKES,
        hides=_HIDDEN,
        where="lesson 07, section 1 (if you knew the pairs)",
    ),
    Task(
        id="07-3",
        title="mend a step of ICP",
        points=3,
        version=3,
        kind="mend",
        signature="def icp_step(source, target, T, radius)",
        cases=_step_cases,
        judge=_judge_step,
        misconceptions=MEND_MISTAKES,
        anatomy=parts_of_step,
        hides=_HIDDEN,
        data=("stanford_bunny",),
        where="lesson 07, sections 2 (closest points, again and again) and 4 (what the fitness is a share of)",
    ),
    which_cause(
        "07-4",
        "which mistake made this",
        CAUSE_OF,
        "the five registrations above",
        WHICH_MISTAKES,
        "lesson 07, section 1 (if you knew the pairs)",
        causes=CAUSES,
    ),
    Task(
        id="07-5",
        title="register two scans",
        points=4,
        version=3,
        kind="open",
        signature="def register(source, target, normals, start)",
        cases=lambda rng: [_open_case(rng)],
        judge=judge_scans(_BANDS),
        misconceptions=OPEN_MISTAKES,
        anatomy=parts_of_registration,
        may_call=("numpy", "scipy"),
        hides=_HIDDEN,
        guess=_guess_open,
        where="lesson 07, section 5 (coarse to fine)",
    ),
    in_words(
        "07-6",
        "explain a fitness of one",
        (
            "0: says that the fitness proves the pose, or only that ICP may fail.",
            "1: says that with a large radius every point finds some partner at almost any pose; or names a check that "
            "does not use the same pairs.",
            "2: both: a large radius makes the fitness 1 at wrong poses too, and the pose must be checked by something "
            "else (marked points, a second start, a smaller radius, overlap seen by eye).",
        ),
        "lesson 07, section 4 (numbers that mislead)",
    ),
)
