"""Point clouds: as plain arrays, as PCL lays them out in memory, and as ROS sends them.

Points are metres; colours RGB uint8. An *organised* cloud keeps the rows and columns of the image it came from, with NaN
where nothing was measured; an unorganised one is a list.

References
----------
Rusu and Cousins, 3D is here: Point Cloud Library (PCL), ICRA 2011; PCL 1.13 `pcl/impl/point_types.hpp`.
ROS `sensor_msgs/PointCloud2` and `sensor_msgs/PointField`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import cameras, checks, rgbd, transforms

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """An unorganised cloud, checked when made.

    Parameters
    ----------
    points : (N, 3) float32 or float64, metres, N ≥ 1; NaN rows are allowed (see `drop_nan`).
    colors : (N, 3) uint8 RGB, or None.
    normals : (N, 3) float, or None.
    labels : (N,) integers, or None.

    Raises
    ------
    ValueError
        If there is no point, or an attribute does not have one row a point.

    Examples
    --------
    >>> len(PointCloud([[0, 0, 1], [0, 1, 1]]))
    2
    """

    points: FloatArray
    colors: NDArray[np.uint8] | None = None
    normals: FloatArray | None = None
    labels: NDArray[np.integer] | None = None

    def __post_init__(self) -> None:
        points = checks.cloud_points(self.points)
        object.__setattr__(self, "points", points)
        if self.colors is not None:
            object.__setattr__(self, "colors", checks.colors_uint8(self.colors, points.shape))
        if self.normals is not None:
            normals = checks.last_axis(self.normals, 3, "normals")
            if normals.shape != points.shape:
                raise ValueError(f"normals: expected one a point, shape {points.shape}, got {normals.shape}.")
            object.__setattr__(self, "normals", normals)
        if self.labels is not None:
            labels = checks.numbers(self.labels, "labels")
            if labels.dtype.kind not in "iu" or labels.shape != points.shape[:1]:
                raise ValueError(f"labels: expected {len(points)} integers, got {labels.dtype} of shape {labels.shape}.")
            object.__setattr__(self, "labels", labels)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        has = [name for name in ("colors", "normals", "labels") if getattr(self, name) is not None]
        return f"PointCloud({len(self)} points{', with ' + ', '.join(has) if has else ''})"

    def select(self, index: ArrayLike) -> PointCloud:
        """Return the cloud of the chosen points: a (N,) bool mask or integer indices; choosing none raises."""
        index = np.asarray(index)
        picked = {
            name: None if values is None else values[index]
            for name, values in ((n, getattr(self, n)) for n in ("points", "colors", "normals", "labels"))
        }
        return replace(self, **picked)


def _cloud(cloud: PointCloud | ArrayLike) -> PointCloud:
    return cloud if isinstance(cloud, PointCloud) else PointCloud(cloud)


def drop_nan(cloud: PointCloud | ArrayLike) -> PointCloud:
    """Return the cloud without the points that have a NaN or infinite coordinate; order is kept.

    Raises
    ------
    ValueError
        If no point is left.
    """
    cloud = _cloud(cloud)
    finite = np.isfinite(cloud.points).all(axis=1)
    if not finite.any():
        raise ValueError(f"drop_nan: all {len(cloud)} points are NaN; nothing was measured.")
    return cloud if finite.all() else cloud.select(finite)


def bounds(cloud: PointCloud | ArrayLike) -> NDArray[np.float64]:
    """Return the (2, 3) smallest and largest coordinates of the finite points, metres.

    Examples
    --------
    >>> bounds([[0, 1, 2], [3, 0, 2]]).tolist()
    [[0.0, 0.0, 2.0], [3.0, 1.0, 2.0]]
    """
    points = drop_nan(cloud).points
    return np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float64)


def extent(cloud: PointCloud | ArrayLike) -> NDArray[np.float64]:
    """Return the (3,) lengths of the box around the finite points along x, y, z, metres."""
    low, high = bounds(cloud)
    return high - low


def from_organised(points_hw3: ArrayLike, colors: ArrayLike | None = None) -> PointCloud:
    """Flatten an organised cloud, row by row, without its unmeasured points.

    Parameters
    ----------
    points_hw3 : (H, W, 3), metres, NaN where nothing was measured.
    colors : (H, W, 3) uint8 RGB, or None.

    Returns
    -------
    PointCloud of the finite points.

    Raises
    ------
    ValueError
        If shapes differ, or nothing was measured.
    """
    points = checks.last_axis(points_hw3, 3, "points_hw3")
    if points.ndim != 3:
        raise ValueError(f"points_hw3: expected shape (H, W, 3), got {points.shape}.")
    if colors is not None:
        colors = checks.colors_uint8(colors, points.shape).reshape(-1, 3)
    return drop_nan(PointCloud(points.reshape(-1, 3), colors))


def from_frame(frame: rgbd.RGBDFrame, *, world: bool = False) -> PointCloud:
    """Lift an RGB-D frame to a coloured cloud.

    Parameters
    ----------
    frame : the images. Colours are taken only where they are registered to depth.
    world : False for the camera frame; True for the world frame, which needs `frame.T_world_camera`.

    Returns
    -------
    PointCloud, float64, of the measured pixels, row by row.

    Raises
    ------
    ValueError
        If nothing was measured, or the world frame is asked for and the pose is unknown.
    """
    if not isinstance(frame, rgbd.RGBDFrame):
        raise ValueError(f"frame: expected an RGBDFrame, got {type(frame).__name__}.")
    points = cameras.deproject_compact(frame.depth, frame.camera)
    if world:
        if frame.T_world_camera is None:
            raise ValueError("frame: its pose T_world_camera is unknown, so its points have no place in the world.")
        points = transforms.apply(frame.T_world_camera, points)
    return PointCloud(points, frame.color[rgbd.valid_mask(frame.depth)] if frame.registered else None)


# --- PCL's point types -------------------------------------------------------------------------------------------------


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
    if name not in POINT_TYPES:
        lower = {n.lower(): n for n in POINT_TYPES}
        raise ValueError(f"point_type: there is no {name!r}; {checks.nearest_name(name, lower)}")
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
    if array.dtype not in (np.float32, np.uint32):
        raise ValueError(f"packed: expected float32 or uint32 with the bits of a colour, got {array.dtype}.")
    bits = np.ascontiguousarray(array.astype(array.dtype.newbyteorder("="), copy=False)).view(np.uint32)
    bits = bits.reshape(array.shape)
    return np.stack([(bits >> 16) & 255, (bits >> 8) & 255, bits & 255], axis=-1).astype(np.uint8)


# --- ROS PointCloud2 ---------------------------------------------------------------------------------------------------

_DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_DATATYPE_OF = {np.dtype(kind): number for number, kind in _DATATYPES.items()}


@dataclass(frozen=True)
class PointField:
    """One column of a message: name, offset in bytes from the point's start, datatype 1–8 as in ROS, count."""

    name: str
    offset: int
    datatype: int
    count: int = 1


