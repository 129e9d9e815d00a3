"""What is wrong with the form of an answer, in words: before values are compared."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from course_lib.tasks.plain import Plain

COUNTS = ("rows dropped", "rows too many")
"""What says least about a form: where something else explains an answer, that is told."""
_OF_A_MOTION = {(3, 4): "The upper three rows", (3, 3): "The rotation alone", (3,): "Three numbers"}


def form_problem(answer: Plain, truth: Plain, others: Sequence[tuple[Plain, Plain]] = ()) -> tuple[str, str] | None:
    """The name of what is wrong with the form of an answer and a sentence about it, or None.

    Parameters
    ----------
    answer : plain, refused by the judge or far off.
    truth : the true answer, or one of its form.
    others : the same of other cases; what helps here must help there, too.
    """
    if isinstance(truth, Mapping) and isinstance(answer, Mapping):
        return _of_dict(answer, truth)
    if isinstance(answer, Mapping) and not isinstance(truth, Mapping):
        return "a dict", f"A dict came back where {_kind(truth)} is asked: return the value itself."
    if isinstance(truth, np.ndarray) or (isinstance(truth, list) and truth and not isinstance(truth[0], str)):
        return _of_array(answer, np.asarray(truth), others)
    if isinstance(truth, (int, float)) and not isinstance(truth, bool):
        return _of_number(answer, truth)
    return None


NAN_ALWAYS = (
    "NaN",
    "NaN came back: it comes from the root of a negative number or from 0 / 0, and a mean, a median or a largest value "
    "of numbers with NaN among them is NaN, too.",
)


def gap_problem(answer: Plain, truth: Plain) -> tuple[str, str] | None:
    """What NaN and infinity in an answer say that should not be there; of a dict, also what its parts' forms say."""
    if isinstance(truth, Mapping):
        if not isinstance(answer, Mapping) or set(answer) != set(truth):
            return None
        for key, part in truth.items():
            found = form_problem(answer[key], part) or gap_problem(answer[key], part)
            if found:
                return f"{found[0]} in {key!r}", f"In {key!r}: {found[1]}"
        return None
    if isinstance(answer, float) and isinstance(truth, (int, float)):
        return NAN_ALWAYS if math.isnan(answer) and not math.isnan(truth) else None
    if not isinstance(answer, (np.ndarray, list)) or not isinstance(truth, np.ndarray):
        return None
    try:
        a = np.asarray(answer)
    except ValueError:
        return None
    if a.dtype.kind not in "iuf" or truth.dtype.kind not in "iuf" or a.shape != truth.shape:
        return None
    return of_gaps(a.astype(float), truth.astype(float))


def of_gaps(a: np.ndarray, t: np.ndarray) -> tuple[str, str] | None:
    """What NaN and infinity in numbers say, of the same shape as the true ones."""
    lost, filled = np.isnan(a) & ~np.isnan(t), ~np.isnan(a) & np.isnan(t)
    if filled.any() and not lost.any():
        values = a[filled]
        words = f", always {values[0] + 0.0:g}" if np.ptp(values) == 0 else ""
        return (
            "holes filled",
            f"Where nothing was measured stands a number ({filled.sum():,} times{words}) instead of NaN.",
        )
    if lost.any() and not filled.any():
        if (t[lost] == 0).all():
            return (
                "NaN for 0",
                f"NaN stands where 0 is asked ({lost.sum():,} times), and nowhere else: keep the 0 there.",
            )
        if _farthest(t, lost):
            return (
                "cut off",
                f"NaN stands where the largest values belong, and only there ({lost.sum():,} times): is something cut "
                "off at a limit?",
            )
        return (
            "values lost",
            f"NaN stands where a number belongs ({lost.sum():,} times): is there the root of a negative number, a "
            "division by 0, or 0 / 0?",
        )
    if lost.any():
        return "holes moved", (
            "NaN stands in other places than it should: numbers come from elsewhere, as when rows and columns, an "
            "order or a step from one to the next is wrong."
        )
    endless = np.isinf(a) & ~np.isinf(t)
    if endless.any():
        return (
            "infinite",
            f"Infinity stands in {endless.sum():,} places: is there a division by 0, or was a stand-in for what is "
            "missing never taken out?",
        )
    return None


