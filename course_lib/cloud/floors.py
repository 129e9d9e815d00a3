"""The floor: the lowest level plane of a cloud, heights above it, and the cloud without it.

What stands on a floor touches everything else through it. Take it away, and things fall apart into pieces.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.checks import finite_points
from course_lib.cloud.planes import Plane, find_planes

__all__ = ["find_floor", "heights_above", "remove_floor"]

TRIED = 4  # planes that are looked at, the largest first
LEAST_SHARE = 0.02  # of all points, for a plane to count


def find_floor(
    points: ArrayLike, threshold: float, up: ArrayLike = (0.0, 0.0, 1.0), most_degrees: float = 15.0, seed: int = 0
) -> Plane:
    """Find the floor: of the large planes that lie level, the lowest.

    The largest level plane may be a table. What makes a floor is that it is lower.

    Parameters
    ----------
    points : (N, 3) float, finite, N ≥ 3.
    threshold : largest distance of an inlier, in the unit of the points.
    up : (3,) which way is up in their frame, of any length: (0, 0, 1) in a world, (0, −1, 0) for a level camera.
    most_degrees : how far the floor's normal may be from `up`.
    seed : of the random samples.

    Returns
    -------
    The floor's plane.

    Raises
    ------
    ValueError
        If no large plane is level, or an argument is of another form.

    Examples
    --------
    >>> floor = [[x, y, 0] for x in range(6) for y in range(6)]
    >>> table = [[x, y, 3] for x in range(5) for y in range(9)]
    >>> find_floor(floor + table, 0.01).offset
    0.0
    """
    array = finite_points(points)
    upward = _direction(up)
    if not 0 < most_degrees < 90:
        raise ValueError(f"most_degrees: expected an angle between 0 and 90, got {most_degrees!r}.")
    least = max(3, int(LEAST_SHARE * len(array)))
    level: list[tuple[Plane, NDArray[np.intp]]] = []
    common = np.zeros(3)
    for plane, index in find_planes(array, threshold, most=TRIED, least=least, seed=seed):
        along = float(plane.normal @ upward)
        if abs(along) >= np.cos(np.radians(most_degrees)):
            level.append((plane, index))
            common += len(index) * np.copysign(1.0, along) * plane.normal
    if not level:
        raise ValueError(
            f"points: none of their large planes is within {most_degrees:g} degrees of level; is `up` in their frame?"
        )
    # Along the planes' own normal: along an `up` that is 20 degrees off, a far floor is higher than a near table.
    return min(level, key=lambda one: float(np.median(array[one[1]] @ common)))[0]


def heights_above(points: ArrayLike, floor: Plane, up: ArrayLike = (0.0, 0.0, 1.0)) -> NDArray[np.float64]:
    """Return how high points (..., 3) stand above a floor, (...,), negative below it.

    A plane's normal may point either way; `up` decides.

    Raises
    ------
    ValueError
        If the floor stands upright for that `up`, or an argument is of another form.

    Examples
    --------
    >>> heights_above([[0, 0, 3], [0, 0, 0]], Plane((0, 0, -1), 1)).tolist()
    [2.0, -1.0]
    """
    side = float(floor.normal @ _direction(up))
    if abs(side) < 1e-6:
        raise ValueError("floor: it stands upright for this `up`, so nothing is above or below it.")
    return floor.distances(points) * float(np.sign(side))


def remove_floor(
    points: ArrayLike,
    threshold: float,
    up: ArrayLike = (0.0, 0.0, 1.0),
    clearance: float | None = None,
    most_degrees: float = 15.0,
    seed: int = 0,
) -> NDArray[np.bool_]:
    """Return which points stand above the floor, (N,) bool; floor and what lies below it are False.

    Parameters
    ----------
    points, threshold, up, most_degrees, seed : as in `find_floor`.
    clearance : points up to this height belong to the floor; by default twice the threshold.

    Raises
    ------
    ValueError
        As `find_floor`, or if the clearance is not positive.

    Examples
    --------
    >>> floor = [[x, y, 0] for x in range(6) for y in range(6)]
    >>> remove_floor(floor + [[2, 2, 1], [2, 2, -1]], 0.01).tolist()[-3:]
    [False, True, False]
    """
    floor = find_floor(points, threshold, up, most_degrees, seed)
    height = 2 * threshold if clearance is None else checks.positive(clearance, "clearance")
    return heights_above(points, floor, up) > height


def _direction(up: ArrayLike) -> NDArray[np.float64]:
    upward = checks.vector(up, 3, "up")
    length = np.linalg.norm(upward)
    if length == 0:
        raise ValueError("up: it is zero, so it says no direction.")
    return upward / length
