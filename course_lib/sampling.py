"""Samples of a cloud, as indices of the points to keep: at random, every k-th, and the farthest from those chosen."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.neighbours import finite_points

__all__ = ["farthest_points", "random_points", "uniform_points"]

Indices = NDArray[np.intp]


def random_points(points: ArrayLike, count: int, seed: int = 0) -> Indices:
    """Return indices of `count` points drawn at random, each point as likely as any other; ascending.

    Dense regions stay dense and sparse ones may be lost.

    Raises
    ------
    ValueError
        If there are fewer points than `count`.

    Examples
    --------
    >>> len(random_points([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 2))
    2
    """
    size = len(checks.cloud_points(points))
    return np.sort(np.random.default_rng(seed).choice(size, _count(count, size), replace=False))


def uniform_points(points: ArrayLike, every: int, start: int = 0) -> Indices:
    """Return the indices of every k-th point in stored order, as Open3D's `uniform_down_sample` does.

    Uniform is the count, not the density: what remains depends on the order in which points were stored.

    Raises
    ------
    ValueError
        If `every` is no whole number of at least 1, or `start` lies beyond the last point.

    Examples
    --------
    >>> uniform_points([[0, 0, 0]] * 7, every=3).tolist()
    [0, 3, 6]
    """
    size = len(checks.cloud_points(points))
    _whole(every, 1, "every")
    if _whole(start, 0, "start") >= size:
        raise ValueError(f"start: {start} lies beyond the last of {size} points.")
    return np.arange(start, size, every, dtype=np.intp)


def farthest_points(points: ArrayLike, count: int, start: int = 0) -> Indices:
    """Return indices of `count` points, each the farthest from all that were chosen before it.

    Coverage is even whatever the density, and outliers are chosen first. Time grows with N times `count`.

    Parameters
    ----------
    points : (N, 3) float, metres, finite.
    count : how many to choose.
    start : the index of the first one.

    Returns
    -------
    (count,) indices in the order in which they were chosen; of points equally far, the first.

    Raises
    ------
    ValueError
        If there are fewer points, or fewer different places, than `count`.

    References
    ----------
    Eldar, Lindenbaum, Porat and Zeevi, The farthest point strategy for progressive image sampling, IEEE TIP 6(9), 1997.

    Examples
    --------
    >>> farthest_points([[0, 0, 0], [1, 0, 0], [9, 0, 0], [5, 0, 0]], 3).tolist()
    [0, 2, 3]
    """
    array = finite_points(points)
    size = len(array)
    if not _whole(start, 0, "start") < size:
        raise ValueError(f"start: {start} lies beyond the last of {size} points.")
    chosen = np.empty(_count(count, size), dtype=np.intp)
    chosen[0] = start
    columns = [np.ascontiguousarray(array[:, axis]) for axis in range(3)]
    away = np.full(size, np.inf)  # squared distance to the nearest chosen point
    for n in range(1, len(chosen)):
        last = chosen[n - 1]
        square = sum((column - column[last]) ** 2 for column in columns)
        np.minimum(away, square, out=away)
        chosen[n] = np.argmax(away)
        if away[chosen[n]] == 0:
            raise ValueError(f"points: only {n} different places for {len(chosen)} samples; ask for fewer.")
    return chosen


def _whole(value: int, least: int, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{what}: expected a whole number of at least {least}, got {value!r}.")
    return int(value)


def _count(count: int, size: int) -> int:
    if _whole(count, 1, "count") > size:
        raise ValueError(f"count: {count} samples asked of {size} points; ask for fewer.")
    return int(count)
