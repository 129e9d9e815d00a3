"""Normals against LAPACK, against truth, and where there are none."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from course_lib.cloud import normals
from course_lib.cloud.normals import estimate_normals, fit_surfels, orient_normals, smallest_eigenvectors
from course_lib.geometry import transforms

PARTS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def waves(n, seed=0, noise=0.0):
    """(n, 3) points of a wavy ground, and their true normals, upward."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 4, (2, n))
    points = np.stack([x, y, 0.3 * np.sin(x) * np.cos(y) + noise * rng.standard_normal(n)], axis=1)
    true = np.stack([-0.3 * np.cos(x) * np.cos(y), 0.3 * np.sin(x) * np.sin(y), np.ones(n)], axis=1)
    return points, true / np.linalg.norm(true, axis=1, keepdims=True)


def lines_apart(a, b):
    """The largest angle between lines, radians."""
    return np.linalg.norm(np.cross(a, b), axis=1).max()


def by_loop(points, k, radius=np.inf):
    """The same as the library, one point at a time by SVD; NaN where there is none."""
    found = np.full(points.shape, np.nan)
    for i, point in enumerate(points):
        distance = np.linalg.norm(points - point, axis=1)
        near = [j for j in np.argsort(distance, kind="stable")[:k] if distance[j] <= radius]
        if len(near) < 3:
            continue
        spread, axes = np.linalg.svd(points[near] - points[near].mean(axis=0))[1:]
        if spread[1] > 1e-6 * spread[0]:
            found[i] = axes[2]
    return found


@given(st.integers(0, 2**32 - 1), st.integers(3, 60), st.integers(3, 12), st.sampled_from([np.inf, 1.0]))
def test_normals_are_what_a_loop_finds(seed, n, k, radius):
    points = np.random.default_rng(seed).normal(size=(n, 3)) * [1, 0.7, 0.2]
    want = by_loop(points, k, radius)
    if np.isnan(want).all():
        with pytest.raises(ValueError, match="there are no normals"):
            estimate_normals(points, k, radius)
        return
    got = estimate_normals(points, k, radius)
    np.testing.assert_array_equal(np.isnan(got), np.isnan(want))
    there = ~np.isnan(want[:, 0])
    np.testing.assert_allclose(np.linalg.norm(got[there], axis=1), 1, atol=1e-12)
    clear = fit_surfels(points, k, radius).variation[there] < 0.2  # where two spreads are nearly one, any axis will do
    assert not clear.any() or lines_apart(got[there][clear], want[there][clear]) < 1e-4


@given(st.integers(0, 2**32 - 1), st.sampled_from(["any", "flat", "line", "ball", "thin", "small", "large"]))
def test_eigenvectors_are_lapacks(seed, kind):
    rng = np.random.default_rng(seed)
    widths = {"any": rng.uniform(0.1, 1, 3), "flat": [1, 0.8, 0], "line": [1, 1e-9, 1e-9], "ball": [1, 1, 1],
              "thin": [1, 0.5, 1e-6], "small": [1e-9, 8e-10, 1e-10], "large": [1e6, 7e5, 1e4]}[kind]  # fmt: skip
    axes = transforms.random(rng)[:3, :3]
    matrix = axes @ np.diag(np.square(widths)) @ axes.T
    vectors, values = smallest_eigenvectors([[matrix[i, j]] for i, j in PARTS])
    wanted = np.linalg.eigvalsh(matrix)
    np.testing.assert_allclose(values[:, 0], np.maximum(wanted, 0), rtol=0, atol=3e-8 * wanted[2])
    assert np.linalg.norm(vectors[0]) == pytest.approx(1, abs=1e-12)
    residual = np.linalg.norm(matrix @ vectors[0] - wanted[0] * vectors[0])
    assert residual <= 1e-7 * wanted[2]


def test_open3d_finds_the_same():
    points, _ = waves(4000, noise=0.01)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
    assert lines_apart(estimate_normals(points, 30), np.asarray(cloud.normals)) < 1e-6
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=0.2, max_nn=30))
    ours = estimate_normals(points, 30, radius=0.2)
    there = ~np.isnan(ours[:, 0])
    assert there.mean() > 0.99 and lines_apart(ours[there], np.asarray(cloud.normals)[there]) < 1e-6


def test_normals_of_a_known_surface():
    points, true = waves(20_000)
    found = estimate_normals(points, 12, viewpoint=(2, 2, 50))
    degrees = np.degrees(np.arccos(np.clip((found * true).sum(axis=1), -1, 1)))
    assert np.median(degrees) < 0.4 and (found * true).sum(axis=1).min() > 0.9


@given(st.integers(0, 2**32 - 1))
def test_normals_turn_with_the_cloud_and_do_not_scale(seed):
    rng = np.random.default_rng(seed)
    points, _ = waves(80, seed=seed % 1000)
    T = transforms.random(rng)
    here = estimate_normals(points, 10, viewpoint=(0.3, 0.2, 9.0))
    moved = transforms.apply(T, points)
    there = estimate_normals(moved, 10, viewpoint=transforms.apply(T, np.array([[0.3, 0.2, 9.0]]))[0])
    np.testing.assert_allclose(there, here @ T[:3, :3].T, atol=1e-6)
    np.testing.assert_allclose(
        fit_surfels(1000 * points, 10).variation, fit_surfels(points, 10).variation, rtol=1e-6, atol=1e-9
    )
    assert lines_apart(estimate_normals(points / 1000, 10), here) < 1e-6
    mixed = rng.permutation(len(points))
    assert lines_apart(estimate_normals(points[mixed], 10), here[mixed]) < 1e-6


