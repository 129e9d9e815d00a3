"""Pictures of depth images and RGB-D frames, whose legend shows "no data" as a colour of its own."""

from __future__ import annotations

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._compose import Panel, columns_of, compose, extend_of, fit_width, no_data_entry, panel_width
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
    return limits, extend_of(float(measured.min()), float(measured.max()), limits)


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
