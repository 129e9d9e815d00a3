"""A desk in a deep room for lab 05, as 150 by 110 pixels see it: neighbours lie apart in proportion to z."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from course_lib.cloud.clusters import euclidean_clusters

SURFACE, THIN, FLYING, REFLECTION, NOISE = range(1, 6)
FOCAL = 110.0
"""Pixels: one of them is z / FOCAL wide, 9 mm at 1 m."""
_WIDTH, _HEIGHT = 150, 110
_NOISE = 0.0012
"""Of depth, in metres at 1 m; it grows with z squared."""
_APART = 5.5
"""Pixels at their depth: no wrong point comes closer to a true one."""
_LEAST = 370
"""Points of the smallest true piece."""


def in_pixels(points: np.ndarray) -> np.ndarray:
    """Coordinates (N, 3) in which a distance is one in pixels at its depth: x / z, y / z and ln z, times FOCAL."""
    x, y, z = np.asarray(points, float).T
    return FOCAL * np.column_stack([x / z, y / z, np.log(z)])


def deep_desk(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) in the camera's frame, metres, shuffled, and their kinds (N,).

    A desk with two boxes, a rod and a cable, a sign that hangs in the room, and a wall 3.2 to 4 m away; a tablet in
    which something is mirrored; flying pixels behind edges; single strays and specks of four.
    """
    while True:
        points, kinds = _seen(rng)
        label = euclidean_clusters(in_pixels(points[kinds < FLYING]), 3.0)
        if np.bincount(label).min() >= _LEAST:
            return points, kinds


