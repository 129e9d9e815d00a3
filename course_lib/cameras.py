"""The pinhole camera: from points to pixels and, with a depth image, back.

The camera frame has x right, y down, z forward. Pixel centres lie at integers: the ideal principal point of a W-wide image
is (W − 1)/2, and scaling an image by s moves it to s (cx + 0.5) − 0.5. Depth is z, the distance along the optical axis, not
the range to the camera's centre. Images are indexed [row v, column u].

References
----------
Hartley and Zisserman, Multiple View Geometry in Computer Vision, 2nd ed., chapter 6. Brown, Close-range camera
calibration, Photogrammetric Engineering 37(8), 1971. OpenCV manual, camera calibration and 3D reconstruction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from course_lib import checks

FloatArray = NDArray[np.floating]
Axis = Literal["horizontal", "vertical"]
Centre = Literal["integer", "half"]

NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)
# The inverse of the distortion is iterated until it reproduces the point to this many focal lengths.
UNDISTORT_TOLERANCE = 1e-13
UNDISTORT_STEPS = 100


@dataclass(frozen=True)
class PinholeCamera:
    """Intrinsics of one camera at one resolution.

    Parameters
    ----------
    width, height : pixels.
    fx, fy : focal lengths, pixels.
    cx, cy : principal point, pixels, with pixel centres at integers.
    distortion : (k1, k2, p1, p2, k3) of Brown and Conrady, in OpenCV's order; zeros for none.
    source : one sentence that says where the numbers come from.

    Raises
    ------
    ValueError
        If a size is not a positive whole number, a focal length not positive, or a number not finite.

    Examples
    --------
    >>> camera = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
    >>> camera.scaled(320, 240).cx
    159.5
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = NO_DISTORTION
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            object.__setattr__(self, name, _size(getattr(self, name), name))
        for name in ("fx", "fy", "cx", "cy"):
            object.__setattr__(self, name, checks.number(getattr(self, name), name))
        if self.fx <= 0 or self.fy <= 0:
            raise ValueError(f"focal lengths must be positive pixels, got fx {self.fx:g}, fy {self.fy:g}.")
        distortion = checks.vector(self.distortion, 5, "distortion (k1, k2, p1, p2, k3)")
        object.__setattr__(self, "distortion", tuple(distortion.tolist()))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The (3, 3) matrix K: pixels = K (x/z, y/z, 1)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def distorted(self) -> bool:
        """Whether any distortion coefficient differs from zero."""
        return any(self.distortion)

    def scaled(self, width: int, height: int) -> PinholeCamera:
        """Return the camera of the same picture resized to `width` x `height`: f' = s f, cx' = s (cx + 0.5) − 0.5."""
        sx, sy = _size(width, "width") / self.width, _size(height, "height") / self.height
        return replace(
            self,
            width=width,
            height=height,
            fx=sx * self.fx,
            fy=sy * self.fy,
            cx=sx * (self.cx + 0.5) - 0.5,
            cy=sy * (self.cy + 0.5) - 0.5,
            source=f"{self.source.rstrip('. ')}; scaled from {self.width}x{self.height}." if self.source else "",
        )

    def cropped(self, left: int, top: int, width: int, height: int) -> PinholeCamera:
        """Return the camera of the window of `width` x `height` pixels whose first pixel is column `left`, row `top`."""
        width, height = _size(width, "width"), _size(height, "height")
        if left < 0 or top < 0 or left + width > self.width or top + height > self.height:
            raise ValueError(
                f"the window {width}x{height} at ({left}, {top}) does not lie inside {self.width}x{self.height}."
            )
        return replace(
            self,
            width=width,
            height=height,
            cx=self.cx - left,
            cy=self.cy - top,
            source=f"{self.source.rstrip('. ')}; cropped from {self.width}x{self.height}." if self.source else "",
        )


