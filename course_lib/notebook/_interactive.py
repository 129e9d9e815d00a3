"""What moves in a live notebook, without network: a plotly view to turn, and a slider over frames.

PyVista's own browser view loads code from the internet at run time; plotly's is installed with JupyterLab's
extensions, so it also turns on a machine that is offline. Neither is ever stored in a lesson.
"""

from __future__ import annotations

import json

import numpy as np

from course_lib.notebook._picture import Picture
from course_lib.notebook._scene import Scene
from course_lib.notebook._views import look

MOST_POINTS = 60_000
"""A browser turns this many points smoothly, and a notebook saved by mistake stays under 3 MB."""


class Turnable:
    """A plotly figure that JupyterLab draws with the code it has installed; elsewhere its description is shown."""

    def __init__(self, figure: object, alt: str):
        self.figure, self.alt = figure, alt

    def __repr__(self) -> str:
        return self.alt

    def _repr_mimebundle_(self, include=None, exclude=None) -> dict:
        return {"application/vnd.plotly.v1+json": json.loads(self.figure.to_json()), "text/plain": self.alt}


def turnable(scene: Scene, title: str = "") -> Turnable:
    """Return a view of a scene to turn with the mouse, with equal axes and the scene's up direction."""
    from plotly.graph_objects import Figure, Mesh3d, Scatter3d

    figure = Figure()
    for layer in scene.layers:
        if layer.kind == "mesh":
            x, y, z = layer.points.astype(np.float32).T
            i, j, k = layer.triangles.T
            figure.add_trace(Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, vertexcolor=layer.rgb, hoverinfo="skip"))
        elif layer.kind == "trajectory":
            pairs = np.full((len(layer.segments), 3, 3), np.nan)
            pairs[:, :2] = layer.points[layer.segments]
            x, y, z = pairs.reshape(-1, 3).T
            line = {"color": _css(layer.rgb[0]), "width": 4}
            figure.add_trace(Scatter3d(x=x, y=y, z=z, mode="lines", line=line, hoverinfo="skip"))
        else:
            step = -(-len(layer.points) // MOST_POINTS)
            x, y, z = layer.points[::step].astype(np.float32).T
            marker = {"size": 2, "color": [_css(colour) for colour in layer.rgb[::step]]}
            figure.add_trace(Scatter3d(x=x, y=y, z=z, mode="markers", marker=marker))
    view = look("iso", scene.points, scene.frame)
    axis = dict.fromkeys(("x", "y", "z"))
    figure.update_layout(
        title=title or None,
        height=520,
        margin={"l": 0, "r": 0, "t": 40 if title else 0, "b": 0},
        showlegend=False,
        scene={
            "aspectmode": "data",
            "camera": {
                "eye": dict(zip(axis, (-1.6 * view.forward).tolist(), strict=True)),
                "up": dict(zip(axis, view.up.tolist(), strict=True)),
            },
            **{f"{name}axis": {"title": f"{name} (m)"} for name in axis},
        },
    )
    return Turnable(figure, f"A view to turn with the mouse. {scene.text}")


def _css(colour: np.ndarray) -> str:
    return f"rgb({colour[0]},{colour[1]},{colour[2]})"


def frame_slider(pictures: dict[str, Picture], label: str):
    """Return an ipywidgets slider over pictures that are already drawn."""
    from ipywidgets import HTML, Image, SelectionSlider, VBox

    first = next(iter(pictures.values()))
    image = Image(value=first.png, format="png", width=first.width)
    words = HTML(first.alt)
    slider = SelectionSlider(options=list(pictures), description=label, style={"description_width": "initial"})

    def turn(change: dict) -> None:
        image.value, words.value = pictures[change["new"]].png, pictures[change["new"]].alt

    slider.observe(turn, names="value")
    return VBox([slider, image, words])
