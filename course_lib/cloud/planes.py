"""Planes: the best one through points, and the one that most points agree on.

A plane is n · x + d = 0 with a normal n of length 1, so that n · x + d is the distance of x, signed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.checks import finite_points

__all__ = ["Plane", "find_plane", "find_planes", "fit_plane", "iterations_needed"]

SUBSET = 4096  # points on which hypotheses are compared
BATCH = 128  # hypotheses at a time
MOST = 8192  # hypotheses at most
BEST = 3  # that are refined
REFITS = 5  # at most, over all inliers
FEW = 1e-3  # of the points: a refit that gains fewer inliers is the last
LINE = 1e-12  # points whose second radius squared is this share of the first lie on a line


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane n · x + d = 0.

    Parameters
    ----------
    normal : (3,) of any length but zero; stored with length 1, the largest component positive.
    offset : d for that normal as given.

    Raises
    ------
    ValueError
        If the normal is zero or not finite.

    Examples
    --------
    >>> floor = Plane((0, 0, 2), -4)  # z = 2
    >>> floor.distances([[5, 5, 3.5]]).tolist()
    [1.5]
    """

    normal: NDArray[np.float64]
    offset: float

    def __post_init__(self) -> None:
        normal, offset = checks.vector(self.normal, 3, "normal"), checks.number(self.offset, "offset")
        length = float(np.linalg.norm(normal))
        if length == 0:
            raise ValueError("normal: it is zero, so it says no direction.")
        if normal[np.abs(normal).argmax()] < 0:
            length = -length
        object.__setattr__(self, "normal", normal / length + 0.0)
        object.__setattr__(self, "offset", offset / length + 0.0)

    def distances(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the signed distances (N,) of points (N, 3), positive on the side of the normal."""
        return checks.last_axis(points, 3, "points") @ self.normal + self.offset


def fit_plane(points: ArrayLike) -> Plane:
    """Fit the plane of least squared distances, measured at right angles to it.

    The normal is the eigenvector of the smallest eigenvalue of the scatter matrix Σ (x − μ)(x − μ)ᵀ. Without the mean μ
    the plane would be forced through the origin.

    Parameters
    ----------
    points : (N, 3) float, finite, N ≥ 3.

    Raises
    ------
    ValueError
        If there are fewer than 3 points, or all lie on a line.

    References
    ----------
    Pearson, On lines and planes of closest fit to systems of points in space, Phil. Mag. 2, 1901.

    Examples
    --------
    >>> plane = fit_plane([[0, 0, 2], [1, 0, 2], [0, 1, 2], [1, 1, 2]])
    >>> plane.normal.tolist(), plane.offset
    ([0.0, 0.0, 1.0], -2.0)
    """
    return _fit(finite_points(points))


def _fit(array: NDArray[np.float64]) -> Plane:
    if len(array) < 3:
        raise ValueError(f"points: a plane needs 3 of them, there are {len(array)}.")
    middle = array[0] + (array - array[0]).mean(axis=0)  # far from the origin a plain mean would lose digits
    centred = array - middle
    values, vectors = np.linalg.eigh(centred.T @ centred)
    rounding = np.finfo(np.float64).eps * float(np.abs(array).max())
    if values[1] <= LINE * values[2] or values[1] <= len(array) * rounding**2:
        raise ValueError("points: they lie on a line, and many planes go through a line; give points beside it.")
    normal = vectors[:, 0]
    return Plane(normal, -float(normal @ middle))


def iterations_needed(inlier_share: float, sample: int = 3, confidence: float = 0.999) -> int:
    """Return how many random samples make it likely that one of them holds inliers only.

    A sample is good with probability wˢ, all of n are bad with (1 − wˢ)ⁿ, and that shall be at most 1 − p.

    Parameters
    ----------
    inlier_share : w, of all points, in (0, 1].
    sample : s, points a sample.
    confidence : p, in (0, 1).

    Raises
    ------
    ValueError
        If a number lies outside, or no number of samples is enough.

    References
    ----------
    Fischler and Bolles, Random sample consensus, CACM 24(6), 1981.

    Examples
    --------
    >>> iterations_needed(0.6, 3, 0.99)
    19
    """
    w, p = checks.number(inlier_share, "inlier_share"), checks.number(confidence, "confidence")
    sample = checks.whole(sample, "sample", of="points")
    if not 0 < p < 1:
        raise ValueError(f"confidence: expected a probability in (0, 1), got {confidence!r}.")
    if not 0 < w <= 1 or (good := w**sample) < 1e-300:
        raise ValueError(f"inlier_share: expected a share in (0, 1], and not one near 0, got {inlier_share!r}.")
    return 1 if good >= 1 else max(1, math.ceil(math.log(1 - p) / math.log1p(-good)))


def find_plane(
    points: ArrayLike, threshold: float, seed: int = 0, confidence: float = 0.999
) -> tuple[Plane, NDArray[np.bool_]]:
    """Find the plane with the most points near it, by RANSAC, and refine it by least squares over these.

    Hypotheses are compared on a random subset, the best few are refined there, and the winner is fitted again to its
    inliers in the whole cloud. There are as many hypotheses as `iterations_needed` for the share that the best one has.

    Parameters
    ----------
    points : (N, 3) float, finite, N ≥ 3.
    threshold : largest distance of an inlier, in the unit of the points.
    seed : of the random samples; the same seed gives the same plane.
    confidence : probability that a sample of inliers only was among those drawn.

    Returns
    -------
    plane : the plane.
    inliers : (N,) bool.

    Raises
    ------
    ValueError
        If there are fewer than 3 points, all lie on a line, or an argument is of another form.

    References
    ----------
    Fischler and Bolles, CACM 1981; Chum, Matas and Kittler, Locally optimized RANSAC, DAGM 2003.

    Examples
    --------
    >>> plane, inliers = find_plane([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.3, 0.2, 5]], threshold=0.01)
    >>> plane.normal.tolist(), inliers.tolist()
    ([0.0, 0.0, 1.0], [True, True, True, True, False])
    """
    array = finite_points(points)
    if len(array) < 3:
        raise ValueError(f"points: a plane needs 3 of them, there are {len(array)}.")
    reach = checks.positive(threshold, "threshold")
    local = array - (start := array[0])
    rounding = 8 * np.finfo(np.float64).eps * float(np.abs(array).max())
    best = _hypothesis(local, reach, np.random.default_rng(seed), confidence, rounding)
    if best is None:
        _fit(array)  # says what is wrong with them
        raise ValueError("points: no three of those drawn span a plane; most of them are equal or on one line.")
    inliers = _within(local, best, reach)
    for _ in range(REFITS):
        refined = _refit(local[np.flatnonzero(inliers)])
        if refined is None:
            break
        again = _within(local, refined, reach)
        more = np.count_nonzero(again) - np.count_nonzero(inliers)
        if more < 0:
            break
        best, inliers = refined, again
        if more <= FEW * len(local):
            break
    normal, offset = best
    return Plane(normal, offset - float(normal @ start)), inliers


def _within(local: NDArray[np.float64], plane: tuple[NDArray[np.float64], float], reach: float) -> NDArray[np.bool_]:
    """Which points lie near a plane."""
    off = local @ plane[0]
    off += plane[1]
    return np.abs(off, out=off) <= reach


def _refit(inside: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """Least squares over inliers near the origin: like `_fit`, in one pass. None where they span no plane."""
    if len(inside) < 3:
        return None
    total = np.ones(len(inside)) @ inside
    values, vectors = np.linalg.eigh(inside.T @ inside - np.outer(total, total) / len(inside))
    if values[1] <= LINE * values[2]:
        return None
    return vectors[:, 0], -float(vectors[:, 0] @ total) / len(inside)


def _hypothesis(
    local: NDArray[np.float64], reach: float, rng: np.random.Generator, confidence: float, rounding: float
) -> tuple[NDArray[np.float64], float] | None:
    """The best plane through three points, compared on a subset and refined on it; None if no three span a plane."""
    some = local if len(local) <= SUBSET else local[rng.integers(0, len(local), SUBSET)]
    # in single precision, in units of the threshold: enough to compare, and half the memory
    coarse = np.ascontiguousarray((some / reach).T, dtype=np.float32)
    scored: list[tuple[int, NDArray[np.float64], float]] = []
    drawn, needed = 0, MOST
    while drawn < needed:
        corner = local[rng.integers(0, len(local), (BATCH, 3))]
        first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        normal = np.cross(first, second)
        length = np.linalg.norm(normal, axis=1)
        one, other = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
        wide = length > np.maximum(1e-9 * one * other, rounding * (one + other))  # a width that is more than rounding
        drawn += BATCH
        if wide.any():
            normal = normal[wide] / length[wide, None]
            offset = -np.einsum("ij,ij->i", normal, corner[wide, 0])
            off = normal.astype(np.float32) @ coarse
            off += (offset / reach).astype(np.float32)[:, None]
            count = np.count_nonzero(np.abs(off, out=off) <= 1, axis=1)
            for i in np.argsort(-count, kind="stable")[:BEST]:
                scored.append((int(count[i]), normal[i], float(offset[i])))
            scored = sorted(scored, key=lambda one: -one[0])[:BEST]
            share = max(scored[0][0], 3) / len(some)
            needed = min(MOST, iterations_needed(min(1.0, share), 3, confidence))
    for _, normal, offset in tuple(scored):
        refined = _refit(some[_within(some, (normal, offset), reach)])
        if refined is not None:
            scored.append((int(np.count_nonzero(_within(some, refined, reach))), *refined))
    return max(scored, key=lambda one: one[0])[1:] if scored else None


def find_planes(
    points: ArrayLike, threshold: float, most: int = 5, least: int = 100, seed: int = 0
) -> Iterator[tuple[Plane, NDArray[np.intp]]]:
    """Find one plane after another, each among the points that the ones before left.

    Parameters
    ----------
    points, threshold, seed : as in `find_plane`.
    most : planes at most.
    least : a plane with fewer inliers ends the search.

    Yields
    ------
    plane : the plane.
    index : (M,) indices of its inliers into `points`.

    Raises
    ------
    ValueError
        As `find_plane`, for the first plane.

    Examples
    --------
    >>> floor = [[x, y, 0] for x in range(4) for y in range(4)]
    >>> wall = [[x, 9, z] for x in range(3) for z in range(1, 4)]
    >>> [len(index) for _, index in find_planes(floor + wall, 0.01, least=5)]
    [16, 9]
    """
    array = finite_points(points)
    left = np.arange(len(array))
    for number in range(most):
        try:
            plane, inliers = find_plane(array[left], threshold, seed + number)
        except ValueError:  # of what is left, no three points span a plane
            if number == 0:
                raise
            return
        if np.count_nonzero(inliers) < least:
            return
        yield plane, left[inliers]
        left = left[~inliers]
