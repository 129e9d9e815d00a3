"""Reading PLY files: text or binary, either order of bytes, any scalar types, in any order.

References
----------
Greg Turk, The PLY Polygon File Format, 1994.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from course_lib.notebook._columns import Stored, cut, more_than, not_one, text_table, typed
from course_lib.notebook._errors import Refusal, shown

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
CORNERS = ("vertex_indices", "vertex_index")
MAX_HEADER = 100_000


Rows = tuple[tuple[int, ...], dict[str, np.ndarray]]
"""Rows whose lists have these lengths: name → (rows, how many) numbers of the file's type."""


@dataclass(frozen=True)
class Element:
    """One element of a header: `count` rows of properties; a list has two types, of its length and of its items."""

    name: str
    count: int
    properties: dict[str, tuple[np.dtype, ...]] = field(default_factory=dict)

    @property
    def lists(self) -> list[str]:
        return [name for name, types in self.properties.items() if len(types) == 2]

    @property
    def promised(self) -> str:
        return f"{self.count:,} of element {self.name}"

    def fields(self, lengths: tuple[int, ...]) -> list[tuple[str, np.dtype, int]]:
        """What stands in a row whose lists have these lengths: name, type and how many."""
        rest, fields = iter(lengths), []
        for name, (kind, *item) in self.properties.items():
            fields += [(f"length of {name}", kind, 1), (name, item[0], next(rest))] if item else [(name, kind, 1)]
        return fields


def read_ply(path: Path) -> Stored:
    """Read a PLY file whole.

    Raises
    ------
    Refusal
        If it is no PLY, its header has a line that PLY does not know, or its body is shorter or longer than promised.
    """
    content = path.read_bytes()
    newline = next((end for end in (b"\r\n", b"\n", b"\r") if content.startswith(b"ply" + end)), None)
    if newline is None:
        raise not_one(path, "PLY", "it does not begin with the word ply")
    order, elements, above, start = _header(path, content, newline)
    body = (
        _text_body(path, content[start:], elements, above)
        if order == ""
        else _binary_body(path, content, start, elements, order)
    )
    count, columns, faces = 0, {}, None
    for element, parts in body:
        if element.name == "vertex":
            count = element.count
            columns = (
                {} if element.lists else {name: column[:, 0] for _, part in parts for name, column in part.items()}
            )
        elif element.name == "face" and (name := next((n for n in CORNERS if n in element.lists), None)):
            faces = {}
            for _, part in parts:
                if part[name].dtype.kind == "f":
                    raise Refusal(f"{shown(path)} holds the corners of its faces as floats: save them as int.")
                corners = part[name].astype(np.int64)
                faces[corners.shape[1]] = np.concatenate([faces.get(corners.shape[1], corners[:0]), corners])
    return Stored(path, count, columns, faces)


def _header(path: Path, content: bytes, newline: bytes) -> tuple[str, list[Element], int, int]:
    """The order of bytes ("" for text), the elements, how many lines the header has, and where the body begins."""
    order, elements, number, at = None, [], 1, len(b"ply" + newline)
    while True:
        end = content.find(newline, at, MAX_HEADER)
        if end < 0:
            raise cut(path, "a body", "the file ends inside the header")
        line = content[at:end].decode("utf-8", "replace")
        words, at, number = line.split(), end + len(newline), number + 1
        match words:
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", form, _] if form in ORDERS:
                order = ORDERS[form]
            case ["element", name, count] if count.isdecimal() and name not in {one.name for one in elements}:
                elements.append(Element(name, int(count)))
            case ["property", kind, name] if kind in TYPES and elements and name not in elements[-1].properties:
                elements[-1].properties[name] = (np.dtype(TYPES[kind]),)
            case ["property", "list", length, kind, name] if (
                TYPES.get(length, "f")[0] in "iu" and kind in TYPES and elements and name not in elements[-1].properties
            ):
                elements[-1].properties[name] = (np.dtype(TYPES[length]), np.dtype(TYPES[kind]))
            case ["end_header"] if (
                order is not None and elements and all(e.properties or not e.count for e in elements)
            ):
                return order, elements, number, at
            case _:
                said = line[:60] if words != ["end_header"] else "end_header, before a format and properties"
                raise not_one(path, "PLY", f"line {number} of its header is {said!r}")


