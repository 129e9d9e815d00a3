"""Drawing with PyVista, off-screen; and finding out, without risk, whether this machine can.

A machine without the OpenGL libraries does not raise an error: VTK ends the whole process. So the first picture on a
machine is tried in a subprocess, and the answer is remembered in the user's cache folder for as long as VTK, the
libraries and the environment stay the same. `COURSE_RENDER=pyvista` or `matplotlib` decides without a trial.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import subprocess
import sys
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from course_lib.notebook._scene import Layer
from course_lib.notebook._views import View

PROBE_SECONDS = 90
_TRIAL = """
import course_lib
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="black")
image = plotter.screenshot(return_img=True)
raise SystemExit(0 if image.min() < 128 < image.max() else 3)
"""
_ENVIRONMENT = ("DISPLAY", "WAYLAND_DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW", "LIBGL_ALWAYS_SOFTWARE", "LD_LIBRARY_PATH")
_LIBRARIES = ("libEGL.so.1", "libGL.so.1")


@lru_cache(maxsize=1)
def rendering() -> tuple[str, str]:
    """Return which renderer draws, "pyvista" or "matplotlib", and why.

    Raises
    ------
    ValueError
        If COURSE_RENDER is neither.
    """
    forced = os.environ.get("COURSE_RENDER", "")
    if forced:
        if forced not in ("pyvista", "matplotlib"):
            raise ValueError(f"COURSE_RENDER is {forced!r}: set it to 'pyvista' or 'matplotlib', or leave it unset.")
        return forced, "COURSE_RENDER says so"
    missing = missing_libraries()
    if missing:
        return "matplotlib", f"{' and '.join(missing)} not found"
    note = _cache_file()
    known = _read(note)
    if known is None:
        known, certain = _probe()
        if certain:
            _write(note, known)
    return known


def missing_libraries() -> list[str]:
    """Name the OpenGL libraries that VTK needs on Linux and this machine lacks."""
    if not sys.platform.startswith("linux"):
        return []
    return [name for name in _LIBRARIES if not _loads(name)]


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _probe() -> tuple[tuple[str, str], bool]:
    """Draw a sphere in a subprocess. Return the answer, and whether it is certain enough to remember."""
    home = Path(__file__).resolve().parents[2]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(home), os.environ.get("PYTHONPATH", "")])}
    try:
        run = subprocess.run(
            [sys.executable, "-c", _TRIAL], env=environment, capture_output=True, timeout=PROBE_SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return ("matplotlib", f"a trial picture took more than {PROBE_SECONDS} s"), False
    if run.returncode == 0:
        return ("pyvista", "a trial picture was drawn"), True
    return ("matplotlib", f"a trial picture failed with code {run.returncode}"), True


def _cache_file() -> Path:
    from platformdirs import user_cache_path

    state = [
        sys.executable,
        sys.version,
        version("vtk"),
        version("pyvista"),
        *(os.environ.get(n, "") for n in _ENVIRONMENT),
    ]
    key = hashlib.sha256(json.dumps(state).encode()).hexdigest()[:16]
    return user_cache_path("course-3d-reconstruction") / f"rendering-{key}.json"


def _read(note: Path) -> tuple[str, str] | None:
    try:
        found = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):  # no note yet, or a half-written one: probe again
        return None
    return (found["renderer"], found["reason"]) if {"renderer", "reason"} <= set(found) else None


def _write(note: Path, known: tuple[str, str]) -> None:
    """Remember; where the cache folder cannot be written, the next session probes again."""
    draft = note.with_suffix(f".{os.getpid()}")
    try:
        note.parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(json.dumps({"renderer": known[0], "reason": known[1]}), encoding="utf-8")
        draft.replace(note)
    except OSError:
        return


def draw(layers: tuple[Layer, ...], views: list[View], point_size: float, cull: bool = False) -> list[np.ndarray]:
    """Draw the same layers from each view: a list of (height, width, 3) uint8 on white."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=(views[0].width, views[0].height), lighting="light kit")
    plotter.set_background("white")
    for layer in layers:
        if layer.kind == "mesh":
            surface = pyvista.PolyData.from_regular_faces(layer.points, layer.triangles)
            surface.point_data["rgb"] = layer.rgb
            plotter.add_mesh(surface, scalars="rgb", rgb=True, ambient=0.25, culling="back" if cull else None)
        elif layer.kind == "trajectory":
            path = pyvista.PolyData(layer.points, lines=np.insert(layer.segments, 0, 2, axis=1).ravel())
            path.point_data["rgb"] = layer.rgb
            plotter.add_mesh(path, scalars="rgb", rgb=True, line_width=3, lighting=False)
        else:
            cloud = pyvista.PolyData(layer.points)
            cloud.point_data["rgb"] = layer.rgb
            plotter.add_mesh(
                cloud,
                scalars="rgb",
                rgb=True,
                style="points",
                point_size=point_size,
                lighting=False,
                render_points_as_spheres=True,
            )
    clouds = [layer for layer in layers if layer.kind == "cloud"]
    shaded = bool(clouds) and all(layer.classes for layer in clouds)
    images = []
    for view in views:
        clipping = _aim(plotter, view, layers)
        plotter.render()
        image = np.array(plotter.screenshot(return_img=True))[..., :3]
        images.append(_shade(image, _depths(plotter, view, clipping)) if shaded else image)
    plotter.close()
    return images


