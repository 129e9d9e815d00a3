"""Small things to show in tests, whose every number can be done in the head."""

from __future__ import annotations

import numpy as np

from course_lib.cloud.pointcloud import PointCloud
from course_lib.surface.meshes import Mesh


def box_cloud(n: int = 11) -> PointCloud:
    """n³ points on a grid that fills 2 x 1 x 0.5 m, its lower corner at the origin, z up."""
    axes = np.meshgrid(np.linspace(0, 2, n), np.linspace(0, 1, n), np.linspace(0, 0.5, n), indexing="ij")
    return PointCloud(np.stack(axes, axis=-1).reshape(-1, 3))


def wall_cloud() -> PointCloud:
    """A coloured wall 2 m ahead of a camera at the origin, 2 m wide and 1 m high: red left, green right."""
    x, y = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-0.5, 0.5, 41))
    points = np.stack([x, y, np.full_like(x, 2.0)], axis=-1).reshape(-1, 3)
    colors = np.where(points[:, :1] < 0, [[200, 0, 0]], [[0, 160, 0]]).astype(np.uint8)
    return PointCloud(points, colors)


def square_mesh() -> Mesh:
    """Two triangles that make a 1 m square on the floor, seen from above."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
    return Mesh(vertices, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32))


def straight_path(n: int = 5) -> list[np.ndarray]:
    """n poses along x, 1 m from the first to the last, that look along z."""
    poses = [np.eye(4) for _ in range(n)]
    for pose, x in zip(poses, np.linspace(0, 1, n), strict=True):
        pose[0, 3] = x
    return poses
