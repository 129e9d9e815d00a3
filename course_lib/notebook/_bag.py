"""A RealSense recording (.bag, ROS 1) through Open3D's reader, which aligns depth to colour.

What is not supported: .db3 (librealsense ≥ 2.57 records that) and .mcap, encrypted or compressed topics, and recordings
without both a depth and a colour stream.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from course_lib.cameras import PinholeCamera
from course_lib.notebook._dataset import Dataset, Lazy
from course_lib.notebook._errors import Refusal, shown
from course_lib.rgbd import DepthEncoding, RGBDFrame, decode_depth

MAGIC = b"#ROSBAG V2.0\n"
MOST = 100
"""Frames kept in memory unless the caller asks for another number: 100 of 848x480 take 200 MB."""


def check_bag(path: Path) -> None:
    """Prove that a file is a whole ROS 1 bag before Open3D opens it (a bad one gives it uninitialised numbers).

    Raises
    ------
    Refusal
        If it is missing, empty, no bag, or was never closed.
    """
    if not path.is_file():
        raise Refusal(f"There is no recording {shown(path)}: check the name and the folder.")
    with open(path, "rb") as file:
        content = file.read(4096)
    if not content.startswith(MAGIC):
        what = "is empty" if not content else "is not a ROS 1 bag"
        raise Refusal(f"{shown(path)} {what}: record it again as .bag, or convert it with rosbags-convert.")
    header = content[len(MAGIC) : len(MAGIC) + 4096]
    at = header.find(b"index_pos=")
    index = int.from_bytes(header[at + 10 : at + 18], "little") if at >= 0 else 0
    if index == 0:
        raise Refusal(f"{shown(path)} was never closed (it has no index): mend it with rosbag reindex or record again.")
    if index >= path.stat().st_size:
        raise Refusal(f"{shown(path)} is cut short: its index lies behind its end; copy it again.")


def read_bag(path: Path, *, every: int = 1, most: int | None = None) -> Dataset:
    """Read a recording into memory.

    Parameters
    ----------
    path : the .bag file.
    every : keep each so-many-th frame.
    most : keep at most so many; None for `MOST`.

    Returns
    -------
    Dataset of kind "yours"; depth is aligned to colour, the camera is the colour camera as the file says. Open3D plays
    a recording at the speed at which it was made: a machine too slow to follow skips frames, as the camera would.

    Raises
    ------
    Refusal
        If the file is not a whole bag with depth and colour, or Open3D on this platform has no reader.
    """
    check_bag(path)
    import open3d as o3d

    reader_class = getattr(o3d.t.io, "RSBagReader", None)
    if reader_class is None:
        raise Refusal("Open3D on this platform has no RealSense reader: extract color/ and depth/ on another machine.")
    most = MOST if most is None else most
    frames: list[tuple[np.ndarray, np.ndarray]] = []
    seen = 0
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        reader = reader_class()
        try:
            opened = reader.open(str(path))
        except RuntimeError as error:
            raise Refusal(f"{shown(path)} cannot be opened as a RealSense recording: record it again.") from error
        if not opened:
            raise Refusal(f"{shown(path)} cannot be opened as a RealSense recording: record it again.")
        try:
            facts = _facts(path, reader.metadata)
            while len(frames) < most:
                frame = reader.next_frame()
                if frame.is_empty():  # not is_eof(): the last frame is still handed out after the reader met the end
                    break
                if seen % every == 0:
                    frames.append((np.asarray(frame.color).copy(), np.asarray(frame.depth)[..., 0].copy()))
                seen += 1
        finally:
            reader.close()
    if not frames:
        raise Refusal(f"{shown(path)} holds no frame with both depth and colour: record both streams.")
    camera, form, device = facts
    name = path.stem

    def raw(index: int) -> tuple[np.ndarray, np.ndarray]:
        color, depth = frames[index]
        return color.copy(), depth.copy()

    def frame_of(index: int) -> RGBDFrame:
        color, depth = frames[index]
        return RGBDFrame(color.copy(), decode_depth(depth, form), camera, name=f"{name} {index:03d}")

    return Dataset(
        name=name,
        kind="yours",
        title=f"{len(frames)} frames of a {device}, depth aligned to colour",
        meta={"device": device, "frames_seen": seen},
        files={path.name: path},
        held={"frames": Lazy(len(frames), frame_of, "frames"), "encoding": form, "camera": camera},
        raw_frame=raw,
    )


def _facts(path: Path, metadata: object) -> tuple[PinholeCamera, DepthEncoding, str]:
    """Camera, encoding and device, after checking that the numbers can be."""
    K = np.asarray(metadata.intrinsics.intrinsic_matrix)
    width, height, scale = metadata.width, metadata.height, metadata.depth_scale
    sane = 0 < width < 10_000 and 0 < height < 10_000 and np.isfinite(K).all() and K[0, 0] > 0 and 1 <= scale <= 100_000
    if not sane or str(metadata.color_format) == "" or str(metadata.depth_format) != "Z16":
        raise Refusal(f"{shown(path)} says nothing usable of its camera: record depth (Z16) and colour (RGB8) again.")
    source = f"read from {path.name}: the colour camera of a {metadata.device_name}"
    camera = PinholeCamera(width, height, K[0, 0], K[1, 1], K[0, 2], K[1, 2], source=source)
    units = float(np.round(scale, 3))
    form = DepthEncoding("bag", units, np.uint16, (0, 65535), f"depth scale of {path.name}")
    return camera, form, metadata.device_name