def _depths(plotter, view: View, clipping: tuple[float, float]) -> np.ndarray:
    """Read the depth buffer as (height, width) metres along the view, infinite where nothing was drawn."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkFloatArray

    buffer = vtkFloatArray()
    plotter.render_window.GetZbufferData(0, 0, view.width - 1, view.height - 1, buffer)
    share = vtk_to_numpy(buffer).reshape(view.height, view.width)[::-1].astype(np.float64)
    near, far = clipping
    depth = near + share * (far - near) if view.eye is None else near * far / (far - share * (far - near))
    return np.where(share < 1, depth, np.inf)


def _shade(image: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Darken what lies behind its neighbours, never by more than half, so that a cloud of one colour has a shape.

    References
    ----------
    Boucheny, Interactive scientific visualization of large datasets, 2009 (eye-dome lighting).
    """
    drawn = np.isfinite(depth)
    if not drawn.any():
        return image
    low, high = np.percentile(depth[drawn], [2, 98])
    height = np.where(drawn, depth, np.nan) / max(high - low, 1e-9)
    behind = np.zeros_like(height)
    for step in (2, 5):
        for shift, axis in ((step, 0), (-step, 0), (step, 1), (-step, 1)):
            behind += np.nan_to_num(np.clip(height - np.roll(height, shift, axis), 0, 0.05))
    shade = 0.5 + 0.5 * np.exp(-12.0 * behind)
    return np.where(drawn[..., None], image * shade[..., None], image).round().astype(np.uint8)


def _aim(plotter, view: View, layers: tuple[Layer, ...]) -> tuple[float, float]:
    depths = np.concatenate([(layer.points - view.centre) @ view.forward for layer in layers])
    size = float(depths.max() - depths.min()) or 1.0
    camera = plotter.camera
    if view.eye is None:
        camera.parallel_projection = True
        camera.parallel_scale = view.scale * view.height / 2
        distance = -float(depths.min()) + size
        camera.position = view.centre - view.forward * distance
    else:
        camera.parallel_projection = False
        camera.view_angle = float(np.degrees(2 * np.arctan(view.scale)))
        camera.position = view.eye
        distance = float((view.centre - view.eye) @ view.forward)
    camera.focal_point = view.centre
    camera.up = view.up
    near, far = distance + float(depths.min()), distance + float(depths.max())
    camera.clipping_range = (max(near - 0.01 * size, 1e-3 * far), far + 0.01 * size)
    return camera.clipping_range