@given(st.integers(0, 2**32 - 1))
def test_oriented_normals_point_to_the_viewpoint(seed):
    rng = np.random.default_rng(seed)
    points, arrows, eye = rng.normal(size=(30, 3)), rng.normal(size=(30, 3)), 3 * rng.normal(size=3)
    turned = orient_normals(points, arrows, eye)
    assert ((turned * (eye - points)).sum(axis=1) >= 0).all()
    assert (np.abs(turned) == np.abs(arrows)).all()


def test_variation_tells_planes_edges_and_solids_apart():
    rng = np.random.default_rng(2)
    plane = np.column_stack([rng.uniform(-1, 1, (500, 2)), np.zeros(500)])
    edge = np.concatenate([plane, plane[:, [0, 2, 1]]])
    solid = rng.normal(size=(2000, 3))
    assert fit_surfels(plane, 20).variation.max() < 1e-12
    on_edge = np.abs(edge[:, 1:]).max(axis=1) < 0.03
    assert np.median(fit_surfels(edge, 40).variation[on_edge]) > 0.05
    assert 0.05 < np.median(fit_surfels(solid, 100).variation) <= 1 / 3


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        (np.zeros((0, 3)), "there are none"),
        (np.zeros((1, 3)), "a plane needs 3 of them, there are 1"),
        (np.eye(3)[:2], "a plane needs 3 of them, there are 2"),
        (np.zeros((9, 3)), "there are no normals"),
        (np.full((9, 3), 1e6 + 1 / 3), "there are no normals"),
        (np.outer(np.arange(9), [1.0, 2.0, 3.0]), "there are no normals"),
        (np.outer(np.arange(9), [1.0, 2.0, 3.0]) + 1e6, "there are no normals"),
        ([[np.nan, 0, 0], [0, 0, 0], [1, 0, 0]], "1 of 3 are NaN or infinite"),
        ([[np.inf, 0, 0], [0, 0, 0], [1, 0, 0]], "1 of 3 are NaN or infinite"),
        (np.zeros((4, 2)), "last axis must have 3"),
    ],
)
def test_where_there_is_no_normal_one_sentence_says_so(points, sentence):
    with pytest.raises(ValueError, match=sentence):
        estimate_normals(points)


def test_three_points_have_one_normal():
    found = estimate_normals([[0, 0, 0], [2, 0, 0], [0, 1, 0]], viewpoint=(0, 0, 1))
    np.testing.assert_allclose(found, [[0, 0, 1]] * 3, atol=1e-12)


def test_a_lonely_point_has_none_and_the_others_keep_theirs():
    points = np.concatenate([np.column_stack([np.random.default_rng(3).uniform(0, 1, (50, 2)), np.zeros(50)]),
                             [[9.0, 9.0, 9.0]]])  # fmt: skip
    found = estimate_normals(points, 10, radius=1.0)
    assert np.isnan(found[-1]).all()
    np.testing.assert_allclose(np.abs(found[:-1]), [[0, 0, 1]] * 50, atol=1e-9)


def test_a_plane_far_away_in_float32_and_with_duplicates():
    flat = np.column_stack([np.random.default_rng(4).uniform(0, 100, (200, 2)), np.zeros(200)])
    tilted = flat @ transforms.rotation_x(0.5)[:3, :3].T
    far = estimate_normals(tilted + 1e6, 12, viewpoint=(1e6, 1e6, 1e6 + 1e4))
    np.testing.assert_allclose(far, [[0, -np.sin(0.5), np.cos(0.5)]] * 200, atol=1e-6)
    single = estimate_normals(tilted.astype(np.float32), 12, viewpoint=(0, 0, 1e4))
    np.testing.assert_allclose(single, far, atol=1e-3)
    twice = estimate_normals(np.concatenate([tilted, tilted]), 24, viewpoint=(0, 0, 1e4))
    np.testing.assert_allclose(twice[:200], far, atol=1e-6)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda p: estimate_normals(p, 2), "whole number of neighbours from 3 on"),
        (lambda p: estimate_normals(p, 3.5), "whole number of neighbours from 3 on"),
        (lambda p: estimate_normals(p, 5, radius=-1.0), "radius: expected a positive length"),
        (lambda p: estimate_normals(p, 5, viewpoint=(0, 0)), "viewpoint: expected 3 numbers"),
        (lambda p: estimate_normals(p, 5, viewpoint=(0, 0, np.nan)), "viewpoint"),
        (lambda p: orient_normals(p, p[:4], (0, 0, 0)), "expected one a point"),
    ],
)
def test_bad_arguments_get_one_sentence(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call(np.random.default_rng(5).normal(size=(10, 3)))


def test_the_module_offers_what_it_says():
    assert all(callable(getattr(normals, name)) for name in normals.__all__)


@pytest.mark.parametrize("offset", [0.0, 1.0, 10.0, 1000.0, 1e4])
def test_a_line_in_single_precision_has_no_normals_either(offset):
    line = (np.outer(np.arange(60) * 0.02, [1, 0.37, 0.21]) + offset).astype(np.float32)
    with pytest.raises(ValueError, match="nowhere do neighbours span a plane"):
        estimate_normals(line, k=10)
    assert np.isnan(fit_surfels(line, k=10).normals).all()


def test_a_board_in_single_precision_keeps_its_normals():
    board = np.random.default_rng(0).uniform(0, 1, (400, 3)) * [1, 1, 0] + [10, 20, 2]
    assert np.abs(estimate_normals(board.astype(np.float32), k=10)[:, 2]).min() > 1 - 1e-6