def _seen(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """One drawing of a desk; a piece of something may be cut off from the rest by what is nearer."""
    rays, tilt = _rays(), float(rng.uniform(0.4, 0.46))
    depth, kinds = _world(rng, rays, tilt)
    true = np.log(depth)
    given = true.copy()
    _mirror(rng, rays, tilt, depth, given, kinds)
    _fly(rng, true, given, kinds)
    _stray(rng, given, kinds)
    wrong = kinds >= FLYING
    at = FOCAL * np.dstack([rays[..., :2], given])
    clear = np.ones(kinds.shape, bool)
    clear[wrong] = cKDTree(at[~wrong]).query(at[wrong])[0] >= _APART
    z = np.exp(given)
    z = z + _NOISE * z**2 * rng.normal(0, 1, z.shape).clip(-3, 3)
    order = rng.permutation(np.flatnonzero(clear.ravel()))
    return (rays * z[..., None]).reshape(-1, 3)[order], kinds.ravel()[order]


def _rays() -> np.ndarray:
    """The directions (H, W, 3) of the pixels, with z = 1."""
    u, v = np.meshgrid(np.arange(_WIDTH) - (_WIDTH - 1) / 2, np.arange(_HEIGHT) - (_HEIGHT - 1) / 2)
    return np.dstack([u / FOCAL, v / FOCAL, np.ones_like(u)])


def _upright(rays: np.ndarray, tilt: float) -> np.ndarray:
    """Directions as x right, y ahead, z up, for a camera that looks down by `tilt`."""
    x, down, ahead = np.moveaxis(rays, -1, 0)
    return np.dstack([x, np.cos(tilt) * ahead - np.sin(tilt) * down, -np.sin(tilt) * ahead - np.cos(tilt) * down])


_EYE = np.array([0.0, 0.0, 0.5])
"""The camera: half a metre above the desk, whose top is at height 0."""


def _depth_of_box(rays: np.ndarray, low: tuple[float, ...], high: tuple[float, ...]) -> np.ndarray:
    """Depth (H, W) of a box between two corners; infinite where a ray misses it."""
    with np.errstate(divide="ignore"):
        a, b = (np.asarray(low) - _EYE) / rays, (np.asarray(high) - _EYE) / rays
    near, far = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
    return np.where((near <= far) & (near > 0), near, np.inf)


def _world(rng: np.random.Generator, rays: np.ndarray, tilt: float) -> tuple[np.ndarray, np.ndarray]:
    """Depth and kinds (H, W) of what is there."""
    up = _upright(rays, tilt)
    wall, x1, x2 = rng.uniform(3.2, 4.0), rng.uniform(-0.5, -0.42), rng.uniform(0.1, 0.16)
    sign = rng.uniform(-0.7, 0.2), rng.uniform(2.0, 2.3)
    boxes = [
        ((-9, wall, -9), (9, wall + 1, 9)),
        ((-0.6, 0.45, -0.03), (0.6, 1.15, 0)),
        ((x1, 0.68, 0), (x1 + 0.2, 0.78, rng.uniform(0.1, 0.14))),
        ((x2, 0.72, 0), (x2 + 0.22, 0.84, rng.uniform(0.1, 0.16))),
        ((sign[0], sign[1], 0.14), (sign[0] + 0.6, sign[1] + 0.02, 0.5)),
    ]
    depth = np.min([_depth_of_box(up, *box) for box in boxes], axis=0)
    kinds = np.full(depth.shape, SURFACE)
    at = rng.uniform(-0.12, 0.0)
    rod = np.linspace((at, 0.95, 0.0), (at, 0.95, 0.36), 400)
    s = np.linspace(0, 1, 400)[:, None]
    end = rng.uniform(0.45, 0.55)
    cable = (1 - s) * (at, 0.95, 0.36) + s * (end, 0.6, 0.0) - 0.3 * s * (1 - s) * (0, 0, 1.0)
    for line in (rod, cable):
        x, y, z = (line - _EYE).T
        ahead, down = np.cos(tilt) * y - np.sin(tilt) * z, -np.sin(tilt) * y - np.cos(tilt) * z
        u = np.rint(FOCAL * x / ahead + (_WIDTH - 1) / 2).astype(int)
        v = np.rint(FOCAL * down / ahead + (_HEIGHT - 1) / 2).astype(int)
        seen = (u >= 0) & (u < _WIDTH) & (v >= 0) & (v < _HEIGHT)
        u, v, ahead = u[seen], v[seen], ahead[seen]
        front = ahead < depth[v, u]
        depth[v[front], u[front]] = ahead[front]
        kinds[v[front], u[front]] = THIN
    return depth, kinds


def _mirror(
    rng: np.random.Generator,
    rays: np.ndarray,
    tilt: float,
    depth: np.ndarray,
    given: np.ndarray,
    kinds: np.ndarray,
) -> None:
    """Where the tablet lies, the depth of what it mirrors: a few pixels deeper than the glass."""
    low = np.array([rng.uniform(-0.12, -0.08), rng.uniform(0.5, 0.53)])
    place = _EYE + _upright(rays, tilt) * depth[..., None]
    glass = ((place[..., :2] >= low) & (place[..., :2] <= low + (0.19, 0.132))).all(axis=-1)
    glass &= (np.abs(place[..., 2]) < 0.001) & (kinds == SURFACE)
    given[glass] += rng.uniform(7.0, 8.5) / FOCAL
    kinds[glass] = REFLECTION


def _fly(rng: np.random.Generator, true: np.ndarray, given: np.ndarray, kinds: np.ndarray) -> None:
    """Pixels on the far side of an edge that hang in the air behind what is near."""
    front = np.full(true.shape, np.inf)
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        front = np.minimum(front, np.roll(true, step, axis))
    inner = np.zeros(true.shape, bool)
    inner[1:-1, 1:-1] = True
    edge = inner & (true - front > 14 / FOCAL) & (kinds == SURFACE) & (rng.random(true.shape) < 0.6)
    room = np.minimum(true - front - 6 / FOCAL, 11 / FOCAL)
    given[edge] = (front + 6 / FOCAL + (room - 6 / FOCAL) * rng.random(true.shape))[edge]
    kinds[edge] = FLYING


def _stray(rng: np.random.Generator, given: np.ndarray, kinds: np.ndarray) -> None:
    """Single pixels, and specks of two by two, at any depth."""
    for size, count in ((1, 60), (2, 12)):
        for _ in range(count):
            v, u = rng.integers(0, _HEIGHT - size), rng.integers(0, _WIDTH - size)
            place = np.s_[v : v + size, u : u + size]
            if (kinds[place] == SURFACE).all():
                given[place] = np.log(rng.uniform(0.4, 3.0))
                kinds[place] = NOISE
