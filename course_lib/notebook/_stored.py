"""How a recipe's output lies on disk: PNG files (8-bit colour and labels, 16-bit depth), NPZ files, and a manifest."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from course_lib.notebook._errors import DataDamaged, Refusal
from course_lib.notebook._images import decode

if TYPE_CHECKING:
    from course_lib.simulate.recipes.recipe import RecipeOutput

MANIFEST = "manifest.json"


def sha256(path: Path) -> str:
    """Hash a file's content."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


_proved: dict[Path, tuple[int, int, str]] = {}


def is_whole(path: Path, wanted: str) -> bool:
    """Has a file this sha256? Hashed once in a process, until its size or time changes."""
    stat = path.stat()
    stamp = (stat.st_size, stat.st_mtime_ns, wanted)
    if _proved.get(path) != stamp:
        if sha256(path) != wanted:
            return False
        _proved[path] = stamp
    return True


def write(folder: Path, output: RecipeOutput, about: dict[str, Any]) -> dict[str, Any]:
    """Store a recipe's output in an empty folder, and return its manifest, which begins with `about`.

    Raises
    ------
    OSError
        If the disk is full; the caller clears the folder away.
    """
    files: dict[str, dict[str, Any]] = {}

    def store(name: str, content: bytes) -> str:
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
        files[name] = {"sha256": hashlib.sha256(content).hexdigest(), "size": len(content)}
        return name

    frames = [
        {part: store(f"frames/{number:03d}_{part}{_suffix(array)}", _encode(array)) for part, array in frame.items()}
        for number, frame in enumerate(output.frames)
    ]
    manifest = {
        **about,
        "made_with": {package: version(package) for package in ("numpy", "opencv-python-headless")},
        "encoding": output.encoding,
        "camera": output.camera,
        "meta": output.meta,
        "frames": frames,
        "poses": store("poses.npz", _pack({"poses": output.poses})),
        "meshes": {
            name: {"file": store(f"mesh_{name}.npz", _pack(parts)), "arrays": list(parts)}
            for name, parts in output.meshes.items()
        },
        "clouds": {name: store(f"cloud_{name}.npz", _pack(parts)) for name, parts in output.clouds.items()},
        "truth": {name: store(f"truth_{name}.npz", _pack({name: array})) for name, array in output.truth.items()},
        "files": files,
    }
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1, default=_plain), encoding="utf-8")
    return json.loads((folder / MANIFEST).read_text(encoding="utf-8"))


def _suffix(array: np.ndarray) -> str:
    return ".png" if array.dtype in (np.uint8, np.uint16) and array.ndim in (2, 3) else ".npz"


def _encode(array: np.ndarray) -> bytes:
    if _suffix(array) == ".npz":
        return _pack({"array": array}, np.savez)  # compressing true depth saves a fifth and takes seconds
    image = array[..., ::-1] if array.ndim == 3 else array
    done, content = cv2.imencode(".png", np.ascontiguousarray(image), [cv2.IMWRITE_PNG_COMPRESSION, 2])
    if not done:
        raise Refusal(f"An image of shape {array.shape} cannot be stored as PNG: mend the recipe.")
    return content.tobytes()


def _pack(arrays: dict[str, np.ndarray], save: Callable[..., None] = np.savez_compressed) -> bytes:
    buffer = io.BytesIO()
    save(buffer, **arrays)
    return buffer.getvalue()


def _plain(value: object) -> object:
    """Turn NumPy numbers and arrays of a recipe's facts into JSON."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be stored in a manifest")


def read(path: Path) -> Any:
    """Read one stored file: an image as RGB or as it is, or the arrays of an NPZ as a dict.

    Raises
    ------
    DataDamaged
        If it went away or changed after it was proved.
    """
    try:
        content = path.read_bytes()
        if path.suffix == ".png":
            image = decode(content, path)
            return np.ascontiguousarray(image[..., ::-1]) if image.ndim == 3 else image
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            return dict(stored)
    except (OSError, ValueError, KeyError) as error:
        what = f"{path.parent.name}/{path.name} changed while it was in use"
        raise DataDamaged(f"{what}: load the dataset again.") from error
