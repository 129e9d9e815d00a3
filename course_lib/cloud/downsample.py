"""Fewer points: a voxel grid with a stated origin and a stated representative, and three ways to sample.

A voxel grid cuts space into cubes and keeps one point a cube. Which cubes there are depends on where the grid begins,
so the origin is an argument. All functions take and return metres (or any one unit) and float64.

References
----------
Rusu and Cousins, 3D is here: Point Cloud Library, ICRA 2011 (the voxel grid filter); Eldar, Lindenbaum, Porat and
Zeevi, The farthest point strategy for progressive image sampling, IEEE Trans. Image Processing 6(9), 1997.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.cloud.neighbours import finite_points

__all__ = ["VoxelGrid", "sample_farthest", "sample_random", "sample_uniform", "voxel_downsample", "voxel_grid"]

LARGEST = 2.0**52  # the number of a cube beyond this has no exact neighbour in float64


class VoxelGrid(NamedTuple):
    """Which voxel each point lies in.

    Attributes
    ----------
    voxel : (N,) number of the voxel of each point, from 0; voxels are numbered along x, then y, then z.
    index : (V, 3) int64, the cube of each voxel: it spans origin + index * size to origin + (index + 1) * size.
    count : (V,) points in each voxel, at least 1.
    origin : (3,) where the grid begins.
    size : the edge of a cube.
    """

    voxel: NDArray[np.intp]
    index: NDArray[np.int64]
    count: NDArray[np.intp]
    origin: NDArray[np.float64]
    size: float

    @property
    def centres(self) -> NDArray[np.float64]:
        """(V, 3) the middle of each cube."""
        return self.origin + (self.index + 0.5) * self.size


def voxel_grid(points: ArrayLike, size: float, origin: ArrayLike = (0.0, 0.0, 0.0)) -> VoxelGrid:
    """Sort points into cubes.

    Parameters
    ----------
    points : (N, 3) float, finite, N ≥ 1.
    size : edge of a cube, in the unit of the points.
    origin : (3,) a corner of the grid. Another origin gives another number of voxels.

    Raises
    ------
    ValueError
        If the points are not a finite (N, 3) array, the size is not positive, or so small that cubes cannot be counted.

    Examples
    --------
    >>> grid = voxel_grid([[0.1, 0, 0], [0.9, 0, 0], [-0.1, 0, 0]], 1.0)
    >>> grid.voxel.tolist(), grid.index[:, 0].tolist()  # -0.1 lies in cube -1: floor, not int
    ([1, 1, 0], [-1, 0])
    """
    array = finite_points(points)
    start = checks.vector(origin, 3, "origin")
    cells = _cells(np.ascontiguousarray(array.T), size, start)
    runs = _runs(cells)
    first = runs.order[runs.start]
    index = np.stack([cell[first] for cell in cells], axis=1)
    return VoxelGrid(runs.of_points(), index, runs.count, start, _edge(size))


def voxel_downsample(
    points: ArrayLike, size: float, origin: ArrayLike = (0.0, 0.0, 0.0), representative: str = "centroid"
) -> NDArray[np.float64]:
    """Keep one point a cube.

    Parameters
    ----------
    points, size, origin : as in `voxel_grid`.
    representative : "centroid", the mean of a cube's points, which averages noise and rounds edges off; or "nearest",
        that one of its points which lies nearest to the cube's centre, which changes no point.

    Returns
    -------
    (V, 3) float64, ordered along x, then y, then z of their cubes.

    Raises
    ------
    ValueError
        As `voxel_grid`; or if the representative is another word.

    Examples
    --------
    >>> voxel_downsample([[0.25, 0, 0], [0.75, 0, 0], [1.5, 0, 0]], 1.0).tolist()
    [[0.5, 0.0, 0.0], [1.5, 0.0, 0.0]]
    """
    if representative not in ("centroid", "nearest"):
        raise ValueError(f"representative: {representative!r} is unknown; say 'centroid' or 'nearest'.")
    array = finite_points(points)
    start = checks.vector(origin, 3, "origin")
    if representative == "nearest":
        grid = voxel_grid(array, size, start)
        off = np.linalg.norm(array - grid.centres[grid.voxel], axis=1)
        order = np.lexsort((off, grid.voxel))
        return array[order[np.concatenate([[0], np.cumsum(grid.count)[:-1]])]]
    columns = np.ascontiguousarray(array.T)  # axis by axis, memory is read in its order
    return _centroids(columns, _runs(_cells(columns, size, start)))


class _Runs(NamedTuple):
    """Points sorted by cube: those of cube i are `order[start[i]:start[i] + count[i]]`, in ascending order."""

    order: NDArray[np.intp]
    start: NDArray[np.intp]
    count: NDArray[np.intp]

    def of_points(self) -> NDArray[np.intp]:
        """(N,) the cube of each point."""
        cube = np.empty(len(self.order), dtype=np.intp)
        cube[self.order] = np.repeat(np.arange(len(self.start)), self.count)
        return cube


def _cells(columns: NDArray[np.float64], size: float, origin: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """The cube of each point along each axis. Rounded down: int() would put both sides of the origin into one cube."""
    edge = _edge(size)
    cells = []
    for column, begin in zip(columns, origin, strict=True):
        cell = column - begin
        with np.errstate(over="ignore"):
            cell /= edge
        np.floor(cell, out=cell)
        if not (cell.min() > -LARGEST and cell.max() < LARGEST):
            raise ValueError(f"size: {edge:g} makes more cubes than can be counted; is it in the unit of the points?")
        cells.append(cell.astype(np.int64))
    return cells


def _runs(cells: list[NDArray[np.int64]]) -> _Runs:
    """Sort points by cube, x first. A cube's number and a point's are packed into one integer, which sorts fastest.

    Memory grows with the points, never with the space: where the numbers of cubes do not fit, only those in use count.
    """
    size = len(cells[0])
    low_bits = max(size - 1, 1).bit_length()
    most = 1 << (63 - low_bits)
    key, room = np.zeros(size, dtype=np.int64), 1
    for cell in cells:
        low, high = int(cell.min()), int(cell.max())
        if room * (high - low + 1) >= most:
            key, room = _ranks(key)
        if room * (high - low + 1) >= most:
            cell, high = _ranks(cell)
            low, high = 0, high - 1
        key *= high - low + 1
        key += cell
        key -= low
        room *= high - low + 1
    key <<= low_bits
    key |= np.arange(size)
    key.sort()
    order = (key & ((1 << low_bits) - 1)).astype(np.intp)
    key >>= low_bits
    start = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    return _Runs(order, start, np.diff(start, append=size))


def _ranks(numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """The same order in smaller numbers: the rank of each among those that occur, and how many occur."""
    used, rank = np.unique(numbers, return_inverse=True)
    return rank.reshape(-1).astype(np.int64), len(used)


def _centroids(columns: NDArray[np.float64], runs: _Runs) -> NDArray[np.float64]:
    """The mean of each cube's points, counted from the lowest one, so that far-away clouds keep their digits.

    Points are read in their order and added to sums, of which there are few: fetching them cube by cube, from all over
    memory, takes three times as long for a million.
    """
    cube = runs.of_points()
    means = np.empty((len(runs.start), 3))
    for axis, column in enumerate(columns):
        low = column.min()
        means[:, axis] = low + np.bincount(cube, column - low, len(runs.start)) / runs.count
    return means


def _edge(size: float) -> float:
    edge = checks.number(size, "size")
    if edge <= 0:
        raise ValueError(f"size: a voxel has a positive edge, got {edge:g}; it is a length in the unit of the points.")
    return edge


def sample_random(points: ArrayLike, count: int, seed: int) -> NDArray[np.intp]:
    """Return the indices of `count` points drawn without replacement, in ascending order.

    Raises
    ------
    ValueError
        If there are not so many points.

    Examples
    --------
    >>> len(set(sample_random([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 2, seed=3).tolist()))
    2
    """
    array = finite_points(points)
    return np.sort(np.random.default_rng(seed).choice(len(array), _count(count, len(array)), replace=False))


def sample_uniform(points: ArrayLike, step: int) -> NDArray[np.intp]:
    """Return the indices of every `step`-th point: even along the list, which need not be even in space.

    Raises
    ------
    ValueError
        If the step is not a whole number of at least 1.

    Examples
    --------
    >>> sample_uniform([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 2).tolist()
    [0, 2]
    """
    array = finite_points(points)
    if isinstance(step, bool) or not isinstance(step, (int, np.integer)) or step < 1:
        raise ValueError(f"step: expected a whole number of at least 1, got {step!r}.")
    return np.arange(0, len(array), int(step))


def sample_farthest(points: ArrayLike, count: int, start: int = 0) -> NDArray[np.intp]:
    """Return the indices of `count` points, each the farthest from all before it; O(N · count).

    Parameters
    ----------
    points : (N, 3) float, finite.
    count : how many.
    start : index of the first.

    Raises
    ------
    ValueError
        If there are not so many points in different places, or no point `start`.

    Examples
    --------
    >>> sample_farthest([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 0, 0]], 3).tolist()
    [0, 3, 2]
    """
    array = finite_points(points)
    chosen = np.empty(_count(count, len(array)), dtype=np.intp)
    if not 0 <= start < len(array):
        raise ValueError(f"start: there is no point {start}; there are {len(array)}.")
    nearest = np.full(len(array), np.inf)
    chosen[0] = start
    for i in range(1, len(chosen)):
        np.minimum(nearest, ((array - array[chosen[i - 1]]) ** 2).sum(axis=1), out=nearest)
        chosen[i] = int(nearest.argmax())
        if nearest[chosen[i]] == 0:
            raise ValueError(f"points: they lie in {i} different places, {len(chosen)} were asked for; ask for fewer.")
    return chosen


def _count(count: int, most: int) -> int:
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 1 <= count <= most:
        raise ValueError(f"count: expected a whole number from 1 to {most}, got {count!r}.")
    return int(count)
