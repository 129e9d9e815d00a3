"""The two formats of RealSense recordings, read by rosbags: what they say of the cameras, and their images.

.bag (ROS 1) is what librealsense wrote before 2.57, .db3 (ROS 2) what it has written since. What is not read:
recordings of ROS's own camera nodes, whose topics have other names; encrypted bags; colour that is not RGB or BGR.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import cv2
import numpy as np
import PIL
import PIL.Image

from course_lib.geometry.rotations import from_quaternion_xyzw
from course_lib.geometry.transforms import from_rotation_translation
from course_lib.notebook._bag_common import IMAGES, TO_RGB, Recording, Stream, only, printable
from course_lib.notebook._errors import Refusal, shown

ROS1_MAGIC, SQLITE_MAGIC = b"#ROSBAG V2.0\n", b"SQLite format 3\0"
COMPRESSED_DEPTH_HEADER = 12
"""Bytes before the PNG in a message of ROS's compressedDepth."""


class Ros1(Recording):
    """A .bag, which librealsense wrote before 2.57 (ROS 1)."""

    def __init__(self, path: Path):
        from rosbags.rosbag1 import Reader
        from rosbags.typesys import get_types_from_msg

        super().__init__(path, Reader(path), "ros1_noetic")
        own = {each.msgtype: each for each in self.reader.connections if each.msgtype.startswith("realsense_msgs/")}
        for name, each in own.items():
            self.store.register(get_types_from_msg(each.msgdef.data, name))

    def decode(self, topic: str, message: bytes) -> Any:
        return self.store.deserialize_ros1(message, self.connections[topic].msgtype)

    def device(self) -> str:
        pairs = (self.decode("/device_0/info", message) for _, message in self.messages("/device_0/info"))
        return printable(next((each.value for each in pairs if each.key == "Name"), "a RealSense"))

    def stream(self, kind: str) -> Stream:
        topic, base, tf = self.topics_of(kind)
        info, lens = self.first(f"{base}/info"), self.first(f"{base}/info/camera_info")
        if info is None or lens is None or not tf:
            raise self.useless()
        move = self.first(tf)
        turn, shift = move.rotation, move.translation
        meta = f"{base}/image/metadata"
        clocks = (self.decode(meta, each) for _, each in self.messages(meta) if b"timestamp_domain" in each)
        read = [(arrival, _ros1_image(message)) for arrival, message in self.messages(topic)]
        numbers = (lens.width, lens.height, lens.K[0], lens.K[4], lens.K[2], lens.K[5])
        coefficients = tuple(map(float, lens.D))
        return Stream(
            topic,
            self.believable(numbers, info.fps, coefficients),
            (lens.distortion_model, coefficients),
            float(info.fps),
            tf.rpartition("/")[2],
            from_quaternion_xyzw((turn.x, turn.y, turn.z, turn.w), (shift.x, shift.y, shift.z)),
            only({each.value for each in clocks if each.key == "timestamp_domain"}),
            np.array([image.stamp for _, image in read]),
            np.array([arrival for arrival, _ in read]),
            np.array([image.unit for _, image in read]),
        )

    def unit_in_metres(self, depth: Stream) -> float | None:
        sensor = IMAGES.fullmatch(depth.topic)["sensor"]
        found = (self.first(f"{sensor}/option/{name}/value") for name in ("Depth Units", "Depth_Units"))
        return next((float(each.data) for each in found if each is not None), None)

    def image(self, stream: Stream, message: bytes) -> np.ndarray:
        _, height, width, encoding, data, _ = _ros1_image(message)
        if "/Depth_" in stream.topic:
            good = encoding == "mono16" and data.size == 2 * height * width
            return self.checked(stream, data.view("<u2").reshape(height, width).astype(np.uint16) if good else None)
        image = None
        if encoding in TO_RGB and data.size == height * width * (4 if "a8" in encoding else 3):
            image = data.reshape(height, width, -1)
            image = image.copy() if TO_RGB[encoding] is None else cv2.cvtColor(image, TO_RGB[encoding])
        return self.checked(stream, image)


class _Ros1Image(NamedTuple):
    """A sensor_msgs/Image of ROS 1, with the metres a unit that librealsense appends."""

    stamp: float
    height: int
    width: int
    encoding: str
    data: np.ndarray
    unit: float


def _ros1_image(message: bytes) -> _Ros1Image:
    """Take an Image apart.

    Done here because librealsense 2.55 writes four bytes more than the message's own definition has (of a depth image,
    metres a unit), which a reader that follows the definition refuses.
    """
    seconds, nanoseconds, length = struct.unpack_from("<4xIII", message)
    height, width, size = struct.unpack_from("<III", message, 16 + length)
    at = 28 + length
    encoding = bytes(message[at : at + size]).decode("ascii")
    (count,) = struct.unpack_from("<I", message, at + size + 5)
    data = np.frombuffer(message, np.uint8, count, at + size + 9)
    end = at + size + 9 + count
    unit = struct.unpack_from("<f", message, end)[0] if len(message) >= end + 4 else np.nan
    return _Ros1Image(seconds + nanoseconds * 1e-9, height, width, encoding, data, unit)