@dataclass(frozen=True)
class PointCloud2:
    """A cloud as ROS sends it: a description of the columns and the bytes. Nothing is checked before `from_message`.

    Parameters
    ----------
    height, width : rows and columns; height 1 for an unorganised cloud.
    fields : the columns.
    is_bigendian : byte order of every number in `data`.
    point_step : bytes from one point to the next.
    row_step : bytes from one row to the next.
    data : height * row_step bytes.
    is_dense : whether no point is NaN or infinite.
    frame_id : name of the coordinate frame.
    """

    height: int
    width: int
    fields: tuple[PointField, ...]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: bytes
    is_dense: bool
    frame_id: str = ""


def to_message(
    structured_array: NDArray,
    *,
    height: int | None = None,
    big_endian: bool = False,
    padding: int = 0,
    row_padding: int = 0,
    frame_id: str = "",
) -> PointCloud2:
    """Write a structured array as a PointCloud2 message.

    Parameters
    ----------
    structured_array : (N,) or (H, W) of a structured type such as those in `POINT_TYPES`; its padding is kept.
    height : rows, which must divide N; or None for the array's own (1 for (N,)).
    big_endian : byte order of the numbers.
    padding : further bytes after each point.
    row_padding : further bytes after each row.
    frame_id : name of the coordinate frame.

    Returns
    -------
    PointCloud2; every padding byte is 0.

    Raises
    ------
    ValueError
        If the array is not structured, empty, or has fields that ROS cannot name, or height does not divide N.
    """
    array = np.asarray(structured_array)
    if array.dtype.names is None:
        raise ValueError("structured_array: expected a structured array, e.g. numpy.zeros(n, POINT_TYPES['PointXYZ']).")
    if array.ndim not in (1, 2) or array.size == 0:
        raise ValueError(f"structured_array: expected shape (N,) or (H, W) with points, got {array.shape}.")
    if padding < 0 or row_padding < 0:
        raise ValueError("padding: a number of bytes cannot be negative.")
    rows = (array.shape[0] if array.ndim == 2 else 1) if height is None else height
    if rows < 1 or array.size % rows:
        raise ValueError(f"height: {rows} rows do not divide {array.size} points.")
    columns = array.size // rows
    fields, formats = [], []
    for name in array.dtype.names:
        kind, offset = array.dtype.fields[name][:2]
        base, shape = kind.subdtype or (kind, (1,))
        native = base.newbyteorder("=")
        if native not in _DATATYPE_OF or len(shape) != 1:
            raise ValueError(f"structured_array: ROS has no datatype for field {name!r} of type {kind}.")
        fields.append(PointField(name, offset, _DATATYPE_OF[native], shape[0]))
        formats.append((base.newbyteorder(">" if big_endian else "<"), shape) if kind.subdtype else
                       base.newbyteorder(">" if big_endian else "<"))  # fmt: skip
    point_step = array.dtype.itemsize + padding
    wire = np.dtype(
        {
            "names": list(array.dtype.names),
            "formats": formats,
            "offsets": [field.offset for field in fields],
            "itemsize": point_step,
        }
    )
    row_step = columns * point_step + row_padding
    data = np.zeros((rows, row_step), np.uint8)
    points = np.ndarray((rows, columns), wire, data, strides=(row_step, point_step))
    dense = True
    for name in array.dtype.names:
        column = array[name].reshape(points[name].shape)
        points[name] = column
        dense = dense and (column.dtype.kind != "f" or name in ("rgb", "rgba") or bool(np.isfinite(column).all()))
    return PointCloud2(
        rows, columns, tuple(fields), bool(big_endian), point_step, row_step, data.tobytes(), dense, frame_id
    )


