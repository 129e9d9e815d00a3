"""Benchmark of lesson 06: a plane among stray points, against Open3D's C++ on the same points."""

from __future__ import annotations

import numpy as np
import open3d as o3d

from course_lib.bench import inputs
from course_lib.bench.compare import Case
from course_lib.bench.scaling import EXPONENT, Scaling, over
from course_lib.cloud import planes

THRESHOLD = 0.015  # metres, three times the noise
TRIALS = 256


def cases() -> list[Case]:
    points = inputs.plane_among_points(200_000, 7)
    legacy = inputs.open3d_cloud(points)
    tensor = o3d.t.geometry.PointCloud(o3d.core.Tensor(points.astype(np.float32)))

    def of(cloud: o3d.geometry.PointCloud | o3d.t.geometry.PointCloud) -> tuple:
        o3d.utility.random.seed(3)
        return cloud.segment_plane(THRESHOLD, 3, TRIALS)

    def agree() -> None:
        ours = int(np.count_nonzero(planes.find_plane(points, THRESHOLD)[1]))
        best = max(len(of(legacy)[1]), len(of(tensor)[1]))
        assert ours >= best, f"{ours} inliers, Open3D found {best}"

    return [
        Case(
            "plane by RANSAC, 200k points, 60 % inliers",
            (0.9, 0.5),
            lambda: planes.find_plane(points, THRESHOLD),
            {"Open3D": lambda: of(legacy), "Open3D tensor": lambda: of(tensor)},
            f"segment_plane({TRIALS} samples); ours has at least the inliers of the better one",
            agree,
        )
    ]


def scalings() -> list[Scaling]:
    job = over(inputs.plane_among_points, lambda points: planes.find_plane(points, THRESHOLD))
    return [Scaling("plane by RANSAC", EXPONENT, job)]
