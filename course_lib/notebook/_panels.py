"""Scenes drawn by the renderer that this machine has, and put together to a Picture with its description."""

from __future__ import annotations

import os

import numpy as np

from course_lib.notebook._compose import Panel, columns_of, compose, panel_width
from course_lib.notebook._picture import DENSITY, Picture, picture_of
from course_lib.notebook._probe import rendering
from course_lib.notebook._scene import Scene
from course_lib.notebook._views import View, layout
from course_lib.notebook._words import sentence


def draw_scenes(
    scenes: list[Scene],
    looks: list[View],
    labels: list[str],
    title: str,
    size: float | None,
    zoom: float,
    cull: bool,
    columns: int | None,
    text: str,
    alt: str,
) -> Picture:
    """Draw one panel a scene with the renderer that this machine has, and put them together."""
    bar = next((scene.bar for scene in scenes if scene.bar is not None), None)
    columns = columns or columns_of(len(looks))
    width = panel_width(columns, bars=1 if bar else 0)
    looks = layout(looks, [scene.points for scene in scenes], width, zoom)
    name, reason = rendering()
    if name == "pyvista":
        from course_lib.notebook._render import draw
    else:
        from course_lib.notebook._fallback import draw
    if all(scene is scenes[0] for scene in scenes):
        images = draw(scenes[0].layers, looks, _point_size(scenes[0], looks[0], size), cull)
    else:
        images = [
            draw(s.layers, [one], _point_size(s, one, size), cull)[0] for s, one in zip(scenes, looks, strict=True)
        ]
    for label, image in zip(labels, images, strict=True):
        if not (image < 250).any():
            raise ValueError(
                f"The view {label or looks[0].name!r} came out blank: its colours may be white, or the view misses it."
            )
    panels = [Panel(label, image, one) for label, image, one in zip(labels, images, looks, strict=True)]
    legend = tuple(dict.fromkeys(entry for scene in scenes for entry in scene.legend))
    hint = ""
    if name == "matplotlib" and os.environ.get("COURSE_RENDER") != "matplotlib":
        hint = f"Drawn flat by Matplotlib, because {reason}: python3 course.py doctor says how to mend it."
    pixels = compose(panels, columns=columns, title=title, legend=legend, bar=bar, hint=hint)
    return picture_of(pixels, f"{sentence(alt)} {text}" if alt else text)


def _point_size(scene: Scene, view: View, size: float | None) -> float:
    """Choose how many pixels a point is wide: about the spacing of the points in the picture."""
    if size is not None:
        return DENSITY * size
    clouds = [layer.points for layer in scene.layers if layer.kind == "cloud"]
    if not clouds:
        return 3.0
    points = np.concatenate(clouds)
    pixels, _ = view.project(points)
    inside = (
        np.isfinite(pixels).all(axis=1) & (pixels >= 0).all(axis=1) & (pixels < [view.width, view.height]).all(axis=1)
    )
    cells = np.unique((pixels[inside] // 16).astype(np.int64) @ [1, 100_000])
    spacing = np.sqrt(256 * max(len(cells), 1) / max(int(inside.sum()), 1))
    return float(np.clip((1.5 if len(clouds) > 1 else 1.9) * spacing, 2.4, 10.0))