def from_message(msg: PointCloud2) -> NDArray:
    """Read a PointCloud2 message of any stride, padding and byte order.

    Parameters
    ----------
    msg : the message (or any object with the same attributes, such as ROS's own).

    Returns
    -------
    structured array in this machine's byte order with the message's offsets and point step: (width,) if height is 1, else
    (height, width). It is a copy.

    Raises
    ------
    ValueError
        If the message contradicts itself: bytes missing, steps smaller than what they must hold, fields outside the point
        or over each other, unknown datatypes, two fields of one name, no point.
    """
    if msg.height < 1 or msg.width < 1:
        raise ValueError(f"message: height {msg.height} x width {msg.width} holds no point.")
    if not msg.fields:
        raise ValueError("message: it names no field, so its bytes mean nothing.")
    names, formats, offsets = [], [], []
    for field in sorted(msg.fields, key=lambda f: f.offset):
        if field.datatype not in _DATATYPES:
            raise ValueError(f"message: field {field.name!r} has datatype {field.datatype}; ROS knows 1 to 8.")
        if field.name in names:
            raise ValueError(f"message: two fields are called {field.name!r}.")
        kind = np.dtype(_DATATYPES[field.datatype])
        count = max(1, field.count)  # ROS 1 senders leave 0 for 1
        end = field.offset + count * kind.itemsize
        if field.offset < 0 or end > msg.point_step:
            raise ValueError(
                f"message: field {field.name!r} ends at byte {end}, but point_step is only {msg.point_step}."
            )
        names.append(field.name)
        formats.append((kind, (count,)) if count > 1 else kind)
        offsets.append(field.offset)
    if msg.row_step < msg.width * msg.point_step:
        raise ValueError(
            f"message: row_step {msg.row_step} is smaller than width {msg.width} times point_step {msg.point_step}."
        )
    needed = (msg.height - 1) * msg.row_step + msg.width * msg.point_step
    if len(msg.data) < needed:
        raise ValueError(
            f"message: {msg.height} rows of {msg.width} points need {needed} bytes, but data has only {len(msg.data)}; "
            "it is truncated."
        )
    native = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": msg.point_step})
    wire = native.newbyteorder(">" if msg.is_bigendian else "<")
    view = np.ndarray((msg.height, msg.width), wire, msg.data, strides=(msg.row_step, msg.point_step))
    array = np.zeros(view.shape, native)
    for name in names:
        array[name] = view[name]
    return array[0] if msg.height == 1 else array


def message_to_xyz(msg: PointCloud2) -> FloatArray:
    """Read the coordinates of a PointCloud2 message.

    Parameters
    ----------
    msg : a message with fields x, y, z.

    Returns
    -------
    (height * width, 3) in the message's own float type, row by row; unmeasured points stay NaN (see `drop_nan`).

    Raises
    ------
    ValueError
        If a field is missing, or the message contradicts itself.
    """
    array = from_message(msg).ravel()
    missing = [name for name in "xyz" if name not in array.dtype.names]
    if missing:
        raise ValueError(f"message: no field {', '.join(missing)}; it has {', '.join(array.dtype.names)}.")
    return np.stack([array["x"], array["y"], array["z"]], axis=-1)
