"""Where a picture looks from: the same named views for every renderer, so that pictures can be compared.

A `View` has no renderer in it: the PyVista and the Matplotlib renderer are both given one, and `View.project` says
where a point lands in either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

# what lies ahead and what is up in each frame, and how steeply "iso" looks down
_AXES = {
    "camera": ((0, 0, 1), (0, -1, 0), 0.5),
    "world": ((0, 1, 0), (0, 0, 1), 0.5),
    "object": ((0, 0, -1), (0, 1, 0), 0.45),
}
FRAMES = tuple(_AXES)
"""camera: y down, z forward. world: z up. object: y up, z towards the viewer (scanned models such as the bunny)."""

VIEW_WORDS = {
    "camera": "the sensor",
    "front": "the front",
    "side": "the right side",
    "back": "the back",
    "top": "above",
    "iso": "above at an angle",
    "pose": "a given pose",
}
VIEWS = tuple(word for word in VIEW_WORDS if word != "pose")


@dataclass(frozen=True)
class View:
    """One look at a scene, in pixels of one panel.

    Attributes
    ----------
    name : one of VIEWS, or "pose".
    right, up, forward : (3,) unit axes of the picture, in the scene's frame.
    centre : (3,) metres, what is in the middle of the panel.
    scale : metres a pixel (parallel views), or tangent of the half height (views from a sensor).
    eye : (3,) metres where a sensor looks from; None for a parallel view.
    width, height : pixels.
    """

    name: str
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    centre: np.ndarray
    scale: float
    eye: np.ndarray | None = None
    width: int = 0
    height: int = 0

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Map (N, 3) points to (N, 2) pixels (u right, v down) and (N,) depths; behind a sensor the pixel is NaN."""
        relative = np.asarray(points, dtype=np.float64) - (self.centre if self.eye is None else self.eye)
        plane = relative @ np.stack([self.right, -self.up], axis=1)
        depth = relative @ self.forward
        if self.eye is None:
            plane = plane / self.scale
        else:
            ahead = np.where(depth > 1e-9, depth, np.nan)
            plane = plane / ahead[:, None] / self.scale * (self.height / 2)
        return plane + [self.width / 2, self.height / 2], depth

    def holds(self, pixels: np.ndarray) -> np.ndarray:
        """(N,) bool: which of (N, 2) pixels lie in the picture."""
        return (np.isfinite(pixels) & (pixels >= 0) & (pixels < [self.width, self.height])).all(axis=1)

    @property
    def pixels_per_metre(self) -> float | None:
        """Of a parallel view, where a scale bar is true; None from a sensor."""
        return None if self.eye is not None else 1.0 / self.scale


def guess_frame(points: np.ndarray) -> str:
    """Guess the frame of (N, 3) points.

    "camera" if they are what one sensor at the origin can see: all more than 0.1 m ahead, within 60 degrees of the
    optical axis, and on both sides of it. Else "world". Scanned models ("object") cannot be told and must be named.
    """
    if points[:, 2].min() <= 0.1:
        return "world"
    sideways = points[:, :2] / points[:, 2:]
    ahead = (np.abs(sideways) < 1.75).all() and (sideways.min(axis=0) < 0).all() and (sideways.max(axis=0) > 0).all()
    return "camera" if ahead else "world"


def height_axis(frame: str) -> np.ndarray:
    """(3,) the direction that is up."""
    return np.array(_AXES[frame][1], dtype=np.float64)


