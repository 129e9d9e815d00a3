"""Reading PCD files: text, binary or compressed, with any fields.

References
----------
The PCD file format: https://pointclouds.org/documentation/tutorials/pcd_file_format.html
Marc Lehmann, LibLZF: how the compressed block is packed.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from course_lib.notebook._columns import Stored, cut, more_than, not_one, text_table, typed
from course_lib.notebook._errors import Refusal, shown

KINDS = ("VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
TYPES = {f"{kind} {size}": f"<{kind.lower()}{size}" for kind in "IU" for size in (1, 2, 4, 8)}
TYPES |= {"F 4": "<f4", "F 8": "<f8"}
MAX_HEADER = 100_000


def read_pcd(path: Path) -> Stored:
    """Read a PCD file whole. Fields named _ fill up and are left.

    Raises
    ------
    Refusal
        If it is no PCD, its header contradicts itself, or its body is shorter or longer than promised.
    """
    content = path.read_bytes()
    entries, above, start = _header(path, content)
    dtype, shape = _row_type(path, entries), _shape(path, entries)
    count, kind, body = shape[0] * shape[1], entries["DATA"], content[start:]
    if kind == ["ascii"]:
        rows = _text_rows(path, body, dtype, count, above)
    elif kind == ["binary"]:
        rows = _binary_rows(path, body, dtype, count)
    elif kind == ["binary_compressed"]:
        rows = _packed_rows(path, body, dtype, count)
    else:
        raise not_one(path, "PCD", f"it stores its points as {' '.join(kind)!r}")
    columns = {name: column for name, column in rows.items() if not name.startswith("_")}
    return Stored(path, count, columns, shape=shape if shape[0] > 1 else None)


def _header(path: Path, content: bytes) -> tuple[dict[str, list[str]], int, int]:
    """The words after each name, how many lines the header has, and where the body begins."""
    entries: dict[str, list[str]] = {}
    at = number = 0
    while "DATA" not in entries:
        end = content.find(b"\n", at, MAX_HEADER)
        if end < 0:
            if entries:
                raise cut(path, "points", "the file ends inside the header")
            raise not_one(path, "PCD", "it has no header")
        words, at, number = content[at:end].decode("utf-8", "replace").split(), end + 1, number + 1
        if not words or words[0].startswith("#"):
            continue
        if not entries and words[0] not in ("VERSION", "FIELDS", "COLUMNS"):
            raise not_one(path, "PCD", "it does not begin with VERSION or FIELDS")
        if words[0] not in KINDS or words[0] in entries:
            raise not_one(path, "PCD", f"line {number} of its header is {' '.join(words)[:60]!r}")
        entries["FIELDS" if words[0] == "COLUMNS" else words[0]] = words[1:]
    if lacking := {"FIELDS", "SIZE", "TYPE", "WIDTH"} - set(entries):
        raise not_one(path, "PCD", f"its header lacks a line that PCD needs, {min(lacking)}")
    return entries, number, at


def _row_type(path: Path, entries: dict[str, list[str]]) -> np.dtype:
    fields, sizes, types = (entries[name] for name in ("FIELDS", "SIZE", "TYPE"))
    counts = entries.get("COUNT", ["1"] * len(fields))
    if not len(fields) == len(sizes) == len(types) == len(counts) > 0:
        raise not_one(path, "PCD", f"its {len(fields)} FIELDS need as many words after SIZE, TYPE and COUNT")
    columns = []
    for i, (name, size, kind, several) in enumerate(zip(fields, sizes, types, counts, strict=True)):
        if f"{kind} {size}" not in TYPES or not several.isdecimal() or not 0 < int(several) < 10_000:
            raise not_one(path, "PCD", f"its field {name} has TYPE {kind}, SIZE {size} and COUNT {several}")
        columns.append((f"_{i}" if name == "_" else name, TYPES[f"{kind} {size}"], (int(several),)))
    names = [name for name, *_ in columns]
    if twice := {name for name in names if names.count(name) > 1}:
        raise not_one(path, "PCD", f"it has the field {min(twice)} twice")
    return np.dtype(columns)


def _shape(path: Path, entries: dict[str, list[str]]) -> tuple[int, int]:
    """Rows and columns, which are as many points as promised."""
    words = [entries["WIDTH"], entries.get("HEIGHT", ["1"])]
    words.append(entries.get("POINTS", []) or ["0"])
    if any(len(word) != 1 or not word[0].isdecimal() for word in words):
        raise not_one(path, "PCD", "its WIDTH, HEIGHT or POINTS is no whole number")
    width, height, points = (int(word[0]) for word in words)
    if "POINTS" in entries and width * height != points:
        raise Refusal(
            f"{shown(path)} contradicts itself: {width:,} x {height:,} are {width * height:,} points and its header "
            f"promises {points:,}; save it again."
        )
    return height, width


def _text_rows(path: Path, body: bytes, dtype: np.dtype, count: int, above: int) -> dict[str, np.ndarray]:
    lines = [(number, line) for number, line in enumerate(body.splitlines(), above + 1) if line.strip()]
    names = [name for name in dtype.names for _ in range(dtype[name].shape[0])]
    whole = len(lines) - bool(lines and len(lines[-1][1].split()) < len(names))
    if len(lines) < count or (len(lines) == count and whole < count):
        raise cut(path, f"{count:,} points", f"the file ends after {min(whole, count):,}")
    if len(lines) > count:
        raise more_than(path, f"{count:,} points")
    table = text_table(path, lines, names)
    rows, at = {}, 0
    for name in dtype.names:
        kind, (several,) = dtype[name].base, dtype[name].shape
        column, at = table[:, at : at + several], at + several
        packed = name in ("rgb", "rgba") and kind == np.float32
        rows[name] = _bits(path, name, column) if packed else typed(path, name, column, kind)
        rows[name] = rows[name][:, 0] if several == 1 else rows[name]
    return rows


def _bits(path: Path, name: str, numbers: np.ndarray) -> np.ndarray:
    """Packed colours in text under TYPE F: whole numbers as PCL writes them, or the floats that have these bits."""
    whole = numbers >= 1
    bits = numbers.astype(np.float32).view(np.uint32)
    bits[whole] = typed(path, name, numbers[whole], np.dtype(np.uint32))
    return bits


def _binary_rows(path: Path, body: bytes, dtype: np.dtype, count: int) -> dict[str, np.ndarray]:
    there = len(body) // dtype.itemsize
    if there < count:
        raise cut(path, f"{count:,} points", f"the file ends after {there:,}")
    if body[count * dtype.itemsize :].strip(b"\r\n\0 "):
        raise more_than(path, f"{count:,} points")
    rows = np.frombuffer(body, dtype, count)
    return {
        name: rows[name][:, 0].copy() if rows[name].shape[1:] == (1,) else rows[name].copy() for name in dtype.names
    }


def _packed_rows(path: Path, body: bytes, dtype: np.dtype, count: int) -> dict[str, np.ndarray]:
    """A compressed block holds field after field, each of all points."""
    if count == 0:
        return {name: np.zeros(0, dtype[name].base) for name in dtype.names}
    packed, size = struct.unpack_from("<II", body) if len(body) >= 8 else (0, 0)
    promised = f"{count:,} points"
    if len(body) < 8 + packed or packed == 0:
        raise cut(path, promised, "the compressed block is incomplete")
    if size != count * dtype.itemsize:
        raise cut(path, promised, f"the compressed block holds {size // dtype.itemsize:,}")
    if body[8 + packed :].strip(b"\r\n\0 "):
        raise more_than(path, promised)
    from course_lib.notebook.lzf_loops import unpack  # imported where it is needed: its loop is compiled

    block = np.empty(size, np.uint8)
    if unpack(np.frombuffer(body, np.uint8, packed, 8), block) != size:
        raise Refusal(f"{shown(path)} is damaged: its compressed block cannot be unpacked; copy or download it again.")
    rows, at = {}, 0
    for name in dtype.names:
        column = block[at : (at := at + count * dtype[name].itemsize)].view(dtype[name].base)
        rows[name] = column if dtype[name].shape == (1,) else column.reshape(count, -1)
    return rows