def _farthest(t: np.ndarray, lost: np.ndarray) -> bool:
    """Whether what is lost is what is beyond a limit, in one of the numbers of each row."""
    if t.ndim > 1 and t.shape[-1] <= 4:
        t, lost = t.reshape(-1, t.shape[-1]), lost.reshape(-1, t.shape[-1]).any(axis=1)
    else:
        t, lost = t.reshape(-1, 1), lost.reshape(-1)
    left = t[~lost & ~np.isnan(t).any(axis=1)]
    return lost.sum() > 1 and len(left) > 0 and bool((t[lost].min(axis=0) > left.max(axis=0)).any())


def _kind(truth: Plain) -> str:
    if isinstance(truth, np.ndarray):
        return f"an array of shape {truth.shape}"
    return "a number" if isinstance(truth, (int, float)) else "another kind of value"


def _of_dict(answer: Mapping, truth: Mapping) -> tuple[str, str] | None:
    keys, values = set(truth), list(answer.values())
    if set(answer) == keys:
        inner = ((key, form_problem(answer[key], truth[key])) for key in truth)
        return next(((f"{one[0]} in {key!r}", f"In {key!r}: {one[1]}") for key, one in inner if one), None)
    if all(isinstance(value, (str, int)) for value in values) and set(values) == keys:
        return "an inverted dict", "Keys and values of the dict are exchanged: look up by " + _names(keys) + "."
    return "other keys", f"The dict has the keys {_names(answer)}; {_names(keys)} are asked."


def _names(keys) -> str:
    return ", ".join(repr(key) for key in sorted(keys, key=str))


def _of_number(answer: Plain, truth: float) -> tuple[str, str] | None:
    if isinstance(answer, np.ndarray) and answer.size > 1:
        return "an array for a number", (
            f"{answer.size:,} numbers came back where one is asked: is a mean, a sum or an index missing at the end?"
        )
    if isinstance(answer, list) and len(answer) > 1:
        return "several for one", f"{len(answer)} values came back where one number is asked: return only that one."
    return None


def _of_array(answer: Plain, truth: np.ndarray, others: Sequence[tuple[Plain, Plain]]) -> tuple[str, str] | None:
    if isinstance(answer, (int, float)) and not isinstance(answer, bool):
        if truth.ndim and truth.size > 1:
            return "axis forgotten", (
                f"One number came back where {truth.shape} are asked: a mean, sum or norm without axis= takes all "
                "numbers together."
            )
        return None
    if isinstance(answer, list):
        joined = _joined(answer, truth)
        if joined:
            return joined
        try:
            answer = np.asarray(answer)
        except ValueError:
            return (
                "rows of different lengths",
                "The rows of the answer have different lengths: give each as many numbers.",
            )
    if not isinstance(answer, np.ndarray) or answer.dtype.kind not in "biuf":
        return None
    got, asked = answer.shape, truth.shape
    if truth.dtype.kind == "b" and answer.dtype.kind in "iu" and answer.ndim == 1 and truth.ndim == 1:
        if len(answer) == len(truth) and np.isin(answer, (0, 1)).all():
            return None
        if len(answer) == len(truth) and (np.diff(answer) <= 0).any():
            return "numbers for a mask", (
                "Whole numbers came back where a mask is asked: compare them with a threshold, for True or False."
            )
        return "row numbers for a mask", (
            f"Row numbers came back ({len(answer):,}) where a mask is asked: {len(truth):,} times True or False."
        )
    if truth.dtype.kind in "iu" and answer.dtype.kind == "b":
        return (
            "a mask for row numbers",
            "A mask came back where row numbers are asked: np.flatnonzero(mask) gives them.",
        )
    if got == asked:
        return None
    if len(asked) == 1 and len(got) == 2 and got[1] in (2, 3) and truth.dtype.kind in "biu" and asked[0] > 3:
        what = "a mask" if truth.dtype.kind == "b" else "a list of whole numbers"
        return f"points for {'a mask' if truth.dtype.kind == 'b' else 'row numbers'}", (
            f"Points came back ({got[0]:,}) where {what} is asked: return what you chose them by, not the points."
        )
    return _of_shape(answer, truth, others)