def _size(value: int, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value <= 0:
        raise ValueError(f"{name}: expected a positive whole number of pixels, got {value!r}.")
    return int(value)


def _fov(fov: float) -> float:
    fov = checks.number(fov, "fov")
    if fov >= np.pi:
        raise ValueError(f"fov: {fov:g} is not below π radians; if these are degrees, convert with numpy.radians.")
    if fov <= 0:
        raise ValueError(f"fov: {fov:g} is not a positive angle in radians.")
    return fov


def focal_length(fov: float, size: int) -> float:
    """Return the focal length in pixels that spreads `fov` over `size` pixels: f = (size / 2) / tan(fov / 2).

    Parameters
    ----------
    fov : the whole angle, radians, between 0 and π, across the axis that `size` counts.
    size : pixels: the width for a horizontal angle, the height for a vertical one.

    Returns
    -------
    pixels.

    Raises
    ------
    ValueError
        If the angle is not between 0 and π (degrees given for radians), or the size not a positive whole number.

    Examples
    --------
    >>> round(focal_length(np.radians(90), 640), 9)
    320.0
    """
    return 0.5 * _size(size, "size") / float(np.tan(0.5 * _fov(fov)))


def field_of_view(focal: float, size: int) -> float:
    """Return the whole angle in radians that `size` pixels see at a focal length in pixels: the inverse of `focal_length`.

    Raises
    ------
    ValueError
        If one of them is not positive.

    Examples
    --------
    >>> round(np.degrees(field_of_view(320, 640)), 9)
    90.0
    """
    focal = checks.number(focal, "focal")
    if focal <= 0:
        raise ValueError(f"focal: {focal:g} pixels is not positive.")
    return 2.0 * float(np.arctan(0.5 * _size(size, "size") / focal))


def camera_from_fov(fov: float, width: int, height: int, *, axis: Axis, centre: Centre = "integer") -> PinholeCamera:
    """Make an ideal camera with square pixels from a field of view: equations 1–4 of the UAV document.

    Parameters
    ----------
    fov : the whole angle along `axis`, radians.
    width, height : pixels.
    axis : "horizontal" or "vertical"; simulators differ (Unity's angle is vertical), so it must be said.
    centre : "integer" puts pixel centres at integers, cx = (W − 1)/2, the convention of this course; "half" puts them at
        +0.5, cx = W/2, as the document's equations 3 and 4 do.

    Returns
    -------
    PinholeCamera with fx = fy.

    Raises
    ------
    ValueError
        If the angle is not between 0 and π, or `axis` or `centre` is not one of the two words.

    Examples
    --------
    >>> camera_from_fov(np.radians(60), 640, 480, axis="horizontal").fx.__round__()
    554
    >>> camera_from_fov(np.radians(60), 640, 480, axis="vertical").fx.__round__()
    416
    """
    if axis not in ("horizontal", "vertical"):
        raise ValueError(f"axis: say 'horizontal' or 'vertical' for the field of view, got {axis!r}.")
    if centre not in ("integer", "half"):
        raise ValueError(f"centre: say 'integer' (this course) or 'half' (cx = width/2), got {centre!r}.")
    f = focal_length(fov, width if axis == "horizontal" else height)
    shift = 0.5 if centre == "integer" else 0.0
    return PinholeCamera(
        width, height, f, f, 0.5 * _size(width, "width") - shift, 0.5 * _size(height, "height") - shift,
        source=f"ideal camera with a {axis} field of view of {np.degrees(fov):.4g} degrees",
    )  # fmt: skip


def distort(xy: ArrayLike, distortion: ArrayLike) -> NDArray[np.float64]:
    """Bend ideal normalised coordinates as a real lens does, by the model of Brown and Conrady.

    Parameters
    ----------
    xy : (..., 2) normalised coordinates x/z, y/z.
    distortion : (5,) k1, k2, p1, p2, k3.

    Returns
    -------
    (..., 2) float64, normalised coordinates.

    Raises
    ------
    ValueError
        If shapes are wrong.

    References
    ----------
    Brown, Close-range camera calibration, 1971; OpenCV's `projectPoints` in the same order of coefficients.
    """
    xy = checks.last_axis(xy, 2, "xy").astype(np.float64)
    k1, k2, p1, p2, k3 = checks.vector(distortion, 5, "distortion (k1, k2, p1, p2, k3)")
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )


