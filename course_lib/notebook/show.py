"""Pictures of clouds, meshes, frames and trajectories, each with a description in words and numbers.

`show` is a callable with helpers on it, so that a lesson imports one name:

    show(cloud)                      a picture of a cloud, a mesh, a trajectory, a frame, or several of them
    show.panels({"raw": a, "clean": b})   the same view of different things, side by side
    show.depth(depth)                a depth image with its colour bar and its "no data"
    show.images({"left": image})     rows of images
    show.slider(function, values)    a strip of frames; a slider in a live notebook
    show.error_budget({...})         the course's running table of errors
    show.COLOURS                     the colours of inlier, outlier, source, target ...
    show.style()                     Matplotlib fonts and colours of the course; applied by itself in a notebook
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from course_lib.notebook import _colours, budget
from course_lib.notebook._compose import Panel, columns_of, compose
from course_lib.notebook._depth import depth_picture, images_picture, sentence
from course_lib.notebook._picture import WIDTH, Picture, picture, picture_of
from course_lib.notebook._render import rendering
from course_lib.notebook._scene import Colouring, Scene, build, views_text
from course_lib.notebook._views import FRAMES, VIEW_WORDS, View, layout, look
from course_lib.notebook._words import number
from course_lib.notebook.report import Table, display_object


class Show:
    """What `show` is: see the module's docstring."""

    COLOURS = _colours.COLOURS
    picture = staticmethod(picture)
    rendering = staticmethod(rendering)

    def __call__(
        self,
        *things: object,
        title: str = "",
        view: object = None,
        views: Sequence[object] | None = None,
        frame: str | None = None,
        color: object = None,
        label: str = "",
        unit: str = "m",
        limits: tuple[float, float] | None = None,
        signed: bool = False,
        size: float | None = None,
        zoom: float = 1.0,
        cull: bool = False,
        about: bool = False,
        alt: str = "",
        interactive: bool = False,
    ) -> Picture:
        """Show things in one scene, from one view or several.

        Parameters
        ----------
        things : PointCloud, (N, 3) or organised (H, W, 3) float array in metres (NaN left out), Mesh, RGBDFrame, list of
            4x4 T_world_camera (a trajectory), or Open3D's clouds and meshes; each may come as a pair (thing, "name"),
            (thing, class of COLOURS), (thing, "#rrggbb") or (thing, colours); a dict is name → thing.
            RGBDFrames alone, without a view, are shown as images: colour beside depth.
        title : written above the picture.
        view : "front", "side" (from the right), "back", "top", "iso" (parallel, with a scale bar), "camera" (what the
            sensor sees) or a 4x4 T_world_camera to look from.
        views : several of these, as panels at one common scale.
        frame : "camera" (y down, z forward), "world" (z up) or "object" (y up). When it is not given: "world" beside a
            trajectory; "camera" where all points are more than 0.1 m ahead and around the optical axis; else "world".
        color : "rgb", "height", "depth", "label"; (N,) numbers, with `label`, `unit`, `limits` for the colour bar
            (`signed` for a map with white at zero); (N,) bool, True being an inlier; (N, 3) uint8; a class of COLOURS.
        size : of a point, in pixels of the 700 px wide picture; by default it follows the density.
        zoom : above 1 to come closer.
        cull : leave out surfaces seen from behind, to look into a room.
        about : the counts may differ between machines: say "about 36,000 points", extents to 2 digits.
        alt : what to see, in your words; the computed description follows it.
        interactive : in a live notebook, a view to turn with the mouse (plotly; needs no network). Never keep one in a
            lesson: it stores its points.

        Raises
        ------
        ValueError
            If there is nothing to show, or a thing, view or colour is not understood.
        """
        if things and view is None and views is None and not interactive and all(map(_is_frame, things)):
            return _frames(things, title, alt)
        colouring = Colouring(color, label, unit, limits, signed, about)
        scene = build(things, colouring, _known_frame(frame))
        if interactive:
            from course_lib.notebook._interactive import turnable

            return turnable(scene, title)
        names = list(views) if views is not None else [view if view is not None else _first_view(scene)]
        looks = [look(name, scene.points, scene.frame, scene.sensor) for name in names]
        labels = [_view_label(one) for one in looks] if len(looks) > 1 else [""]
        text = f"{scene.text} {views_text([one.name for one in looks], VIEW_WORDS)}"
        return _draw([scene] * len(looks), looks, labels, title, size, zoom, cull, text, alt)

    def panels(
        self,
        things: Mapping[str, object],
        *,
        title: str = "",
        view: object = None,
        frame: str | None = None,
        color: object = None,
        label: str = "",
        unit: str = "m",
        limits: tuple[float, float] | None = None,
        signed: bool = False,
        size: float | None = None,
        zoom: float = 1.0,
        cull: bool = False,
        about: bool = False,
        alt: str = "",
    ) -> Picture:
        """Show different things from the same view, side by side and at the same scale.

        Parameters
        ----------
        things : label → what `show` takes; a list there is several things in one panel (a list of poses is one).
        title, view, frame, color, label, unit, limits, signed, size, zoom, cull, about, alt : as in `show`.
        """
        if not things:
            raise ValueError("show.panels needs at least one thing: pass {'label': cloud}.")
        colouring = Colouring(color, label, unit, limits, signed, about)
        scenes = [build(_several(thing), colouring, _known_frame(frame)) for thing in things.values()]
        if limits is None and all(scene.bar is not None for scene in scenes):
            low, high = min(s.bar.limits[0] for s in scenes), max(s.bar.limits[1] for s in scenes)
            colouring = Colouring(color, label, unit, (low, high), signed, about)
            scenes = [build(_several(thing), colouring, _known_frame(frame)) for thing in things.values()]
        looks = [
            look(view if view is not None else _first_view(scenes[0]), scene.points, scene.frame, scene.sensor)
            for scene in scenes
        ]
        parts = [f"{name}: {scene.text}" for name, scene in zip(things, scenes, strict=True)]
        text = " ".join([*parts, views_text([looks[0].name], VIEW_WORDS)])
        return _draw(scenes, looks, list(things), title, size, zoom, cull, text, alt)

    def depth(
        self,
        depth: np.ndarray | Mapping[str, np.ndarray],
        *,
        title: str = "",
        near: float | None = None,
        far: float | None = None,
        alt: str = "",
    ) -> Picture:
        """Show depth images in metres, with a colour bar; pixels without data have a colour of their own.

        Parameters
        ----------
        depth : (H, W) float metres, 0 or NaN where nothing was measured; or a dict label → depth.
        near, far : metres, ends of the colour bar; by default 99 % of the pixels lie between them.
        title, alt : as in `show`.

        Raises
        ------
        ValueError
            If an image is not (H, W) floats, or has no measured pixel.
        """
        depths = dict(depth) if isinstance(depth, Mapping) else {"": getattr(depth, "depth", depth)}
        depths = {name: getattr(one, "depth", one) for name, one in depths.items()}
        return depth_picture(depths, title, near, far, alt)

    def images(
        self,
        images: Mapping[str, object] | np.ndarray,
        *,
        title: str = "",
        unit: str = "",
        limits: tuple[float, float] | None = None,
        signed: bool = False,
        alt: str = "",
    ) -> Picture:
        """Show images side by side.

        Parameters
        ----------
        images : label → (H, W, 3) uint8 colour, (H, W) uint8 grey, (H, W) bool, (H, W) other numbers (with a colour bar;
            NaN has a colour of its own) or a Picture.
        unit, limits, signed : of the colour bars.
        title, alt : as in `show`.
        """
        images = dict(images) if isinstance(images, Mapping) else {"": images}
        return images_picture(images, title, unit, limits, signed, alt)

    def slider(
        self, function: Callable[[object], Picture | np.ndarray], values: Sequence, *, label: str, alt: str = ""
    ) -> object:
        """Show what a function draws for each value: a strip of frames, or a slider in a live notebook.

        Parameters
        ----------
        function : value → Picture or image.
        values : 2 to 8 of them.
        label : what the value is, such as "voxel (m)".
        alt : what to see.

        Returns
        -------
        Picture
            The strip, which is what a stored notebook holds; under COURSE_LIVE=1 (set by `course start`) an ipywidgets
            slider over the same frames, drawn once.
        """
        frames = {f"{label} {number(value)}": function(value) for value in values}
        if os.environ.get("COURSE_LIVE") == "1":
            from course_lib.notebook._interactive import frame_slider

            return frame_slider(frames, label)
        return self.images(frames, alt=alt)

    def error_budget(self, measured: Mapping[str, tuple[float, float]] | None = None) -> None:
        """Show the running error budget: what was measured so far, and which lessons measure the rest.

        Parameters
        ----------
        measured : key of budget.STAGES → (value in the stage's unit, effect in mm on the surface at 1.5 m).
        """
        measured = dict(measured or {})
        unknown = set(measured) - {stage.key for stage in budget.STAGES}
        if unknown:
            raise ValueError(
                f"The error budget has no row {sorted(unknown)[0]!r}: use {', '.join(s.key for s in budget.STAGES)}."
            )
        rows = []
        for stage in budget.STAGES:
            value, effect = measured.get(stage.key, (None, None))
            shown = f"{number(float(value), 2)} {stage.unit}" if value is not None else f"waits for lesson {stage.lesson[:2]}"
            rows.append([stage.name, stage.lesson[:2], shown, number(float(effect), 2) if effect is not None else "–"])
        columns = ["error", "lesson", "measured", budget.EFFECT]
        display_object(Table(rows, columns, [False, False, True, True], "Error budget"))

    def style(self) -> None:
        """Give Matplotlib plots the course's fonts, sizes and colour cycle (rcParams; called by itself in a notebook)."""
        from cycler import cycler
        from matplotlib import rcParams

        rcParams.update(
            {
                "axes.prop_cycle": cycler(color=[code for code, _ in _colours.CYCLE]),
                "axes.spines.top": False,
                "axes.spines.right": False,
                "axes.grid": True,
                "axes.axisbelow": True,
                "grid.color": "#DDDDDD",
                "grid.linewidth": 0.6,
                "font.size": 10,
                "axes.titlesize": 11,
                "legend.frameon": False,
                "figure.figsize": (7.0, 3.6),
                "figure.constrained_layout.use": True,
                "image.cmap": _colours.MAGNITUDES,
            }
        )


