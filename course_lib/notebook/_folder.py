"""The learner's own recording in the course's types: a folder of images, a folder of clouds, or a RealSense's file."""

from __future__ import annotations

import difflib
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from course_lib.camera.pinhole import PinholeCamera, preset
from course_lib.camera.rgbd import DepthEncoding, decode_depth, find_encoding
from course_lib.notebook import _poses, files
from course_lib.notebook._dataset import Dataset, Parts, raw_of, with_frames
from course_lib.notebook._errors import Refusal, shown
from course_lib.notebook._images import SUFFIXES
from course_lib.notebook._recording import read_recording

COLOR_FOLDERS = ("color", "colour", "rgb", "image", "images")
DEPTH_FOLDERS = ("depth", "depths", "aligned_depth", "depth_aligned", "depth_raw")
ASSOCIATIONS = ("associations.txt", "association.txt", "associate.txt", "associated.txt")
CAMERA_FILES = ("camera*.json", "*intrinsic*.json", "cam_params*.json", "calibration*.json", "*_camera.json")
RECORDINGS = (".bag", ".db3")
NOT_READ = {
    ".mcap": "a recording of ROS 2's own nodes: extract color/ and depth/ from it first",
    ".mkv": "an Azure Kinect recording: extract color/ and depth/ from it first",
    ".oni": "an OpenNI recording: extract color/ and depth/ from it first",
    ".mp4": "a film, which has no depth: record depth images too",
    ".zip": "packed: unpack it and name the folder",
}
MOST_SECONDS_APART = 0.02
"""Colour and depth of a TUM-style recording belong together if their times differ by less: the benchmark's default."""
FAR_MEDIAN = 10.0
"""Metres: a first frame deeper than this in the median, with an encoding nobody named, has the wrong unit."""


def from_folder(
    path: str | Path,
    *,
    camera: PinholeCamera | str | Path | None = None,
    encoding: DepthEncoding | str | None = None,
    registered: bool = True,
    every: int = 1,
    most: int | None = None,
) -> Dataset:
    """Load your own recording.

    Three forms are read. A folder with `color/` (or `rgb/`) and `depth/`: images pair up by `associations.txt`, by
    `rgb.txt` and `depth.txt`, by names that are times in seconds (TUM), or by the number in their names; poses come
    from `groundtruth.txt` or `trajectory.log` where there is one. A folder of PLY, PCD or XYZ clouds. A RealSense
    recording, `.bag` or `.db3`. Not read: .mcap, .mkv, .oni.

    Parameters
    ----------
    path : the folder, or the .bag or .db3 file.
    camera : intrinsics of the depth images: a PinholeCamera, a preset's name, or a JSON file (in the folder, or
        anywhere); None to look for a `camera*.json` or `*intrinsic*.json` in the folder. (A recording knows its own.)
    encoding : how depth is stored: a name ("tum", "realsense", ...) or a DepthEncoding; None for "tum" where the folder
        looks like TUM's, else "realsense" (millimetres).
    registered : whether depth was aligned to colour when it was recorded.
    every, most : keep each so-many-th frame, and at most so many.

    Returns
    -------
    Dataset of kind "yours", in the same types as every other.

    Raises
    ------
    Refusal
        If nothing is there that the course reads; the sentence says what was expected.
    """
    path = Path(path).expanduser()
    if every < 1 or (most is not None and most < 1):
        raise Refusal(f"every and most count frames from 1 on, not every={every}, most={most}.")
    if path.is_file():
        return _from_file(path, every, most)
    if not path.is_dir():
        beside = [one.name for one in path.parent.iterdir()] if path.parent.is_dir() else []
        near = difflib.get_close_matches(path.name, beside, n=1)
        raise Refusal(f"There is no folder {shown(path)}: {f'did you mean {near[0]}?' if near else 'check its name.'}")
    found = {one.name.lower(): one for one in sorted(path.iterdir()) if not one.name.startswith(".")}
    if not found:
        raise Refusal(f"{shown(path)} is empty: put color/ and depth/ (16-bit PNG) into it, or clouds, or name a .db3.")
    color = next((found[name] for name in COLOR_FOLDERS if name in found and found[name].is_dir()), None)
    depth = next((found[name] for name in DEPTH_FOLDERS if name in found and found[name].is_dir()), None)
    clouds = {one.stem: one for one in found.values() if one.suffix.lower() in files.CLOUDS}
    if color is None and depth is None:
        if clouds:
            makers = {name: lambda p=one: files.read_cloud(p) for name, one in clouds.items()}
            held = {"clouds": Parts(makers, path.name)}
            return Dataset(path.name, "yours", f"{len(clouds)} clouds", files=clouds, held=held)
        bag = next((one for one in found.values() if one.suffix.lower() in RECORDINGS), None)
        expected = "color/ and depth/, or clouds (PLY, PCD, XYZ) were expected."
        hint = f"name the file {bag.name} itself." if bag else expected
        raise Refusal(f"{shown(path)} holds no recording that the course reads: {hint}")
    if color is None or depth is None:
        there, lacking = ("depth/", "color/ (or rgb/)") if color is None else (f"{color.name}/", "depth/")
        raise Refusal(f"{shown(path)} has {there} but no {lacking}: both are needed.")
    return _rgbd(path, color, depth, camera, encoding, registered, every, most)


