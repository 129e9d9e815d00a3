"""RGB-D images: a colour image and a depth image of the same view, and how files store depth.

Depth is z along the optical axis in metres, float32, with 0 where nothing was measured. Colours are RGB uint8. Images are
indexed [row v, column u] and pixel centres lie at integers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import cv2
import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from course_lib import checks, transforms
from course_lib.cameras import PinholeCamera

check_depth = checks.depth_image


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


@dataclass(frozen=True)
class DepthEncoding:
    """How a file stores depth.

    Parameters
    ----------
    name : what to call it.
    units_per_metre : raw units in one metre (after the bits are put in order).
    dtype : the type of the raw values.
    no_data : raw values that mean "not measured"; they decode to 0.
    source : who says so.
    form : "linear" (metres = raw / units), "rotated" (the 16 bits are rotated left by 3 first: SUN) or "disparity"
        (NYU: the bytes are swapped, and metres = 351.3 / (1092.5 − raw), rounded to units).
    """

    name: str
    units_per_metre: float
    dtype: DTypeLike
    no_data: tuple[int, ...]
    source: str
    form: Literal["linear", "rotated", "disparity"] = "linear"

    def __post_init__(self) -> None:
        if not checks.number(self.units_per_metre, "units_per_metre") > 0:
            raise ValueError(f"units_per_metre: {self.units_per_metre} is not positive.")
        if np.dtype(self.dtype) != np.uint16:
            raise ValueError(f"dtype: raw depth is 16-bit unsigned, not {np.dtype(self.dtype)}.")
        if self.form not in ("linear", "rotated", "disparity"):
            raise ValueError(f"form: say 'linear', 'rotated' or 'disparity', got {self.form!r}.")


ENCODINGS: dict[str, DepthEncoding] = {
    e.name: e
    for e in (
        DepthEncoding("tum", 5000.0, np.uint16, (0,), "TUM RGB-D benchmark, file formats: 5000 units are 1 m."),
        DepthEncoding("sun", 1000.0, np.uint16, (0,), "SUN RGB-D and SUN3D toolboxes: bits rotated by 3.", "rotated"),
        DepthEncoding("nyu", 1000.0, np.uint16, (0,), "NYU Depth v2, as Open3D reads it: Kinect disparity.", "disparity"),
        DepthEncoding("redwood", 1000.0, np.uint16, (0,), "Redwood data sets: 1000 units are 1 m."),
        DepthEncoding(
            "realsense", 1000.0, np.uint16, (0, 65535), "librealsense Z16 at the default depth scale of 0.001 m."
        ),
    )
}


def find_encoding(name: str | DepthEncoding) -> DepthEncoding:
    """Return a depth encoding by name (or unchanged); an unknown name raises ValueError with the nearest one."""
    if isinstance(name, DepthEncoding):
        return name
    if name not in ENCODINGS:
        raise ValueError(f"encoding: there is no {name!r}; {checks.nearest_name(name, ENCODINGS)}")
    return ENCODINGS[name]


def _check_raw(raw: ArrayLike) -> NDArray[np.uint16]:
    array = checks.numbers(raw, "raw depth")
    if array.dtype.itemsize == 1:
        raise ValueError(
            "raw depth: 8-bit values hold only 256 steps and are a picture of depth, not depth; "
            "read the 16-bit file unchanged (cv2.IMREAD_UNCHANGED)."
        )
    if array.dtype.kind == "f":
        raise ValueError(f"raw depth: expected 16-bit integers as stored, got {array.dtype}; it may be decoded already.")
    if array.ndim != 2 or array.size == 0:
        raise ValueError(f"raw depth: expected one channel of shape (H, W), got {array.shape}.")
    if array.dtype != np.uint16 and (array.min() < 0 or array.max() > 65535):
        raise ValueError(f"raw depth: {array.dtype} values from {array.min()} to {array.max()} do not fit 16 bits.")
    return array.astype(np.uint16, copy=False)


def decode_depth(raw: ArrayLike, encoding: str | DepthEncoding) -> NDArray[np.float32]:
    """Turn raw depth values of a file into metres.

    Parameters
    ----------
    raw : (H, W) 16-bit integers as stored (for NYU: as a PGM reader returns them).
    encoding : a name in `ENCODINGS` or a DepthEncoding.

    Returns
    -------
    (H, W) float32, metres; 0 where nothing was measured.

    Raises
    ------
    ValueError
        If raw is 8-bit, not integer, not one channel, or the encoding is unknown.

    Examples
    --------
    >>> decode_depth(np.array([[0, 5000, 12500]], np.uint16), "tum").tolist()
    [[0.0, 1.0, 2.5]]
    """
    form = find_encoding(encoding)
    raw = _check_raw(raw)
    missing = np.isin(raw, form.no_data)
    units = raw
    if form.form == "rotated":
        units = (raw >> 3) | (raw << 13)
    elif form.form == "disparity":
        units = _nyu_units(raw.byteswap(), form.units_per_metre)
    depth = (units / form.units_per_metre).astype(np.float32)
    depth[missing] = 0
    return depth


NYU_NUMERATOR, NYU_OFFSET = 351.3, 1092.5  # metres = 351.3 / (1092.5 − disparity): the Kinect fit of the NYU toolbox


def _nyu_units(disparity: NDArray[np.uint16], units_per_metre: float) -> NDArray[np.float64]:
    metres = NYU_NUMERATOR / (NYU_OFFSET - disparity.astype(np.float64))
    return np.where(metres > 0, np.floor(metres * units_per_metre + 0.5), 0.0)


def encode_depth(depth: ArrayLike, encoding: str | DepthEncoding) -> NDArray[np.uint16]:
    """Turn metres into the raw values that a file stores, rounded to its unit: the inverse of `decode_depth`.

    Parameters
    ----------
    depth : (H, W) float, metres; 0, NaN or infinite where nothing was measured.
    encoding : a name in `ENCODINGS` or a DepthEncoding.

    Returns
    -------
    (H, W) uint16.

    Raises
    ------
    ValueError
        If depth is not metres, or too far (or near) for the encoding.
    """
    form = find_encoding(encoding)
    depth = check_depth(depth).astype(np.float64)
    measured = valid_mask(depth)
    metres = np.where(measured, depth, 0.0)
    if form.form == "disparity":
        with np.errstate(divide="ignore"):
            units = np.where(measured, np.rint(NYU_OFFSET - NYU_NUMERATOR / metres), 2047)
    else:
        units = np.rint(metres * form.units_per_metre)
    largest = 2046 if form.form == "disparity" else 65534 if 65535 in form.no_data else 65535
    if measured.any() and (units[measured].max() > largest or units[measured].min() < 1):
        raise ValueError(
            f"depth: {metres[measured].min():.4g} to {metres[measured].max():.4g} m does not fit the encoding "
            f"{form.name!r}; set what is out of its range to 0."
        )
    units = units.astype(np.uint16)
    if form.form == "rotated":
        return (units << 3) | (units >> 13)
    return units.byteswap() if form.form == "disparity" else units


def valid_mask(depth: ArrayLike) -> NDArray[np.bool_]:
    """Return where depth was measured: finite and above 0. Shape and memory follow `depth`, (H, W) bool."""
    depth = checks.numbers(depth, "depth")
    return (depth > 0) & (depth < np.inf)


def _target(width: int, height: int) -> tuple[int, int]:
    for name, value in (("width", width), ("height", height)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value <= 0:
            raise ValueError(f"{name}: expected a positive whole number of pixels, got {value!r}.")
    return int(width), int(height)


def resize_depth(depth: ArrayLike, width: int, height: int) -> NDArray[np.float32]:
    """Resize a depth image by picking, for every new pixel, the old pixel that its centre lies in.

    Two depths are never mixed: the mean of a chair and the wall behind it is a point in the air. The picked pixel's centre
    lies up to half an old pixel away from the new one; its camera is `camera.scaled(width, height)`.

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
    width, height = _target(width, height)
    rows = (2 * np.arange(height) + 1) * depth.shape[0] // (2 * height)
    columns = (2 * np.arange(width) + 1) * depth.shape[1] // (2 * width)
    return depth[np.ix_(rows, columns)].astype(np.float32, copy=False)


