"""Seeing from its pixels alone that a picture shows nothing: a blank render, or axes that nothing was drawn into."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

BLANK_SHARE = 0.997  # of all pixels in one colour
BLANK_MIDDLE = 0.999  # of the middle, where a title or a colour bar does not reach
MIDDLE = 0.15  # the margin on each side that is not the middle
SAME = 16  # of 255: the difference that a palette and its dither leave in one colour
LINE = 60  # of 255: how much darker than its surroundings a spine is
SHORTEST = 40  # pixels: an axes is at least so wide and so high
TICKS = 8  # pixels inside a spine that ticks may take
OVERSHOOT = 14  # pixels by which ticks make a spine longer
EDGE_TO_EDGE = 0.96  # of a row: a grid's line less its crossings; a curve stops at its margins
DOTS = 1e-5  # the share of pixels in an axes that palette noise may change


class Box(NamedTuple):
    """The inside of an axes in pixels; right and bottom are excluded."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def width(self) -> int:
        return self.right - self.left

    @property
    def height(self) -> int:
        return self.bottom - self.top

    def mostly_in(self, other: Box) -> bool:
        """Whether nine tenths of this box lie in another."""
        width = min(self.right, other.right) - max(self.left, other.left)
        height = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(width, 0) * max(height, 0) >= 0.9 * self.width * self.height


def _largest(image: NDArray[np.integer]) -> NDArray[np.integer]:
    """The largest of three channels: NumPy's own maximum along so short an axis takes several times as long."""
    return np.maximum(np.maximum(image[..., 0], image[..., 1]), image[..., 2])


def _smallest(image: NDArray[np.integer]) -> NDArray[np.integer]:
    return np.minimum(np.minimum(image[..., 0], image[..., 1]), image[..., 2])


def _dominant_share(image: NDArray[np.uint8]) -> float:
    """The share of the pixels that has the commonest colour, up to what dithering does to it."""
    pixels = image.reshape(-1, 3)
    coarse = (pixels >> 3).astype(np.uint32)
    keys = (coarse[:, 0] << 10) | (coarse[:, 1] << 5) | coarse[:, 2]
    commonest = pixels[keys == np.bincount(keys).argmax()][0].astype(np.int16)
    return float((_largest(np.abs(pixels.astype(np.int16) - commonest)) <= SAME).mean())


def is_blank(image: NDArray[np.uint8]) -> bool:
    """Whether one colour fills a picture, or fills its middle under a title or beside a colour bar.

    Parameters
    ----------
    image : (H, W, 3) uint8.
    """
    height, width = image.shape[:2]
    dv, du = int(MIDDLE * height), int(MIDDLE * width)
    middle = image[dv : height - dv, du : width - du]
    return _dominant_share(image) > BLANK_SHARE or _dominant_share(middle) > BLANK_MIDDLE


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and end (excluded) of every run of True in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _lines(image: NDArray[np.int16], ground: NDArray[np.int16]) -> list[tuple[int, int, int, bool]]:
    """Dark grey horizontal lines, and whether each could be the spine of an axes without content.

    Such a spine is thin (light on both sides) and has the figure's ground on one side.

    Returns
    -------
    (row, start, end, bare) of each, end excluded.
    """
    grey = (image[..., 0] + image[..., 1] + image[..., 2]) / 3
    padded = np.pad(grey, ((4, 4), (0, 0)), mode="edge")
    above, below = padded[:-8] - grey, padded[8:] - grey
    dark = (_largest(image) - _smallest(image) < 48) & (grey < 160)
    edge = dark & (np.maximum(above, below) > LINE)
    thin = dark & (np.minimum(above, below) > LINE)
    lines = []
    for row in np.flatnonzero(edge.sum(axis=1) >= SHORTEST):
        for start, end in _runs(edge[row]):
            if end - start < SHORTEST:
                continue
            beside = [image[v, start:end] for v in (row - 4, row + 4) if 0 <= v < len(image)]
            grounded = any((_largest(np.abs(pixels - ground)) <= SAME).mean() > 0.5 for pixels in beside)
            lines.append((int(row), start, end, bool(grounded and thin[row, start:end].mean() > 0.5)))
    return lines


def _axes(image: NDArray[np.uint8]) -> list[tuple[Box, bool]]:
    """The outermost axes of a plot, found by spines that meet bottom left, and whether both spines are bare."""
    pixels = image.astype(np.int16)
    ground = pixels[0, 0]
    boxes: list[tuple[Box, bool]] = []
    vertical = _lines(pixels.transpose(1, 0, 2), ground)
    for row, left, right, bare in _lines(pixels, ground):
        for column, top, bottom, also_bare in vertical:
            if abs(column - left) <= OVERSHOOT and abs(bottom - 1 - row) <= OVERSHOOT:
                box = Box(column + TICKS, top + TICKS, right - TICKS, row - TICKS)
                if box.width >= SHORTEST // 2 and box.height >= SHORTEST // 2:
                    boxes.append((box, bare and also_bare))
    boxes.sort(key=lambda found: -found[0].width * found[0].height)
    return [found for n, found in enumerate(boxes) if not any(found[0].mostly_in(box) for box, _ in boxes[:n])]


def empty_axes(image: NDArray[np.uint8]) -> list[Box]:
    """Find the axes of a plot that nothing was drawn into.

    Parameters
    ----------
    image : (H, W, 3) uint8.

    Returns
    -------
    Their insides, largest first.
    """
    inside = [box for box, bare in _axes(image) if bare]
    return [box for box in inside if is_empty_box(image[box.top : box.bottom, box.left : box.right])]


def _grid_lines(pixels: NDArray[np.int16], drawn: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which rows are drawn from end to end in one colour, as lines of a grid are and a curve in its margins is not.

    The rows beside them count too (they hold the soft edges of crossings). More than a fifth of all rows is no grid.
    """
    middle = np.median(pixels, axis=1, keepdims=True)
    plain = (_largest(np.abs(pixels - middle)) <= SAME).mean(axis=1) > EDGE_TO_EDGE
    full = plain & (drawn.mean(axis=1) > EDGE_TO_EDGE) & drawn[:, 0] & drawn[:, -1]
    if full.mean() > 0.2:
        return np.zeros_like(full)
    wide = full.copy()
    wide[1:] |= full[:-1]
    wide[:-1] |= full[1:]
    return wide


def is_empty_box(inside: NDArray[np.uint8]) -> bool:
    """Whether the inside of an axes holds nothing but its ground and lines of a grid from edge to edge.

    Parameters
    ----------
    inside : (H, W, 3) uint8.
    """
    pixels = inside.astype(np.int16)
    ground = np.median(pixels.reshape(-1, 3), axis=0)
    drawn = _largest(np.abs(pixels - ground)) > SAME
    rows, columns = _grid_lines(pixels, drawn), _grid_lines(pixels.transpose(1, 0, 2), drawn.T)
    rest = drawn[~rows][:, ~columns]
    return bool(rest.size) and rest.mean() <= DOTS


def what_is_empty(image: NDArray[np.uint8]) -> str:
    """Say in a few words what a picture lacks; "" where it shows something.

    Parameters
    ----------
    image : (H, W, 3) uint8.
    """
    empty = len(empty_axes(image))
    if empty:
        return f"{empty} axes in the picture {'is' if empty == 1 else 'are'} empty"
    return "the picture is blank" if is_blank(image) and not _axes(image) else ""
