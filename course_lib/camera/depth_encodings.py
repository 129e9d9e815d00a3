"""How files store depth: TUM, SUN, NYU, Redwood and RealSense, to metres and back.

Everything here can be had from `course_lib.camera.rgbd` too.

References
----------
Sturm et al., A benchmark for the evaluation of RGB-D SLAM systems, IROS 2012 (TUM: 5000 units are 1 m). Song and
others, SUN RGB-D, CVPR 2015, and the SUN3D toolbox (rotated bits). Silberman et al., Indoor segmentation and support
inference from RGBD images, ECCV 2012 (NYU). Choi, Zhou and Koltun, Robust reconstruction of indoor scenes, CVPR 2015
(Redwood: 1000). librealsense, format Z16. Open3D 0.20 manual, RGBD images.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from course_lib import checks


def valid_mask(depth: ArrayLike) -> NDArray[np.bool_]:
    """Return where depth was measured: finite and above 0. Shape and memory follow `depth`, (H, W) bool."""
    depth = checks.numbers(depth, "depth")
    return (depth > 0) & (depth < np.inf)


@dataclass(frozen=True)
class DepthEncoding:
    """How a file stores depth.

    Parameters
    ----------
    name : what to call it.
    units_per_metre : raw units in one metre (after the bits are put in order).
    dtype : the type of the raw values: uint16, or float32 in files of floats (a linear form only).
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
        if np.dtype(self.dtype) not in (np.uint16, np.float32):
            raise ValueError(f"dtype: raw depth is 16-bit unsigned (or float32), not {np.dtype(self.dtype)}.")
        if np.dtype(self.dtype) == np.float32 and self.form != "linear":
            raise ValueError(f"form: floats are linear, not {self.form!r}.")
        if self.form not in ("linear", "rotated", "disparity"):
            raise ValueError(f"form: say 'linear', 'rotated' or 'disparity', got {self.form!r}.")


ENCODINGS: dict[str, DepthEncoding] = {
    e.name: e
    for e in (
        DepthEncoding("tum", 5000.0, np.uint16, (0,), "TUM RGB-D benchmark, file formats: 5000 units are 1 m."),
        DepthEncoding("sun", 1000.0, np.uint16, (0,), "SUN RGB-D and SUN3D toolboxes: bits rotated by 3.", "rotated"),
        DepthEncoding("nyu", 1000.0, np.uint16, (), "NYU Depth v2 raw: Kinect disparity, read as Open3D.", "disparity"),
        DepthEncoding("redwood", 1000.0, np.uint16, (0,), "Redwood data sets: 1000 units are 1 m."),
        DepthEncoding(
            "realsense", 1000.0, np.uint16, (0, 65535), "librealsense Z16 at the default depth scale of 0.001 m."
        ),
    )
}


METRES = DepthEncoding("metres", 1.0, np.float32, (0,), "floats in metres, as NumPy and TIFF files hold them.")


def find_encoding(name: str | float | DepthEncoding) -> DepthEncoding:
    """Return a depth encoding by name, by its units in a metre, or unchanged; ValueError names the nearest name."""
    if isinstance(name, DepthEncoding):
        return name
    if isinstance(name, (int, float)) and not isinstance(name, bool):
        return DepthEncoding(f"{name:g} units a metre", name, np.uint16, (0,), "given by you.")
    if not isinstance(name, str) or name not in ENCODINGS:
        raise ValueError(f"encoding: there is no {name!r}; {checks.nearest_name(str(name), ENCODINGS)}")
    return ENCODINGS[name]


def _check_raw(raw: ArrayLike) -> NDArray[np.uint16]:
    array = checks.numbers(raw, "raw depth")
    if array.dtype.itemsize == 1:
        raise ValueError(
            "raw depth: 8-bit values hold only 256 steps and are a picture of depth, not depth; "
            "read the 16-bit file unchanged (cv2.IMREAD_UNCHANGED)."
        )
    if array.dtype.kind == "f":
        raise ValueError(f"raw depth: expected 16-bit integers as stored, got {array.dtype}; is it decoded already?")
    if array.ndim != 2 or array.size == 0:
        raise ValueError(f"raw depth: expected one channel of shape (H, W), got {array.shape}.")
    if array.dtype != np.uint16 and (array.min() < 0 or array.max() > 65535):
        raise ValueError(f"raw depth: {array.dtype} values from {array.min()} to {array.max()} do not fit 16 bits.")
    return array.astype(np.uint16, copy=False)


def decode_depth(raw: ArrayLike, encoding: str | DepthEncoding) -> NDArray[np.float32]:
    """Turn raw depth values of a file into metres.

    Parameters
    ----------
    raw : (H, W) 16-bit integers as stored (for NYU: as a PGM reader returns them), or floats if the encoding says so.
    encoding : a name in `ENCODINGS` or a DepthEncoding.

    Returns
    -------
    (H, W) float32, metres; 0 where nothing was measured.

    Raises
    ------
    ValueError
        If raw is 8-bit, not of the encoding's type, not one channel, or the encoding is unknown.

    Examples
    --------
    >>> decode_depth(np.array([[0, 5000, 12500]], np.uint16), "tum").tolist()
    [[0.0, 1.0, 2.5]]
    """
    form = find_encoding(encoding)
    if np.dtype(form.dtype) == np.float32:
        metres = checks.check_depth(np.asarray(raw) / form.units_per_metre).astype(np.float32)
        return np.where(valid_mask(metres), metres, np.float32(0))
    raw = _check_raw(raw)
    missing = np.isin(raw, form.no_data)
    units: NDArray[np.uint16 | np.float64] = raw
    if form.form == "rotated":
        units = (raw >> np.uint16(3)) | (raw << np.uint16(13))
    elif form.form == "disparity":
        units = _nyu_units(raw.byteswap(), form.units_per_metre)
    depth = (units / form.units_per_metre).astype(np.float32)
    depth[missing] = 0
    return depth


NYU_NUMERATOR, NYU_OFFSET = 351.3, 1092.5  # metres = 351.3 / (1092.5 − disparity): the Kinect fit of the NYU toolbox


def _nyu_units(disparity: NDArray[np.uint16], units_per_metre: float) -> NDArray[np.float64]:
    metres = NYU_NUMERATOR / (NYU_OFFSET - disparity.astype(np.float64))
    return np.where(metres > 0, np.floor(metres * units_per_metre + 0.5), 0.0)


def encode_depth(depth: ArrayLike, encoding: str | DepthEncoding) -> NDArray[np.uint16 | np.float32]:
    """Turn metres into the raw values that a file stores, rounded to its unit: the inverse of `decode_depth`.

    Parameters
    ----------
    depth : (H, W) float, metres; 0, NaN or infinite where nothing was measured.
    encoding : a name in `ENCODINGS` or a DepthEncoding.

    Returns
    -------
    (H, W) uint16, or float32 if the encoding says so.

    Raises
    ------
    ValueError
        If depth is not metres, or too far (or near) for the encoding.
    """
    form = find_encoding(encoding)
    depth = checks.check_depth(depth).astype(np.float64)
    measured = valid_mask(depth)
    metres = np.where(measured, depth, 0.0)
    if np.dtype(form.dtype) == np.float32:
        return (metres * form.units_per_metre).astype(np.float32)
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
        return (units << np.uint16(3)) | (units >> np.uint16(13))
    return units.byteswap() if form.form == "disparity" else units
