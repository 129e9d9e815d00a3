"""Benchmarks of lesson 05: outliers and clusters, against Open3D's C++ on the same points.

Open3D's cloud is made before timing; everything else (trees, sorting, grids) is part of both sides.
"""

from __future__ import annotations

import numpy as np

from course_lib.bench import inputs
from course_lib.bench.compare import Case
from course_lib.bench.scaling import EXPONENT, Scaling, over
from course_lib.cloud import clusters, outliers

K = 20
STD_RATIO = 2.0
LEAST, RADIUS = 16, 0.2
CLUSTER_RADIUS = 0.15
PER_AREA = 500.0  # points a square metre: 200,000 on 20 x 20 m


def _outliers() -> list[Case]:
    points = inputs.field_with_strays(200_000, 5)
    cloud = inputs.open3d_cloud(points)
    asked = {
        f"statistical outliers, 200k points, {K} neighbours": (
            lambda: outliers.keep_by_statistics(points, K, STD_RATIO),
            lambda: cloud.remove_statistical_outlier(K + 1, STD_RATIO)[1],
            f"Open3D's legacy remove_statistical_outlier({K + 1}), which counts the point itself; the same points kept",
        ),
        f"radius outliers, 200k points, {LEAST} within {RADIUS} m": (
            lambda: outliers.keep_by_radius(points, RADIUS, LEAST),
            lambda: cloud.remove_radius_outlier(LEAST, RADIUS)[1],
            f"Open3D's legacy remove_radius_outlier({LEAST}), the same points kept",
        ),
    }
    return [
        Case(
            name,
            (0.9, 0.5),
            ours,
            {"Open3D": theirs},
            note,
            lambda ours=ours, theirs=theirs: np.testing.assert_array_equal(np.flatnonzero(ours()), theirs()),
        )
        for name, (ours, theirs, note) in asked.items()
    ]


def _clusters() -> Case:
    points = inputs.field_with_strays(100_000, 5, PER_AREA / 2)
    cloud = inputs.open3d_cloud(points)

    def theirs() -> np.ndarray:
        return np.asarray(cloud.cluster_dbscan(CLUSTER_RADIUS, 1))

    def agree() -> None:
        ours, other = clusters.euclidean_clusters(points, CLUSTER_RADIUS), theirs()
        # the same partition: each label of one side goes with exactly one of the other
        pairs = np.unique(np.stack([ours, other]), axis=1)
        assert pairs.shape[1] == len(np.unique(ours)) == len(np.unique(other))

    return Case(
        f"Euclidean clusters, 100k points, {CLUSTER_RADIUS} m",
        (0.9, 0.5),
        lambda: clusters.euclidean_clusters(points, CLUSTER_RADIUS),
        {"Open3D": theirs},
        "Open3D's legacy cluster_dbscan(min_points=1), the same clusters",
        agree,
    )


def cases() -> list[Case]:
    return [*_outliers(), _clusters()]


def scalings() -> list[Scaling]:
    asked = {
        "statistical outliers": (PER_AREA, lambda points: outliers.keep_by_statistics(points, K)),
        "radius outliers": (PER_AREA, lambda points: outliers.keep_by_radius(points, RADIUS, LEAST)),
        "Euclidean clusters": (PER_AREA / 2, lambda points: clusters.euclidean_clusters(points, CLUSTER_RADIUS)),
    }
    return [
        Scaling(name, EXPONENT, over(inputs.field_with_strays, job, per_area=density))
        for name, (density, job) in asked.items()
    ]