def _is_frame(thing: object) -> bool:
    return hasattr(thing, "depth") and hasattr(thing, "color") and hasattr(thing, "camera")


def _several(thing: object) -> tuple:
    """Several things of one panel, or one thing."""
    poses = isinstance(thing, list) and all(np.shape(one) == (4, 4) for one in thing)
    return tuple(thing) if isinstance(thing, list) and not poses else (thing,)


def _known_frame(frame: str | None) -> str | None:
    if frame is not None and frame not in FRAMES:
        raise ValueError(f"There is no frame {frame!r}: use 'camera' (y down), 'world' (z up) or 'object' (y up).")
    return frame


def _first_view(scene: Scene) -> str:
    return {"camera": "camera", "world": "iso", "object": "front"}[scene.frame]


def _view_label(view: View) -> str:
    return "sensor" if view.name == "camera" else view.name


def _frames(frames: Sequence, title: str, alt: str) -> Picture:
    """Colour beside depth, a row a frame."""
    from course_lib.notebook._depth import frames_picture

    return frames_picture(list(frames), title, alt)


def _draw(
    scenes: list[Scene],
    looks: list[View],
    labels: list[str],
    title: str,
    size: float | None,
    zoom: float,
    cull: bool,
    text: str,
    alt: str,
) -> Picture:
    """Draw one panel a scene with the renderer that this machine has, and put them together."""
    bar = next((scene.bar for scene in scenes if scene.bar is not None), None)
    width = (WIDTH - (190 if bar else 0)) // columns_of(len(looks)) - 24
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
    panels = [Panel(label, image, one) for label, image, one in zip(labels, images, looks, strict=True)]
    legend = tuple(dict.fromkeys(entry for scene in scenes for entry in scene.legend))
    hint = ""
    if name == "matplotlib" and os.environ.get("COURSE_RENDER") != "matplotlib":
        hint = f"Drawn flat by Matplotlib, because {reason}: python3 course.py doctor says how to mend it."
    pixels = compose(panels, title=title, legend=legend, bar=bar, hint=hint)
    return picture_of(pixels, f"{sentence(alt)} {text}" if alt else text)


def _point_size(scene: Scene, view: View, size: float | None) -> float:
    """Choose how many pixels a point is wide: about the spacing of the points in the picture."""
    if size is not None:
        return 2.0 * size
    clouds = [layer.points for layer in scene.layers if layer.kind == "cloud"]
    if not clouds:
        return 4.0
    points = np.concatenate(clouds)
    pixels, _ = view.project(points)
    inside = np.isfinite(pixels).all(axis=1) & (pixels >= 0).all(axis=1) & (pixels < [view.width, view.height]).all(axis=1)
    cells = np.unique((pixels[inside] // 16).astype(np.int64) @ [1, 100_000])
    spacing = np.sqrt(256 * max(len(cells), 1) / max(int(inside.sum()), 1))
    return float(np.clip(1.3 * spacing, 3.0, 12.0))


show = Show()
