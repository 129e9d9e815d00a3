"""Lens distortion by the model of Brown and Conrady, and its inverse.

Coordinates are normalised: x/z and y/z of a point, or (u − cx)/fx and (v − cy)/fy of a pixel. Coefficients are
k1, k2, p1, p2, k3 in OpenCV's order. Everything here can be had from `course_lib.camera.pinhole` too.

References
----------
Brown, Close-range camera calibration, Photogrammetric Engineering 37(8), 1971. OpenCV manual, module calib3d.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks

# The inverse is iterated until it reproduces the point to this many focal lengths.
UNDISTORT_TOLERANCE = 1e-12
UNDISTORT_STEPS = 100


def distort(xy: ArrayLike, distortion: ArrayLike) -> NDArray[np.float64]:
    """Bend ideal normalised coordinates as a real lens does, by the model of Brown and Conrady.

    Parameters
    ----------
    xy : (..., 2) normalised coordinates x/z, y/z.
    distortion : (5,) k1, k2, p1, p2, k3.

    Returns
    -------
    (..., 2) float64, normalised coordinates.

    Raises
    ------
    ValueError
        If shapes are wrong.

    Examples
    --------
    >>> distort([[1.0, 0.0]], (0.1, 0.0, 0.0, 0.0, 0.0)).tolist()
    [[1.1, 0.0]]
    """
    xy = checks.last_axis(xy, 2, "xy").astype(np.float64)
    k1, k2, p1, p2, k3 = checks.vector(distortion, 5, "distortion (k1, k2, p1, p2, k3)")
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )


def undistort(xy: ArrayLike, distortion: ArrayLike) -> NDArray[np.float64]:
    """Straighten distorted normalised coordinates: the inverse of `distort`, by Newton's iteration.

    Parameters
    ----------
    xy : (..., 2) distorted normalised coordinates: (u − cx)/fx, (v − cy)/fy. A point with a NaN becomes NaN.
    distortion : (5,) k1, k2, p1, p2, k3.

    Returns
    -------
    (..., 2) float64, ideal normalised coordinates x/z, y/z.

    Raises
    ------
    ValueError
        If shapes are wrong, or a point lies where the lens model folds over and has no inverse.
    """
    target = checks.last_axis(xy, 2, "xy").astype(np.float64)
    flat = target.reshape(-1, 2)
    finite = np.isfinite(flat).all(axis=1, keepdims=True)
    result = np.where(finite, flat, np.nan)
    todo = np.flatnonzero(finite)
    for _ in range(UNDISTORT_STEPS):
        guess, wanted = result[todo], flat[todo]
        miss = distort(guess, distortion) - wanted
        (a, b), (_, d) = _slopes(guess, distortion)
        determinant = a * d - b * b
        # A root beyond the point where the lens folds over is a false one: it is walked away from, never accepted.
        proper = (determinant > 0) & (a + d > 0)
        found = proper & (np.abs(miss).max(axis=1) <= UNDISTORT_TOLERANCE * (1 + np.abs(wanted).max(axis=1)))
        if found.all():
            return result.reshape(target.shape)
        todo, guess, miss, proper = todo[~found], guess[~found], miss[~found], proper[~found]
        a, b, d, determinant = a[~found], b[~found], d[~found], determinant[~found]
        newton = np.stack([d * miss[:, 0] - b * miss[:, 1], a * miss[:, 1] - b * miss[:, 0]], axis=1)
        step = np.where(proper[:, None], newton / np.where(proper, determinant, 1.0)[:, None], 0.5 * guess)
        # A step is at most half as long as the radius, so that Newton does not leap over the fold.
        limit = 0.5 * np.linalg.norm(guess, axis=1) + 1e-3
        result[todo] = guess - step * np.minimum(1.0, limit / np.maximum(np.linalg.norm(step, axis=1), limit))[:, None]
    raise ValueError(
        f"undistort: {len(todo)} points lie where this distortion folds over and has no inverse; "
        "check the coefficients and their order (k1, k2, p1, p2, k3)."
    )


def _slopes(
    xy: NDArray[np.float64], distortion: ArrayLike
) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """The derivative of `distort` at (N, 2) points: ((dx/dx, dx/dy), (dy/dx, dy/dy)), which is symmetric."""
    k1, k2, p1, p2, k3 = checks.vector(distortion, 5, "distortion (k1, k2, p1, p2, k3)")
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    bend = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
    mixed = x * y * bend + 2 * p1 * x + 2 * p2 * y
    along_x = radial + x * x * bend + 2 * p1 * y + 6 * p2 * x
    along_y = radial + y * y * bend + 6 * p1 * y + 2 * p2 * x
    return (along_x, mixed), (mixed, along_y)
