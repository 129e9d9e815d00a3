"""Outlier filters for a depth image: neighbours are the pixels around, so nothing has to be searched.

Thresholds are in inverse depth, 1/m, because a stereo camera's noise is constant there: one pixel of disparity is
1 / (f B) at every depth.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks

__all__ = ["keep_large_patches", "keep_supported"]

AROUND = tuple((dv, du) for dv in (-1, 0, 1) for du in (-1, 0, 1) if (dv, du) != (0, 0))


def keep_supported(depth: ArrayLike, tolerance: float, least: int = 3) -> NDArray[np.bool_]:
    """Keep pixels of which enough of the eight around have nearly the same inverse depth.

    Parameters
    ----------
    depth : (H, W) float, metres, 0 or NaN where nothing was measured.
    tolerance : in 1/m; k / (f B) is k pixels of disparity.
    least : how many of the eight, 1 to 8.

    Returns
    -------
    (H, W) bool; False also where nothing was measured.

    Raises
    ------
    ValueError
        If an argument is of another form.

    Examples
    --------
    >>> keep_supported([[1.0, 1.0, 3.0], [1.0, 1.0, 0.0]], tolerance=0.1).astype(int).tolist()
    [[1, 1, 0], [1, 1, 0]]
    """
    inverse = _inverse(depth)
    limit = checks.positive(tolerance, "tolerance", "number of 1/m")
    least = checks.whole(least, "least", 1, 8, of="pixels")
    padded = np.pad(inverse, 1, constant_values=np.nan)
    height, width = inverse.shape
    support = np.zeros(inverse.shape, dtype=np.int8)
    for dv, du in AROUND:
        other = padded[1 + dv : 1 + dv + height, 1 + du : 1 + du + width]
        support += np.abs(other - inverse) <= limit  # False beside NaN
    return support >= least


def keep_large_patches(depth: ArrayLike, tolerance: float, least: int) -> NDArray[np.bool_]:
    """Keep patches of at least so many pixels, whose inverse depth changes little from pixel to pixel.

    What clusters are for a cloud; pixels touch along their sides.

    Parameters
    ----------
    depth : (H, W) float, metres, 0 or NaN where nothing was measured.
    tolerance : in 1/m; k / (f B) is k pixels of disparity.
    least : pixels of the smallest patch that is kept, at least 1.

    Returns
    -------
    (H, W) bool; False also where nothing was measured.

    Raises
    ------
    ValueError
        If an argument is of another form.

    Examples
    --------
    >>> keep_large_patches([[1.0, 1.0, 3.0], [1.0, 1.0, 3.0]], tolerance=0.1, least=3).astype(int).tolist()
    [[1, 1, 0], [1, 1, 0]]
    """
    inverse = _inverse(depth)
    limit = checks.positive(tolerance, "tolerance", "number of 1/m")
    least = checks.whole(least, "least", of="pixels")
    steps = np.nan_to_num(np.rint(inverse / limit * 16), nan=0.0) + 33  # OpenCV compares whole numbers of 16 bits
    if steps.max() > np.iinfo(np.int16).max:
        raise ValueError(f"tolerance: {limit:g} 1/m is too fine for depths as near as {1 / np.nanmax(inverse):g} m.")
    image = np.where(np.isnan(inverse), 0, steps).astype(np.int16)
    measured = image > 0  # no data is two tolerances from the farthest pixel: a patch of its own
    cleaned = image.copy()
    # patches of up to maxSpeckleSize pixels are overwritten; no data is a patch of its own and stays what it is
    cv2.filterSpeckles(cleaned, -1, least - 1, 16)
    return measured & (cleaned > 0)


def _inverse(depth: ArrayLike) -> NDArray[np.float64]:
    """(H, W) 1/m, NaN where nothing was measured."""
    image = np.asarray(depth)
    if image.ndim != 2 or image.dtype.kind not in "fiu" or image.size == 0:
        raise ValueError(f"depth: expected an (H, W) image in metres, got shape {image.shape}, {image.dtype}.")
    image = image.astype(np.float64)
    there = np.isfinite(image) & (image > 0)
    return np.where(there, 1.0 / np.where(there, image, 1.0), np.nan)
