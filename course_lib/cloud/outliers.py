"""Outliers by the distance to their neighbours: statistical and radius removal.

Both return which points are kept, as a mask, and change nothing. *Neighbours here are other points*: the point itself
never counts. PCL counts so, too; Open3D counts the point itself, so its `nb_neighbors` is our k + 1.

References
----------
Rusu, Marton, Blodow, Dolha and Beetz, Towards 3D point cloud based object maps for household environments, Robotics and
Autonomous Systems 56, 2008 (statistical removal); the manuals of PCL and Open3D (radius removal).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.cloud.neighbours import Neighbours

__all__ = ["keep_by_radius", "keep_by_statistics", "mean_distances"]


def mean_distances(points: ArrayLike, k: int = 20) -> NDArray[np.float64]:
    """Return the mean distance of each point to its k nearest other points, in the unit of the points.

    Parameters
    ----------
    points : (N, 3) float, finite, N ≥ 2.
    k : how many other points; where there are fewer, all of them.

    Returns
    -------
    (N,) float64.

    Raises
    ------
    ValueError
        If there is only one point, or an argument is of another form.

    Examples
    --------
    >>> mean_distances([[0, 0, 0], [1, 0, 0], [3, 0, 0]], k=2).tolist()
    [2.0, 1.5, 2.5]
    """
    near = Neighbours(points)
    if len(near) < 2:
        raise ValueError("points: one point has no neighbours; give two or more.")
    return near.mean_distances(min(checks.whole(k, "k"), len(near) - 1))


def keep_by_statistics(points: ArrayLike, k: int = 20, std_ratio: float = 2.0) -> NDArray[np.bool_]:
    """Keep points whose mean distance to their neighbours is usual in this cloud.

    A point goes if its mean distance is at least the mean of all plus `std_ratio` of their standard deviations (n − 1).
    A larger ratio removes less. The threshold is made of the cloud itself: run it again and it removes again.

    Parameters
    ----------
    points : (N, 3) float, finite, N ≥ 2.
    k : other points to look at.
    std_ratio : standard deviations above the mean, positive.

    Returns
    -------
    (N,) bool, True for points that are kept. Where all mean distances are equal, all are kept.

    Raises
    ------
    ValueError
        If there is only one point, or an argument is of another form.

    Examples
    --------
    >>> keep_by_statistics([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [40, 0, 0]], k=2, std_ratio=1.0).tolist()
    [True, True, True, True, False]
    """
    ratio = checks.positive(std_ratio, "std_ratio", "number of standard deviations")
    mean = mean_distances(points, k)
    middle, deviation = float(mean.mean()), float(mean.std(ddof=1))
    # distances that differ by rounding only, of themselves or of the coordinates, have no outliers among them
    given = np.asarray(points)
    digit = 4 * np.finfo(given.dtype if given.dtype.kind == "f" else np.float64).eps * float(np.abs(given).max())
    if deviation <= max(1e-9 * middle, digit):
        return np.ones(len(mean), dtype=bool)
    return mean < middle + ratio * deviation


def keep_by_radius(points: ArrayLike, radius: float, least: int = 16) -> NDArray[np.bool_]:
    """Keep points that have at least so many other points within a radius.

    Parameters
    ----------
    points : (N, 3) float, finite.
    radius : in the unit of the points.
    least : other points that must be there. Open3D's `nb_points` of the same number keeps the same, except
        that it leaves out a neighbour at exactly the radius.

    Returns
    -------
    (N,) bool, True for points that are kept; possibly none.

    Raises
    ------
    ValueError
        If an argument is of another form.

    Examples
    --------
    >>> keep_by_radius([[0, 0, 0], [0.1, 0, 0], [5, 0, 0]], radius=0.2, least=1).tolist()
    [True, True, False]
    """
    least = checks.whole(least, "least")
    near = Neighbours(points)
    reach = checks.positive(radius, "radius")
    return near.crowded(reach, least) if least < len(near) else np.zeros(len(near), dtype=bool)
