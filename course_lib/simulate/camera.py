"""The ideal RGB-D camera: colour, depth and labels of a scene, by casting rays.

This module is the only place that decides where a ray goes through a pixel. Open3D's ``create_rays_pinhole`` puts pixel
centres at +0.5, everything else in the course at integers; here rays come from `course_lib.camera.pinhole.pixel_rays`,
so that deprojecting a rendered depth image gives points on the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d

from course_lib.camera.pinhole import PinholeCamera, pixel_rays
from course_lib.camera.rgbd import RGBDFrame
from course_lib.geometry.transforms import check_rigid
from course_lib.simulate.implicit import rotate
from course_lib.simulate.scene_model import Scene

_CORNERS = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))  # of a pixel, where edges are smoothed


@dataclass(frozen=True)
class Hits:
    """What N rays met.

    Attributes
    ----------
    t : (N,) float32, how often the ray's direction fits into the way; inf for nothing.
    triangle : (N,) int32, index into ``scene.triangles``; -1 for nothing.
    bary : (N, 2) float32, weights of the triangle's second and third corner.
    facing : (N,) float32, size of the cosine between ray and normal.
    normal : (N, 3) float32, the triangle's unit normal, world coordinates.
    """

    t: np.ndarray
    triangle: np.ndarray
    bary: np.ndarray
    facing: np.ndarray
    normal: np.ndarray


def cast(scene: Scene, origin: np.ndarray, directions: np.ndarray) -> Hits:
    """Cast rays from ``origin`` (3,) or (N, 3) along ``directions`` (N, 3), world coordinates, of any length."""
    rays = np.empty((len(directions), 6), np.float32)
    rays[:, :3], rays[:, 3:] = origin, directions
    found = scene.caster.cast_rays(o3d.core.Tensor(rays))
    t, normal = found["t_hit"].numpy(), found["primitive_normals"].numpy()
    triangle = np.where(np.isfinite(t), found["primitive_ids"].numpy().astype(np.int32), np.int32(-1))
    way = rays[:, 3:]
    facing = np.abs(np.einsum("ij,ij->i", normal, way)) / np.sqrt(np.einsum("ij,ij->i", way, way))
    return Hits(t, triangle, found["primitive_uvs"].numpy(), facing, normal)


def colors_of(scene: Scene, hits: Hits, spread: np.ndarray | float) -> np.ndarray:
    """Colours (N, 3) float32, 0 to 255, of what rays met (black where nothing).

    Parameters
    ----------
    spread : (N,) metres on a facing surface that one pixel covers; decides how much a picture is blurred.
    """
    out = np.zeros((len(hits.t), 3), np.float32)
    seen = hits.triangle >= 0
    if seen.all():
        seen = slice(None)  # spares copies
    triangle, bary = hits.triangle[seen], hits.bary[seen]
    surface = scene.triangle_surface[triangle]
    way = scene.picture_map[triangle]
    uv = way[:, :2] + bary[:, :1] * way[:, 2:4] + bary[:, 1:] * way[:, 4:]
    wide = np.broadcast_to(spread, hits.t.shape)[seen] / np.sqrt(np.maximum(hits.facing[seen], 0.05))
    level = np.log2(wide / np.maximum(scene.texel[surface], 1e-6)) - 0.25
    found = scene.atlas.look_up(surface, uv, level)
    solid = scene.is_solid[surface]
    if solid.any():
        corners, bary = scene.triangles[triangle[solid]], bary[solid]
        a, b, c = (scene.vertex_colors[corners[:, k]].astype(np.float32) for k in range(3))
        found[solid] = a + bary[:, :1] * (b - a) + bary[:, 1:] * (c - a)
    out[seen] = found
    return out


def render_labelled(
    scene: Scene, camera: PinholeCamera, T_world_camera: np.ndarray, *, name: str = ""
) -> tuple[RGBDFrame, np.ndarray]:
    """As `render`, with the label of what each pixel sees: (H, W) uint8, an index into ``scene.label_names``."""
    T = check_rigid(T_world_camera)
    rays = pixel_rays(camera).reshape(-1, 3).astype(np.float32)
    turn = T.astype(np.float32)
    hits = cast(scene, T[:3, 3], rotate(turn, rays))
    seen = hits.triangle >= 0
    if not seen.any():
        raise ValueError("The camera sees nothing of the scene: every ray misses; move it or turn it around.")
    depth = np.where(seen, hits.t, 0).astype(np.float32)  # a ray's direction has z = 1, so its t is the depth
    surface = np.where(seen, scene.triangle_surface[hits.triangle], -1)
    label = np.where(seen, scene.surface_label[surface], 0).astype(np.uint8)
    pixel = 1 / np.sqrt(camera.fx * camera.fy)
    colors = colors_of(scene, hits, depth * pixel)
    size = (camera.height, camera.width)
    edge = np.flatnonzero(_edges(surface.reshape(size), depth.reshape(size), hits.normal.reshape(*size, 3)))
    mixed = np.zeros((len(edge), 3), np.float32)
    for du, dv in _CORNERS:
        shifted = rays[edge] + np.array([du / camera.fx, dv / camera.fy, 0], np.float32)
        some = cast(scene, T[:3, 3], rotate(turn, shifted))
        mixed += colors_of(scene, some, np.where(np.isfinite(some.t), some.t, 0) * pixel) / len(_CORNERS)
    colors[edge] = mixed
    color = np.rint(colors).astype(np.uint8).reshape(*size, 3)
    frame = RGBDFrame(color, depth.reshape(size), camera, T_world_camera=T, name=name)
    return frame, label.reshape(size)


def render_paint(scene: Scene, camera: PinholeCamera, T_world_camera: np.ndarray) -> np.ndarray:
    """The paint (H, W, 3) uint8 of what each pixel's centre sees, without light or blur; black where no picture is.

    This is the truth about what is printed on a surface, however dark or bright the light makes it.
    """
    T = check_rigid(T_world_camera)
    hits = cast(scene, T[:3, 3], rotate(T.astype(np.float32), pixel_rays(camera).reshape(-1, 3).astype(np.float32)))
    out = np.zeros((camera.height * camera.width, 3), np.uint8)
    way = scene.picture_map[hits.triangle]
    uv = way[:, :2] + hits.bary[:, :1] * way[:, 2:4] + hits.bary[:, 1:] * way[:, 4:]
    surface = np.where(hits.triangle >= 0, scene.triangle_surface[hits.triangle], -1)
    for number in np.unique(surface[surface >= 0]):
        if scene.is_solid[number]:
            continue
        paint, here = scene.surfaces[number].paint, surface == number
        size = np.array([paint.shape[1], paint.shape[0]])
        u, v = np.clip((uv[here] * size).astype(int), 0, size - 1).T
        out[here] = paint[v, u]
    return out.reshape(camera.height, camera.width, 3)


def render(scene: Scene, camera: PinholeCamera, T_world_camera: np.ndarray, *, name: str = "") -> RGBDFrame:
    """Take an ideal picture of a scene: no noise, no blur, exact depth.

    Parameters
    ----------
    scene : what to see.
    camera : intrinsics; its distortion is honoured.
    T_world_camera : (4, 4) pose of the camera.
    name : name of the frame.

    Returns
    -------
    RGBDFrame; its depth is z in metres at the centre of each pixel, 0 where the ray leaves the scene.

    Raises
    ------
    ValueError
        If no ray meets the scene, or the pose is not rigid.
    """
    return render_labelled(scene, camera, T_world_camera, name=name)[0]


def _edges(surface: np.ndarray, depth: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Pixels beside a neighbour that sees another surface, another slope or another depth."""
    out = np.zeros(surface.shape, bool)
    for here, there in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        differs = surface[here] != surface[there]
        differs |= np.einsum("ijk,ijk->ij", normal[here], normal[there]) < 0.95
        differs |= np.abs(depth[here] - depth[there]) > 0.05 * np.minimum(depth[here], depth[there])
        out[here] |= differs
        out[there] |= differs
    return out
