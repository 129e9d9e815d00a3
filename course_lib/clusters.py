"""Euclidean clusters: points that a walker reaches from each other in steps of at most a radius.

What DBSCAN gives when every point counts as a core point (min_points = 1), and PCL's EuclideanClusterExtraction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from course_lib import checks
from course_lib.neighbours import Neighbours

__all__ = ["euclidean_clusters"]

FIRST = 6  # neighbours to look at first; most points need no more


def euclidean_clusters(points: ArrayLike, radius: float, least: int = 1) -> NDArray[np.intp]:
    """Number the clusters of a cloud.

    Parameters
    ----------
    points : (N, 3) float, finite.
    radius : two points this near, or nearer, belong together; in the unit of the points.
    least : smaller clusters count as none.

    Returns
    -------
    (N,) labels: 0 is the largest cluster, then by size (of equal ones that with the earlier point); -1 is none.

    Raises
    ------
    ValueError
        If an argument is of another form.

    References
    ----------
    Rusu, Semantic 3D object maps for everyday manipulation in human living environments, dissertation, TU München,
    2009; Ester, Kriegel, Sander and Xu, A density-based algorithm for discovering clusters, KDD 1996.

    Examples
    --------
    >>> euclidean_clusters([[0, 0, 0], [9, 0, 0], [0.5, 0, 0], [1, 0, 0]], radius=0.6).tolist()
    [0, 1, 0, 0]
    """
    reach = checks.number(radius, "radius")
    if reach <= 0:
        raise ValueError(f"radius: expected a positive length in the unit of the points, got {reach:g}.")
    if isinstance(least, bool) or not isinstance(least, (int, np.integer)) or least < 1:
        raise ValueError(f"least: expected a whole number of points of at least 1, got {least!r}.")
    near = Neighbours(points)
    label = np.empty(len(near), dtype=np.intp)
    label[near.order] = _components(near, reach)
    return _by_size(label, int(least))


def _components(near: Neighbours, radius: float) -> NDArray[np.intp]:
    """Component of each point, in the order of `near.sorted`.

    First points that follow each other on the Z-curve are joined where they are near, then each with its few nearest.
    What may still be missing are pairs of points with more neighbours than were looked at; of two such parts one is
    not the largest, so only the points of the others are looked at again, with twice as many, until none is left.
    """
    n = len(near)
    step = np.linalg.norm(np.diff(near.sorted, axis=0), axis=1)
    follows = np.flatnonzero(step <= radius)
    ends = [(follows, follows + 1)]
    open_points, k = np.arange(n), min(FIRST, n)
    while True:
        cut = []
        for part in np.array_split(open_points, max(1, len(open_points) * k // 2_000_000)):
            distance, place = near.places(near.sorted[part], k, radius)
            cut.append(part[np.isfinite(distance[:, -1])])
            other = place[:, 1:]  # the first is the point itself, or one that equals it
            here = np.broadcast_to(part[:, None], other.shape)
            there = other < n
            ends.append((here[there], other[there]))
        label = _joined(ends, n)
        open_points = np.concatenate(cut)
        open_points = open_points[label[open_points] != np.bincount(label).argmax()]
        if k == n or not len(open_points):
            return label
        k = min(2 * k, n)
        # what is joined stays joined by one edge a point
        ends = [(np.arange(n), _first_of(label))]


def _joined(ends: list[tuple[NDArray, NDArray]], n: int) -> NDArray[np.intp]:
    rows, columns = (np.concatenate([pair[side] for pair in ends]) for side in (0, 1))
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n, n))
    return connected_components(graph.tocsr(), directed=False)[1].astype(np.intp)


def _first_of(label: NDArray[np.intp]) -> NDArray[np.intp]:
    """For each point the first point of its component."""
    _, first = np.unique(label, return_index=True)
    return first[label]


def _by_size(label: NDArray[np.intp], least: int) -> NDArray[np.intp]:
    """Renumber by size, the largest first; components that are too small become -1."""
    _, first, inverse, count = np.unique(label, return_index=True, return_inverse=True, return_counts=True)
    order = np.lexsort((first, -count))
    number = np.empty(len(order), dtype=np.intp)
    number[order] = np.arange(len(order))
    number[count < least] = -1
    return number[inverse]
