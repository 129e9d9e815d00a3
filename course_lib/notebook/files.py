"""Reading and writing clouds, meshes and images, so that what comes back is whole or a sentence says why it is not.

Clouds and meshes go through Open3D, images through OpenCV. Every file is measured against its own header before it
is read (Open3D fills up a truncated PLY with whatever was in memory). Files are written whole or not at all.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook._atomic import atomic_file
from course_lib.notebook._errors import CannotWrite, Refusal, shown
from course_lib.notebook._headers import Header, check_pcd, check_ply, check_xyz
from course_lib.notebook._images import read_depth, read_image, there, write_depth, write_image  # noqa: F401 - images, too
from course_lib.surface.meshes import Mesh

if TYPE_CHECKING:
    import open3d

PARTS = ("positions", "colors", "normals", "labels")
CLOUDS = {".ply": check_ply, ".pcd": check_pcd, ".xyz": check_xyz}


def cloud_header(path: str | Path) -> Header:
    """Say what the header of a PLY, PCD or XYZ file promises, having proved that the body holds it.

    Returns
    -------
    Header with `counts` ("vertex", "face"), `fields` and, for an organised PCD, `shape` (height, width).

    Raises
    ------
    Refusal
        If the file is missing, of another kind, or cut short.
    """
    path = there(path, tuple(CLOUDS), "a cloud")
    return CLOUDS[path.suffix.lower()](path)


def read_cloud(path: str | Path) -> PointCloud:
    """Read a point cloud from a PLY, PCD or XYZ file.

    Returns
    -------
    PointCloud of as many points as the header promises, missing ones (NaN) included; colours and normals where stored.

    Raises
    ------
    Refusal
        If the file is missing, cut short, not what its name says, or holds no points.
    """
    header = cloud_header(path)
    count = header.counts.get("vertex", 0)
    if count == 0:
        raise Refusal(f"{shown(path)} holds no points: check how it was saved.")
    o3d, quiet = _open3d()
    with quiet:
        cloud = o3d.t.io.read_point_cloud(str(path), remove_nan_points=False, remove_infinite_points=False)
    # Copies: an array that shares Open3D's memory makes it print its statistics when Python ends.
    parts = {name: cloud.point[name].numpy().copy() for name in PARTS if name in cloud.point}
    points = parts.get("positions", np.zeros((0, 3)))
    if len(points) != count:
        raise Refusal(f"{shown(path)} promises {count:,} points and Open3D read {len(points):,}: save it again.")
    colors, labels = parts.get("colors"), parts.get("labels")
    if colors is not None and colors.dtype != np.uint8:
        colors = np.round(np.clip(colors, 0, 1) * 255).astype(np.uint8)
    labels = None if labels is None else labels.reshape(-1)
    return PointCloud(points, colors=colors, normals=parts.get("normals"), labels=labels)


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
    shape = cloud_header(path).shape
    if shape is None:
        raise Refusal(f"{shown(path)} is not organised (its header gives no rows and columns): use read_cloud.")
    cloud = read_cloud(path)
    colors = None if cloud.colors is None else cloud.colors.reshape(*shape, 3)
    return cloud.points.reshape(*shape, 3), colors


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
        _prove(partial, path, done, {"vertex": len(cloud.points)})
    return path


def read_mesh(path: str | Path) -> Mesh:
    """Read a triangle mesh from a PLY file; polygons are split into triangles.

    Raises
    ------
    Refusal
        If the file is missing, cut short, not a PLY, or holds points only.
    """
    path = there(path, (".ply",), "a mesh")
    counts = check_ply(path).counts
    if not counts.get("face"):
        raise Refusal(f"{shown(path)} holds points and no faces: read it with read_cloud.")
    o3d, quiet = _open3d()
    with quiet:
        mesh = o3d.io.read_triangle_mesh(str(path))
    vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    if len(vertices) != counts.get("vertex", 0) or len(triangles) < counts["face"]:
        raise Refusal(
            f"{shown(path)} promises {counts.get('vertex', 0):,} vertices and {counts['face']:,} faces and Open3D read "
            f"{len(vertices):,} and {len(triangles):,}: save it again."
        )
    colors = np.round(np.asarray(mesh.vertex_colors) * 255).astype(np.uint8) if mesh.has_vertex_colors() else None
    normals = np.asarray(mesh.vertex_normals).copy() if mesh.has_vertex_normals() else None
    return Mesh(vertices.copy(), triangles.astype(np.int32), colors=colors, normals=normals)


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
        _prove(partial, path, done, {"vertex": len(mesh.vertices), "face": len(mesh.triangles)})
    return path


def _prove(partial: Path, path: Path, done: bool, wanted: dict[str, int]) -> None:
    """Read back the counts of what was written: a full disk does not make Open3D fail."""
    try:
        counts = CLOUDS[path.suffix.lower()](partial).counts if done and partial.stat().st_size else {}
    except Refusal:
        counts = {}
    if any(counts.get(name) != count for name, count in wanted.items()):
        raise CannotWrite(f"{shown(path)} was not written whole and was removed: is the disk full?")


def _open3d() -> tuple[open3d, object]:
    """Import Open3D, and give a block in which it prints errors only."""
    import open3d as o3d

    return o3d, o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error)
