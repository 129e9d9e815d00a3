"""Damaged files of points: each is refused in one sentence, or read as an independent reader reads it."""

from __future__ import annotations

import itertools
import struct
import warnings

import naive_points
import numpy as np
import pytest
from how_thorough import sample

from course_lib.notebook import files
from course_lib.notebook._errors import Refusal

HEAD = "ply\nformat {form} 1.0\ncomment made by a test\nelement vertex 6\nproperty float x\nproperty double y\n"
HEAD += "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty int label\n"
HEAD += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
POINTS = np.random.default_rng(0).normal(size=(6, 3)).round(4).astype(np.float32).tolist()
ROWS = [(*point, i, 10 * i, 255 - i, 7 - i) for i, point in enumerate(POINTS)]
PCD = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb _ label\nSIZE 4 4 4 4 1 4\nTYPE F F F F U U\nCOUNT 1 1 1 1 4 1\n"
PCD += "WIDTH 3\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 6\nDATA "


def _ply(form: str) -> bytes:
    head = HEAD.format(form=form).encode()
    if form == "ascii":
        rows = [" ".join(f"{number:g}" for number in row) for row in ROWS] + ["3 0 1 2", "4 2 3 4 5"]
        return head + "\n".join(rows).encode() + b"\n"
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(f"{order}fdfBBBi", *row) for row in ROWS)
    return head + body + struct.pack(f"{order}B3iB4i", 3, 0, 1, 2, 4, 2, 3, 4, 5)


def _pcd(kind: str) -> bytes:
    head = f"{PCD}{kind}\n".encode()
    bits = [struct.pack("I", 4278190080 + 65536 * row[3] + 256 * row[4] + row[5]) for row in ROWS]
    if kind == "ascii":
        colours = [struct.unpack("I", four)[0] for four in bits]
        rows = [f"{x:g} {y:g} {z:g} {c} 0 0 0 0 {label}" for (x, y, z, *_, label), c in zip(ROWS, colours, strict=True)]
        return head + "\n".join(rows).encode() + b"\n"
    rows = [
        [struct.pack("<fff", *row[:3]), four, bytes(4), struct.pack("<I", row[6])]
        for row, four in zip(ROWS, bits, strict=True)
    ]
    if kind == "binary":
        return head + b"".join(b"".join(row) for row in rows)
    block = b"".join(struct.pack("<6f", *(row[i] for row in ROWS)) for i in range(3))
    block += b"".join(b"".join(row[i] for row in rows) for i in (1, 2, 3))
    zeros = block.index(bytes(24))
    plain = block[: zeros + 1]
    packed = b"".join(bytes([len(part) - 1]) + part for part in (plain[i : i + 32] for i in range(0, len(plain), 32)))
    packed += bytes([0xE0, 23 - 9, 0]) + bytes([len(block) - zeros - 24 - 1]) + block[zeros + 24 :]
    return head + struct.pack("<II", len(packed), len(block)) + packed


WHOLE = {
    **{f"{form}.ply": _ply(form) for form in ("ascii", "binary_little_endian", "binary_big_endian")},
    **{f"{kind}.pcd": _pcd(kind) for kind in ("ascii", "binary", "binary_compressed")},
    "text.xyz": ("# x y z\n" + "\n".join(" ".join(map(str, point)) for point in POINTS)).encode(),
}
WORDS = [
    b"float",
    b"double",
    b"uchar",
    b"list",
    b"int",
    b"nan",
    b"-1",
    b"1e9",
    b"vertex",
    b"F",
    b"I",
    b"4",
    b"8",
    b"7",
    b"\xff",
]


def mutant(content: bytes, rng: np.random.Generator) -> bytes:
    """Change one to three things: a bit, a byte, a word, a line, a piece, the end."""
    for _ in range(rng.integers(1, 4)):
        at, length = int(rng.integers(len(content) or 1)), int(rng.integers(1, 12))
        lines = content.split(b"\n")
        line = int(rng.integers(min(len(lines), 16)))
        match int(rng.integers(9)):
            case 0 | 1:
                content = content[:at] + bytes([rng.integers(256)]) + content[at + 1 :]
            case 2:
                content = content[:at] + content[at + length :]
            case 3:
                content = content[:at] + content[at : at + length] + content[at:]
            case 4:
                content = content[:at]
            case 5 | 6:
                words = lines[line].split(b" ")
                words[int(rng.integers(len(words)))] = WORDS[int(rng.integers(len(WORDS)))]
                content = b"\n".join([*lines[:line], b" ".join(words), *lines[line + 1 :]])
            case 7:
                content = b"\n".join([*lines[:line], *lines[line + 1 :]])
            case 8:
                content = b"\n".join([*lines[:line], lines[line], *lines[line:]])
    return content


def _numbers(values: object) -> np.ndarray:
    return np.asarray(values, np.float64)


def compare(path, content: bytes) -> str:
    """Read both ways; "read", or "refused" by the course's reader."""
    path.write_bytes(content)
    kind = path.suffix[1:]
    try:
        stored = files.CLOUDS[path.suffix](path) if content else files.read_cloud(path)
    except Refusal as refusal:
        assert path.name in str(refusal) and "\n" not in str(refusal) and str(refusal)[-1] in ".?"
        return "refused"
    columns = getattr(naive_points, kind)(content)
    columns, faces = columns if kind == "ply" else (columns, [])
    assert stored.count == 0 or list(stored.columns) == list(columns)
    for name, column in stored.columns.items():
        theirs = columns.get(name, [])
        np.testing.assert_array_equal(_numbers(column).reshape(-1), _numbers(theirs).reshape(-1))
    ours = sorted(row.tolist() for rows in (stored.faces or {}).values() for row in rows)
    assert ours == sorted(faces)
    for read in (files.read_cloud, files.read_mesh) if kind == "ply" else (files.read_cloud,):
        try:
            thing = read(path)
        except Refusal as refusal:
            assert path.name in str(refusal) and "\n" not in str(refusal)
        else:
            small = {name.lower(): values for name, values in columns.items()}
            points = thing.points if read is files.read_cloud else thing.vertices
            expected = np.stack([_numbers(small[name]) for name in "xyz"], 1)
            with np.errstate(invalid="ignore"):  # a NaN that signals
                np.testing.assert_array_equal(points, expected.astype(points.dtype))
    return "read"


@pytest.mark.parametrize("name", WHOLE)
def test_a_whole_file_is_read_as_the_independent_reader_reads_it(tmp_path, name):
    assert compare(tmp_path / name, WHOLE[name]) == "read"
    cloud = files.read_cloud(tmp_path / name)
    np.testing.assert_array_equal(cloud.points.astype(np.float32), np.float32(POINTS))
    if not name.endswith("xyz"):
        assert cloud.colors.tolist() == [list(row[3:6]) for row in ROWS]
        assert cloud.labels.tolist() == [row[6] for row in ROWS]


def test_mutants_are_refused_or_read_as_the_independent_reader_reads_them(tmp_path):
    """200 in the whole test, 5,000 with --thorough: no crash, no warning, no silent change."""
    ends = dict.fromkeys(("read", "refused"), 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for seed, name in zip(range(sample(5000, 210)), itertools.cycle(WHOLE), strict=False):
            rng = np.random.default_rng(seed)
            content = mutant(WHOLE[name], rng)
            try:
                ends[compare(tmp_path / name, content)] += 1
            except Exception as error:
                raise AssertionError(f"mutant {seed} of {name}: {content!r}") from error
    assert min(ends.values()) > sum(ends.values()) / 20, ends