def undistort(xy: ArrayLike, distortion: ArrayLike) -> NDArray[np.float64]:
    """Straighten distorted normalised coordinates: the inverse of `distort`, by Newton's iteration.

    Parameters
    ----------
    xy : (..., 2) distorted normalised coordinates: (u − cx)/fx, (v − cy)/fy. NaN stays NaN.
    distortion : (5,) k1, k2, p1, p2, k3.

    Returns
    -------
    (..., 2) float64, ideal normalised coordinates x/z, y/z.

    Raises
    ------
    ValueError
        If shapes are wrong, or a point lies where the lens model folds over and has no inverse.
    """
    target = checks.last_axis(xy, 2, "xy").astype(np.float64)
    k1, k2, p1, p2, k3 = checks.vector(distortion, 5, "distortion (k1, k2, p1, p2, k3)")
    flat = target.reshape(-1, 2)
    result = flat.copy()
    todo = np.flatnonzero(np.isfinite(flat).all(axis=1))
    for _ in range(UNDISTORT_STEPS):
        x, y = result[todo, 0], result[todo, 1]
        miss = distort(result[todo], distortion) - flat[todo]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))  # d radial / d r² times 2
        xx = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x
        xy_ = x * y * slope + 2 * p1 * x + 2 * p2 * y
        yy = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x
        determinant = xx * yy - xy_ * xy_
        open_ = np.abs(miss).max(axis=1, initial=0.0) > UNDISTORT_TOLERANCE * (1 + np.abs(flat[todo]).max(axis=1))
        open_ |= determinant <= 0
        if not open_.any():
            return result.reshape(target.shape)
        # A step longer than half the radius is shortened: far from the solution Newton would leap over the fold.
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.stack([yy * miss[:, 0] - xy_ * miss[:, 1], xx * miss[:, 1] - xy_ * miss[:, 0]], axis=1)
            step /= determinant[:, None]
            step = np.where(determinant[:, None] > 0, step, 0.5 * result[todo])
            length = np.linalg.norm(step, axis=1)
            limit = 0.5 * np.sqrt(r2) + 1e-3
            step *= np.minimum(1.0, limit / np.maximum(length, 1e-300))[:, None]
        result[todo] -= step
        todo = todo[open_]
    raise ValueError(
        f"undistort: {len(todo)} points lie where this distortion folds over and has no inverse; "
        "check the coefficients and their order (k1, k2, p1, p2, k3)."
    )


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
    _check_camera(camera)
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
    _check_camera(camera)
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
    out : (H, W, 3) array of `dtype` to write into, for loops over many frames; or None for a new one.

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
    shape = (camera.height, camera.width, 3)
    if out is None:
        out = np.empty(shape, dtype)
    elif not isinstance(out, np.ndarray) or out.shape != shape or out.dtype != dtype:
        raise ValueError(f"out: expected an array of shape {shape} and type {dtype}.")
    z = np.where((depth > 0) & (depth < np.inf), depth, np.nan).astype(dtype, copy=False)
    x, y = _ray_slopes(camera, dtype)
    np.multiply(x, z, out=out[..., 0])
    np.multiply(y, z, out=out[..., 1])
    out[..., 2] = z
    return out


def deproject_compact(depth: FloatArray, camera: PinholeCamera) -> NDArray[np.float64]:
    """Lift the measured pixels of a depth image to points, row by row, as Open3D's legacy cloud does.

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
    """
    depth = _check_size(depth, camera)
    valid = np.flatnonzero((depth > 0) & (depth < np.inf))
    if len(valid) == 0:
        raise ValueError("depth: no pixel was measured, so there is no point to return.")
    x, y = _ray_slopes(camera, np.float64)
    points = np.empty((len(valid), 3))
    z = depth.ravel()[valid].astype(np.float64)
    points[:, 0] = np.broadcast_to(x, depth.shape).ravel()[valid] * z
    points[:, 1] = np.broadcast_to(y, depth.shape).ravel()[valid] * z
    points[:, 2] = z
    return points


