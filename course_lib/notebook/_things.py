"""What `show` can be given: each kind of thing is recognised here and taken apart into arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from course_lib.notebook._words import count


@dataclass
class Thing:
    """A recognised thing, before its colours are decided.

    Attributes
    ----------
    kind : "cloud", "mesh" or "trajectory".
    points : (N, 3) float, metres, finite.
    name : for the legend; may be empty.
    color : what it is to be coloured by, where it was given with the thing.
    colors : (N, 3) uint8 of its own, or None.
    labels : (N,) int of its own, or None.
    triangles : (T, 3) int of a mesh, else None.
    poses : (P, 4, 4) of a trajectory, else None.
    note : what was left out, in words.
    """

    kind: str
    points: np.ndarray
    name: str = ""
    color: object = None
    colors: np.ndarray | None = None
    labels: np.ndarray | None = None
    triangles: np.ndarray | None = None
    poses: np.ndarray | None = None
    note: str = ""


def recognise(things: tuple) -> list[Thing]:
    """Recognise all things of one picture: pairs are (thing, name or colour), dicts are name → thing or pair."""
    known = []
    for thing in things:
        if isinstance(thing, dict):
            known += [_recognise(value, name) for name, value in thing.items()]
        elif _is_pair(thing):
            known.append(_recognise(*thing))
        else:
            known.append(_recognise(thing, None))
    return known


def _is_pair(thing: object) -> bool:
    return isinstance(thing, tuple) and len(thing) == 2 and np.shape(thing[1]) != (4, 4)


def _recognise(thing: object, tag: object) -> Thing:
    """Recognise one thing that came with a name or a colour."""
    color = None
    if _is_pair(thing):
        thing, color = thing
    found = _arrays(thing)
    found.color = color
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
        raise ValueError(
            f"There is nothing to show: the {found.kind}{name} has no points; check what was filtered before."
        )
    return found


def _arrays(thing: object) -> Thing:
    """Find out what a thing is and take its arrays."""
    if hasattr(thing, "depth") and hasattr(thing, "camera"):
        from course_lib.cloud.pointcloud import from_frame

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
    array = _array(thing)
    if array is not None and array.ndim == 3 and array.shape[1:] == (4, 4):
        poses = array.astype(np.float64)
        return Thing("trajectory", poses[:, :3, 3], poses=poses)
    if array is not None and array.ndim in (2, 3) and array.shape[-1] == 3 and array.dtype.kind == "f":
        return _cloud(array.reshape(-1, 3), None, None)
    if array is not None and array.ndim >= 2:
        raise ValueError(
            f"An array of shape {array.shape} and type {array.dtype} is not a cloud: for pictures use "
            "show.images({'title': array}), for depth show.depth(depth)."
        )
    if isinstance(thing, (list, tuple)):
        raise ValueError(
            "A list is shown as a trajectory of 4x4 poses, and this one holds other things: pass them one by one, "
            "show(a, b), or side by side, show.panels({'a': a, 'b': b})."
        )
    raise ValueError(
        f"show does not know what a {type(thing).__name__} is: pass a PointCloud, an (N, 3) array, a Mesh, "
        "an RGBDFrame or a list of 4x4 poses."
    )


def _array(thing: object) -> np.ndarray | None:
    """Take an array as it is, and a list of poses or points as an array; None for anything else."""
    if isinstance(thing, np.ndarray):
        return thing
    if not isinstance(thing, (list, tuple)) or any(np.shape(one) not in ((4, 4), (3,)) for one in thing):
        return None
    return np.asarray(thing, dtype=np.float64)


def _first(thing: object, *names: str) -> np.ndarray | None:
    for name in names:
        value = getattr(thing, name, None)
        if value is not None and len(value):
            return np.asarray(value)
    return None


def as_bytes(colors: np.ndarray | None, n: int) -> np.ndarray | None:
    if colors is None or len(colors) != n:
        return None
    return (colors * 255).round().astype(np.uint8) if colors.dtype.kind == "f" else colors.astype(np.uint8)


def _cloud(points: np.ndarray, colors: np.ndarray | None, labels: np.ndarray | None) -> Thing:
    points = points.reshape(-1, 3).astype(np.float64)
    colors = colors.reshape(-1, 3) if colors is not None else None
    return Thing("cloud", points, colors=as_bytes(colors, len(points)), labels=labels)


def _mesh(vertices: np.ndarray, triangles: np.ndarray, colors: np.ndarray | None) -> Thing:
    if len(triangles) == 0:
        raise ValueError("There is nothing to show: this mesh has no triangles; check how it was made.")
    return Thing(
        "mesh",
        vertices.astype(np.float64),
        colors=as_bytes(colors, len(vertices)),
        triangles=triangles.astype(np.int64),
    )
