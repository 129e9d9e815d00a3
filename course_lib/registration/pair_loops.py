"""The loops over pairs of points: sums from which a rigid motion follows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from course_lib.compiled import FLOATS, INTS, ROWS, compiled

__all__ = ["add_pairs", "add_planes", "move"]


@compiled(f"void({ROWS}, {ROWS}, {INTS}, {FLOATS}, int64, int64, float64[:, ::1])")
def add_pairs(
    p: NDArray[np.float64],
    q: NDArray[np.float64],
    place: NDArray[np.int64],
    weight: NDArray[np.float64],
    start: int,
    stop: int,
    sums: NDArray[np.float64],
) -> None:
    """Add Σ w (q, 1) (p, 1)ᵀ over the pairs of a part to (4, 4) sums; q[place[i]] belongs to p[i]."""
    w_ = px = py = pz = qx = qy = qz = xx = xy = xz = yx = yy = yz = zx = zy = zz = 0.0
    for i in range(start, stop):
        w, j = weight[i], place[i]
        if w > 0:
            x, y, z = p[i, 0], p[i, 1], p[i, 2]
            a, b, c = w * q[j, 0], w * q[j, 1], w * q[j, 2]
            xx, xy, xz, qx = xx + a * x, xy + a * y, xz + a * z, qx + a
            yx, yy, yz, qy = yx + b * x, yy + b * y, yz + b * z, qy + b
            zx, zy, zz, qz = zx + c * x, zy + c * y, zz + c * z, qz + c
            px, py, pz, w_ = px + w * x, py + w * y, pz + w * z, w_ + w
    for row, (a, b, c, d) in enumerate(((xx, xy, xz, qx), (yx, yy, yz, qy), (zx, zy, zz, qz), (px, py, pz, w_))):
        sums[row, 0] += a
        sums[row, 1] += b
        sums[row, 2] += c
        sums[row, 3] += d


@compiled(f"void({ROWS}, {ROWS}, {ROWS}, {INTS}, {FLOATS}, int64, int64, float64[:, ::1])")
def add_planes(
    p: NDArray[np.float64],
    q: NDArray[np.float64],
    normals: NDArray[np.float64],
    place: NDArray[np.int64],
    weight: NDArray[np.float64],
    start: int,
    stop: int,
    sums: NDArray[np.float64],
) -> None:
    """Add Σ w a aᵀ, upper half, with a = (p x n, n, n · (q - p)), and below it Σ w (p, 1, |p|²), to (8, 7) sums."""
    a = np.empty(7)
    for i in range(start, stop):
        if weight[i] > 0:
            x, y, z, j = p[i, 0], p[i, 1], p[i, 2], place[i]
            nx, ny, nz = normals[j, 0], normals[j, 1], normals[j, 2]
            a[0], a[1], a[2] = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
            a[3], a[4], a[5] = nx, ny, nz
            a[6] = nx * (q[j, 0] - x) + ny * (q[j, 1] - y) + nz * (q[j, 2] - z)
            for row in range(7):
                w = weight[i] * a[row]
                for column in range(row, 7):
                    sums[row, column] += w * a[column]
            w = weight[i]
            sums[7, 0] += w * x
            sums[7, 1] += w * y
            sums[7, 2] += w * z
            sums[7, 3] += w
            sums[7, 4] += w * (x * x + y * y + z * z)


@compiled(f"void({ROWS}, {ROWS}, int64, int64, float64[:, ::1])")
def move(
    T: NDArray[np.float64], points: NDArray[np.float64], start: int, stop: int, moved: NDArray[np.float64]
) -> None:
    """Write T (4, 4) applied to some points."""
    for i in range(start, stop):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for row in range(3):
            moved[i, row] = T[row, 0] * x + T[row, 1] * y + T[row, 2] * z + T[row, 3]
