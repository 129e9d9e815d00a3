"""Inputs of the benchmarks of lessons 04 to 07: a height field with noise, stray points, and a plane among them."""

from __future__ import annotations

import numpy as np
import open3d as o3d

NOISE = 0.01  # metres
SIDE = 20.0  # metres, at DENSITY_POINTS points
STRAY = 0.02  # share of points anywhere in a box
BOX = 12.0  # metres high


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The surface z(x, y), metres."""
    return 0.8 * np.sin(0.9 * x) * np.cos(0.7 * y) + 0.3 * np.sin(2.3 * x + 1.1 * y)


def slope_normals(points: np.ndarray) -> np.ndarray:
    """The true upward normals of the surface at points (N, 3)."""
    x, y = points[:, 0], points[:, 1]
    dx = 0.72 * np.cos(0.9 * x) * np.cos(0.7 * y) + 0.69 * np.cos(2.3 * x + 1.1 * y)
    dy = -0.56 * np.sin(0.9 * x) * np.sin(0.7 * y) + 0.33 * np.cos(2.3 * x + 1.1 * y)
    normals = np.stack([-dx, -dy, np.ones_like(dx)], axis=1)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def field(n: int, seed: int, per_area: float | None = None, noise: float = NOISE) -> np.ndarray:
    """(n, 3) points of the surface with noise on 20 x 20 m; with `per_area` points a square metre, on a fitting square.

    A fixed density is what makes times of different n comparable: each point then has as many neighbours.
    """
    rng = np.random.default_rng(seed)
    side = SIDE if per_area is None else np.sqrt(n / per_area)
    x, y = rng.uniform(0, side, (2, n))
    return np.stack([x, y, height(x, y) + rng.normal(0, noise, n)], axis=1)


def field_with_strays(n: int, seed: int, per_area: float | None = None) -> np.ndarray:
    """The surface, of which a share of points is replaced by points anywhere in a box over it."""
    points = field(n, seed, per_area)
    rng = np.random.default_rng([seed, 1])
    stray = rng.permutation(n)[: round(STRAY * n)]
    side = SIDE if per_area is None else np.sqrt(n / per_area)
    points[stray] = rng.uniform((0, 0, -BOX / 2), (side, side, BOX / 2), (len(stray), 3))
    return points


def plane_among_points(n: int, seed: int, share: float = 0.6, noise: float = 0.005) -> np.ndarray:
    """(n, 3) points of which a share lie on a tilted plane with noise, the others anywhere around it."""
    rng = np.random.default_rng(seed)
    inside = round(share * n)
    xy = rng.uniform(-5, 5, (inside, 2))
    on = np.column_stack([xy, 0.3 * xy[:, 0] - 0.2 * xy[:, 1] + 1.0 + rng.normal(0, noise, inside)])
    off = rng.uniform((-5, -5, -3), (5, 5, 5), (n - inside, 3))
    return rng.permutation(np.vstack([on, off]))


def open3d_cloud(points: np.ndarray) -> o3d.geometry.PointCloud:
    """Open3D's legacy cloud of points (N, 3)."""
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
