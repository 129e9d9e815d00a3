"""Which colour each point gets, what explains it (legend, colour bar), and how it is said in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from course_lib.notebook import _colours as colours
from course_lib.notebook._things import Thing, as_bytes
from course_lib.notebook._views import height_axis
from course_lib.notebook._words import amount, count, number


@dataclass(frozen=True)
class ColourBar:
    """What the colours of a magnitude mean."""

    label: str
    map: str
    limits: tuple[float, float]


@dataclass(frozen=True)
class Colouring:
    """How `show` was asked to colour: see there."""

    color: object = None
    label: str = ""
    unit: str = ""
    limits: tuple[float, float] | None = None
    signed: bool = False
    about: bool = False


def _values(thing: Thing, colouring: Colouring, frame: str) -> tuple[np.ndarray, str] | None:
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


def common_limits(things: list[Thing], colouring: Colouring, frame: str) -> tuple[float, float]:
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


Painted = tuple[np.ndarray, str, list[tuple[str, str]], ColourBar | None]
"""(N, 3) uint8 colours, the words for them, legend entries, and a colour bar or None."""


def paint(
    thing: Thing,
    cycled: tuple[str, str] | None,
    colouring: Colouring,
    frame: str,
    limits: tuple[float, float],
) -> Painted:
    """Decide the colours of a thing and what explains them.

    Parameters
    ----------
    thing : what is coloured.
    cycled : colour and word that tell it from the others; None where it is the only one of its kind.
    colouring : how `show` was asked to colour; what came with the thing itself goes first.
    frame : where up is.
    limits : of the colour bar.
    """
    n = len(thing.points)
    color = thing.color if thing.color is not None else colouring.color
    magnitudes = _values(thing, colouring, frame)
    if magnitudes is not None:
        return _by_magnitude(*magnitudes, colouring, limits)
    if isinstance(color, str) and color in ("label", "rgb", "height", "depth"):
        if thing.kind == "trajectory":
            return _plain(thing, None, cycled)
        return _by_label(thing) if color == "label" else _own(thing)
    if color is None or isinstance(color, str):
        return _plain(thing, color, cycled)
    array = np.asarray(color)
    if array.shape == (n, 3):
        return as_bytes(array, n), "in given colours", [], None
    if array.shape == (n,) and array.dtype.kind == "b":
        return _by_mask(array)
    raise ValueError(f"Colours of shape {array.shape} do not fit {n:,} points: pass ({n},) numbers or ({n}, 3) uint8.")


def _by_magnitude(values: np.ndarray, name: str, colouring: Colouring, limits: tuple[float, float]) -> Painted:
    unit = "m" if name in ("height", "depth") else colouring.unit
    map_name = colours.SIGNED if colouring.signed else colours.MAGNITUDES
    ends = "blue below, red above zero" if colouring.signed else "dark blue to yellow"
    low, high = _seen(limits)
    words = f"coloured by {name}, {number(low, 2)} to {amount(high, unit, 2)} ({ends})"
    bar = ColourBar(f"{name} ({unit})" if unit else name, map_name, limits)
    return colours.colour_map(map_name, values, limits), words, [], bar


def _seen(limits: tuple[float, float]) -> tuple[float, float]:
    """The ends of a colour bar as one can read them: what is less than 1 % of its length from zero is zero.

    The smallest of many errors is often such a number, and it is another one on another machine.
    """
    least = 0.01 * abs(limits[1] - limits[0])
    return tuple(0.0 if abs(end) < least else end for end in limits)


def _own(thing: Thing) -> Painted:
    if thing.colors is None:
        raise ValueError(f"This {thing.kind} has no colours of its own: use color='height', or give it colours.")
    return thing.colors, "in its own colours", [], None


def _plain(thing: Thing, color: str | None, cycled: tuple[str, str] | None) -> Painted:
    """One colour: the class that was asked for or is the thing's name; else its own; else one that tells it apart."""
    class_name = color or (thing.name if thing.name in colours.COLOURS else "")
    if class_name:
        code, words = colours.COLOURS.get(class_name, class_name), colours.COLOUR_WORDS.get(class_name, class_name)
    elif cycled is None and thing.colors is not None:
        return _own(thing)
    elif cycled is not None and (thing.kind != "mesh" or thing.name):
        code, words = cycled
    else:
        class_name = {"cloud": "inlier", "mesh": "surface", "trajectory": "outlier"}[thing.kind]
        code, words, class_name = colours.COLOURS[class_name], colours.COLOUR_WORDS[class_name], ""
    name = thing.name or (class_name if class_name in colours.COLOURS else "")
    flat = np.tile(np.array(colours.rgb(code), np.uint8), (len(thing.points), 1))
    return flat, words, [(name, code)] if name else [], None


def _by_mask(mask: np.ndarray) -> Painted:
    kept, dropped = np.array(colours.rgb("inlier"), np.uint8), np.array(colours.rgb("outlier"), np.uint8)
    words = f"{count(int(mask.sum()), 'inlier')} blue, {count(int((~mask).sum()), 'outlier')} vermilion"
    entries = [("inlier", colours.COLOURS["inlier"]), ("outlier", colours.COLOURS["outlier"])]
    return np.where(mask[:, None], kept, dropped), words, entries, None


def _by_label(thing: Thing) -> Painted:
    if thing.labels is None:
        raise ValueError(f"This {thing.kind} has no labels: color='label' needs PointCloud(labels=...).")
    names, which = np.unique(thing.labels, return_inverse=True)
    grey = names < 0
    places = np.cumsum(~grey) - 1
    codes = [
        colours.COLOURS["surface"] if grey[i] else colours.CYCLE[places[i] % len(colours.CYCLE)][0]
        for i in range(len(names))
    ]
    table = np.array([colours.rgb(code) for code in codes], np.uint8)
    entries = [(f"{'no label' if n < 0 else f'label {n}'}", c) for n, c in zip(names, codes, strict=True)][:8]
    return table[which.ravel()], f"coloured by label, {count(int((~grey).sum()), 'label')}", entries, None
