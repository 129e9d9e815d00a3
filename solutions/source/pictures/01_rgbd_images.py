"""What the pictures of lab 01 are drawn from: the range of a flat wall, and how far five spoiled depth images are off."""

from __future__ import annotations

import numpy as np

from course_lib.notebook import data
from course_lib.tasks.labs.lab_01_rgbd_images.causes import CAUSE_OF


def arrays() -> dict[str, np.ndarray]:
    """The range of a wall (480 x 640, every eighth pixel), and wrong minus right of each letter (240 x 320), all in metres."""
    v, u = np.indices((60, 80)) * 8
    wall = 2 * np.sqrt(1 + ((u - 319.5) / 525) ** 2 + ((v - 239.5) / 525) ** 2)
    room = data.load("living_room")
    frame, camera = room.frames[0], room.frames[0].camera
    depth = np.where(frame.depth > 0, room.truth["depth"][0], 0)[::2, ::2].astype(float)  # its holes, without its noise
    h, w = depth.shape
    v, u = np.indices(depth.shape) * 2
    stretch = np.sqrt(1 + ((u - camera.cx) / camera.fx) ** 2 + ((v - camera.cy) / camera.fy) ** 2)
    held = depth > 0
    spoiled = {
        "8 bits": np.round(depth / 6 * 255) / 255 * 6,
        "flipped": np.where(held, depth.max() + depth[held].min() - depth, 0),
        "range": depth * stretch,
        "mixed": depth.reshape(h // 2, 2, w // 2, 2).mean(axis=(1, 3)).repeat(2, 0).repeat(2, 1),
        "tum": depth / 5,
    }
    off = {name: np.where(held & (image > 0), image - depth, np.nan) for name, image in spoiled.items()}
    letters = {letter: off[cause].astype(np.float16) for letter, cause in CAUSE_OF.items()}
    return {"wall": wall.astype(np.float32), **letters}
