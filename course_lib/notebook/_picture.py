"""A picture of a notebook: a small palette PNG that can be described without being seen."""

from __future__ import annotations

import html
import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from course_lib.notebook._colours import COLOURS, rgb

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AIM_BYTES = 90_000
MOST_BYTES = 140_000
PALETTES = (256, 112, 64)
"""How many colours a picture may have, tried in this order until it is small enough to aim at."""
MOST_CELLS = 20_000
"""A picture with more different colours than this is counted in coarser ones, for speed."""
CSS_WIDTH = 700
"""How wide a notebook shows a full-width picture, in CSS pixels."""
DENSITY = 1.6
WIDTH = round(CSS_WIDTH * DENSITY)
"""Pixels of a full-width picture: more than CSS pixels, so that it stays sharp on a projector."""
TALLEST = round(640 * DENSITY)
"""Pixels: what is higher does not fit on a projector's screen below the browser's bars."""
INK = "#222222"


@dataclass(frozen=True)
class Picture:
    """A finished picture: what a cell shows, and what it says to someone who cannot see it.

    Attributes
    ----------
    png : the file's bytes: palette PNG on white.
    alt : what is to be seen, with its numbers; also the output's plain text, and a folded line below it.
    width : how wide a notebook shows it, in CSS pixels.
    """

    png: bytes
    alt: str
    width: int = 700

    def __repr__(self) -> str:
        return self.alt

    def _ipython_display_(self) -> None:
        """Two outputs: the picture, and its description again as a folded line.

        JupyterLab and HTML exports drop the alt text that stands in an output's metadata; of a bundle with HTML in it
        JupyterLab would show the HTML instead of the picture.
        """
        from IPython.display import display

        about = {"image/png": {"alt": self.alt, "width": self.width}}
        display({"image/png": self.png, "text/plain": self.alt}, metadata=about, raw=True)
        display({"text/html": in_words(self.alt)}, raw=True)

    @property
    def pixels(self) -> np.ndarray:
        """(H, W, 3) uint8."""
        from PIL import Image

        return np.asarray(Image.open(io.BytesIO(self.png)).convert("RGB"))

    def save(self, path: str | Path) -> Path:
        """Write the PNG file."""
        path = Path(path)
        path.write_bytes(self.png)
        return path


def in_words(alt: str) -> str:
    """A picture's description as one folded line of HTML."""
    style = "font-size:85%;opacity:0.8;max-width:60em"
    return f'<details style="{style}"><summary>In words</summary>{html.escape(alt)}</details>'


def picture_of(pixels: np.ndarray, alt: str) -> Picture:
    """Make a Picture of (H, W, 3) uint8 pixels, DENSITY of them a CSS pixel: margins cut, few colours, small file.

    Raises
    ------
    ValueError
        If nothing but background is in it, or the text has no number.
    """
    check_alt(alt)
    pixels = _cut_margins(np.ascontiguousarray(pixels[..., :3], dtype=np.uint8))
    width = min(CSS_WIDTH, round(pixels.shape[1] / DENSITY))
    return Picture(_encode(pixels, width), alt, width)


def blank(width: int, height: int, dpi: int) -> Figure:
    """An empty white figure of so many pixels, apart from pyplot."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width / dpi, height / dpi), dpi=dpi, facecolor="white", layout="none")


def drawn(fig: Figure) -> np.ndarray:
    """The pixels of a figure: (H, W, 3) uint8."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


def check_alt(alt: str) -> None:
    """Refuse a description without a number in it."""
    if not isinstance(alt, str) or not any(letter.isdigit() for letter in alt):
        raise ValueError(
            f"The alt text {alt!r} has no number: say a number in it that was computed, "
            "as in f'Errors up to {worst:.0f} mm'."
        )


def picture(fig: Figure, alt: str) -> Picture:
    """Turn a Matplotlib figure into a Picture and close the figure; 7 inches are a notebook's full width.

    Parameters
    ----------
    fig : a figure in which every axes holds data.
    alt : what to see, for someone who cannot see it, with at least one computed number.

    Raises
    ------
    ValueError
        If an axes is empty, or the alt text has no number.
    """
    from matplotlib import pyplot

    try:
        check_alt(alt)
        for axes in fig.axes:
            if axes.images:  # the style's grid is for plots
                axes.grid(False)
        fig.set_dpi(min(100 * DENSITY, WIDTH / fig.get_figwidth()))
        pixels = drawn(fig)
        _check_axes(fig)
        return picture_of(pixels, alt)
    finally:
        pyplot.close(fig)


def _check_axes(fig: Figure) -> None:
    if not fig.axes:
        raise ValueError("This figure has no axes: plot something into it before calling picture(fig, alt).")
    for number, axes in enumerate(fig.axes, start=1):
        if not _holds_data(axes):
            name = axes.get_title() or axes.get_ylabel() or f"number {number}"
            raise ValueError(
                f"The axes {name!r} of this figure is empty: plot its data, or remove it with axes.remove()."
            )


