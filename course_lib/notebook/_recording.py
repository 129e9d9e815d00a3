"""A RealSense recording (.bag or .db3) in the course's types, with depth moved to the colour camera.

Frame after frame is read from the file; nothing is played, so that no frame is lost on a slow machine.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from course_lib.camera.depth_alignment import align_depth
from course_lib.camera.distortion import distort
from course_lib.camera.rgbd import DepthEncoding, decode_depth, encode_depth
from course_lib.geometry.transforms import invert
from course_lib.notebook._bag_common import Stream, printable
from course_lib.notebook._dataset import Dataset, with_frames
from course_lib.notebook._errors import Refusal, shown
from course_lib.notebook._rosbags import opened

MOST = 100
"""Frames kept in memory unless the caller asks for another number: 100 of 848x480 take 200 MB."""
MOST_BYTES = 4e9
NO_LENS = "None"

FORWARD = ("Brown Conrady", "Modified Brown Conrady", "Inverse Brown Conrady")
"""Lens models whose polynomial leads from the straight to the recorded pixel; librealsense (since 2.44) uses the one
that it calls inverse so, too. Their tangential terms differ by less than a hundredth of a pixel."""


def read_recording(path: Path, *, every: int = 1, most: int | None = None) -> Dataset:
    """Read a recording into memory.

    Parameters
    ----------
    path : the .bag or .db3 file.
    every : keep each so-many-th frame.
    most : keep at most so many; None for `MOST`.

    Returns
    -------
    Dataset of kind "yours". The camera is the colour camera: depth is moved to its pixels and becomes its z (rounded to
    the recording's unit); a distorted colour image is straightened. Each colour image is paired with the depth image
    nearest in time, not more than a frame's time away; one that has none is left out.

    Raises
    ------
    Refusal
        If the file is not a whole recording by librealsense with depth and colour.
    """
    with opened(path) as recording:
        colour, depth = recording.stream("Color"), recording.stream("Depth")
        if colour.reference != depth.reference:
            raise Refusal(f"{shown(path)} does not say where its cameras are to each other: record it again.")
        pairs = _pair(colour, depth)
        if not pairs:
            raise Refusal(f"{shown(path)} holds no frame with both depth and colour: record both streams.")
        wanted = pairs[::every][: MOST if most is None else most]
        units = recording.units(depth, [pair[1] for pair in wanted])
        size = len(wanted) * sum(n * one.camera.width * one.camera.height for n, one in ((3, colour), (2, depth)))
        if size > MOST_BYTES:
            raise Refusal(f"{shown(path)}: {len(wanted)} frames take {size / 1e9:.1f} GB: say most= or every=.")
        bent = _bend(path, colour)
        if depth.lens[0] != NO_LENS and (depth.lens[0] not in FORWARD or any(depth.lens[1])):
            raise Refusal(f"{shown(path)} is not of a stereo camera: its depth has lens distortion, which is not read.")
        colours = recording.images(colour, [pair[0] for pair in wanted])
        depths = recording.images(depth, [pair[1] for pair in wanted])
        device = recording.device()
    T_color_depth = colour.T_stream_reference @ invert(depth.T_stream_reference)
    form = DepthEncoding("recording", units, np.uint16, (0, 65535), f"depth units of {path.name}")
    source = f"read from {path.name}: the colour camera of {device}"
    camera = replace(colour.camera, source=source if bent is None else f"{source}, straightened")

    def raw(index: int) -> tuple[np.ndarray, np.ndarray]:
        image = colours[index] if bent is None else cv2.remap(colours[index], *bent, cv2.INTER_LINEAR)
        moved = align_depth(decode_depth(depths[index], form), depth.camera, camera, T_color_depth)
        stored = np.rint(moved * units)
        moved[(stored < 1) | (stored > 65534)] = 0  # what 16 bits of this unit cannot hold
        if bent is not None:
            moved[~_inside(*bent)] = 0  # the recorded picture ends before the straight one
        return image.copy(), encode_depth(moved, form)

    if not raw(0)[1].any():
        raise Refusal(f"{shown(path)}: its first frame has no measured pixel that the colour camera sees.")
    base = Dataset(
        name=path.stem,
        kind="yours",
        title=f"{len(wanted)} frame{'s' if len(wanted) > 1 else ''} by {device}, depth aligned to colour",
        meta={"device": device, "frames_recorded": len(pairs)},
        files={path.name: path},
    )
    return with_frames(base, [f"{path.stem} {index:03d}" for index in range(len(wanted))], raw, form, camera)


def _pair(colour: Stream, depth: Stream) -> list[tuple[int, int]]:
    """Places of colour and depth images that belong together, in the order of time, none used twice."""
    if not len(colour.stamps) or not len(depth.stamps):
        return []
    same = colour.clock == depth.clock != ""
    times, others = (colour.stamps, depth.stamps) if same else (colour.arrivals, depth.arrivals)
    limit = 1 / min(colour.rate, depth.rate)
    order = np.argsort(others, kind="stable")
    after = np.searchsorted(others[order], times)
    near = order[np.stack([np.maximum(after - 1, 0), np.minimum(after, len(order) - 1)])]  # before and after, (2, N)
    apart = np.abs(others[near] - times)
    pairs, used = {}, set()
    for at in np.argsort(apart, axis=None, kind="stable"):
        column, row = int(near.flat[at]), int(at) % len(times)
        if apart.flat[at] <= limit and row not in pairs and column not in used:
            pairs[row] = column
            used.add(column)
    return sorted(pairs.items(), key=lambda pair: times[pair[0]])


def _bend(path: Path, stream: Stream) -> tuple[np.ndarray, np.ndarray] | None:
    """Where each pixel of the straight colour image lies in the recorded one, for cv2.remap; None if it is straight."""
    model, coefficients = stream.lens
    if model == NO_LENS:
        return None
    if model not in FORWARD:
        raise Refusal(f"{shown(path)} has a colour lens of the model {printable(model)}, which is not read.")
    if not any(coefficients):
        return None
    camera = stream.camera
    v, u = np.mgrid[: camera.height, : camera.width]
    straight = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy], axis=-1)
    maps = distort(straight, coefficients) * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    return maps[..., 0].astype(np.float32), maps[..., 1].astype(np.float32)


def _inside(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(H, W) bool: where the straight image has a pixel of the recorded one."""
    height, width = u.shape
    return (u >= 0) & (u <= width - 1) & (v >= 0) & (v <= height - 1)