def look(name: object, points: np.ndarray, frame: str, T_world_camera: np.ndarray | None = None) -> View:
    """Aim a view at (N, 3) points; `layout` sets its scale and size.

    Parameters
    ----------
    name : one of VIEWS, or a (4, 4) T_world_camera to look from.
    points : what must be in the picture.
    frame : of the points, one of FRAMES.
    T_world_camera : the sensor's pose, for name "camera" where points are not in the camera's own frame.
    """
    if isinstance(name, str) and name not in VIEWS:
        raise ValueError(f"There is no view {name!r}: use {', '.join(VIEWS)}, or a 4x4 T_world_camera.")
    if not isinstance(name, str):
        T_world_camera, name = np.asarray(name, dtype=np.float64), "pose"
        if T_world_camera.shape != (4, 4):
            raise ValueError(f"A view is a name or a 4x4 T_world_camera, and this has shape {T_world_camera.shape}.")
    if name in ("camera", "pose"):
        return _from_sensor(name, points, frame, T_world_camera)
    ahead, up, steep = (np.array(axis, dtype=np.float64) for axis in _AXES[frame])
    right = np.array([1.0, 0.0, 0.0])
    directions = {"front": ahead, "back": -ahead, "side": -right, "top": -up}
    forward = directions.get(name, -0.55 * right + 0.8 * ahead - steep * up)
    up = ahead if name == "top" else up
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    axes = np.stack([right, up, forward])
    along = points @ axes.T
    middle = (along.min(axis=0) + along.max(axis=0)) / 2
    return View(name, right, up, forward, middle @ axes, scale=1.0)


def _from_sensor(name: str, points: np.ndarray, frame: str, T_world_camera: np.ndarray | None) -> View:
    if T_world_camera is None:
        if frame != "camera":
            raise ValueError(
                f"view='camera' needs to know where the sensor was in this {frame} frame: pass its pose as the view."
            )
        T_world_camera = np.eye(4)
    rotation, eye = T_world_camera[:3, :3], T_world_camera[:3, 3]
    depth = (points - eye) @ rotation[:, 2]
    if not (depth > 0).any():
        raise ValueError("Nothing lies in front of this camera: check the pose (T_world_camera or its inverse?).")
    centre = eye + rotation[:, 2] * np.median(depth[depth > 0])
    return View(name, rotation[:, 0], -rotation[:, 1], rotation[:, 2], centre, 1.0, eye)


def spread(view: View, points: np.ndarray) -> tuple[float, float]:
    """Return width and height of points in a view: metres (parallel) or twice the tangents of half angles (sensor)."""
    relative = points - (view.centre if view.eye is None else view.eye)
    across, upwards = relative @ view.right, relative @ view.up
    if view.eye is not None:
        depth = relative @ view.forward
        ahead = depth > 0
        across, upwards = across[ahead] / depth[ahead], upwards[ahead] / depth[ahead]
        # beyond 60 degrees to a side a perspective picture is all distortion
        across, upwards = np.clip(across, -1.75, 1.75), np.clip(upwards, -1.75, 1.75)
    return 2 * float(np.abs(across).max()), 2 * float(np.abs(upwards).max())


def layout(views: list[View], points: list[np.ndarray], width: int, zoom: float = 1.0) -> list[View]:
    """Give views their size and one common scale, so that a metre is as long in each parallel panel.

    Parameters
    ----------
    views, points : one entry a panel.
    width : pixels of one panel.
    zoom : above 1 to come closer.
    """
    sizes = [spread(view, cloud) for view, cloud in zip(views, points, strict=True)]
    parallel = [size for view, size in zip(views, sizes, strict=True) if view.eye is None]
    room = 0.94
    widest, tallest = (max((size[axis] for size in parallel), default=0.0) for axis in (0, 1))
    shapes = [tallest / widest] if widest > 0 else []
    shapes += [
        size[1] / size[0] for view, size in zip(views, sizes, strict=True) if view.eye is not None and size[0] > 0
    ]
    height = round(width * min(max(max(shapes, default=0.7), 0.3), 0.72 if len(views) == 1 else 1.2))
    scale = max(widest / (room * width), tallest / (room * height)) or 1e-3  # a single point: a millimetre a pixel
    done = []
    for view, size in zip(views, sizes, strict=True):
        if view.eye is None:
            done.append(replace(view, scale=scale / zoom, width=width, height=height))
        else:
            tangent = max(size[1] / 2, size[0] / 2 * height / width) or math.tan(0.5)
            done.append(replace(view, scale=tangent * 1.02 / zoom, width=width, height=height))
    return done