def _ray_slopes(camera: PinholeCamera, dtype: DTypeLike) -> tuple[FloatArray, FloatArray]:
    """x/z and y/z of every pixel, as arrays that broadcast to (H, W): a row and a column where nothing is distorted."""
    if camera.distorted:
        rays = pixel_rays(camera).astype(dtype, copy=False)
        return rays[..., 0], rays[..., 1]
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    return x.astype(dtype)[None, :], y.astype(dtype)[:, None]


def _check_camera(camera: PinholeCamera) -> None:
    if not isinstance(camera, PinholeCamera):
        raise ValueError(f"camera: expected a PinholeCamera, got {type(camera).__name__}.")


def _check_size(depth: FloatArray, camera: PinholeCamera) -> FloatArray:
    _check_camera(camera)
    depth = checks.depth_image(depth)
    if depth.shape != (camera.height, camera.width):
        raise ValueError(
            f"depth: the image is {depth.shape[1]}x{depth.shape[0]} but the camera {camera.width}x{camera.height}; "
            "use the intrinsics of this resolution (camera.scaled)."
        )
    return depth


def _presets() -> dict[str, PinholeCamera]:
    presets = {
        "primesense": PinholeCamera(
            640, 480, 525.0, 525.0, 319.5, 239.5,
            source="Open3D's PrimeSenseDefault and camera_primesense.json: the nominal values of the first Kinect family.",
        )
    }  # fmt: skip
    # D455, data sheet 337029: depth 87 x 58 degrees and colour 90 x 65 degrees, both ± 3 degrees.
    depth = replace(
        camera_from_fov(np.radians(87), 1280, 720, axis="horizontal"),
        source="nominal: Intel data sheet 337029, D455 depth, horizontal field of view 87 degrees, square pixels; "
        "a real device's own calibration must be read from it.",
    )
    for width, height in ((1280, 720), (848, 480), (640, 360), (480, 270), (424, 240)):
        presets[f"d455_depth_{width}x{height}"] = _nominal(depth, width, height)
    presets["d455_depth_640x480"] = _nominal(depth, 640, 480, imager_height=800)
    colour = replace(
        camera_from_fov(np.radians(90), 1280, 800, axis="horizontal"),
        source="nominal: Intel data sheet 337029, D455 colour, horizontal field of view 90 degrees, square pixels; "
        "a real device's own calibration must be read from it.",
    )
    for width, height in ((1280, 800), (640, 400), (1280, 720), (848, 480), (640, 480), (640, 360), (424, 240)):
        presets[f"d455_color_{width}x{height}"] = _nominal(colour, width, height)
    return presets


def _nominal(full: PinholeCamera, width: int, height: int, imager_height: int | None = None) -> PinholeCamera:
    """One mode of an ideal centred camera: scaled to cover width x height, then cropped about the centre."""
    scale = max(width / full.width, height / (imager_height or full.height))
    f = scale * full.fx
    return replace(full, width=width, height=height, fx=f, fy=f, cx=0.5 * (width - 1), cy=0.5 * (height - 1))


PRESETS: dict[str, PinholeCamera] = _presets()


def preset(name: str) -> PinholeCamera:
    """Return a preset camera by name.

    Parameters
    ----------
    name : one of `PRESETS`, e.g. "primesense" or "d455_depth_848x480".

    Returns
    -------
    PinholeCamera whose `source` says where its numbers come from.

    Raises
    ------
    ValueError
        If the name is unknown; the nearest one is suggested.

    Examples
    --------
    >>> preset("primesence")
    Traceback (most recent call last):
    ValueError: preset: there is no camera 'primesence'; did you mean 'primesense'?
    """
    if name not in PRESETS:
        raise ValueError(f"preset: there is no camera {name!r}; {checks.nearest_name(name, PRESETS)}")
    return PRESETS[name]
