"""A .db3, which librealsense has written since 2.57 (ROS 2); what is said of the cameras stands there as text."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any
from urllib.parse import quote

import cv2
import numpy as np
import PIL
import PIL.Image

from course_lib.geometry.transforms import from_rotation_translation
from course_lib.notebook._bag_common import IMAGES, TO_RGB, Recording, Stream, only, printable
from course_lib.notebook._errors import Refusal, shown

COMPRESSED_DEPTH_HEADER = 12
"""Bytes before the PNG in a message of ROS's compressedDepth."""


class Ros2(Recording):
    """A .db3, in which what is said of the cameras stands as text, `name=value` with semicolons between."""

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
        topic = self.topic_of(kind)
        base = topic.partition("/image/")[0]
        info, lens = self.said(f"{base}/info"), self.said(f"{base}/camera_info")
        tf = next((name for name in sorted(self.connections) if name.startswith(f"{base}/tf/")), None)
        if not info or not lens or tf is None:
            raise Refusal(f"{shown(self.path)} says nothing usable of its cameras: record it again.")
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
