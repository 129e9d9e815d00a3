"""Reading and writing clouds, meshes and images, so that what comes back is whole or a sentence says why it is not.

Clouds and meshes are read here, column by column as their headers say (a parser that trusts a header invents what is
not there), and written by Open3D; images go through OpenCV. Files are written whole or not at all.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook._atomic import atomic_file
from course_lib.notebook._columns import Stored, cloud_of
from course_lib.notebook._errors import CannotWrite, Refusal, shown
from course_lib.notebook._images import read_depth, read_image, there, write_depth, write_image  # noqa: F401 - images, too
from course_lib.notebook._pcd import read_pcd
from course_lib.notebook._ply import read_ply
from course_lib.notebook._xyz import read_xyz
from course_lib.surface.meshes import Mesh
from course_lib.surface.polygons import triangulate

if TYPE_CHECKING:
    import open3d

CLOUDS = {".ply": read_ply, ".pcd": read_pcd, ".xyz": read_xyz}


def _stored(path: str | Path) -> Stored:
    path = there(path, tuple(CLOUDS), "a cloud")
    return CLOUDS[path.suffix.lower()](path)


def read_cloud(path: str | Path) -> PointCloud:
    """Read a point cloud from a PLY, PCD or XYZ file.

    Returns
    -------
    PointCloud of as many points as the header promises, missing ones (NaN) included; colours, normals and labels where
    stored. Other fields (intensity, curvature) are left.

    Raises
    ------
    Refusal
        If the file is missing, cut short, not what its name says, holds no points, or fields that cannot be theirs.
    """
    return cloud_of(_stored(path))


def read_organised(path: str | Path) -> tuple[np.ndarray, np.ndarray | None]:
    """Read an organised PCD: a cloud that kept the rows and columns of its camera.

    Returns
    -------
    points : (H, W, 3) float32, metres; NaN where nothing was measured.
    colors : (H, W, 3) uint8 RGB, or None.

    Raises
    ------
    Refusal
        If the file is not a PCD with a height above 1.
    """
    stored = _stored(path)
    if stored.shape is None:
        raise Refusal(f"{shown(path)} is not organised (its header gives no rows and columns): use read_cloud.")
    cloud = cloud_of(stored)
    colors = None if cloud.colors is None else cloud.colors.reshape(*stored.shape, 3)
    return cloud.points.reshape(*stored.shape, 3), colors


def write_cloud(path: str | Path, cloud: PointCloud, *, ascii: bool = False) -> Path:
    """Write a cloud to a PLY, PCD or XYZ file (XYZ keeps the points only), whole or not at all.

    Parameters
    ----------
    path : its ending chooses the format.
    cloud : points in metres, with whatever colours, normals and labels it has.
    ascii : write numbers as text, to look at the file from the inside.

    Raises
    ------
    Refusal
        If the ending is unknown or the cloud is empty.
    CannotWrite
        If the disk is full or the folder is read-only.
    """
    path = Path(path)
    if path.suffix.lower() not in CLOUDS:
        raise Refusal(f"{shown(path)} cannot hold a cloud: end the name in {', '.join(CLOUDS)}.")
    if len(cloud.points) == 0:
        raise Refusal(f"The cloud is empty, so {shown(path)} was not written: check the step that removed its points.")
    o3d, quiet = _open3d()
    tensor = o3d.t.geometry.PointCloud(np.ascontiguousarray(cloud.points))
    for name, values in (("colors", cloud.colors), ("normals", cloud.normals), ("labels", cloud.labels)):
        if values is not None:
            values = np.ascontiguousarray(values.reshape(len(cloud.points), -1))
            tensor.point[name] = o3d.core.Tensor(values.astype(np.int32) if name == "labels" else values)
    size = sum(v.nbytes for v in (cloud.points, cloud.colors, cloud.normals, cloud.labels) if v is not None)
    with atomic_file(path, size * (4 if ascii or path.suffix.lower() == ".xyz" else 1)) as partial, quiet:
        if path.suffix.lower() == ".xyz":  # the tensor writer of XYZ takes float32 only
            done = o3d.io.write_point_cloud(str(partial), tensor.to_legacy())
        else:
            done = o3d.t.io.write_point_cloud(str(partial), tensor, write_ascii=ascii)
        _prove(partial, path, done, len(cloud.points))
    return path


def read_mesh(path: str | Path) -> Mesh:
    """Read a triangle mesh from a PLY file; polygons are split into triangles.

    Raises
    ------
    Refusal
        If the file is missing, cut short, not a PLY, or holds points only.
    """
    stored = read_ply(there(path, (".ply",), "a mesh"))
    if not stored.faces:
        raise Refusal(f"{shown(path)} holds points and no faces: read it with read_cloud.")
    if min(stored.faces) < 3:
        raise Refusal(f"{shown(path)} holds a face of {min(stored.faces)} corners: a face has three at least.")
    cloud = cloud_of(stored)
    for corners in stored.faces.values():
        if (wrong := corners[(corners < 0) | (corners >= len(cloud))]).size:
            raise Refusal(f"{shown(path)} holds a face with corner {wrong[0]} and has {len(cloud):,} vertices.")
    if not np.isfinite(cloud.points).all():
        raise Refusal(f"{shown(path)} holds a vertex that is NaN or infinite: a mesh needs finite vertices.")
    triangles = [triangulate(cloud.points, corners) for corners in stored.faces.values()]
    vertices, normals = cloud.points.astype(np.float64), cloud.normals
    normals = None if normals is None else normals.astype(np.float64)
    return Mesh(vertices, np.concatenate(triangles).astype(np.int32), colors=cloud.colors, normals=normals)


def write_mesh(path: str | Path, mesh: Mesh, *, ascii: bool = False) -> Path:
    """Write a mesh to a PLY file, whole or not at all.

    Raises
    ------
    Refusal
        If the name does not end in .ply, or the mesh has no triangles.
    CannotWrite
        If the disk is full or the folder is read-only.
    """
    path = Path(path)
    if path.suffix.lower() != ".ply":
        raise Refusal(f"{shown(path)} cannot hold a mesh: end the name in .ply.")
    if len(mesh.triangles) == 0:
        raise Refusal(f"The mesh has no triangles, so {shown(path)} was not written: check how it was made.")
    o3d, quiet = _open3d()
    legacy = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices.astype(np.float64)), o3d.utility.Vector3iVector(mesh.triangles)
    )
    if mesh.colors is not None:
        legacy.vertex_colors = o3d.utility.Vector3dVector(mesh.colors / 255.0)
    if mesh.normals is not None:
        legacy.vertex_normals = o3d.utility.Vector3dVector(mesh.normals.astype(np.float64))
    size = len(mesh.vertices) * (24 + 3 * (mesh.colors is not None) + 24 * (mesh.normals is not None))
    size += len(mesh.triangles) * 13
    with atomic_file(path, size * (4 if ascii else 1)) as partial, quiet:
        done = o3d.io.write_triangle_mesh(str(partial), legacy, write_ascii=ascii)
        _prove(partial, path, done, len(mesh.vertices), len(mesh.triangles))
    return path


def _prove(partial: Path, path: Path, done: bool, points: int, faces: int = 0) -> None:
    """Read back what was written: a full disk does not make Open3D fail."""
    try:
        stored = CLOUDS[path.suffix.lower()](partial) if done else None
    except Refusal:
        stored = None
    counts = (stored.count, sum(map(len, (stored.faces or {}).values()))) if stored else ()
    if counts != (points, faces):
        raise CannotWrite(f"{shown(path)} was not written whole and was removed: is the disk full?")


def _open3d() -> tuple[open3d, object]:
    """Import Open3D, and give a block in which it prints errors only."""
    import open3d as o3d

    return o3d, o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error)
