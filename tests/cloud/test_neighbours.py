"""Neighbours against brute force, whatever the points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from course_lib.cloud import neighbours
from course_lib.cloud.neighbours import Neighbours


def brute(points, queries, k):
    distance = np.linalg.norm(np.asarray(queries, float)[:, None] - np.asarray(points, float)[None], axis=-1)
    return np.sort(distance, axis=1)[:, :k]


def clouds():
    number = st.integers(0, 2**32 - 1)
    return st.builds(
        lambda seed, n, kind: make(np.random.default_rng(seed), n, kind),
        number, st.integers(1, 80), st.sampled_from(["solid", "flat", "line", "equal", "pairs", "far"]),
    )  # fmt: skip


def make(rng, n, kind):
    points = rng.normal(size=(n, 3))
    if kind in ("flat", "line"):
        points[:, 2 if kind == "flat" else 1 :] = 0.25
    if kind == "equal":
        points[:] = points[0]
    if kind == "pairs":
        points[n // 2 :] = points[: n - n // 2]
    return points + (1e6 if kind == "far" else 0)


@given(clouds(), st.integers(1, 9))
def test_nearest_is_what_brute_force_finds(points, k):
    queries = points[::2] + 0.1
    distance, index = Neighbours(points).nearest(queries, k)
    wanted = brute(points, queries, k)
    n = len(points)
    np.testing.assert_allclose(distance[:, :n], wanted, rtol=1e-12, atol=1e-12)
    assert np.isinf(distance[:, n:]).all() and (index[:, n:] == n).all()
    near = np.linalg.norm(points[index[:, : min(k, n)]] - queries[:, None], axis=-1)
    np.testing.assert_allclose(near, wanted, rtol=1e-12, atol=1e-12)


@given(clouds(), st.floats(0.01, 3))
def test_within_is_what_brute_force_finds(points, radius):
    offsets, index = Neighbours(points).within(points, radius)
    inside = np.linalg.norm(points[:, None] - points[None], axis=-1)
    for i in range(len(points)):
        found = set(index[offsets[i] : offsets[i + 1]].tolist())
        assert set(np.nonzero(inside[i] < radius * (1 - 1e-9))[0]) <= found
        assert found <= set(np.nonzero(inside[i] <= radius * (1 + 1e-9))[0])


def test_many_queries_come_back_in_their_own_order():
    rng = np.random.default_rng(3)
    points, queries = rng.normal(size=(500, 3)), rng.normal(size=(neighbours.SORT_FROM + 5, 3))
    distance, index = Neighbours(points).nearest(queries, 2)
    few = [Neighbours(points).nearest(part, 2) for part in np.array_split(queries, 4)]
    np.testing.assert_array_equal(index, np.concatenate([each[1] for each in few]))
    np.testing.assert_array_equal(distance, np.concatenate([each[0] for each in few]))


def test_own_neighbours_in_blocks():
    points = np.random.default_rng(4).normal(size=(300, 3))
    near = Neighbours(points)
    seen = []
    for index, distance, place in near.self_nearest(4, block=70):
        np.testing.assert_array_equal(near.order[place[:, 0]], index)  # itself first
        np.testing.assert_allclose(distance, brute(points, points[index], 4), atol=1e-12)
        seen.append(index)
    assert sorted(np.concatenate(seen)) == list(range(300))


def test_a_point_at_exactly_the_radius_counts():
    points = [[0, 0, 0], [1, 0, 0]]
    assert Neighbours(points).nearest([[0, 0, 0]], k=2, radius=1.0)[1].tolist() == [[0, 1]]
    assert Neighbours(points).within([[0, 0, 0]], 1.0)[0].tolist() == [0, 2]


def test_the_curve_keeps_neighbours_together():
    points = np.random.default_rng(5).uniform(size=(5000, 3))
    step = np.linalg.norm(np.diff(points[neighbours.morton_order(points)], axis=0), axis=1)
    assert np.median(step) < 0.1 * np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))


@given(clouds(), st.integers(0, 99))
def test_spacing_keeps_under_motion_and_permutation_and_scales(points, seed):
    if len(points) < 2:
        with pytest.raises(ValueError, match="one point has no nearest other"):
            neighbours.spacing(points)
        return
    here = neighbours.spacing(points)
    mixed = np.random.default_rng(seed).permutation(points)
    assert neighbours.spacing(mixed) == pytest.approx(here, rel=1e-9, abs=1e-9)
    assert neighbours.spacing(points[:, [1, 2, 0]] * [1, -1, 1] + 0.5) == pytest.approx(here, rel=1e-6, abs=1e-9)
    assert neighbours.spacing(points * 4) == pytest.approx(4 * here, rel=1e-9)


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        (np.zeros((0, 3)), "there are none"),
        ([[np.nan, 0, 0], [0, 0, 0]], "1 of 2 are NaN or infinite"),
        ([[np.inf, 0, 0], [-np.inf, 0, 0], [0, 0, 0]], "2 of 3 are NaN or infinite"),
        ([1, 2, 3], r"expected shape \(N, 3\)"),
        ([["a", "b", "c"]], "expected real numbers"),
    ],
)
def test_bad_points_get_one_sentence(points, sentence):
    with pytest.raises(ValueError, match=sentence):
        Neighbours(points)
    with pytest.raises(ValueError, match=sentence):
        neighbours.morton_order(points)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [({"k": 0}, "k: expected a whole"), ({"k": 1.5}, "k:"), ({"radius": 0.0}, "radius: expected")],
)
def test_bad_arguments_get_one_sentence(given, sentence):
    with pytest.raises(ValueError, match=sentence):
        Neighbours([[0, 0, 0]]).nearest([[0, 0, 0]], **given)


def test_float32_and_whole_numbers_are_taken():
    points = np.arange(30, dtype=np.float32).reshape(10, 3)
    assert Neighbours(points).nearest(points[:3])[1].tolist() == [[0], [1], [2]]
    assert Neighbours(points.astype(int)).nearest([[0, 1, 2]])[1].tolist() == [[0]]