def _from_file(path: Path, every: int, most: int | None) -> Dataset:
    kind = path.suffix.lower()
    if kind in RECORDINGS:
        return read_recording(path, every=every, most=most)
    if kind in files.CLOUDS:
        held = {"clouds": Parts({path.stem: lambda: files.read_cloud(path)}, path.name)}
        return Dataset(path.stem, "yours", "one cloud", files={path.name: path}, held=held)
    what = NOT_READ.get(kind, "of a kind that the course does not read: name a folder, a .bag or a .db3")
    raise Refusal(f"{shown(path)} is {what}.")


def _rgbd(
    path: Path,
    color: Path,
    depth: Path,
    camera: PinholeCamera | str | Path | None,
    encoding: DepthEncoding | str | None,
    registered: bool,
    every: int,
    most: int | None,
) -> Dataset:
    pairs, times = _pairs(path, color, depth)
    keep = list(range(0, len(pairs), every))[:most]
    like_tum = times is not None
    form = find_encoding(encoding or ("tum" if like_tum else "realsense"))
    poses, why = _trajectory(path, len(pairs), times)
    pairs = [pairs[i] for i in keep]
    poses = None if poses is None else [poses[i] for i in keep]
    first_color, first_depth = files.read_image(pairs[0][0]), files.read_depth(pairs[0][1])
    lens = _find_camera(path, camera, first_depth)
    if registered and first_color.shape[:2] != first_depth.shape:
        raise Refusal(
            f"{pairs[0][0].name} is {first_color.shape[1]}x{first_color.shape[0]} and {pairs[0][1].name} "
            f"{first_depth.shape[1]}x{first_depth.shape[0]}: align depth to colour when recording, or say "
            "registered=False."
        )
    measured = decode_depth(first_depth, form)
    if not (measured > 0).any():
        raise Refusal(f"{shown(pairs[0][1])} holds no measured pixel: check the recording.")
    middle = float(np.median(measured[measured > 0]))
    if encoding is None and middle > FAR_MEDIAN:
        raise Refusal(
            f"At {form.units_per_metre:g} units a metre the first depth image would be {middle:.1f} m deep in the "
            "median: say how it is stored, such as encoding='tum'."
        )

    unit = f"{form.units_per_metre:g} units a metre{' (assumed)' if encoding is None else ''}"
    base = Dataset(
        name=path.name,
        kind="yours",
        title=f"{len(pairs)} frames; {unit}; depth {'aligned' if registered else 'not aligned'} to colour",
        meta={"poses_from": why} if why else {},
        files={f"{kind}/{one.name}": one for pair in pairs for kind, one in zip(("color", "depth"), pair, strict=True)},
    )
    names = [f"{path.name} {one.stem}" for _, one in pairs]
    return with_frames(base, names, raw_of(pairs), form, lens, poses=poses, registered=registered)


def _images(folder: Path) -> list[Path]:
    return sorted(one for one in folder.iterdir() if one.suffix.lower() in SUFFIXES and not one.name.startswith("."))


