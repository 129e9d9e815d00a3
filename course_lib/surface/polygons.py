"""Faces of more than three corners, split into triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks


def triangulate(vertices: ArrayLike, polygons: ArrayLike) -> NDArray[np.int64]:
    """Split polygons of the same number of corners into triangles that keep their sense of rotation.

    A polygon that bulges everywhere becomes a fan about its first corner. Of others, ears are cut off: corners that
    bulge and whose triangle holds no other corner.

    Parameters
    ----------
    vertices : (V, 3) metres.
    polygons : (F, n) indices of vertices, n ≥ 3, around each face; nearly plane.

    Returns
    -------
    (F (n − 2), 3) indices of vertices, polygon after polygon.

    Raises
    ------
    ValueError
        If a polygon has fewer than three corners.

    References
    ----------
    G. H. Meisters, Polygons have ears, American Mathematical Monthly, 1975.

    Examples
    --------
    >>> triangulate([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]).tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    points = checks.cloud_points(vertices, "vertices").astype(np.float64)
    corners = checks.numbers(polygons, "polygons").astype(np.int64)
    if corners.ndim != 2 or corners.shape[1] < 3:
        raise ValueError(f"polygons: expected (F, n) with at least three corners, got shape {corners.shape}.")
    fans = np.stack([np.repeat(corners[:, :1], corners.shape[1] - 2, 1), corners[:, 1:-1], corners[:, 2:]], 2)
    placed = points[corners] - points[corners[:, :1]]
    normals = np.cross(placed, np.roll(placed, -1, axis=1)).sum(axis=1)
    sides = np.roll(placed, -1, axis=1) - placed
    turns = np.einsum("fnk,fk->fn", np.cross(np.roll(sides, 1, axis=1), sides), normals)
    for i in np.flatnonzero((turns < 0).any(axis=1)):
        fans[i] = corners[i][_ears(placed[i], normals[i])]
    return fans.reshape(-1, 3)


def _ears(points: NDArray[np.float64], normal: NDArray[np.float64]) -> list[list[int]]:
    """Triangles of one polygon, by the numbers of its corners; where no ear is left (it crosses itself), a fan."""
    left, triangles = list(range(len(points))), []
    while len(left) > 3:
        for i, b in enumerate(left):
            a, c = left[i - 1], left[(i + 1) % len(left)]
            others = points[[one for one in left if one not in (a, b, c)]]
            sides = [
                np.cross(q - p, others - p) @ normal for p, q in zip(points[[a, b, c]], points[[b, c, a]], strict=True)
            ]
            bulges = np.cross(points[b] - points[a], points[c] - points[b]) @ normal > 0
            if bulges and not np.all(np.array(sides) >= 0, axis=0).any():
                break
        else:
            break
        triangles.append([a, b, c])
        left.remove(b)
    return triangles + [[left[0], *pair] for pair in zip(left[1:], left[2:], strict=False)]
