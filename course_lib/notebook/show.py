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
from dataclasses import replace

import numpy as np
from IPython import get_ipython

from course_lib.notebook import _colours, lessons
from course_lib.notebook._panels import How, draw_scenes
from course_lib.notebook._picture import Picture, picture
from course_lib.notebook._probe import rendering
from course_lib.notebook._rows import Scale, depth_picture, frames_picture, images_picture
from course_lib.notebook._words import number
from course_lib.notebook.report import Table, display_object


class Show:
    """What `show` is: see the module's docstring."""

    COLOURS = _colours.COLOURS
    picture = staticmethod(picture)
    style = staticmethod(_colours.style)
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
        unit: str = "",
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
        things : PointCloud, (N, 3) or organised (H, W, 3) float array in metres (NaN left out), Mesh, RGBDFrame, list
            of 4x4 T_world_camera (a trajectory), or Open3D's clouds and meshes; each may come as a pair
            (thing, "name"), (thing, class of COLOURS), (thing, "#rrggbb") or (thing, colours); a dict is name → thing.
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
        interactive : in a live notebook, a view to turn with the mouse (plotly, which needs no network; at most 60,000
            points of a cloud). Never keep one in a lesson: it stores its points.

        Raises
        ------
        ValueError
            If there is nothing to show, or a thing, view or colour is not understood.
        """
        if things and view is None and views is None and not interactive and all(map(_is_frame, things)):
            return frames_picture(list(things), title, alt)
        how = How(color, label, unit, limits, signed, about, title, view, frame, size, zoom, cull, alt)
        scene = how.scene(*things)
        if interactive:
            from course_lib.notebook._interactive import turnable

            return turnable(scene, title)
        names = list(views) if views is not None else [how.view_of(scene)]
        return draw_scenes([scene] * len(names), names, [], how, None, scene.text)

    def panels(self, things: Mapping[str, object], *, columns: int | None = None, **how: object) -> Picture:
        """Show different things from the same view, side by side and at the same scale.

        Parameters
        ----------
        things : label → what `show` takes; a list there is several things in one panel (a list of poses is one).
        columns : panels in a row.
        title, view, frame, color, label, unit, limits, signed, size, zoom, cull, about, alt : as in `show`.
        """
        unknown = [name for name in how if name not in How.__dataclass_fields__]
        if unknown:
            raise TypeError(f"Show.panels() got an unexpected keyword argument {unknown[0]!r}")
        if not things:
            raise ValueError("show.panels needs at least one thing: pass {'label': cloud}.")
        how = How(**how)
        scenes = [how.scene(*_several(thing)) for thing in things.values()]
        if how.limits is None and all(scene.bar is not None for scene in scenes):
            low, high = min(s.bar.limits[0] for s in scenes), max(s.bar.limits[1] for s in scenes)
            how = replace(how, limits=(low, high))
            scenes = [how.scene(*_several(thing)) for thing in things.values()]
        text = " ".join(f"{name}: {scene.text}" for name, scene in zip(things, scenes, strict=True))
        return draw_scenes(scenes, [how.view_of(scenes[0])] * len(scenes), list(things), how, columns, text)

    def depth(
        self,
        depth: np.ndarray | Mapping[str, np.ndarray],
        *,
        title: str = "",
        near: float | None = None,
        far: float | None = None,
        columns: int | None = None,
        alt: str = "",
    ) -> Picture:
        """Show depth images in metres, with a colour bar; pixels without data have a colour of their own.

        Parameters
        ----------
        depth : (H, W) float metres, 0 or NaN where nothing was measured; or a dict label → depth.
        near, far : metres, ends of the colour bar; by default 99 % of the pixels lie between them.
        columns : images in a row.
        title, alt : as in `show`.

        Raises
        ------
        ValueError
            If an image is not (H, W) floats, or has no measured pixel.
        """
        depths = dict(depth) if isinstance(depth, Mapping) else {"": getattr(depth, "depth", depth)}
        depths = {name: getattr(one, "depth", one) for name, one in depths.items()}
        return depth_picture(depths, title, near, far, columns, alt)

    def images(
        self,
        images: Mapping[str, object] | np.ndarray,
        *,
        title: str = "",
        unit: str = "",
        limits: tuple[float, float] | None = None,
        signed: bool = False,
        columns: int | None = None,
        alt: str = "",
    ) -> Picture:
        """Show images side by side.

        Parameters
        ----------
        images : label → (H, W, 3) uint8 colour, (H, W) uint8 grey, (H, W) bool, (H, W) other numbers (with a colour
            bar; NaN has a colour of its own) or a Picture.
        unit, limits, signed : of the colour bars; images of numbers with a unit share one bar.
        columns : images in a row.
        title, alt : as in `show`.
        """
        images = dict(images) if isinstance(images, Mapping) else {"": images}
        return images_picture(images, title, Scale(unit, limits, signed), columns, alt)

    def slider(
        self, function: Callable[[object], object], values: Sequence, *, label: str, alt: str = "", **how: object
    ) -> object:
        """Show what a function draws for each value: a strip of frames, or a slider in a live notebook.

        Parameters
        ----------
        function : value → a Picture, an image, or a cloud, mesh or trajectory.
        values : 2 to 8 of them.
        label : what the value is, such as "voxel (m)".
        alt : what to see.
        how : as in `panels` or `images`, to which the frames are given.

        Returns
        -------
        Picture
            The strip, which is what a stored notebook holds; under COURSE_LIVE=1 (set by `course start`) an ipywidgets
            slider over the same frames, drawn once.
        """
        if not 2 <= len(values) <= 8:
            raise ValueError(
                f"A slider has 2 to 8 values, and these are {len(values)}: a strip of frames must be readable."
            )
        frames = {f"{label} {number(value)}": function(value) for value in values}
        strip = self.images if all(map(_is_image, frames.values())) else self.panels
        if os.environ.get("COURSE_LIVE") == "1":
            from course_lib.notebook._interactive import frame_slider

            return frame_slider({name: strip({name: frame}, **how) for name, frame in frames.items()}, label)
        return strip(frames, columns=min(len(frames), 4), alt=alt, **how)

    def error_budget(self, measured: Mapping[str, tuple[float, float]] | None = None) -> None:
        """Show the running error budget: what was measured so far, and which lessons measure what else is announced.

        Parameters
        ----------
        measured : key of a stage of `lessons` → (value in the stage's unit, effect in mm on the surface at 1.5 m).
        """
        measured, stages = dict(measured or {}), lessons.stages()
        unknown = set(measured) - {stage.key for stage in stages}
        if unknown:
            keys = ", ".join(stage.key for stage in stages)
            raise ValueError(f"The error budget has no row {sorted(unknown)[0]!r}: use {keys}.")
        rows = []
        newest = max((stage.lesson for stage in stages if stage.key in measured), default="")
        for stage in stages:
            if stage.lesson > newest and not stage.announced:
                continue
            value, effect = measured.get(stage.key, (None, None))
            shown = (
                f"{number(float(value), 2)} {stage.unit}"
                if value is not None
                else f"{'see' if stage.lesson < newest else 'waits for'} lesson {stage.lesson[:2]}"
            )
            rows.append([stage.name, stage.lesson[:2], shown, number(float(effect), 2) if effect is not None else "–"])
        columns = ["error", "lesson", "measured", "effect on the surface at 1.5 m (mm)"]
        display_object(Table(rows, columns, [False, False, True, True], "Error budget"))


def _is_frame(thing: object) -> bool:
    return hasattr(thing, "depth") and hasattr(thing, "color") and hasattr(thing, "camera")


def _is_image(thing: object) -> bool:
    """A Picture, or an array that is not a cloud."""
    flat = isinstance(thing, np.ndarray) and (thing.ndim == 2 and thing.shape[1] != 3 or thing.dtype == np.uint8)
    return isinstance(thing, Picture) or flat


def _several(thing: object) -> tuple:
    """Several things of one panel, or one thing."""
    poses = isinstance(thing, list) and all(not isinstance(one, tuple) and np.shape(one) == (4, 4) for one in thing)
    return tuple(thing) if isinstance(thing, list) and not poses else (thing,)


show = Show()
if get_ipython() is not None:
    show.style()
