"""Nearest neighbours, fast: points laid out along a curve that fills space, and a k-d tree over them.

A k-d tree answers a query fastest when the query before it was near by, because what it touched is still in the
processor's cache. So points are sorted along Morton's Z-curve before the tree is built, and queries before they are
asked; results come back in the order of the caller. All work is SciPy's, in float64.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from course_lib import checks

__all__ = ["Neighbours", "finite_points", "morton_order", "spacing"]

BITS = 21  # of each axis; three of them fill the 63 bits of an int64
BLOCK = 1 << 14  # own neighbours are handed out in blocks of so many points, small enough for the cache
SORT_FROM = 2048  # fewer queries than this are not worth sorting
SPREADS = (  # move the bits of one number apart, two zeros between each: (shift, mask) in turn
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def finite_points(points: ArrayLike, what: str = "points") -> NDArray[np.float64]:
    """Return `points` as finite (N, 3) float64, N ≥ 1.

    Raises
    ------
    ValueError
        If the shape is another, there are none, or one is NaN or infinite.
    """
    array = checks.cloud_points(points, what)
    # one sum tells of NaN and infinity without a mask of every number
    with np.errstate(invalid="ignore", over="ignore"):
        total = array.sum(dtype=np.float64)
    if not np.isfinite(total):
        bad = np.count_nonzero(~np.isfinite(array).all(axis=1))
        if bad:
            raise ValueError(
                f"{what}: {bad} of {len(array)} are NaN or infinite; drop them first (pointcloud.drop_nan)."
            )
    return np.ascontiguousarray(array, dtype=np.float64)


def morton_order(points: ArrayLike) -> NDArray[np.intp]:
    """Return the order in which points follow Morton's Z-curve: neighbours in the list are mostly neighbours in space.

    Parameters
    ----------
    points : (N, 3) float, any unit, finite.

    Returns
    -------
    (N,) indices; `points[order]` follows the curve.

    Raises
    ------
    ValueError
        If the points are not a finite (N, 3) array.

    References
    ----------
    Morton, A computer oriented geodetic data base and a new technique in file sequencing, IBM, 1966.

    Examples
    --------
    >>> morton_order([[9, 9, 9], [0, 0, 0], [9, 9, 8], [1, 0, 0]]).tolist()
    [1, 3, 2, 0]
    """
    return _morton_order(finite_points(points))


def _morton_order(points: NDArray[np.float64]) -> NDArray[np.intp]:
    low = points.min(axis=0)
    widest = float((points.max(axis=0) - low).max())
    # so few cells an axis that points of one cell are few; the fewer bits, the faster the sort
    bits = min(BITS, max(1, int(np.ceil(np.log2(len(points)) / 2)) + 3)) if len(points) > 1 else 1
    scale = (2**bits - 1) / widest if 0 < widest < np.inf else 0.0
    key = np.zeros(len(points), dtype=np.int64)
    for axis in range(3):
        cell = ((points[:, axis] - low[axis]) * scale).astype(np.int64)
        for shift, mask in SPREADS:
            cell |= cell << shift
            cell &= mask
        cell <<= axis
        key |= cell
    return np.argsort(key, kind="stable")


class Neighbours:
    """A cloud prepared for questions about what lies near.

    Parameters
    ----------
    points : (N, 3) float, metres (or any one unit), finite, N ≥ 1.
    asked_often : take longer to build and less to answer; for more than a few questions a point.

    Raises
    ------
    ValueError
        If the points are not such an array.

    References
    ----------
    Bentley, Multidimensional binary search trees used for associative searching, CACM 18(9), 1975.

    Examples
    --------
    >>> near = Neighbours([[0, 0, 0], [1, 0, 0], [5, 0, 0]])
    >>> distance, index = near.nearest([[0.9, 0, 0]], k=2)
    >>> index.tolist()
    [[1, 0]]
    >>> near.nearest([[9, 0, 0]], radius=1.0)[1].tolist()  # nothing within 1: the index is len(points)
    [[3]]
    """

    def __init__(self, points: ArrayLike, asked_often: bool = False) -> None:
        array = finite_points(points)
        self.order = _morton_order(array)
        self.sorted = array[self.order]
        self._tree = cKDTree(self.sorted, balanced_tree=asked_often, compact_nodes=asked_often)
        self._names = np.append(self.order, len(array))  # the tree says len(points) for "none"; so do we

    def __len__(self) -> int:
        return len(self.sorted)

    def nearest(
        self, queries: ArrayLike, k: int = 1, radius: float = np.inf, workers: int = -1
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Return the k nearest points of each query, the nearest first.

        Parameters
        ----------
        queries : (M, 3) float, finite, in the unit of the points.
        k : how many; a point of the cloud that is its own query counts among them.
        radius : farther points do not count.
        workers : threads; -1 for all processors.

        Returns
        -------
        distance : (M, k) float; infinite where there are fewer.
        index : (M, k) into the points as given; len(points) where there are fewer.

        Raises
        ------
        ValueError
            If an argument is of another form.
        """
        asked = finite_points(queries, "queries")
        k, radius = _whole(k, "k"), _positive(radius, "radius")
        if len(asked) < SORT_FROM:
            distance, index = self.places(asked, k, radius, workers)
            return distance, self._names[index]
        order = _morton_order(asked)
        found, place = self.places(asked[order], k, radius, workers)
        distance, index = np.empty_like(found), np.empty_like(place)
        distance[order], index[order] = found, self._names[place]
        return distance, index

    def self_nearest(
        self, k: int, radius: float = np.inf, workers: int = -1, block: int = BLOCK
    ) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.intp]]]:
        """Yield the k nearest points of each of the cloud's own points, itself among them, block by block.

        Each block follows the Z-curve, so what is gathered for it (`near.sorted[place]`) lies close together in memory.

        Parameters
        ----------
        k, radius, workers : as in `nearest`.
        block : points a block.

        Yields
        ------
        index : (B,) which points of the cloud as given.
        distance : (B, k) float, ascending; infinite where there are fewer.
        place : (B, k) their neighbours, as indices into `sorted`; len(points) where there are fewer.

        Raises
        ------
        ValueError
            If an argument is of another form.
        """
        k, radius = _whole(k, "k"), _positive(radius, "radius")
        for start in range(0, len(self), _whole(block, "block")):
            part = slice(start, start + block)
            distance, place = self.places(self.sorted[part], k, radius, workers)
            yield self.order[part], distance, place

    def within(self, queries: ArrayLike, radius: float, workers: int = -1) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return all points within a radius of each query, in no order.

        Parameters
        ----------
        queries : (M, 3) float, finite.
        radius : in the unit of the points; a point at exactly this distance counts.
        workers : threads; -1 for all processors.

        Returns
        -------
        offsets : (M + 1,); the neighbours of query i are `index[offsets[i]:offsets[i + 1]]`.
        index : into the points as given.

        Raises
        ------
        ValueError
            If an argument is of another form.
        """
        asked = finite_points(queries, "queries")
        lists = self._tree.query_ball_point(asked, _positive(radius, "radius"), workers=workers, return_sorted=False)
        offsets = np.zeros(len(asked) + 1, dtype=np.intp)
        np.cumsum([len(each) for each in lists], out=offsets[1:])
        flat = np.fromiter((i for each in lists for i in each), dtype=np.intp, count=int(offsets[-1]))
        return offsets, self.order[flat]

    def places(
        self, queries: NDArray[np.float64], k: int = 1, radius: float = np.inf, workers: int = -1
    ) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Answer as `nearest` does, unchecked and unsorted: for queries that follow a curve already.

        Returns
        -------
        distance : (M, k) float.
        place : (M, k) into `sorted`, not into the points as given; len(points) where there are fewer.
        """
        # SciPy leaves out what lies at exactly the bound; we count it, as a ball does
        bound = np.nextafter(radius, np.inf)
        return self._tree.query(queries, k=np.arange(1, k + 1), distance_upper_bound=bound, workers=workers)


def spacing(points: ArrayLike) -> float:
    """Return the median distance from a point to the nearest other one, in the unit of the points.

    Raises
    ------
    ValueError
        If there are fewer than two points, or they are not a finite (N, 3) array.

    Examples
    --------
    >>> spacing([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 9]])
    1.0
    """
    near = Neighbours(points)
    if len(near) < 2:
        raise ValueError("points: one point has no nearest other; give two or more.")
    return float(np.median(np.concatenate([distance[:, 1] for _, distance, _ in near.self_nearest(2)])))


def _whole(value: int, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ValueError(f"{what}: expected a whole number of at least 1, got {value!r}.")
    return int(value)


def _positive(value: float, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not value > 0:
        raise ValueError(f"{what}: expected a positive length in the unit of the points, got {value!r}.")
    return float(value)
