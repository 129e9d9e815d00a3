"""Surface normals from the covariance of neighbours, and how they are turned to one side.

The points around a point spread out along the surface and hardly across it. So the direction in which they spread
least is the normal: the eigenvector of the smallest eigenvalue of their covariance. A viewpoint decides its sign.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.checks import finite_points
from course_lib.cloud.neighbours import Neighbours
from course_lib.compiled import in_threads

__all__ = ["Surfels", "estimate_normals", "fit_surfels", "orient_normals", "smallest_eigenvectors"]

FLAT = 1e-12  # a second eigenvalue below this share of the largest: the neighbours lie on a line, which has no normal
ROUNDING = 16 * np.finfo(np.float64).eps  # of a coordinate and of what is computed from it, as a share of its size
ROUNDING_FLOAT32 = 4 * float(np.finfo(np.float32).eps)  # of a coordinate that came in single precision
NEARLY_A_LINE = 1 - 1e-6  # from here on the closed form loses digits, and the slower solver takes over
BLOCK = 1 << 13  # points at a time, so that what is computed of them stays in the cache


class Surfels(NamedTuple):
    """What the neighbours of each point say of the surface there.

    Attributes
    ----------
    normals : (N, 3) float64, unit length, sign arbitrary; NaN where fewer than 3 neighbours, or neighbours on a line.
    variation : (N,) λ0 / (λ0 + λ1 + λ2) of the eigenvalues, smallest first: 0 on a plane, at most 1/3. NaN as above.
    """

    normals: NDArray[np.float64]
    variation: NDArray[np.float64]


def estimate_normals(
    points: ArrayLike, k: int = 30, radius: float = np.inf, viewpoint: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Estimate the normal of the surface at each point.

    Parameters
    ----------
    points : (N, 3) float, finite, N ≥ 3.
    k : neighbours to look at, the point itself among them.
    radius : farther neighbours do not count.
    viewpoint : (3,) from where the points were seen: normals point to its side. None leaves the sign arbitrary.

    Returns
    -------
    (N, 3) float64 of unit length; NaN where the neighbours are fewer than 3 or lie on a line.

    Raises
    ------
    ValueError
        If there are fewer than 3 points, or no point has a normal.

    References
    ----------
    Hoppe, DeRose, Duchamp, McDonald and Stuetzle, Surface reconstruction from unorganized points, SIGGRAPH 1992.

    Examples
    --------
    >>> square = [[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1.0]]
    >>> estimate_normals(square, k=4, viewpoint=(0, 0, 0))[0].tolist()
    [0.0, 0.0, -1.0]
    """
    array = finite_points(points)
    normals = _surfels(array, k, radius, _rounding(points)).normals
    if np.isnan(normals[:, 0]).all():
        raise ValueError(
            "points: nowhere do neighbours span a plane (fewer than 3, or on one line); there are no normals."
        )
    return normals if viewpoint is None else orient_normals(array, normals, viewpoint)


def orient_normals(points: ArrayLike, normals: ArrayLike, viewpoint: ArrayLike) -> NDArray[np.float64]:
    """Turn each normal to the side from which its point was seen.

    Parameters
    ----------
    points : (N, 3) float.
    normals : (N, 3) float.
    viewpoint : (3,), in the frame of the points; (0, 0, 0) for a camera's own cloud.

    Returns
    -------
    (N, 3) float64.

    Raises
    ------
    ValueError
        If the shapes differ.

    Examples
    --------
    >>> orient_normals([[0, 0, 2.0]], [[0, 0, 1.0]], (0, 0, 0)).tolist()
    [[0.0, 0.0, -1.0]]
    """
    array = finite_points(points)
    turned = checks.last_axis(normals, 3, "normals").astype(np.float64)
    if turned.shape != array.shape:
        raise ValueError(f"normals: expected one a point, shape {array.shape}, got {turned.shape}.")
    away = np.einsum("ij,ij->i", turned, array - checks.vector(viewpoint, 3, "viewpoint")) > 0
    turned[away] *= -1
    return turned + 0.0  # no minus zero


def fit_surfels(points: ArrayLike, k: int = 30, radius: float = np.inf) -> Surfels:
    """Fit a small plane to the neighbours of each point.

    Parameters
    ----------
    points, k, radius : as in `estimate_normals`.

    Raises
    ------
    ValueError
        If there are fewer than 3 points, or k < 3.
    """
    return _surfels(points, k, radius, _rounding(points))


def _rounding(points: ArrayLike) -> float:
    """How exact the coordinates are, as a share of their size: a line in float32 is not straight in float64."""
    return ROUNDING_FLOAT32 if np.asarray(points).dtype.itemsize < 8 else ROUNDING


