"""Flat images side by side: depth and numbers with a colour bar, colour, grey, masks, and finished pictures."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._compose import Panel, columns_of, compose, extend_of, fit_width, fitting_width, panel_width
from course_lib.notebook._paint import ColourBar
from course_lib.notebook._picture import Picture, picture_of
from course_lib.notebook._words import amount, number, sentence

NO_DATA = ("no data", colours.COLOURS["no data"])
"""The legend's entry for what was not measured."""


@dataclass(frozen=True)
class Scale:
    """How numbers become colours: what the colour bar says, its ends (None: where the numbers end), zero in white?"""

    label: str = ""
    limits: tuple[float | None, float | None] | None = None
    signed: bool = False

    def bar(self, images: list[np.ndarray]) -> tuple[ColourBar, str]:
        """Return the colour bar of images, and on which sides values lie beyond it."""
        values = np.concatenate([image[np.isfinite(image)] for image in images])
        low, high = (float(q) for q in np.percentile(values, [0.5, 99.5]))
        if self.signed:
            high = max(abs(low), abs(high))
            low = -high
        near, far = self.limits or (None, None)
        limits = (low if near is None else float(near), high if far is None else float(far))
        bar = ColourBar(self.label, colours.SIGNED if self.signed else colours.MAGNITUDES, limits)
        return bar, extend_of(float(values.min()), float(values.max()), limits)


@dataclass(frozen=True)
class Flat:
    """An image ready to be drawn.

    Attributes
    ----------
    label : written above it.
    text : what it is, in words with numbers.
    rgb : (H, W, 3) uint8, or None where the colours depend on a colour bar.
    values : (H, W) float of such an image, NaN for no data.
    legend : entries for the picture's legend.
    """

    label: str
    text: str
    rgb: np.ndarray | None = None
    values: np.ndarray | None = None
    legend: list[tuple[str, str]] = field(default_factory=list)

    @property
    def aspect(self) -> float:
        """Height by width."""
        rows, columns = (self.values if self.rgb is None else self.rgb).shape[:2]
        return rows / columns


def images_picture(images: dict[str, object], title: str, scale: Scale, columns: int | None, alt: str) -> Picture:
    """Draw images side by side; numbers of one unit share one colour bar. See `show.images`."""
    if not images:
        raise ValueError("show.images needs at least one image: pass {'title': array}.")
    flat = [_flat(name, image, scale.label) for name, image in images.items()]
    several = sum(image.values is not None for image in flat) > 1
    shared = several and (bool(scale.label) or scale.limits is not None)
    return _draw(flat, scale, shared, columns, title, alt)


def depth_picture(
    depths: dict[str, np.ndarray], title: str, near: float | None, far: float | None, columns: int | None, alt: str
) -> Picture:
    """Draw depth images in metres side by side with one colour bar. See `show.depth`."""
    flat = [_depth(name, depth, f" '{name}'" if name else "") for name, depth in depths.items()]
    return _draw(flat, Scale("depth z (m)", (near, far)), True, columns, title, alt, "Colours")


def frames_picture(frames: list, title: str, alt: str) -> Picture:
    """Draw RGBDFrames: colour beside depth, a row a frame, one colour bar for all depths."""
    flat = []
    for frame in frames:
        name = getattr(frame, "name", "") or ""
        rows, columns = frame.color.shape[:2]
        text = f"Colour image{f' {name!r}' if name else ''} of {columns} × {rows} pixels."
        flat.append(Flat(f"{name} colour".strip(), text, frame.color))
        flat.append(_depth(f"{name} depth".strip(), frame.depth))
    return _draw(flat, Scale("depth z (m)"), True, 2, title, alt, "Colours of depth")