def resize_color(color: ArrayLike, width: int, height: int) -> NDArray[np.uint8]:
    """Resize a colour image with the same pixel centres: averaged where it shrinks, interpolated where it grows.

    Parameters
    ----------
    color : (H, W, 3) uint8.
    width, height : of the result, pixels.

    Returns
    -------
    (height, width, 3) uint8.

    Raises
    ------
    ValueError
        If color is not (H, W, 3) uint8, or a size is not a positive whole number.
    """
    color = np.asarray(color)
    checks.colors_uint8(color, (*color.shape[:2], 3), "color")
    width, height = _target(width, height)
    shrinks = width <= color.shape[1] and height <= color.shape[0]
    return cv2.resize(color, (width, height), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)


def resize_frame(frame: RGBDFrame, width: int, height: int) -> RGBDFrame:
    """Resize both images of a frame and scale its camera with them.

    Raises
    ------
    ValueError
        If `frame` is no RGBDFrame, or a size is not a positive whole number.
    """
    if not isinstance(frame, RGBDFrame):
        raise ValueError(f"frame: expected an RGBDFrame, got {type(frame).__name__}.")
    return replace(
        frame,
        color=resize_color(frame.color, width, height),
        depth=resize_depth(frame.depth, width, height),
        camera=frame.camera.scaled(width, height),
    )


def rescale_for_display(
    depth: ArrayLike, near: float, far: float, *, darker: Literal["farther", "nearer"] = "farther"
) -> NDArray[np.uint8]:
    """Squeeze depth into 8 bits, for looking only: the lecture's float32 → [0, 255].

    Parameters
    ----------
    depth : (H, W) float, metres.
    near, far : the depths that get the two ends of the grey scale, metres; what lies outside is clipped.
    darker : which end is dark. It is a choice of display and says nothing about the file.

    Returns
    -------
    (H, W) uint8: 1 to 255 for measured pixels, 0 where nothing was measured. Never to be computed with.

    Raises
    ------
    ValueError
        If depth is no depth image, near is not below far, or `darker` is not one of the two words.
    """
    depth = check_depth(depth)
    near, far = checks.number(near, "near"), checks.number(far, "far")
    if not near < far:
        raise ValueError(f"near ({near:g} m) must be below far ({far:g} m).")
    if darker not in ("farther", "nearer"):
        raise ValueError(f"darker: say 'farther' or 'nearer', got {darker!r}.")
    measured = valid_mask(depth)
    share = (np.clip(np.where(measured, depth, near), near, far) - near) / (far - near)
    if darker == "farther":
        share = 1 - share
    return np.where(measured, np.rint(1 + 254 * share), 0).astype(np.uint8)
