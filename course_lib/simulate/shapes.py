"""Shapes of virtual scenes: rectangles, boxes, turned solids, and a smooth closed animal.

A *patch* is a grid of points that a picture can be glued to: seen from outside, column j runs to the right and row i
runs downwards, as in an image. All lengths are metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from course_lib.simulate.animal import PARTS, animal_colors, animal_distance, organic_shape
from course_lib.simulate.implicit import Solid, closed_surface, gradient, rotate

__all__ = [
    "PARTS", "Patch", "Solid", "animal_colors", "animal_distance", "box", "closed_surface", "curved", "gradient",
    "organic_shape", "rectangle", "sharp", "sphere", "turned",
]  # fmt: skip


@dataclass(frozen=True)
class Patch:
    """A grid surface: ``points`` (rows, columns, 3) float64 and outward unit ``normals`` of the same shape."""

    points: np.ndarray
    normals: np.ndarray

    def moved(self, T: np.ndarray) -> Patch:
        """The patch after the rigid motion ``T`` (4, 4)."""
        return Patch(rotate(T, self.points) + T[:3, 3], rotate(T, self.normals))

    def triangles(self) -> np.ndarray:
        """(T, 3) int32 indices into the row-major grid, counter-clockwise from outside, none without area."""
        rows, columns = self.points.shape[:2]
        index = np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
        faces = np.stack([np.stack([a, c, b], -1), np.stack([b, c, d], -1)], axis=2).reshape(-1, 3)
        corners = self.points.reshape(-1, 3)[faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        return faces[area > 1e-12].astype(np.int32)


def rectangle(corner: Sequence[float], right: Sequence[float], down: Sequence[float], step: float = 0.25) -> Patch:
    """A flat patch from its top left ``corner`` along two edge vectors, with a grid line about every ``step`` metres.

    Raises
    ------
    ValueError
        If the edges span no area.
    """
    corner, right, down = (np.asarray(v, float) for v in (corner, right, down))
    (a, b, c), (d, e, f) = down, right
    normal = np.array([b * f - c * e, c * d - a * f, a * e - b * d])
    size = np.sqrt(normal @ normal)
    if not size > 0:
        raise ValueError("A rectangle needs two edges that are not parallel; give other 'right' and 'down' vectors.")
    columns, rows = (max(2, 1 + int(np.ceil(np.sqrt(edge @ edge) / step))) for edge in (right, down))
    u, v = np.arange(columns)[None, :, None] / (columns - 1), np.arange(rows)[:, None, None] / (rows - 1)
    points = corner + u * right + v * down
    return Patch(points, np.broadcast_to(normal / size, points.shape))


def box(size: Sequence[float], step: float = 0.25) -> dict[str, Patch]:
    """The six faces of a box that stands on the origin, its front towards -y; pictures on them are upright."""
    if min(size) <= 0:
        raise ValueError(f"A box needs three positive lengths in metres, not {tuple(size)}.")
    x, y, z = size[0] / 2, size[1] / 2, size[2]
    w, d, h = np.array([2 * x, 0, 0]), np.array([0, 2 * y, 0]), np.array([0, 0, z])
    return {
        "front": rectangle((-x, -y, z), w, -h, step),
        "back": rectangle((x, y, z), -w, -h, step),
        "left": rectangle((-x, y, z), -d, -h, step),
        "right": rectangle((x, -y, z), d, -h, step),
        "top": rectangle((-x, y, z), w, -d, step),
        "bottom": rectangle((-x, -y, 0), w, d, step),
    }


def turned(profile: Sequence[Sequence[float]], segments: int = 48, start: float = -np.pi) -> Patch:
    """The patch made by turning a profile about the z axis (a sphere, a mug, a lamp shade).

    Parameters
    ----------
    profile : (n, 2) radius and height, metres, from top to bottom; the surface is closed if both ends lie on the axis.
    segments : number of columns around the axis.
    start : angle of the picture's left edge, radians from +x.
    """
    profile = np.asarray(profile, float)
    if profile.ndim != 2 or profile.shape[1] != 2 or len(profile) < 2 or profile[:, 0].min() < 0:
        raise ValueError("A profile is a list of at least two (radius, height) pairs with radii that are not negative.")
    angle = start + np.linspace(0, 2 * np.pi, segments + 1)
    angle[-1] = angle[0]  # the seam closes exactly
    cos, sin = np.cos(angle), np.sin(angle)
    radius, height = profile[:, :1], profile[:, 1:]
    points = np.stack([radius * cos, radius * sin, np.broadcast_to(height, (len(profile), len(cos)))], -1)
    tangent = np.gradient(profile, axis=0)
    slope = np.stack([-tangent[:, 1], tangent[:, 0]], -1)  # outwards where the profile runs downwards
    slope /= np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12)
    across = slope[:, :1]
    normals = np.stack([across * cos, across * sin, np.broadcast_to(slope[:, 1:], across.shape[:1] + cos.shape)], -1)
    return Patch(points, normals)


def sphere(radius: float, segments: int = 64) -> Patch:
    """A closed sphere about the origin (its polyhedron is inscribed); its picture is a map, north at the top."""
    if not radius > 0:
        raise ValueError(f"A sphere needs a positive radius in metres, not {radius}.")
    latitude = np.linspace(np.pi / 2, -np.pi / 2, segments // 2 + 1)
    profile = radius * np.stack([np.cos(latitude), np.sin(latitude)], -1)
    profile[[0, -1], 0] = 0.0
    return turned(profile, segments)


def sharp(corners: Sequence[Sequence[float]], bevel: float = 0.0015) -> np.ndarray:
    """A profile with its inner corners doubled at a small distance, so that `turned` shades them as edges."""
    corners = np.asarray(corners, float)
    out = [corners[0]]
    for before, here, after in zip(corners[:-2], corners[1:-1], corners[2:], strict=True):
        for other in (before, after):
            length = np.linalg.norm(other - here)
            out.append(here + (other - here) * min(bevel / length, 0.45) if length > 0 else here)
    return np.array([*out, corners[-1]])


def curved(points: np.ndarray) -> Patch:
    """A patch through a grid of points (rows, columns, 3), its normals from the slopes of the grid."""
    points = np.asarray(points, float)
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    return Patch(points, normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12))