def _pairs(path: Path, color: Path, depth: Path) -> tuple[list[tuple[Path, Path]], np.ndarray | None]:
    """Pair colour with depth images; also the times of the depth images, where the recording has times."""
    listed = next((path / name for name in ASSOCIATIONS if (path / name).is_file()), None)
    if listed:
        lines = [line.partition("#")[0].split() for line in listed.read_text(encoding="utf-8").splitlines()]
        rows = [words for words in lines if words]
        if not rows or any(len(row) != 4 for row in rows):
            raise Refusal(f"{shown(listed)} must hold time, image, time, image on every line: write it again.")
        order = (1, 3, 2) if rows[0][1].startswith(f"{color.name}/") else (3, 1, 0)
        pairs = [(path / row[order[0]], path / row[order[1]]) for row in rows]
        return pairs, np.array([float(row[order[2]]) for row in rows])
    colors, depths = _images(color), _images(depth)
    for folder, found in ((color, colors), (depth, depths)):
        if not found:
            raise Refusal(f"{shown(folder)} is empty: it should hold images ({', '.join(SUFFIXES)}).")
    color_times, depth_times = _times(path / "rgb.txt", colors), _times(path / "depth.txt", depths)
    if color_times is not None and depth_times is not None:
        nearest = np.abs(color_times[None] - depth_times[:, None]).argmin(axis=1)
        near = np.abs(color_times[nearest] - depth_times) < MOST_SECONDS_APART
        if not near.any():
            raise Refusal(f"No image of {color.name}/ was taken within {MOST_SECONDS_APART} s of one of {depth.name}/.")
        return [(colors[nearest[i]], depths[i]) for i in np.flatnonzero(near)], depth_times[near]
    numbers = [{_number(one): one for one in found} for found in (colors, depths)]
    both = sorted(set(numbers[0]) & set(numbers[1]))
    if len(both) < max(len(colors), len(depths)):
        raise Refusal(
            f"{color.name}/ has {len(colors)} images, {depth.name}/ has {len(depths)} and {len(both)} numbers in their "
            "names agree: give each pair the same number, or write associations.txt."
        )
    return [(numbers[0][n], numbers[1][n]) for n in both], None


def _number(path: Path) -> int | str:
    digits = re.findall(r"\d+", path.stem)
    return int(digits[-1]) if digits else ""


def _times(listing: Path, images: list[Path]) -> np.ndarray | None:
    """Times in seconds of images: from a TUM list, else from names that are such times, else None."""
    if listing.is_file():
        rows = [line.split() for line in listing.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        by_name = {Path(row[1]).name: float(row[0]) for row in rows if len(row) == 2}
        if all(one.name in by_name for one in images):
            return np.array([by_name[one.name] for one in images])
    if all(re.fullmatch(r"\d+\.\d+", one.stem) for one in images):
        return np.array([float(one.stem) for one in images])
    return None


def _find_camera(path: Path, camera: PinholeCamera | str | Path | None, depth: np.ndarray) -> PinholeCamera:
    size = f"{depth.shape[1]}x{depth.shape[0]}"
    if camera is None:
        found = next((one for pattern in CAMERA_FILES for one in sorted(path.glob(pattern))), None)
        if found is None:
            raise Refusal(
                f"{shown(path)} holds no intrinsics: put camera.json (width, height, fx, fy, cx, cy) beside the "
                "images, or pass camera=, such as a preset's name."
            )
        camera = _poses.read_camera(found)
    elif isinstance(camera, Path) or (isinstance(camera, str) and camera.endswith(".json")):
        inside = path / camera
        camera = _poses.read_camera(files.there(inside if inside.exists() else camera, (".json",), "a camera file"))
    elif isinstance(camera, str):
        camera = preset(camera)
    if (camera.height, camera.width) != depth.shape:
        raise Refusal(
            f"The intrinsics are for {camera.width}x{camera.height} and the depth images are {size}: pass those "
            f"of {size}, or camera.scaled(...) if the images were resized."
        )
    return camera if camera.source else replace(camera, source="given by you")


def _trajectory(path: Path, count: int, times: np.ndarray | None) -> tuple[list[np.ndarray] | None, str]:
    """Poses of the frames where the folder has them, and the file they come from."""
    truth, log = path / "groundtruth.txt", path / "trajectory.log"
    if truth.is_file() and times is not None:
        stamps, poses = _poses.read_tum(truth)
        nearest = np.abs(stamps[None] - times[:, None]).argmin(axis=1)
        if np.abs(stamps[nearest] - times).max() < MOST_SECONDS_APART:
            return list(poses[nearest]), truth.name
    if log.is_file():
        poses = _poses.read_log(log)
        if len(poses) != count:
            raise Refusal(f"{shown(log)} has {len(poses)} poses and there are {count} frames: they must agree.")
        return list(poses), log.name
    return None, ""
