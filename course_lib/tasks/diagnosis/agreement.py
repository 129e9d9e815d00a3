"""When two answers to a case are the same: number for number, or within what the judge allows."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from course_lib.tasks.core import Case, Task, Verdict
from course_lib.tasks.plain import Plain, same


@dataclass(frozen=True)
class Sampled:
    """A large answer of which some numbers are kept.

    Parameters
    ----------
    form : what it is made of, as `leaves` says it.
    places, values : of each array in it: flat indices, and the numbers there.
    tolerance : within which numbers agree.
    """

    form: str
    places: tuple[np.ndarray, ...]
    values: tuple[np.ndarray, ...]
    tolerance: float

    def agrees(self, answer: Plain) -> bool:
        """Whether an answer has this form and these numbers."""
        form, parts = leaves(answer)
        return form == self.form and all(
            _agree(part.reshape(-1)[at], values, self.tolerance)
            for part, at, values in zip(parts, self.places, self.values, strict=True)
        )


def _agree(a: np.ndarray, b: np.ndarray, tolerance: float) -> bool:
    if b.dtype.kind == "b":
        return bool((a == b).all())
    a, b = a.astype(np.float64), b.astype(np.float64)
    with np.errstate(invalid="ignore"):
        near = (a == b) | (np.isfinite(b) & (np.abs(a - b) <= np.maximum(tolerance, 1e-5 * np.abs(b))))
    return bool((near | (np.isnan(a) & np.isnan(b))).all())


def leaves(value: Plain) -> tuple[str, list[np.ndarray]]:
    """What a plain value is made of, as text, and its arrays of numbers in order."""
    if isinstance(value, list) and isinstance(array := _as_array(value), np.ndarray):
        value = array
    if isinstance(value, np.ndarray) and value.dtype.names is None:
        return f"{'mask' if value.dtype.kind == 'b' else 'numbers'} {value.shape}", [value]
    if isinstance(value, dict):
        parts = [(key, *leaves(value[key])) for key in sorted(value, key=str)]
        text = ", ".join(f"{key!r}: {form}" for key, form, _ in parts)
        return f"{{{text}}}", [array for *_, arrays in parts for array in arrays]
    if isinstance(value, list):
        forms = [leaves(one) for one in value]
        return f"[{', '.join(form for form, _ in forms)}]", [array for _, arrays in forms for array in arrays]
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return "number", [np.asarray(value)]
    return repr(value), []


def distance(task: Task, case: Case, a: Plain, b: Plain | Sampled) -> float:
    """How far two answers to a case are from each other, in tolerances; NaN is near nothing, where truth has none."""
    if isinstance(b, Sampled):
        return 0.0 if b.agrees(a) else math.inf
    if isinstance(b, np.ndarray) and isinstance(a, list):
        a = _as_array(a)
    truth = case.hidden.get("truth")
    if _stray_nan(a, truth) or _stray_nan(b, truth):
        return 0.0 if _holds_numbers(b) and same(a, b) else math.inf  # the same numbers, and NaN in the same places
    if same(a, b):
        return 0.0
    if not comparable(a, b) or (isinstance(truth, dict) and not _same_form(b, truth)):
        return math.inf
    if isinstance(truth, np.ndarray):
        b = _as_array(b) if isinstance(b, list) else b
        if not isinstance(b, (np.ndarray, int, float)) or np.ndim(b) != truth.ndim:  # two arrays in one answer
            return math.inf
    if task.distance is not None:
        return float(task.distance(case, a, b))
    if "truth" not in case.hidden:
        return math.inf
    verdict = _judged(task, case, a, b)
    return verdict.ratio if verdict else math.inf


def _judged(task: Task, case: Case, a: Plain, truth: Plain) -> Verdict | None:
    """The verdict on an answer if this, which is wrong, were the truth; None where a judge cannot take it for one."""
    return verdict_on_made(task, replace(case, hidden={**case.hidden, "truth": truth}), a)


def verdict_on_made(task: Task, case: Case, answer: Plain) -> Verdict | None:
    """The verdict where the answer or the truth is one that a program made up; None where the judge cannot take it.

    A judge owes a verdict on whatever a learner answers, with a truth of its own. What it makes of other truths, or of
    answers that nobody gave, is nobody's promise, and must cost no learner a grade.
    """
    try:
        with np.errstate(all="ignore"):
            return task.judge(case, answer)
    except Exception:
        return None


def _holds_numbers(value: Plain) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind == "f" and bool(np.isfinite(value).any())


def _stray_nan(value: Plain, truth: Plain) -> bool:
    """Whether NaN stands where the truth has a number."""
    if isinstance(value, float) and isinstance(truth, (int, float)):
        return math.isnan(value) and not math.isnan(truth)
    if isinstance(value, np.ndarray) and value.dtype.kind == "f":
        gaps = np.isnan(value)
        if isinstance(truth, np.ndarray) and truth.shape == value.shape and truth.dtype.kind == "f":
            gaps = gaps & ~np.isnan(truth)
        return bool(gaps.any()) and not (
            isinstance(truth, np.ndarray)
            and truth.dtype.kind == "f"
            and np.isnan(truth).any()
            and truth.shape != value.shape
        )
    return False


def _as_array(value: list[Plain]) -> Plain:
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        return value
    return array if array.dtype.kind in "biuf" else value


def comparable(a: Plain, b: Plain) -> bool:
    """Whether two plain values are of the same form, so that a judge may take one for the truth of the other."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.ndim == b.ndim and a.dtype.names == b.dtype.names
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return isinstance(a, bool) == isinstance(b, bool)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(comparable, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(comparable(a[key], b[key]) for key in a)
    return type(a) is type(b)


def _same_form(value: Plain, truth: Plain) -> bool:
    """Whether a judge may take a value for the truth: the same keys, and arrays of the same shape."""
    if isinstance(value, dict) and isinstance(truth, dict):
        return value.keys() == truth.keys() and all(_same_form(value[key], truth[key]) for key in truth)
    return np.shape(value) == np.shape(truth) if isinstance(truth, np.ndarray) else type(value) is type(truth)


def near(task: Task, case: Case, a: Plain, b: Plain | Sampled) -> bool:
    """Whether two answers are the same number for number, or within the tolerance of the judge."""
    if isinstance(b, Sampled):
        return b.agrees(a)
    if isinstance(b, np.ndarray) and isinstance(a, list):
        a = _as_array(a)
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        if a.shape != b.shape or a.dtype.names or b.dtype.names:
            return False
        truth = case.hidden.get("truth")
        if same(a, b, 1e-5) or (isinstance(truth, np.ndarray) and truth.shape != b.shape):
            return same(a, b, 1e-5)
    if task.kind == "open" and task.distance is None and "truth" in case.hidden:
        verdict = _judged(task, case, a, b) if comparable(a, b) else None
        return verdict is not None and verdict.passed
    return distance(task, case, a, b) <= 1


def same_kind(answer: Plain, truth: Plain) -> bool:
    """Whether a truth is kept in the form of an answer: then slips of answers can be made of it."""
    kinds = ((int, float), (np.ndarray, list), (dict,), (str,))
    return any(isinstance(answer, kind) and isinstance(truth, kind) for kind in kinds)
