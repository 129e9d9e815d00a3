"""Scenes drawn by the renderer that this machine has, and put together to a Picture with its description."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from course_lib.notebook._compose import Panel, columns_of, compose, fitting_width, panel_width
from course_lib.notebook._paint import Colouring
from course_lib.notebook._picture import DENSITY, Picture, picture_of
from course_lib.notebook._probe import rendering
from course_lib.notebook._scene import Scene, build
from course_lib.notebook._views import FRAMES, VIEW_WORDS, View, layout, look
from course_lib.notebook._words import sentence, sentence_list

FIRST_VIEW = {"camera": "camera", "world": "iso", "object": "front"}
"""What a scene of a frame is seen from where nobody says."""


@dataclass(frozen=True)
class How(Colouring):
    """How `show` and `show.panels` were asked to draw: see there."""

    title: str = ""
    view: object = None
    frame: str | None = None
    size: float | None = None
    zoom: float = 1.0
    cull: bool = False
    alt: str = ""

    def scene(self, *things: object) -> Scene:
        """Turn things into a scene."""
        if self.frame is not None and self.frame not in FRAMES:
            raise ValueError(
                f"There is no frame {self.frame!r}: use 'camera' (y down), 'world' (z up) or 'object' (y up)."
            )
        return build(things, self, self.frame)

    def view_of(self, scene: Scene) -> object:
        """The view that was asked for, or else the one that suits a scene."""
        return self.view if self.view is not None else FIRST_VIEW[scene.frame]


def draw_scenes(
    scenes: list[Scene], views: list[object], labels: list[str], how: How, columns: int | None, text: str
) -> Picture:
    """Draw one panel a scene with the renderer that this machine has, and put them together.

    Parameters
    ----------
    scenes, views : one a panel; see `look` for what a view may be.
    labels : one a panel; none for the names of the views, where there are several.
    text : what is in the scenes.
    """
    looks = [look(view, s.points, s.frame, s.sensor) for view, s in zip(views, scenes, strict=True)]
    if not labels:
        labels = ["sensor" if one.name == "camera" else one.name for one in looks] if len(looks) > 1 else [""]
    bar = next((scene.bar for scene in scenes if scene.bar is not None), None)
    columns = columns or columns_of(len(looks))
    width = panel_width(columns, bars=1 if bar else 0)
    name, reason = rendering()
    hint = ""
    if name == "matplotlib" and os.environ.get("COURSE_RENDER") != "matplotlib":
        hint = f"Drawn flat by Matplotlib, because {reason}: python3 course.py doctor says how to mend it."
    legend = tuple(dict.fromkeys(entry for scene in scenes for entry in scene.legend))
    around = {"title": how.title, "legend": legend, "hint": hint}
    clouds = [scene.points for scene in scenes]
    aspects = [one.height / one.width for one in layout(looks, clouds, width, how.zoom)]
    width = fitting_width(width, aspects, columns=columns, labels=any(labels), strip=True, **around)
    looks = layout(looks, clouds, width, how.zoom)
    if name == "pyvista":
        from course_lib.notebook._render import draw
    else:
        from course_lib.notebook._fallback import draw
    one_scene = all(scene is scenes[0] for scene in scenes)
    if one_scene:
        images = draw(scenes[0].layers, looks, _point_size(scenes[0], looks[0], how.size), how.cull)
    else:
        sizes = [_point_size(scene, one, how.size) for scene, one in zip(scenes, looks, strict=True)]
        images = [draw(scenes[i].layers, [one], sizes[i], how.cull)[0] for i, one in enumerate(looks)]
    for label, image in zip(labels, images, strict=True):
        if not (image < 250).any():
            raise ValueError(
                f"The view {label or looks[0].name!r} came out blank: its colours may be white, or the view misses it."
            )
    panels = [Panel(label, image, one) for label, image, one in zip(labels, images, looks, strict=True)]
    pixels = compose(panels, columns=columns, bar=bar, **around)
    seen = sentence_list([VIEW_WORDS[one.name] for one in (looks if one_scene else looks[:1])])
    words = [*([sentence(how.alt)] if how.alt else []), text, f"Seen from {seen}."]
    return picture_of(pixels, " ".join(words))


def _point_size(scene: Scene, view: View, size: float | None) -> float:
    """Choose how many pixels a point is wide: about the spacing of the points in the picture."""
    if size is not None:
        return DENSITY * size
    clouds = [layer.points for layer in scene.layers if layer.kind == "cloud"]
    if not clouds:
        return 3.0
    points = np.concatenate(clouds)
    pixels, _ = view.project(points)
    inside = view.holds(pixels)
    cells = np.unique((pixels[inside] // 16).astype(np.int64) @ [1, 100_000])
    spacing = np.sqrt(256 * max(len(cells), 1) / max(int(inside.sum()), 1))
    return float(np.clip((1.5 if len(clouds) > 1 else 1.9) * spacing, 2.4, 10.0))
