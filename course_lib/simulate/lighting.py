"""Light for virtual scenes: how bright every surface is, computed once, so that it looks the same from everywhere.

Surfaces are matt (Lambert); lights are small clouds of points, which makes their shadows soft; corners and the ground
under things get less of the light that fills the room (ambient occlusion). Brightness has no unit: 1 is well lit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import open3d as o3d

GAMMA = 2.2
_LINEAR = ((np.arange(256) / 255.0) ** GAMMA).astype(np.float32)
_SHADES = 2048  # steps of the tone table for brightness 0 to 4
_TONE = np.rint(255 * (1 - np.exp(-1.35 * np.linspace(0, 4, 4 * _SHADES + 1))) ** (1 / GAMMA)).astype(np.uint8)


@dataclass(frozen=True)
class Light:
    """``points`` (K, 3) that shine with ``colour`` (3,) together, towards ``normal`` (3,); everywhere if it is None."""

    points: np.ndarray
    colour: tuple[float, float, float]
    normal: np.ndarray | None = None


def window_light(corner: Sequence[float], a: Sequence[float], b: Sequence[float], colour: Sequence[float]) -> Light:
    """A rectangle that shines towards a x b, sampled by 4 x 4 points."""
    corner, a, b = (np.asarray(v, float) for v in (corner, a, b))
    steps = (np.arange(4) + 0.5) / 4
    points = corner + steps[:, None, None] * a + steps[None, :, None] * b
    normal = np.cross(a, b)
    return Light(points.reshape(-1, 3), tuple(colour), normal / np.linalg.norm(normal))


def bulb_light(centre: Sequence[float], radius: float, colour: Sequence[float], count: int = 8) -> Light:
    """A ball that shines everywhere, sampled by points on a spiral."""
    return Light(np.asarray(centre, float) + radius * _spiral(count), tuple(colour))


def _spiral(count: int) -> np.ndarray:
    """``count`` unit vectors, evenly spread (the Fibonacci spiral)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], -1)


def blocked(caster: o3d.t.geometry.RaycastingScene, origins: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Whether the straight way from each origin (N, 3) to origin + offset (N, 3) meets a triangle: (N,) bool."""
    rays = np.concatenate([origins, offsets], 1).astype(np.float32)
    return caster.test_occlusions(o3d.core.Tensor(rays), tnear=1e-4, tfar=1 - 1e-4).numpy()


def brightness(
    caster: o3d.t.geometry.RaycastingScene,
    points: np.ndarray,
    normals: np.ndarray,
    lights: Sequence[Light],
    ambient: Sequence[float],
    reach: float = 0.6,
) -> np.ndarray:
    """Light that falls on points of surfaces.

    Parameters
    ----------
    caster : what casts shadows.
    points, normals : (N, 3) each, metres and unit vectors.
    lights : direct light, with shadows and falling off with the square of the distance.
    ambient : (3,) light from everywhere, taken away where things within ``reach`` metres close off the view.

    Returns
    -------
    (N, 3) float32.
    """
    start = points + 1e-3 * normals
    total = np.zeros((len(points), 3))
    for light in lights:
        gain = np.zeros(len(points))
        for source in light.points:
            way = source - start
            square = np.sum(way * way, 1)
            fall = np.sum(way * normals, 1) / np.sqrt(square)
            if light.normal is not None:
                fall = np.where(fall > 0, fall * np.maximum(-np.sum(way * light.normal, 1) / np.sqrt(square), 0), 0)
            lit = np.flatnonzero(fall > 1e-3)
            free = lit[~blocked(caster, start[lit], way[lit])] if len(lit) else lit
            gain[free] += fall[free] / (square[free] + 0.05)
        total += gain[:, None] / len(light.points) * np.asarray(light.colour)
    open_view = _open_view(caster, start, normals, reach)
    shade = (0.25 + 0.75 * open_view) * (0.9 + 0.1 * normals[:, 2])
    return (total + shade[:, None] * np.asarray(ambient)).astype(np.float32)


def _open_view(
    caster: o3d.t.geometry.RaycastingScene, start: np.ndarray, normals: np.ndarray, reach: float
) -> np.ndarray:
    """How open the view around each normal is: 1 with nothing within reach, less for things, near ones the most."""
    around = _spiral(20) * 0.97  # added to the unit normal, these are spread by the cosine
    free = np.zeros(len(start))
    rays = np.empty((len(start), 6), np.float32)
    rays[:, :3] = start
    for direction in around:
        way = normals + direction
        rays[:, 3:] = way * (reach / np.sqrt(np.sum(way * way, 1, keepdims=True)))
        free += np.minimum(caster.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy(), 1)
    return free / len(around)


def linear(picture: np.ndarray) -> np.ndarray:
    """Turn display values (uint8) into light (float32, 0 to 1)."""
    return _LINEAR[picture]


def displayed(light: np.ndarray) -> np.ndarray:
    """Turn light (float, 1 for bright) into display values (uint8), bright ones gently compressed."""
    return _TONE[np.clip(light * _SHADES, 0, 4 * _SHADES).astype(np.int32)]
