"""What a file of points holds, column by column, and the clouds and colours that columns make.

A column has the type and the numbers of the file. Only here are they turned into the course's types, and what cannot
be turned without loss is refused by its name.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook._errors import Refusal, shown

XYZ = ("x", "y", "z")
NORMALS = (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z"))
COLORS = (("red", "green", "blue"), ("r", "g", "b"))
LABELS = ("label", "labels")
ODD = re.compile(rb"[^\t\v\f -~]|_")  # in a number's line; NumPy takes some of them for blanks, Python takes 1_000
EXACT = 2.0**53  # beyond, not every whole number is a float64


@dataclass(frozen=True)
class Stored:
    """What a file holds.

    Attributes
    ----------
    path : where it lies, for the messages.
    count : of its points.
    columns : name → (count,) or (count, several), in the file's own types.
    faces : of a mesh, by how many corners they have: (F, corners) int64 rows of points.
    shape : (height, width) of an organised cloud, or None.
    """

    path: Path
    count: int
    columns: Mapping[str, np.ndarray]
    faces: Mapping[int, np.ndarray] | None = None
    shape: tuple[int, int] | None = None


def cut(path: Path, promised: str, there: str) -> Refusal:
    """The sentence about a file that ends early."""
    what = f"its header promises {promised} and {there}"
    return Refusal(f"{shown(path)} is cut short: {what}; copy or download it again.")


def not_one(path: Path, kind: str, why: str) -> Refusal:
    """The sentence about a file that is something else."""
    return Refusal(f"{shown(path)} is not a {kind} file ({why}): check that the download or copy is the right file.")


def more_than(path: Path, promised: str) -> Refusal:
    """The sentence about a file that goes on after its last point."""
    return Refusal(f"{shown(path)} holds more than its header promises ({promised}): it was changed; save it again.")


def text_table(path: Path, lines: Sequence[tuple[int, bytes]], names: Sequence[str], exact: bool = True) -> np.ndarray:
    """Read lines of numbers as (rows, columns) float64.

    Parameters
    ----------
    lines : number of the line in the file, and what it holds.
    names : of the columns, for the messages.
    exact : whether a line may hold no more numbers than that.

    Raises
    ------
    Refusal
        If a line holds too few or too many, or a word that is no number; it names the line and the column.
    """
    wanted = len(names)
    if not lines:
        return np.zeros((0, wanted))
    texts = [line for _, line in lines]
    if not ODD.search(b" ".join(texts)):
        with contextlib.suppress(ValueError):  # which line it was is found below
            table = np.loadtxt(texts, ndmin=2, comments=None, usecols=None if exact else range(wanted))
            if table.shape == (len(lines), wanted):
                return table
    rows = []
    for number, line in lines:
        words = line.split()
        if len(words) < wanted or (exact and len(words) > wanted):
            held = f"{len(words)} words and should hold {wanted} numbers ({', '.join(names)})"
            raise Refusal(f"Line {number} of {shown(path)} holds {held}: the file is damaged; copy or save it again.")
        rows.append([_number(path, number, name, word) for name, word in zip(names, words, strict=False)])
    return np.array(rows, float).reshape(-1, wanted)


def _number(path: Path, line: int, name: str, word: bytes) -> float:
    if not ODD.search(word):
        with contextlib.suppress(ValueError):
            return float(word)
    said = word[:20].decode("utf-8", "replace")
    raise Refusal(f"Line {line} of {shown(path)} holds {said!r} where {name} should be a number: write it again.")


def typed(path: Path, name: str, numbers: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """Give numbers read from text the type that the header promised; Refusal where one does not fit."""
    if dtype.kind == "f":
        with np.errstate(over="ignore"):
            return numbers.astype(dtype)
    info = np.iinfo(dtype)
    whole = (numbers == np.rint(numbers)) & (np.abs(numbers) <= EXACT) & (numbers >= info.min) & (numbers <= info.max)
    if not whole.all():
        bad = numbers[~whole].flat[0]
        raise Refusal(f"{shown(path)} holds {bad:g} where {name} should be a whole number ({dtype}): save it again.")
    return numbers.astype(dtype)


def cloud_of(stored: Stored) -> PointCloud:
    """Make a cloud of columns.

    Returns
    -------
    PointCloud, float32 where all coordinates are floats of 32 bits or small whole numbers, else float64. Colours are
    taken from 8 bits, from 16 bits (where one is above 255), and from floats up to 1 or up to 255.

    Raises
    ------
    Refusal
        If it has no points, no z, two of the three colours, or numbers that no colour or label can be.
    """
    path, columns = stored.path, _by_small_names(stored)
    if stored.count == 0:
        raise Refusal(f"{shown(path)} holds no points: check how it was saved.")
    points = _three(path, columns, (XYZ,))
    if points is None:
        raise Refusal(f"{shown(path)} holds no x, y and z: its fields are {', '.join(columns) or 'none'}.")
    normals = _three(path, columns, NORMALS)
    return PointCloud(
        np.stack(points, 1).astype(np.result_type(*points, np.float32)),
        colors=_colors(path, columns),
        normals=None if normals is None else np.stack(normals, 1).astype(np.result_type(*normals, np.float32)),
        labels=_labels(path, columns),
    )


def _by_small_names(stored: Stored) -> dict[str, np.ndarray]:
    """Columns by names in small letters: X is x."""
    small = {name.lower(): column for name, column in stored.columns.items()}
    if len(small) < len(stored.columns):
        raise Refusal(f"{shown(stored.path)} has fields that differ only in large and small letters: rename one.")
    return small


def _three(path: Path, columns: Mapping[str, np.ndarray], names: Iterable[tuple[str, ...]]) -> list[np.ndarray] | None:
    """Three columns of one of these names, or None where none of them is there."""
    for three in names:
        lacking = [name for name in three if name not in columns]
        if len(lacking) < 3:
            if lacking:
                there = ", ".join(name for name in three if name in columns)
                raise Refusal(f"{shown(path)} holds {there} and no {', no '.join(lacking)}: check how it was saved.")
            for name in three:
                _one(path, name, columns[name])
            return [columns[name] for name in three]
    return None


def _one(path: Path, name: str, column: np.ndarray) -> np.ndarray:
    if column.ndim != 1:
        raise Refusal(f"{shown(path)} holds {column.shape[1]} numbers a point in {name}, where one was expected.")
    return column


def _colors(path: Path, columns: Mapping[str, np.ndarray]) -> np.ndarray | None:
    packed = next((name for name in ("rgb", "rgba") if name in columns), None)
    if packed:
        bits = _one(path, packed, columns[packed])
        if bits.dtype.itemsize != 4:
            raise Refusal(f"{shown(path)} holds {packed} as {bits.dtype}: four bytes (blue, green, red) were expected.")
        return np.ascontiguousarray(np.ascontiguousarray(bits).view(np.uint8).reshape(-1, 4)[:, 2::-1])
    three = _three(path, columns, COLORS)
    if three is None:
        return None
    numbers = np.stack(three, 1)
    if numbers.dtype == np.uint8:
        return numbers
    low, high = numbers.min(), numbers.max()  # NaN where one is
    top = 255 if numbers.dtype != np.uint16 or high <= 255 else 65535
    if not (low >= 0 and high <= top):
        raise Refusal(f"{shown(path)} holds colours from {low:g} to {high:g}: 0 to 255 (or floats to 1) were expected.")
    scale = 255 / top if numbers.dtype.kind in "iu" or high > 1 else 255
    return np.rint(numbers * np.float64(scale)).astype(np.uint8)


def _labels(path: Path, columns: Mapping[str, np.ndarray]) -> np.ndarray | None:
    there = [name for name in LABELS if name in columns]
    if not there:
        return None
    if len(there) > 1:
        raise Refusal(f"{shown(path)} holds both label and labels: remove one of them.")
    labels = _one(path, there[0], columns[there[0]])
    if labels.dtype.kind not in "iu":
        raise Refusal(f"{shown(path)} holds {there[0]} as {labels.dtype}: labels are whole numbers; save them as int.")
    return labels
