"""PCL's point types as NumPy structured types, byte for byte, and its way of packing a colour into a float.

Everything here can be had from `course_lib.cloud.pointcloud` too.

References
----------
Rusu and Cousins, 3D is here: Point Cloud Library (PCL), ICRA 2011. PCL 1.13, `pcl/impl/point_types.hpp`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks


def _pcl(itemsize: int, **fields: tuple[str, int]) -> np.dtype:
    return np.dtype(
        {
            "names": list(fields),
            "formats": [kind for kind, _ in fields.values()],
            "offsets": [offset for _, offset in fields.values()],
            "itemsize": itemsize,
        }
    )


_XYZ = {"x": ("<f4", 0), "y": ("<f4", 4), "z": ("<f4", 8)}
_NORMAL = ("normal_x", "normal_y", "normal_z")

# Every group of up to four floats fills 16 bytes, so that SSE can load it; the gaps are padding.
POINT_TYPES: dict[str, np.dtype] = {
    "PointXYZ": _pcl(16, **_XYZ),
    "PointXYZI": _pcl(32, **_XYZ, intensity=("<f4", 16)),
    "PointXYZRGB": _pcl(32, **_XYZ, rgb=("<f4", 16)),
    "PointXYZRGBA": _pcl(32, **_XYZ, rgba=("<u4", 16)),
    "Normal": _pcl(32, **{n: ("<f4", 4 * i) for i, n in enumerate(_NORMAL)}, curvature=("<f4", 16)),
    "PointNormal": _pcl(48, **_XYZ, **{n: ("<f4", 16 + 4 * i) for i, n in enumerate(_NORMAL)}, curvature=("<f4", 32)),
}


def point_type(name: str) -> np.dtype:
    """Return a PCL point type by name; an unknown one raises ValueError with the nearest suggested.

    Examples
    --------
    >>> point_type("PointXYZ").itemsize
    16
    """
    if not isinstance(name, str) or name not in POINT_TYPES:
        raise ValueError(f"point_type: there is no {name!r}; {checks.nearest_name(name, POINT_TYPES)}")
    return POINT_TYPES[name]


def pack_rgb(colors: ArrayLike) -> NDArray[np.float32]:
    """Pack RGB into the bits of a float32, as PCL does: 0x00RRGGBB. The float's value means nothing.

    Parameters
    ----------
    colors : (..., 3) uint8 RGB.

    Returns
    -------
    (...) float32; copy it, never compute with it.

    Raises
    ------
    ValueError
        If colors are not uint8 triples.

    Examples
    --------
    >>> hex(pack_rgb(np.array([[255, 128, 1]], np.uint8)).view(np.uint32)[0])
    '0xff8001'
    """
    colors = np.asarray(colors)
    checks.colors_uint8(colors, (*colors.shape[:-1], 3))
    wide = colors.astype(np.uint32)
    return np.asarray((wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2]).view(np.float32)


def unpack_rgb(packed: ArrayLike) -> NDArray[np.uint8]:
    """Read RGB out of packed colours: the inverse of `pack_rgb`; the top byte (alpha) is ignored.

    Parameters
    ----------
    packed : (...) float32 (field rgb) or uint32 (field rgba).

    Returns
    -------
    (..., 3) uint8 RGB.

    Raises
    ------
    ValueError
        If packed is neither float32 nor uint32: converting a packed float loses its bits.
    """
    array = np.asarray(packed)
    native = array.dtype.newbyteorder("=")
    if native not in (np.float32, np.uint32):
        raise ValueError(f"packed: expected float32 or uint32 with the bits of a colour, got {array.dtype}.")
    bits = np.ascontiguousarray(array.astype(native, copy=False)).view(np.uint32).reshape(array.shape)
    return np.stack([(bits >> 16) & 255, (bits >> 8) & 255, bits & 255], axis=-1).astype(np.uint8)
