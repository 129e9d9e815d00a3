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
from scipy.spatial import cKDTree

from course_lib.geometry.transforms import apply, compose, invert, rotation_z
from course_lib.tasks.core import Case, Judge, Task, Verdict
from course_lib.tasks.judges import judge_band, judge_number, judge_transform, refuse, worst_of
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_07_icp.marks import fit_cases, horn
from course_lib.tasks.labs.lab_07_icp.mistakes import FIT_MISTAKES
from course_lib.tasks.labs.lab_07_icp.parts import parts_of_registration, parts_of_step
from course_lib.tasks.labs.lab_07_icp.scan_mistakes import CAUSE_OF, CAUSES, OPEN_MISTAKES, WHICH_MISTAKES
from course_lib.tasks.labs.lab_07_icp.step_mistakes import MEND_MISTAKES
from course_lib.tasks.labs.lab_07_icp.total_mistakes import TOTAL_MISTAKES
from course_lib.tasks.labs.lab_07_icp.two_scans import bumps, motion, two_scans
from course_lib.tasks.plain import Plain, describe

_DEGREES, _METRES = 0.01, 1e-4
_EXACT_DEGREES, _EXACT_METRES = 1e-3, 1e-5
"""Of a fit in closed form: so fine that a pair left out of forty shows, and numbers of 16 bits."""


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


# ------------------------------------------------------------------------------------------------------------ 3 mend


def _step_case(rng: np.random.Generator, radius: float, degrees: float, strays: int, name: str) -> Case:
    target = bumps(rng, 200)[0]
    source = np.vstack([bumps(rng, 120)[0], rng.uniform((0, 0, 1), (2, 2, 3), (strays, 3))])
    T = motion(rng, degrees, 0.25)
    return _stepped(apply(invert(compose(motion(rng, 4, 0.05), T)), source), target, T, radius, name)


def _stepped(source: np.ndarray, target: np.ndarray, T: np.ndarray, radius: float, name: str) -> Case:
    """What one step from T must give; the target's first and last points are partners: to leave one out shows."""
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

_BANDS = ((0.6, 1.0), (0.9, 0.75), (1.2, 0.5), (2.0, 0.25))  # spacings of the target, mean over the source's ground


def _open_case(rng: np.random.Generator) -> Case:
    scans = two_scans(rng)
    return Case(
        {"source": scans.source, "target": scans.target, "normals": scans.normals, "start": scans.start},
        {
            "truth": scans.T_target_source,
            "surface": scans.surface,
            "size": scans.size,
            "spacing": float(np.median(cKDTree(scans.target).query(scans.target, 2)[0][:, 1])),
        },
        f"two scans of a ground of {1.5 * scans.size:.0f} m by {2 * scans.size:.0f} m",
    )


def judge_scans(bands: Sequence[tuple[float, float]]) -> Judge:
    """A judge of a registration by how far it leaves the source's ground from its place: spacings, else metres."""

    def judge(case: Case, answer: Plain) -> Verdict:
        form = judge_transform(answer, case.truth, degrees=0.2, metres=0.01)
        unit = "spacings" if "spacing" in case.hidden else "m"
        if not np.isfinite(form.error):
            return replace(form, tolerance=bands[0][0], unit=unit)
        surface, T = case.hidden["surface"], np.asarray(answer, dtype=float)

        def off(motion: np.ndarray) -> float:
            away = np.linalg.norm(apply(motion, surface) - apply(case.truth, surface), axis=1).mean()
            return float(away) / case.hidden.get("spacing", 1.0)

        verdict = judge_band(off(T), bands, unit, what="the mean error over the ground")
        still = np.abs(T - case.given.get("start", np.eye(4))).max() < 1e-3
        return replace(verdict, message=verdict.message + _more_of_scans(T, still, verdict.score, off, bands[-1][0]))

    return judge


def _more_of_scans(T: np.ndarray, still: bool, score: float, off: Callable[[np.ndarray], float], least: float) -> str:
    """What else a judge says of a registration."""
    if still:
        return " That is the start itself: nothing was moved."
    if score > 0:
        return ""
    if off(np.linalg.inv(T)) < least:
        return " Its inverse lies far nearer: return the motion that moves the source."
    return (
        " Three questions: does the radius begin as large as the scans are apart, and shrink to a few spacings of this "
        "scene? Are the distances those to planes? Does each new step stand on the left?"
    )


def _guess_open(rng: np.random.Generator):
    """A function that turns and shifts at random, about as far as the start is off."""
    turned, shifted = motion(rng, float(rng.uniform(0, 22)), 0.0), motion(rng, 0.0, float(rng.uniform(0, 0.5)))

    def register(source: np.ndarray, target: np.ndarray, normals: np.ndarray, start: np.ndarray) -> np.ndarray:
        said = turned.copy()
        said[:3, 3] = shifted[:3, 3] * np.ptp(target, axis=0).max()
        return said @ start

    return register


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
        cases=fit_cases,
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
        version=4,
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
