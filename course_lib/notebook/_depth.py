"""Flat pictures: depth images whose legend shows "no data" as a colour of its own, and rows of images."""

from __future__ import annotations

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._compose import Panel, columns_of, compose, no_data_entry, panel_width
from course_lib.notebook._picture import Picture, picture_of
from course_lib.notebook._scene import ColourBar
from course_lib.notebook._words import amount, number, sentence


def depth_picture(
    depths: dict[str, np.ndarray], title: str, near: float | None, far: float | None, columns: int | None, alt: str
) -> Picture:
    """Draw depth images in metres side by side with one colour bar. See `show.depth`."""
    clean = {name: _metres(depth) for name, depth in depths.items()}
    limits, extend = _depth_limits(list(clean.values()), near, far)
    columns = columns or columns_of(len(clean))
    width = panel_width(columns, bars=1)
    panels = [Panel(name, depth_pixels(depth, limits, width)) for name, depth in clean.items()]
    holes = any(np.isnan(depth).any() for depth in clean.values())
    bar = ColourBar("depth z (m)", colours.MAGNITUDES, limits)
    legend = (no_data_entry(),) if holes else ()
    pixels = compose(panels, columns=columns, title=title, legend=legend, bar=bar, extend=extend)
    parts = [depth_text(depth, name) for name, depth in clean.items()]
    span = f"Colours: {number(limits[0], 2)} m dark blue to {number(limits[1], 2)} m yellow."
    return picture_of(pixels, " ".join([*([sentence(alt)] if alt else []), *parts, span]))


def depth_pixels(depth: np.ndarray, limits: tuple[float, float], width: int) -> np.ndarray:
    """Colour a depth image (H, W), NaN for no data, at a width in pixels: (h, width, 3) uint8."""
    return fit_width(colours.colour_map(colours.MAGNITUDES, depth, limits), width)


def depth_text(depth: np.ndarray, name: str = "") -> str:
    """Describe a depth image (H, W), NaN for no data."""
    rows, columns = depth.shape
    measured = depth[np.isfinite(depth)]
    share = 100 * (1 - measured.size / depth.size)
    called = f" '{name}'" if name else ""
    near, middle, far = (number(float(q), 3) for q in np.percentile(measured, [1, 50, 99]))
    holes = f"no data in {amount(share, '%', 2)} (pale pink)" if share > 0 else "every pixel measured"
    return (
        f"Depth image{called} of {columns} × {rows} pixels: "
        f"median {middle} m, 98 % of it between {near} and {far} m; {holes}."
    )


def _metres(depth: np.ndarray) -> np.ndarray:
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
    return clean


def _depth_limits(depths: list[np.ndarray], near: float | None, far: float | None) -> tuple[tuple[float, float], str]:
    """Choose the ends of the colour bar, and on which side values lie beyond it."""
    measured = np.concatenate([depth[np.isfinite(depth)] for depth in depths])
    low, high = (float(q) for q in np.percentile(measured, [0.5, 99.5]))
    limits = (low if near is None else float(near), high if far is None else float(far))
    return limits, _extend(float(measured.min()), float(measured.max()), limits)


def _extend(low: float, high: float, limits: tuple[float, float]) -> str:
    margin = 0.02 * (limits[1] - limits[0])
    below, above = low < limits[0] - margin, high > limits[1] + margin
    return {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}[below, above]


def images_picture(
    images: dict[str, object],
    title: str,
    unit: str,
    limits: tuple[float, float] | None,
    signed: bool,
    columns: int | None,
    alt: str,
) -> Picture:
    """Draw images of any kind side by side. See `show.images`."""
    if not images:
        raise ValueError("show.images needs at least one image: pass {'title': array}.")
    columns = columns or columns_of(len(images))
    bars = max(sum(map(_needs_bar, list(images.values())[i : i + columns])) for i in range(0, len(images), columns))
    width = panel_width(columns, bars)
    panels, parts, legend = [], [], []
    for name, image in images.items():
        panel, text, entries = _image_panel(name, image, unit, limits, signed, width)
        panels.append(panel)
        parts.append(text)
        legend += [entry for entry in entries if entry not in legend]
    pixels = compose(panels, columns=columns, title=title, legend=tuple(legend))
    return picture_of(pixels, " ".join([*([sentence(alt)] if alt else []), *parts]))


def _needs_bar(image: object) -> bool:
    """Say whether an image holds numbers that only a colour bar explains."""
    return not isinstance(image, Picture) and np.ndim(image) == 2 and np.asarray(image).dtype not in (np.uint8, bool)


