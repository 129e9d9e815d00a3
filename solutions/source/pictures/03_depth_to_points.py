"""What the pictures of lab 03 show: what the code of task 3 gives as it stands, and the six clouds of task 4."""

from __future__ import annotations

import numpy as np

from course_lib.camera.pinhole import PinholeCamera
from course_lib.notebook import data
from course_lib.tasks.labs.lab_03_depth_to_points.causes import CAUSE_OF

FRAME = 15  # of task 3
WHICH_FRAME, WHICH_ROW = 4, 150  # of task 4
SHORT_F = 300  # pixels, for the 405 of the room's camera
TOO_LARGE = 2  # 2000 steps a metre read as 1000
EVERY = 2  # of the pixels of task 3's cloud, so that the file stays small


def _given(depth: np.ndarray, color: np.ndarray, camera: PinholeCamera) -> dict[str, np.ndarray]:
    """Task 3 as given, on a recording of 1500 steps a metre: points (N, 3) in whole millimetres and colours (N, 3)."""
    z = np.round(depth * 1500) / 1000
    keep = np.zeros(depth.shape, bool)
    keep[::EVERY, ::EVERY] = ((z > 0) & (z < 3))[::EVERY, ::EVERY]
    v, u = np.nonzero(keep)
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(len(u))], axis=1)
    points = z[keep][:, None] * rays * [1, -1, -1]
    return {"given_points": np.rint(1000 * points).astype(np.int16), "given_colors": color[keep]}


def _clouds(depth: np.ndarray, camera: PinholeCamera) -> dict[str, np.ndarray]:
    """Points (H, W, 3) by cause, and "right"; NaN where nothing was measured."""
    v, u = np.indices(depth.shape)
    a, b = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
    z = np.where(depth > 0, depth, np.nan)
    right = np.stack([a * z, b * z, z], axis=-1)
    return {
        "right": right,
        "another camera's focal length": right * [camera.fx / SHORT_F, camera.fy / SHORT_F, 1],
        "another camera's depth scale": right * TOO_LARGE,
        "z taken for range": right / np.sqrt(1 + a**2 + b**2)[..., None],
        "rows for columns": np.stack([(v - camera.cx) / camera.fx * z, (u - camera.cy) / camera.fy * z, z], axis=-1),
        "cut off at 3 m": np.where(z[..., None] < 3, right, np.nan),
        "flip left in": right * [1, -1, -1],
    }


def _measured(points: np.ndarray) -> list[float]:
    """Width, height and depth of a cloud and its median z in metres, and how many points it has."""
    extent = np.nanmax(points, axis=(0, 1)) - np.nanmin(points, axis=(0, 1))
    return [*extent, np.nanmedian(points[..., 2]), np.isfinite(points[..., 2]).sum()]


def arrays() -> dict[str, np.ndarray]:
    """Task 3's given cloud; of task 4 one row of pixels and the measures of the right cloud and of A to F."""
    room = data.load("living_room")
    clouds = _clouds(room.truth["depth"][WHICH_FRAME], room.camera)
    shown = [clouds["right"], *(clouds[CAUSE_OF[letter]] for letter in "ABCDEF")]
    return {
        **_given(room.truth["depth"][FRAME], room.frames[FRAME].color, room.camera),
        "rows": np.stack([cloud[WHICH_ROW] for cloud in shown]).astype(np.float32),
        "measures": np.array([_measured(cloud) for cloud in shown]),
    }