def _holds_data(axes) -> bool:
    """Say whether a finite point, a bar, an image or a patch is in an axes."""
    lines = [np.asarray(line.get_ydata(orig=False), dtype=float) for line in axes.lines]
    if any(np.isfinite(ydata).any() for ydata in lines) or axes.images or axes.patches or axes.tables:
        return True
    for collection in axes.collections:
        offsets = np.ma.filled(np.ma.asarray(collection.get_offsets(), dtype=float), np.nan)
        paths = collection.get_paths() or []
        mesh = collection.get_array() is not None and not len(paths)
        if mesh or (np.isfinite(offsets).all(axis=-1).any() and len(offsets) and any(len(p.vertices) for p in paths)):
            return True
    return False


def _cut_margins(pixels: np.ndarray, margin: int = 12) -> np.ndarray:
    """Cut away rows and columns of pure white around the content."""
    ink = (pixels < 250).any(axis=-1)
    if not ink.any():
        raise ValueError("This picture is blank: nothing was drawn on its white background, so check what you show.")
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    top, bottom = max(rows[0] - margin, 0), rows[-1] + margin + 1
    left, right = max(columns[0] - margin, 0), columns[-1] + margin + 1
    return pixels[top:bottom, left:right]


def _encode(pixels: np.ndarray, width: int) -> bytes:
    """Choose colours and size for a small file: first fewer colours, and only then fewer pixels (of a photograph)."""
    fixed = _fixed_colours(pixels)
    png = _palette_png(pixels, PALETTES[0], fixed)
    for colours in PALETTES[1 if len(png) < 2 * AIM_BYTES else -1 :]:  # a photograph, at once with the fewest
        if len(png) > AIM_BYTES:
            png = _palette_png(pixels, colours, fixed)
    least, scale = width / pixels.shape[1], 1.0
    while len(png) > MOST_BYTES and scale > least:
        scale = max(least, 0.97 * scale * (MOST_BYTES / len(png)) ** 0.5)
        png = _palette_png(_resize(pixels, scale), PALETTES[-1], fixed)
    return png


def _resize(pixels: np.ndarray, scale: float) -> np.ndarray:
    import cv2

    size = (round(pixels.shape[1] * scale), round(pixels.shape[0] * scale))
    return cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)


def _palette_png(pixels: np.ndarray, most: int, fixed: np.ndarray) -> bytes:
    """Write (H, W, 3) uint8 with at most so many colours, the (K, 3) fixed ones as they are."""
    from PIL import Image
    from scipy.spatial import cKDTree

    used, where = np.unique(_cells(pixels, bits=6), return_inverse=True)
    if len(used) > MOST_CELLS:
        used, where = np.unique(_cells(pixels, bits=5), return_inverse=True)
    where = where.ravel()
    weights = np.bincount(where).astype(float)
    means = np.stack([np.bincount(where, pixels[..., k].ravel()) / weights for k in range(3)], axis=1)
    if len(used) <= most:
        palette, nearest = means, np.arange(len(used))
    else:
        sample = Image.fromarray(np.ascontiguousarray(pixels[::2, ::2]))
        adaptive = sample.quantize(most - len(fixed), method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        palette = np.concatenate([fixed, np.array(adaptive.getpalette(), float).reshape(-1, 3)])[:most]
        for _ in range(4):  # move each free colour to the mean of the pixels that it stands for
            nearest = cKDTree(palette).query(means)[1]
            total = np.bincount(nearest, weights, minlength=len(palette))
            sums = np.stack(
                [np.bincount(nearest, weights * means[:, k], minlength=len(palette)) for k in range(3)], axis=1
            )
            taken = total > 0
            taken[: len(fixed)] = False
            palette[taken] = sums[taken] / total[taken, None]
        nearest = cKDTree(palette).query(means)[1]
    index = nearest[where].reshape(pixels.shape[:2]).astype(np.uint8)
    palette = palette.round().astype(np.uint8)
    image = Image.fromarray(index, mode="P")
    image.putpalette(palette.ravel().tolist())
    buffer = io.BytesIO()
    image.save(buffer, format="PNG", compress_level=9)
    return buffer.getvalue()


def _cells(pixels: np.ndarray, bits: int) -> np.ndarray:
    """Number similar colours alike: (H, W) int, so many bits a channel."""
    red, green, blue = (pixels[..., k].astype(np.int32) >> (8 - bits) for k in range(3))
    return (red << 2 * bits) | (green << bits) | blue


def _fixed_colours(pixels: np.ndarray) -> np.ndarray:
    """Return (K, 3) the colours that stay exact: white, ink, and the classes of the course that the picture uses."""
    codes = pixels.astype(np.int32) @ [1 << 16, 1 << 8, 1]
    classes = np.array([rgb(code) for code in dict.fromkeys(COLOURS.values())])
    seen = [(codes == code).sum() > 12 for code in classes @ [1 << 16, 1 << 8, 1]]
    return np.array([(255, 255, 255), rgb(INK), *classes[seen]], dtype=float)
