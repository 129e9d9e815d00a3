"""The learner's own recording in the course's types: a folder of images, a folder of clouds, or a RealSense's file."""

from __future__ import annotations

import difflib
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from course_lib.camera.pinhole import PinholeCamera
from course_lib.camera.rgbd import METRES, DepthEncoding, decode_depth, find_encoding
from course_lib.notebook import files
from course_lib.notebook._camera_files import find_camera
from course_lib.notebook._dataset import Dataset, Parts, raw_of, with_frames
from course_lib.notebook._errors import Refusal, shown
from course_lib.notebook._images import DEPTH_SUFFIXES, SUFFIXES
from course_lib.notebook._pairing import Pairs, flat_images, images, natural, pair
from course_lib.notebook._poses import poses_of_folder
from course_lib.notebook._recording import read_recording

COLOR_FOLDERS = ("color", "colour", "rgb", "image", "images")
DEPTH_FOLDERS = ("depth", "depths", "aligned_depth", "depth_aligned", "depth_raw")
RECORDINGS = (".bag", ".db3")
NOT_READ = {
    ".mcap": "a recording of ROS 2's own nodes: extract color/ and depth/ from it first",
    ".mkv": "an Azure Kinect recording: extract color/ and depth/ from it first",
    ".oni": "an OpenNI recording: extract color/ and depth/ from it first",
    ".mp4": "a film, which has no depth: record depth images too",
    ".zip": "packed: unpack it and name the folder",
}
FAR_MEDIAN = 10.0
"""Metres: a first frame deeper than this in the median, with an encoding nobody named, has the wrong unit."""


def from_folder(
    path: str | Path,
    *,
    camera: PinholeCamera | ArrayLike | str | Path | None = None,
    encoding: DepthEncoding | str | float | None = None,
    registered: bool = True,
    every: int = 1,
    most: int | None = None,
) -> Dataset:
    """Load your own recording.

    Three forms are read. A folder with `color/` (or `rgb/`) and `depth/`, or with both in one
    (`frame-000000.color.png`, `frame-000000.depth.png`): images pair up by `associations.txt`, by `rgb.txt` and
    `depth.txt`, by names that are times in seconds (TUM), or by a number in their names; poses come from
    `groundtruth.txt`, `trajectory.log` or `frame-000000.pose.txt` where there are such. A folder of PLY, PCD or XYZ
    clouds. A RealSense recording, `.bag` or `.db3`. Not read: .mcap, .mkv, .oni.

    Parameters
    ----------
    path : the folder, or the .bag or .db3 file.
    camera : intrinsics of the depth images: a PinholeCamera, a matrix K, a preset's name, or a file (JSON, ROS's YAML,
        or K as text; in the folder, or anywhere); None to look for a `camera*` or `*intrinsic*` file in the folder. (A
        recording knows its own.)
    encoding : how depth is stored: a name ("tum", "realsense", ...), the units in a metre, or a DepthEncoding; None for
        metres in files of floats, "tum" where the folder looks like TUM's, else "realsense" (millimetres).
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
    found = sorted((one for one in path.iterdir() if not one.name.startswith(".")), key=natural)
    if not found:
        raise Refusal(f"{shown(path)} is empty: put color/ and depth/ (16-bit PNG) into it, or clouds, or name a .db3.")
    folders = {one.name.lower(): one for one in found if one.is_dir()}
    color = next((folders[name] for name in COLOR_FOLDERS if name in folders), None)
    depth = next((folders[name] for name in DEPTH_FOLDERS if name in folders), None)
    if color is not None and depth is not None:
        lists = images(color), images(depth, DEPTH_SUFFIXES)
        for folder, there, kinds in zip((color, depth), lists, (SUFFIXES, DEPTH_SUFFIXES), strict=True):
            if not there:
                raise Refusal(f"{shown(folder)} is empty: it should hold images ({', '.join(kinds)}).")
        return _rgbd(path, pair(path, *lists, (color.name, depth.name)), camera, encoding, registered, every, most)
    if color is not None or depth is not None:
        there, lacking = ("depth/", "color/ (or rgb/)") if color is None else (f"{color.name}/", "depth/")
        raise Refusal(f"{shown(path)} has {there} but no {lacking}: both are needed.")
    colors, depths = flat_images(path)
    if colors and depths:
        pairs = pair(path, colors, depths, (f"{path.name} (color)", f"{path.name} (depth)"))
        return _rgbd(path, pairs, camera, encoding, registered, every, most)
    clouds = [one for one in found if one.suffix.lower() in files.CLOUDS]
    if clouds:
        stems = [one.stem for one in clouds]
        names = {one.stem if stems.count(one.stem) == 1 else one.name: one for one in clouds}
        held = {"clouds": Parts({name: lambda p=one: files.read_cloud(p) for name, one in names.items()}, path.name)}
        return Dataset(path.name, "yours", f"{len(clouds)} clouds", files=names, held=held)
    bag = next((one for one in found if one.suffix.lower() in RECORDINGS), None)
    expected = "color/ and depth/, or clouds (PLY, PCD, XYZ) were expected."
    hint = f"name the file {bag.name} itself." if bag else expected
    raise Refusal(f"{shown(path)} holds no recording that the course reads: {hint}")


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
    found: Pairs,
    camera: PinholeCamera | ArrayLike | str | Path | None,
    encoding: DepthEncoding | str | float | None,
    registered: bool,
    every: int,
    most: int | None,
) -> Dataset:
    poses, origin, note = poses_of_folder(path, [depth for _, depth in found.files], found.times)
    keep = list(range(0, len(found.files), every))[:most]
    pairs = [found.files[i] for i in keep]
    poses = None if poses is None else [poses[i] for i in keep]
    first_color, first_depth = files.read_image(pairs[0][0]), files.read_depth(pairs[0][1])
    floats = first_depth.dtype.kind == "f"
    form = METRES if floats else find_encoding("realsense" if found.times is None else "tum")
    if encoding is not None:
        form = replace(find_encoding(encoding), **({"dtype": np.float32, "form": "linear"} if floats else {}))
    lens = find_camera(path, camera, first_depth.shape)
    lens = lens if lens.source else replace(lens, source="given by you")
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
    title = f"{len(pairs)} frames; {unit}; depth {'aligned' if registered else 'not aligned'} to colour"
    base = Dataset(
        name=path.name,
        kind="yours",
        title="; ".join(words for words in (title, found.left, note) if words),
        meta={"poses_from": origin} if origin else {},
        files={f"{kind}/{one.name}": one for both in pairs for kind, one in zip(("color", "depth"), both, strict=True)},
    )
    names = [f"{path.name} {one.stem}" for _, one in pairs]
    return with_frames(base, names, raw_of(pairs), form, lens, poses=poses, registered=registered)
