"""The pinhole camera: from points to pixels and, with a depth image, back.

The camera frame has x right, y down, z forward. Pixel centres lie at integers. Depth is z, the distance along the
optical axis, not the range to the camera's centre. Images are indexed [row v, column u].

The intrinsics themselves live in `course_lib.camera.intrinsics`, the lens in `course_lib.camera.distortion`, the named
cameras in `course_lib.camera.presets`; all of it is here too.

References
----------
Hartley and Zisserman, Multiple View Geometry in Computer Vision, 2nd ed., chapter 6.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from course_lib import checks
from course_lib.camera.distortion import distort, undistort
from course_lib.camera.intrinsics import (
    PinholeCamera,
    camera_from_fov,
    camera_from_matrix,
    check_camera,
    field_of_view,
    focal_length,
)
from course_lib.camera.presets import PRESETS, preset
from course_lib.checks import FloatArray

__all__ = [
    "PRESETS", "PinholeCamera", "camera_from_fov", "camera_from_matrix", "check_camera", "deproject",
    "deproject_compact", "distort", "field_of_view", "focal_length", "pixel_rays", "preset", "project", "undistort",
]  # fmt: skip

# Deprojection works through slabs of this many rows, whose intermediate results stay in the processor's cache.
SLAB_ROWS = 32


def project(points: ArrayLike, camera: PinholeCamera) -> NDArray[np.float64]:
    """Project points to pixels: u = fx x/z + cx, v = fy y/z + cy, with the camera's distortion.

    Parameters
    ----------
    points : (..., 3) in the camera frame, metres.
    camera : the intrinsics.

    Returns
    -------
    (..., 2) float64 pixels (u, v), which may lie outside the image; NaN for points at or behind the camera (z ≤ 0).

    Raises
    ------
    ValueError
        If the last axis is not 3 long, or `camera` is no PinholeCamera.

    Examples
    --------
    >>> project([[0.0, 0.0, 2.0], [1.0, 0.0, 2.0]], PinholeCamera(640, 480, 500, 500, 319.5, 239.5)).tolist()
    [[319.5, 239.5], [569.5, 239.5]]
    """
    check_camera(camera)
    points = checks.last_axis(points, 3, "points").astype(np.float64)
    z = np.where(points[..., 2:] > 0, points[..., 2:], np.nan)
    xy = points[..., :2] / z
    if camera.distorted:
        xy = distort(xy, camera.distortion)
    return xy * [camera.fx, camera.fy] + [camera.cx, camera.cy]


def pixel_rays(camera: PinholeCamera) -> NDArray[np.float64]:
    """Return the point at depth 1 that each pixel sees, distortion removed: deprojection is depth times this.

    Parameters
    ----------
    camera : the intrinsics.

    Returns
    -------
    (H, W, 3) float64 in the camera frame, z = 1.

    Raises
    ------
    ValueError
        If `camera` is no PinholeCamera, or its distortion cannot be inverted.
    """
    check_camera(camera)
    rays = np.ones((camera.height, camera.width, 3))
    rays[..., 0] = (np.arange(camera.width) - camera.cx) / camera.fx
    rays[..., 1] = ((np.arange(camera.height) - camera.cy) / camera.fy)[:, None]
    if camera.distorted:
        rays[..., :2] = undistort(rays[..., :2], camera.distortion)
    return rays


def deproject(
    depth: FloatArray, camera: PinholeCamera, *, dtype: DTypeLike = np.float32, out: FloatArray | None = None
) -> FloatArray:
    """Lift a depth image to an organised cloud in the camera frame (x right, y down, z forward).

    Parameters
    ----------
    depth : (H, W) float, metres along the optical axis; 0, NaN or infinite where nothing was measured.
    camera : intrinsics of this resolution.
    dtype : float32 or float64, of the result.
    out : (H, W, 3) C-ordered array of `dtype` to write into, for loops over many frames; or None for a new one.

    Returns
    -------
    (H, W, 3) metres; NaN where nothing was measured.

    Raises
    ------
    ValueError
        If the image is not the camera's size, is integer, negative, or looks like millimetres, or `out` does not fit.

    References
    ----------
    Hartley and Zisserman, Multiple View Geometry, 2nd ed., sec. 6.1.

    Examples
    --------
    >>> camera = PinholeCamera(3, 1, 2.0, 2.0, 1.0, 0.0)
    >>> deproject(np.array([[2.0, 2.0, 0.0]]), camera)[0].tolist()
    [[-1.0, 0.0, 2.0], [0.0, 0.0, 2.0], [nan, nan, nan]]
    """
    depth = _check_size(depth, camera)
    dtype = np.dtype(dtype)
    if dtype not in (np.float32, np.float64):
        raise ValueError(f"dtype: points are float32 or float64, not {dtype}.")
    shape = (*depth.shape, 3)
    if out is None:
        out = np.empty(shape, dtype)
    elif not isinstance(out, np.ndarray) or (out.shape, out.dtype) != (shape, dtype) or not out.flags.carray:
        raise ValueError(f"out: expected a writable C-ordered array of shape {shape} and type {dtype}.")
    with np.errstate(invalid="ignore"):  # depth / depth is 1 where measured and NaN at 0, infinity and NaN
        for rows, x, y, z, spare in _slabs(depth, camera, dtype):
            np.divide(z, z, out=spare[0])
            z *= spare[0]
            cv2.merge([np.multiply(x, z, out=spare[0]), np.multiply(y, z, out=spare[1]), z], out[rows])
    return out


def deproject_compact(depth: FloatArray, camera: PinholeCamera) -> NDArray[np.float64]:
    """Lift the measured pixels of a depth image to points, in the order in which Open3D's legacy cloud has them.

    Parameters
    ----------
    depth : (H, W) float, metres along the optical axis; 0, NaN or infinite where nothing was measured.
    camera : intrinsics of this resolution.

    Returns
    -------
    (N, 3) float64, metres, camera frame; N is the number of measured pixels, in the order of `depth.ravel()`.

    Raises
    ------
    ValueError
        If the image is not the camera's size, is integer, negative, looks like millimetres, or measured nothing at all.

    Examples
    --------
    >>> deproject_compact(np.array([[0.0, 2.0, 4.0]]), PinholeCamera(3, 1, 2.0, 2.0, 1.0, 0.0)).tolist()
    [[0.0, 0.0, 2.0], [2.0, 0.0, 4.0]]
    """
    depth = _check_size(depth, camera)
    measured = (depth > 0) & (depth < np.inf)
    count = int(np.count_nonzero(measured))
    if count == 0:
        raise ValueError("depth: no pixel was measured, so there is no point to return.")
    points = np.empty((count, 3))
    whole = points.view("V24")[:, 0]  # one point as one item of 24 bytes: a mask then moves whole points
    slab = np.empty((SLAB_ROWS, camera.width, 3))
    start = 0
    with np.errstate(invalid="ignore"):
        for rows, x, y, z, _ in _slabs(depth, camera, np.dtype(np.float64)):
            part = slab[: len(z)]
            np.multiply(x, z, out=part[..., 0])
            np.multiply(y, z, out=part[..., 1])
            part[..., 2] = z
            picked = part.view("V24")[..., 0][measured[rows]]
            whole[start : start + len(picked)] = picked
            start += len(picked)
    return points


def _slabs(
    depth: FloatArray, camera: PinholeCamera, dtype: np.dtype
) -> Iterator[tuple[slice, FloatArray, FloatArray, FloatArray, list[FloatArray]]]:
    """Walk down the image: (rows, x/z, y/z, a copy of depth, two spare arrays) of `SLAB_ROWS` rows at a time."""
    if camera.distorted:
        rays = pixel_rays(camera).astype(dtype, copy=False)
        x, y = rays[..., 0], rays[..., 1]
    else:
        x = ((np.arange(camera.width) - camera.cx) / camera.fx).astype(dtype)[None, :]
        y = ((np.arange(camera.height) - camera.cy) / camera.fy).astype(dtype)[:, None]
    work = np.empty((3, SLAB_ROWS, camera.width), dtype)
    for start in range(0, camera.height, SLAB_ROWS):
        rows = slice(start, min(start + SLAB_ROWS, camera.height))
        z, *spare = work[:, : rows.stop - start]
        z[...] = depth[rows]
        yield rows, (x[rows] if camera.distorted else x), y[rows], z, spare


def _check_size(depth: FloatArray, camera: PinholeCamera) -> FloatArray:
    check_camera(camera)
    depth = checks.check_depth(depth)
    if depth.shape != (camera.height, camera.width):
        raise ValueError(
            f"depth: the image is {depth.shape[1]}x{depth.shape[0]} but the camera {camera.width}x{camera.height}; "
            "use the intrinsics of this resolution (camera.scaled)."
        )
    return depth
