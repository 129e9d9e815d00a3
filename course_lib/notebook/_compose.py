"""Panels put together: pictures side by side with labels, scale bars, axes, a legend and a colour bar."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from course_lib.notebook._picture import INK, TALLEST, WIDTH, blank, drawn
from course_lib.notebook._scene import ColourBar
from course_lib.notebook._views import View

DPI = 160
GAP, LABEL_ROW, TITLE_ROW, LEGEND_ROW, STRIP, BAR_COLUMN = 20, 36, 44, 46, 84, 136
AXIS_COLOURS = ("#D55E00", "#009E73", "#0072B2")


@dataclass(frozen=True)
class Panel:
    """One picture in a row.

    Attributes
    ----------
    label : written above it; may be empty.
    pixels : (H, W, 3) uint8.
    view : for the scale bar and the axes; None for a flat image.
    bar : a colour bar of its own at its right; None for none.
    """

    label: str
    pixels: np.ndarray
    view: View | None = None
    bar: ColourBar | None = None
    extend: str = "neither"


def columns_of(n: int) -> int:
    """How many panels stand side by side, so that each can be read from the back of a room."""
    return n if n <= 3 else 2 if n == 4 else 3 if n in (5, 6, 9) else 4


def panel_width(n: int, bars: int = 0) -> int:
    """Pixels that each of n panels in a row may be wide, where so many colour bars stand beside them."""
    return (WIDTH - 2 * GAP - bars * BAR_COLUMN - (n - 1) * GAP) // n


def fitting_width(
    width: int, aspects: list[float], *, columns: int, labels: bool, strip: bool, title: str, legend: object, hint: str
) -> int:
    """Pixels that each panel may be wide in a picture that is no taller than a screen, its legend included.

    Parameters
    ----------
    width : what there is room for side by side.
    aspects : height by width of each panel, in reading order.
    labels, strip : whether panels have a line above them, and scale and axes below.
    """
    rows = [max(aspects[i : i + columns]) for i in range(0, len(aspects), columns)]
    around = 2 * GAP + (TITLE_ROW if title else 0) + (LEGEND_ROW if legend else 0) + (LABEL_ROW if hint else 0)
    around += len(rows) * ((LABEL_ROW if labels else 0) + (STRIP if strip else 0) + GAP) - GAP
    return min(width, math.floor((TALLEST - around) / sum(rows)))


def compose(
    panels: list[Panel],
    *,
    columns: int,
    title: str = "",
    legend: tuple[tuple[str, str], ...] = (),
    bar: ColourBar | None = None,
    hint: str = "",
    extend: str = "neither",
) -> np.ndarray:
    """Lay out panels in rows: (H, W, 3) uint8.

    Parameters
    ----------
    panels : in reading order.
    columns : panels in a row.
    title, legend, bar : of the whole picture; `extend` as in Matplotlib's colorbar.
    hint : a small line at the bottom.
    """
    rows = [panels[i : i + columns] for i in range(0, len(panels), columns)]
    widths = [max(_width(row[k]) for row in rows if k < len(row)) for k in range(len(rows[0]))]
    labels = [LABEL_ROW if any(panel.label for panel in row) else 0 for row in rows]
    strip = STRIP if any(panel.view is not None for panel in panels) else 0
    heights = [max(panel.pixels.shape[0] for panel in row) + strip for row in rows]
    top = GAP + (TITLE_ROW if title else 0)
    bottom = (LEGEND_ROW if legend else 0) + (LABEL_ROW if hint else 0)
    width = sum(widths) + (len(widths) - 1) * GAP + (BAR_COLUMN if bar else 0) + 2 * GAP
    height = top + sum(heights) + sum(labels) + (len(rows) - 1) * GAP + bottom + GAP
    figure = blank(width, height, DPI)

    def place(left: float, up: float, wide: float, high: float):
        return figure.add_axes((left / width, 1 - (up + high) / height, wide / width, high / height))

    def write(x: float, y: float, text: str, size: float, **style) -> None:
        figure.text(x / width, 1 - y / height, text, fontsize=size, color=INK, **style)

    if title:
        write(GAP, GAP + 4, title, min(10.5, (width - 2 * GAP) / (1.35 * len(title))), weight="bold", va="top")
    y = top
    for row, row_height, label_height in zip(rows, heights, labels, strict=True):
        x = GAP
        for panel, column_width in zip(row, widths, strict=False):
            high, wide = panel.pixels.shape[:2]
            if panel.label:
                size = min(9.0, 9.0 * column_width / (11.5 * len(panel.label)))  # long labels stay inside their column
                write(x + wide / 2, y + 4, panel.label, max(size, 6.0), ha="center", va="top")
            axes = place(x, y + label_height, wide, high)
            axes.imshow(panel.pixels, interpolation="none", aspect="auto")
            axes.set_axis_off()
            if panel.view is not None:
                _scale_strip(place(x, y + label_height + high, wide, STRIP), panel.view)
            if panel.bar is not None:
                beside = place(x + wide + 14, y + label_height + 0.04 * high, 20, 0.92 * high)
                _colour_bar(beside, panel.bar, panel.extend)
            x += column_width + GAP
        y += row_height + label_height + GAP
    if bar is not None:
        high = sum(heights) + sum(labels[1:]) + (len(rows) - 1) * GAP - strip
        beside = place(width - GAP - BAR_COLUMN + 18, top + labels[0] + 0.05 * high, 20, 0.9 * high)
        _colour_bar(beside, bar, extend)
    if legend:
        _legend(figure, legend, (LABEL_ROW if hint else 0) / height)
    if hint:
        write(GAP, height - 6, hint, 7, va="bottom", style="italic")
    return drawn(figure)


def _width(panel: Panel) -> int:
    return panel.pixels.shape[1] + (BAR_COLUMN if panel.bar else 0)


def _legend(figure, entries: tuple[tuple[str, str], ...], bottom: float) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], marker="o", linestyle="", markersize=8, color=code, label=name) for name, code in entries]
    figure.legend(
        handles=handles,
        loc="lower center",
        ncols=min(len(handles), 6),
        frameon=False,
        fontsize=9,
        labelcolor=INK,
        bbox_to_anchor=(0.5, bottom),
        handletextpad=0.2,
    )


def _colour_bar(axes, bar: ColourBar, extend: str) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    low, high = bar.limits
    scale = axes.figure.colorbar(
        ScalarMappable(Normalize(low, high if high > low else low + 1e-6), bar.map), cax=axes, extend=extend
    )
    scale.set_label(bar.label, fontsize=9, color=INK)
    scale.ax.tick_params(labelsize=8, colors=INK)
    scale.outline.set_linewidth(0.4)


def _scale_strip(axes, view: View) -> None:
    """Draw, under a panel, how x, y and z lie in it and how long a metre is."""
    axes.set_axis_off()
    axes.set_xlim(0, view.width)
    axes.set_ylim(STRIP, 0)
    tips = [np.array([axis @ view.right, -(axis @ view.up)]) * 32.0 for axis in np.eye(3)]
    origin = np.array([56.0, STRIP / 2]) - (np.max([*tips, (0, 0)], axis=0) + np.min([*tips, (0, 0)], axis=0)) / 2
    for name, tip, colour in zip("xyz", tips, AXIS_COLOURS, strict=True):
        if np.linalg.norm(tip) < 8:
            continue
        arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.3, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
        axes.annotate("", origin + tip, origin, arrowprops=arrow)
        axes.text(*(origin + tip * 1.45), name, fontsize=7.5, color=colour, ha="center", va="center", weight="bold")
    if view.pixels_per_metre is None:  # in perspective no length is true everywhere
        return
    metres = round_length(0.3 * view.width / view.pixels_per_metre)
    right, y = view.width - 20.0, STRIP / 2 + 12
    left = right - metres * view.pixels_per_metre
    axes.plot([left, right], [y, y], color=INK, lw=1.8, solid_capstyle="butt")
    axes.text((left + right) / 2, y - 8, length_text(metres), fontsize=8, color=INK, ha="center", va="bottom")


def round_length(longest: float) -> float:
    """Return the longest of 1, 2, 5, 10 ... that is not over a length in metres."""
    power = 10.0 ** math.floor(math.log10(longest))
    return next(step * power for step in (5, 2, 1) if step * power <= longest)


def length_text(metres: float) -> str:
    """Write a round length: "50 cm"."""
    return f"{metres:g} m" if metres >= 1 else f"{metres * 100:g} cm" if metres >= 0.01 else f"{metres * 1000:g} mm"


def fit_width(pixels: np.ndarray, width: int) -> np.ndarray:
    """Resize (H, W, 3) uint8 to a width: averaged when it shrinks, square pixels when it grows."""
    import cv2

    height = max(1, round(pixels.shape[0] * width / pixels.shape[1]))
    grow = width > pixels.shape[1]
    return cv2.resize(pixels, (width, height), interpolation=cv2.INTER_NEAREST if grow else cv2.INTER_AREA)


def extend_of(low: float, high: float, limits: tuple[float, float]) -> str:
    """Say on which side of a colour bar values lie beyond it, as Matplotlib's colorbar wants it."""
    margin = 0.02 * (limits[1] - limits[0])
    below, above = low < limits[0] - margin, high > limits[1] + margin
    return {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[below, above]
