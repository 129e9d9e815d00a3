"""What the two formats of RealSense recordings have in common."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from course_lib.camera.pinhole import PinholeCamera
from course_lib.notebook._errors import Refusal, shown

IMAGES = re.compile(r"(?P<sensor>/device_\d+/sensor_\d+)/(?P<kind>Depth|Color)_\d+/image/data(/compressed(Depth)?)?")


WIDEST = 4096
"""Pixels along a side of an image; more is a spoiled number."""


TO_RGB = {"rgb8": None, "bgr8": cv2.COLOR_BGR2RGB, "rgba8": cv2.COLOR_RGBA2RGB, "bgra8": cv2.COLOR_BGRA2RGB}


@dataclass(frozen=True)
class Stream:
    """What a recording says of its depth or its colour.

    Parameters
    ----------
    topic : where its images are; those of its sensor and itself begin with the same words.
    camera : intrinsics without distortion.
    lens : librealsense's name of the distortion model, and its five coefficients.
    rate : images a second, as it was asked to give.
    T_stream_reference : (4, 4) maps points of the frame called `reference` to its own.
    clock : whose clock the stamps are read from; "" where it is not told or changes.
    stamps, arrivals : (N,) seconds of each image, by that clock and by the recorder's, in the order of the file.
    units : (N,) metres a raw unit, as each depth image says; NaN where it does not.
    """

    topic: str
    camera: PinholeCamera
    lens: tuple[str, tuple[float, ...]]
    rate: float
    reference: str
    T_stream_reference: np.ndarray
    clock: str
    stamps: np.ndarray
    arrivals: np.ndarray
    units: np.ndarray


def printable(text: str) -> str:
    """The text in one line, without what a terminal would obey."""
    return "".join(one if one.isprintable() else " " for one in text)


class Recording:
    """What both formats have in common."""

    def __init__(self, path: Path, reader: Any, store: str):
        from rosbags.typesys import Stores, get_typestore

        self.path, self.reader = path, reader
        self.store = get_typestore(Stores(store))
        reader.open()
        self.connections = {each.topic: each for each in reader.connections}

    def messages(self, topic: str) -> Iterator[tuple[float, bytes]]:
        """Time of arrival in seconds and bytes of each message of a topic."""
        if topic in self.connections:
            for _, nanoseconds, message in self.reader.messages([self.connections[topic]]):
                yield nanoseconds * 1e-9, message

    def first(self, topic: str) -> Any:
        """The first message of a topic, or None."""
        return next((self.decode(topic, message) for _, message in self.messages(topic)), None)

    def topics_of(self, kind: str) -> tuple[str, str, str]:
        """Topics of a kind: of its images, what they all begin with, and where its sensor stands."""
        found = sorted(name for name in self.connections if (m := IMAGES.fullmatch(name)) and m["kind"] == kind)
        if found:
            base = found[0].partition("/image/")[0]
            places = sorted(name for name in self.connections if name.startswith(f"{base}/tf/"))
            return found[0], base, places[0] if places else ""
        if not any(name.startswith("/device_") for name in self.connections):
            raise Refusal(
                f"{shown(self.path)} was not recorded by librealsense: record it with the RealSense Viewer, or extract "
                "color/ and depth/ from it."
            )
        raise Refusal(f"{shown(self.path)} holds no {'colour' if kind == 'Color' else 'depth'}: record both streams.")

    def useless(self) -> Refusal:
        return Refusal(f"{shown(self.path)} says nothing usable of its cameras: record it again.")

    def believable(self, camera: tuple, rate: float, coefficients: tuple[float, ...]) -> PinholeCamera:
        """The camera, if its numbers can be those of one."""
        width, height, fx, fy, cx, cy = camera
        sane = np.isfinite((*camera, rate, *coefficients)).all() and rate > 0 and len(coefficients) in (0, 5)
        sane = sane and 0 < width <= WIDEST and 0 < height <= WIDEST and all(abs(each) < 1000 for each in coefficients)
        sane = sane and all(0.05 < f / width < 20 for f in (fx, fy)) and abs(cx) < 10 * width and abs(cy) < 10 * height
        if not sane:
            raise self.useless()
        return PinholeCamera(int(width), int(height), fx, fy, cx, cy)

    def units(self, depth: Stream, wanted: list[int]) -> float:
        """Raw units a metre of the wanted images: as they say, or else as the sensor was set when recording began."""
        told = depth.units[wanted]
        told = told[np.isfinite(told) & (told > 0)]
        if len(told) and told.max() > 1.001 * told.min():
            raise Refusal(f"{shown(self.path)} changes the unit of its depth while it runs: record it with one unit.")
        metres = float(told[0]) if len(told) else self.unit_in_metres(depth)
        if metres is None or not 1e-6 < metres < 1:
            raise Refusal(f"{shown(self.path)} does not say the unit of its depth: record it again.")
        return float(np.round(1 / metres, 3))

    def images(self, stream: Stream, wanted: list[int]) -> list[np.ndarray]:
        """Images by their places in the file, decoded: (H, W, 3) uint8 RGB or (H, W) uint16."""
        places, found = set(wanted), {}
        for place, (_, message) in enumerate(self.messages(stream.topic)):
            if place in places:
                found[place] = self.image(stream, message)
                if len(found) == len(places):
                    break
        return [found[place] for place in wanted]

    def checked(self, stream: Stream, image: np.ndarray | None) -> np.ndarray:
        """The image, if it is what its stream promises."""
        depth = "/Depth_" in stream.topic
        size = (stream.camera.height, stream.camera.width)
        good = image is not None and image.shape == (size if depth else (*size, 3))
        if not good or image.dtype != (np.uint16 if depth else np.uint8):
            what = "depth" if depth else "colour"
            raise Refusal(f"{shown(self.path)} holds {what} that cannot be read: record Z16 depth and RGB8 colour.")
        return image


def only(words: set[str]) -> str:
    """The only one of the words, or ""."""
    return next(iter(words)) if len(words) == 1 else ""