def _image_panel(
    name: str, image: object, unit: str, limits: tuple[float, float] | None, signed: bool, width: int
) -> tuple[Panel, str, list[tuple[str, str]]]:
    """Make a panel, its text and its legend entries of one image."""
    if isinstance(image, Picture):
        return Panel(name, fit_width(image.pixels, width)), f"{name}: {image.alt}", []
    image = np.asarray(image)
    if image.ndim not in (2, 3) or image.size == 0 or (image.ndim == 3 and image.shape[2] not in (3, 4)):
        raise ValueError(f"The image {name!r} has shape {image.shape}: pass (H, W, 3) colour or (H, W) numbers.")
    rows, columns = image.shape[:2]
    start = f"Image '{name}' of {columns} × {rows} pixels"
    if image.ndim == 3:
        if image.dtype.kind == "f":
            image = np.clip(np.nan_to_num(image), 0, 1) * 255
        return Panel(name, fit_width(image[..., :3].astype(np.uint8), width)), f"{start}, in colour.", []
    if image.dtype.kind == "b":
        yes, no = np.array(colours.rgb("inlier"), np.uint8), np.array((235, 235, 235), np.uint8)
        share = amount(100 * float(image.mean()), "%", 2)
        entries = [("yes", colours.COLOURS["inlier"]), ("no", "#EBEBEB")]
        return (
            Panel(name, fit_width(np.where(image[..., None], yes, no), width)),
            f"{start}: yes in {share} (blue).",
            entries,
        )
    if image.dtype == np.uint8:
        low, high = image.min(), image.max()
        grey = np.repeat(image[..., None], 3, axis=2)
        return Panel(name, fit_width(grey, width)), f"{start}, grey, {low} to {high} of 255.", []
    return _numbers_panel(name, image.astype(np.float64), start, unit, limits, signed, width)


def _numbers_panel(name, image, start, unit, limits, signed, width) -> tuple[Panel, str, list[tuple[str, str]]]:
    finite = image[np.isfinite(image)]
    if finite.size == 0:
        raise ValueError(f"There is nothing to show: every pixel of {name!r} is NaN.")
    if limits is None:
        low, high = (float(q) for q in np.percentile(finite, [0.5, 99.5]))
        limits = (-max(abs(low), abs(high)), max(abs(low), abs(high))) if signed else (low, high)
    map_name = colours.SIGNED if signed else colours.MAGNITUDES
    pixels = fit_width(colours.colour_map(map_name, image, limits), width)
    bar = ColourBar(unit, map_name, limits)
    near, middle, far = (number(float(q), 3) for q in np.percentile(finite, [1, 50, 99]))
    holes = 100 * (1 - finite.size / image.size)
    missing = f"; no data in {amount(holes, '%', 2)} (pale pink)" if holes > 0 else ""
    unit_text = f" {unit}" if unit else ""
    text = f"{start}: median {middle}{unit_text}, 98 % of it between {near} and {far}{unit_text}{missing}."
    extend = _extend(float(finite.min()), float(finite.max()), limits)
    return Panel(name, pixels, bar=bar, extend=extend), text, [no_data_entry()] if holes > 0 else []


def fit_width(pixels: np.ndarray, width: int) -> np.ndarray:
    """Resize (H, W, 3) uint8 to a width: averaged when it shrinks, square pixels when it grows."""
    import cv2

    height = max(1, round(pixels.shape[0] * width / pixels.shape[1]))
    grow = width > pixels.shape[1]
    return cv2.resize(pixels, (width, height), interpolation=cv2.INTER_NEAREST if grow else cv2.INTER_AREA)


def frames_picture(frames: list, title: str, alt: str) -> Picture:
    """Draw RGBDFrames: colour beside depth, a row a frame, one colour bar for all depths."""
    depths = [_metres(frame.depth) for frame in frames]
    limits, extend = _depth_limits(depths, None, None)
    width = panel_width(2, bars=1)
    panels, parts = [], []
    for frame, depth in zip(frames, depths, strict=True):
        name = getattr(frame, "name", "") or ""
        rows, columns = frame.color.shape[:2]
        panels += [Panel(f"{name} colour".strip(), fit_width(frame.color, width))]
        panels += [Panel(f"{name} depth".strip(), depth_pixels(depth, limits, width))]
        parts.append(f"Colour image{f' {name!r}' if name else ''} of {columns} × {rows} pixels. {depth_text(depth)}")
    holes = any(np.isnan(depth).any() for depth in depths)
    bar = ColourBar("depth z (m)", colours.MAGNITUDES, limits)
    legend = (no_data_entry(),) if holes else ()
    pixels = compose(panels, columns=2, title=title, legend=legend, bar=bar, extend=extend)
    span = f"Colours of depth: {number(limits[0], 2)} m dark blue to {number(limits[1], 2)} m yellow."
    return picture_of(pixels, " ".join([*([sentence(alt)] if alt else []), *parts, span]))
