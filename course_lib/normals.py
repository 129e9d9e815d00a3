"""Normals of a cloud: the direction in which a small piece of surface around each point is thinnest.

The neighbours of a point scatter widely along the surface and hardly across it. Their covariance matrix says so in
numbers: its eigenvalues are the squared spreads along three perpendicular directions, and the eigenvector of the
smallest one is the normal. Which of its two signs is meant, no neighbour can tell; a viewpoint can.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.neighbours import Neighbours, finite_points

__all__ = ["LocalShape", "curvature", "estimate_normals", "local_shape", "orient_towards", "smallest_eigenvectors"]

BLOCK = 1 << 13  # points at a time: the coordinates of their neighbours stay in the cache
DEFAULT_K = 30
THIN = 1e-12  # neighbours whose squared width is less than this share of their squared length lie on a line
ROUNDING = 16 * np.finfo(float).eps  # of coordinates, as a share of the largest one
NEARLY_A_LINE = 1 - 1e-6  # from here on the closed form loses digits, and the slower solver takes over

Floats = NDArray[np.float64]


class LocalShape(NamedTuple):
    """What the neighbourhood of each point looks like.

    Parameters
    ----------
    normals : (N, 3) unit vectors of either sign; NaN where the neighbours lie on a line, or are fewer than three.
    eigenvalues : (N, 3) ascending, squared unit of the points: variances along the normal and along the surface.
    """

    normals: Floats
    eigenvalues: Floats


def estimate_normals(
    points: ArrayLike,
    k: int = DEFAULT_K,
    viewpoint: ArrayLike | None = None,
    *,
    radius: float = np.inf,
    workers: int = -1,
) -> Floats:
    """Return the unit normal at each point: the eigenvector of the smallest eigenvalue of its neighbours' covariance.

    Parameters
    ----------
    points : (N, 3) float, metres, finite, N ≥ 3.
    k : how many nearest points make a neighbourhood, the point itself among them.
    viewpoint : (3,) where the sensor stood, in the frame of the points, or (N, 3), one a point; normals then point to
        its side. None leaves their signs to chance.
    radius : metres; neighbours farther away do not count.
    workers : threads of the search; -1 for all processors.

    Returns
    -------
    (N, 3) float64 of length 1; NaN where there is no normal: fewer than three neighbours, or all on a line.

    Raises
    ------
    ValueError
        If the input is of another form, or no point at all has a normal.

    References
    ----------
    Hoppe, DeRose, Duchamp, McDonald and Stuetzle, Surface reconstruction from unorganized points, SIGGRAPH 1992.

    Examples
    --------
    >>> square = [[0, 0, 2], [1, 0, 2], [0, 1, 2], [1, 1, 2]]
    >>> (estimate_normals(square, k=4, viewpoint=[0, 0, 0]) + 0.0).tolist()[0]
    [0.0, 0.0, -1.0]
    """
    array = finite_points(points)
    normals = local_shape(array, k, radius=radius, workers=workers).normals
    return normals if viewpoint is None else orient_towards(normals, array, viewpoint)


def curvature(points: ArrayLike, k: int = DEFAULT_K, *, radius: float = np.inf, workers: int = -1) -> Floats:
    """Return the surface variation at each point: the smallest eigenvalue over the sum of the three.

    It is 0 on a plane, 1/3 where points scatter alike in all directions, and large along edges. It has no unit and
    depends on the size of the neighbourhood.

    Parameters
    ----------
    points, k, radius, workers : as in `estimate_normals`.

    Returns
    -------
    (N,) float64 from 0 to 1/3; NaN where there is no normal.

    Raises
    ------
    ValueError
        If the input is of another form, or no point at all has a normal.

    References
    ----------
    Pauly, Gross and Kobbelt, Efficient simplification of point-sampled surfaces, IEEE Visualization 2002.

    Examples
    --------
    >>> curvature([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], k=6).round(3).tolist()[0]
    0.333
    """
    shape = local_shape(points, k, radius=radius, workers=workers)
    total = shape.eigenvalues.sum(axis=1)
    share = np.divide(shape.eigenvalues[:, 0], total, out=np.zeros_like(total), where=total > 0)
    return np.where(np.isnan(shape.normals[:, 0]), np.nan, share)


def orient_towards(normals: ArrayLike, points: ArrayLike, viewpoint: ArrayLike) -> Floats:
    """Return normals, turned round where they point away from the viewpoint.

    Parameters
    ----------
    normals : (N, 3); rows of NaN stay.
    points : (N, 3) metres.
    viewpoint : (3,) or (N, 3), metres, in the frame of the points.

    Returns
    -------
    (N, 3) float64; n · (viewpoint − p) ≥ 0.

    Raises
    ------
    ValueError
        If shapes differ, or the viewpoint is not finite.

    Examples
    --------
    >>> orient_towards([[0, 0, 1.0]], [[0, 0, 2.0]], [0, 0, 0]).tolist()
    [[-0.0, -0.0, -1.0]]
    """
    arrows = checks.cloud_points(normals, "normals").astype(np.float64)
    places = finite_points(points)
    if arrows.shape != places.shape:
        raise ValueError(f"normals: expected one a point, shape {places.shape}, got {arrows.shape}.")
    eye = checks.numbers(viewpoint, "viewpoint").astype(np.float64)
    if eye.shape not in ((3,), places.shape) or not np.isfinite(eye).all():
        raise ValueError(
            f"viewpoint: expected 3 finite numbers, or one place for each of the {len(places)} points, "
            f"got an array of shape {eye.shape}."
        )
    away = np.einsum("ni,ni->n", arrows, eye - places) < 0
    return np.where(away[:, None], -arrows, arrows)


def local_shape(points: ArrayLike, k: int = DEFAULT_K, *, radius: float = np.inf, workers: int = -1) -> LocalShape:
    """Return normals and eigenvalues of each point's neighbourhood.

    Parameters
    ----------
    points, k, radius, workers : as in `estimate_normals`.

    Returns
    -------
    LocalShape.

    Raises
    ------
    ValueError
        If the input is of another form, or no point at all has a normal.

    Examples
    --------
    >>> shape = local_shape([[0, 0, 0], [2, 0, 0], [0, 2, 0], [2, 2, 0]], k=4)
    >>> shape.eigenvalues[0].round(6).tolist()
    [0.0, 1.0, 1.0]
    """
    near = Neighbours(points)
    size = len(near)
    if size < 3:
        raise ValueError(f"points: {size} span no plane; normals need three or more that do not lie on a line.")
    if isinstance(k, (int, np.integer)) and not isinstance(k, bool) and k < 3:
        raise ValueError(f"k: {k} neighbours span no plane; take 3 or more, better 10 to 50.")
    normals, values = np.empty((size, 3)), np.empty((size, 3))
    columns = [np.ascontiguousarray(near.sorted[:, axis]) for axis in range(3)]
    smallest = (ROUNDING * max(float(np.abs(near.sorted).max()), np.finfo(float).tiny)) ** 2
    start = 0
    for index, _, place in near.self_nearest(min(k, size), radius, workers, BLOCK):
        own = np.arange(start, start + len(index))
        start += len(index)
        six, count = _covariances(columns, own, place, size)
        vectors, spread = smallest_eigenvectors(six)
        spread = spread.T
        lacking = (count < 3) | (spread[:, 1] <= np.maximum(THIN * spread[:, 2], smallest))
        vectors[lacking] = np.nan
        normals[index], values[index] = vectors, spread
    if np.isnan(normals[:, 0]).all():
        raise ValueError(
            "points: no point has a normal, as its neighbours are fewer than three or lie on a line; "
            "take a larger radius or more neighbours, or look at the cloud."
        )
    return LocalShape(normals, values)


def _covariances(
    columns: list[Floats], own: NDArray[np.intp], place: NDArray[np.intp], size: int
) -> tuple[Floats, NDArray[np.intp]]:
    """Covariances (6, B), xx yy zz xy xz yz, of the neighbours at `place` (B, k), and how many there are.

    Coordinates are counted from the point itself: numbers of 1e6 then lose no digits, and a missing neighbour, put at
    the point itself, adds nothing to any sum.
    """
    found = place < size
    count = np.count_nonzero(found, axis=1)
    if count.min() < place.shape[1]:
        place = np.where(found, place, own[:, None])
    offsets = [np.take(column, place) - column[own, None] for column in columns]
    mean = [offset.sum(axis=1) / count for offset in offsets]
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    six = np.empty((6, len(own)))
    for row, (a, b) in enumerate(pairs):
        np.einsum("bk,bk->b", offsets[a], offsets[b], out=six[row])
        six[row] /= count
        six[row] -= mean[a] * mean[b]
    return six, count


def smallest_eigenvectors(six: ArrayLike) -> tuple[Floats, Floats]:
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