def _surfels(points: ArrayLike, k: int, radius: float, rounding: float) -> Surfels:
    near = Neighbours(points)
    if len(near) < 3:
        raise ValueError(f"points: a plane needs 3 of them, there are {len(near)}.")
    k = checks.whole(k, "k", 3, of="neighbours")
    six, count = near.covariances(min(k, len(near)), checks.reach(radius, "radius"))
    normals, variation = np.empty((len(near), 3)), np.empty(len(near))

    def job(start: int, stop: int) -> None:
        for begin in range(start, stop, BLOCK):
            part = slice(begin, min(begin + BLOCK, stop))
            normals[part], variation[part] = _planes(six[part], count[part], near.points[part], rounding)

    in_threads(job, len(near), BLOCK)
    return Surfels(normals, variation)


def _planes(
    six: NDArray[np.float64], count: NDArray[np.intp], points: NDArray[np.float64], rounding: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normals and variations of a block: the eigenvectors of its covariances."""
    normals, values = smallest_eigenvectors(six.T)
    digits = (rounding * np.abs(points).max(axis=1)) ** 2  # a spread below that of the digits of the coordinates
    line = (count < 3) | (values[1] <= np.maximum(FLAT * values[2], digits))
    variation = values[0] / np.where(line, 1, values.sum(axis=0))
    normals[line], variation[line] = np.nan, np.nan
    return normals, variation


def smallest_eigenvectors(six: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return, of symmetric 3x3 matrices, the eigenvector of the smallest eigenvalue, and all eigenvalues.

    The roots of the cubic come from their closed form; the eigenvector is a column of the adjugate of A − λI, which is
    a multiple of n nᵀ. Where two small eigenvalues nearly meet, LAPACK decides instead.

    Parameters
    ----------
    six : (6, B) xx, yy, zz, xy, xz, yz of each matrix, positive semi-definite.

    Returns
    -------
    vectors : (B, 3) of length 1, sign arbitrary.
    values : (3, B) ascending, none below 0; two large ones that are equal come apart by a few 1e-9 of their size.

    References
    ----------
    Smith, Eigenvalues of a symmetric 3x3 matrix, CACM 4(4), 1961. Kopp, Efficient numerical diagonalization of
    Hermitian 3x3 matrices, Int. J. Mod. Phys. C 19, 2008.

    Examples
    --------
    >>> vectors, values = smallest_eigenvectors([[4.0], [1.0], [9.0], [0.0], [0.0], [0.0]])
    >>> np.abs(vectors).round(12).tolist(), values[:, 0].round(12).tolist()
    ([[0.0, 1.0, 0.0]], [1.0, 4.0, 9.0])
    """
    xx, yy, zz, xy, xz, yz = np.asarray(six, dtype=np.float64)
    third = (xx + yy + zz) / 3
    a, b, c = xx - third, yy - third, zz - third
    off = xy * xy + xz * xz + yz * yz
    p = np.sqrt((a * a + b * b + c * c + 2 * off) / 6)
    half_det = (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        r = np.clip(half_det / (p * p * p), -1, 1)
    angle = np.arccos(r) / 3
    low = third + 2 * p * np.cos(angle + 2 * np.pi / 3)
    high = third + 2 * p * np.cos(angle)

    a, b, c = xx - low, yy - low, zz - low
    cx, cy, cz = b * c - yz * yz, a * c - xz * xz, a * b - xy * xy
    cxy, cxz, cyz = xz * yz - xy * c, xy * yz - xz * b, xy * xz - a * yz
    x_first, y_first = (cx >= cy) & (cx >= cz), cy >= cz
    vectors = np.empty((len(xx), 3))
    vectors[:, 0] = np.where(x_first, cx, np.where(y_first, cxy, cxz))
    vectors[:, 1] = np.where(x_first, cxy, np.where(y_first, cy, cyz))
    vectors[:, 2] = np.where(x_first, cxz, np.where(y_first, cyz, cz))
    with np.errstate(divide="ignore", invalid="ignore"):
        vectors /= np.sqrt(np.einsum("bi,bi->b", vectors, vectors))[:, None]
    values = np.stack([low, 3 * third - low - high, high])

    hard = np.flatnonzero(~(r < NEARLY_A_LINE) | ~np.isfinite(vectors[:, 0]))
    if hard.size:
        matrices = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1)[hard].reshape(-1, 3, 3)
        w, v = np.linalg.eigh(matrices)
        vectors[hard], values[:, hard] = v[:, :, 0], w.T
    return vectors, np.maximum(values, 0)
