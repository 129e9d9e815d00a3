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

FIRST = 8  # neighbours to look at first; most points need no more


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

    First the points of each small cube are joined, then each with its few nearest. What may still be missing are pairs
    of points with more neighbours than were looked at; of two such components one is not the largest, so only the
    points of the others are looked at again, with twice as many neighbours, until none is left.
    """
    n = len(near)
    # two points of one such cube are never farther apart than the radius
    low = near.sorted.min(axis=0)
    cube = np.floor((near.sorted - low) / (radius / np.sqrt(3.0) * (1 - 1e-9)))
    order = np.lexsort(cube.T)
    same = (cube[order[1:]] == cube[order[:-1]]).all(axis=1)
    ends = [(order[1:][same], order[:-1][same])]
    open_points, k = np.arange(n), min(FIRST, n)
    label = np.zeros(n, dtype=np.intp)
    while len(open_points):
        cut = []
        for part in np.array_split(open_points, max(1, len(open_points) * k // 2_000_000)):
            distance, place = near._query(near.sorted[part], k, radius, -1)
            there = np.isfinite(distance)
            ends.append((np.broadcast_to(part[:, None], place.shape)[there], place[there]))
            cut.append(part[there[:, -1]])
        label = _joined(ends, n)
        if k >= n:
            break
        largest = np.bincount(label).argmax()
        open_points = np.concatenate(cut)
        open_points = open_points[label[open_points] != largest]
        k = min(2 * k, n)
        # what is joined stays joined by one edge a point
        ends = [(np.arange(n), _first_of(label))]
    return label


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
