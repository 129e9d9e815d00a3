"""Closed triangle meshes from implicit surfaces: functions that are negative inside and positive outside.

References
----------
Gibson, "Constrained elastic surface nets", MICCAI 1998.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Implicit = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Solid:
    """A closed triangle surface: ``vertices`` (V, 3) float64, ``triangles`` (T, 3) int32, unit ``normals`` (V, 3), and
    ``part`` (V,) uint8, the number of the part of the shape that each vertex belongs to."""

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    part: np.ndarray

    def placed(self, T: np.ndarray, scale: float = 1.0) -> Solid:
        """The solid after scaling about its origin and the rigid motion ``T`` (4, 4)."""
        moved = rotate(T, self.vertices * scale) + T[:3, 3]
        return Solid(moved, self.triangles, rotate(T, self.normals), self.part)


def rotate(T: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Turn vectors (..., 3) by the rotation of ``T`` (4, 4)."""
    # Written out, because a BLAS product may differ in the last bit with the number of threads.
    return sum(vectors[..., k, None] * T[:3, k] for k in range(3))


def closed_surface(distance: Implicit, low: Sequence[float], high: Sequence[float], spacing: float) -> tuple:
    """The zero set of a function as a closed mesh by surface nets: one vertex in each grid cell that it crosses.

    Parameters
    ----------
    distance : maps points (N, 3) to values, negative inside; positive on the faces of the box ``low``–``high``.
    spacing : edge of a grid cell, metres.

    Returns
    -------
    vertices (V, 3) float64 on the zero set, triangles (T, 3) int32, counter-clockwise from outside.

    Raises
    ------
    ValueError
        If the surface leaves the box, or is not in it.
    """
    inside, corner = _inside(distance, np.asarray(low, float), np.asarray(high, float), spacing)
    _fill_doubtful_corners(inside)
    rim = inside.copy()
    rim[1:-1, 1:-1, 1:-1] = False
    if rim.any() or not inside.any():
        raise ValueError("The surface must lie inside the box; give a box that holds all of it.")
    count = sum(
        inside[i : i + inside.shape[0] - 1, j : j + inside.shape[1] - 1, k : k + inside.shape[2] - 1].astype(np.int8)
        for i in (0, 1)
        for j in (0, 1)
        for k in (0, 1)
    )
    crossed = (count > 0) & (count < 8)
    number = np.full(crossed.shape, -1, np.int64)
    number[crossed] = np.arange(np.count_nonzero(crossed))
    vertices = corner + spacing * (np.argwhere(crossed) + 0.5)
    quads = []
    for axis in range(3):
        low_end, high_end = inside.swapaxes(0, axis)[:-1], inside.swapaxes(0, axis)[1:]
        for leaving, order in ((low_end & ~high_end, (0, 1, 2, 3)), (~low_end & high_end, (3, 2, 1, 0))):
            i, j, k = np.nonzero(leaving)
            around = [(0, -1, -1), (0, 0, -1), (0, 0, 0), (0, -1, 0)]  # the four cells that share this grid edge
            cells = number.swapaxes(0, axis)
            ring = np.stack([cells[i, j + dj, k + dk] for _, dj, dk in around], -1)
            quads.append(ring[:, list(order if axis == 0 else order[::-1])])
    quads = np.concatenate(quads)
    for _ in range(4):  # even out the triangles, then fall back onto the surface
        vertices = _neighbour_mean(vertices, quads)
        vertices = _onto_surface(distance, vertices, spacing)
    vertices = _onto_surface(distance, vertices, spacing)
    a, b, c, d = (vertices[quads[:, n]] for n in range(4))
    cut = np.sum((a - c) ** 2, 1) <= np.sum((b - d) ** 2, 1)  # along the shorter diagonal
    first, second = np.where(cut[:, None], quads[:, [0, 1, 2]], quads[:, [1, 2, 3]]), quads[:, [0, 2, 3]]
    second = np.where(cut[:, None], second, quads[:, [1, 3, 0]])
    return vertices, np.concatenate([first, second]).astype(np.int32)


def _inside(distance: Implicit, low: np.ndarray, high: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Signs on a grid, computed only where a four times coarser grid says that the surface may be near."""
    coarse = 4
    cells = np.ceil((high - low) / (coarse * spacing)).astype(int) + 1
    at = low + coarse * spacing * np.stack(np.meshgrid(*map(np.arange, cells + 1), indexing="ij"), -1)
    rough = distance(at.reshape(-1, 3)).reshape(cells + 1)
    inside = rough < 0
    for axis in range(3):  # grid points 4i … 4i + 3 take the sign of coarse point i, until they are computed
        inside = np.repeat(inside, coarse, axis=axis)
    near = np.abs(rough) < 2.2 * coarse * spacing
    block = np.stack(np.meshgrid(*[range(coarse)] * 3), -1).reshape(-1, 3)
    index = (coarse * np.argwhere(near)[:, None] + block).reshape(-1, 3)
    inside[tuple(index.T)] = distance(low + spacing * index) < 0
    return inside, low


def _fill_doubtful_corners(inside: np.ndarray) -> None:
    """Fill, in place, grid points where two corners of the inside touch only across a face or a cell: the surface would
    touch itself there, and an edge would belong to four triangles."""

    def part(offset: tuple[int, ...]) -> np.ndarray:
        ends = zip(offset, inside.shape, strict=True)
        return inside[tuple(slice(o, n - 1 + o) if o >= 0 else slice(None) for o, n in ends)]

    faces = [[tuple(np.insert(corner, axis, -1)) for corner in ((0, 0), (0, 1), (1, 1), (1, 0))] for axis in range(3)]
    diagonals = [((0, j, k), (1, 1 - j, 1 - k)) for j in (0, 1) for k in (0, 1)]
    before = -1
    while before != (before := np.count_nonzero(inside)):
        for a, b, c, d in faces:
            for one, two, other, last in ((a, c, b, d), (b, d, a, c)):
                part(other)[...] |= part(one) & part(two) & ~part(other) & ~part(last)
        count = sum(part((i, j, k)).astype(np.int8) for i in (0, 1) for j in (0, 1) for k in (0, 1))
        for one, two in diagonals:
            both, none = part(one) & part(two), ~part(one) & ~part(two)
            part((one[0], one[1], two[2]))[...] |= both & (count == 2)
            part(one)[...] |= none & (count == 6)


def _neighbour_mean(vertices: np.ndarray, quads: np.ndarray) -> np.ndarray:
    n = len(vertices)
    total, times = np.zeros((n, 3)), np.zeros(n)
    for step in (1, 3):
        target, source = quads.ravel(), np.roll(quads, -step, axis=1).ravel()
        times += np.bincount(target, minlength=n)
        for k in range(3):
            total[:, k] += np.bincount(target, vertices[source, k], minlength=n)
    return total / times[:, None]


def gradient(distance: Implicit, points: np.ndarray, step: float = 1e-4) -> np.ndarray:
    """Central differences of a function of points (N, 3)."""
    offsets = step * np.eye(3)
    return np.stack([(distance(points + o) - distance(points - o)) / (2 * step) for o in offsets], -1)


def _onto_surface(distance: Implicit, points: np.ndarray, spacing: float) -> np.ndarray:
    """One Newton step along the gradient, no longer than a grid cell."""
    slope = gradient(distance, points, spacing / 20)
    move = distance(points)[:, None] * slope / np.maximum(np.sum(slope * slope, -1, keepdims=True), 0.04)
    length = np.linalg.norm(move, axis=1, keepdims=True)
    return points - move * np.minimum(1, spacing / np.maximum(length, 1e-12))