class Ros2(Recording):
    """A .db3, which librealsense has written since 2.57 (ROS 2); what is said of the cameras stands there as text,
    `name=value` with semicolons between."""

    def __init__(self, path: Path):
        from rosbags.rosbag2 import Reader

        reader = Reader(path)
        reader.storage.path = Path(quote(str(path.absolute()), safe="/\\:"))  # rosbags writes it into a URI as it is
        super().__init__(path, reader, "ros2_humble")

    def decode(self, topic: str, message: bytes) -> Any:
        return self.store.deserialize_cdr(message, self.connections[topic].msgtype)

    def said(self, topic: str) -> dict[str, str]:
        found = self.first(topic)
        return {} if found is None else _said(found.data)

    def device(self) -> str:
        return printable(self.said("/device_0/info").get("Name", "a RealSense"))

    def stream(self, kind: str) -> Stream:
        topic, base, tf = self.topics_of(kind)
        info, lens = self.said(f"{base}/info"), self.said(f"{base}/camera_info")
        if not info or not lens or not tf:
            raise self.useless()
        move = self.said(tf)
        columns = np.reshape(_floats(move["rotation"]), (3, 3))
        meta = {
            arrival: _said(self.decode(f"{base}/image/metadata", message).data)
            for arrival, message in self.messages(f"{base}/image/metadata")
        }
        arrivals = [arrival for arrival, _ in self.messages(topic)]
        told = [meta.get(arrival, {}).get("timestamp") for arrival in arrivals]
        stamped = None not in told
        if info["encoding"].lower() not in (TO_RGB if kind == "Color" else ("z16",)):
            raise Refusal(f"{shown(self.path)} holds {info['encoding']}: record Z16 depth and RGB8 colour.")
        numbers = tuple(float(lens[name]) for name in ("width", "height", "fx", "fy", "ppx", "ppy"))
        rate, coefficients = float(info["fps"]), tuple(_floats(lens["coeffs"]))
        return Stream(
            topic,
            self.believable(numbers, rate, coefficients),
            (lens["model"], coefficients),
            rate,
            tf.rpartition("/")[2],
            from_rotation_translation(columns.T, _floats(move["translation"])),
            only({each.get("timestamp_domain", "") for each in meta.values()}) if stamped else "",
            np.array([float(milliseconds) * 1e-3 for milliseconds in told] if stamped else arrivals),
            np.array(arrivals),
            np.array([float(meta.get(arrival, {}).get("depth_units", "nan")) for arrival in arrivals]),
        )

    def unit_in_metres(self, depth: Stream) -> float | None:
        found = self.first(f"{IMAGES.fullmatch(depth.topic)['sensor']}/option/Depth_Units/value")
        return None if found is None else float(found.data)

    def image(self, stream: Stream, message: bytes) -> np.ndarray:
        data = np.asarray(self.decode(stream.topic, message).data, dtype=np.uint8)
        depth = "/Depth_" in stream.topic
        data = data[COMPRESSED_DEPTH_HEADER:] if depth else data
        # Looked at before it is unpacked: a few spoiled bytes can promise gigabytes.
        try:
            with PIL.Image.open(io.BytesIO(data.tobytes()), formats=("PNG", "JPEG")) as promised:
                fits = promised.size == (stream.camera.width, stream.camera.height)
        except (PIL.UnidentifiedImageError, PIL.Image.DecompressionBombError):
            fits = False
        if not fits:
            return self.checked(stream, None)
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED if depth else cv2.IMREAD_COLOR)
        return self.checked(stream, image if depth or image is None else cv2.cvtColor(image, cv2.COLOR_BGR2RGB))


def _said(text: str) -> dict[str, str]:
    return dict(part.split("=", 1) for part in text.split(";") if "=" in part)


def _floats(text: str) -> list[float]:
    return [float(part) for part in text.split(",")]


@contextmanager
def opened(path: Path) -> Iterator[Ros1 | Ros2]:
    """Open a recording; whatever its bytes do to the reader of its format becomes one sentence.

    Raises
    ------
    Refusal
        If it is missing, empty, of another format, cut short, never closed, or spoiled inside.
    """
    if not path.is_file():
        raise Refusal(f"There is no recording {shown(path)}: check the name and the folder.")
    check, kind = (_check_ros1, Ros1) if path.suffix.lower() == ".bag" else (_check_ros2, Ros2)
    check(path)
    try:
        recording = kind(path)
        try:
            yield recording
        finally:
            recording.reader.close()
    except (Refusal, OSError):
        raise
    except MemoryError as error:
        raise Refusal(f"{shown(path)} asks for more memory than there is: copy it again, or give most=.") from error
    except Exception as error:
        why = printable(str(error)).rstrip(". ") or type(error).__name__
        raise Refusal(f"{shown(path)} is damaged inside ({why}): copy it again.") from error


def _check_ros1(path: Path) -> None:
    """Prove that a file is a whole bag, and say what else it is."""
    with open(path, "rb") as file:
        content = file.read(4096)
    if not content.startswith(ROS1_MAGIC):
        what = "is empty" if not content else "is not a ROS 1 bag"
        raise Refusal(f"{shown(path)} {what}: record it again.")
    at = content.find(b"index_pos=")
    index = int.from_bytes(content[at + 10 : at + 18], "little") if at >= 0 else 0
    if index == 0:
        raise Refusal(f"{shown(path)} was never closed (it has no index): mend it with rosbag reindex or record again.")
    if index >= path.stat().st_size:
        raise Refusal(f"{shown(path)} is cut short: its index lies behind its end; copy it again.")


def _check_ros2(path: Path) -> None:
    with open(path, "rb") as file:
        content = file.read(len(SQLITE_MAGIC))
    if content != SQLITE_MAGIC:
        what = "is empty" if not content else "is not a ROS 2 recording"
        raise Refusal(f"{shown(path)} {what}: record it again.")
