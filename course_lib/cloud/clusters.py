"""Euclidean clusters: points that a walker reaches from each other in steps of at most a radius.

What DBSCAN gives when every point counts as a core point (min_points = 1;
Open3D's leaves out steps of exactly the radius), and PCL's EuclideanClusterExtraction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from course_lib import checks
from course_lib.cloud.neighbours import Neighbours

__all__ = ["euclidean_clusters"]

FIRST = 6  # neighbours to look at first; most points need no more
FARTHEST_CUBE = 2.0**52  # beyond it, a float cannot tell neighbouring cubes apart
MIXERS = np.array([0x9E3779B97F4A7C1, 0x2545F4914F6CDD1D, 0x1000001B3], dtype=np.int64)  # odd, and far apart
PAIRS = 1 << 20  # pairs of points compared at once


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
    A pair that is still missing has more neighbours than were looked at, on both its sides, and of two such parts one
    is not the largest. Where that happens, small cubes of such points are compared with the cubes around them.
    """
    n, k = len(near), min(FIRST, len(near))
    step = np.linalg.norm(np.diff(near.sorted, axis=0), axis=1)
    follows = np.flatnonzero(step <= radius)
    ends, cut = [(follows, follows + 1)], []
    for part in np.array_split(np.arange(n), max(1, n * k // 2_000_000)):
        distance, place = near.places(near.sorted[part], k, radius)
        cut.append(part[np.isfinite(distance[:, -1])])
        other = place[:, 1:]  # the first is the point itself, or one that equals it
        here = np.broadcast_to(part[:, None], other.shape)
        there = other < n
        ends.append((here[there], other[there]))
    label = _joined(ends, n)
    many = np.concatenate(cut)
    if k == n or (label[many] == np.bincount(label).argmax()).all():
        return label
    return _with_cubes(near.sorted, many, label, radius)


def _with_cubes(
    points: NDArray[np.float64], many: NDArray[np.intp], label: NDArray[np.intp], radius: float
) -> NDArray[np.intp]:
    """Join the components of points `many` that lie within the radius of each other."""
    n = len(points)
    # two points of one such cube are never farther apart than the radius
    cube = np.floor((points[many] - points.min(axis=0)) / (radius / np.sqrt(3.0) * (1 - 1e-9)))
    if cube.max() > FARTHEST_CUBE:
        raise ValueError(f"radius: {radius:g} is too small for points that lie so far apart; is the unit right?")
    cube = cube.astype(np.int64)
    order = np.lexsort(cube.T)
    cube, many = cube[order], many[order]
    same = (cube[1:] == cube[:-1]).all(axis=1)
    label = _joined([(np.arange(n), _first_of(label)), (many[1:][same], many[:-1][same])], n)
    pairs = _pairs_between(points, cube, many, label, radius)
    return _joined([(np.arange(n), _first_of(label)), pairs], n)


def _pairs_between(
    points: NDArray[np.float64], cube: NDArray[np.int64], many: NDArray[np.intp], label: NDArray[np.intp], radius: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs within the radius of points `many` that lie in different components and different cubes."""
    key = cube @ MIXERS  # wraps around; two cubes with one key only cost a comparison
    order = np.argsort(key, kind="stable")
    many, key = many[order], key[order]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    count = np.diff(np.r_[first, len(key)])
    cells = key[first]
    # of two components one is not the largest
    asking = np.flatnonzero(label[many[first]] != np.bincount(label).argmax())
    lefts, rights = [np.empty(0, np.intp)], [np.empty(0, np.intp)]
    steps = np.arange(-2, 3)
    for shift in np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3).astype(np.int64) @ MIXERS:
        wanted = cells[asking] + shift
        at = np.minimum(np.searchsorted(cells, wanted), len(cells) - 1)
        differ = (cells[at] == wanted) & (label[many[first[at]]] != label[many[first[asking]]])
        a, b = asking[differ], at[differ]
        sizes = count[a] * count[b]
        for part in np.split(np.arange(len(a)), np.flatnonzero(np.diff(np.cumsum(sizes) // PAIRS)) + 1):
            i, j = _all_pairs(first[a[part]], count[a[part]], first[b[part]], count[b[part]])
            i, j = many[i], many[j]
            close = np.sqrt(np.square(points[i] - points[j]).sum(axis=1)) <= radius
            lefts.append(i[close])
            rights.append(j[close])
    return np.concatenate(lefts), np.concatenate(rights)


def _all_pairs(
    first: NDArray[np.intp], count: NDArray[np.intp], other: NDArray[np.intp], others: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Each of `count` numbers from `first` on with each of `others` numbers from `other` on, row by row."""
    sizes = count * others
    row = np.repeat(np.arange(len(sizes)), sizes)
    inside = np.arange(len(row)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return first[row] + inside // others[row], other[row] + inside % others[row]


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
