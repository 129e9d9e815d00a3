"""The loops of the voxel grid: each point's cube as one number, and the mean of the points of each cube."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from course_lib.compiled import FLOATS, INTS, ROWS, compiled

__all__ = ["cube_numbers", "means_of_cubes", "reaches"]


@compiled(f"void({ROWS}, int64, int64, float64[::1], float64[::1])")
def reaches(
    points: NDArray[np.float64], start: int, stop: int, low: NDArray[np.float64], high: NDArray[np.float64]
) -> None:
    """The smallest and the largest coordinate along each axis."""
    x0 = y0 = z0 = math.inf
    x1 = y1 = z1 = -math.inf
    for i in range(start, stop):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
    low[0], low[1], low[2] = x0, y0, z0
    high[0], high[1], high[2] = x1, y1, z1


@compiled(f"void({ROWS}, {FLOATS}, float64, {INTS}, {INTS}, int64, int64, int64, int64[::1])")
def cube_numbers(
    points: NDArray[np.float64],
    origin: NDArray[np.float64],
    size: float,
    first: NDArray[np.int64],
    wide: NDArray[np.int64],
    bits: int,
    start: int,
    stop: int,
    key: NDArray[np.int64],
) -> None:
    """Write for each point the number of its cube, x first, and behind it in `bits` bits its own."""
    for i in range(start, stop):
        x = int(math.floor((points[i, 0] - origin[0]) / size)) - first[0]
        y = int(math.floor((points[i, 1] - origin[1]) / size)) - first[1]
        z = int(math.floor((points[i, 2] - origin[2]) / size)) - first[2]
        key[i] = (((x * wide[1] + y) * wide[2] + z) << bits) | i


@compiled(f"int64({INTS}, {ROWS}, {FLOATS}, int64, int64, int64, int64, float64[:, ::1])")
def means_of_cubes(
    key: NDArray[np.int64],
    points: NDArray[np.float64],
    low: NDArray[np.float64],
    bits: int,
    start: int,
    stop: int,
    row: int,
    means: NDArray[np.float64],
) -> int:
    """Write the means of the cubes that begin in a part of the sorted numbers, from a row on, and return how many.

    Where `row` is negative, they are only counted. Coordinates are taken from the lowest one, so that far-away clouds
    keep their digits.
    """
    own = (1 << bits) - 1
    found, i = 0, start
    while i < stop and i > 0 and key[i] >> bits == key[i - 1] >> bits:
        i += 1  # of a cube that begins before
    while i < stop:
        cube = key[i] >> bits
        x = y = z = 0.0
        count = 0
        while i < len(key) and key[i] >> bits == cube:
            if row >= 0:
                point = key[i] & own
                x += points[point, 0] - low[0]
                y += points[point, 1] - low[1]
                z += points[point, 2] - low[2]
            count += 1
            i += 1
        if row >= 0:
            means[row + found, 0] = low[0] + x / count
            means[row + found, 1] = low[1] + y / count
            means[row + found, 2] = low[2] + z / count
        found += 1
    return found
