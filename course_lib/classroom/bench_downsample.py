"""The benchmarks of `course_lib.downsample` and `course_lib.normals`: a height field, against Open3D's legacy code.

Both sides get the same float64 points. Open3D's cloud is made before the clock starts, so that copying points into it
is not charged to it; ours converts nothing. Sorting and the building of trees are charged to both.
"""

from __future__ import annotations

import os

import numpy as np
import open3d as o3d

from course_lib import downsample, normals
from course_lib.classroom.bench import Case, Scaling

SEED = 4
SIDE = 20.0  # metres
NOISE = 0.01  # metres
VOXEL = 0.05  # metres
K = 30
DENSITY = 1_000_000 / SIDE**2  # points a square metre, of every size


def height_field(count: int, side: float = SIDE, seed: int = SEED) -> np.ndarray:
    """Return (count, 3) float64 points of a wavy ground, metres, with 1 cm noise in z."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, side, (2, count))
    z = 0.8 * np.sin(0.9 * x) * np.cos(0.7 * y) + 0.3 * np.sin(2.3 * x + 1.1 * y) + NOISE * rng.standard_normal(count)
    return np.stack([x, y, z], axis=1)


def _threads() -> int:
    """As many as this process was given processors."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else -1


def _sorted(points: np.ndarray) -> np.ndarray:
    return points[np.lexsort(np.round(points, 6).T)]


def voxel_case(count: int = 1_000_000) -> Case:
    """The voxel grid: the same cubes, and so the same set of centroids."""
    points = height_field(count)
    origin = points.min(axis=0) - VOXEL / 2  # Open3D's own
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))

    def agree() -> None:
        ours = downsample.voxel_centroids(points, VOXEL, origin)
        theirs = np.asarray(cloud.voxel_down_sample(VOXEL).points)
        assert ours.shape == theirs.shape
        np.testing.assert_allclose(_sorted(ours), _sorted(theirs), rtol=0, atol=1e-9)

    return Case(
        f"voxel grid, {count:,} points, centroids",
        0.7,
        lambda: downsample.voxel_centroids(points, VOXEL, origin),
        lambda: cloud.voxel_down_sample(VOXEL),
        "Open3D legacy voxel_down_sample, same cubes",
        agree,
    )


def normals_case(count: int = 200_000) -> Case:
    """Normals: the same up to their sign."""
    points = height_field(count)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    search = o3d.geometry.KDTreeSearchParamKNN(K)

    def agree() -> None:
        ours = normals.estimate_normals(points, K)
        cloud.estimate_normals(search)
        cosine = np.abs(np.einsum("ni,ni->n", ours, np.asarray(cloud.normals)))
        assert cosine.min() > 1 - 1e-9

    return Case(
        f"normals, {count:,} points, k {K}",
        1.3,
        lambda: normals.estimate_normals(points, K, workers=_threads()),
        lambda: cloud.estimate_normals(search),
        "Open3D legacy estimate_normals, same k",
        agree,
    )


def cases() -> list[Case]:
    """Return the benchmark's cases."""
    return [voxel_case(), normals_case()]


def scalings() -> list[Scaling]:
    """Return how time grows: the field is made wider, never denser."""

    def voxel_grid(count: int):
        points = height_field(count, float(np.sqrt(count / DENSITY)))
        return lambda: downsample.voxel_centroids(points, VOXEL)

    def normal_vectors(count: int):
        points = height_field(count, float(np.sqrt(count / DENSITY)))
        return lambda: normals.estimate_normals(points, K, workers=_threads())

    return [
        Scaling("voxel grid, centroids", 1.25, voxel_grid),
        Scaling(f"normals, k {K}", 1.25, normal_vectors),
    ]
