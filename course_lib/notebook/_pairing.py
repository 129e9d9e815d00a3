"""Which colour image belongs to which depth image of a recording, and when each was taken."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from course_lib.notebook._errors import Refusal, shown
from course_lib.notebook._images import DEPTH_SUFFIXES, SUFFIXES

ASSOCIATIONS = ("associations.txt", "association.txt", "associate.txt", "associated.txt")
KINDS = {"color": ("color", "colour", "rgb"), "depth": ("depth",)}
MOST_SECONDS_APART = 0.02
"""Colour and depth of a TUM-style recording belong together if their times differ by less: the benchmark's default."""


@dataclass(frozen=True)
class Pairs:
    """Colour and depth images by twos; `times` of the depth images in seconds, or None; `left` says what lacks one."""

    files: list[tuple[Path, Path]]
    times: np.ndarray | None = None
    left: str = ""


def natural(path: Path) -> list[tuple[int, int | str]]:
    """A key that sorts frame_2 before frame_10."""
    parts = re.split(r"(\d+)", path.name)
    return [(1, int(part)) if part.isdigit() else (0, part) for part in parts]


def images(folder: Path, kinds: tuple[str, ...] = SUFFIXES) -> list[Path]:
    """The images of a folder in their natural order."""
    found = [one for one in folder.iterdir() if one.suffix.lower() in kinds and not one.name.startswith(".")]
    return sorted(found, key=natural)


def flat_images(folder: Path) -> tuple[list[Path], list[Path]]:
    """Colour and depth images in one folder, as of 7-Scenes: frame-000000.color.png and frame-000000.depth.png."""
    words = {one: re.split(r"[^a-z]+", one.name.lower()) for one in images(folder, (*SUFFIXES, *DEPTH_SUFFIXES))}
    color, depth = ([one for one in words if set(KINDS[kind]) & set(words[one])] for kind in ("color", "depth"))
    return color, depth


def pair(path: Path, colors: list[Path], depths: list[Path], names: tuple[str, str]) -> Pairs:
    """Pair colour with depth images.

    Parameters
    ----------
    path : the recording; its lists of times are read.
    colors, depths : images; `names` are what their folders are called.

    Raises
    ------
    Refusal
        If a list is damaged, or the images cannot be told to belong together.
    """
    listed = next((path / name for name in ASSOCIATIONS if (path / name).is_file()), None)
    if listed:
        return _listed(path, listed, names[0])
    color_times, depth_times = _times(path / "rgb.txt", colors), _times(path / "depth.txt", depths)
    if color_times is not None and depth_times is not None:
        nearest, near = nearest_in_time(color_times, depth_times)
        if not near.any():
            raise Refusal(f"No image of {names[0]}/ was taken within {MOST_SECONDS_APART} s of one of {names[1]}/.")
        few = f"{(~near).sum()} of {len(near)} depth images have no colour and are left out"
        return Pairs(
            [(colors[nearest[i]], depths[i]) for i in np.flatnonzero(near)],
            depth_times[near],
            "" if near.all() else few,
        )
    numbers = [[_numbers(one) for one in found] for found in (colors, depths)]
    best: set[int] = set()
    for place in range(-1, max(len(row) for row in numbers[1]) - 1):  # the last number in the name, the first, ...
        by_number = [{row[place]: i for i, row in enumerate(rows) if len(row) > max(place, 0)} for rows in numbers]
        both = set(by_number[0]) & set(by_number[1])
        if len(both) == len(colors) == len(depths):
            return Pairs([(colors[by_number[0][n]], depths[by_number[1][n]]) for n in sorted(both)])
        best = max(best, both, key=len)
    raise Refusal(
        f"{names[0]}/ has {len(colors)} images, {names[1]}/ has {len(depths)} and {len(best)} numbers in their "
        "names agree: give each pair the same number, or write associations.txt."
    )


def _listed(path: Path, listed: Path, color: str) -> Pairs:
    lines = [line.partition("#")[0].split() for line in listed.read_text(encoding="utf-8").splitlines()]
    rows = [words for words in lines if words]
    if not rows or any(len(row) != 4 for row in rows):
        raise Refusal(f"{shown(listed)} must hold time, image, time, image on every line: write it again.")
    order = (1, 3, 2) if Path(rows[0][1]).parts[0] == color else (3, 1, 0)
    try:
        times = np.array([float(row[order[2]]) for row in rows])
    except ValueError as error:
        raise Refusal(f"{shown(listed)} holds a word where a time was expected: write it again.") from error
    return Pairs([(path / row[order[0]], path / row[order[1]]) for row in rows], times)


def _numbers(path: Path) -> list[int]:
    return [int(digits) for digits in re.findall(r"\d+", path.stem)]


def _times(listing: Path, found: list[Path]) -> np.ndarray | None:
    """Times in seconds of images: from a TUM list, else from names that are such times, else None."""
    if listing.is_file():
        rows = [line.split() for line in listing.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        by_name = {Path(row[1]).name: float(row[0]) for row in rows if len(row) == 2}
        if all(one.name in by_name for one in found):
            return np.array([by_name[one.name] for one in found])
    if all(re.fullmatch(r"\d+\.\d+", one.stem) for one in found):
        return np.array([float(one.stem) for one in found])
    return None


def nearest_in_time(times: np.ndarray, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each time asked, the index of the nearest of `times`, and whether it is near enough."""
    order = np.argsort(times, kind="stable")
    after = np.clip(np.searchsorted(times[order], asked), 1, max(1, len(times) - 1))
    pairs = order[np.minimum(np.stack([after - 1, after]), len(times) - 1)]
    apart = np.abs(times[pairs] - asked)
    return np.where(apart[0] <= apart[1], *pairs), apart.min(axis=0) < MOST_SECONDS_APART
