"""Argument checks that the topic modules share: each returns clean arrays or raises one ValueError sentence."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.floating]

# A depth image is inspected on at most about this many pixels when asked whether it looks like millimetres: the check
# then costs microseconds, and a wrong unit shows on every pixel.
SAMPLE_PIXELS = 4096
# How far a matrix may be from rigid: single precision and files with six decimals pass, anything that scales fails.
RIGID_TOLERANCE = 1e-4
# How far the entries of a rotation may be off to be taken for a rotation that was written with few digits.
ROUNDED = 1e-3


def nearest_name(name: str, names: Iterable[str]) -> str:
    """Return the end of a sentence that suggests the known name nearest to `name`, or lists all of them.

    Examples
    --------
    >>> nearest_name("primsense", ["primesense", "d455_depth_848x480"])
    "did you mean 'primesense'?"
    >>> nearest_name("x", ["tum", "sun"])
    'known are: sun, tum.'
    """
    known = {each.lower(): each for each in sorted(names)}
    close = difflib.get_close_matches(str(name).lower(), known, n=1, cutoff=0.5)
    return f"did you mean {known[close[0]]!r}?" if close else f"known are: {', '.join(known.values())}."


def numbers(values: ArrayLike, what: str) -> NDArray[Any]:
    """Return `values` as an array of real numbers; refuse text, objects, complex numbers and ragged lists."""
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"{what}: the rows have different lengths; give an array of one shape.") from error
    if array.dtype.kind not in "fiu":
        got = f"{array.dtype} values" if array.dtype != object or array.ndim else type(values).__name__
        part = next((name for name in ("points", "vertices") if hasattr(values, name)), None)
        hint = f"give its .{part}" if part else "give a numeric array"
        raise ValueError(f"{what}: expected real numbers, got {got}; {hint}.")
    return array


def vector(values: ArrayLike, size: int, what: str) -> NDArray[np.float64]:
    """Return `values` as a finite float64 vector of `size` numbers."""
    array = numbers(values, what)
    if array.shape != (size,):
        raise ValueError(f"{what}: expected {size} numbers, got an array of shape {array.shape}.")
    array = array.astype(np.float64)
    if not np.isfinite(array).all():
        raise ValueError(f"{what}: {array.tolist()} is not finite; give {size} finite numbers.")
    return array


def number(value: float, what: str) -> float:
    """Return `value` as one finite float."""
    array = numbers(value, what)
    if array.ndim != 0 or not np.isfinite(array):
        raise ValueError(f"{what}: expected one finite number, got {value!r}.")
    return float(array)


def positive(value: float, what: str, of: str = "length in the unit of the points") -> float:
    """Return `value` as one finite float above 0."""
    one = number(value, what)
    if one <= 0:
        raise ValueError(f"{what}: expected a positive {of}, got {one:g}.")
    return one


def reach(value: float, what: str) -> float:
    """Return `value` as a float above 0, which may be infinite."""
    return np.inf if isinstance(value, float) and value == np.inf else positive(value, what)


def whole(value: int, what: str, least: int = 1, most: int | None = None, of: str = "") -> int:
    """Return `value` if it is a whole number (of pixels, or the like) from `least` to `most`."""
    right = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not right or value < least or (most is not None and value > most):
        which = f"from {least} on" if most is None else f"from {least} to {most}"
        raise ValueError(f"{what}: expected a whole number {f'of {of} ' if of else ''}{which}, got {value!r}.")
    return int(value)


def last_axis(values: ArrayLike, size: int, what: str) -> FloatArray:
    """Return `values` as floats of shape (..., size): float32 stays float32, everything else becomes float64."""
    array = numbers(values, what)
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"{what}: the last axis must have {size} entries, got an array of shape {array.shape}.")
    return array if array.dtype in (np.float32, np.float64) else array.astype(np.float64)


def check_depth(depth: ArrayLike, what: str = "depth") -> FloatArray:
    """Return `depth` if it can be a depth image in metres: (H, W) floating point, nowhere negative, not millimetres.

    Parameters
    ----------
    depth : (H, W) float, metres along the optical axis; 0, NaN or infinite where nothing was measured.
    what : what the sentence calls it.

    Returns
    -------
    (H, W) float; the same array, not a copy.

    Raises
    ------
    ValueError
        If it is 8-bit, integer, not two-dimensional, empty, negative somewhere, or looks like millimetres.
    """
    array = numbers(depth, what)
    if array.dtype.itemsize == 1:
        raise ValueError(
            f"{what}: 8-bit values hold only 256 steps and are a picture of depth, not depth; "
            "read the 16-bit file unchanged (cv2.IMREAD_UNCHANGED)."
        )
    if array.dtype.kind != "f":
        raise ValueError(
            f"{what}: {array.dtype} values are raw device units, not metres; decode them first with rgbd.decode_depth."
        )
    if array.ndim != 2 or array.size == 0:
        raise ValueError(f"{what}: expected an image of shape (H, W), got {array.shape}.")
    lowest = np.fmin.reduce(array, axis=None)
    if lowest < 0 and lowest != -np.inf:
        raise ValueError(f"{what}: {lowest:.6g} is negative; depth is metres, or 0 where nothing was measured.")
    step = max(1, int(np.sqrt(array.size / SAMPLE_PIXELS)))
    sample = array[step // 2 :: step, step // 2 :: step]
    sample = sample[(sample > 0) & (sample < np.inf)]
    if sample.size and sample.max() > 100:
        middle = float(np.median(sample))
        whole = bool((sample == np.rint(sample)).all())
        if middle > 500 or (middle > 100 and whole):
            raise ValueError(
                f"{what}: a median of {middle:.6g} looks like millimetres or raw units, not metres; "
                "decode it with rgbd.decode_depth, or divide by the units per metre."
            )
    return array


def cloud_points(points: ArrayLike, what: str = "points") -> FloatArray:
    """Return `points` as (N, 3) floats with N ≥ 1: float32 stays float32, everything else becomes float64."""
    array = last_axis(points, 3, what)
    if array.ndim != 2:
        raise ValueError(f"{what}: expected shape (N, 3), got {array.shape}; reshape to rows of x, y, z.")
    if len(array) == 0:
        raise ValueError(f"{what}: there are none; an empty cloud is refused so that nothing is lost silently.")
    return array


def finite_points(points: ArrayLike, what: str = "points") -> NDArray[np.float64]:
    """Return `points` as finite (N, 3) float64, N ≥ 1, C-contiguous.

    Raises
    ------
    ValueError
        If the shape is another, there are none, or one is NaN or infinite.
    """
    array = cloud_points(points, what)
    # one sum tells of NaN and infinity without a mask of every number
    with np.errstate(invalid="ignore", over="ignore"):
        total = array.sum(dtype=np.float64)
    if not np.isfinite(total):
        bad = np.count_nonzero(~np.isfinite(array).all(axis=1))
        if bad:
            raise ValueError(
                f"{what}: {bad} of {len(array)} are NaN or infinite; drop them first (pointcloud.drop_nan)."
            )
    return np.ascontiguousarray(array, dtype=np.float64)


def colors_uint8(colors: ArrayLike, shape: tuple[int, ...], what: str = "colors") -> NDArray[np.uint8]:
    """Return RGB `colors` of exactly `shape` as uint8; refuse other types (0–1 floats are named as such)."""
    array = numbers(colors, what)
    if array.dtype != np.uint8:
        hint = "multiply by 255, round and convert" if array.dtype.kind == "f" else "convert with astype(numpy.uint8)"
        raise ValueError(f"{what}: expected uint8 from 0 to 255, got {array.dtype}; {hint}.")
    if array.shape != shape:
        raise ValueError(f"{what}: expected shape {shape}, got {array.shape}; one RGB triple is needed for each entry.")
    return array


def check_rigid(T: ArrayLike, name: str = "T") -> NDArray[np.float64]:
    """Return `T` as float64 if it is a rigid transform, else raise.

    Parameters
    ----------
    T : (4, 4) rotation and translation in metres, last row 0 0 0 1.
    name : what the sentence calls it.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If the shape, the last row, the lengths and angles, or the handedness is not that of a rigid transform.

    Examples
    --------
    >>> check_rigid(np.diag([2.0, 2.0, 2.0, 1.0]))
    Traceback (most recent call last):
    ValueError: T: the upper left 3x3 is not a rotation (R^T R differs from I by 3); it scales or shears.
    """
    matrix = numbers(T, name).astype(np.float64)
    if matrix.shape != (4, 4):
        raise ValueError(f"{name}: expected a 4x4 matrix, got shape {matrix.shape}.")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name}: the matrix holds NaN or infinity; a rigid transform is finite.")
    if not np.allclose(matrix[3], [0, 0, 0, 1], rtol=0, atol=RIGID_TOLERANCE):
        transposed = " (it looks transposed: translation belongs in the last column)" if matrix[3, :3].any() else ""
        raise ValueError(f"{name}: the last row must be 0 0 0 1, got {matrix[3].tolist()}{transposed}.")
    check_rotation(matrix[:3, :3], name)
    return matrix


def check_rotation(R: NDArray[np.float64], name: str) -> None:
    """Raise ValueError if the (3, 3) matrix is not a rotation: lengths, angles and handedness kept."""
    error = float(np.abs(R.T @ R - np.eye(3)).max())
    if error > RIGID_TOLERANCE:
        raise ValueError(
            f"{name}: the upper left 3x3 is not a rotation (R^T R differs from I by {error:.3g}); it scales or shears"
            f"{', or was rounded: transforms.nearest_rigid mends that' if error < ROUNDED else ''}."
        )
    if np.linalg.det(R) < 0:
        raise ValueError(f"{name}: the upper left 3x3 is a reflection (determinant -1), not a rotation; flip one axis.")


def size(value: int, what: str) -> int:
    """Return `value` as a positive whole number of pixels."""
    return whole(value, what, of="pixels")
