"""Files of points read value by value, slowly, by the letter of their formats: what the course's reader is held to."""

from __future__ import annotations

import re
import struct

LETTERS = {
    **dict.fromkeys(("char", "int8", "I1"), "b"), **dict.fromkeys(("uchar", "uint8", "U1"), "B"),
    **dict.fromkeys(("short", "int16", "I2"), "h"), **dict.fromkeys(("ushort", "uint16", "U2"), "H"),
    **dict.fromkeys(("int", "int32", "I4"), "i"), **dict.fromkeys(("uint", "uint32", "U4"), "I"),
    **dict.fromkeys(("float", "float32", "F4"), "f"), **dict.fromkeys(("double", "float64", "F8"), "d"),
    "I8": "q", "U8": "Q",
}  # fmt: skip
Number = int | float


class No(Exception):
    """This file is not as its format says."""


def _text_value(word: bytes, letter: str) -> Number:
    try:
        value = float(word)
    except ValueError:
        raise No(word) from None
    if b"_" in word:
        raise No(word)
    if letter == "packed" and value >= 1:
        letter = "I"
    if letter == "packed":
        return struct.unpack("I", struct.pack("f", value))[0]
    if letter == "f":
        return struct.unpack("f", struct.pack("f", value))[0] if abs(value) < 3.4e38 else value
    if letter == "d":
        return value
    if value != value or value in (float("inf"), float("-inf")) or value != int(value):
        raise No(word)
    try:
        struct.pack(letter, int(value))
    except struct.error:
        raise No(word) from None
    return int(value)


class Words:
    """A text body, a line a row."""

    def __init__(self, body: bytes):
        self.lines = [line.split() for line in re.split(rb"\r\n|\r|\n", body) if line.split()]
        self.row: list[bytes] = []

    def begin(self) -> None:
        if not self.lines:
            raise No("too short")
        self.row = list(self.lines.pop(0))

    def take(self, letter: str) -> Number:
        if not self.row:
            raise No("too short a line")
        return _text_value(self.row.pop(0), letter)

    def end(self) -> None:
        if self.row:
            raise No("too long a line")

    def close(self) -> None:
        if self.lines:
            raise No("more lines")


class Bytes:
    """A binary body."""

    def __init__(self, body: bytes, order: str):
        self.body, self.at, self.order = body, 0, order

    def begin(self) -> None:
        pass

    end = begin

    def take(self, letter: str) -> Number:
        size = struct.calcsize(letter)
        if self.at + size > len(self.body):
            raise No("too short")
        (value,) = struct.unpack_from(self.order + letter, self.body, self.at)
        self.at += size
        return value

    def close(self) -> None:
        if self.body[self.at :].strip(b"\r\n\0 "):
            raise No("more bytes")


def ply(content: bytes) -> tuple[dict[str, list[Number]], list[list[Number]]]:
    """Columns of the vertices, and the faces."""
    match = re.match(rb"ply(\r\n|\n|\r)", content)
    if not match:
        raise No("no ply")
    end = match[1]
    at, form, elements, words = match.end(), "", [], []
    while words != ["end_header"]:
        stop = content.find(end, at)
        if stop < 0:
            raise No("no end")
        words, at = content[at:stop].decode("utf-8", "replace").split(), stop + len(end)
        if words[:1] == ["format"] and len(words) == 3:
            form = words[1]
        elif words[:1] == ["element"] and len(words) == 3 and re.fullmatch("[0-9]+", words[2]):
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"] and len(words) in (3, 5) and elements:
            if len(words) == 5 and words[1] != "list":
                raise No(words)
            letters = [
                LETTERS.get(word, "") if word.islower() else "" for word in words[2 if len(words) == 5 else 1 : -1]
            ]
            if not all(letters) or (len(letters) == 2 and letters[0] in "fd"):
                raise No(words)
            elements[-1][2].append((words[-1], letters))
        elif words and words[0] not in ("comment", "obj_info", "end_header"):
            raise No(words)
    orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
    if form not in orders or len({name for name, *_ in elements}) < len(elements):
        raise No(form)
    body = Bytes(content[at:], orders[form]) if orders[form] else Words(content[at:])
    columns, faces = {}, []
    for name, count, properties in elements:
        if len({one for one, _ in properties}) < len(properties) or (count and not properties):
            raise No(name)
        for _ in range(count):
            body.begin()
            for one, letters in properties:
                if len(letters) == 1:
                    value = body.take(letters[0])
                    if name == "vertex" and all(len(kinds) == 1 for _, kinds in properties):
                        columns.setdefault(one, []).append(value)
                else:
                    length = body.take(letters[0])
                    if length < 0:
                        raise No("a negative length")
                    items = [body.take(letters[1]) for _ in range(length)]
                    if name == "face" and one in ("vertex_indices", "vertex_index"):
                        faces.append(items)
            body.end()
    body.close()
    return columns, faces


