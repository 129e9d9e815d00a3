"""A .bag, which librealsense wrote before 2.57 (ROS 1)."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from course_lib.geometry.rotations import from_quaternion_xyzw
from course_lib.notebook._bag_common import IMAGES, TO_RGB, Recording, Stream, only, printable
from course_lib.notebook._errors import Refusal, shown


class Ros1(Recording):
    """A .bag."""

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
        topic = self.topic_of(kind)
        base = topic.partition("/image/")[0]
        info, lens = self.first(f"{base}/info"), self.first(f"{base}/info/camera_info")
        tf = next((name for name in sorted(self.connections) if name.startswith(f"{base}/tf/")), None)
        if info is None or lens is None or tf is None:
            raise Refusal(f"{shown(self.path)} says nothing usable of its cameras: record it again.")
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
