"""Sums over pairs of points, from which a rigid motion follows: by NumPy for few, by a compiled loop for many.

Pairs stand as in `Correspondences`: `q[place[i]]` belongs to `p[i]`, with a weight that is 0 where nothing belongs.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from course_lib.compiled import in_threads

__all__ = ["moved", "pair_sums", "plane_sums"]

MANY = 5000  # pairs; fewer are not worth a loop
FEW = 50_000  # pairs; a thread is not given fewer
PARTS = 4  # whose sums are added in their order, so that the number of threads changes nothing


def moved(T: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return T (4, 4) applied to points (N, 3)."""
    if len(points) < MANY:
        return points @ T[:3, :3].T + T[:3, 3]
    from course_lib.registration.pair_loops import move

    T, out = np.ascontiguousarray(T), np.empty_like(points)
    in_threads(lambda start, stop: move(T, points, start, stop, out), len(points), MANY)
    return out


def pair_sums(
    p: NDArray[np.float64], q: NDArray[np.float64], place: NDArray[np.int64], weight: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return Σ w (q, 1) (p, 1)ᵀ, (4, 4): the sums of weights, of points, and of their products."""
    if len(p) < MANY:
        a, b = _with_one(q.take(place, axis=0)), _with_one(p)
        product: NDArray[np.float64] = np.einsum("ni,n,nj->ij", a, weight, b)
        return product
    from course_lib.registration.pair_loops import add_pairs

    return _in_parts((4, 4), len(p), lambda start, stop, sums: add_pairs(p, q, place, weight, start, stop, sums))


def plane_sums(
    p: NDArray[np.float64],
    q: NDArray[np.float64],
    normals: NDArray[np.float64],
    place: NDArray[np.int64],
    weight: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """The normal equations of a step to planes, and where the points lie.

    Returns
    -------
    sums : (7, 7) Σ w a aᵀ with a = (p x n, n, n · (q - p)).
    middle, size : (3,) the mean of the points, and how far from it they are (root mean square; 1 where that is 0).
    """
    if len(p) < MANY:
        n = normals.take(place, axis=0)
        off = np.einsum("ni,ni->n", n, q.take(place, axis=0) - p)
        a = np.concatenate([np.cross(p, n), n, off[:, None]], axis=1)
        sums, total = np.einsum("ni,n,nj->ij", a, weight, a), weight.sum()
        middle, square = weight @ p / total, np.einsum("n,ni,ni->", weight, p, p) / total
    else:
        from course_lib.registration.pair_loops import add_planes

        both = _in_parts(
            (8, 7), len(p), lambda start, stop, sums: add_planes(p, q, normals, place, weight, start, stop, sums)
        )
        sums = both[:7] + np.triu(both[:7], 1).T
        middle, square = both[7, :3] / both[7, 3], both[7, 4] / both[7, 3]
    return sums, middle, float(np.sqrt(max(0.0, square - middle @ middle))) or 1.0


def _with_one(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([points, np.ones((len(points), 1))], axis=1)


def _in_parts(
    shape: tuple[int, int], count: int, add: Callable[[int, int, NDArray[np.float64]], None]
) -> NDArray[np.float64]:
    """Sums of a shape over parts, added in their order."""
    sums = np.zeros((PARTS, *shape))
    edges = np.linspace(0, count, PARTS + 1).astype(np.int64).tolist()

    def job(first: int, last: int) -> None:
        for i in range(first, last):
            add(edges[i], edges[i + 1], sums[i])

    in_threads(job, PARTS, PARTS * FEW // count)
    total: NDArray[np.float64] = sums.sum(axis=0)
    return total
