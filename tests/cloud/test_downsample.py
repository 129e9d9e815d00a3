"""Voxel grids and samples against plain loops, whatever the points."""

from __future__ import annotations

import math

import numpy as np
import open3d as o3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from course_lib.cloud import downsample
from course_lib.cloud.downsample import sample_farthest, sample_random, sample_uniform, voxel_downsample, voxel_grid


def by_hand(points, size, origin):
    """The points of each cube, in a dict, one point at a time."""
    cubes: dict[tuple[int, ...], list[np.ndarray]] = {}
    for point in np.asarray(points, float):
        number = tuple(math.floor((c - o) / size) for c, o in zip(point, origin, strict=True))
        cubes.setdefault(number, []).append(point)
    return dict(sorted(cubes.items()))


def make(seed, n, kind):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3))
    if kind in ("flat", "line"):
        points[:, 2 if kind == "flat" else 1 :] = 0.25
    if kind == "equal":
        points[:] = points[0]
    if kind == "pairs":
        points[n // 2 :] = points[: n - n // 2]
    return points + (1e6 if kind == "far" else 0)


KINDS = ["solid", "flat", "line", "equal", "pairs", "far"]
clouds = st.builds(make, st.integers(0, 2**32 - 1), st.integers(1, 60), st.sampled_from(KINDS))
sizes = st.floats(0.05, 4.0)
origins = st.tuples(*[st.floats(-2, 2)] * 3)


@given(clouds, sizes, origins)
def test_the_grid_is_what_a_loop_finds(points, size, origin):
    cubes = by_hand(points, size, origin)
    grid = voxel_grid(points, size, origin)
    assert grid.index.tolist() == [list(number) for number in cubes]
    assert grid.count.tolist() == [len(held) for held in cubes.values()]
    for i, held in enumerate(cubes.values()):
        np.testing.assert_array_equal(points[grid.voxel == i], held)
    centroids = voxel_downsample(points, size, origin)
    np.testing.assert_allclose(centroids, [np.mean(held, axis=0) for held in cubes.values()], rtol=1e-14, atol=1e-12)
    slack = 1e-9 * (1 + np.abs(points).max())
    assert (np.abs(centroids - grid.centres) <= size / 2 + slack).all(), "a centroid lies in its cube"


@given(clouds, sizes, origins)
def test_nearest_keeps_a_measured_point_of_each_cube(points, size, origin):
    kept = voxel_downsample(points, size, origin, representative="nearest")
    cubes = by_hand(points, size, origin)
    assert len(kept) == len(cubes)
    for one, (number, held) in zip(kept, cubes.items(), strict=True):
        assert any((one == point).all() for point in held)
        centre = np.array(origin) + (np.array(number) + 0.5) * size
        off = np.linalg.norm(np.array(held) - centre, axis=1)
        assert np.linalg.norm(one - centre) <= off.min() * (1 + 1e-9) + 1e-9


@given(clouds, sizes, st.integers(0, 99))
def test_order_of_points_does_not_matter(points, size, seed):
    mixed = np.random.default_rng(seed).permutation(points)
    np.testing.assert_allclose(voxel_downsample(mixed, size), voxel_downsample(points, size), rtol=1e-13, atol=1e-12)


@given(clouds.filter(lambda p: np.abs(p).max() < 100), st.integers(-5, 5))
def test_a_grid_moves_with_its_cloud(points, steps):
    """Whole voxels and powers of two are exact, so the same cubes hold the same points."""
    move = np.array([steps, -steps, 2.0 * steps])
    np.testing.assert_allclose(
        voxel_downsample(points + move, 0.5, move), voxel_downsample(points, 0.5) + move, rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(voxel_downsample(4 * points, 2.0), 4 * voxel_downsample(points, 0.5), rtol=1e-12)
    turned = points[:, [1, 2, 0]]
    a, b = voxel_downsample(turned, 0.5), voxel_downsample(points, 0.5)[:, [1, 2, 0]]
    np.testing.assert_allclose(a, b[np.lexsort(np.floor(b / 0.5).T[::-1])], rtol=1e-12, atol=1e-12)


def test_floor_and_not_int():
    """-0.9 and 0.9 lie in cubes -1 and 0; int() would put both into cube 0."""
    grid = voxel_grid([[-0.9, 0, 0], [0.9, 0, 0]], 1.0)
    assert grid.index[:, 0].tolist() == [-1, 0]


def test_open3d_keeps_the_same_points():
    points = np.random.default_rng(3).uniform(-1, 1, (5000, 3))
    ours = voxel_downsample(points, 0.11, points.min(axis=0) - 0.11 / 2)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    theirs = np.asarray(cloud.voxel_down_sample(0.11).points)
    a, b = (each[np.lexsort(np.round(each, 9).T)] for each in (ours, theirs))
    np.testing.assert_allclose(a, b, atol=1e-12)


def test_half_the_voxel_is_four_times_the_points_on_a_surface_and_eight_in_a_solid():
    rng = np.random.default_rng(4)
    solid = rng.uniform(0, 1, (400_000, 3))
    surface = solid.copy()
    surface[:, 2] = 0.3 * surface[:, 0] + 0.2 * surface[:, 1] ** 2
    for points, times in ((surface, 4), (solid, 8)):
        ratio = len(voxel_downsample(points, 0.025)) / len(voxel_downsample(points, 0.05))
        assert ratio == pytest.approx(times, rel=0.06)


def test_memory_grows_with_points_and_not_with_space():
    """Two clusters ten thousand kilometres apart in cubes of a millimetre: no grid of them would fit anywhere."""
    rng = np.random.default_rng(5)
    points = np.concatenate([rng.uniform(0, 0.01, (500, 3)), rng.uniform(0, 0.01, (500, 3)) + [1e7, -1e7, 1e7]])
    grid = voxel_grid(points, 1e-3)
    want = by_hand(points, 1e-3, (0, 0, 0))
    assert grid.index.tolist() == [list(number) for number in want]
    many = rng.uniform(-1e6, 1e6, (20_000, 3))
    assert len(voxel_downsample(many, 1e-3)) == len(many)


def test_far_away_clouds_keep_their_digits():
    points = np.random.default_rng(6).uniform(0, 0.1, (5000, 3))
    near, far = voxel_downsample(points, 0.25), voxel_downsample(points + 1e6, 0.25, (1e6, 1e6, 1e6))
    assert len(near) == len(far) == 1
    np.testing.assert_allclose(far - 1e6, near, atol=2e-10)


def test_float32_is_taken_as_it_is():
    points = np.random.default_rng(7).normal(size=(100, 3)).astype(np.float32)
    for how in ("centroid", "nearest"):
        np.testing.assert_array_equal(
            voxel_downsample(points, 0.5, representative=how),
            voxel_downsample(points.astype(np.float64), 0.5, representative=how),
        )


@pytest.mark.parametrize("n", [1, 2, 3])
def test_few_points(n):
    points = np.eye(3)[:n]
    assert len(voxel_downsample(points, 0.1)) == n
    assert len(voxel_downsample(points, 10.0)) == 1
    np.testing.assert_array_equal(voxel_downsample(np.repeat(points, 4, axis=0), 0.1), points[::-1])


BAD_POINTS = [
    (np.zeros((0, 3)), "there are none"),
    ([[np.nan, 0, 0], [0, 0, 0]], "1 of 2 are NaN or infinite"),
    ([[np.inf, 0, 0]], "1 of 1 are NaN or infinite"),
    ([1, 2, 3], r"expected shape \(N, 3\)"),
    ([["a", "b", "c"]], "expected real numbers"),
]


@pytest.mark.parametrize(("points", "sentence"), BAD_POINTS)
@pytest.mark.parametrize(
    "function",
    [
        lambda p: voxel_grid(p, 0.1),
        lambda p: voxel_downsample(p, 0.1),
        lambda p: voxel_downsample(p, 0.1, representative="nearest"),
        lambda p: sample_farthest(p, 1),
        lambda p: sample_random(p, 1, 0),
        lambda p: sample_uniform(p, 1),
    ],
)
def test_bad_points_get_one_sentence(function, points, sentence):
    with pytest.raises(ValueError, match=sentence):
        function(points)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: voxel_grid([[0, 0, 0]], 0), "a voxel has a positive edge"),
        (lambda: voxel_grid([[0, 0, 0]], -0.1), "a voxel has a positive edge"),
        (lambda: voxel_grid([[0, 0, 0]], np.nan), "size"),
        (lambda: voxel_grid([[1e6, 0, 0]], 1e-12), "more cubes than can be counted"),
        (lambda: voxel_grid([[1e300, 0, 0]], 1e-300), "more cubes than can be counted"),
        (lambda: voxel_grid([[0, 0, 0]], 0.1, (0, 0)), "origin: expected 3 numbers"),
        (lambda: voxel_grid([[0, 0, 0]], 0.1, (0, 0, np.inf)), "origin"),
        (lambda: voxel_downsample([[0, 0, 0]], 0.1, representative="middle"), "say 'centroid' or 'nearest'"),
        (lambda: sample_random([[0, 0, 0]], 2, 0), "count: expected a whole number from 1 to 1"),
        (lambda: sample_random([[0, 0, 0]], 0, 0), "count"),
        (lambda: sample_uniform([[0, 0, 0]], 0), "step: expected"),
        (lambda: sample_uniform([[0, 0, 0]], 1.5), "step: expected"),
        (lambda: sample_farthest([[0, 0, 0]], 1, start=1), "start: there is no point 1"),
        (lambda: sample_farthest([[0, 0, 0], [0, 0, 0]], 2), "in 1 different places, 2 were asked for"),
    ],
)
def test_bad_arguments_get_one_sentence(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()


@given(clouds, st.integers(0, 99))
def test_random_points_are_different_and_repeat(points, seed):
    count = (len(points) + 1) // 2
    chosen = sample_random(points, count, seed)
    assert len(np.unique(chosen)) == count and (np.diff(chosen) > 0).all()
    np.testing.assert_array_equal(chosen, sample_random(points, count, seed))


@given(clouds, st.integers(1, 9))
def test_uniform_is_open3ds(points, step):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    np.testing.assert_array_equal(points[sample_uniform(points, step)], cloud.uniform_down_sample(step).points)


@given(clouds.filter(lambda p: len(np.unique(p, axis=0)) > 3), st.integers(0, 3))
def test_each_farthest_point_is_the_farthest(points, start):
    count = min(len(np.unique(points, axis=0)), 8)
    chosen = sample_farthest(points, count, start)
    assert chosen[0] == start
    for n in range(1, count):
        gap = np.linalg.norm(points[:, None] - points[chosen[:n]], axis=2).min(axis=1)
        assert gap[chosen[n]] == pytest.approx(gap.max(), rel=1e-9)
    motion = points[:, [2, 0, 1]] * [1, -1, -1]
    np.testing.assert_array_equal(sample_farthest(2 * motion, count, start), chosen)


def test_farthest_points_cover_better_than_random_ones():
    points = np.random.default_rng(8).uniform(0, 1, (2000, 3)) * [1, 1, 0]
    gap = {}
    for name, chosen in (("farthest", sample_farthest(points, 60)), ("random", sample_random(points, 60, 1))):
        gap[name] = np.linalg.norm(points[:, None] - points[chosen], axis=2).min(axis=1).max()
    assert gap["farthest"] < 0.6 * gap["random"]


def test_the_module_offers_what_it_says():
    assert all(callable(getattr(downsample, name)) for name in downsample.__all__)