def _unpacked(packed: bytes) -> bytes:
    out, at = bytearray(), 0
    try:
        while at < len(packed):
            control = packed[at]
            if control < 32:
                if at + 2 + control > len(packed):
                    raise No("cut")
                out += packed[at + 1 : at + 2 + control]
                at += 2 + control
                continue
            length, at = control >> 5, at + 1
            if length == 7:
                length, at = 7 + packed[at], at + 1
            back = len(out) - ((control & 31) << 8) - packed[at] - 1
            at += 1
            if back < 0:
                raise No("before the beginning")
            for _ in range(length + 2):
                out.append(out[back])
                back += 1
    except IndexError:
        raise No("cut") from None
    return bytes(out)


def pcd(content: bytes) -> dict[str, list]:
    """Columns of the points."""
    lines, at, entries = [], 0, {}
    while "DATA" not in entries:
        stop = content.find(b"\n", at)
        if stop < 0:
            raise No("no DATA")
        words, at = content[at:stop].decode("utf-8", "replace").split(), stop + 1
        lines.append(words)
        if words and not words[0].startswith("#"):
            name = "FIELDS" if words[0] == "COLUMNS" else words[0]
            if name in entries:
                raise No(name)
            entries[name] = words[1:]
    try:
        fields = entries["FIELDS"]
        letters = [LETTERS[kind + size] for kind, size in zip(entries["TYPE"], entries["SIZE"], strict=True)]
        counts = [int(word) for word in entries.get("COUNT", ["1"] * len(fields))]
        count = int(entries["WIDTH"][0]) * int(entries.get("HEIGHT", ["1"])[0])
        if len({len(fields), len(letters), len(counts)}) > 1 or int(entries.get("POINTS", [str(count)])[0]) != count:
            raise No("contradiction")
    except (KeyError, ValueError, IndexError) as error:
        raise No(error) from None
    columns = {name: [] for name in fields if not name.startswith("_")}
    body = content[at:]
    if entries["DATA"] == ["binary_compressed"]:
        packed, size = struct.unpack_from("<II", body) if len(body) > 7 else (0, 0)
        if len(body) < 8 + packed or body[8 + packed :].strip(b"\r\n\0 "):
            raise No("cut")
        block = _unpacked(body[8 : 8 + packed])
        if not len(block) == size == count * sum(struct.calcsize(k) * n for k, n in zip(letters, counts, strict=True)):
            raise No("size")
        reader, order = Bytes(block, "<"), [(slice(count), 1)]
    else:
        reader = Words(body) if entries["DATA"] == ["ascii"] else Bytes(body, "<")
        if entries["DATA"] == ["ascii"]:  # colours stand as PCL writes them, whole, or as the float of these bits
            packed = [name in ("rgb", "rgba") and letter == "f" for name, letter in zip(fields, letters, strict=True)]
            letters = ["packed" if one else letter for one, letter in zip(packed, letters, strict=True)]
        if entries["DATA"] not in (["ascii"], ["binary"]):
            raise No("DATA")
        order = [(slice(1), count)]
    for rows, times in order:
        for _ in range(times):
            reader.begin()
            for name, letter, several in zip(fields, letters, counts, strict=True):
                for _ in range(len(range(count)[rows])):
                    values = [reader.take(letter) for _ in range(several)]
                    if name in columns:
                        columns[name].append(values[0] if several == 1 else values)
            reader.end()
    reader.close()
    return columns


def xyz(content: bytes) -> dict[str, list[float]]:
    """Columns of the points."""
    rows = [line.split() for line in re.split(rb"\r\n|\r|\n", content) if line.split()]
    rows = [words for words in rows if not words[0].startswith(b"#")]
    if any(len(words) < 3 for words in rows):
        raise No("short")
    return {name: [_text_value(words[i], "d") for words in rows] for i, name in enumerate("xyz")}
