"""Neighbours against brute force, whatever the points."""

from __future__ import annotations

from contextlib import contextmanager

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


@contextmanager
def by(way):
    """The grid answers even for few points, or the tree for all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(neighbours, "SMALL", 0 if way == "grid" else 10**9)
        yield


WAYS = pytest.mark.parametrize("way", ["grid", "tree"])


@WAYS
@given(clouds(), st.floats(0.05, 4))
def test_one_nearest_is_what_brute_force_finds(way, points, radius):
    queries = np.concatenate([points[::2] + 0.1, points + 3, points[:1] - 1e5])
    with by(way):
        distance, index = Neighbours(points).nearest(queries, radius=radius)
    wanted = brute(points, queries, 1)[:, 0]
    inside = wanted <= radius
    assert np.isinf(distance[~inside]).all() and (index[~inside] == len(points)).all()
    np.testing.assert_allclose(distance[inside, 0], wanted[inside], rtol=1e-12, atol=1e-12)
    near = np.linalg.norm(points[index[inside, 0]] - queries[inside], axis=1)
    np.testing.assert_allclose(near, wanted[inside], rtol=1e-12, atol=1e-12)


@WAYS
@given(clouds(), st.integers(1, 9))
def test_mean_distances_are_those_of_brute_force(way, points, k):
    k = min(k, len(points) - 1)
    if k:
        with by(way):
            mean = Neighbours(points).mean_distances(k)
        np.testing.assert_allclose(mean, brute(points, points, k + 1)[:, 1:].mean(axis=1), rtol=1e-12, atol=1e-12)


@WAYS
@given(clouds(), st.integers(1, 12), st.floats(0.05, 4))
def test_covariances_are_those_of_brute_force(way, points, k, radius):
    k = min(k, len(points))
    with by(way):
        six, count = Neighbours(points).covariances(k, radius)
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    for i, row in enumerate(apart):
        found = np.argsort(row, kind="stable")[:k]
        found = found[row[found] <= radius]
        assert count[i] == len(found)
        beyond = np.delete(row, found)
        if len(beyond) == 0 or beyond.min() > row[found].max():  # else several sets of k are the nearest
            spread = np.cov(points[found].T, bias=True) if len(found) > 1 else np.zeros((3, 3))
            wanted = spread[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            np.testing.assert_allclose(six[i], wanted, rtol=1e-7, atol=1e-9 * (1 + np.abs(spread).max()))


@WAYS
@given(clouds(), st.floats(0.05, 4), st.integers(1, 9))
def test_crowded_is_what_brute_force_counts(way, points, radius, least):
    if least < len(points):
        with by(way):
            crowded = Neighbours(points).crowded(radius, least)
        others = (np.linalg.norm(points[:, None] - points[None], axis=-1) <= radius).sum(axis=1) - 1
        np.testing.assert_array_equal(crowded, others >= least)


def test_a_large_cloud_with_crowds_and_strays_is_as_the_tree_says():
    """What cubes cannot serve, and where a thread's part ends, is answered all the same."""
    rng = np.random.default_rng(6)
    points = np.concatenate(
        [
            rng.uniform(0, 1, (20_000, 3)) * [1, 1, 0.02],  # a slab
            rng.normal(0.5, 1e-4, (6_000, 3)),  # a crowd in one cube
            rng.uniform(-50, 50, (300, 3)),  # strays
            np.repeat(rng.uniform(0, 1, (5, 3)), 40, axis=0),  # one place many times
        ]
    )[rng.permutation(26_500)]
    answers = []
    for way in ("grid", "tree"):
        with by(way):
            near = Neighbours(points)
            answers.append((near.mean_distances(12), *near.covariances(12), near.crowded(0.02, 10)))
    for grid, tree in zip(*answers, strict=True):
        np.testing.assert_allclose(grid, tree, rtol=1e-9, atol=1e-15)


@WAYS
def test_queries_come_back_in_their_own_order(way):
    rng = np.random.default_rng(3)
    points, queries = rng.normal(size=(5000, 3)), rng.normal(size=(5000, 3))
    with by(way):
        distance, index = Neighbours(points).nearest(queries)
    np.testing.assert_array_equal(
        np.linalg.norm(points[index[:, 0]] - queries, axis=1).round(12), distance[:, 0].round(12)
    )
    np.testing.assert_array_equal(distance[:50, 0].round(12), brute(points, queries[:50], 1)[:, 0].round(12))


@WAYS
def test_a_point_at_exactly_the_radius_counts(way):
    points = [[0, 0, 0], [1, 0, 0]]
    with by(way):
        near = Neighbours(points)
        assert near.nearest([[0, 0, 0]], k=2, radius=1.0)[1].tolist() == [[0, 1]]
        assert near.nearest([[-1, 0, 0], [-1.0000001, 0, 0]], radius=1.0)[1].tolist() == [[0], [2]]
        assert near.crowded(1.0, 1).all() and near.covariances(2, 1.0)[1].tolist() == [2, 2]
        lattice = Neighbours(np.stack(np.meshgrid(*[np.arange(5) * 0.1] * 3), axis=-1).reshape(-1, 3))
        assert lattice.crowded(0.1, 3).all()


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