def _draw(
    flat: list[Flat], scale: Scale, shared: bool, columns: int | None, title: str, alt: str, span: str = ""
) -> Picture:
    """Draw images in rows, with one colour bar or one for each; `span` begins the words for the one of depths."""
    columns = columns or columns_of(len(flat))
    needs_bar = [image.values is not None for image in flat]
    bars = 1 if shared else max(sum(needs_bar[i : i + columns]) for i in range(0, len(flat), columns))
    bar, extend = scale.bar([one.values for one in flat if one.values is not None]) if shared else (None, "neither")
    legend = tuple(dict.fromkeys(entry for image in flat for entry in image.legend))
    around = {"columns": columns, "title": title, "legend": legend, "hint": ""}
    aspects = [image.aspect for image in flat]
    labels = any(image.label for image in flat)
    width = fitting_width(panel_width(columns, bars), aspects, labels=labels, strip=False, **around)
    panels = []
    for image in flat:
        if image.values is None:
            panels.append(Panel(image.label, fit_width(image.rgb, width)))
            continue
        own_bar, own_extend = (bar, extend) if shared else scale.bar([image.values])
        pixels = fit_width(colours.colour_map(own_bar.map, image.values, own_bar.limits), width)
        panels.append(Panel(image.label, pixels, bar=None if shared else own_bar, extend=own_extend))
    pixels = compose(panels, bar=bar, extend=extend, **around)
    words = [*([sentence(alt)] if alt else []), *(image.text for image in flat)]
    if span:
        low, high = (number(end, 2) for end in bar.limits)
        words.append(f"{span}: {low} m dark blue to {high} m yellow.")
    return picture_of(pixels, " ".join(words))


def _flat(name: str, image: object, unit: str) -> Flat:
    """Find out what an image is, and describe it."""
    if isinstance(image, Picture):
        return Flat(name, f"{name}: {image.alt}", image.pixels)
    image = np.asarray(image)
    if image.ndim not in (2, 3) or image.size == 0 or (image.ndim == 3 and image.shape[2] not in (3, 4)):
        raise ValueError(f"The image {name!r} has shape {image.shape}: pass (H, W, 3) colour or (H, W) numbers.")
    rows, columns = image.shape[:2]
    start = f"Image{f' {name!r}' if name else ''} of {columns} × {rows} pixels"
    if image.ndim == 3:
        if image.dtype.kind == "f":
            image = np.clip(np.nan_to_num(image), 0, 1) * 255
        return Flat(name, f"{start}, in colour.", image[..., :3].astype(np.uint8))
    if image.dtype.kind == "b":
        yes, no = np.array(colours.rgb("inlier"), np.uint8), np.array(colours.rgb("#EBEBEB"), np.uint8)
        legend = [("yes", colours.COLOURS["inlier"]), ("no", "#EBEBEB")]
        share = amount(100 * float(image.mean()), "%", 2)
        return Flat(name, f"{start}: yes in {share} (blue).", np.where(image[..., None], yes, no), legend=legend)
    if image.dtype == np.uint8:
        text = f"{start}, grey, {image.min()} to {image.max()} of 255."
        return Flat(name, text, np.repeat(image[..., None], 3, axis=2))
    values = image.astype(np.float64)
    if not np.isfinite(values).any():
        raise ValueError(f"There is nothing to show: every pixel of {name!r} is NaN.")
    return _numbers(name, values, start, unit)


def _depth(label: str, depth: np.ndarray, called: str = "") -> Flat:
    """Check a depth image and turn its no-data into NaN."""
    depth = np.asarray(depth)
    if depth.ndim != 2:
        raise ValueError(f"A depth image is (H, W) and this has shape {depth.shape}: for colour use show.images.")
    if depth.dtype.kind != "f":
        raise ValueError(
            f"This depth image holds {depth.dtype} numbers, not metres: decode it first (rgbd.decode_depth), or look "
            "at the numbers as they are with show.images({'raw': raw})."
        )
    clean = np.where(np.isfinite(depth) & (depth > 0), depth, np.nan).astype(np.float64)
    if not np.isfinite(clean).any():
        raise ValueError("There is nothing to show: every pixel of this depth image is without data.")
    start = f"Depth image{called} of {depth.shape[1]} × {depth.shape[0]} pixels"
    return _numbers(label, clean, start, "m", whole="; every pixel measured")


def _numbers(label: str, values: np.ndarray, start: str, unit: str, whole: str = "") -> Flat:
    """Describe (H, W) numbers, NaN for no data; `whole` is said where there is no such pixel."""
    finite = values[np.isfinite(values)]
    near, middle, far = (number(float(q), 3) for q in np.percentile(finite, [1, 50, 99]))
    share = 100 * (1 - finite.size / values.size)
    holes = f"; no data in {amount(share, '%', 2)} (pale pink)" if share > 0 else whole
    of = f" {unit}" if unit else ""
    text = f"{start}: median {middle}{of}, 98 % of it between {near} and {far}{of}{holes}."
    return Flat(label, text, values=values, legend=[NO_DATA] if share > 0 else [])
