"""Other sensors, each by one simulated picture: laser scanner, structured light, stereo, infrared dots.

All of them look at a `Scene`; rays are cast against its true surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from course_lib.camera.pinhole import PinholeCamera, pixel_rays, project
from course_lib.camera.rgbd import RGBDFrame
from course_lib.geometry.transforms import check_rigid, invert
from course_lib.simulate.camera import cast, render
from course_lib.simulate.implicit import rotate
from course_lib.simulate.lighting import blocked, displayed, linear
from course_lib.simulate.scene_model import Scene


@dataclass(frozen=True)
class LaserScan:
    """One turn of a rotating laser scanner.

    Attributes
    ----------
    points : (N, 3) float64, metres, in the sensor's frame (x forward, y left, z up), only where something was hit.
    rings : (N,) uint8, which beam, 0 the lowest.
    azimuths : (N,) float64, radians from x towards y.
    ranges : (N,) float64, metres along the beam: a laser measures range, not z.
    labels : (N,) uint8, index into the scene's ``label_names``.
    """

    points: np.ndarray
    rings: np.ndarray
    azimuths: np.ndarray
    ranges: np.ndarray
    labels: np.ndarray


def laser_scan(
    scene: Scene,
    T_world_sensor: np.ndarray,
    elevations: Sequence[float],
    columns: int = 900,
    *,
    rng: np.random.Generator | None = None,
    sigma: float = 0.01,
    max_range: float = 30.0,
) -> LaserScan:
    """Scan a scene with a rotating bundle of beams.

    Parameters
    ----------
    T_world_sensor : (4, 4) pose of the sensor: x forward, y left, z up (the axis of rotation).
    elevations : one angle above the horizon a beam, radians, lowest first.
    columns : shots of each beam in one turn.
    rng : where the range noise comes from; None for none.
    sigma : standard deviation of the range, metres.
    max_range : metres; what is farther is not seen.

    Raises
    ------
    ValueError
        If there are no beams or shots, the pose is not rigid, or nothing is in range.
    """
    T, elevations = check_rigid(T_world_sensor, "T_world_sensor"), np.asarray(elevations, float)
    if elevations.ndim != 1 or not 1 <= len(elevations) <= 255 or columns < 1:
        raise ValueError("A laser scan needs 1 to 255 elevations (radians) and at least one shot a turn.")
    azimuth = np.tile(np.arange(columns) * 2 * np.pi / columns, len(elevations))
    ring = np.repeat(np.arange(len(elevations)), columns)
    cos = np.cos(elevations[ring])
    beams = np.stack([cos * np.cos(azimuth), cos * np.sin(azimuth), np.sin(elevations[ring])], 1)
    hits = cast(scene, T[:3, 3], rotate(T, beams))
    seen = hits.t <= max_range  # beams have length 1
    if not seen.any():
        raise ValueError(f"The laser scanner meets nothing within {max_range:g} m; move it, or raise max_range.")
    ranges = hits.t[seen].astype(float)
    if rng is not None:
        ranges = ranges + sigma * rng.standard_normal(len(ranges))
    label = scene.surface_label[scene.triangle_surface[hits.triangle[seen]]]
    return LaserScan(beams[seen] * ranges[:, None], ring[seen].astype(np.uint8), azimuth[seen], ranges, label)


@dataclass(frozen=True)
class PatternView:
    """A camera's view of a scene into which a projector shines.

    Attributes
    ----------
    image : (H, W, 3) uint8, what the camera sees.
    projector_uv : (H, W, 2) float32, the projector's pixel that shines on what each camera pixel sees; NaN in shadow.
    """

    image: np.ndarray
    projector_uv: np.ndarray


def stripes(width: int, height: int, period: float) -> np.ndarray:
    """Upright sine stripes for a projector: (height, width) float32 from 0 to 1, ``period`` pixels a stripe."""
    if not period > 0:
        raise ValueError(f"The period of stripes must be positive pixels, not {period}.")
    wave = 0.5 + 0.5 * np.cos(2 * np.pi * np.arange(width) / period)
    return np.tile(wave.astype(np.float32), (height, 1))


def dots(width: int, height: int, rng: np.random.Generator, share: float = 0.06, size: float = 1.2) -> np.ndarray:
    """Random soft dots, ``size`` pixels wide, on about ``share`` of the picture: (height, width) float32, 0 to 1."""
    spots = (rng.random((height, width)) < share / (4 * size**2)).astype(np.float32)
    soft = cv2.GaussianBlur(spots, (0, 0), size)
    return np.clip(soft * (2 * np.pi * size**2), 0, 1)


def structured_light(
    scene: Scene,
    camera: PinholeCamera,
    T_world_camera: np.ndarray,
    projector: PinholeCamera,
    T_world_projector: np.ndarray,
    pattern: np.ndarray,
    *,
    strength: float = 1.6,
    room_light: float = 0.25,
) -> PatternView:
    """What a camera sees of a scene into which a projector throws a pattern: geometry bends it.

    Parameters
    ----------
    camera, T_world_camera : the camera and its pose.
    projector, T_world_projector : the projector is a camera that shines instead of seeing.
    pattern : (projector.height, projector.width) float, 0 dark to 1 bright.
    strength : brightness of the projector at 1 m.
    room_light : how much of the ordinary light stays on.

    Raises
    ------
    ValueError
        If the pattern is not the projector's size, or a camera sees nothing.
    """
    pattern = np.asarray(pattern, np.float32)
    if pattern.shape != (projector.height, projector.width):
        raise ValueError(
            f"The pattern has shape {pattern.shape}, but the projector has {projector.height} rows and "
            f"{projector.width} columns; make the pattern for this projector."
        )
    T, T_lamp = check_rigid(T_world_camera), check_rigid(T_world_projector, "T_world_projector")
    frame = render(scene, camera, T)
    directions = rotate(T, pixel_rays(camera).reshape(-1, 3))
    hits = cast(scene, T[:3, 3], directions)
    seen = np.flatnonzero(hits.triangle >= 0)
    points = T[:3, 3] + directions[seen] * hits.t[seen, None].astype(float)
    normals = np.where(np.sum(hits.normal[seen] * directions[seen], 1, keepdims=True) > 0, -1, 1) * hits.normal[seen]
    inverse = invert(T_lamp)
    uv = project(rotate(inverse, points) + inverse[:3, 3], projector)
    inside = (uv >= 0).all(1) & (uv <= (projector.width - 1, projector.height - 1)).all(1)
    way = T_lamp[:3, 3] - points
    distance = np.sqrt(np.sum(way * way, 1))
    slant = np.sum(way * normals, 1) / distance
    lit = np.flatnonzero(inside & (slant > 0))
    lit = lit[~blocked(scene.caster, points[lit] + 1e-4 * normals[lit], way[lit])] if len(lit) else lit

    where = uv[lit].astype(np.float32)
    rows = -(-len(lit) // 1024)
    grid = np.zeros((max(rows, 1) * 1024, 2), np.float32)
    grid[: len(lit)] = where
    shine = cv2.remap(pattern, grid.reshape(-1, 1024, 2), None, cv2.INTER_LINEAR).ravel()[: len(lit)]
    light = room_light * linear(frame.color).reshape(-1, 3)
    gain = strength * shine * slant[lit] / distance[lit] ** 2
    light[seen[lit]] += gain[:, None] * (0.25 + 0.75 * linear(frame.color).reshape(-1, 3)[seen[lit]])
    found = np.full((len(directions), 2), np.nan, np.float32)
    found[seen[lit]] = where
    size = (camera.height, camera.width)
    return PatternView(displayed(light).reshape(*size, 3), found.reshape(*size, 2))


def infrared_dots(
    scene: Scene,
    camera: PinholeCamera,
    T_world_camera: np.ndarray,
    rng: np.random.Generator,
    *,
    offset: float = 0.03,
) -> np.ndarray:
    """What the left imager of an active stereo camera sees: (H, W) uint8, grey, with the dots of its own projector.

    Parameters
    ----------
    offset : metres from the imager to the projector, to the right.
    """
    wide = PinholeCamera(2 * camera.width, 2 * camera.height, 1.7 * camera.fx, 1.7 * camera.fy,
                         camera.width - 0.5, camera.height - 0.5)  # fmt: skip
    T = check_rigid(T_world_camera)
    T_lamp = T.copy()
    T_lamp[:3, 3] += offset * T[:3, 0]
    pattern = dots(wide.width, wide.height, rng)
    seen = structured_light(scene, camera, T, wide, T_lamp, pattern, strength=3.0, room_light=0.12)
    return cv2.cvtColor(seen.image, cv2.COLOR_RGB2GRAY)


@dataclass(frozen=True)
class StereoPair:
    """Two pictures of a scene from cameras side by side, with truth.

    Attributes
    ----------
    left, right : frames; the left camera has the pose that was asked for.
    baseline : metres from the left to the right camera, along x of the camera.
    disparity : (H, W) float32, pixels: a point in column u of the left image is in column u - disparity of the right;
        0 where the left camera sees nothing.
    occluded : (H, W) bool, left pixels whose point the right camera does not see.
    """

    left: RGBDFrame
    right: RGBDFrame
    baseline: float
    disparity: np.ndarray
    occluded: np.ndarray


def stereo_pair(scene: Scene, camera: PinholeCamera, T_world_left: np.ndarray, baseline: float = 0.095) -> StereoPair:
    """Take a rectified stereo pair of a scene.

    Raises
    ------
    ValueError
        If the baseline is not positive, the camera has distortion (rectified images have none) or sees nothing.
    """
    if not baseline > 0:
        raise ValueError(f"The baseline must be a positive length in metres, not {baseline}.")
    if camera.distorted:
        raise ValueError("A rectified stereo pair has no distortion; give a camera without distortion coefficients.")
    T = check_rigid(T_world_left, "T_world_left")
    T_right = T.copy()
    T_right[:3, 3] += baseline * T[:3, 0]
    left, right = render(scene, camera, T, name="left"), render(scene, camera, T_right, name="right")
    there = left.depth > 0
    disparity = np.where(there, camera.fx * baseline / np.where(there, left.depth, 1), 0).astype(np.float32)
    points = T[:3, 3] + rotate(T, pixel_rays(camera)) * left.depth[..., None].astype(float)
    way = (T_right[:3, 3] - points).reshape(-1, 3)
    start = points.reshape(-1, 3) + 1e-3 * way  # a little off the surface
    hidden = blocked(scene.caster, start, 0.999 * way).reshape(there.shape)
    outside = np.arange(camera.width) - disparity < 0
    return StereoPair(left, right, baseline, disparity, there & (hidden | outside))
