"""Two scans of one bumpy surface for lab 07, with strays, and with parts that only one of them saw."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from course_lib.geometry.transforms import apply, compose, exp, invert


class TwoScans(NamedTuple):
    """Two scans and the truth.

    Parameters
    ----------
    source, target : (N, 3) and (M, 3) points, metres.
    normals : (M, 3) unit normals of the target.
    T_target_source : (4, 4) the motion that brings the source home.
    surface : (K, 3) the source's points without noise and strays, metres, in the source's frame.
    """

    source: np.ndarray
    target: np.ndarray
    normals: np.ndarray
    T_target_source: np.ndarray
    surface: np.ndarray


def motion(rng: np.random.Generator, degrees: float, metres: float) -> np.ndarray:
    """(4, 4) turn by so many degrees about any axis, and a shift by so many metres in any direction."""
    axis, shift = rng.normal(size=(2, 3))
    T = exp(np.r_[np.zeros(3), axis / np.linalg.norm(axis) * np.radians(degrees)])
    T[:3, 3] = shift / np.linalg.norm(shift) * metres
    return T


def bumps(rng: np.random.Generator, n: int, low: float = 0.0, high: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a bumpy surface, metres, and their unit normals."""
    x, y = rng.uniform(low, high, n), rng.uniform(0, 2, n)
    z = 0.25 * np.sin(2.5 * x) * np.cos(2.1 * y) + 0.1 * np.sin(4.3 * x + 2.3 * y)
    dx = 0.625 * np.cos(2.5 * x) * np.cos(2.1 * y) + 0.43 * np.cos(4.3 * x + 2.3 * y)
    dy = -0.525 * np.sin(2.5 * x) * np.sin(2.1 * y) + 0.23 * np.cos(4.3 * x + 2.3 * y)
    normals = np.c_[-dx, -dy, np.ones(n)]
    return np.c_[x, y, z], normals / np.linalg.norm(normals, axis=1, keepdims=True)


def two_scans(rng: np.random.Generator) -> TwoScans:
    """Two scans that share two thirds, 15 to 20 degrees and some 60 cm apart, with 5 mm noise and one stray in ten.

    The start is so far off that a radius of a few spacings finds too few true partners, and a radius that finds them
    lets strays and what only one scan saw pull on the result: it has to shrink.
    """
    target, normals = bumps(rng, 900, 0.0, 1.5)
    clean = bumps(rng, 900, 0.5, 2.0)[0]
    target = target + rng.normal(0, 0.005, target.shape)
    noisy = clean + rng.normal(0, 0.005, clean.shape)
    strays = rng.uniform((0.5, 0, -0.8), (2.0, 2, 0.8), (90, 3))
    middle = np.eye(4)
    middle[:3, 3] = clean.mean(axis=0)
    T = compose(middle, motion(rng, rng.uniform(15, 20), rng.uniform(0.55, 0.65)), invert(middle))
    source = rng.permutation(apply(invert(T), np.vstack([noisy, strays])))
    return TwoScans(source, target, normals, T, apply(invert(T), clean))
