"""Lab 07: rigid motions from pairs, one step of ICP, and a registration with strays and partial overlap.

`T_target_source` maps source coordinates to target coordinates. Truth is known because each case moves a cloud by a
transform drawn at random; what a step of ICP must give is computed here by Horn's quaternions, not by an SVD.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from course_lib.geometry.transforms import apply, compose, invert, rotation_z
from course_lib.tasks.core import Case, Task, Verdict
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


def _judge_T(case: Case, answer: Plain) -> Verdict:
    return _all_or_nothing(judge_transform(answer, case.truth, degrees=_DEGREES, metres=_METRES))


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


def _fit_case(rng: np.random.Generator, points: np.ndarray, degrees: float, metres: float, name: str) -> Case:
    T = motion(rng, degrees, metres)
    return Case({"source": points, "target": apply(T, points)}, {"truth": T}, name)


def _fit_cases(rng: np.random.Generator) -> list[Case]:
    solid = rng.normal(size=(60, 3)) * [0.5, 0.3, 0.2]
    far = rng.normal(size=(40, 3)) * 0.3 + [1.5, -2.0, 0.7]
    cases = [
        _fit_case(rng, solid, rng.uniform(8, 25), 0.3, "a cloud about the origin"),
        _fit_case(rng, far, rng.uniform(8, 25), 0.6, "a cloud two metres from the origin"),
    ]
    noisy = apply(motion(rng, rng.uniform(8, 25), 0.3), solid) + rng.normal(0, 0.02, solid.shape)
    given = {"source": solid, "target": noisy}  # least squares has its say: three pairs do not tell the motion
    cases.append(Case(given, {"truth": _horn(solid, noisy)}, "pairs with 2 cm of noise"))
    plane = np.c_[rng.uniform(-1, 1, (30, 2)), np.zeros(30)] + [0.3, 0.2, 1.0]
    while True:  # of planar clouds, half need the guard: draw until this one does
        case = _fit_case(rng, apply(motion(rng, 60, 0.0), plane), rng.uniform(8, 25), 0.4, "points of one plane")
        p, q = case.given["source"], case.given["target"]
        U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
        if np.linalg.det(Vt.T @ U.T) < 0:
            return [*cases, case]


# ------------------------------------------------------------------------------------------------------------ 3 mend


def _horn(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """The rigid motion from p to q by the largest eigenvector of Horn's matrix of quaternions."""
    S = (p - p.mean(axis=0)).T @ (q - q.mean(axis=0))
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
    T[:3, 3] = q.mean(axis=0) - T[:3, :3] @ p.mean(axis=0)
    return T


def _step_case(rng: np.random.Generator, radius: float, degrees: float, strays: int, name: str) -> Case:
    target = bumps(rng, 200)[0]
    source = np.vstack([bumps(rng, 120)[0], rng.uniform((0, 0, 1), (2, 2, 3), (strays, 3))])
    T = motion(rng, degrees, 0.25)
    return _stepped(apply(invert(compose(motion(rng, 4, 0.05), T)), source), target, T, radius, name)


def _stepped(source: np.ndarray, target: np.ndarray, T: np.ndarray, radius: float, name: str) -> Case:
    """What one step from T must give."""
    moved = apply(T, source)
    distances = np.linalg.norm(moved[:, None] - target[None], axis=2)
    keep = distances.min(axis=1) <= radius
    step = _horn(moved[keep], target[distances.argmin(axis=1)[keep]])
    truth = {"T": step @ T, "fitness": float(keep.mean())}
    return Case({"source": source, "target": target, "T": T, "radius": radius}, {"truth": truth}, name)


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
            judge_transform(answer["T"], case.truth["T"], degrees=_DEGREES, metres=_METRES, what="T"),
            judge_number(answer["fitness"], case.truth["fitness"], 1e-3, "", "the fitness"),
        )
    )


# ------------------------------------------------------------------------------------------------------------ 5 open

_BANDS = ((0.007, 1.0), (0.011, 0.75), (0.018, 0.5), (0.04, 0.25))  # metres, mean over the source's surface


def _open_case(rng: np.random.Generator) -> Case:
    scans = two_scans(rng)
    return Case(
        {"source": scans.source, "target": scans.target, "normals": scans.normals},
        {"truth": scans.T_target_source, "surface": scans.surface},
        "two scans that share two thirds",
    )


def _judge_open(case: Case, answer: Plain) -> Verdict:
    form = judge_transform(answer, case.truth, degrees=0.2, metres=0.01)
    if not np.isfinite(form.error):
        return replace(form, tolerance=_BANDS[0][0], unit="m")
    surface, T = case.hidden["surface"], np.asarray(answer, dtype=float)

    def off(motion: np.ndarray) -> float:
        return float(np.linalg.norm(apply(motion, surface) - apply(case.truth, surface), axis=1).mean())

    error = off(T)
    verdict = judge_band(error, _BANDS, "m", what="the mean error over the surface")
    said = verdict.message
    if np.abs(T - np.eye(4)).max() < 1e-3:
        said += " That is the start itself: nothing was moved."
    elif verdict.score == 0 and off(np.linalg.inv(T)) < _BANDS[-1][0]:
        said += " Its inverse lies far nearer: return the motion that moves the source."
    elif verdict.score == 0:
        said += (
            " Three questions: does the radius begin as large as the scans are apart, and shrink? Are the distances"
            " those to planes? Does each new step stand on the left?"
        )
    return replace(verdict, message=said)


def _guess_open(rng: np.random.Generator):
    """A function that turns and shifts at random, about as far as the scans are apart."""
    said = motion(rng, float(rng.uniform(0, 20)), float(rng.uniform(0, 0.65)))
    return lambda source, target, normals: said


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
        judge=_judge_T,
        misconceptions=TOTAL_MISTAKES,
        hides=("course_lib.geometry.transforms.compose",),
        where="lesson 07, section 2 (closest points, again and again)",
    ),
    Task(
        id="07-2",
        title="best rigid motion",
        points=3,
        version=3,
        kind="write",
        signature="def best_rigid(source, target)",
        cases=_fit_cases,
        judge=_judge_T,
        misconceptions=FIT_MISTAKES,
        hides=_HIDDEN,
        where="lesson 07, section 1 (if you knew the pairs)",
    ),
    Task(
        id="07-3",
        title="mend a step of ICP",
        points=3,
        version=2,
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
        version=2,
        kind="open",
        signature="def register(source, target, normals)",
        cases=lambda rng: [_open_case(rng)],
        judge=_judge_open,
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
