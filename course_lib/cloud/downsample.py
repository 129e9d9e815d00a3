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
from course_lib.checks import finite_points
from course_lib.cloud.grid import LARGEST, Runs, cells_of, runs_of
from course_lib.compiled import in_threads, threads

__all__ = ["VoxelGrid", "sample_farthest", "sample_random", "sample_uniform", "voxel_downsample", "voxel_grid"]

MANY = 100_000  # points; fewer are as quickly sorted by NumPy alone
PARTS = 8  # of the sorted points for each thread


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
    index: NDArray[np.int64]  # type: ignore[assignment]  # hides the method of tuples
    count: NDArray[np.intp]  # type: ignore[assignment]  # as index does
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
    cells = cells_of(np.ascontiguousarray(array.T), _edge(size), start)
    runs = runs_of(cells)
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
        kept: NDArray[np.float64] = array[order[np.concatenate([[0], np.cumsum(grid.count)[:-1]])]]
        return kept
    edge = _edge(size)
    if len(array) >= MANY and (means := _centroids_in_threads(array, edge, start)) is not None:
        return means
    columns = np.ascontiguousarray(array.T)  # axis by axis, memory is read in its order
    return _centroids(columns, runs_of(cells_of(columns, edge, start)))


def _centroids_in_threads(
    points: NDArray[np.float64], size: float, origin: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """The same means as `_centroids`; None where the numbers of a cube and of a point do not fit into one integer."""
    from course_lib.cloud.downsample_loops import cube_numbers, means_of_cubes, reaches

    parts = np.linspace(0, len(points), PARTS * threads() + 1).astype(np.int64)
    count = len(parts) - 1
    ends = np.empty((2, count, 3))

    def reach(a: int, b: int) -> None:
        for i in range(a, b):
            reaches(points, parts[i], parts[i + 1], *ends[:, i])

    in_threads(reach, count)
    low, high = ends[0].min(axis=0), ends[1].max(axis=0)
    first, last = np.floor((low - origin) / size), np.floor((high - origin) / size)
    bits = (len(points) - 1).bit_length()
    if np.abs([first, last]).max() >= LARGEST or np.prod(last - first + 1) >= 2.0 ** (62 - bits):
        return None
    wide, key = (last - first + 1).astype(np.int64), np.empty(len(points), dtype=np.int64)
    number = (points, origin, size, first.astype(np.int64), wide, bits)
    in_threads(lambda a, b: cube_numbers(*number, a, b, key), len(points))
    key.sort()
    found = np.zeros(count + 1, dtype=np.int64)
    means = np.empty((0, 3))

    def count_or_write(a: int, b: int, write: bool) -> None:
        for i in range(a, b):
            row = found[i] if write else -1
            cubes = means_of_cubes(key, points, low, bits, parts[i], parts[i + 1], row, means)
            if not write:
                found[i + 1] = cubes

    in_threads(lambda a, b: count_or_write(a, b, False), count)
    np.cumsum(found, out=found)
    means = np.empty((found[-1], 3))
    in_threads(lambda a, b: count_or_write(a, b, True), count)
    return means


def _centroids(columns: NDArray[np.float64], runs: Runs) -> NDArray[np.float64]:
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
    return np.sort(
        np.random.default_rng(seed).choice(len(array), checks.whole(count, "count", 1, len(array)), replace=False)
    )


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
    return np.arange(0, len(array), checks.whole(step, "step"))


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
    chosen = np.empty(checks.whole(count, "count", 1, len(array)), dtype=np.intp)
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
