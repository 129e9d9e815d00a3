"""Point clouds as plain arrays.

Points are metres; colours RGB uint8. An *organised* cloud keeps the rows and columns of the image it came from, with
NaN where nothing was measured; an unorganised one is a list. How PCL lays points out in memory is told in
`course_lib.cloud.point_types`, how ROS sends them in `course_lib.cloud.messages`; both are here too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.camera import pinhole, rgbd
from course_lib.checks import FloatArray
from course_lib.cloud.messages import PointCloud2, PointField, from_message, message_to_xyz, to_message
from course_lib.cloud.point_types import POINT_TYPES, pack_rgb, point_type, unpack_rgb
from course_lib.geometry import transforms

__all__ = [
    "POINT_TYPES", "PointCloud", "PointCloud2", "PointField", "drop_nan", "from_frame", "from_message",
    "message_to_xyz", "pack_rgb", "point_type", "to_message", "unpack_rgb",
]  # fmt: skip


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
                raise ValueError(f"labels: expected {len(points)} integers, got {labels.dtype}, {labels.shape}.")
            object.__setattr__(self, "labels", labels)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        has = [name for name in ("colors", "normals", "labels") if getattr(self, name) is not None]
        return f"PointCloud({len(self)} points{', with ' + ', '.join(has) if has else ''})"

    def select(self, index: ArrayLike) -> PointCloud:
        """Return the cloud of the chosen points: (N,) bool mask, or integer indices; ValueError where that is none."""
        index = np.asarray(index)
        mask = index.dtype == bool and index.shape == (len(self),)
        if not mask and (index.dtype.kind not in "iu" or index.ndim != 1 or not (np.abs(index) < len(self)).all()):
            raise ValueError(
                f"select: expected a mask of {len(self)} booleans or a list of indices below {len(self)}, "
                f"got {index.dtype} of shape {index.shape}."
            )
        rest = {
            name: None if values is None else values[index]
            for name, values in ((n, getattr(self, n)) for n in ("colors", "normals", "labels"))
        }
        return replace(self, points=self.points[index], **rest)


def _cloud(cloud: PointCloud | ArrayLike) -> PointCloud:
    return cloud if isinstance(cloud, PointCloud) else PointCloud(checks.cloud_points(cloud))


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
    points: FloatArray = pinhole.deproject_compact(frame.depth, frame.camera)
    if world:
        if frame.T_world_camera is None:
            raise ValueError("frame: its pose T_world_camera is unknown, so its points have no place in the world.")
        points = transforms.apply(frame.T_world_camera, points)
    return PointCloud(points, frame.color[rgbd.valid_mask(frame.depth)] if frame.registered else None)
