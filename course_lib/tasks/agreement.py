"""When two answers to a case are the same: number for number, or within what the judge allows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Task
from course_lib.tasks.plain import Plain, same


def distance(task: Task, case: Case, a: Plain, b: Plain) -> float:
    """How far two answers to a case are from each other, in tolerances; NaN is near nothing, where truth has none."""
    if isinstance(b, np.ndarray) and isinstance(a, list):
        a = _as_array(a)
    truth = case.hidden.get("truth")
    if _stray_nan(a, truth) or _stray_nan(b, truth):
        return math.inf
    if same(a, b):
        return 0.0
    if not _comparable(a, b) or (isinstance(truth, dict) and not _same_form(b, truth)):
        return math.inf
    if task.distance is not None:
        return float(task.distance(case, a, b))
    if "truth" not in case.hidden:
        return math.inf
    try:
        with np.errstate(all="ignore"):
            return task.judge(replace(case, hidden={**case.hidden, "truth": b}), a).ratio
    except ValueError:  # b, which is wrong, is no truth that this judge can take: a matrix that is not rigid
        return math.inf


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


def _comparable(a: Plain, b: Plain) -> bool:
    """Whether two plain values are of the same form, so that a judge may take one for the truth of the other."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.ndim == b.ndim and a.dtype.names == b.dtype.names
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return isinstance(a, bool) == isinstance(b, bool)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_comparable, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_comparable(a[key], b[key]) for key in a)
    return type(a) is type(b)


def _same_form(value: Plain, truth: Plain) -> bool:
    """Whether a judge may take a value for the truth: the same keys, and arrays of the same shape."""
    if isinstance(value, dict) and isinstance(truth, dict):
        return value.keys() == truth.keys() and all(_same_form(value[key], truth[key]) for key in truth)
    return np.shape(value) == np.shape(truth) if isinstance(truth, np.ndarray) else type(value) is type(truth)


def near(task: Task, case: Case, a: Plain, b: Plain) -> bool:
    """Whether two answers are the same number for number, or within the tolerance of the judge."""
    if isinstance(b, np.ndarray) and isinstance(a, list):
        a = _as_array(a)
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        if a.shape != b.shape or a.dtype.names or b.dtype.names:
            return False
        truth = case.hidden.get("truth")
        if same(a, b, 1e-5) or (isinstance(truth, np.ndarray) and truth.shape != b.shape):
            return same(a, b, 1e-5)
    return distance(task, case, a, b) <= 1


def same_kind(answer: Plain, truth: Plain) -> bool:
    """Whether a truth is kept in the form of an answer: then slips of answers can be made of it."""
    kinds = ((int, float), (np.ndarray, list), (dict,), (str,))
    return any(isinstance(answer, kind) and isinstance(truth, kind) for kind in kinds)
