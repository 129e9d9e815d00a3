"""Nearest neighbours: what lies around each point of a cloud, asked for all of its points at once.

Two ways lead to one answer. Points sorted into cubes (`grid`) know what is near them without a search: the cubes around
their own. That is fastest where points lie about as densely as elsewhere. What cubes cannot serve, points far from all
others and crowds in one cube, is asked of SciPy's k-d tree; so are clouds of fewer than SMALL points.

References
----------
Bentley, Stanat and Williams, The complexity of finding fixed-radius near neighbors, Inf. Process. Lett. 6(6), 1977
(cubes); Bentley, Multidimensional binary search trees used for associative searching, CACM 18(9), 1975 (trees).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from course_lib import checks
from course_lib.checks import finite_points
from course_lib.cloud.grid import Grid, grid_of, order_in_space, typical_reach
from course_lib.compiled import in_threads, threads

__all__ = ["Neighbours", "Trace"]

SMALL = 2000  # points; fewer are not worth a grid
EDGE = 1.35  # of a cube, times the distance to the k-th neighbour
BLOCK = 1 << 13  # points asked of the tree at a time: the coordinates of their neighbours stay in the cache
FEW_CUBES, FEW_QUERIES = 8, 500  # at least, that a thread is given
WIDER = 1 + 1e-9  # so that rounding puts no point at exactly the radius two cubes away
FOLLOWED = 6  # neighbours that a cube is made for where single nearest points are followed


class Trace(NamedTuple):
    """What is known of queries that move (M of them): see `follow_loops.follow`.

    Attributes
    ----------
    place : (M,) the nearest point of each, an index into `Neighbours.sorted`, also beyond the radius; -1: none.
    seen : (M, 3) where it was when that was found out.
    others : (M,) how far away all other points were then, at least; -1 where that is not known.
    """

    place: NDArray[np.int64]
    seen: NDArray[np.float64]
    others: NDArray[np.float64]

    @classmethod
    def of(cls, count: int) -> Trace:
        """Of queries of which nothing is known yet."""
        return cls(np.full(count, -1), np.zeros((count, 3)), np.full(count, -1.0))


class Neighbours:
    """A cloud prepared for questions about what lies near.

    Parameters
    ----------
    points : (N, 3) float, metres (or any one unit), finite, N ≥ 1.

    Raises
    ------
    ValueError
        If the points are not such an array.

    Examples
    --------
    >>> near = Neighbours([[0, 0, 0], [1, 0, 0], [5, 0, 0]])
    >>> distance, index = near.nearest([[0.9, 0, 0]], k=2)
    >>> index.tolist()
    [[1, 0]]
    >>> near.nearest([[9, 0, 0]], radius=1.0)[1].tolist()  # nothing within 1: the index is len(points)
    [[3]]
    """

    def __init__(self, points: ArrayLike) -> None:
        self.points = finite_points(points)

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points, balanced_tree=False, compact_nodes=False)

    def _by_tree(
        self, queries: NDArray[np.float64], k: int, radius: float = np.inf
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        # SciPy leaves out what lies at exactly the bound; we count it, as a ball does
        bound = np.nextafter(radius, np.inf)
        distance, index = self._tree.query(queries, np.arange(1, k + 1), distance_upper_bound=bound, workers=threads())
        return distance, index

    def _grid_for(self, k: int) -> Grid | None:
        """Cubes as wide as the distance to the k-th neighbour mostly is; None where they would be of no use."""
        edge = typical_reach(self.points, k) * EDGE if len(self) >= SMALL else 0.0
        return grid_of(self.points, edge) if edge > 0 else None

    @cached_property
    def _followed(self) -> Grid | None:
        return self._grid_for(FOLLOWED)

    @cached_property
    def order(self) -> NDArray[np.intp]:
        """(N,) the order in which `follow` knows the points."""
        return np.arange(len(self)) if self._followed is None else self._followed.order

    @cached_property
    def sorted(self) -> NDArray[np.float64]:
        """(N, 3) the points in that order."""
        return self.points if self._followed is None else self._followed.points

    def follow(self, queries: NDArray[np.float64], radius: float, trace: Trace) -> NDArray[np.float64]:
        """The distance (M,) to the nearest point of each query, inf where it is beyond the radius: unchecked.

        Parameters
        ----------
        queries : (M, 3) float64, finite, C-contiguous; found soonest where near ones are near each other in the list.
        radius : farther points do not count; a point at exactly this distance does.
        trace : of the same queries, wherever they were the last time; brought up to date.
        """
        grid = self._followed
        distance, open_ = np.empty(len(queries)), np.ones(len(queries), dtype=bool)
        if grid is not None:
            from course_lib.cloud.follow_loops import TOGETHER, follow

            def job(start: int, stop: int) -> None:
                scratch = np.empty(TOGETHER, dtype=np.int64), np.empty(TOGETHER), *_scratch()
                follow(*grid[1:], queries, start, stop, radius, *scratch, *trace, distance, open_)

            in_threads(job, len(queries), FEW_QUERIES)
        rest = np.flatnonzero(open_)
        if len(rest):
            found, index = self._by_tree(queries.take(rest, axis=0), 1, radius)
            distance[rest] = found[:, 0]
            there = index[:, 0] < len(self)
            trace.place[rest] = -1
            trace.place[rest[there]] = _inverse(self.order).take(index[there, 0])
        return distance

    def nearest(
        self, queries: ArrayLike, k: int = 1, radius: float = np.inf
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Return the k nearest points of each query, the nearest first.

        Parameters
        ----------
        queries : (M, 3) float, finite, in the unit of the points.
        k : how many; a point of the cloud that is its own query counts among them.
        radius : farther points do not count; a point at exactly this distance does.

        Returns
        -------
        distance : (M, k) float; infinite where there are fewer.
        index : (M, k) into the points; len(points) where there are fewer.

        Raises
        ------
        ValueError
            If an argument is of another form.
        """
        asked = finite_points(queries, "queries")
        k, radius = checks.whole(k, "k"), checks.reach(radius, "radius")
        if k > 1 or len(asked) < SMALL or self._followed is None:
            return self._by_tree(asked, k, radius)
        order = order_in_space(asked)
        distance, index = np.empty((len(asked), 1)), np.empty((len(asked), 1), dtype=np.intp)
        trace = Trace.of(len(asked))
        distance[order, 0] = self.follow(asked.take(order, axis=0), radius, trace)
        trace.place[np.isinf(distance[order, 0])] = -1
        index[order, 0] = np.append(self.order, len(self)).take(trace.place)  # -1 takes the last: none
        return distance, index

    def mean_distances(self, k: int) -> NDArray[np.float64]:
        """Return the mean distance (N,) of each point to its k nearest others; k < N."""

        def by_grid(grid: Grid, start: int, stop: int, open_: NDArray[np.bool_]) -> None:
            _loops().mean_distances(*grid[1:], start, stop, k, *_scratch(), mean, open_)

        def by_tree(points: NDArray[np.float64]) -> tuple[NDArray[Any], ...]:
            return (self._by_tree(points, k + 1)[0][:, 1:].mean(axis=1),)

        mean = np.empty(len(self))
        return self._each(self._grid_for(k + 1), (mean,), by_grid, by_tree)[0]

    def covariances(self, k: int, radius: float = np.inf) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Return how the k nearest points around each point spread, itself among them, none beyond the radius; k ≤ N.

        Returns
        -------
        six : (N, 6) xx, yy, zz, xy, xz, yz of their covariance.
        count : (N,) how many they are.
        """

        def by_grid(grid: Grid, start: int, stop: int, open_: NDArray[np.bool_]) -> None:
            picked, most = np.empty(k, dtype=np.int64), _squared(radius)
            _loops().covariances(*grid[1:], start, stop, k, most, *_scratch(), picked, six, count, open_)

        def by_tree(points: NDArray[np.float64]) -> tuple[NDArray[Any], ...]:
            blocks = np.array_split(points, len(points) // BLOCK + 1)
            parts = [_spread(block, self.points, *self._by_tree(block, k, radius)) for block in blocks]
            return tuple(np.concatenate(part) for part in zip(*parts, strict=True))

        six, count = np.empty((len(self), 6)), np.empty(len(self), dtype=np.int64)
        answers = self._each(self._grid_for(k), (six, count), by_grid, by_tree)
        return answers[0], answers[1]

    def crowded(self, radius: float, least: int) -> NDArray[np.bool_]:
        """Return which points (N,) have at least so many others within the radius; least < N."""
        if len(self) < SMALL:
            return np.isfinite(self._by_tree(self.points, least + 1, radius)[0][:, least])
        grid, enough = grid_of(self.points, radius * WIDER), np.empty(len(self), dtype=bool)

        def job(start: int, stop: int) -> None:
            _loops().has_others_within(*grid[1:], start, stop, least, _squared(radius), enough)

        in_threads(job, len(grid.cells) - 1, FEW_CUBES)
        return enough.take(_inverse(grid.order))

    def _each(
        self,
        grid: Grid | None,
        outs: tuple[NDArray[Any], ...],
        by_grid: Callable[[Grid, int, int, NDArray[np.bool_]], None],
        by_tree: Callable[[NDArray[np.float64]], tuple[NDArray[Any], ...]],
    ) -> tuple[NDArray[Any], ...]:
        """An answer for each point, written into `outs` by the grid, and by the tree where the grid leaves it open."""
        if grid is None:
            return by_tree(self.points)
        open_ = np.ones(len(self), dtype=bool)
        in_threads(lambda start, stop: by_grid(grid, start, stop, open_), len(grid.cells) - 1, FEW_CUBES)
        rest = np.flatnonzero(open_)
        if len(rest):
            for out, answer in zip(outs, by_tree(grid.points.take(rest, axis=0)), strict=True):
                out[rest] = answer
        place = _inverse(grid.order)
        return tuple(out.take(place, axis=0) for out in outs)


def _loops() -> ModuleType:
    """The compiled loops, imported when they are first needed."""
    from course_lib.cloud import grid_loops

    return grid_loops


def _scratch() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Memory for what is gathered around one cube."""
    room = _loops().ROOM
    return np.empty((5, room + 4)), np.empty(room, dtype=np.int64)  # loops that take four at a time write beyond


def _inverse(order: NDArray[np.intp]) -> NDArray[np.intp]:
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    return place


def _squared(radius: float) -> float:
    """The largest squared distance that counts: that of a point at exactly the radius, as SciPy's trees round it."""
    return float(np.nextafter(np.nextafter(radius, np.inf) ** 2, 0.0))


def _spread(
    points: NDArray[np.float64], cloud: NDArray[np.float64], distance: NDArray[np.float64], index: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """The covariance (B, 6) of what a tree found around points (B, 3), and how many (B,) it found."""
    there = np.isfinite(distance)
    count = there.sum(axis=1)
    # coordinates about each point itself, so that the digits of far-away clouds are not lost; missing ones are zero
    off = np.where(there[:, :, None], cloud.take(np.where(there, index, 0), axis=0) - points[:, None], 0.0)
    mean = off.sum(axis=1) / count[:, None]
    six = np.empty((len(points), 6))
    for row, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        six[:, row] = np.einsum("nk,nk->n", off[:, :, i], off[:, :, j]) / count - mean[:, i] * mean[:, j]
    return six, count
