"""Intrinsics: what one camera does at one resolution, and fields of view.

Pixel centres lie at integers: the ideal principal point of a W-wide image is (W − 1)/2, and scaling an image by s moves
it to s (cx + 0.5) − 0.5. Everything here can be had from `course_lib.camera.pinhole` too.

References
----------
Hartley and Zisserman, Multiple View Geometry in Computer Vision, 2nd ed., sec. 6.1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks

Axis = Literal["horizontal", "vertical"]
Centre = Literal["integer", "half"]

NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)
NARROWEST = 0.05
"""Focal lengths, as a share of the image, below which nothing can be a pinhole: it would see 169 degrees."""


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
            object.__setattr__(self, name, checks.size(getattr(self, name), name))
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
        """Return the camera of the same picture resized: f' = s f, cx' = s (cx + 0.5) − 0.5 along each axis."""
        sx, sy = checks.size(width, "width") / self.width, checks.size(height, "height") / self.height
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


def camera_from_matrix(
    K: ArrayLike, width: int, height: int, *, distortion: ArrayLike = NO_DISTORTION, source: str = ""
) -> PinholeCamera:
    """Return the camera of a matrix K, as calibrations and recordings give it.

    Parameters
    ----------
    K : (3, 3), or its nine numbers, row after row (as in ROS) or column after column (as in Open3D).
    width, height : pixels.
    distortion : k1, k2, p1, p2 and, if there is one, k3, of Brown and Conrady; zeros may follow.
    source : one sentence that says where the numbers come from.

    Raises
    ------
    ValueError
        If K has another shape, a skew, or focal lengths that are shares of the image instead of pixels.

    Examples
    --------
    >>> camera_from_matrix([50, 0, 31.5, 0, 50, 23.5, 0, 0, 1], 64, 48).cx
    31.5
    """
    matrix = checks.numbers(K, "K").astype(np.float64)
    if matrix.shape == (9,):
        matrix = matrix.reshape(3, 3)
        if matrix[2, :2].any() and not matrix[:2, 2].any():
            matrix = matrix.T
    if matrix.shape != (3, 3):
        raise ValueError(f"K: expected a 3x3 matrix or its nine numbers, got an array of shape {matrix.shape}.")
    if matrix[0, 1] != 0 or matrix[1, 0] != 0 or (matrix[2] != [0, 0, 1]).any():
        raise ValueError(f"K: expected fx 0 cx, 0 fy cy, 0 0 1, got {matrix.tolist()}.")
    five = checks.numbers(distortion, "distortion").astype(np.float64).reshape(-1)
    if len(five) < 4 or five[5:].any():
        raise ValueError(f"distortion: expected k1, k2, p1, p2, k3, got {len(five)} numbers: {five.tolist()}.")
    five = np.append(five, 0.0)[:5]
    fx, fy, cx, cy = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    camera = PinholeCamera(width, height, fx, fy, cx, cy, tuple(five.tolist()), source)
    if max(camera.fx / camera.width, camera.fy / camera.height) < NARROWEST:
        raise ValueError(
            f"K: focal lengths of {camera.fx:g} and {camera.fy:g} are shares of the image, not pixels; multiply "
            f"fx and cx by the width ({width}), fy and cy by the height ({height})."
        )
    return camera


def _fov(fov: float) -> float:
    fov = checks.number(fov, "fov")
    if fov >= np.pi:
        raise ValueError(f"fov: {fov:g} is not below π radians; if these are degrees, convert with numpy.radians.")
    if fov <= 0:
        raise ValueError(f"fov: {fov:g} is not a positive angle in radians.")
    return fov


def focal_length(fov: float, size: int) -> float:
    """Return the focal length in pixels that spreads `fov` over `size` pixels: f = (size / 2) / tan(fov / 2).

    It is the half angle that counts, because f and half the image are the legs of a right-angled triangle.

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
    return 0.5 * checks.size(size, "size") / float(np.tan(0.5 * _fov(fov)))


def field_of_view(focal: float, size: int) -> float:
    """Return the angle that `size` pixels see: the inverse of `focal_length`.

    Parameters
    ----------
    focal : focal length, pixels.
    size : pixels along the same axis.

    Returns
    -------
    the whole angle, radians.

    Raises
    ------
    ValueError
        If one of them is not positive.

    Examples
    --------
    >>> round(float(np.degrees(field_of_view(320, 640))), 9)
    90.0
    """
    focal = checks.number(focal, "focal")
    if focal <= 0:
        raise ValueError(f"focal: {focal:g} pixels is not positive.")
    return 2.0 * float(np.arctan(0.5 * checks.size(size, "size") / focal))


def camera_from_fov(fov: float, width: int, height: int, *, axis: Axis, centre: Centre = "integer") -> PinholeCamera:
    """Make an ideal camera with square pixels from a field of view: equations 1–4 of the UAV document.

    Parameters
    ----------
    fov : the whole angle along `axis`, radians.
    width, height : pixels.
    axis : "horizontal" or "vertical"; simulators differ (Unity's angle is vertical), so it must be said.
    centre : where the coordinates of a pixel's centre lie. "integer", the convention of this course: cx = (W − 1)/2.
        "half", that of the document's equations 3 and 4: at +0.5, so cx = W/2; nothing else here works so.

    Returns
    -------
    PinholeCamera with fx = fy.

    Raises
    ------
    ValueError
        If the angle is not between 0 and π, or `axis` or `centre` is not one of the two words.

    Examples
    --------
    >>> round(camera_from_fov(np.radians(60), 640, 480, axis="horizontal").fx)
    554
    >>> round(camera_from_fov(np.radians(60), 640, 480, axis="vertical").fx)
    416
    """
    if axis not in ("horizontal", "vertical"):
        raise ValueError(f"axis: say 'horizontal' or 'vertical' for the field of view, got {axis!r}.")
    if centre not in ("integer", "half"):
        raise ValueError(f"centre: say 'integer' (this course) or 'half' (cx = width/2), got {centre!r}.")
    f = focal_length(fov, width if axis == "horizontal" else height)
    shift = 0.5 if centre == "integer" else 0.0
    cx, cy = 0.5 * checks.size(width, "width") - shift, 0.5 * checks.size(height, "height") - shift
    source = f"ideal: {axis} field of view {np.degrees(fov):.4g} degrees, square pixels, centred."
    return PinholeCamera(width, height, f, f, cx, cy, source=source)


def check_camera(camera: PinholeCamera) -> None:
    """Raise ValueError if `camera` is not a PinholeCamera."""
    if not isinstance(camera, PinholeCamera):
        raise ValueError(f"camera: expected a PinholeCamera, got {type(camera).__name__}.")
