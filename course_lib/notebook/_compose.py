"""Panels put together: pictures side by side with labels, scale bars, axes, a legend and a colour bar."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._scene import ColourBar
from course_lib.notebook._views import View

DPI = 200
GAP, LABEL_ROW, TITLE_ROW, LEGEND_ROW, BAR_COLUMN = 24, 44, 56, 56, 190
INK = "#222222"


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
    """How many panels stand side by side."""
    return n if n <= 4 else 3 if n in (5, 6, 9) else 4


def compose(
    panels: list[Panel],
    *,
    title: str = "",
    legend: tuple[tuple[str, str], ...] = (),
    bar: ColourBar | None = None,
    hint: str = "",
    extend: str = "neither",
    columns: int | None = None,
) -> np.ndarray:
    """Lay out panels in rows: (H, W, 3) uint8."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n = columns or columns_of(len(panels))
    rows = [panels[i : i + n] for i in range(0, len(panels), n)]
    cell_width = max(panel.pixels.shape[1] + (BAR_COLUMN if panel.bar else 0) for panel in panels)
    labels = LABEL_ROW if any(panel.label for panel in panels) else 0
    heights = [max(panel.pixels.shape[0] for panel in row) + labels for row in rows]
    top = TITLE_ROW if title else 0
    bottom = (LEGEND_ROW if legend else 0) + (LABEL_ROW if hint else 0)
    width = n * cell_width + (n - 1) * GAP + (BAR_COLUMN if bar else 0) + 2 * GAP
    height = top + sum(heights) + (len(rows) - 1) * GAP + bottom + 2 * GAP
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)

    def place(left: float, up: float, wide: float, high: float):
        return figure.add_axes((left / width, 1 - (up + high) / height, wide / width, high / height))

    def write(x: float, y: float, text: str, size: float, **style) -> None:
        figure.text(x / width, 1 - y / height, text, fontsize=size, color=INK, **style)

    y = GAP + top
    if title:
        write(GAP, GAP + 4, title, 10.5, weight="bold", va="top")
    for row, row_height in zip(rows, heights, strict=True):
        x = GAP
        for panel in row:
            high, wide = panel.pixels.shape[:2]
            if panel.label:
                write(x + wide / 2, y + 4, panel.label, 9, ha="center", va="top")
            axes = place(x, y + labels, wide, high)
            axes.imshow(panel.pixels, interpolation="none", aspect="auto")
            axes.set_axis_off()
            if panel.view is not None:
                _axes_mark(axes, panel.view)
                _scale_bar(axes, panel.view)
            if panel.bar is not None:
                _colour_bar(place(x + wide + 18, y + labels + 0.04 * high, 26, 0.92 * high), panel.bar, panel.extend)
            x += cell_width + GAP
        y += row_height + GAP
    if bar is not None:
        high = min(sum(heights) - labels, 900)
        _colour_bar(place(width - GAP - BAR_COLUMN + 24, GAP + top + labels + 0.05 * high, 28, 0.9 * high), bar, extend)
    if legend:
        from matplotlib.lines import Line2D

        handles = [Line2D([], [], marker="o", linestyle="", markersize=8, color=code, label=name) for name, code in legend]
        figure.legend(handles=handles, loc="lower center", ncols=min(len(handles), 6), frameon=False, fontsize=9,
                      labelcolor=INK, bbox_to_anchor=(0.5, (LABEL_ROW if hint else 0) / height), handletextpad=0.2)
    if hint:
        write(GAP, height - 6, hint, 7, va="bottom", style="italic")
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


def _colour_bar(axes, bar: ColourBar, extend: str) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    low, high = bar.limits
    drawn = axes.figure.colorbar(
        ScalarMappable(Normalize(low, high if high > low else low + 1e-6), bar.map), cax=axes, extend=extend
    )
    drawn.set_label(bar.label, fontsize=9, color=INK)
    drawn.ax.tick_params(labelsize=8, colors=INK)
    drawn.outline.set_linewidth(0.4)


def _axes_mark(axes, view: View) -> None:
    """Draw x, y and z as they lie in this view, at the lower left."""
    length = 44.0
    origin = np.array([64.0, view.height - 64.0])
    for name, axis, colour in zip("xyz", np.eye(3), ("#D55E00", "#009E73", "#0072B2"), strict=True):
        tip = np.array([axis @ view.right, -(axis @ view.up)]) * length
        if np.linalg.norm(tip) < 0.2 * length:
            continue
        axes.annotate("", origin + tip, origin, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.3, "shrinkA": 0,
                                                           "shrinkB": 0, "mutation_scale": 7})
        axes.text(*(origin + tip * 1.4), name, fontsize=7.5, color=colour, ha="center", va="center", weight="bold")


def _scale_bar(axes, view: View) -> None:
    """Draw a round length in metres at the lower right; only parallel views have one that is true."""
    if view.pixels_per_metre is None:
        return
    longest = 0.28 * view.width / view.pixels_per_metre
    power = 10.0 ** math.floor(math.log10(longest))
    metres = next(step * power for step in (5, 2, 1) if step * power <= longest)
    right, y = view.width - 24.0, view.height - 24.0
    left = right - metres * view.pixels_per_metre
    axes.plot([left, right], [y, y], color=INK, lw=1.6, solid_capstyle="butt")
    text = f"{metres:g} m" if metres >= 0.5 else f"{metres * 100:g} cm" if metres >= 0.01 else f"{metres * 1000:g} mm"
    axes.text((left + right) / 2, y - 8, text, fontsize=8, color=INK, ha="center", va="bottom")
    axes.set_xlim(0, view.width)
    axes.set_ylim(view.height, 0)


def no_data_entry() -> tuple[str, str]:
    """The legend's entry for what was not measured."""
    return "no data", colours.COLOURS["no data"]
