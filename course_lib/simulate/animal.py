"""The animal of the course: a smooth, closed, lop-sided shape that stands in for the Stanford bunny.

It is the smooth union of ellipsoids, hollowed at the ears, with the faint bumps of a clay model.

References
----------
Quilez, "Smooth minimum" and "Ellipsoid - distance estimation", iquilezles.org.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from course_lib.simulate.implicit import Solid, closed_surface, gradient

PARTS = ("body", "head", "ears", "limbs", "tail", "eyes")

# centre, half axes (m), turn about x, y, z (degrees), part, blend radius (m): it sits and looks over its right shoulder
_ANIMAL = (
    ((0.000, 0.000, 0.046), (0.052, 0.040, 0.044), (0, -18, 0), 0, 0.020),
    ((0.026, 0.000, 0.062), (0.030, 0.030, 0.042), (0, 24, 0), 0, 0.020),
    ((-0.022, -0.027, 0.032), (0.033, 0.019, 0.031), (0, 12, 8), 3, 0.008),
    ((-0.022, 0.027, 0.032), (0.033, 0.019, 0.031), (0, 12, -8), 3, 0.008),
    ((0.006, -0.036, 0.009), (0.031, 0.012, 0.0105), (0, 0, -6), 3, 0.013),
    ((0.008, 0.035, 0.009), (0.031, 0.012, 0.0105), (0, 0, 9), 3, 0.013),
    ((0.042, -0.014, 0.027), (0.0115, 0.0105, 0.032), (0, -9, 0), 3, 0.011),
    ((0.046, 0.013, 0.026), (0.0115, 0.0105, 0.031), (0, -16, 0), 3, 0.011),
    ((0.053, -0.014, 0.007), (0.015, 0.0100, 0.0075), (0, 0, -8), 3, 0.006),
    ((0.059, 0.013, 0.007), (0.015, 0.0100, 0.0075), (0, 0, 5), 3, 0.006),
    ((0.042, -0.007, 0.107), (0.031, 0.024, 0.0245), (0, 14, -22), 1, 0.012),
    ((0.063, -0.015, 0.098), (0.0145, 0.0145, 0.0125), (0, 14, -22), 1, 0.010),
    ((0.053, -0.025, 0.097), (0.012, 0.009, 0.010), (0, 0, -22), 1, 0.007),
    ((0.060, 0.001, 0.097), (0.012, 0.009, 0.010), (0, 0, -22), 1, 0.007),
    ((0.0750, -0.0200, 0.1010), (0.0042, 0.0050, 0.0036), (0, 10, -22), 1, 0.004),
    ((0.018, -0.019, 0.153), (0.0068, 0.0145, 0.038), (12, -26, -24), 2, 0.007),
    ((0.027, 0.014, 0.142), (0.0066, 0.0130, 0.025), (-32, -16, 6), 2, 0.007),
    ((0.025, 0.041, 0.150), (0.0062, 0.0145, 0.024), (-122, 0, 4), 2, 0.009),
    ((-0.058, 0.004, 0.036), (0.016, 0.016, 0.0155), (0, 0, 0), 4, 0.005),
    ((0.0530, -0.0288, 0.1135), (0.0048, 0.0044, 0.0050), (0, 0, -22), 5, 0.0015),
    ((0.0650, 0.0034, 0.1135), (0.0048, 0.0044, 0.0050), (0, 0, -22), 5, 0.0015),
)
_HOLLOWS = (  # the inside of each ear: centre, half axes, turn, blend radius
    ((0.0255, -0.0222, 0.1550), (0.0052, 0.0088, 0.029), (12, -26, -24), 0.004),
    ((0.0335, 0.0140, 0.1420), (0.0045, 0.0075, 0.018), (-32, -16, 6), 0.004),
    ((0.0305, 0.0415, 0.1500), (0.0045, 0.0090, 0.017), (-122, 0, 4), 0.004),
)


def _turn(degrees: Sequence[float]) -> np.ndarray:
    a, b, c = np.radians(degrees)
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return z @ y @ x


def _smooth_min(a: np.ndarray, b: np.ndarray, k: float) -> np.ndarray:
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * h * (k / 6)


def _ellipsoid(p: np.ndarray, centre: Sequence[float], axes: Sequence[float], degrees: Sequence[float]) -> np.ndarray:
    """Distance of points (N, 3) to an ellipsoid, to first order, negative inside."""
    R = _turn(degrees)
    squares, steep = np.full(len(p), 1e-12), np.zeros(len(p))
    for k in range(3):
        local = (p[:, 0] - centre[0]) * R[0, k] + (p[:, 1] - centre[1]) * R[1, k] + (p[:, 2] - centre[2]) * R[2, k]
        local *= local * (1 / axes[k] ** 2)
        squares += local
        steep += local * (1 / axes[k] ** 2)
    scaled = np.sqrt(squares)
    return (scaled - 1) * np.clip(scaled / np.sqrt(steep + 1e-12), min(axes), max(axes))


def animal_distance(p: np.ndarray, seed: int = 0) -> np.ndarray:
    """Signed distance, nearly (negative inside, metres), from points (N, 3) to the animal, which stands on z = 0."""
    p = np.asfortranarray(p)  # columns one after the other in memory: twice as fast
    distance = np.full(len(p), 1.0)
    for centre, axes, degrees, _part, blend in _ANIMAL:
        distance = _smooth_min(distance, _ellipsoid(p, centre, axes, degrees), blend)
    for centre, axes, degrees, blend in _HOLLOWS:
        distance = -_smooth_min(-distance, _ellipsoid(p, centre, axes, degrees), blend)
    rng = np.random.default_rng(seed)
    for wavelength, height in ((0.036, 3e-4), (0.021, 1.6e-4), (0.012, 0.8e-4)):  # bumps like those of a clay model
        for _ in range(4):
            direction = rng.normal(size=3)
            direction *= 2 * np.pi / wavelength / np.linalg.norm(direction)
            along = p[:, 0] * direction[0] + p[:, 1] * direction[1] + p[:, 2] * direction[2]
            distance = distance + height / 2 * np.sin(along + rng.uniform(0, 2 * np.pi))
    return -_smooth_min(-distance, p[:, 2], 0.004)  # cut off below z = 0, the edge rounded


def organic_shape(spacing: float = 0.00152, seed: int = 0) -> Solid:
    """A sitting, lop-eared animal, about 0.15 m long, closed, standing on z = 0 and looking towards +x.

    Parameters
    ----------
    spacing : grid cell, metres; the default gives about 36,000 vertices, twice of it about a quarter.
    seed : where the small bumps of its surface lie.
    """
    if not 4e-4 <= spacing <= 8e-3:
        raise ValueError(f"The spacing of organic_shape must lie between 0.0004 and 0.008 m, not {spacing}.")

    def distance(p: np.ndarray) -> np.ndarray:
        return animal_distance(p, seed)

    pad = 2 * spacing
    low, high = np.array([-0.082, -0.056, 0.0]) - pad, np.array([0.084, 0.068, 0.195]) + pad
    vertices, triangles = closed_surface(distance, low, high, spacing)
    normals = gradient(distance, vertices)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nearest = np.argmin([_ellipsoid(vertices, *row[:3]) for row in _ANIMAL], axis=0)
    part = np.array([row[3] for row in _ANIMAL], np.uint8)[nearest]
    return Solid(vertices, triangles, normals, part)


def animal_colors(solid: Solid, seed: int) -> np.ndarray:
    """(V, 3) uint8 colours of the animal: a dappled coat, a light tail and feet, dark eyes."""
    rng, p = np.random.default_rng([seed, 1]), solid.vertices
    dapple = np.zeros(len(p))
    for wavelength in (0.06, 0.04, 0.025):
        for _ in range(3):
            way = rng.normal(size=3)
            way *= 2 * np.pi / wavelength / np.linalg.norm(way)
            dapple += np.sin(p[:, 0] * way[0] + p[:, 1] * way[1] + p[:, 2] * way[2] + rng.uniform(0, 6.28)) / 3
    light = 1 / (1 + np.exp(-2.5 * dapple))[:, None]
    coat = np.array((150, 98, 60)) * (1 - light) + np.array((206, 158, 110)) * light
    pale = np.array((240, 230, 214))
    coat = np.where(solid.part[:, None] == PARTS.index("tail"), pale, coat)
    feet = np.clip((0.016 - p[:, 2:]) / 0.008, 0, 1)
    inner = np.clip((solid.normals[:, :1] - 0.55) / 0.2, 0, 1) * (solid.part[:, None] == PARTS.index("ears"))
    nose = np.clip(1.6 - np.sqrt(np.sum((p - (0.0775, -0.0210, 0.1010)) ** 2, 1))[:, None] / 0.0035, 0, 1)
    for weight, colour in ((feet, pale), (inner, (226, 168, 150)), (nose, (120, 62, 60))):
        coat = coat * (1 - weight) + np.asarray(colour) * weight
    coat = np.where(solid.part[:, None] == PARTS.index("eyes"), np.array((24, 20, 22)), coat)
    return coat.clip(0, 255).astype(np.uint8)
