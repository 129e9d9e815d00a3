"""Statistical and radius removal, clusters and the filters of depth images: right, equal to Open3D, robust."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from course_lib.bench import inputs
from course_lib.camera import depth_filters
from course_lib.cloud import clusters, outliers
from course_lib.geometry import transforms

FIVE = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0], [9, 0, 0], [10, 0, 0.0]])

FILTERS = {
    "statistics": lambda p: outliers.keep_by_statistics(p, 3, 1.0),
    "radius": lambda p: outliers.keep_by_radius(p, 0.3, 3),
    "clusters": lambda p: clusters.euclidean_clusters(p, 0.12),
}


def cloud_of(points: np.ndarray) -> o3d.geometry.PointCloud:
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.asarray(points, float)))


def slow_distances(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points[None], axis=-1)


def same_partition(a: np.ndarray, b: np.ndarray) -> bool:
    pairs = np.unique(np.stack([a, b]), axis=1)
    return pairs.shape[1] == len(np.unique(a)) == len(np.unique(b))


@pytest.fixture(scope="module")
def strays() -> np.ndarray:
    return inputs.field_with_strays(5000, 3, 500.0)


def test_the_five_points_that_tell_whether_a_point_counts_itself():
    assert outliers.mean_distances(FIVE, 2).tolist() == [2, 1.5, 2.5, 3.5, 4]
    assert outliers.keep_by_statistics(FIVE, 2, 1.0).tolist() == [True, True, True, True, False]
    for neighbours, kept in ((3, [0, 1, 2, 3]), (2, [0, 1, 3, 4])):
        assert list(cloud_of(FIVE).remove_statistical_outlier(neighbours, 1.0)[1]) == kept


def test_mean_distances_are_those_of_all_pairs():
    points = np.random.default_rng(0).uniform(size=(300, 3))
    expected = np.sort(slow_distances(points), axis=1)[:, 1:8].mean(axis=1)
    np.testing.assert_allclose(outliers.mean_distances(points, 7), expected, atol=1e-12)


@pytest.mark.parametrize("ratio", [0.25, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("k", [1, 8, 20])
def test_statistical_removal_keeps_what_open3d_keeps(strays, k, ratio):
    theirs = cloud_of(strays).remove_statistical_outlier(k + 1, ratio)[1]
    assert np.array_equal(np.flatnonzero(outliers.keep_by_statistics(strays, k, ratio)), theirs)


@pytest.mark.parametrize(("radius", "least"), [(0.05, 1), (0.1, 5), (0.2, 16), (0.5, 60)])
def test_radius_removal_keeps_what_open3d_keeps(strays, radius, least):
    theirs = cloud_of(strays).remove_radius_outlier(least, radius)[1]
    assert np.array_equal(np.flatnonzero(outliers.keep_by_radius(strays, radius, least)), theirs)


@pytest.mark.slow
@pytest.mark.parametrize("radius", [0.02, 0.05, 0.1, 0.3, 2.0])
def test_clusters_are_those_of_dbscan_with_one_point(strays, radius):
    theirs = np.asarray(cloud_of(strays).cluster_dbscan(radius, 1))
    assert same_partition(clusters.euclidean_clusters(strays, radius), theirs)


def test_dense_clusters_with_far_more_neighbours_than_are_looked_at_first():
    rng = np.random.default_rng(4)
    balls = [rng.normal(0, 0.02, (n, 3)) + (x, 0, 0) for n, x in ((900, 0), (700, 0.35), (500, 0.62), (30, 2))]
    points = rng.permutation(np.concatenate(balls))
    for radius in (0.01, 0.05, 0.1, 0.15, 0.2):
        theirs = np.asarray(cloud_of(points).cluster_dbscan(radius, 1))
        assert same_partition(clusters.euclidean_clusters(points, radius), theirs), radius


def test_clusters_are_numbered_by_size_and_small_ones_are_none():
    points = np.array([[9, 0, 0], [0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [5, 0, 0], [5.1, 0, 0.0]])
    assert clusters.euclidean_clusters(points, 0.15).tolist() == [2, 0, 0, 0, 1, 1]
    assert clusters.euclidean_clusters(points, 0.15, least=2).tolist() == [-1, 0, 0, 0, 1, 1]


def test_a_larger_ratio_removes_less(strays):
    removed = [np.sum(~outliers.keep_by_statistics(strays, 8, ratio)) for ratio in (0.25, 0.5, 1, 2, 3)]
    assert all(np.diff(removed) < 0)


# ---------------------------------------------------------------------------------------------------- degenerate


@pytest.mark.parametrize("name", FILTERS)
def test_no_points_nan_and_infinity_are_one_sentence(name):
    spoiled = np.random.default_rng(0).uniform(size=(50, 3))
    spoiled[7, 1] = np.nan
    infinite = np.where(np.isnan(spoiled), np.inf, spoiled)
    for wrong in (np.empty((0, 3)), spoiled, infinite, np.zeros((4, 2)), "rubbish", None):
        with pytest.raises(ValueError) as told:
            FILTERS[name](wrong)
        assert "\n" not in str(told.value) and len(str(told.value)) > 20


def test_one_point_has_no_neighbours():
    with pytest.raises(ValueError, match="one point has no neighbours"):
        outliers.keep_by_statistics([[0, 0, 0]])
    assert outliers.keep_by_radius([[0, 0, 0]], 1.0, 1).tolist() == [False]
    assert clusters.euclidean_clusters([[0, 0, 0]], 1.0).tolist() == [0]


@pytest.mark.parametrize("count", [2, 3])
def test_few_points(count):
    points = np.arange(count)[:, None] * np.array([0.1, 0, 0])
    assert outliers.keep_by_statistics(points, 20, 2.0).all()
    assert outliers.keep_by_radius(points, 0.15, 1).all() and not outliers.keep_by_radius(points, 0.15, 5).any()
    assert clusters.euclidean_clusters(points, 0.15).tolist() == [0] * count


def test_all_equal_points_are_kept_and_one_cluster():
    points = np.full((100, 3), 2.5)
    assert outliers.keep_by_statistics(points, 8, 1.0).all()
    assert outliers.keep_by_radius(points, 0.1, 16).all()
    assert not clusters.euclidean_clusters(points, 0.1).any()


@pytest.mark.parametrize("shape", ["collinear", "coplanar"])
def test_flat_clouds(shape):
    rng = np.random.default_rng(6)
    points = rng.uniform(size=(400, 3)) * ([1, 0, 0] if shape == "collinear" else [1, 1, 0])
    theirs = cloud_of(points)
    assert np.array_equal(
        np.flatnonzero(outliers.keep_by_statistics(points, 8, 1.0)), theirs.remove_statistical_outlier(9, 1.0)[1]
    )
    assert np.array_equal(
        np.flatnonzero(outliers.keep_by_radius(points, 0.05, 4)), theirs.remove_radius_outlier(4, 0.05)[1]
    )
    assert same_partition(clusters.euclidean_clusters(points, 0.02), np.asarray(theirs.cluster_dbscan(0.02, 1)))


def test_duplicates_are_neighbours_at_distance_zero():
    points = np.repeat(np.random.default_rng(2).uniform(size=(40, 3)), 3, axis=0)
    assert outliers.mean_distances(points, 2).tolist() == [0.0] * 120
    assert outliers.keep_by_radius(points, 1e-9, 2).all()
    assert len(np.unique(clusters.euclidean_clusters(points, 1e-6))) == 40


@pytest.mark.parametrize("name", FILTERS)
def test_coordinates_of_a_map_and_float32(name):
    points = np.random.default_rng(8).uniform(0, 1, (500, 3)).round(3)
    here = FILTERS[name](points)
    assert np.array_equal(FILTERS[name](points + 1e6), here)
    single = FILTERS[name](points.astype(np.float32))
    assert single.shape == here.shape and np.mean(single == here) > 0.99


def test_wrong_settings_are_one_sentence():
    points = np.random.default_rng(0).uniform(size=(50, 3))
    for call in (
        lambda: outliers.keep_by_statistics(points, 0),
        lambda: outliers.keep_by_statistics(points, 2.5),
        lambda: outliers.keep_by_statistics(points, 5, -1.0),
        lambda: outliers.keep_by_statistics(points, 5, np.nan),
        lambda: outliers.keep_by_radius(points, 0.0),
        lambda: outliers.keep_by_radius(points, np.nan),
        lambda: outliers.keep_by_radius(points, 0.1, 0),
        lambda: clusters.euclidean_clusters(points, -1.0),
        lambda: clusters.euclidean_clusters(points, 0.1, 0),
    ):
        with pytest.raises(ValueError) as told:
            call()
        assert "\n" not in str(told.value)


# --------------------------------------------------------------------------------------------------- invariances

seeds = st.integers(0, 10_000)


def drawn(seed: int) -> tuple[np.random.Generator, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng, rng.uniform(0, 1, (int(rng.integers(30, 200)), 3))


@given(seed=seeds, name=st.sampled_from(sorted(FILTERS)))
def test_order_of_points_does_not_matter(seed, name):
    rng, points = drawn(seed)
    order = rng.permutation(len(points))
    here, there = FILTERS[name](points)[order], FILTERS[name](points[order])
    assert same_partition(here, there) if name == "clusters" else np.array_equal(here, there)


@given(seed=seeds, name=st.sampled_from(sorted(FILTERS)))
def test_rigid_motion_changes_nothing(seed, name):
    rng, points = drawn(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn[:, 0] *= np.linalg.det(turn)
    T = transforms.from_rotation_translation(turn, rng.uniform(-5, 5, 3))
    here, there = FILTERS[name](points), FILTERS[name](transforms.apply(T, points))
    assert same_partition(here, there) if name == "clusters" else np.array_equal(here, there)


@given(seed=seeds, scale=st.sampled_from([1e-3, 0.5, 2.0, 1024.0]))
def test_scale(seed, scale):
    _, points = drawn(seed)
    scaled = points * scale
    assert np.array_equal(outliers.keep_by_statistics(points, 5, 1.5), outliers.keep_by_statistics(scaled, 5, 1.5))
    assert np.array_equal(outliers.keep_by_radius(points, 0.2, 4), outliers.keep_by_radius(scaled, 0.2 * scale, 4))
    assert same_partition(clusters.euclidean_clusters(points, 0.1), clusters.euclidean_clusters(scaled, 0.1 * scale))


@given(seed=seeds)
def test_a_longer_reach_only_joins_clusters(seed):
    _, points = drawn(seed)
    short, long = clusters.euclidean_clusters(points, 0.08), clusters.euclidean_clusters(points, 0.12)
    assert len(np.unique(np.stack([short, long]), axis=1).T) == len(np.unique(short))


# --------------------------------------------------------------------------------------------------- depth images


def test_a_speck_and_a_flying_pixel_go_and_a_slanted_wall_stays():
    depth = np.linspace(1.0, 1.3, 40)[None] * np.ones((30, 1))
    depth[10, 10], depth[20:22, 20:22], depth[5, 5] = 2.5, 0.6, 0.0
    supported = depth_filters.keep_supported(depth, 0.05, 4)
    patches = depth_filters.keep_large_patches(depth, 0.05, 10)
    wrong = np.zeros(depth.shape, bool)
    wrong[10, 10] = wrong[20:22, 20:22] = wrong[5, 5] = True
    assert np.array_equal(patches, ~wrong)
    corners = np.zeros_like(wrong)
    corners[np.ix_([0, -1], [0, -1])] = True  # three neighbours only
    assert not supported[wrong].any() and supported[~wrong & ~corners].all()


def test_a_speck_of_four_supports_itself_up_to_three():
    depth = np.full((9, 9), 2.0)
    depth[4:6, 4:6] = 1.0
    assert depth_filters.keep_supported(depth, 0.1, 3)[4:6, 4:6].all()
    assert not depth_filters.keep_supported(depth, 0.1, 4)[4:6, 4:6].any()


def test_the_tolerance_is_one_disparity_at_every_depth():
    """Two pixels of disparity: kept within 1.9 of them, not within 2.1, near and far."""
    for z in (0.5, 1.0, 4.0):
        for share, kept in ((0.95, True), (1.05, False)):
            other = 1 / (1 / z - share * 0.04)
            assert depth_filters.keep_supported([[z, other]], 0.04, 1).all() == kept


@pytest.mark.parametrize("function", [depth_filters.keep_supported, depth_filters.keep_large_patches])
def test_depth_filters_refuse_with_a_sentence_and_pass_no_data(function):
    for wrong in (np.zeros(5), np.zeros((0, 4)), "rubbish", np.zeros((2, 2, 3))):
        with pytest.raises(ValueError):
            function(wrong, 0.1, 2)
    for setting in ((0.0, 2), (np.nan, 2), (0.1, 0), (0.1, 1.5)):
        with pytest.raises(ValueError):
            function(np.ones((4, 4)), *setting)
    assert not function(np.zeros((4, 4)), 0.1, 1).any()
    assert not function(np.full((4, 4), np.nan), 0.1, 1).any()
    assert function(np.full((4, 4), 2.0, np.float32), 0.1, 3).all()


@pytest.mark.parametrize(
    ("dtype", "shift"), [("f4", (3, 2, 1)), ("f8", (0, 0, 0)), ("f8", (1e5, 0, 0)), ("f8", (1e6, 1e6, 0))]
)
def test_a_regular_ring_has_no_outliers_whatever_its_digits(dtype, shift):
    angle = np.radians(np.arange(360))
    ring = np.column_stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), np.zeros(360)]) + shift
    assert outliers.keep_by_statistics(ring.astype(dtype), k=2, std_ratio=1.0).all()


def test_open3d_leaves_out_a_neighbour_at_exactly_the_radius():
    grid = np.stack(np.meshgrid(*[np.arange(5.0)] * 3), axis=-1).reshape(-1, 3)
    assert outliers.keep_by_radius(grid, 1.0, 3).all()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(grid))
    assert len(cloud.remove_radius_outlier(3, 1.0)[1]) == 0


@pytest.mark.parametrize("far", [1.0, 70.0, 1000.0])
def test_a_lone_pixel_far_away_is_no_part_of_the_hole_beside_it(far):
    image = np.zeros((20, 20))
    image[10, 10] = far
    assert not depth_filters.keep_large_patches(image, tolerance=0.5, least=10).any()
