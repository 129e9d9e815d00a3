"""What is to be drawn, free of any renderer: things become layers with colours, a legend, a colour bar and a text.

The text description of a picture is computed here and nowhere else, from the data alone: it is the same whichever renderer
draws, and the same on any machine.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._views import guess_frame, height_axis
from course_lib.notebook._words import amount, count, number, sentence_list

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


@dataclass(frozen=True)
class ColourBar:
    """What the colours of a magnitude mean."""

    label: str
    map: str
    limits: tuple[float, float]


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


@dataclass(frozen=True)
class Colouring:
    """How `show` was asked to colour: see there."""

    color: object = None
    label: str = ""
    unit: str = "m"
    limits: tuple[float, float] | None = None
    signed: bool = False
    about: bool = False
    digits: int = field(default=3)


@dataclass
class _Thing:
    """A recognised thing: arrays, before colours are decided."""

    kind: str
    points: np.ndarray
    name: str = ""
    color: object = None
    colors: np.ndarray | None = None
    labels: np.ndarray | None = None
    triangles: np.ndarray | None = None
    poses: np.ndarray | None = None
    note: str = ""


def build(things: tuple, colouring: Colouring, frame: str | None = None) -> Scene:
    """Turn things into a scene. See `show` for what a thing may be."""
    known = [_recognise(thing) for thing in _named(things)]
    if not known:
        raise ValueError("show needs something to show: pass a cloud, a mesh, a frame or a list of poses.")
    sensor = next((thing.poses[0] for thing in known if thing.poses is not None), None)
    if frame is None:
        frame = "world" if sensor is not None else guess_frame(np.concatenate([thing.points for thing in known]))
    layers: list[Layer] = []
    legend: list[tuple[str, str]] = []
    bars: list[ColourBar] = []
    limits = _common_limits(known, colouring, frame)
    for index, thing in enumerate(known):
        plain = colours.CYCLE[index % len(colours.CYCLE)] if len(known) > 1 else None
        rgb, words, entries, bar = _colour(thing, plain, colouring, frame, limits)
        legend += [entry for entry in entries if entry not in legend]
        bars += [bar] if bar else []
        layers.append(_layer(thing, rgb, words, colouring, known))
    text = ". ".join(layer.text for layer in layers) + "."
    return Scene(tuple(layers), frame, text, tuple(legend), bars[0] if bars else None, sensor)


def _named(things: tuple) -> list[tuple[object, object]]:
    """Flatten dicts and pairs into (thing, name or colour or None)."""
    flat: list[tuple[object, object]] = []
    for thing in things:
        if isinstance(thing, dict):
            flat += [(value, name) for name, value in thing.items()]
        elif isinstance(thing, tuple) and len(thing) == 2 and np.ndim(getattr(thing[1], "points", thing[1])) <= 1:
            flat.append(thing)
        else:
            flat.append((thing, None))
    return flat


def _recognise(pair: tuple[object, object]) -> _Thing:
    thing, tag = pair
    if isinstance(thing, tuple) and len(thing) == 2:
        thing, color = thing
        found = _arrays(thing)
        found.color = color
    else:
        found = _arrays(thing)
    if isinstance(tag, str) and not tag.startswith("#"):
        found.name = tag
    elif tag is not None:
        found.color = tag
    finite = np.isfinite(found.points).all(axis=1)
    if found.kind == "cloud" and not finite.all():
        per_point = found.points.shape[0]
        found.points = found.points[finite]
        found.colors = found.colors[finite] if found.colors is not None else None
        found.labels = found.labels[finite] if found.labels is not None else None
        if found.color is not None and not isinstance(found.color, str) and len(found.color) == per_point:
            found.color = np.asarray(found.color)[finite]
        found.note = f"{count(int((~finite).sum()), 'point')} without measurement left out"
    if len(found.points) == 0:
        name = f" {found.name!r}" if found.name else ""
        raise ValueError(f"There is nothing to show: the {found.kind}{name} has no points; check what was filtered before.")
    return found


def _arrays(thing: object) -> _Thing:
    """Find out what a thing is and take its arrays."""
    if hasattr(thing, "depth") and hasattr(thing, "camera"):
        from course_lib.pointcloud import from_frame

        return _arrays(from_frame(thing))
    if hasattr(thing, "vertices") and hasattr(thing, "triangles"):
        return _mesh(np.asarray(thing.vertices), np.asarray(thing.triangles), _first(thing, "colors", "vertex_colors"))
    if hasattr(thing, "vertex") and hasattr(thing, "triangle"):
        colors = thing.vertex.colors.numpy() if "colors" in thing.vertex else None
        return _mesh(thing.vertex.positions.numpy(), thing.triangle.indices.numpy(), colors)
    if hasattr(thing, "points"):
        labels = getattr(thing, "labels", None)
        return _cloud(np.asarray(thing.points), _first(thing, "colors"), None if labels is None else np.asarray(labels))
    if hasattr(thing, "point") and hasattr(thing.point, "positions"):
        colors = thing.point.colors.numpy() if "colors" in thing.point else None
        return _cloud(thing.point.positions.numpy(), colors, None)
    if hasattr(thing, "poses"):
        thing = thing.poses
    array = np.asarray(thing) if isinstance(thing, (np.ndarray, list, tuple)) else None
    if array is not None and array.ndim == 3 and array.shape[1:] == (4, 4):
        poses = array.astype(np.float64)
        return _Thing("trajectory", poses[:, :3, 3], poses=poses)
    if array is not None and array.ndim in (2, 3) and array.shape[-1] == 3 and array.dtype.kind == "f":
        return _cloud(array.reshape(-1, 3), None, None)
    if array is not None and array.ndim >= 2:
        raise ValueError(
            f"An array of shape {array.shape} and type {array.dtype} is not a cloud: for pictures use "
            "show.images({'title': array}), for depth show.depth(depth)."
        )
    raise ValueError(
        f"show does not know what a {type(thing).__name__} is: pass a PointCloud, an (N, 3) array, a Mesh, "
        "an RGBDFrame or a list of 4x4 poses."
    )


def _first(thing: object, *names: str) -> np.ndarray | None:
    for name in names:
        value = getattr(thing, name, None)
        if value is not None and len(value):
            return np.asarray(value)
    return None


def _bytes(colors: np.ndarray | None, n: int) -> np.ndarray | None:
    if colors is None or len(colors) != n:
        return None
    return (colors * 255).round().astype(np.uint8) if colors.dtype.kind == "f" else colors.astype(np.uint8)


def _cloud(points: np.ndarray, colors: np.ndarray | None, labels: np.ndarray | None) -> _Thing:
    points = points.reshape(-1, 3).astype(np.float64)
    colors = colors.reshape(-1, 3) if colors is not None else None
    return _Thing("cloud", points, colors=_bytes(colors, len(points)), labels=labels)


def _mesh(vertices: np.ndarray, triangles: np.ndarray, colors: np.ndarray | None) -> _Thing:
    if len(triangles) == 0:
        raise ValueError("There is nothing to show: this mesh has no triangles; check how it was made.")
    return _Thing(
        "mesh", vertices.astype(np.float64), colors=_bytes(colors, len(vertices)), triangles=triangles.astype(np.int64)
    )


# ---------------------------------------------------------------------------------------------------------- colours


def _values(thing: _Thing, colouring: Colouring, frame: str) -> tuple[np.ndarray, str] | None:
    """Return the magnitudes that a thing is coloured by and their name, or None where it has plain colours."""
    color = thing.color if thing.color is not None else colouring.color
    if thing.kind == "trajectory" or color is None:
        return None
    if isinstance(color, str):
        if color == "height":
            return thing.points @ height_axis(frame), "height"
        if color == "depth":
            if frame != "camera":
                raise ValueError("color='depth' is for clouds in the camera's frame: use 'height' here, or an array.")
            return thing.points[:, 2], "depth"
        return None
    array = np.asarray(color)
    if array.ndim != 1 or array.dtype.kind == "b":
        return None
    if len(array) != len(thing.points):
        raise ValueError(f"The colours are {len(array):,} numbers for {len(thing.points):,} points: pass one for each.")
    return array.astype(np.float64), colouring.label or "value"


def _common_limits(things: list[_Thing], colouring: Colouring, frame: str) -> tuple[float, float]:
    if colouring.limits is not None:
        return float(colouring.limits[0]), float(colouring.limits[1])
    found = [pair[0] for thing in things if (pair := _values(thing, colouring, frame)) is not None]
    finite = np.concatenate(found) if found else np.zeros(1)
    finite = finite[np.isfinite(finite)]
    if not len(finite):
        raise ValueError("There is no finite number to colour by: every value is NaN.")
    low, high = np.percentile(finite, [0.5, 99.5]) if len(finite) > 200 else (finite.min(), finite.max())
    if colouring.signed:
        high = max(abs(low), abs(high))
        low = -high
    return float(low), float(high)


def _colour(
    thing: _Thing,
    plain: tuple[str, str] | None,
    colouring: Colouring,
    frame: str,
    limits: tuple[float, float],
) -> tuple[np.ndarray, str, list[tuple[str, str]], ColourBar | None]:
    """Decide the (N, 3) uint8 colours of a thing, the words for them, its legend entries and its colour bar."""
    n = len(thing.points)
    color = thing.color if thing.color is not None else colouring.color
    magnitudes = _values(thing, colouring, frame)
    if magnitudes is not None:
        values, name = magnitudes
        unit = "m" if name in ("height", "depth") else colouring.unit
        map_name = colours.SIGNED if colouring.signed else colours.MAGNITUDES
        ends = "blue below, red above zero" if colouring.signed else "dark blue to yellow"
        span = f"{number(limits[0], 2)} to {amount(limits[1], unit, 2)}"
        bar = ColourBar(f"{name} ({unit})" if unit else name, map_name, limits)
        return colours.colour_map(map_name, values, limits), f"coloured by {name}, {span} ({ends})", [], bar
    if isinstance(color, str) and color == "label":
        return _by_label(thing)
    if isinstance(color, str) and color == "rgb" and thing.kind != "trajectory":
        if thing.colors is None:
            raise ValueError(f"This {thing.kind} has no colours of its own: use color='height', or give it colours.")
        return thing.colors, "in its own colours", [], None
    if color is not None and not isinstance(color, str):
        array = np.asarray(color)
        if array.shape == (n, 3):
            return _bytes(array, n), "in given colours", [], None
        if array.shape == (n,) and array.dtype.kind == "b":
            return _by_mask(array)
        raise ValueError(f"Colours of shape {array.shape} do not fit {n:,} points: pass ({n},) numbers or ({n}, 3) uint8.")
    class_name = color if color is not None else thing.name if thing.name in colours.COLOURS else None
    if class_name is not None and not (color is not None and thing.kind == "trajectory" and color not in colours.COLOURS):
        code = colours.COLOURS.get(class_name, class_name)
        words = colours.COLOUR_WORDS.get(class_name, class_name)
    elif thing.colors is not None and plain is None:
        return thing.colors, "in its own colours", [], None
    elif plain is not None and not (thing.kind == "mesh" and not thing.name):
        code, words = plain
    else:
        code, words = {
            "cloud": (colours.COLOURS["inlier"], "blue"),
            "mesh": (colours.COLOURS["surface"], "grey"),
            "trajectory": (colours.COLOURS["outlier"], "vermilion"),
        }[thing.kind]
    name = thing.name or (class_name if class_name in colours.COLOURS else "")
    return np.tile(np.array(colours.rgb(code), np.uint8), (n, 1)), words, [(name, code)] if name else [], None


def _by_mask(mask: np.ndarray) -> tuple[np.ndarray, str, list[tuple[str, str]], None]:
    kept, dropped = np.array(colours.rgb("inlier"), np.uint8), np.array(colours.rgb("outlier"), np.uint8)
    words = f"{count(int(mask.sum()), 'inlier')} blue, {count(int((~mask).sum()), 'outlier')} vermilion"
    entries = [("inlier", colours.COLOURS["inlier"]), ("outlier", colours.COLOURS["outlier"])]
    return np.where(mask[:, None], kept, dropped), words, entries, None


def _by_label(thing: _Thing) -> tuple[np.ndarray, str, list[tuple[str, str]], None]:
    if thing.labels is None:
        raise ValueError(f"This {thing.kind} has no labels: color='label' needs PointCloud(labels=...).")
    names, which = np.unique(thing.labels, return_inverse=True)
    grey = names < 0
    places = np.cumsum(~grey) - 1
    codes = [
        colours.COLOURS["surface"] if grey[i] else colours.CYCLE[places[i] % len(colours.CYCLE)][0] for i in range(len(names))
    ]
    table = np.array([colours.rgb(code) for code in codes], np.uint8)
    entries = [(f"{'no label' if n < 0 else f'label {n}'}", c) for n, c in zip(names, codes, strict=True)][:8]
    return table[which.ravel()], f"coloured by label, {count(int((~grey).sum()), 'label')}", entries, None


# ------------------------------------------------------------------------------------------------------- layers, text


def extent_text(points: np.ndarray, digits: int = 3) -> str:
    """Say how large (N, 3) points are: "0.156 × 0.154 × 0.119 m (x × y × z)"."""
    sides = points.max(axis=0) - points.min(axis=0)
    return " × ".join(number(float(side), digits) for side in sides) + " m (x × y × z)"


def _layer(thing: _Thing, rgb: np.ndarray, words: str, colouring: Colouring, known: list[_Thing]) -> Layer:
    digits = 2 if colouring.about else colouring.digits
    name = f" '{thing.name}'" if thing.name else ""
    about = colouring.about
    if thing.kind == "trajectory":
        steps = np.linalg.norm(np.diff(thing.points, axis=0), axis=1).sum()
        size = _size([other.points for other in known])
        points, segments = _frusta(thing.poses, 0.05 * size)
        long = f", {amount(float(steps), 'm', digits)} long" if len(thing.poses) > 1 else ""
        text = f"Trajectory{name} of {count(len(thing.poses), 'pose')}{long}, {words}"
        return Layer("trajectory", points, np.tile(rgb[:1], (len(points), 1)), text, segments=segments)
    size = extent_text(thing.points, digits)
    if thing.kind == "mesh":
        n = f"{count(len(thing.points), 'vertex', about).replace('vertexs', 'vertices')} and " + count(
            len(thing.triangles), "triangle", about
        )
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
    return f"{n}{ {1: 'st', 2: 'nd', 3: 'rd'}.get(n % 10 if n % 100 not in (11, 12, 13) else 0, 'th')}"


def _size(clouds: list[np.ndarray]) -> float:
    points = np.concatenate(clouds)
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0))) or 1.0


def _frusta(poses: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Draw a path through (N, 4, 4) poses, with at most 12 small pyramids that open the way the camera looks."""
    path = poses[:, :3, 3]
    lines = [np.stack([np.arange(len(path) - 1), np.arange(1, len(path))], axis=1)]
    points = [path]
    corners = size * np.array([(0, 0, 0), (-0.6, -0.45, 1), (0.6, -0.45, 1), (0.6, 0.45, 1), (-0.6, 0.45, 1)])
    edges = np.array([(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)])
    start = len(path)
    for index in np.unique(np.linspace(0, len(poses) - 1, min(12, len(poses))).round().astype(int)):
        points.append(corners @ poses[index, :3, :3].T + poses[index, :3, 3])
        lines.append(edges + start)
        start += len(corners)
    return np.concatenate(points), np.concatenate(lines)


def views_text(names: list[str], words: dict[str, str]) -> str:
    """Say where a picture looks from."""
    return f"Seen from {sentence_list([words[name] for name in names])}."
