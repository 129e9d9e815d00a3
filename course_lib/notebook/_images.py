"""Colour and depth images from and to files: the image half of `files`.

A file is measured before OpenCV decodes it, which would return half an image and a line on stderr.
"""

from __future__ import annotations

import difflib
import os
import re
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np

from course_lib.notebook._atomic import atomic_file
from course_lib.notebook._errors import CannotWrite, Refusal, shown

PNG = b"\x89PNG\r\n\x1a\n"
SUFFIXES = (".png", ".jpg", ".jpeg", ".pgm", ".ppm")
DEPTH_SUFFIXES = (".png", ".pgm", ".tif", ".tiff", ".npy")
_PNM = re.compile(rb"\AP([56])(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)(?:\s|#[^\n]*\n)+(\d+)\s")


def there(path: str | Path, kinds: tuple[str, ...], what: str) -> Path:
    """Return the path of an existing, readable, non-empty file of one of these kinds.

    Raises
    ------
    Refusal
        If there is no such file (the nearest name beside it is suggested), it is empty, or it is of another kind.
    """
    path = Path(path)
    if path.suffix.lower() not in kinds:
        raise Refusal(f"{shown(path)} is not {what} that the course reads: use {', '.join(kinds)}.")
    if path.is_dir():
        raise Refusal(f"{shown(path)} is a folder, not a file: name one of the files in it.")
    if not path.exists():
        beside = [one.name for one in path.parent.iterdir()] if path.parent.is_dir() else []
        near = difflib.get_close_matches(path.name, beside, n=1)
        hint = f"did you mean {near[0]}?" if near else "check the name and the folder."
        raise Refusal(f"There is no file {shown(path)}: {hint}")
    if not os.access(path, os.R_OK):
        raise Refusal(f"{shown(path)} may not be read by you: change its permissions or copy it elsewhere.")
    if path.stat().st_size == 0:
        raise Refusal(f"{shown(path)} is empty (0 bytes): copy or download it again.")
    return path


def decode(content: bytes, path: Path) -> np.ndarray:
    """Decode a whole image file exactly as it is stored: bits, channels (BGR order) and values.

    Parameters
    ----------
    content : the file's bytes.
    path : where they come from, for the messages.

    Returns
    -------
    (H, W) or (H, W, 3 or 4) uint8, uint16 or, from a TIFF, float32. A PGM of 16 bits is read big-endian, as its
    format says.

    Raises
    ------
    Refusal
        If it is not the kind of image that its name says, ends early, or has a wrong checksum.
    """
    kind = path.suffix.lower()
    if kind == ".png":
        _check_png(content, path)
    elif kind in (".jpg", ".jpeg"):
        if not content.startswith(b"\xff\xd8"):
            raise _not_one(path, "JPEG", content)
        if b"\xff\xd9" not in content[-65536:]:
            raise _cut(path)
    elif kind in (".pgm", ".ppm"):
        _check_pnm(content, path)
    elif kind in (".tif", ".tiff"):
        if not content.startswith((b"II*\0", b"MM\0*")):
            raise _not_one(path, "TIFF", content)
    else:
        raise Refusal(f"{shown(path)} is not an image that the course reads: use {', '.join(SUFFIXES)}.")
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise Refusal(f"{shown(path)} cannot be decoded: its content is damaged; copy or download it again.")
    return image


def _cut(path: Path) -> Refusal:
    return Refusal(f"{shown(path)} is cut short: the image is not complete; copy or download it again.")


def _not_one(path: Path, kind: str, content: bytes) -> Refusal:
    if not content:
        return Refusal(f"{shown(path)} is empty (0 bytes): copy or download it again.")
    known = {PNG[:4]: "a PNG", b"\xff\xd8": "a JPEG", b"<": "a web page", b"version https": "a Git LFS pointer"}
    start = content[:64].lstrip()
    really = next((word for sign, word in known.items() if start.startswith(sign)), "something else")
    return Refusal(f"{shown(path)} is not a {kind}, its bytes are {really}: check what was saved under this name.")


def _check_png(content: bytes, path: Path) -> None:
    if not content.startswith(PNG):
        raise _cut(path) if content and PNG.startswith(content) else _not_one(path, "PNG", content)
    at, name = len(PNG), b""
    while name != b"IEND":
        if at + 12 > len(content):
            raise _cut(path)
        length, name = struct.unpack_from(">I4s", content, at)
        if at + 12 + length > len(content):
            raise _cut(path)
        (checksum,) = struct.unpack_from(">I", content, at + 8 + length)
        if zlib.crc32(content[at + 4 : at + 8 + length]) != checksum:
            raise Refusal(f"{shown(path)} is damaged: a checksum inside it is wrong; copy or download it again.")
        at += 12 + length


