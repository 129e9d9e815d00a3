"""Judges: what passes, what fails by how much, and what they say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from course_lib.tasks.judges import (
    judge_array,
    judge_band,
    judge_choice,
    judge_labels,
    judge_number,
    judge_transform,
    judge_words,
    quantity,
    rotation_degrees,
    worst_of,
)
from course_lib.tasks.point_sets import judge_points_set

POINTS = np.random.default_rng(3).normal(size=(12, 3))
MILLIMETRE = 1e-3


def _off(index: tuple[int, ...], by: float) -> np.ndarray:
    points = POINTS.copy()
    points[index] += by
    return points


def _turned(degrees: float, translation: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    a = math.radians(degrees)
    T = np.eye(4)
    T[:2, :2] = [[math.cos(a), -math.sin(a)], [math.sin(a), math.cos(a)]]
    T[:3, 3] = translation
    return T


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (0.153, "m", "153 mm"), (1e-4, "m", "0.1 mm"), (1e-6, "m", "1 µm"), (4723.4, "m", "4,723 m"), (0, "m", "0 m"),
        (math.radians(30), "rad", "30°"), (0.5, "deg", "0.5°"), (0.02, "s", "20 ms"), (12.5, "%", "12.5%"),
        (3, "px", "3 px"), (2.5, "", "2.5"), (1e-9, "px", "1.00e-09 px"), (math.inf, "m", "infinitely much m"),
    ],
)  # fmt: skip
def test_quantity(value: float, unit: str, words: str) -> None:
    assert quantity(value, unit) == words


def test_array_names_the_axis_and_the_worst_case() -> None:
    verdict = judge_array(_off((3, 0), 0.153), POINTS, MILLIMETRE, "m", axes="xyz")
    assert not verdict.passed
    assert verdict.error == pytest.approx(0.153)
    assert verdict.ratio == pytest.approx(153)
    assert verdict.axis == "x"
    assert verdict.message == "x is off by 153 mm at worst (row [3] of 12); 1 mm is allowed."
    assert verdict.score == 0


def test_array_within_tolerance() -> None:
    verdict = judge_array(POINTS + 2e-4, POINTS, MILLIMETRE, "m", what="the points")
    assert verdict.passed and verdict.score == 1
    assert verdict.ratio == pytest.approx(0.2)
    assert verdict.message == "The points are within 1 mm."
    assert judge_array(POINTS.tolist(), POINTS, MILLIMETRE).passed
    assert judge_array(POINTS.astype(np.float32), POINTS, MILLIMETRE).passed


def test_array_tolerance_of_its_own_for_each_element() -> None:
    tolerance = np.array([1.0, 1.0, 10.0])
    assert judge_array(_off((0, 2), 9.0), POINTS, tolerance).passed
    verdict = judge_array(_off((0, 1), 2.0), POINTS, tolerance, axes="xyz")
    assert verdict.axis == "y" and verdict.tolerance == 1


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (POINTS.T, "expected shape (12, 3), got (3, 12): transpose?"),
        (POINTS.ravel(), "got (36,): as many numbers in another form."),
        (POINTS[:-2], "2 rows too few."),
        (np.vstack([POINTS, POINTS]), "12 rows too many."),
        (POINTS[:, :2], "got (12, 2)."),
        (None, "got None: is the return missing?"),
        ("x", "Expected a (12, 3) array for the answer, got the text 'x'."),
        ([[1, 2], [3]], "rows differ in length"),
        ([np.zeros((2, 3)), np.zeros(2)], "2 things came back together, a (2, 3) float64 array and"),
        ({"a": 1}, "got a dict with 1 entry"),
        (_off((3, 1), np.nan), "NaN in 1 of 36 places where a number is expected (first at [3, 1])"),
        (_off((3, 1), -np.inf), "infinite in 1 of 36 places"),
        (np.zeros(3, [("x", "f4")]), "record"),
    ],
)
def test_array_refusals(answer: object, words: str) -> None:
    verdict = judge_array(answer, POINTS, MILLIMETRE, "m")
    assert not verdict.passed
    assert words in verdict.message
    assert verdict.ratio == math.inf


def test_array_nan_belongs_where_truth_has_it() -> None:
    truth = _off((2, 0), np.nan)
    assert judge_array(truth, truth, MILLIMETRE).passed
    verdict = judge_array(POINTS, truth, MILLIMETRE)
    assert not verdict.passed and "where NaN is expected" in verdict.message
    assert judge_array(np.full(3, np.nan), np.full(3, np.nan), 1).passed


def test_array_kinds() -> None:
    mask = POINTS[:, 0] > 0
    assert judge_array(mask, mask, 0.2).passed
    assert "expected True/False, got dtype int64" in judge_array(mask.astype(np.int64), mask, 0.2).message
    counts = np.arange(4)
    assert judge_array(counts.astype(float), counts, 0.2).passed
    assert "whole numbers" in judge_array(counts.astype(float), counts, 0.2, kind="int").message
    assert "expected dtype float32" in judge_array(POINTS, POINTS, 0.2, dtype=np.float32).message
    assert judge_array(np.array([np.inf, 1]), np.array([np.inf, 1.0]), 0.1).passed
    assert judge_array(np.empty((0, 3)), np.empty((0, 3)), 0.1).passed


@pytest.mark.parametrize(
    ("answer", "passed", "words"),
    [
        (1.5, True, "within 1 mm"),
        (np.array([1.5]), True, "within"),
        (1.6, False, "The depth is off by 100 mm; 1 mm is allowed."),
        (True, False, "Expected a number for the depth, got True."),
        (math.nan, False, "finite"),
        (math.inf, False, "finite"),
        ([1.5], False, "1 thing in a tuple or list"),
        (None, False, "is the return missing?"),
    ],
)
def test_number(answer: object, passed: bool, words: str) -> None:
    verdict = judge_number(answer, 1.5, MILLIMETRE, "m", "the depth")
    assert verdict.passed == passed
    assert words in verdict.message


def test_number_that_is_nan() -> None:
    assert judge_number(math.nan, math.nan, 1).passed
    assert not judge_number(3.0, math.nan, 1).passed


@pytest.mark.parametrize("degrees", [1e-7, 0.01, 30, 179.9])
def test_rotation_degrees(degrees: float) -> None:
    assert rotation_degrees(np.eye(3), _turned(degrees)[:3, :3]) == pytest.approx(degrees, rel=1e-6)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (_turned(40, (1, 2, 3)), "The rotation is off by 10°; 0.1° is allowed."),
        (_turned(30, (1, 2, 3.5)), "The translation is off by 500 mm; 1 mm is allowed."),
        (_turned(30, (1, 2, 3)).T, "last row of the transform is not 0 0 0 1: is it transposed?"),
        (_turned(30, (1, 2, 3)) @ np.diag([1, 1, -1, 1]), "reflection"),
        (_turned(30, (1, 2, 3)) @ np.diag([2, 2, 2, 1]), "does not hold a rotation"),
        (_turned(30)[:3, :3], "expected shape (4, 4), got (3, 3)"),
        (np.full((4, 4), np.nan), "NaN or infinity at [0, 0]"),
    ],
)
def test_transform_refusals(answer: np.ndarray, words: str) -> None:
    verdict = judge_transform(answer, _turned(30, (1, 2, 3)), degrees=0.1, metres=1e-3)
    assert not verdict.passed
    assert words in verdict.message


def test_transform_passes_in_float32() -> None:
    truth = _turned(30, (1, 2, 3))
    assert judge_transform(truth.astype(np.float32), truth, degrees=0.1, metres=1e-3).passed


def test_points_set_ignores_order_but_not_partners() -> None:
    assert judge_points_set(POINTS[::-1] + 1e-4, POINTS, MILLIMETRE).passed
    assert judge_points_set(np.empty((0, 3)), np.empty((0, 3)), 1).passed
    assert "expected 12, got 11" in judge_points_set(POINTS[1:], POINTS, MILLIMETRE).message
    assert "transpose?" in judge_points_set(POINTS.T, POINTS, MILLIMETRE).message
    far = judge_points_set(_off((3, 0), 5.0), POINTS, MILLIMETRE)
    assert not far.passed and "row [3] of 12" in far.message
    twice = np.vstack([POINTS[:-1], POINTS[:1]])
    assert "no partner among yours" in judge_points_set(twice, POINTS, MILLIMETRE).message
    doubled, other = POINTS[[0, 0, 1]], POINTS[[0, 1, 1]]
    assert judge_points_set(doubled[::-1], doubled, MILLIMETRE).passed
    assert "too many in one place" in judge_points_set(other, doubled, MILLIMETRE).message


def test_labels() -> None:
    truth = np.arange(20) % 3
    wrong = truth.copy()
    wrong[4] = 7
    assert judge_labels(truth, truth).passed
    verdict = judge_labels(wrong, truth)
    assert not verdict.passed and verdict.ratio >= 5 - 1e-9
    assert "in 1 of 20 places (first at [4])" in verdict.message
    assert judge_labels(wrong, truth, least=0.9).passed
    mask = truth > 0
    assert "1 True too many, 0 too few" in judge_labels(mask | (np.arange(20) == 0), mask, what="the mask").message
    assert "True/False" in judge_labels(truth, mask).message


def test_choice() -> None:
    choices = ("flip", "range", "scale")
    truth = {"A": "flip", "B": "range"}
    assert judge_choice(dict(truth), truth, choices).passed
    half = judge_choice({"A": "flip", "B": "scale"}, truth, choices)
    assert not half.passed and half.score == 0.5 and half.ratio >= 5 - 1e-9
    assert half.message == "Right: 1 of 2."
    twice = judge_choice({"A": "flip", "B": "flip"}, truth, choices)
    assert twice.message == "Right: 1 of 2. Used more than once: 'flip'; never: 'range'." and twice.score == 0.5
    assert judge_choice(["flip", "flip"], ["flip", "flip"], choices).passed
    assert judge_choice(["flip", "flip", "range"], ["flip", "range", "range"], choices).message == "Right: 2 of 3."
    assert "did you mean 'flip'?" in judge_choice({"A": "flp", "B": "range"}, truth, choices).message
    assert "a dict with the keys 'A', 'B'" in judge_choice({"A": "flip"}, truth, choices).message
    assert judge_choice("flip", "flip", choices).passed
    assert "is not 'range'" in judge_choice("range", "flip", choices).message
    assert judge_choice(["flip"], ["flip"], choices).passed
    assert not judge_choice(None, ["flip"], choices).passed


@pytest.mark.parametrize(
    ("answer", "passed"),
    [("", False), ("  \n", False), ("…", False), ("why", True), ("a " * 60, True), ("a " * 61, False)],
)
def test_words(answer: str, passed: bool) -> None:
    assert judge_words(answer).passed == passed


def test_words_refuses_what_is_no_text() -> None:
    assert "a text in quotes" in judge_words(3).message


@pytest.mark.parametrize(
    ("value", "score", "words"),
    [
        (5e-4, 1.0, "The error is 0.5 mm, under 1 mm."),
        (2e-3, 0.7, "The error is 2 mm, under 3 mm; the next band begins under 1 mm"),
        (5e-3, 0.3, "under 10 mm; the next band begins under 3 mm"),
        (1.0, 0.0, "The error is 1 m, in no band yet; the next band begins under 10 mm"),
        (math.nan, 0.0, "not finite"),
    ],
)
def test_band(value: float, score: float, words: str) -> None:
    verdict = judge_band(value, ((1e-3, 1.0), (3e-3, 0.7), (1e-2, 0.3)), "m", what="the error")
    assert verdict.score == score
    assert verdict.passed == (score >= 0.5)
    assert words in verdict.message


def test_band_of_what_should_be_large() -> None:
    bands = ((0.9, 1.0), (0.7, 0.5))
    assert judge_band(0.95, bands, better="larger").score == 1
    assert judge_band(0.7, bands, better="larger").score == 0.5
    assert judge_band(0.1, bands, better="larger").ratio > judge_band(0.6, bands, better="larger").ratio > 0


def test_worst_of_speaks_of_the_worst() -> None:
    fine, bad = judge_number(1, 1, 1), judge_number(9, 1, 1, what="the height")
    verdict = worst_of(fine, bad)
    assert not verdict.passed and verdict.score == 0.5
    assert "The height is off" in verdict.message
    assert worst_of(fine, fine).passed
