"""Two scans of one bumpy ground for lab 07, with leaves, and with parts that only one of them saw."""

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
    start : (4, 4) where a compass puts the source, T_target_source up to half the length and 22 degrees off.
    T_target_source : (4, 4) the motion that brings the source home.
    surface : (K, 3) the source's ground without noise and leaves, metres, in the source's frame.
    size : how many times larger all lengths are than in a ground of 1.5 m by 2 m.
    """

    source: np.ndarray
    target: np.ndarray
    normals: np.ndarray
    start: np.ndarray
    T_target_source: np.ndarray
    surface: np.ndarray
    size: float


def motion(rng: np.random.Generator, degrees: float, metres: float) -> np.ndarray:
    """(4, 4) turn by so many degrees about any axis, and a shift by so many metres in any direction."""
    axis, shift = rng.normal(size=(2, 3))
    T = exp(np.r_[np.zeros(3), axis / np.linalg.norm(axis) * np.radians(degrees)])
    T[:3, 3] = shift / np.linalg.norm(shift) * metres
    return T


def bumps(rng: np.random.Generator, n: int, low: float = 0.0, high: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a bumpy ground, metres, and their unit normals."""
    x, y = rng.uniform(low, high, n), rng.uniform(0, 2, n)
    z = 0.25 * np.sin(2.5 * x) * np.cos(2.1 * y) + 0.1 * np.sin(4.3 * x + 2.3 * y)
    dx = 0.625 * np.cos(2.5 * x) * np.cos(2.1 * y) + 0.43 * np.cos(4.3 * x + 2.3 * y)
    dy = -0.525 * np.sin(2.5 * x) * np.sin(2.1 * y) + 0.23 * np.cos(4.3 * x + 2.3 * y)
    normals = np.c_[-dx, -dy, np.ones(n)]
    return np.c_[x, y, z], normals / np.linalg.norm(normals, axis=1, keepdims=True)


def two_scans(rng: np.random.Generator) -> TwoScans:
    """Two scans of one ground that share two thirds, with a fifth of a spacing of noise; leaves over the source's.

    Each ground has its own size, 3 to 20 times 1.5 m by 2 m, and all lengths grow with it: no list of radii in metres
    fits them all, while one in spacings and lengths does.

    The start is farther off than it is tilted, so that a radius of a few spacings finds next to no partners. Leaves
    stand on one side, so that a radius that reaches them is pulled to that side: it has to begin large and shrink. The
    source's own coordinates are far from the target's, so that a step on the wrong side of T goes astray.
    """
    target, normals = bumps(rng, 1200, 0.0, 1.5)
    clean = bumps(rng, 1200, 0.5, 2.0)[0]
    leaves = bumps(rng, 300, 0.5, 2.0)[0] + rng.uniform(0.03, 0.5, (300, 1)) * [0, 0, 1]
    target = target + rng.normal(0, 0.005, target.shape)
    noisy = clean + rng.normal(0, 0.005, clean.shape)
    off, middle = motion(rng, rng.uniform(15, 22), 0.0), np.eye(4)
    way, middle[:3, 3] = rng.uniform(0, 2 * np.pi), clean.mean(axis=0)
    off[:3, 3] = 0.25 * np.cos(way), 0.25 * np.sin(way), rng.choice([-1, 1]) * rng.uniform(0.75, 0.9)
    T = motion(rng, rng.uniform(70, 120), 3.0)
    start = compose(middle, off, invert(middle), T)
    source = rng.permutation(apply(invert(T), np.vstack([noisy, leaves])))
    size = float(np.exp(rng.uniform(np.log(3), np.log(20))))
    surface = apply(invert(T), clean)
    for motion_of_all in (start, T):
        motion_of_all[:3, 3] *= size
    return TwoScans(size * source, size * target, normals, start, T, size * surface, size)