def _check_pnm(content: bytes, path: Path) -> None:
    match = _PNM.match(content)
    if not match:
        raise _not_one(path, "binary PGM or PPM", content)
    channels = {b"5": 1, b"6": 3}[match[1]]
    width, height, largest = (int(word) for word in match.groups()[1:])
    if len(content) - match.end() < width * height * channels * (1 + (largest > 255)):
        raise _cut(path)


def read_image(path: str | Path) -> np.ndarray:
    """Read a colour image (PNG, JPEG, PPM) as (H, W, 3) uint8 RGB; grey is repeated, transparency dropped.

    Raises
    ------
    Refusal
        If the file is missing, cut short, not an image, or has 16 bits a channel.
    """
    path = there(path, SUFFIXES, "an image")
    image = decode(path.read_bytes(), path)
    if image.dtype != np.uint8:
        raise Refusal(f"{shown(path)} has 16 bits a channel, so it is no colour picture: read it with read_depth.")
    if image.ndim == 2:
        return np.repeat(image[..., None], 3, axis=2)
    return np.ascontiguousarray(image[..., 2::-1])


def read_depth(path: str | Path) -> np.ndarray:
    """Read a depth image (PNG, PGM, TIFF or NumPy's .npy) as it is stored, in the recording's own units.

    `course_lib.camera.rgbd.decode_depth` turns it into metres.

    Returns
    -------
    (H, W) uint16, or float32 where the file holds floats.

    Raises
    ------
    Refusal
        If the file is missing, cut short, not an image, has 8 bits, or has colours.
    """
    path = there(path, DEPTH_SUFFIXES, "a depth image")
    image = _array(path) if path.suffix.lower() == ".npy" else decode(path.read_bytes(), path)
    if image.dtype == np.uint8:
        raise Refusal(
            f"{shown(path)} has 8 bits, which leaves 256 distances at most: it is a picture of depth, not depth; "
            "save the depth again as a 16-bit PNG."
        )
    if image.ndim != 2:
        raise Refusal(f"{shown(path)} has {image.shape[2]} channels and depth has one: choose the depth image.")
    if image.dtype.kind == "f":
        return image.astype(np.float32, copy=False)
    if image.dtype != np.uint16:
        if image.min() < 0 or image.max() > 65535:
            raise Refusal(f"{shown(path)} holds {image.min()} to {image.max()}: depth was expected, 0 to 65535.")
        image = image.astype(np.uint16)
    return image


def _array(path: Path) -> np.ndarray:
    """The image in a .npy file; nothing in it is run."""
    try:
        image = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise Refusal(f"{shown(path)} cannot be read as an array of numbers: copy or save it again.") from error
    image = image[..., 0] if isinstance(image, np.ndarray) and image.ndim == 3 and image.shape[2] == 1 else image
    if not isinstance(image, np.ndarray) or image.dtype.kind not in "fiu" or image.ndim not in (2, 3) or not image.size:
        raise Refusal(f"{shown(path)} holds no image of numbers: (H, W) depth was expected.")
    return image


def write_image(path: str | Path, image: np.ndarray) -> Path:
    """Write an (H, W, 3) uint8 RGB image as PNG or JPEG, whole or not at all.

    Raises
    ------
    Refusal
        If the array is not such an image or the ending is unknown.
    CannotWrite
        If the disk is full or the folder is read-only.
    """
    image = np.asarray(image)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        raise Refusal(f"A colour image is (H, W, 3) uint8 and this is {image.shape} {image.dtype}: convert it first.")
    return _write(Path(path), image[..., ::-1], (".png", ".jpg", ".jpeg", ".ppm"))


def write_depth(path: str | Path, raw: np.ndarray) -> Path:
    """Write an (H, W) uint16 depth image as PNG or PGM, whole or not at all.

    Raises
    ------
    Refusal
        If the array is not uint16 (`course_lib.camera.rgbd.encode_depth` encodes metres) or the ending is unknown.
    CannotWrite
        If the disk is full or the folder is read-only.
    """
    raw = np.asarray(raw)
    if raw.dtype != np.uint16 or raw.ndim != 2:
        raise Refusal(
            f"A depth file holds (H, W) uint16 and this is {raw.shape} {raw.dtype}: encode metres with "
            "rgbd.encode_depth."
        )
    return _write(Path(path), raw, (".png", ".pgm"))


def _write(path: Path, image: np.ndarray, kinds: tuple[str, ...]) -> Path:
    if path.suffix.lower() not in kinds:
        raise Refusal(f"{shown(path)} cannot hold this image: end the name in {', '.join(kinds)}.")
    done, content = cv2.imencode(path.suffix.lower(), np.ascontiguousarray(image))
    if not done:
        raise CannotWrite(f"OpenCV could not encode {shown(path)}: check the image's size, {image.shape}.")
    with atomic_file(path, content.nbytes) as partial:
        partial.write_bytes(content.tobytes())
    return path
