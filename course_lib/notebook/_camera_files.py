"""Intrinsics from the files that calibrations write: JSON, ROS's YAML, or K as text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from course_lib.camera.pinhole import PRESETS, PinholeCamera, camera_from_matrix, preset
from course_lib.notebook._errors import Refusal, shown
from course_lib.notebook._images import there

KINDS = (".json", ".yaml", ".yml", ".txt")
NAMES = ("camera*", "*intrinsic*", "cam_params*", "calibration*", "*_camera", "K")
"""What the file of a folder's camera may be called, before its kind."""
STRAIGHT = ("", "none", "plumb_bob", "brown_conrady", "modified_brown_conrady", "inverse_brown_conrady")
"""Lens models of k1, k2, p1, p2, k3 that lead from the straight to the recorded pixel; librealsense applies the
"inverse" one so, too."""


def find_camera(folder: Path, camera: Any, shape: tuple[int, int]) -> PinholeCamera:
    """The camera of depth images of this shape (height, width).

    Parameters
    ----------
    folder : of the recording: where a file of intrinsics is looked for.
    camera : a PinholeCamera, a matrix K, a preset's name, a file (in the folder, or anywhere), or None.

    Raises
    ------
    Refusal
        If there are none, or they are for images of another size.
    """
    height, width = shape
    if camera is None:
        kinds = [f"{name}{kind}" for name in NAMES for kind in KINDS]
        camera = next((one for pattern in kinds for one in sorted(folder.glob(pattern))), None)
        if camera is None:
            raise Refusal(
                f"{shown(folder)} holds no intrinsics: put camera.json (width, height, fx, fy, cx, cy) beside the "
                "images, or pass camera=, such as a preset's name."
            )
        found = read_camera(camera, shape)
    elif isinstance(camera, Path) or (isinstance(camera, str) and camera.endswith(KINDS)):
        inside = folder / camera
        found = read_camera(there(inside if inside.exists() else camera, KINDS, "a camera file"), shape)
    elif isinstance(camera, (str, PinholeCamera)):
        found = preset(camera) if isinstance(camera, str) else camera
    else:
        found = camera_from_matrix(camera, width, height, source="given by you")
    if isinstance(camera, PinholeCamera):  # it may have been made of shares of the image
        camera_from_matrix(camera.matrix, camera.width, camera.height)
    if (found.height, found.width) != shape:
        raise Refusal(_other_size(found, width, height))
    return found


def _other_size(camera: PinholeCamera, width: int, height: int) -> str:
    start = f"The intrinsics are for {camera.width}x{camera.height} and the depth images are {width}x{height}"
    if camera.width * height == camera.height * width:
        return f"{start}: pass those of {width}x{height}, or camera.scaled(...) if the images were resized."
    known = [name for name, one in PRESETS.items() if (one.width, one.height) == (width, height)]
    near = ", ".join(f"{name!r} (fx {PRESETS[name].fx:.1f}, cx {PRESETS[name].cx:.1f})" for name in known)
    return f"{start}, so this mode is cropped, not resized: pass its own{f', such as {near}' if near else ''}."


def read_camera(path: Path, shape: tuple[int, int] | None = None) -> PinholeCamera:
    """Read intrinsics from a file, and the lens where it names one.

    JSON of plain names (width, height, fx, fy, cx, cy; a RealSense writes ppx, ppy, model, coeffs) or with a matrix
    (Open3D's intrinsic_matrix, column after column; or row after row); a ROS camera_info in YAML; text with K in three
    rows, or fx, fy, cx, cy in one.

    Parameters
    ----------
    shape : (height, width) of the images, for files that do not say.

    Raises
    ------
    Refusal
        If it is none of them, or has a lens of another model.
    """
    try:
        found = _numbers(path) if path.suffix.lower() == ".txt" else _names(path)
        matrix = _first(found, "intrinsic_matrix", "camera_matrix", "K", "k")
        if matrix is None:
            fx, fy = found["fx"], found["fy"]
            cx, cy = _first(found, "cx", "ppx"), _first(found, "cy", "ppy")
            matrix = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]
        height, width = (_first(found, name, f"image_{name}") for name in ("height", "width"))
        if width is None and height is None and shape is not None:
            height, width = shape
        lens = _first(found, "distortion", "distortion_coefficients", "dist_coeffs", "coeffs", "D", "d")
        lens = np.array(lens if lens is not None else [], float).reshape(-1)
        model = str(_first(found, "distortion_model", "model") or "")
        width, height = int(width), int(height)
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, yaml.YAMLError) as error:
        raise Refusal(
            f"{shown(path)} holds no intrinsics that the course reads: give JSON with width, height, fx, fy, cx, cy."
        ) from error
    if lens.any() and model.lower().replace(" ", "_").removeprefix("distortion.") not in STRAIGHT:
        raise Refusal(
            f"{shown(path)} has a lens of the model {model!r}, which is not read: straighten the images first."
        )
    lens = lens if lens.any() else np.zeros(5)
    try:
        return camera_from_matrix(matrix, width, height, distortion=lens, source=f"read from {path.name}")
    except ValueError as error:
        raise Refusal(f"{shown(path)}: {error}") from error


def _first(found: Mapping[str, Any], *names: str) -> Any:
    """What stands under the first of these names; ROS wraps numbers into a table with `data`."""
    value = next((found[name] for name in names if found.get(name) is not None), None)
    return value["data"] if isinstance(value, Mapping) else value


def _names(path: Path) -> Mapping[str, Any]:
    text = path.read_text(encoding="utf-8")
    found = json.loads(text) if path.suffix.lower() == ".json" else yaml.safe_load(text)
    return found.get("intrinsic", found)


def _numbers(path: Path) -> Mapping[str, Any]:
    table = np.loadtxt(path, ndmin=2)
    if table.shape == (1, 4):
        return dict(zip(("fx", "fy", "cx", "cy"), table[0].tolist(), strict=True))
    if table.shape not in ((3, 3), (4, 4)):
        raise ValueError(f"a table of {table.shape}")
    return {"K": table[:3, :3]}
