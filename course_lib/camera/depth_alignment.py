"""Depth from one camera as another camera beside it would have measured it: what makes depth and colour registered.

RealSense, Kinect and their kin measure depth and colour through lenses a few centimetres apart, which look in slightly
different directions. librealsense, too, gives each depth to the colour pixels that it covers and lets the nearest win,
but copies the number: it stays the z of the depth camera. Here it becomes the z of the colour camera. Where that is
turned by 0.7°, the difference is 1 cm at the side of an image of something 1.5 m away.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.camera.distortion import undistort
from course_lib.camera.intrinsics import PinholeCamera
from course_lib.camera.pinhole import project
from course_lib.checks import FloatArray
from course_lib.geometry import transforms

__all__ = ["align_depth"]

MARGIN = 0.25
"""Colour pixels by which a depth pixel is widened on every side, so that a slanted surface is not crossed by cracks."""
SAME = 0.02
"""Where the depth pixel under a centre is deeper by less than this share, it is of the same surface, and goes first."""
WIDEST = 32
"""A depth pixel that would cover more pixels than this along a side lies at the lens of the other camera."""


def align_depth(
    depth: ArrayLike, depth_camera: PinholeCamera, color_camera: PinholeCamera, T_color_depth: ArrayLike
) -> NDArray[np.float32]:
    """Move a depth image to the pixels of a colour camera.

    Each measured pixel is lifted, moved and projected by its upper left and its lower right corner, and fills the
    pixels whose centres lie between; where several fall together the nearest point hides the others. What the depth
    camera did not see stays unmeasured: beside near things a strip without data remains, because the lenses lie apart.
    For cameras side by side: where one is rolled against the other, the rectangles do not turn with it.

    Parameters
    ----------
    depth : (H, W) float, metres, 0 or NaN where nothing was measured.
    depth_camera : its intrinsics.
    color_camera : intrinsics of the colour image.
    T_color_depth : (4, 4) maps points of the depth camera's frame to the colour camera's.

    Returns
    -------
    (H', W') float32, the colour image's size, metres along the colour camera's axis; 0 where nothing was measured.

    Raises
    ------
    ValueError
        If the image is not the depth camera's size or not in metres, or the transform is not rigid.

    References
    ----------
    Forward warping with a z-buffer, as in librealsense's `align`.

    Examples
    --------
    >>> camera = PinholeCamera(4, 1, 2.0, 2.0, 1.5, 0.0)
    >>> aside = transforms.from_rotation_translation(np.eye(3), (1.0, 0.0, 0.0))
    >>> align_depth([[2.0, 2.0, 2.0, 0.0]], camera, camera, aside).tolist()
    [[0.0, 2.0, 2.0, 2.0]]
    """
    depth = checks.check_depth(depth)
    T = checks.check_rigid(T_color_depth, "T_color_depth")
    if depth.shape != (depth_camera.height, depth_camera.width):
        raise ValueError(
            f"depth is {depth.shape[1]}x{depth.shape[0]} but the camera {depth_camera.width}x{depth_camera.height}; "
            "use the intrinsics of this resolution (camera.scaled)."
        )
    v, u = np.nonzero((depth > 0) & (depth < np.inf))
    z = depth[v, u].astype(np.float64)
    moved = transforms.apply(T, _lift(u, v, z, depth_camera))[:, 2]
    upper, lower = (
        project(transforms.apply(T, _lift(u + at, v + at, z, depth_camera)), color_camera) for at in (-0.5, 0.5)
    )
    # A corner behind the colour camera is NaN.
    good = (np.isfinite(upper) & np.isfinite(lower)).all(axis=1) & (moved > 0)
    low, high = np.fmin(upper, lower)[good], np.fmax(upper, lower)[good]
    exact, near = (
        _nearest(low - margin, high + margin, moved[good], (color_camera.height, color_camera.width))
        for margin in (0.0, MARGIN)
    )
    aligned = np.where(exact <= near * (1 + SAME), exact, near)
    aligned[np.isinf(aligned)] = 0
    return aligned


def _nearest(
    low: NDArray[np.float64], high: NDArray[np.float64], z: FloatArray, shape: tuple[int, int]
) -> NDArray[np.float32]:
    """The smallest z (N,) of the rectangles, corners (N, 2) in pixels, that hold a pixel's centre; else infinite."""
    # Along each axis: the first pixel, and how many more. One axis at a time: a third of the time.
    first, last = (
        [np.clip(np.ceil(corner[:, axis]), 0, shape[1 - axis]).astype(np.int32) for axis in (0, 1)]
        for corner in (low, high)
    )
    more = [last[axis] - 1 - first[axis] for axis in (0, 1)]
    seen = (more[0] >= 0) & (more[1] >= 0) & (more[0] < WIDEST) & (more[1] < WIDEST)
    start = (first[1] * shape[1] + first[0])[seen]
    more, z = [each[seen] for each in more], z[seen].astype(np.float32)
    found = np.full(shape, np.inf, dtype=np.float32)
    for dv in range(more[1].max(initial=-1) + 1):
        for du in range(more[0].max(initial=-1) + 1):
            reach = np.flatnonzero((more[0] >= du) & (more[1] >= dv))
            np.minimum.at(found.reshape(-1), start[reach] + (dv * shape[1] + du), z[reach])
    return found


def _lift(
    u: NDArray[np.intp | np.floating], v: NDArray[np.intp | np.floating], z: NDArray[np.float64], camera: PinholeCamera
) -> NDArray[np.float64]:
    """Points (N, 3) at pixels that need not be whole."""
    xy = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy], axis=1)
    if camera.distorted:
        xy = undistort(xy, camera.distortion)
    return np.concatenate([xy * z[:, None], z[:, None]], axis=1)
