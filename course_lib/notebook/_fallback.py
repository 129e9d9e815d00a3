"""Drawing with Matplotlib where there is no OpenGL: the same views and scale, far things first, near ones over them."""

from __future__ import annotations

import numpy as np

from course_lib.notebook._picture import blank, drawn
from course_lib.notebook._scene import Layer
from course_lib.notebook._views import View

SLABS = 24
"""The scene is drawn in this many slices from far to near, so that clouds, surfaces and lines cover each other."""
DPI = 100


def draw(layers: tuple[Layer, ...], views: list[View], point_size: float, cull: bool = False) -> list[np.ndarray]:
    """Draw the same layers from each view: a list of (height, width, 3) uint8 on white."""
    return [_draw(layers, view, point_size, cull) for view in views]


def _draw(layers: tuple[Layer, ...], view: View, point_size: float, cull: bool) -> np.ndarray:
    figure = blank(view.width, view.height, DPI)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_xlim(0, view.width)
    axes.set_ylim(view.height, 0)
    primitives = [_primitives(layer, view, point_size, cull) for layer in layers]
    depths = np.concatenate([depth for _, depth, _ in primitives])
    if len(depths):
        edges = np.linspace(depths.max(), depths.min(), SLABS + 1)
        edges[0], edges[-1] = np.inf, -np.inf
        for order, (far, near) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
            for layer, (shapes, depth, colour) in zip(layers, primitives, strict=True):
                inside = (depth >= near) & (depth < far)
                _add(axes, layer.kind, shapes[inside], colour[inside], point_size, order)
    return drawn(figure)


def _primitives(layer: Layer, view: View, point_size: float, cull: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what to draw of a layer, far things first: pixels, depths, colours (0..1) of its points or parts."""
    pixels, depth = view.project(layer.points)
    if layer.kind == "cloud":
        chosen = _in_front(pixels, depth, view, max(1.0, point_size / 3))
        return pixels[chosen], depth[chosen], layer.rgb[chosen] / 255.0
    parts = layer.triangles if layer.kind == "mesh" else layer.segments
    parts = parts[np.isfinite(pixels[parts]).all(axis=(1, 2))]
    colour = layer.rgb[parts].mean(axis=1) / 255.0
    if layer.kind == "mesh":
        brightness, facing = _light(layer.points, parts, view)
        if not layer.classes:  # colours from a photo have light in them already
            brightness = 0.6 + 0.4 * brightness
        parts, colour = (
            (parts[facing], (colour * brightness[:, None])[facing]) if cull else (parts, colour * brightness[:, None])
        )
    middle = depth[parts].mean(axis=1)
    order = np.argsort(-middle, kind="stable")
    return pixels[parts[order]], middle[order], np.clip(colour[order], 0, 1)


def _in_front(pixels: np.ndarray, depth: np.ndarray, view: View, cell: float) -> np.ndarray:
    """Choose the nearest point of each small cell of the picture, far ones first: the others would be painted over."""
    inside = np.flatnonzero(view.holds(pixels))
    nearest_first = inside[np.argsort(depth[inside], kind="stable")]
    cells = (pixels[nearest_first] // cell).astype(np.int64) @ [1, 1 << 20]
    _, first = np.unique(cells, return_index=True)
    return nearest_first[np.sort(first)[::-1]]


def _add(axes, kind: str, shapes: np.ndarray, colour: np.ndarray, point_size: float, order: int) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    if len(shapes) == 0:
        return
    if kind == "cloud":
        axes.scatter(*shapes.T, s=(point_size * 72 / DPI) ** 2, c=colour, linewidths=0, zorder=order)
    elif kind == "mesh":
        axes.add_collection(PolyCollection(shapes, facecolors=colour, edgecolors=colour, linewidths=0.3, zorder=order))
    else:
        axes.add_collection(LineCollection(shapes, colors=colour, linewidths=2.0, zorder=order + 0.5))


def _light(points: np.ndarray, triangles: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray]:
    """Light from over the viewer's shoulder: (T,) brightness, and (T,) whether the front of a triangle is seen."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    towards = -view.forward if view.eye is None else view.eye - a
    facing = (normal * towards).sum(axis=1) > 0
    lamp = -view.forward + 0.35 * view.up - 0.25 * view.right
    return 0.35 + 0.7 * np.abs(normal @ (lamp / np.linalg.norm(lamp))), facing
