"""Is a PLY, PCD or XYZ file whole? Asked before Open3D reads it.

Open3D returns as many points as the header of a PLY promises even where the file ends early, the rest whatever was in
memory, and its PLY parser prints to stderr. So headers and bodies are measured here first.

References
----------
PLY: Greg Turk, The PLY Polygon File Format, 1994. PCD: https://pointclouds.org/documentation/tutorials/pcd_file_format.html
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from course_lib.notebook._errors import Refusal, shown

PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
MAX_HEADER = 100_000


@dataclass(frozen=True)
class Element:
    """One element of a PLY header: `count` rows of properties, (name, type) or (name, type of count, type of item)."""

    name: str
    count: int
    properties: tuple[tuple[str, ...], ...]

    @property
    def has_list(self) -> bool:
        return any(len(one) == 3 for one in self.properties)


@dataclass(frozen=True)
class Header:
    """What the header of a cloud or mesh file says.

    Attributes
    ----------
    counts : element → how many ("vertex", "face"; a PCD or XYZ has "vertex" only).
    shape : (height, width) of an organised PCD, or None.
    fields : names of the properties of a vertex.
    """

    counts: dict[str, int]
    fields: tuple[str, ...]
    shape: tuple[int, int] | None = None


def _cut(path: Path, promised: str, there: str) -> Refusal:
    what = f"its header promises {promised} and {there}"
    return Refusal(f"{shown(path)} is cut short: {what}; copy or download it again.")


def _not_one(path: Path, kind: str, why: str) -> Refusal:
    return Refusal(f"{shown(path)} is not a {kind} file ({why}): check that the download or copy is the right file.")


def check_ply(path: Path) -> Header:
    """Read a PLY header and prove that the body holds what it promises.

    Raises
    ------
    Refusal
        If the file is not a PLY, or ends early.
    """
    content = path.read_bytes()
    if not content.startswith((b"ply\n", b"ply\r\n")):
        raise _not_one(path, "PLY", "it does not begin with the word ply")
    end = content.find(b"end_header", 0, MAX_HEADER)
    newline = content.find(b"\n", end)
    if end < 0 or newline < 0:
        raise _cut(path, "a body", "the file ends inside the header")
    form, elements = "", []
    for line in content[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        if words[:1] == ["format"] and len(words) > 1:
            form = words[1]
        elif words[:1] == ["element"] and len(words) == 3 and words[2].isdigit():
            elements.append(Element(words[1], int(words[2]), ()))
        elif words[:1] == ["property"] and len(words) >= 3 and elements:
            one = (words[-1], *words[2:4]) if words[1] == "list" else (words[-1], words[1])
            last = elements[-1]
            elements[-1] = Element(last.name, last.count, (*last.properties, one))
    types = {kind for element in elements for one in element.properties for kind in one[1:]}
    known = form in ("ascii", "binary_little_endian", "binary_big_endian") and types <= set(PLY_TYPES)
    if not known or not elements:
        raise _not_one(path, "PLY", "its header names no format or types that PLY has")
    body = memoryview(content)[newline + 1 :]
    if form == "ascii":
        _measure_ascii(path, body, elements)
    else:
        _measure_binary(path, body, elements, "<" if "little" in form else ">")
    vertex = next((element for element in elements if element.name == "vertex"), Element("vertex", 0, ()))
    return Header({e.name: e.count for e in elements}, tuple(one[0] for one in vertex.properties))


def _measure_ascii(path: Path, body: memoryview, elements: list[Element]) -> None:
    lines = [line for line in bytes(body).split(b"\n") if line.strip()]
    start = 0
    for element in elements:
        there = min(element.count, len(lines) - start)
        promised = f"{element.count:,} of element {element.name}"
        if there < element.count:
            raise _cut(path, promised, f"the file ends after {there:,}")
        if there:
            words = lines[start + there - 1].split()
            need = len(element.properties)
            if len(element.properties) == 1 and element.has_list:
                need += int(words[0]) if words[0].isdigit() else 0
            if len(words) < need:
                raise _cut(path, promised, "the last one is incomplete")
        start += there


def _measure_binary(path: Path, body: memoryview, elements: list[Element], order: str) -> None:
    at = 0
    for element in elements:
        promised = f"{element.count:,} of element {element.name}"
        if not element.has_list:
            size = sum(np.dtype(PLY_TYPES[one[1]]).itemsize for one in element.properties)
            there = min(element.count, (len(body) - at) // size) if size else element.count
            at += element.count * size
        else:
            at, there = _walk_lists(body, at, element, order)
        if there < element.count:
            raise _cut(path, promised, f"the file ends after {there:,}")


def _walk_lists(body: memoryview, at: int, element: Element, order: str) -> tuple[int, int]:
    """Step over the rows of an element with lists; return where they end and how many are whole."""
    steps = [tuple(np.dtype(PLY_TYPES[kind]) for kind in one[1:]) for one in element.properties]
    for row in range(element.count):
        for head, *item in steps:
            if not item:
                at += head.itemsize
                continue
            if at + head.itemsize > len(body):
                return at, row
            (items,) = struct.unpack_from(order + head.char, body, at)
            at += head.itemsize + int(items) * item[0].itemsize
        if at > len(body):
            return at, row
    return at, element.count


def check_pcd(path: Path) -> Header:
    """Read a PCD header and prove that the body holds what it promises.

    Raises
    ------
    Refusal
        If the file is not a PCD, or ends early.
    """
    content = path.read_bytes()
    entries: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in entries:
        end = content.find(b"\n", at, MAX_HEADER)
        if end < 0:
            if entries:
                raise _cut(path, "points", "the file ends inside the header")
            raise _not_one(path, "PCD", "it has no header")
        words = content[at:end].decode("ascii", "replace").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            if not entries and words[0] not in ("VERSION", "FIELDS", "COLUMNS"):
                raise _not_one(path, "PCD", "it does not begin with VERSION or FIELDS")
            entries[words[0]] = words[1:]
    fields = tuple(entries.get("FIELDS", entries.get("COLUMNS", [])))
    try:
        width, height = int(entries["WIDTH"][0]), int(entries.get("HEIGHT", ["1"])[0])
        points = int(entries.get("POINTS", [str(width * height)])[0])
        sizes = [int(word) for word in entries["SIZE"]]
        counts = [int(word) for word in entries.get("COUNT", ["1"] * len(sizes))]
        kind = entries["DATA"][0]
    except (KeyError, IndexError, ValueError) as error:
        raise _not_one(path, "PCD", "its header lacks a line that PCD needs") from error
    stride = sum(size * count for size, count in zip(sizes, counts, strict=False))
    body, promised = content[at:], f"{points:,} points"
    if kind == "ascii":
        lines = [line for line in body.split(b"\n") if line.strip()]
        if len(lines) < points or (points and len(lines[points - 1].split()) < sum(counts)):
            raise _cut(path, promised, f"the file ends after {min(len(lines), points) - (len(lines) >= points):,}")
    elif kind == "binary":
        if len(body) < points * stride:
            raise _cut(path, promised, f"the file ends after {len(body) // stride:,}")
    elif kind == "binary_compressed":
        packed, unpacked = struct.unpack_from("<II", body) if len(body) >= 8 else (0, 0)
        if len(body) < 8 + packed or unpacked < points * stride:
            raise _cut(path, promised, "the compressed block is incomplete")
    else:
        raise _not_one(path, "PCD", f"it stores its points as {kind!r}")
    return Header({"vertex": points}, fields, (height, width) if height > 1 else None)


def check_xyz(path: Path) -> Header:
    """Prove that every line of an XYZ file holds three numbers (more columns are allowed and not read).

    Raises
    ------
    Refusal
        If a line does not.
    """
    count = 0
    for at, line in enumerate(path.read_bytes().split(b"\n"), start=1):
        words = line.split()
        if not words or words[0].startswith(b"#"):
            continue
        try:
            numbers = [float(word) for word in words[:3]]
        except ValueError:
            numbers = []
        if len(numbers) < 3:
            raise Refusal(f"Line {at} of {shown(path)} holds no three numbers: the file is cut short or is not XYZ.")
        count += 1
    return Header({"vertex": count}, ("x", "y", "z"))
