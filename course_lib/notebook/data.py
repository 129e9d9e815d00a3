"""The only way to data: `data.load("living_room")`.

Synthetic datasets are made on first use and carry their truth. Real ones are captured; they are never downloaded by
`load`: `python3 course.py data get NAME` fetches them, or COURSE_DATA_MIRROR names a folder that holds them. A
learner's own recordings come in through `from_folder`, in the same types. Lengths are metres and depth is z.

Environment
-----------
COURSE_CACHE : where made and fetched data go, instead of datasets/cache.
COURSE_DATA_MIRROR : a folder (USB stick, lab share) with the real files, looked through first.
COURSE_QUIET : 1 = print nothing while data are made.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from course_lib.camera.pinhole import PinholeCamera
from course_lib.camera.rgbd import find_encoding
from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook import _cache, _catalog, _real, _stored
from course_lib.notebook._dataset import Dataset, Lazy, Parts, described, with_frames
from course_lib.notebook._errors import CannotWrite, DataDamaged, DataMissing, NotHere, Refusal  # noqa: F401 - to catch
from course_lib.notebook._folder import from_folder  # noqa: F401 - a way to data, too
from course_lib.surface.meshes import Mesh


def names() -> list[str]:
    """The names of all datasets of the catalogue."""
    return list(_catalog.catalogue())


def load(name: str, *, seed: int | None = None) -> Dataset:
    """Load a dataset by name.

    A synthetic dataset that is not there yet is made (seconds; the next time it is read from the cache). Every file is
    proved by its sha256 once in a process. Images and clouds are decoded when they are asked for.

    Parameters
    ----------
    name : one of `names()`.
    seed : of a synthetic dataset: another world by the same recipe; None for the published one.

    Raises
    ------
    Refusal
        If there is no such dataset (the nearest is suggested), or a seed is given for a real one.
    DataMissing
        If it is real and not on this machine; the message holds the command that fetches it.
    DataDamaged
        If a real file's bytes are wrong; the message names the file.
    CannotWrite
        If a synthetic dataset has to be made and the disk is full or read-only.
    """
    entry = _catalog.entry(name)
    if entry.kind == "synthetic":
        return _synthetic(entry, *_cache.make(entry, seed))
    if seed is not None:
        raise Refusal(f"{name} was captured, so it has no seed: leave seed out.")
    return _real.load(entry)


def available(name: str) -> bool:
    """Can this dataset be loaded here without fetching anything? Synthetic: always; real: if its files are there.

    Raises
    ------
    Refusal
        If there is no dataset of that name.
    """
    entry = _catalog.entry(name)
    return entry.kind == "synthetic" or not _real.missing(entry)


def prepare(names: str | Iterable[str]) -> None:
    """Make the synthetic ones of these datasets now, so that nothing is made, and no bar shown, while a notebook runs.

    Raises
    ------
    Refusal
        If a name is unknown or a dataset cannot be written.
    """
    for name in [names] if isinstance(names, str) else names:
        entry = _catalog.entry(name)
        if entry.kind == "synthetic":
            _cache.make(entry)


class Card(str):
    """The card of a dataset: Markdown in a notebook, plain text elsewhere."""

    __repr__ = _repr_markdown_ = str.__str__


def of_lab(number: str) -> dict[str, np.ndarray]:
    """The arrays that a lab's pictures are drawn from, by name: data.of_lab("04").

    Raises
    ------
    Refusal
        If there is no such lab, or its pictures are drawn from none.
    """
    from course_lib.tasks import registry

    drawn = registry.pictures(number)
    if not drawn:
        raise Refusal(f"There are no arrays of a lab {number!r}.")
    return drawn


def describe(name: str) -> Card:
    """Return the card of a dataset: what it is, how it was captured, what it is good for, what to watch out for.

    Raises
    ------
    Refusal
        If there is no dataset of that name, or its card is missing.
    """
    entry = _catalog.entry(name)
    if not entry.card_path.is_file():
        raise Refusal(f"The card datasets/{name}.md is missing from this copy of the course: get it with git checkout.")
    return Card(entry.card_path.read_text(encoding="utf-8"))


def _synthetic(entry: _catalog.Entry, folder: Path, manifest: Mapping[str, Any]) -> Dataset:
    """Put a made dataset together from its folder; nothing but the poses is read yet."""

    def arrays(name: str) -> dict[str, np.ndarray]:
        return _stored.read(folder / name)

    def mesh(name: str) -> Mesh:
        stored = arrays(name)
        return Mesh(**{part: stored[part] for part in ("vertices", "triangles", "colors", "normals") if part in stored})

    def cloud(name: str) -> PointCloud:
        return PointCloud(**arrays(name))

    stored = manifest["frames"]
    form = find_encoding(manifest["encoding"]) if stored else None
    given = manifest["camera"]
    camera = PinholeCamera(**{**given, "distortion": tuple(given.get("distortion", (0.0,) * 5))}) if given else None
    poses = arrays(manifest["poses"])["poses"]

    def part(name: str, index: int) -> np.ndarray:
        values = _stored.read(folder / stored[index][name])
        return values["array"] if isinstance(values, dict) else values

    def images(name: str) -> Lazy:
        return Lazy(len(stored), lambda index: part(name, index), f"{name} images")

    def raw(index: int) -> tuple[np.ndarray, np.ndarray]:
        return part("color", index), part("depth_raw", index)

    per_frame = [name for name in (stored[0] if stored else {}) if name not in ("color", "depth_raw")]
    truth = {
        **{name.removesuffix("_truth"): lambda n=name: images(n) for name in per_frame},
        **({"poses": lambda: list(poses)} if len(poses) else {}),
        **({"camera": lambda: camera} if camera else {}),
        **{name: lambda n=one["file"]: mesh(n) for name, one in manifest["meshes"].items()},
        **{
            f"{name}_labels": lambda n=one["file"]: arrays(n)["labels"]
            for name, one in manifest["meshes"].items()
            if "labels" in one["arrays"]
        },
        **{name: lambda n=name, f=file: arrays(f)[n] for name, file in manifest["truth"].items()},
        **{name: lambda v=value: list(v) for name, value in manifest["meta"].items() if name.endswith("_names")},
    }
    clouds = {name: lambda f=file: cloud(f) for name, file in manifest["clouds"].items()}
    meshes = {name: lambda f=one["file"]: mesh(f) for name, one in manifest["meshes"].items()}
    base = described(entry, manifest["meta"], {name: folder / name for name in manifest["files"]})
    return with_frames(
        base,
        [f"{entry.name} {index:03d}" for index in range(len(stored))],
        raw,
        form,
        camera,
        poses=poses if len(poses) else None,
        clouds=Parts(clouds, f"the clouds of {entry.name}"),
        meshes=Parts(meshes, f"the meshes of {entry.name}"),
        truth=Parts(truth, f"the truth of {entry.name}"),
    )
