"""Benchmarks of lesson 04 and 05: voxel grid, normals, outliers, clusters, against Open3D's C++ on the same points.

Open3D's cloud is made before timing; everything else (trees, sorting, grids) is part of both sides.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d

from course_lib.bench import inputs
from course_lib.bench.compare import Case, Scaling
from course_lib.cloud import clusters, downsample, normals, outliers

VOXEL = 0.05
K = 20
STD_RATIO = 2.0
LEAST, RADIUS = 16, 0.2
CLUSTER_RADIUS = 0.15
NORMALS_K = 30
EXPONENT = 1.25
PER_AREA = 500.0  # points a square metre: 200,000 on 20 x 20 m


def _cloud(points: np.ndarray) -> o3d.geometry.PointCloud:
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


def _voxel() -> Case:
    points = inputs.field(1_000_000, 4)
    cloud = _cloud(points)
    # Open3D begins its grid half a voxel below the lowest point; we begin ours there, too
    origin = points.min(axis=0) - VOXEL / 2

    def agree() -> None:
        ours = downsample.voxel_downsample(points, VOXEL, origin)
        theirs = np.asarray(cloud.voxel_down_sample(VOXEL).points)
        assert len(ours) == len(theirs)
        # the same centroids; in another order
        a, b = (each[np.lexsort(np.round(each, 9).T)] for each in (ours, theirs))
        np.testing.assert_allclose(a, b, atol=1e-9)

    return Case(
        "voxel grid, 1M points, 0.05 m",
        0.7,
        lambda: downsample.voxel_downsample(points, VOXEL, origin),
        lambda: cloud.voxel_down_sample(VOXEL),
        "Open3D legacy voxel_down_sample, the same centroids",
        agree,
    )


def _statistical(points: np.ndarray, cloud: o3d.geometry.PointCloud) -> Case:
    def theirs() -> list[int]:
        return cloud.remove_statistical_outlier(K + 1, STD_RATIO)[1]

    def agree() -> None:
        np.testing.assert_array_equal(np.flatnonzero(outliers.keep_by_statistics(points, K, STD_RATIO)), theirs())

    return Case(
        f"statistical outliers, 200k points, {K} neighbours",
        0.9,
        lambda: outliers.keep_by_statistics(points, K, STD_RATIO),
        theirs,
        f"Open3D legacy remove_statistical_outlier({K + 1}), which counts the point itself; the same points kept",
        agree,
    )


def _radius(points: np.ndarray, cloud: o3d.geometry.PointCloud) -> Case:
    def theirs() -> list[int]:
        return cloud.remove_radius_outlier(LEAST, RADIUS)[1]

    def agree() -> None:
        np.testing.assert_array_equal(np.flatnonzero(outliers.keep_by_radius(points, RADIUS, LEAST)), theirs())

    return Case(
        f"radius outliers, 200k points, {LEAST} within {RADIUS} m",
        0.5,
        lambda: outliers.keep_by_radius(points, RADIUS, LEAST),
        theirs,
        f"Open3D legacy remove_radius_outlier({LEAST}), the same points kept",
        agree,
    )


def _clusters() -> Case:
    points = inputs.field_with_strays(100_000, 5, PER_AREA / 2)
    cloud = _cloud(points)

    def theirs() -> np.ndarray:
        return np.asarray(cloud.cluster_dbscan(CLUSTER_RADIUS, 1))

    def agree() -> None:
        ours, other = clusters.euclidean_clusters(points, CLUSTER_RADIUS), theirs()
        # the same partition: each label of one side goes with exactly one of the other
        pairs = np.unique(np.stack([ours, other]), axis=1)
        assert pairs.shape[1] == len(np.unique(ours)) == len(np.unique(other))

    return Case(
        f"Euclidean clusters, 100k points, {CLUSTER_RADIUS} m",
        1.0,
        lambda: clusters.euclidean_clusters(points, CLUSTER_RADIUS),
        theirs,
        "Open3D legacy cluster_dbscan(min_points=1), the same clusters",
        agree,
    )


def _normals() -> Case:
    points = inputs.field(200_000, 6)
    cloud = _cloud(points)

    def theirs() -> np.ndarray:
        cloud.normals = o3d.utility.Vector3dVector()
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NORMALS_K))
        return np.asarray(cloud.normals)

    def agree() -> None:
        turn = np.abs(np.einsum("ij,ij->i", normals.estimate_normals(points, NORMALS_K), theirs()))
        assert np.mean(turn > np.cos(np.radians(0.01))) > 0.999

    return Case(
        f"normals by covariance, 200k points, k {NORMALS_K}",
        1.3,
        lambda: normals.estimate_normals(points, NORMALS_K),
        theirs,
        "Open3D legacy estimate_normals, equal up to the sign",
        agree,
    )


def cases() -> list[Case]:
    """Return the benchmark's cases."""
    points = inputs.field_with_strays(200_000, 5)
    cloud = _cloud(points)
    return [_voxel(), _statistical(points, cloud), _radius(points, cloud), _normals(), _clusters()]


def scalings() -> list[Scaling]:
    """Return how each grows, at the density of its case."""

    def over(job, density: float, strays: bool = True):
        make = inputs.field_with_strays if strays else inputs.field

        def make_job(n: int):
            points = make(n, 9, density)
            return lambda: job(points)

        return make_job

    def grid(points: np.ndarray) -> np.ndarray:
        return downsample.voxel_downsample(points, VOXEL)

    return [
        Scaling("voxel grid", EXPONENT, over(grid, 2500.0, strays=False)),
        Scaling("normals", EXPONENT, over(lambda p: normals.estimate_normals(p, NORMALS_K), PER_AREA, strays=False)),
        Scaling("statistical outliers", EXPONENT, over(lambda p: outliers.keep_by_statistics(p, K), PER_AREA)),
        Scaling("radius outliers", EXPONENT, over(lambda p: outliers.keep_by_radius(p, RADIUS, LEAST), PER_AREA)),
        Scaling(
            "Euclidean clusters", EXPONENT, over(lambda p: clusters.euclidean_clusters(p, CLUSTER_RADIUS), PER_AREA / 2)
        ),
    ]
