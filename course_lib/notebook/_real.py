"""Real datasets: finding and proving their files, and reading each into a Dataset."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from course_lib.camera.pinhole import PinholeCamera, preset
from course_lib.camera.rgbd import find_encoding
from course_lib.notebook import _places, _poses, _stored, files
from course_lib.notebook._camera_files import read_camera
from course_lib.notebook._catalog import Entry, RemoteFile
from course_lib.notebook._dataset import Dataset, Parts, described, raw_of, with_frames
from course_lib.notebook._errors import DataDamaged, DataMissing


def places(one: RemoteFile) -> list[Path]:
    """Where a file may lie: below the mirror, then below real/ of each cache."""
    mirror = _places.mirror()
    roots = ([mirror] if mirror else []) + [root / "real" for root in _places.cache_roots()]
    return [root / one.path for root in roots]


def missing(entry: Entry) -> list[RemoteFile]:
    """The files of a real dataset that are nowhere on this machine."""
    return [one for one in entry.files if not any(path.is_file() for path in places(one))]


def is_whole(path: Path, one: RemoteFile) -> bool:
    """Has the file the size and sha256 of the catalogue?"""
    return path.stat().st_size == one.size and _stored.is_whole(path, one.sha256)


def locate(entry: Entry) -> dict[str, Path]:
    """Find and prove every file of a real dataset.

    Raises
    ------
    DataMissing
        If a file is nowhere; the message holds the command that fetches it.
    DataDamaged
        If a file is there but nowhere whole; the message names it.
    """
    absent = missing(entry)
    if absent:
        few = f"{len(absent)} of its {len(entry.files)} files are" if len(absent) < len(entry.files) else "it is"
        where = f"{few} not on this machine"
        raise DataMissing(f"The dataset {entry.name} is real data and {where}: run `{entry.command()}`.")
    found = {}
    for one in entry.files:
        there = [path for path in places(one) if path.is_file()]
        whole = next((path for path in there if is_whole(path, one)), None)
        if whole is None:
            raise damaged(there[0], one, entry)
        found[one.name] = whole
    return found


def damaged(path: Path, one: RemoteFile, entry: Entry) -> DataDamaged:
    """The sentence about a file whose bytes are wrong."""
    mirror = _places.mirror()
    why = "its size differs" if path.stat().st_size != one.size else "its sha256 differs"
    if mirror and path == mirror / one.path:
        return DataDamaged(
            f"The mirror's file {path} is not the one of the catalogue ({why}), so it is refused: "
            "copy it there again, or unset COURSE_DATA_MIRROR."
        )
    what = f"{one.path} of dataset {entry.name} is damaged ({why})"
    return DataDamaged(f"{what}: run `{entry.command()}` to fetch it again.")


def load(entry: Entry) -> Dataset:
    """Read a real dataset whose files are all there; images are decoded when asked for."""
    paths = locate(entry)
    return READERS[entry.reader](entry, paths)


def camera_of(entry: Entry, paths: dict[str, Path]) -> PinholeCamera:
    """The intrinsics of an entry: a preset's, those of one of its files, or numbers; with the entry's source."""
    given = dict(entry.camera)
    if "preset" in given:
        camera = preset(given["preset"])
    elif "file" in given:
        camera = read_camera(paths[given["file"]])
    else:
        camera = PinholeCamera(**given)
    return replace(camera, source=entry.camera_source)


def _frames(entry: Entry, paths: dict[str, Path], start: str = "", **held: Any) -> Dataset:
    """The files called color... are the colour of those called depth..., each in the catalogue's order."""
    colors, depths = ([name for name in paths if name.startswith(start + kind)] for kind in ("color", "depth"))
    labels = [Path(name).stem.removeprefix("depth_") for name in depths]
    names = [entry.name if len(depths) == 1 else f"{entry.name} {label}" for label in labels]
    raw = raw_of([(paths[c], paths[d]) for c, d in zip(colors, depths, strict=True)])
    form, camera = find_encoding(entry.encoding), camera_of(entry, paths)
    return with_frames(described(entry, {}, paths), names, raw, form, camera, registered=entry.registered, **held)


def _redwood(entry: Entry, paths: dict[str, Path]) -> Dataset:
    poses = _poses.read_log(paths["trajectory.log"])
    reference = {"trajectory": lambda: poses, "odometry": lambda: _poses.read_log(paths["odometry.log"])}
    return _frames(entry, paths, poses=poses, reference=_reference(entry, reference))


def _slambook(entry: Entry, paths: dict[str, Path]) -> Dataset:
    poses = _poses.read_quaternions(paths["pose.txt"])
    pair = _frames(replace(entry, name=f"{entry.name} pair", **entry.parts["pair"]), paths, "pair/")
    pair = replace(pair, card=described(entry, {}, paths).card)
    reference = {
        "poses": lambda: poses,
        "trajectory_groundtruth": lambda: _poses.read_tum(paths["trajectories/groundtruth.txt"]),
        "trajectory_estimated": lambda: _poses.read_tum(paths["trajectories/estimated.txt"]),
    }
    parts = Parts({"pair": lambda: pair}, entry.name)
    return _frames(entry, paths, poses=poses, reference=_reference(entry, reference), parts=parts)


def _reference(entry: Entry, makers: dict[str, Callable[[], Any]]) -> Parts:
    return Parts(makers, f"the reference of {entry.name}")


def _clouds(entry: Entry, paths: dict[str, Path]) -> Dataset:
    clouds = {Path(name).stem: path for name, path in paths.items() if path.suffix == ".pcd"}
    makers = {name: lambda path=path: files.read_cloud(path) for name, path in clouds.items()}
    return replace(described(entry, {}, paths), held={"clouds": Parts(makers, entry.name)})


def _scan_pair(entry: Entry, paths: dict[str, Path]) -> Dataset:
    """Two clouds, source and target, and the motion between them as the publisher gives it."""
    makers = {name: lambda path=paths[f"{name}.ply"]: files.read_cloud(path) for name in ("source", "target")}
    reference = {"T_target_source": lambda: _poses.read_matrix(paths["T_target_source.txt"])}
    held = {"clouds": Parts(makers, entry.name), "reference": _reference(entry, reference)}
    return replace(described(entry, {}, paths), held=held)


def _bunny(entry: Entry, paths: dict[str, Path]) -> Dataset:
    """The zippered bunny first; its raw scans as clouds; their registration as the reference."""
    stems = {Path(name).stem: path for name, path in paths.items() if path.suffix == ".ply"}
    clouds = {name: lambda path=path: files.read_cloud(path) for name, path in stems.items()}
    meshes = {name: lambda p=path: files.read_mesh(p) for name, path in stems.items() if name.startswith("bun_zipper")}
    reference = {"scan_poses": lambda: _poses.read_bun_conf(paths["bun.conf"])}
    held = {
        "clouds": Parts(clouds, entry.name),
        "meshes": Parts(meshes, f"the meshes of {entry.name}"),
        "reference": _reference(entry, reference),
    }
    return replace(described(entry, {}, paths), held=held)


READERS: dict[str, Callable[[Entry, dict[str, Path]], Dataset]] = {
    "frames": _frames,
    "redwood": _redwood,
    "slambook": _slambook,
    "clouds": _clouds,
    "scan_pair": _scan_pair,
    "bunny": _bunny,
}