def _text_body(path: Path, body: bytes, elements: list[Element], above: int) -> Iterator[tuple[Element, list[Rows]]]:
    lines = [(number, line) for number, line in enumerate(body.splitlines(), above + 1) if line.strip()]
    for element in elements:
        rows, lines = lines[: element.count], lines[element.count :]
        if len(rows) < element.count:
            raise cut(path, element.promised, f"the file ends after {len(rows):,}")
        groups: dict[tuple[int, ...], list[tuple[int, bytes]]] = {} if element.lists else {(): rows}
        for row in rows if element.lists else ():
            groups.setdefault(_text_lengths(row[1].split(), element), []).append(row)
        if rows and not lines:
            words = rows[-1][1].split()
            if len(words) < sum(count for *_, count in element.fields(_text_lengths(words, element))):
                raise cut(path, element.promised, "the last one is incomplete")
        yield element, [(lengths, _text_rows(path, element.fields(lengths), some)) for lengths, some in groups.items()]
    if lines:
        raise more_than(path, elements[-1].promised)


def _text_lengths(words: list[bytes], element: Element) -> tuple[int, ...]:
    """The lengths of the lists in a line; 0 where the word is no length, which is found when the line is read."""
    at, lengths = 0, []
    for types in element.properties.values():
        if len(types) == 2:
            word = words[at] if at < len(words) else b""
            lengths.append(int(word) if word.isdigit() and len(word) < 10 else 0)
            at += lengths[-1]
        at += 1
    return tuple(lengths)


def _text_rows(
    path: Path, fields: list[tuple[str, np.dtype, int]], lines: list[tuple[int, bytes]]
) -> dict[str, np.ndarray]:
    table = text_table(path, lines, [name for name, _, count in fields for _ in range(count)])
    ends = np.cumsum([0, *(count for *_, count in fields)])
    parts = {
        name: typed(path, name, table[:, a:b], kind)
        for (name, kind, _), a, b in zip(fields, ends, ends[1:], strict=False)
    }
    for name, _, length in fields:
        if f"length of {name}" in parts and (parts[f"length of {name}"] != length).any():
            raise Refusal(f"{shown(path)} holds a list of {name} whose length is no whole number: save it again.")
    return parts


def _binary_body(
    path: Path, content: bytes, at: int, elements: list[Element], order: str
) -> Iterator[tuple[Element, list[Rows]]]:
    for element in elements:
        groups, at = _places(path, content, at, element, order)
        parts = []
        for lengths, places in groups.items():
            dtype = _row_type(element, lengths, order)
            if isinstance(places, int):
                rows = np.frombuffer(content, dtype, element.count, places)
            else:
                every = np.add.outer(places, np.arange(dtype.itemsize))
                rows = np.frombuffer(content, np.uint8)[every].view(dtype)[:, 0]
            native = {name: rows[name].astype(rows[name].dtype.newbyteorder("=")) for name in dtype.names}
            parts.append((lengths, {name: column.reshape(len(rows), -1) for name, column in native.items()}))
        yield element, parts
    if content[at:].strip(b"\r\n\0 "):
        raise more_than(path, elements[-1].promised)


def _row_type(element: Element, lengths: tuple[int, ...], order: str) -> np.dtype:
    fields = element.fields(lengths)
    return np.dtype([(name, kind.newbyteorder(order), (count,)) for name, kind, count in fields])


def _places(
    path: Path, content: bytes, at: int, element: Element, order: str
) -> tuple[dict[tuple[int, ...], int | list[int]], int]:
    """Where the rows lie, by the lengths of their lists (one number where all follow one another), and their end."""
    if element.count == 0:
        return {}, at
    first, size = _binary_lengths(content, at, element, order)
    there = (len(content) - at) // size
    if there >= element.count:
        rows = np.frombuffer(content, _row_type(element, first, order), element.count, at)
        if all((rows[f"length of {name}"] == length).all() for name, length in zip(element.lists, first, strict=True)):
            return {first: at}, at + element.count * size
    elif not element.lists:
        raise cut(path, element.promised, f"the file ends after {there:,}")
    groups: dict[tuple[int, ...], list[int]] = {}
    for row in range(element.count):
        lengths, size = _binary_lengths(content, at, element, order)
        if at + size > len(content):
            raise cut(path, element.promised, f"the file ends after {row:,}")
        groups.setdefault(lengths, []).append(at)
        at += size
    return groups, at


def _binary_lengths(content: bytes, at: int, element: Element, order: str) -> tuple[tuple[int, ...], int]:
    """The lengths of the lists of the row that begins here, and its size in bytes, which may lie beyond the end."""
    begin, lengths = at, []
    for kind, *item in element.properties.values():
        if item:
            word = content[at : at + kind.itemsize].ljust(kind.itemsize, b"\0")
            lengths.append(max(0, int(np.frombuffer(word, kind.newbyteorder(order))[0])))
            at += lengths[-1] * item[0].itemsize
        at += kind.itemsize
    return tuple(lengths), at - begin
