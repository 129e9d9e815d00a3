"""Benchmarks of lesson 04: the voxel grid and normals, against Open3D's and small_gicp's C++ on the same points.

Their clouds are made before timing, except that small_gicp's normals include its cloud and its tree, as ours do.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d
import small_gicp

from course_lib.bench import inputs
from course_lib.bench.compare import Case
from course_lib.bench.scaling import EXPONENT, Scaling, over
from course_lib.cloud import downsample, normals
from course_lib.compiled import threads

VOXEL = 0.05
NORMALS_K = 30
PER_AREA = 500.0  # points a square metre: 200,000 on 20 x 20 m


def _voxel() -> Case:
    points = inputs.field(1_000_000, 4)
    cloud = inputs.open3d_cloud(points)
    # Open3D begins its grid half a voxel below the lowest point; we begin ours there, too
    origin = points.min(axis=0) - VOXEL / 2

    def agree() -> None:
        ours = downsample.voxel_downsample(points, VOXEL, origin)
        theirs = np.asarray(cloud.voxel_down_sample(VOXEL).points)
        assert len(ours) == len(theirs)
        # the same centroids; in another order
        a, b = (each[np.lexsort(np.round(each, 9).T)] for each in (ours, theirs))
        np.testing.assert_allclose(a, b, atol=1e-9)
        # small_gicp's grid begins at 0, and on several threads some cubes are given out twice
        few, more = len(downsample.voxel_downsample(points, VOXEL)), len(small_gicp.voxelgrid_sampling(points, VOXEL))
        assert abs(more - few) <= 0.001 * few, (more, few)

    return Case(
        "voxel grid, 1M points, 0.05 m",
        (0.9, 0.8),
        lambda: downsample.voxel_downsample(points, VOXEL, origin),
        {
            "Open3D": lambda: cloud.voxel_down_sample(VOXEL),
            "small_gicp": lambda: small_gicp.voxelgrid_sampling(points, VOXEL, num_threads=threads()),
        },
        "Open3D's legacy voxel_down_sample, the same centroids; small_gicp's voxelgrid_sampling, as many",
        agree,
    )


def _normals() -> Case:
    points = inputs.field(200_000, 6)
    cloud = inputs.open3d_cloud(points)

    def of_open3d() -> np.ndarray:
        cloud.normals = o3d.utility.Vector3dVector()
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NORMALS_K))
        return np.asarray(cloud.normals)

    def of_small_gicp() -> small_gicp.PointCloud:
        other = small_gicp.PointCloud(points)
        small_gicp.estimate_normals(other, num_neighbors=NORMALS_K, num_threads=threads())
        return other

    def agree() -> None:
        ours = normals.estimate_normals(points, NORMALS_K)
        for theirs in (of_open3d(), of_small_gicp().normals()[:, :3]):
            turn = np.abs(np.einsum("ij,ij->i", ours, theirs))
            assert np.mean(turn > np.cos(np.radians(0.01))) > 0.999

    return Case(
        f"normals by covariance, 200k points, k {NORMALS_K}",
        (0.9, 0.5),
        lambda: normals.estimate_normals(points, NORMALS_K),
        {"Open3D": of_open3d, "small_gicp": of_small_gicp},
        "Open3D's legacy estimate_normals, small_gicp's estimate_normals, both equal to ours up to the sign",
        agree,
    )


def cases() -> list[Case]:
    return [_voxel(), _normals()]


def scalings() -> list[Scaling]:
    voxels = over(inputs.field, lambda points: downsample.voxel_downsample(points, VOXEL), per_area=2500.0)
    turned = over(inputs.field, lambda points: normals.estimate_normals(points, NORMALS_K), per_area=PER_AREA)
    return [Scaling("voxel grid", EXPONENT, voxels), Scaling("normals", EXPONENT, turned)]
