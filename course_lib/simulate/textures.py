"""Procedural pictures for virtual scenes: paint, wood, cloth, posters and lettering, as (h, w, 3) uint8 RGB arrays."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

Colour = Sequence[float]
INK = (38, 38, 44)
PAPER = (243, 239, 228)


def shape_of(width: float, height: float, texel: float, most: int = 2200) -> tuple[int, int]:
    """Rows and columns of a picture of a surface (metres) with elements of ``texel`` metres, at most ``most``."""
    return tuple(int(np.clip(round(side / texel), 2, most)) for side in (height, width))


def noise(
    rng: np.random.Generator, shape: tuple[int, int], cell: float, octaves: int = 4, stretch: float = 1.0
) -> np.ndarray:
    """Smooth noise (h, w) float32 of about unit size: features of ``cell`` pixels and smaller, stretched along x."""
    total, weight = np.zeros(shape, np.float32), 1.0
    for _ in range(octaves):
        grid = (int(shape[0] / cell) + 3, int(shape[1] / cell / stretch) + 3)
        rough = rng.standard_normal(grid).astype(np.float32)
        total += weight * cv2.resize(rough, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
        cell, weight = max(cell / 2, 1), weight * 0.55
    return total


def tint(colour: Colour, change: np.ndarray) -> np.ndarray:
    """A colour made brighter or darker: (h, w) relative change to (h, w, 3) uint8."""
    return np.clip(np.asarray(colour, np.float32) * (1 + change[..., None]), 0, 255).astype(np.uint8)


def plain(rng: np.random.Generator, shape: tuple[int, int], colour: Colour, grain: float = 0.02) -> np.ndarray:
    """Paint or plastic with a faint grain."""
    return tint(colour, grain * noise(rng, shape, 12, 3))


def plaster(rng: np.random.Generator, shape: tuple[int, int], colour: Colour, grain: float = 0.012) -> np.ndarray:
    """A rolled wall: fine grain and wide, faint clouds."""
    return tint(colour, grain * noise(rng, shape, 3, 2) + grain * noise(rng, shape, 90, 2))


def wood(rng: np.random.Generator, shape: tuple[int, int], colour: Colour, figure: float = 0.09) -> np.ndarray:
    """Grain that runs along x, with the bent lines of year rings."""
    h, w = shape
    bend = noise(rng, shape, max(h / 2.5, 2), 3, stretch=5)
    rings = np.sin(np.linspace(0, 0.055 * h, h, dtype=np.float32)[:, None] * 2.2 + 2.2 * bend)
    fibre = noise(rng, shape, 4, 3, stretch=30)
    picture = tint(colour, figure * (0.55 * rings + 0.35 * fibre))
    picture[..., 2] = np.clip(picture[..., 2] * (1 - 0.05 * rings), 0, 255)
    return picture


def boards(
    rng: np.random.Generator, shape: tuple[int, int], texel: float, colour: Colour, width: float = 0.14
) -> np.ndarray:
    """A floor of wooden boards along x, each ``width`` metres wide with its own tint, with dark joints."""
    h, w = shape
    picture = np.empty((h, w, 3), np.uint8)
    rows = max(4, round(width / texel))
    for top in range(0, h, rows):
        strip = min(rows, h - top)
        left = -int(rng.integers(0, 600))
        while left < w:
            length = int(rng.uniform(0.9, 1.9) / texel)
            piece = wood(rng, (rows, length), np.asarray(colour) * rng.uniform(0.84, 1.1) * rng.uniform(0.98, 1.02, 3))
            piece[:, :2] = piece[:, :2] // 3
            piece[:1] = piece[:1] // 3
            a, b = max(left, 0), min(left + length, w)
            if b > a:
                picture[top : top + strip, a:b] = piece[:strip, a - left : b - left]
            left += length
    return picture


def rug(rng: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """A woven rug: a border, rows of diamonds, a medallion."""
    h, w = shape
    red, blue, cream, gold = (134, 44, 40), (38, 56, 92), (222, 206, 174), (190, 140, 62)
    picture = np.empty((h, w, 3), np.uint8)
    picture[:] = red
    for inset, colour in ((0.0, blue), (0.035, cream), (0.05, blue), (0.115, cream), (0.13, red)):
        d = int(inset * w)
        picture[d : h - d, d : w - d] = colour
    step = int(0.065 * w)
    for x in range(int(0.083 * w), w - int(0.06 * w), step):
        for y in (int(0.083 * w), h - int(0.083 * w)):
            _diamond(picture, (x, y), int(step * 0.42), int(step * 0.42), gold)
    for y in range(int(0.083 * w), h - int(0.06 * w), step):
        for x in (int(0.083 * w), w - int(0.083 * w)):
            _diamond(picture, (x, y), int(step * 0.42), int(step * 0.42), gold)
    for k in range(5):
        x = int(w * (0.23 + 0.135 * k))
        for colour, size in ((blue, 0.30), (gold, 0.22), (red, 0.17), (cream, 0.09), (blue, 0.05)):
            _diamond(picture, (x, h // 2), int(size * w * 0.30), int(size * h), colour)
        for y in (0.27, 0.73) if k < 4 else ():
            _diamond(picture, (x + int(0.068 * w), int(h * y)), int(0.025 * w), int(0.04 * w), gold if k % 2 else cream)
    weave = 0.10 * rng.standard_normal((h, w)).astype(np.float32) + 0.05 * noise(rng, shape, 40, 2)
    return np.clip(picture * (1 + cv2.GaussianBlur(weave, (0, 0), 0.8)[..., None]), 0, 255).astype(np.uint8)


def _diamond(picture: np.ndarray, centre: tuple[int, int], a: int, b: int, colour: Colour) -> None:
    x, y = centre
    corners = np.array([[x - a, y], [x, y - b], [x + a, y], [x, y + b]])
    cv2.fillPoly(picture, [corners], tuple(map(int, colour)), cv2.LINE_AA)


def cloth(rng: np.random.Generator, shape: tuple[int, int], colour: Colour) -> np.ndarray:
    """Coarse upholstery."""
    h, w = shape
    threads = np.sin(np.arange(w) * 1.6)[None] * np.sin(np.arange(h) * 1.6)[:, None]
    wear = 0.05 * noise(rng, shape, 5, 2) + 0.03 * noise(rng, shape, 60, 2)
    return tint(colour, (0.07 * threads + wear).astype(np.float32))


def write(
    picture: np.ndarray,
    text: str,
    centre: tuple[float, float],
    height: float,
    colour: Colour,
    *,
    thickness: float = 0.11,
    font: int = cv2.FONT_HERSHEY_SIMPLEX,
    fit: float | None = None,
) -> None:
    """Letter a line into a picture, centred at (x, y), capitals ``height`` pixels high, at most ``fit`` wide."""
    (width, base), _ = cv2.getTextSize(text, font, 1.0, 1)
    if fit is not None and width * height / base > fit:
        height = fit * base / width
    scale = height / base
    width = width * scale
    spot = (round(centre[0] - width / 2), round(centre[1] + height / 2))
    bold = max(1, round(thickness * height))
    cv2.putText(picture, text, spot, font, scale, tuple(map(int, colour)), bold, cv2.LINE_AA)


def framed(picture: np.ndarray, border: float = 0.06, mat: Colour = (236, 234, 226)) -> np.ndarray:
    """A picture inside a pale mat (``border`` of its width)."""
    b = int(border * picture.shape[1])
    return cv2.copyMakeBorder(picture, b, b, b, b, cv2.BORDER_CONSTANT, value=tuple(map(float, mat)))


def speckled(rng: np.random.Generator, picture: np.ndarray, grain: float = 0.02) -> np.ndarray:
    """Printed paper: a picture with a little grain."""
    change = grain * noise(rng, picture.shape[:2], 3, 2)[..., None]
    return np.clip(picture * (1 + change), 0, 255).astype(np.uint8)