def _joined(answer: list, truth: np.ndarray) -> tuple[str, str] | None:
    """Parts that belong into one array: (n, d) for a plane of four numbers, (R, t) for a motion."""
    try:
        parts = [np.atleast_1d(np.asarray(part, float)) for part in answer]
    except (ValueError, TypeError):
        return None
    if truth.shape == (4, 4) and sorted(part.size for part in parts) == [3, 9]:
        return (
            "not joined",
            "A rotation and a shift came back apart where one 4x4 is asked: fill T[:3, :3] and T[:3, 3] of np.eye(4).",
        )
    if truth.ndim == 1 and len({part.shape for part in parts}) > 1 and all(part.ndim == 1 for part in parts):
        if sum(len(part) for part in parts) == len(truth):
            return (
                "not joined",
                f"{len(parts)} parts came back where one array of {len(truth)} is asked: join them (np.append).",
            )
    return None


def _refits(answer: Plain, truth: Plain) -> bool:
    """Whether a reshape alone makes the true answer of it."""
    try:
        a, t = np.asarray(answer, float), np.asarray(truth, float)
    except (ValueError, TypeError):
        return False
    return a.size == t.size and np.allclose(a.reshape(t.shape), t, rtol=1e-3, atol=1e-6, equal_nan=True)


def _of_shape(answer: np.ndarray, truth: np.ndarray, others: Sequence[tuple[Plain, Plain]]) -> tuple[str, str] | None:
    got, asked = answer.shape, truth.shape
    if asked == (4, 4) and got in _OF_A_MOTION:
        return "part of a motion", f"{_OF_A_MOTION[got]} came back where one 4x4 is asked: fill np.eye(4) with R and t."
    if len(got) == len(asked) and sorted(got) == sorted(asked):
        call = ".T" if len(got) == 2 else f"np.moveaxis: {got} to {asked}"
        return "axes in another order", f"The axes stand in another order: {got} for {asked}; use {call}, not reshape."
    if answer.size == truth.size:
        name = "one axis too many" if len(got) > len(asked) else "one axis too few"
        ends = "a reshape alone does not put them in order."
        if all(_refits(a, t) for a, t in ((answer, truth), *others)):
            same_sizes = all(np.shape(t) == asked for _, t in others)
            ends = f".reshape{asked} puts them so{'.' if same_sizes else ' here; other cases have other sizes.'}"
        return name, f"The numbers stand in {got} where {asked} is asked: {ends}"
    if len(got) == len(asked) and got[1:] == asked[1:]:
        if got[0] < asked[0]:
            return (
                "rows dropped",
                f"You kept {got[0]:,} of {asked[0]:,}; the answer has all of them.",
            )
        return (
            "rows too many",
            f"{got[0]:,} came back where {asked[0]:,} are asked: not all of them belong to it.",
        )
    if len(got) == len(asked) and got[:-1] == asked[:-1]:
        return "other columns", f"Each row holds {got[-1]} numbers where {asked[-1]} are asked."
    if len(got) < len(asked) and (got == asked[: len(got)] or got == asked[-len(got) :] if got else False):
        return "axis forgotten", (
            f"{got} came back where {asked} is asked: an axis was averaged away, several numbers were made one, or one "
            "item was returned for all."
        )
    if len(got) > len(asked) and asked and (got[: len(asked)] == asked or got[-len(asked) :] == asked):
        return (
            "not chosen",
            f"{got} came back where {asked} is asked: a norm, a mean or a choice along one axis is missing.",
        )
    if len(got) + 1 == len(asked) and got[1:] == asked[2:] and got[0] < asked[0] * asked[1]:
        return "picked out", (
            f"{got[0]:,} came back where {asked} is asked: a mask picks some out, and the rows and columns are lost; "
            "np.where keeps all places."
        )
    if len(got) == len(asked) + 1 and got[2:] == asked[1:] and got[0] * got[1] > asked[0]:
        return "not picked out", (
            f"All {got[0]:,}x{got[1]:,} came back where {asked[0]:,} are asked: pick them out, with one mask for all."
        )
    return None
