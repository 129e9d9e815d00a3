"""Colours of the course: classes that colour-blind people can tell apart, and maps that are even to the eye.

References
----------
Okabe and Ito, Color Universal Design, 2008 (the classes).
Smith and van der Walt, A better default colormap for Matplotlib, SciPy 2015 (viridis, the map of magnitudes).
"""

from __future__ import annotations

import numpy as np

COLOURS: dict[str, str] = {
    "inlier": "#0072B2",
    "outlier": "#D55E00",
    "source": "#E69F00",
    "target": "#0072B2",
    "truth": "#000000",
    "estimate": "#CC79A7",
    "ours": "#009E73",
    "reference": "#56B4E9",
    "surface": "#B8C4CE",
    "no data": "#E3B7CF",
}
"""What a class looks like in every picture of the course."""

_WORDS: dict[str, str] = {
    "#0072B2": "blue",
    "#E69F00": "orange",
    "#009E73": "green",
    "#CC79A7": "pink",
    "#56B4E9": "sky blue",
    "#D55E00": "vermilion",
    "#000000": "black",
    "#B8C4CE": "grey",
    "#E3B7CF": "pale pink",
}

COLOUR_WORDS: dict[str, str] = {name: _WORDS[code] for name, code in COLOURS.items()}
"""The same colours in words, for the text description of a picture."""

CYCLE: tuple[tuple[str, str], ...] = tuple(_WORDS.items())[:7]
"""What things without a class of their own take, in this order; also the colour cycle of plots (see `show.style`)."""

MAGNITUDES = "viridis"
"""The map of depths, heights and errors: dark blue is small, yellow is large."""

SIGNED = "RdBu_r"
"""The map of signed errors: blue is negative, white is zero, red is positive."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Read a class of COLOURS or a "#rrggbb" as three numbers 0..255."""
    code = COLOURS.get(colour, colour)
    if len(code) != 7 or not code.startswith("#"):
        raise ValueError(f"{colour!r} is no colour of the course: use one of {', '.join(COLOURS)} or '#rrggbb'.")
    return int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16)


def colour_map(name: str, values: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Colour (...) numbers with a Matplotlib map: (..., 3) uint8; NaN becomes the colour of "no data"."""
    from matplotlib import colormaps

    low, high = limits
    values = np.asarray(values, dtype=np.float64)
    share = (values - low) / (high - low if high > low else 1.0)
    measured = np.isfinite(share)
    colours = colormaps[name](np.clip(np.where(measured, share, 0.0), 0.0, 1.0), bytes=True)[..., :3]
    colours[~measured] = rgb("no data")
    return colours


def style() -> None:
    """Give Matplotlib plots the course's fonts, sizes and colour cycle, by setting rcParams.

    Applied by itself when `show` is imported in IPython, so that a lesson's plots look alike without a line of code;
    elsewhere nothing global is touched.
    """
    from cycler import cycler
    from matplotlib import rcParams

    rcParams.update(
        {
            "axes.prop_cycle": cycler(color=[code for code, _ in CYCLE]),
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "axes.axisbelow": True,
            "grid.color": "#DDDDDD",
            "grid.linewidth": 0.6,
            "font.size": 10,
            "axes.titlesize": 11,
            "legend.framealpha": 0.85,
            "legend.edgecolor": "white",
            "figure.figsize": (7.0, 3.6),
            "figure.constrained_layout.use": True,
            "image.cmap": MAGNITUDES,
        }
    )
