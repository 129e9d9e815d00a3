"""How judges speak: quantities with units, places, shapes. Sentences for people, the same on every machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from course_lib.tasks.core import Verdict
from course_lib.tasks.plain import Plain, describe

_STEPS = {
    "m": ((1e-8, 1e-9, "nm"), (1e-5, 1e-6, "µm"), (1.0, 1e-3, "mm")),
    "s": ((1e-3, 1e-6, "µs"), (1.0, 1e-3, "ms")),
}


COUNTED = {"rows": "row", "tries": "try", "points": "point", "cells": "cell", "words": "word", "pixels": "pixel"}
"""Units of things that are counted, with the word for one."""


def quantity(value: float, unit: str = "", digits: int = 3) -> str:
    """A number with its unit as people say it: 0.153 m is "153 mm", 0.1 rad "5.73°"."""
    if unit in ("rad", "deg"):
        return quantity(math.degrees(value) if unit == "rad" else value, "°", digits)
    for below, factor, name in _STEPS.get(unit, ()):
        if 0 < abs(value) < below * (1 - 1e-12):
            return quantity(value / factor, name, digits)
    if not math.isfinite(value):
        text = "infinitely much" if math.isinf(value) else "NaN"
    elif value == 0 or 1e-5 <= abs(value) < 1e7:
        decimals = max(0, digits - 1 - (math.floor(math.log10(abs(value))) if value else digits))
        text = f"{round(value, decimals):,.{decimals}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    else:
        text = f"{value:.{digits - 1}e}"
    if abs(value) == 1:
        unit = COUNTED.get(unit, unit)
    return text + (unit if unit in ("°", "%") else f" {unit}" if unit else "")


def refuse(message: str, tolerance: float = 0.0, unit: str = "", axis: str = "") -> Verdict:
    """The verdict on an answer that has no size of error: wrong type, shape, NaN."""
    return Verdict(False, math.inf, tolerance, unit, axis, message)


def measured(error: float, tolerance: float, unit: str, axis: str, place: str) -> Verdict:
    passed = error <= tolerance
    where = f" at worst ({place})" if place else ""
    allowed = f"; {'none' if unit in COUNTED and tolerance < 1 else quantity(tolerance, unit)} is allowed"
    message = f"{is_(axis)} off by {quantity(error, unit)}{where}{allowed}."
    if passed:
        exact = unit in COUNTED and tolerance < 1
        message = f"{is_(axis)} right." if exact else f"{is_(axis)} within {quantity(tolerance, unit)}."
    return Verdict(passed, error, tolerance, unit, axis, message)


def expected(form: str, answer: Plain, what: str) -> str:
    if answer is None:
        return f"Expected {form} for {what}, got None: is the return missing?"
    return f"Expected {form} for {what}, got {describe(answer)}."


def not_numbers(answer: Plain, what: str, form: str) -> str:
    if isinstance(answer, np.ndarray):
        return "" if answer.dtype.names is None else expected(form, answer, what)
    if isinstance(answer, list):
        try:
            values = np.asarray(answer)
        except ValueError:
            if any(isinstance(one, np.ndarray) for one in answer):  # a return with commas in it
                parts = " and ".join(describe(one) for one in answer[:3])
                return f"{len(answer)} things came back together, {parts}: return {what} alone."
            return f"Expected {form} for {what}, got a list whose rows differ in length."
        return "" if values.dtype.kind in "biuf" else expected(form, answer, what)
    return expected(form, answer, what)


def array_problem(answer: Plain, truth: np.ndarray, what: str, kind: str | None, dtype: Any) -> str:
    form = f"a {truth.shape} array"
    problem = not_numbers(answer, what, form)
    if problem:
        return problem
    values = np.asarray(answer)
    if values.shape != truth.shape:
        return f"{up(what)}: expected shape {truth.shape}, got {values.shape}{transposed(values.shape, truth.shape)}"
    if dtype is not None and values.dtype != np.dtype(dtype):
        return (
            f"{up(what)}: expected dtype {np.dtype(dtype)}, got {values.dtype}: .astype({np.dtype(dtype)}) changes it."
        )
    names = {"float": "f", "int": "iu", "bool": "b"}
    if kind is not None and values.dtype.kind not in names[kind]:
        words = {"float": "floats", "int": "whole numbers", "bool": "True/False"}[kind]
        return f"{up(what)}: expected {words}, got dtype {values.dtype}."
    return ""


def transposed(got: tuple[int, ...], expected: tuple[int, ...]) -> str:
    """How a sentence on a wrong shape ends: with the likely reason, if there is one."""
    if len(got) == len(expected) > 1 and got == expected[::-1]:
        return ": transpose?"
    if len(got) == len(expected) and sorted(got) == sorted(expected):
        return ": are its axes in another order?"
    if math.prod(got) == math.prod(expected):
        return ": as many numbers in another form."
    if len(got) == len(expected) and got[1:] == expected[1:]:
        return f": {quantity(abs(got[0] - expected[0]), 'rows')} too {'many' if got[0] > expected[0] else 'few'}."
    return "."


def share(wrong: np.ndarray) -> str:
    return f"in {int(wrong.sum()):,} of {wrong.size:,} places"


def position(wrong: np.ndarray) -> str:
    return "[" + ", ".join(str(int(i)) for i in np.argwhere(wrong)[0]) + "]" if wrong.ndim else "the number itself"


def place_of(index: Sequence[int], shape: Sequence[int]) -> str:
    if len(index) == 1:
        return f"row [{index[0]}] of {shape[0]}"
    if len(index) == 2:
        return f"row [{index[0]}], column [{index[1]}] of {shape[0]}x{shape[1]}"
    return "at [" + ", ".join(str(int(i)) for i in index) + "]" if index else ""


def is_(what: str) -> str:
    """The subject of a sentence with its verb: "The depth is", "The points are", "x is"."""
    head = what.split(" of ")[0]  # the number of tries is one
    plural = head.endswith("s") and not head.endswith(("ss", "us", "is", "as"))
    return f"{up(what)} {'are' if plural else 'is'}"


def up(text: str) -> str:
    """A sentence's first word with a capital; the name of an axis stays as it is."""
    return text[:1].upper() + text[1:] if len(text) > 1 else text
