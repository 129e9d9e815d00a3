"""The library of the course, a tower of rooms: each imports only from those below it (tests/house/test_floors.py).

Importing it sets two defaults that must stand before Open3D or VTK is imported, so that a kernel prints nothing of its
own and a machine without a display does not warn (both can be overridden from outside).
"""

import importlib.abc
import os
import sys

os.environ.setdefault("OPEN3D_DISABLE_WEB_VISUALIZER", "true")
if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

MOVED = {
    "transforms": "geometry.transforms",
    "rotations": "geometry.rotations",
    "cameras": "camera.pinhole",
    "intrinsics": "camera.intrinsics",
    "distortion": "camera.distortion",
    "camera_presets": "camera.presets",
    "rgbd": "camera.rgbd",
    "depth_encodings": "camera.depth_encodings",
    "depth_filters": "camera.depth_filters",
    "depth_alignment": "camera.depth_alignment",
    "pointcloud": "cloud.pointcloud",
    "point_types": "cloud.point_types",
    "messages": "cloud.messages",
    "neighbours": "cloud.neighbours",
    "downsample": "cloud.downsample",
    "normals": "cloud.normals",
    "outliers": "cloud.outliers",
    "clusters": "cloud.clusters",
    "planes": "cloud.planes",
    "floors": "cloud.floors",
    "meshes": "surface.meshes",
    "metrics": "surface.metrics",
    "partners": "registration.correspondences",
    "robust": "registration.robust",
    "tasks.desk_05": "tasks.labs.lab_05_outliers.cleaning",
    "tasks.scans_07": "tasks.labs.lab_07_icp.two_scans",
}
"""Where a module is now that lessons and labs of earlier versions import by another name."""


def _moved(name: str) -> ImportError:
    return ImportError(
        f"course_lib.{name} is now course_lib.{MOVED[name]}: this copy is of an earlier version of the course. "
        "`python3 course.py reset LAB` puts a fresh copy beside it."
    )


def __getattr__(name: str) -> object:
    if name in MOVED:
        raise _moved(name)
    raise AttributeError(f"module 'course_lib' has no attribute {name!r}")


class _Moved(importlib.abc.MetaPathFinder):
    """Answers where nothing else does: the import of a module that has moved says where it is now."""

    def find_spec(self, fullname: str, path: object, target: object = None) -> None:
        package, _, name = fullname.partition(".")
        if package == "course_lib" and name in MOVED:
            raise _moved(name)


sys.meta_path.append(_Moved())
