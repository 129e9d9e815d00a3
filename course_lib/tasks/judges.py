"""Judges for the usual kinds of answer, each with sentences in physical units; all take any plain answer.

The truth of a case normally stands in `case.hidden["truth"]`; a judge of a task is one line:
`judge=lambda case, answer: judge_array(answer, case.truth, 1e-3, "m", axes="xyz")`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from course_lib.tasks.choices import judge_band, judge_choice, judge_words
from course_lib.tasks.core import Verdict
from course_lib.tasks.plain import Plain, describe
from course_lib.tasks.wording import (
    array_problem,
    expected,
    is_,
    measured,
    place_of,
    position,
    quantity,
    refuse,
    share,
    up,
)

__all__ = [
    "judge_array",
    "judge_band",
    "judge_choice",
    "judge_labels",
    "judge_number",
    "judge_transform",
    "judge_words",
    "quantity",
    "refuse",
    "rotation_degrees",
    "worst_of",
]


def worst_of(*verdicts: Verdict) -> Verdict:
    """One verdict of several: it passes if all do, speaks of the worst, and scores their mean."""
    worst = max(verdicts, key=lambda verdict: (not verdict.passed, verdict.ratio))
    return Verdict(
        all(v.passed for v in verdicts),
        worst.error,
        worst.tolerance,
        worst.unit,
        worst.axis,
        worst.message,
        float(np.mean([v.score for v in verdicts])),
    )


def judge_number(answer: Plain, truth: float, tolerance: float, unit: str = "", what: str = "the answer") -> Verdict:
    """A number against the true one, |difference| ≤ tolerance, all in `unit`. A one-element array is a number."""
    if isinstance(answer, np.ndarray) and answer.size == 1 and answer.dtype.names is None:
        answer = answer.reshape(()).tolist()
    if isinstance(answer, bool) or not isinstance(answer, (int, float)):
        return refuse(expected("a number", answer, what), tolerance, unit)
    if isinstance(truth, (int, float)) and math.isnan(truth):
        return (
            Verdict(True, 0.0, tolerance, unit, what, f"{is_(what)} NaN, as it should be.")
            if math.isnan(answer)
            else refuse(f"{is_(what)} {describe(answer)}: expected NaN, there is no value here.", tolerance, unit)
        )
    if not math.isfinite(answer):
        return refuse(f"{is_(what)} {answer}: expected a finite number.", tolerance, unit)
    error = abs(float(answer) - float(truth))
    return measured(error, tolerance, unit, what, "")


def judge_array(
    answer: Plain,
    truth: np.ndarray,
    tolerance: float | np.ndarray,
    unit: str = "",
    *,
    axes: Sequence[str] = (),
    what: str = "the answer",
    kind: str | None = None,
    dtype: Any = None,
) -> Verdict:
    """An array of numbers against the true one, element by element.

    Parameters
    ----------
    answer : plain; a list of numbers is taken as an array.
    truth : the true array; where it is NaN the answer must be NaN, and only there.
    tolerance : in `unit`; a number or an array that broadcasts against the truth.
    axes : names along the last axis: "xyz", ("u", "v", "z"). Without them rows and columns are named.
    what : how sentences call the answer.
    kind : "float", "int" or "bool" where the dtype matters; by default only truth of True/False asks for its own.
    dtype : the exact dtype, where the task is about it.
    """
    truth = np.asarray(truth)
    top = float(np.max(tolerance))
    problem = array_problem(answer, truth, what, kind or ("bool" if truth.dtype.kind == "b" else None), dtype)
    if problem:
        return refuse(problem, top, unit)
    values, true = np.asarray(answer).astype(np.float64), truth.astype(np.float64)
    missing, hole = np.isnan(values), np.isnan(true)
    if (missing & ~hole).any():
        return refuse(
            f"{is_(what)} NaN {share(missing & ~hole)} where a number is expected "
            f"(first at {position(missing & ~hole)}).",
            top,
            unit,
        )
    if (hole & ~missing).any():
        return refuse(
            f"{up(what)}: a number {share(hole & ~missing)} where NaN is expected, because nothing was "
            f"measured (first at {position(hole & ~missing)}).",
            top,
            unit,
        )
    if (np.isinf(values) & ~np.isinf(true)).any():
        wrong = np.isinf(values) & ~np.isinf(true)
        return refuse(f"{is_(what)} infinite {share(wrong)} (first at {position(wrong)}).", top, unit)
    if values.size == 0 or hole.all():
        return Verdict(True, 0.0, top, unit, what, f"{is_(what)} as it should be.")
    with np.errstate(invalid="ignore"):
        off = np.where(hole | (values == true), 0.0, np.abs(values - true))
    allowed = np.broadcast_to(np.asarray(tolerance, dtype=float), off.shape)
    at = np.unravel_index(np.argmax(off / np.maximum(allowed, 1e-300)), off.shape)
    axis = str(axes[at[-1]]) if len(axes) == off.shape[-1] and off.ndim else what
    place = at[:-1] if axis != what else at
    shape = off.shape[:-1] if axis != what else off.shape
    return measured(float(off[at]), float(allowed[at]), unit, axis, place_of(place, shape))


def judge_transform(
    answer: Plain, truth: np.ndarray, *, degrees: float, metres: float, what: str = "the transform"
) -> Verdict:
    """A rigid 4x4 transform against the true one, in degrees and metres.

    It must be rigid: last row 0 0 0 1, a proper rotation (no reflection, no scale).
    """
    problem = array_problem(answer, np.asarray(truth, float), what, None, None)
    if problem:
        return refuse(problem, degrees, "deg")
    T = np.asarray(answer, dtype=float)
    if not np.isfinite(T).all():
        return refuse(f"{up(what)} holds NaN or infinity at {position(~np.isfinite(T))}.", degrees, "deg")
    if np.abs(T[3] - [0, 0, 0, 1]).max() > 1e-6:
        hint = ": is it transposed?" if np.abs(T[:, 3] - [0, 0, 0, 1]).max() <= 1e-6 else "."
        return refuse(f"The last row of {what} is not 0 0 0 1{hint}", degrees, "deg")
    R = T[:3, :3]
    if np.abs(R.T @ R - np.eye(3)).max() > 1e-4:
        return refuse(
            f"{up(what)} does not hold a rotation: its columns are not perpendicular unit vectors.", degrees, "deg"
        )
    if np.linalg.det(R) < 0:
        return refuse(
            f"{up(what)} holds a reflection: the determinant of its 3x3 part is −1, expected +1.", degrees, "deg"
        )
    angle = rotation_degrees(R, np.asarray(truth, float)[:3, :3])
    shift = float(np.linalg.norm(T[:3, 3] - np.asarray(truth, float)[:3, 3]))
    turn, move = (
        measured(angle, degrees, "deg", "the rotation", ""),
        measured(shift, metres, "m", "the translation", ""),
    )
    both = worst_of(turn, move)
    if turn.passed or move.passed:
        return both
    follows = f" The translation, off by {quantity(shift, 'm')}, may only follow from it."
    return replace(turn, message=turn.message + follows, score=both.score)


def rotation_degrees(A: np.ndarray, B: np.ndarray) -> float:
    """The angle between two rotation matrices, in degrees; exact for small angles too."""
    D = A.T @ B
    sine = np.linalg.norm([D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]]) / 2
    return math.degrees(math.atan2(sine, (np.trace(D) - 1) / 2))


def judge_labels(answer: Plain, truth: np.ndarray, *, least: float = 1.0, what: str = "the labels") -> Verdict:
    """Labels or a mask against the true ones: at least the share `least` must agree. Error and tolerance in %."""
    truth = np.asarray(truth)
    most = max(100 * (1 - least), 100 * 0.2 / max(truth.size, 1))
    problem = array_problem(answer, truth, what, "bool" if truth.dtype.kind == "b" else None, None)
    if problem:
        return refuse(problem, most, "%")
    wrong = np.asarray(answer) != truth
    if not wrong.any():
        return Verdict(True, 0.0, most, "%", what, f"{is_(what)} right everywhere.")
    error = 100 * float(wrong.mean())
    extra = ""
    if truth.dtype.kind == "b":
        extra = f": {int((wrong & ~truth).sum()):,} True too many, {int((wrong & truth).sum()):,} too few"
    return Verdict(
        error <= most, error, most, "%", what, f"{is_(what)} wrong {share(wrong)} (first at {position(wrong)}){extra}."
    )
