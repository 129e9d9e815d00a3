"""Points sorted into cubes: those of one cube lie together, and the cubes around a cube are found at once.

Only cubes that hold points are kept, so memory grows with the points and not with the space between them. Cubes are
sorted along x, then y, then z; those of one x and y are a row, in which cubes above each other lie together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = ["Grid", "Runs", "cells_of", "grid_of", "order_in_space", "runs_of", "typical_reach"]

PER_CUBE = 16  # about so many points of a surface, where only their order is wanted
SAMPLE = 2048  # points from which the distance to a neighbour is judged
TABLE = 16  # entries for each point, as many as a table may have in which every x and y has its own place
MOST_ALONG = 2.0**31 - 8  # cubes along an axis of a grid, which counts in 32 bits
LARGEST = 2.0**52  # the number of a cube beyond this has no exact neighbour in float64


class Runs(NamedTuple):
    """Points sorted by cube: those of cube i are `order[start[i]:start[i] + count[i]]`, in ascending order."""

    order: NDArray[np.intp]
    start: NDArray[np.intp]
    count: NDArray[np.intp]  # type: ignore[assignment]  # hides the method of tuples

    def of_points(self) -> NDArray[np.intp]:
        """(N,) the cube of each point."""
        cube = np.empty(len(self.order), dtype=np.intp)
        cube[self.order] = np.repeat(np.arange(len(self.start)), self.count)
        return cube


class Grid(NamedTuple):
    """A cloud in cubes, as the loops of `grid_loops` read it.

    Attributes
    ----------
    order : (N,) which point stands where: `points` are those given, in this order.
    points : (N, 3) float64.
    cells : (C + 1, 3) int32: row, z and first point of each cube; one more row ends them.
    rows : (R + 1, 3) int32: x, y and first cube of each row; one more row ends them.
    table : (T,) int32: rows by x and y, at x * wide[1] + y where `wide[2]` is 1, else by a hash; -1 for none.
    wide : (3,) int64: cubes along x and along y, and whether each x and y has its own place in the table.
    low : (3,) where the cube 0, 0, 0 begins.
    size : the edge of a cube.
    """

    order: NDArray[np.intp]
    points: NDArray[np.float64]
    cells: NDArray[np.int32]
    rows: NDArray[np.int32]
    table: NDArray[np.int32]
    wide: NDArray[np.int64]
    low: NDArray[np.float64]
    size: float


def grid_of(points: NDArray[np.float64], size: float) -> Grid:
    """Sort finite points (N, 3) into cubes of an edge.

    Raises
    ------
    ValueError
        If there would be more cubes along an axis than can be counted.
    """
    from course_lib.cloud.gather_loops import fill_table

    columns = np.ascontiguousarray(points.T)
    low = columns.min(axis=1)
    if not (columns.max(axis=1) - low).max() < size * MOST_ALONG:
        raise ValueError(f"size: {size:g} makes more cubes than can be counted; is it in the unit of the points?")
    coordinates = cells_of(columns, size, low)
    runs = runs_of(coordinates)
    first = runs.order[runs.start]
    x, y, z = (each[first] for each in coordinates)
    begin = np.flatnonzero(np.concatenate([[True], (x[1:] != x[:-1]) | (y[1:] != y[:-1])]))
    rows = np.empty((len(begin) + 1, 3), dtype=np.int32)
    rows[:-1, 0], rows[:-1, 1], rows[:-1, 2] = x[begin], y[begin], begin
    rows[-1] = (-1, -1, len(first))
    cells = np.empty((len(first) + 1, 3), dtype=np.int32)
    cells[:-1, 0] = np.repeat(np.arange(len(begin)), np.diff(rows[:, 2]))
    cells[:-1, 1], cells[:-1, 2] = z, runs.start
    cells[-1] = (-1, -1, len(points))
    along = int(x[-1]) + 1, int(y.max()) + 1
    own = along[0] * along[1] <= TABLE * len(points)
    table = np.full(along[0] * along[1] if own else 1 << (2 * len(begin)).bit_length(), -1, dtype=np.int32)
    wide = np.array([*along, own], dtype=np.int64)
    fill_table(rows, wide, table)
    return Grid(runs.order, points.take(runs.order, axis=0), cells, rows, table, wide, low, size)


def cells_of(columns: NDArray[np.float64], size: float, origin: NDArray[np.float64]) -> list[NDArray[np.int64]]:
    """The cube of each point along each axis. Rounded down: int() would put both sides of the origin into one cube.

    Parameters
    ----------
    columns : (3, N) coordinates, axis by axis, so that memory is read in its order.

    Raises
    ------
    ValueError
        If there would be more cubes than can be counted.
    """
    cells = []
    for column, begin in zip(columns, origin, strict=True):
        cell = column - begin
        with np.errstate(over="ignore"):
            cell /= size
        np.floor(cell, out=cell)
        if not (cell.min() > -LARGEST and cell.max() < LARGEST):
            raise ValueError(f"size: {size:g} makes more cubes than can be counted; is it in the unit of the points?")
        cells.append(cell.astype(np.int64))
    return cells


def runs_of(cells: list[NDArray[np.int64]]) -> Runs:
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
    return Runs(order, start, np.diff(start, append=size))


def _ranks(numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """The same order in smaller numbers: the rank of each among those that occur, and how many occur."""
    used, rank = np.unique(numbers, return_inverse=True)
    return rank.reshape(-1).astype(np.int64), len(used)


def order_in_space(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """The order of finite points (N, 3) cube by cube: near ones are near each other in the list."""
    columns = np.ascontiguousarray(points.T)
    low = columns.min(axis=1)
    spread = float((columns.max(axis=1) - low).max())
    if not 0 < spread < np.inf:
        return np.arange(len(points))
    return runs_of(cells_of(columns, spread / max(1.0, np.sqrt(len(points) / PER_CUBE)), low)).order


def typical_reach(points: NDArray[np.float64], k: int) -> float:
    """About how far the k-th nearest point is, for most points; 0 where most points lie on others.

    A sample is thinner than the cloud, by how much depends on whether the points fill a line, a surface or a space: the
    eighth and the second neighbour in the sample tell.
    """
    some = points[np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(np.intp)]
    second, eighth = np.median(cKDTree(some).query(some, k=[3, 9])[0], axis=0)
    if not 0 < second < eighth < np.inf:
        return 0.0
    dimension = np.clip(np.log(8 / 2) / np.log(eighth / second), 1.0, 3.0)
    return float(eighth * (k / 8 * len(some) / len(points)) ** (1 / dimension))
