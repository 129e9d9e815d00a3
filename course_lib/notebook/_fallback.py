"""Drawing with Matplotlib where there is no OpenGL: the same views and scale, far things first, near things over them."""

from __future__ import annotations

import numpy as np

from course_lib.notebook._scene import Layer
from course_lib.notebook._views import View

SLABS = 24
"""The scene is drawn in this many slices from far to near, so that clouds, surfaces and lines cover each other."""
DPI = 100


def draw(layers: tuple[Layer, ...], views: list[View], point_size: float, cull: bool = False) -> list[np.ndarray]:
    """Draw the same layers from each view: a list of (height, width, 3) uint8 on white."""
    return [_draw(layers, view, point_size, cull) for view in views]


def _draw(layers: tuple[Layer, ...], view: View, point_size: float, cull: bool) -> np.ndarray:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(view.width / DPI, view.height / DPI), dpi=DPI)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_xlim(0, view.width)
    axes.set_ylim(view.height, 0)
    seen = [(layer, *view.project(layer.points)) for layer in layers]
    depths = np.concatenate([depth for _, _, depth in seen])
    edges = np.linspace(depths.max(), depths.min(), SLABS + 1)
    edges[0], edges[-1] = np.inf, -np.inf
    for slab, (far, near) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        for layer, pixels, depth in seen:
            _draw_slab(axes, layer, view, pixels, depth, (near, far), point_size, cull, slab)
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


def _draw_slab(axes, layer, view, pixels, depth, bounds, point_size, cull, order) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    near, far = bounds
    if layer.kind == "cloud":
        chosen = np.flatnonzero((depth >= near) & (depth < far))
        chosen = chosen[np.argsort(-depth[chosen])]
        area = (point_size * 72 / DPI) ** 2
        axes.scatter(*pixels[chosen].T, s=area, c=layer.rgb[chosen] / 255.0, linewidths=0, zorder=order)
        return
    parts = layer.triangles if layer.kind == "mesh" else layer.segments
    middle = depth[parts].mean(axis=1)
    chosen = np.flatnonzero((middle >= near) & (middle < far) & np.isfinite(pixels[parts]).all(axis=(1, 2)))
    chosen = chosen[np.argsort(-middle[chosen])]
    colour = layer.rgb[parts[chosen]].mean(axis=1) / 255.0
    if layer.kind == "trajectory":
        axes.add_collection(LineCollection(pixels[parts[chosen]], colors=colour, linewidths=2.5, zorder=order + 0.5))
        return
    shade, facing = _shade(layer.points, parts[chosen], view)
    chosen, colour, shade = (a[facing] if cull else a for a in (chosen, colour, shade))
    faces = np.clip(colour * shade[:, None], 0, 1)
    axes.add_collection(PolyCollection(pixels[parts[chosen]], facecolors=faces, edgecolors=faces, linewidths=0.3, zorder=order))


def _shade(points: np.ndarray, triangles: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray]:
    """Light from over the viewer's shoulder: (T,) brightness, and (T,) whether the front of a triangle is seen."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    towards = -view.forward if view.eye is None else view.eye - a
    facing = (normal * towards).sum(axis=1) > 0
    lamp = -view.forward + 0.35 * view.up - 0.25 * view.right
    return 0.35 + 0.7 * np.abs(normal @ (lamp / np.linalg.norm(lamp))), facing
