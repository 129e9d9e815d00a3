"""Clouds as ROS sends them: PointCloud2 messages to and from bytes.

Everything here can be had from `course_lib.cloud.pointcloud` too.

References
----------
ROS `sensor_msgs/PointCloud2` and `sensor_msgs/PointField`.
"""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import fields as dataclass_fields

import numpy as np
from numpy.typing import NDArray

from course_lib import checks

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
    structured_array: NDArray[np.void],
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
    names, layout = array.dtype.names, array.dtype.fields
    if names is None or layout is None:
        raise ValueError("structured_array: expected a structured array, e.g. numpy.zeros(n, POINT_TYPES['PointXYZ']).")
    if array.ndim not in (1, 2) or array.size == 0:
        raise ValueError(f"structured_array: expected shape (N,) or (H, W) with points, got {array.shape}.")
    if not all(isinstance(n, (int, np.integer)) and n >= 0 for n in (padding, row_padding)):
        raise ValueError(f"padding: expected whole numbers of bytes from 0, got {padding!r} and {row_padding!r}.")
    rows = (array.shape[0] if array.ndim == 2 else 1) if height is None else checks.size(height, "height")
    if array.size % rows:
        raise ValueError(f"height: {rows} rows do not divide {array.size} points.")
    columns = array.size // rows
    fields, formats = [], []
    for name in names:
        kind, offset = layout[name][:2]
        base, shape = kind.subdtype or (kind, (1,))
        native = base.newbyteorder("=")
        if native not in _DATATYPE_OF or len(shape) != 1:
            raise ValueError(f"structured_array: ROS has no datatype for field {name!r} of type {kind}.")
        fields.append(PointField(name, offset, _DATATYPE_OF[native], shape[0]))
        ordered = base.newbyteorder(">" if big_endian else "<")
        formats.append((ordered, shape) if kind.subdtype else ordered)
    point_step = array.dtype.itemsize + padding
    wire = np.dtype(
        {
            "names": list(names),
            "formats": formats,
            "offsets": [field.offset for field in fields],
            "itemsize": point_step,
        }
    )
    row_step = columns * point_step + row_padding
    data = np.zeros((rows, row_step), np.uint8)
    points = np.ndarray((rows, columns), wire, data, strides=(row_step, point_step))
    dense = True
    for name in names:
        column = array[name].reshape(points[name].shape)
        points[name] = column
        dense = dense and (column.dtype.kind != "f" or name in ("rgb", "rgba") or bool(np.isfinite(column).all()))
    return PointCloud2(
        rows, columns, tuple(fields), bool(big_endian), point_step, row_step, data.tobytes(), dense, frame_id
    )


def from_message(msg: PointCloud2) -> NDArray[np.void]:
    """Read a PointCloud2 message of any stride, padding and byte order.

    Parameters
    ----------
    msg : the message (or any object with the same attributes, such as ROS's own).

    Returns
    -------
    structured array in this machine's byte order with the message's offsets and point step: (width,) if height is 1,
    else (height, width). It is a copy.

    Raises
    ------
    ValueError
        If the message contradicts itself: bytes missing, steps smaller than what they must hold, fields outside the
        point, unknown datatypes, two fields of one name, no point.
    """
    lacks = [field.name for field in dataclass_fields(PointCloud2)[:-1] if not hasattr(msg, field.name)]
    if lacks:
        raise ValueError(f"message: expected a PointCloud2, but {type(msg).__name__} has no {', '.join(lacks)}.")
    if isinstance(msg.data, (list, tuple)):
        raise ValueError(f"message: data is a {type(msg.data).__name__}; give bytes, as bytes(data) makes of a list.")
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


def message_to_xyz(msg: PointCloud2) -> NDArray[np.floating]:
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
    names = array.dtype.names or ()
    missing = [name for name in "xyz" if name not in names]
    if missing:
        raise ValueError(f"message: no field {', '.join(missing)}; it has {', '.join(names)}.")
    return np.stack([array["x"], array["y"], array["z"]], axis=-1)
