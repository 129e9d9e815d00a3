"""Fewer points, chosen so that one can say what was lost: voxel grids, and random, uniform and farthest-point samples.

A voxel grid cuts space into cubes and keeps one point for each cube that holds any. Where its cubes begin is part of
the answer, so the origin stands in every signature: by default the origin of the frame, so that two clouds in one
frame share their cubes. Open3D begins half a voxel below the smallest coordinates: pass
`origin=points.min(axis=0) - voxel / 2` to get its cubes.

Samples that need no cubes are in `course_lib.sampling` and are offered here, too.

The cubes are numbered, number and index of each point are packed into one integer, and these are sorted: memory grows
with the points, never with the volume.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.neighbours import finite_points
from course_lib.pointcloud import PointCloud
from course_lib.sampling import farthest_points, random_points, uniform_points

__all__ = [
    "farthest_points", "random_points", "uniform_points", "voxel_cells", "voxel_centroids", "voxel_cloud",
    "voxel_nearest",
]  # fmt: skip

MOST = 2.0**52  # a cell's number beyond this has no exact neighbour in float64
BITS = 63  # of a non-negative int64

Indices = NDArray[np.intp]
Floats = NDArray[np.float64]


class _Groups(NamedTuple):
    """Points sorted by cell: `order[start[i]:start[i] + count[i]]` are the points of cell i, by ascending index."""

    order: Indices
    start: Indices
    count: Indices


def voxel_cells(points: ArrayLike, voxel: float, origin: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[np.int64]:
    """Return the cube that each point lies in, as whole numbers of voxels from the origin along x, y and z.

    A point on a face belongs to the cube on the face's upper side. Numbers below the origin are negative.

    Parameters
    ----------
    points : (N, 3) float, metres, finite.
    voxel : edge of a cube, metres.
    origin : (3,) a corner of the cube numbered 0, 0, 0, metres, in the frame of the points.

    Returns
    -------
    (N, 3) int64.

    Raises
    ------
    ValueError
        If the input is of another form, or the voxel is too small to count cubes of at these coordinates.

    Examples
    --------
    >>> voxel_cells([[0.9, 0.0, -0.1]], 0.5).tolist()
    [[1, 0, -1]]
    """
    return np.stack(_cells(finite_points(points), _voxel(voxel), checks.vector(origin, 3, "origin")), axis=1)


def voxel_centroids(points: ArrayLike, voxel: float, origin: ArrayLike = (0.0, 0.0, 0.0)) -> Floats:
    """Return the mean of the points of each cube that holds any.

    Parameters
    ----------
    points, voxel, origin : as in `voxel_cells`.

    Returns
    -------
    (M, 3) float64, metres, M ≤ N, ordered by cube: along x, then y, then z.

    Raises
    ------
    ValueError
        As `voxel_cells`.

    References
    ----------
    Rusu and Cousins, 3D is here: Point Cloud Library (PCL), ICRA 2011 (its VoxelGrid filter).

    Examples
    --------
    >>> voxel_centroids([[0.1, 0, 0], [0.3, 0, 0], [0.6, 0, 0]], 0.5).tolist()
    [[0.2, 0.0, 0.0], [0.6, 0.0, 0.0]]
    """
    array = finite_points(points)
    return _means(array, _groups(array, voxel, origin))


def voxel_nearest(points: ArrayLike, voxel: float, origin: ArrayLike = (0.0, 0.0, 0.0)) -> Indices:
    """Return the index of the point nearest to the centre of its cube, for each cube that holds any.

    What is kept are measured points, with everything that belongs to them: `cloud.select(voxel_nearest(...))`.

    Parameters
    ----------
    points, voxel, origin : as in `voxel_cells`.

    Returns
    -------
    (M,) indices, ordered by cube; of points equally near, the first.

    Raises
    ------
    ValueError
        As `voxel_cells`.

    Examples
    --------
    >>> voxel_nearest([[0.1, 0.2, 0.2], [0.3, 0.2, 0.2], [0.9, 0.2, 0.2]], 0.5).tolist()
    [1, 2]
    """
    array = finite_points(points)
    groups = _groups(array, voxel, origin)
    corner, edge = checks.vector(origin, 3, "origin"), _voxel(voxel)
    offset = np.stack(_cells(array, edge, corner), axis=1).astype(np.float64)
    offset = (array - corner) - (offset + 0.5) * edge
    off = np.einsum("ni,ni->n", offset, offset)[groups.order]
    least = np.minimum.reduceat(off, groups.start)
    places = np.flatnonzero(off == np.repeat(least, groups.count))
    first = np.searchsorted(places, groups.start)  # the first place at or after the start of each cube is its own
    return groups.order[places[first]]


def voxel_cloud(
    cloud: PointCloud | ArrayLike,
    voxel: float,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    keep: Literal["centroid", "nearest"] = "centroid",
) -> PointCloud:
    """Return a cloud of one point a cube, with its colours and normals.

    Parameters
    ----------
    cloud : PointCloud, or (N, 3) points in metres, finite.
    voxel, origin : as in `voxel_cells`.
    keep : "centroid" takes means of places, colours and normals; "nearest" the measured point nearest to the centre.

    Returns
    -------
    PointCloud. A mean normal has length 1, and is NaN where normals cancel.

    Raises
    ------
    ValueError
        As `voxel_cells`; if `keep` is another word; if labels would have to be averaged.

    Examples
    --------
    >>> voxel_cloud([[0.1, 0, 0], [0.3, 0, 0]], 0.5).points.tolist()
    [[0.2, 0.0, 0.0]]
    """
    if keep not in ("centroid", "nearest"):
        raise ValueError(f"keep: {keep!r} is no way to choose; {checks.nearest_name(keep, ['centroid', 'nearest'])}")
    cloud = cloud if isinstance(cloud, PointCloud) else PointCloud(cloud)
    if keep == "nearest":
        return cloud.select(voxel_nearest(cloud.points, voxel, origin))
    if cloud.labels is not None:
        raise ValueError("cloud: labels have no mean; pass keep='nearest', or leave them out.")
    array = finite_points(cloud.points)
    groups = _groups(array, voxel, origin)
    colors = normals = None
    if cloud.colors is not None:
        colors = np.rint(_means(cloud.colors.astype(np.float64), groups)).astype(np.uint8)
    if cloud.normals is not None:
        normals = _means(cloud.normals.astype(np.float64), groups)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, length, out=np.full_like(normals, np.nan), where=length > 1e-12)
    return PointCloud(_means(array, groups), colors, normals)


def _cells(points: Floats, voxel: float, origin: Floats) -> list[NDArray[np.int64]]:
    """The cell numbers along each axis; rounded down, as int() would put both sides of the origin into one cell."""
    cells = []
    for axis in range(3):
        cell = points[:, axis] - origin[axis]
        with np.errstate(over="ignore"):
            cell /= voxel
        np.floor(cell, out=cell)
        if not (cell.min() > -MOST and cell.max() < MOST):
            raise ValueError(f"voxel: {voxel:g} is too small to count cubes over these coordinates; take a larger one.")
        cells.append(cell.astype(np.int64))
    return cells


def _groups(points: Floats, voxel: float, origin: ArrayLike) -> _Groups:
    cells = _cells(points, _voxel(voxel), checks.vector(origin, 3, "origin"))
    size = len(points)
    low_bits = max(size - 1, 1).bit_length()
    key, room = np.zeros(size, dtype=np.int64), 1
    for cell in cells:
        low = int(cell.min())
        width = int(cell.max()) - low + 1
        if room * width >= 1 << (BITS - low_bits):  # too many cubes for one number: count only those that hold points
            key, room = _ranked(key)
        if room * width >= 1 << (BITS - low_bits):
            cell, width = _ranked(cell)
            low = 0
        key *= width
        key += cell
        key -= low
        room *= width
    if room >= 1 << (BITS - low_bits):
        key, room = _ranked(key)
    key <<= low_bits
    key |= np.arange(size)
    key.sort()
    order = (key & ((1 << low_bits) - 1)).astype(np.intp)
    key >>= low_bits
    start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    return _Groups(order, start, np.diff(start, append=size))


def _ranked(numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """The same order with smaller numbers: the rank of each among those that occur, and how many occur."""
    different, rank = np.unique(numbers, return_inverse=True)
    return rank.reshape(-1).astype(np.int64), len(different)


def _means(values: Floats, groups: _Groups) -> Floats:
    """The (M, 3) means of the groups' rows, counted from the lowest value, so that large coordinates lose nothing."""
    means = np.empty((len(groups.start), 3))
    for axis in range(3):
        low = values[:, axis].min()
        sums = np.add.reduceat(values[groups.order, axis] - low, groups.start)
        means[:, axis] = low + sums / groups.count
    return means


def _voxel(voxel: float) -> float:
    value = checks.number(voxel, "voxel")
    if value <= 0:
        raise ValueError(f"voxel: expected a positive edge in metres, got {value:g}.")
    return value
