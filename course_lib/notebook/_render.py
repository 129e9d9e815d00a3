"""Drawing with PyVista, off-screen. Only to be called where `_probe.rendering` says that this machine can."""

from __future__ import annotations

import numpy as np

from course_lib.notebook._scene import Layer
from course_lib.notebook._views import View


def draw(layers: tuple[Layer, ...], views: list[View], point_size: float, cull: bool = False) -> list[np.ndarray]:
    """Draw the same layers from each view: a list of (height, width, 3) uint8 on white."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=(views[0].width, views[0].height), lighting="light kit")
    plotter.set_background("white")
    for layer in layers:
        if layer.kind == "mesh":
            surface = pyvista.PolyData.from_regular_faces(layer.points, layer.triangles)
            surface.point_data["rgb"] = layer.rgb
            # colours from a photo have light in them already
            light = {"ambient": 0.25} if layer.classes else {"ambient": 0.6, "diffuse": 0.5}
            plotter.add_mesh(surface, scalars="rgb", rgb=True, culling="back" if cull else None, **light)
        elif layer.kind == "trajectory":
            path = pyvista.PolyData(layer.points, lines=np.insert(layer.segments, 0, 2, axis=1).ravel())
            path.point_data["rgb"] = layer.rgb
            plotter.add_mesh(path, scalars="rgb", rgb=True, line_width=3, lighting=False)
        else:
            cloud = pyvista.PolyData(layer.points)
            cloud.point_data["rgb"] = layer.rgb
            plotter.add_mesh(
                cloud,
                scalars="rgb",
                rgb=True,
                style="points",
                point_size=point_size,
                lighting=False,
                render_points_as_spheres=True,
            )
    clouds = [layer for layer in layers if layer.kind == "cloud"]
    shaded = bool(clouds) and all(layer.classes for layer in clouds)
    images = []
    for view in views:
        clipping = _aim(plotter, view, layers)
        plotter.render()
        image = np.array(plotter.screenshot(return_img=True))[..., :3]
        images.append(_shade(image, _depths(plotter, view, clipping)) if shaded else image)
    plotter.close()
    return images


def _depths(plotter, view: View, clipping: tuple[float, float]) -> np.ndarray:
    """Read the depth buffer as (height, width) metres along the view, infinite where nothing was drawn."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkFloatArray

    buffer = vtkFloatArray()
    plotter.render_window.GetZbufferData(0, 0, view.width - 1, view.height - 1, buffer)
    share = vtk_to_numpy(buffer).reshape(view.height, view.width)[::-1].astype(np.float64)
    near, far = clipping
    depth = near + share * (far - near) if view.eye is None else near * far / (far - share * (far - near))
    return np.where(share < 1, depth, np.inf)


def _shade(image: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Darken what lies behind its neighbours, never by more than half, so that a cloud of one colour has a shape.

    References
    ----------
    Boucheny, Interactive scientific visualization of large datasets, 2009 (eye-dome lighting).
    """
    drawn = np.isfinite(depth)
    if not drawn.any():
        return image
    low, high = np.percentile(depth[drawn], [2, 98])
    height = np.where(drawn, depth, np.nan) / max(high - low, 1e-9)
    behind = np.zeros_like(height)
    for step in (2, 5):
        for shift, axis in ((step, 0), (-step, 0), (step, 1), (-step, 1)):
            behind += np.nan_to_num(np.clip(height - np.roll(height, shift, axis), 0, 0.05))
    shade = 0.5 + 0.5 * np.exp(-12.0 * behind)
    return np.where(drawn[..., None], image * shade[..., None], image).round().astype(np.uint8)


def _aim(plotter, view: View, layers: tuple[Layer, ...]) -> tuple[float, float]:
    depths = np.concatenate([(layer.points - view.centre) @ view.forward for layer in layers])
    size = float(depths.max() - depths.min()) or 1.0
    camera = plotter.camera
    if view.eye is None:
        camera.parallel_projection = True
        camera.parallel_scale = view.scale * view.height / 2
        distance = -float(depths.min()) + size
        camera.position = view.centre - view.forward * distance
    else:
        camera.parallel_projection = False
        camera.view_angle = float(np.degrees(2 * np.arctan(view.scale)))
        camera.position = view.eye
        distance = float((view.centre - view.eye) @ view.forward)
    camera.focal_point = view.centre
    camera.up = view.up
    near, far = distance + float(depths.min()), distance + float(depths.max())
    camera.clipping_range = (max(near - 0.01 * size, 1e-3 * far), far + 0.01 * size)
    return camera.clipping_range
