"""RGB-D images: a colour image and a depth image of the same view, and how files store depth.

Depth is z along the optical axis in metres, float32, with 0 where nothing was measured. Colours are RGB uint8. Images
are indexed [row v, column u] and pixel centres lie at integers. How files store depth is told in
`course_lib.camera.depth_encodings`; it is here too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.camera.depth_encodings import (
    ENCODINGS,
    METRES,
    DepthEncoding,
    decode_depth,
    encode_depth,
    find_encoding,
    valid_mask,
)
from course_lib.camera.intrinsics import PinholeCamera
from course_lib.checks import check_depth
from course_lib.geometry import transforms

__all__ = [
    "ENCODINGS", "METRES", "DepthEncoding", "RGBDFrame", "check_depth", "decode_depth", "encode_depth",
    "find_encoding", "rescale_for_display", "resize_depth", "valid_mask",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class RGBDFrame:
    """One colour image and one depth image, checked when made.

    Parameters
    ----------
    color : (H, W, 3) uint8, RGB.
    depth : (H, W) float32, metres; 0 where nothing was measured. Other float types are converted.
    camera : intrinsics of the depth image; of both images where they are registered.
    T_world_camera : (4, 4) pose of the camera, or None where it is unknown.
    registered : whether pixel (u, v) of both images sees the same point. Where False, sizes may differ, and equal sizes
        mean nothing.
    name : what to call it in pictures and messages.

    Raises
    ------
    ValueError
        If types, units or sizes do not fit together.
    """

    color: NDArray[np.uint8]
    depth: NDArray[np.float32]
    camera: PinholeCamera
    T_world_camera: NDArray[np.float64] | None = None
    registered: bool = True
    name: str = ""

    def __post_init__(self) -> None:
        color = np.asarray(self.color)
        if color.ndim != 3:
            raise ValueError(f"color: expected shape (H, W, 3), got {color.shape}.")
        checks.colors_uint8(color, (*color.shape[:2], 3), "color")
        depth = check_depth(self.depth)
        if not isinstance(self.camera, PinholeCamera):
            raise ValueError(f"camera: expected a PinholeCamera, got {type(self.camera).__name__}.")
        if self.registered and color.shape[:2] != depth.shape:
            raise ValueError(
                f"color is {color.shape[1]}x{color.shape[0]} but depth {depth.shape[1]}x{depth.shape[0]}; "
                "resize or register them, or say registered=False."
            )
        if depth.shape != (self.camera.height, self.camera.width):
            raise ValueError(
                f"depth is {depth.shape[1]}x{depth.shape[0]} but the camera {self.camera.width}x{self.camera.height}; "
                "use the intrinsics of this resolution (camera.scaled)."
            )
        object.__setattr__(self, "color", color)
        object.__setattr__(self, "depth", depth.astype(np.float32, copy=False))
        if self.T_world_camera is not None:
            object.__setattr__(self, "T_world_camera", transforms.check_rigid(self.T_world_camera, "T_world_camera"))

    def __repr__(self) -> str:
        share = valid_mask(self.depth).mean()
        name = f"{self.name!r}, " if self.name else ""
        return f"RGBDFrame({name}{self.camera.width}x{self.camera.height}, {share:.0%} measured)"


def resize_depth(depth: ArrayLike, width: int, height: int) -> NDArray[np.float32]:
    """Resize a depth image by picking, for every new pixel, the old pixel that its centre lies in.

    Two depths are never mixed: the mean of a chair and the wall behind it is a point in the air. The centre of the
    picked pixel lies up to half an old pixel from the new pixel's; the new camera is `camera.scaled(width, height)`.

    Parameters
    ----------
    depth : (H, W) float, metres.
    width, height : of the result, pixels.

    Returns
    -------
    (height, width) float32, metres; every value occurs in `depth`.

    Raises
    ------
    ValueError
        If depth is not a depth image in metres, or a size is not a positive whole number.

    Examples
    --------
    >>> resize_depth(np.array([[1.0, 1.0, 3.0, 3.0]]), 2, 1).tolist()
    [[1.0, 3.0]]
    """
    depth = check_depth(depth)
    width, height = checks.size(width, "width"), checks.size(height, "height")
    rows = (2 * np.arange(height) + 1) * depth.shape[0] // (2 * height)
    columns = (2 * np.arange(width) + 1) * depth.shape[1] // (2 * width)
    return depth[np.ix_(rows, columns)].astype(np.float32, copy=False)


def rescale_for_display(depth: ArrayLike, near: float, far: float) -> NDArray[np.uint8]:
    """Squeeze depth into 8 bits, for looking only: the lecture's float32 → [0, 255].

    Parameters
    ----------
    depth : (H, W) float, metres.
    near, far : the depths that become 0 and 255, metres; what lies outside is clipped.

    Returns
    -------
    (H, W) uint8: larger is farther, as in the file. A picture that has the near things bright shows 255 minus this: a
    choice of display. Nothing measured becomes 0, as the nearest does. Never to be computed with.

    Raises
    ------
    ValueError
        If depth is no depth image in metres, or near is not below far.

    Examples
    --------
    >>> rescale_for_display(np.array([[0.0, 3.0, 6.0]]), 0, 6).tolist()
    [[0, 128, 255]]
    """
    depth = check_depth(depth)
    near, far = checks.number(near, "near"), checks.number(far, "far")
    if not near < far:
        raise ValueError(f"near ({near:g} m) must be below far ({far:g} m).")
    share = np.where(valid_mask(depth), (depth - near) / (far - near), 0)
    return (np.clip(share, 0, 1) * 255 + 0.5).astype(np.uint8)
