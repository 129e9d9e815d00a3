"""Finding out, without risk, whether this machine can draw with PyVista.

A machine without OpenGL does not raise an error: VTK ends the whole process. So the first picture on a machine is tried
in a subprocess. A success is remembered in the user's cache folder for as long as the machine, VTK and the environment
stay the same, and costs nothing from then on; a failure is tried again in the next session, so that a mended machine is
noticed.
`COURSE_RENDER=pyvista` or `matplotlib` decides without a trial.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import json
import os
import platform
import subprocess
import sys
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

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
    note = note_file()
    if note.exists():
        return "pyvista", "a trial picture was drawn before"
    failure = probe()
    if failure:
        return "matplotlib", failure
    with contextlib.suppress(OSError):  # where the cache folder cannot be written, the next session tries again
        note.parent.mkdir(parents=True, exist_ok=True)
        note.touch()
    return "pyvista", "a trial picture was drawn"


def missing_libraries() -> list[str]:
    """Name the OpenGL libraries that VTK needs on Linux and this machine lacks."""
    missing = []
    for name in _LIBRARIES if sys.platform.startswith("linux") else ():
        try:
            ctypes.CDLL(name)
        except OSError:
            missing.append(name)
    return missing


def probe(seconds: float = PROBE_SECONDS) -> str:
    """Draw a sphere in a subprocess. Return what went wrong, or nothing."""
    home = Path(__file__).resolve().parents[2]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(home), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-P", "-c", _TRIAL]
    try:
        run = subprocess.run(command, env=environment, capture_output=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return f"a trial picture took more than {seconds:g} s"
    return f"a trial picture failed with code {run.returncode}" if run.returncode else ""


def note_file() -> Path:
    """Return where a successful trial on this machine, with this VTK and environment, is remembered."""
    from platformdirs import user_cache_path

    state = [platform.node(), sys.executable, version("vtk"), version("pyvista")]
    state += [os.environ.get(name, "") for name in _ENVIRONMENT]
    key = hashlib.sha256(json.dumps(state).encode()).hexdigest()[:16]
    return user_cache_path("course-3d-reconstruction") / f"rendering-{key}"
