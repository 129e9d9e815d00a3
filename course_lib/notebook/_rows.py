"""Rows of flat images of every kind: colour, grey, masks, numbers with a colour bar, and finished pictures."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._compose import Panel, columns_of, compose, extend_of, fit_width, no_data_entry, panel_width
from course_lib.notebook._paint import ColourBar
from course_lib.notebook._picture import Picture, picture_of
from course_lib.notebook._words import amount, number, sentence


@dataclass(frozen=True)
class Scale:
    """How numbers become colours: see `show.images`."""

    unit: str = ""
    limits: tuple[float, float] | None = None
    signed: bool = False

    def bar(self, images: list[np.ndarray]) -> tuple[ColourBar, str]:
        """Return the colour bar of images, and on which sides values lie beyond it."""
        values = np.concatenate([image[np.isfinite(image)] for image in images])
        low, high = self.limits or (float(q) for q in np.percentile(values, [0.5, 99.5]))
        if self.signed and self.limits is None:
            high = max(abs(low), abs(high))
            low = -high
        bar = ColourBar(self.unit, colours.SIGNED if self.signed else colours.MAGNITUDES, (low, high))
        return bar, extend_of(float(values.min()), float(values.max()), bar.limits)


@dataclass(frozen=True)
class Flat:
    """An image ready to be drawn.

    Attributes
    ----------
    text : what it is, in words with numbers.
    rgb : (H, W, 3) uint8, or None where the colours depend on a colour bar.
    values : (H, W) float of such an image, NaN for no data.
    legend : entries for the picture's legend.
    """

    text: str
    rgb: np.ndarray | None = None
    values: np.ndarray | None = None
    legend: list[tuple[str, str]] = field(default_factory=list)


def images_picture(images: dict[str, object], title: str, scale: Scale, columns: int | None, alt: str) -> Picture:
    """Draw images side by side; numbers of one unit share one colour bar. See `show.images`."""
    if not images:
        raise ValueError("show.images needs at least one image: pass {'title': array}.")
    flat = {name: _flat(name, image, scale.unit) for name, image in images.items()}
    columns = columns or columns_of(len(flat))
    numbers = [image.values for image in flat.values() if image.values is not None]
    shared = len(numbers) > 1 and (bool(scale.unit) or scale.limits is not None)
    bar, extend = scale.bar(numbers) if shared else (None, "neither")
    needs_bar = [image.values is not None for image in flat.values()]
    bars = 1 if shared else max(sum(needs_bar[i : i + columns]) for i in range(0, len(flat), columns))
    width = panel_width(columns, bars)
    panels = []
    for name, image in flat.items():
        if image.values is None:
            panels.append(Panel(name, fit_width(image.rgb, width)))
            continue
        own_bar, own_extend = (bar, extend) if shared else scale.bar([image.values])
        pixels = fit_width(colours.colour_map(own_bar.map, image.values, own_bar.limits), width)
        panels.append(Panel(name, pixels, bar=None if shared else own_bar, extend=own_extend))
    legend = tuple(dict.fromkeys(entry for image in flat.values() for entry in image.legend))
    pixels = compose(panels, columns=columns, title=title, legend=legend, bar=bar, extend=extend)
    return picture_of(pixels, " ".join([*([sentence(alt)] if alt else []), *(image.text for image in flat.values())]))


def _flat(name: str, image: object, unit: str) -> Flat:
    """Find out what an image is, and describe it."""
    if isinstance(image, Picture):
        return Flat(f"{name}: {image.alt}", image.pixels)
    image = np.asarray(image)
    if image.ndim not in (2, 3) or image.size == 0 or (image.ndim == 3 and image.shape[2] not in (3, 4)):
        raise ValueError(f"The image {name!r} has shape {image.shape}: pass (H, W, 3) colour or (H, W) numbers.")
    rows, columns = image.shape[:2]
    start = f"Image{f' {name!r}' if name else ''} of {columns} × {rows} pixels"
    if image.ndim == 3:
        if image.dtype.kind == "f":
            image = np.clip(np.nan_to_num(image), 0, 1) * 255
        return Flat(f"{start}, in colour.", image[..., :3].astype(np.uint8))
    if image.dtype.kind == "b":
        yes, no = np.array(colours.rgb("inlier"), np.uint8), np.array(colours.rgb("#EBEBEB"), np.uint8)
        legend = [("yes", colours.COLOURS["inlier"]), ("no", "#EBEBEB")]
        share = amount(100 * float(image.mean()), "%", 2)
        return Flat(f"{start}: yes in {share} (blue).", np.where(image[..., None], yes, no), legend=legend)
    if image.dtype == np.uint8:
        text = f"{start}, grey, {image.min()} to {image.max()} of 255."
        return Flat(text, np.repeat(image[..., None], 3, axis=2))
    return _numbers(name, image.astype(np.float64), start, unit)


def _numbers(name: str, values: np.ndarray, start: str, unit: str) -> Flat:
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        raise ValueError(f"There is nothing to show: every pixel of {name!r} is NaN.")
    near, middle, far = (number(float(q), 3) for q in np.percentile(finite, [1, 50, 99]))
    holes = 100 * (1 - finite.size / values.size)
    missing = f"; no data in {amount(holes, '%', 2)} (pale pink)" if holes > 0 else ""
    of = f" {unit}" if unit else ""
    text = f"{start}: median {middle}{of}, 98 % of it between {near} and {far}{of}{missing}."
    return Flat(text, values=values, legend=[no_data_entry()] if holes > 0 else [])
