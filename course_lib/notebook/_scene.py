"""What is to be drawn, free of any renderer: things become layers with colours, a legend, a colour bar and a text.

The text description of a picture is computed here, from the data alone: it is the same whichever renderer draws, and
the same on any machine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._paint import ColourBar, Colouring, common_limits, paint
from course_lib.notebook._things import Thing, recognise
from course_lib.notebook._views import guess_frame
from course_lib.notebook._words import amount, count, number

MOST_POINTS = 400_000
"""More points than this are thinned for the picture (never in the data), and the text says so."""


@dataclass(frozen=True)
class Layer:
    """One thing to draw.

    Attributes
    ----------
    kind : "cloud", "mesh" or "trajectory".
    points : (N, 3) float, metres, finite.
    rgb : (N, 3) uint8.
    triangles : (T, 3) int of a mesh, else None.
    segments : (S, 2) int of a trajectory, else None.
    text : what it is, in words with numbers.
    """

    kind: str
    points: np.ndarray
    rgb: np.ndarray
    text: str
    triangles: np.ndarray | None = None
    segments: np.ndarray | None = None

    @property
    def classes(self) -> bool:
        """Coloured by a few classes, not by magnitudes or a photo: shading then misleads nobody."""
        codes = self.rgb.astype(np.int32) @ [1 << 16, 1 << 8, 1]
        return len(np.unique(codes)) <= 12


@dataclass(frozen=True)
class Scene:
    """Layers and what explains them."""

    layers: tuple[Layer, ...]
    frame: str
    text: str
    legend: tuple[tuple[str, str], ...] = ()
    bar: ColourBar | None = None
    sensor: np.ndarray | None = None

    @property
    def points(self) -> np.ndarray:
        """(N, 3) all points of all layers."""
        return np.concatenate([layer.points for layer in self.layers])


def build(things: tuple, colouring: Colouring, frame: str | None = None) -> Scene:
    """Turn things into a scene. See `show` for what a thing may be."""
    known = recognise(things)
    if not known:
        raise ValueError("show needs something to show: pass a cloud, a mesh, a frame or a list of poses.")
    sensor = next((thing.poses[0] for thing in known if thing.poses is not None), None)
    if frame is None:
        frame = "world" if sensor is not None else guess_frame(np.concatenate([thing.points for thing in known]))
    layers: list[Layer] = []
    legend: list[tuple[str, str]] = []
    bars: list[ColourBar] = []
    limits = common_limits(known, colouring, frame)
    for index, thing in enumerate(known):
        alone = sum((other.kind == "trajectory") == (thing.kind == "trajectory") for other in known) == 1
        cycled = None if alone else colours.CYCLE[index % len(colours.CYCLE)]
        rgb, words, entries, bar = paint(thing, cycled, colouring, frame, limits)
        legend += [entry for entry in entries if entry not in legend]
        bars += [bar] if bar else []
        layers.append(_layer(thing, rgb, words, colouring, known))
    text = ". ".join(layer.text for layer in layers) + "."
    return Scene(tuple(layers), frame, text, tuple(legend), bars[0] if bars else None, sensor)


def extent_text(points: np.ndarray, digits: int) -> str:
    """Say how large (N, 3) points are: "0.156 × 0.154 × 0.119 m (x × y × z)"."""
    sides = points.max(axis=0) - points.min(axis=0)
    return " × ".join(number(float(side), digits) for side in sides) + " m (x × y × z)"


def _layer(thing: Thing, rgb: np.ndarray, words: str, colouring: Colouring, known: list[Thing]) -> Layer:
    about = colouring.about
    digits = 2 if about else 3
    name = f" '{thing.name}'" if thing.name else ""
    if thing.kind == "trajectory":
        steps = np.linalg.norm(np.diff(thing.points, axis=0), axis=1).sum()
        size = _size([other.points for other in known])
        points, segments = _frusta(thing.poses, 0.03 * size)
        long = f", {amount(float(steps), 'm', digits)} long" if len(thing.poses) > 1 else ""
        text = f"Trajectory{name} of {count(len(thing.poses), 'pose')}{long}, {words}"
        return Layer("trajectory", points, np.tile(rgb[:1], (len(points), 1)), text, segments=segments)
    size = extent_text(thing.points, digits)
    if thing.kind == "mesh":
        n = f"{count(len(thing.points), 'vertex', about)} and {count(len(thing.triangles), 'triangle', about)}"
        return Layer("mesh", thing.points, rgb, f"Mesh{name} of {n}, {size}, {words}", triangles=thing.triangles)
    notes = [f"Point cloud{name} of {count(len(thing.points), 'point', about)}", size, words]
    notes += [thing.note] if thing.note else []
    points = thing.points
    step = -(-len(points) // MOST_POINTS)
    if step > 1:
        notes.append(f"drawn: every {_ordinal(step)} point")
        points, rgb = points[::step], rgb[::step]
    return Layer("cloud", points, rgb, ", ".join(notes))


def _ordinal(n: int) -> str:
    return f"{n}{ {1: 'st', 2: 'nd', 3: 'rd'}.get(n % 10 if n % 100 not in (11, 12, 13) else 0, 'th') }"


def _size(clouds: list[np.ndarray]) -> float:
    points = np.concatenate(clouds)
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0))) or 1.0


def _frusta(poses: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Draw a path through (N, 4, 4) poses, with at most 10 small pyramids that open the way the camera looks."""
    path = poses[:, :3, 3]
    lines = [np.stack([np.arange(len(path) - 1), np.arange(1, len(path))], axis=1)]
    points = [path]
    corners = size * np.array([(0, 0, 0), (-0.6, -0.45, 1), (0.6, -0.45, 1), (0.6, 0.45, 1), (-0.6, 0.45, 1)])
    edges = np.array([(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)])
    start = len(path)
    for index in np.unique(np.linspace(0, len(poses) - 1, min(10, len(poses))).round().astype(int)):
        points.append(corners @ poses[index, :3, :3].T + poses[index, :3, 3])
        lines.append(edges + start)
        start += len(corners)
    return np.concatenate(points), np.concatenate(lines)
