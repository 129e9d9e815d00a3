"""A desk seen by a D455 that makes every mistake: each measured point is labelled with what it is.

To the desk of `course_lib.simulate.scenes` come a lamp on a thin rod, a cable that hangs from above, and a tablet whose
glass mirrors. The camera measures it with the noise of `course_lib.simulate.d455`; then some pixels are matched
wrongly, and parts of the glass show what they mirror, at the depth of the mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import open3d as o3d

from course_lib.camera.pinhole import PinholeCamera, deproject, pixel_rays
from course_lib.geometry.transforms import apply, look_at
from course_lib.simulate import d455, furniture, shapes, textures
from course_lib.simulate.camera import cast, render_labelled
from course_lib.simulate.scene_model import Scene, Surface

KINDS = ("nothing", "surface", "thin structure", "flying pixel", "reflection", "isolated noise")
NOTHING, SURFACE, THIN, FLYING, REFLECTION, NOISE = range(6)
ARTEFACTS = (*d455.ARTEFACTS, "reflection in glass", "matched wrongly")
MIRRORED, WRONG = len(d455.ARTEFACTS), len(d455.ARTEFACTS) + 1

THIN_NAMES = ("lamp rod", "cable")
GLASS = "glass"
TOP = 0.74  # metres: the height of the desk
ROD, CABLE = 0.006, 0.005  # metres: radii
NEAR_SURFACE = 4.0  # standard deviations of the depth noise: what lies nearer to a surface is a point of it
WRONG_SHARE = 0.006  # of the pixels start a wrong match
SPECKLE_SHARE = 0.3  # of these are two pixels wide and high
MIRROR_SHARE = 0.33  # of the glass shows its mirror image
FARTHEST, NEAREST = 5.0, 0.45  # metres: between these a wrong match falls


@dataclass(frozen=True)
class OutlierShot:
    """One frame and the cloud that it gives.

    Attributes
    ----------
    frame : the arrays of a frame, as `course_lib.simulate.recipes.recipe` describes them.
    pose : (4, 4) T_world_camera.
    points : (N, 3) float32, metres, camera frame: the measured pixels, row by row.
    colors : (N, 3) uint8.
    kinds : (N,) uint8, index into `KINDS`.
    """

    frame: dict[str, np.ndarray]
    pose: np.ndarray
    points: np.ndarray
    colors: np.ndarray
    kinds: np.ndarray


def add_thin_things(desk: Scene, rng: np.random.Generator) -> Scene:
    """Put a lamp, a hanging cable and a tablet on a desk; where exactly, the generator decides."""
    lamp = np.array([rng.uniform(-0.16, 0.02), rng.uniform(0.20, 0.32), TOP])
    tall = rng.uniform(0.34, 0.42)
    metal = textures.plain(rng, (8, 8), (70, 74, 80))
    base = shapes.sharp([(0, 0.016), (0.07, 0.014), (0.075, 0), (0, 0)])
    shade = [(0.035, tall + 0.08), (0.075, tall)]
    cream = textures.plain(rng, (40, 120), (238, 214, 160), 0.05)
    end = np.array([rng.uniform(0.22, 0.32), rng.uniform(-0.10, 0.02), TOP + CABLE])
    start = np.array([end[0] + rng.uniform(0.02, 0.10), end[1] + rng.uniform(0.10, 0.2), TOP + 0.62])
    tablet = (rng.uniform(-0.40, -0.34), rng.uniform(-0.055, -0.025), TOP)
    things = [
        furniture.round_thing("lamp", base, lamp, metal),
        _tube("lamp rod", np.linspace(lamp + (0, 0, 0.012), lamp + (0, 0, tall + 0.02), 12), ROD, metal),
        furniture.round_thing("lamp", shade, lamp, cream),
        furniture.round_thing("lamp", [(r - 0.003, z) for r, z in shade[::-1]], lamp, cream),
        _tube("cable", _hanging(start, end), CABLE, textures.plain(rng, (8, 200), (40, 44, 52), 0.05)),
        *_tablet(rng, tablet, rng.uniform(4, 16), rng.uniform(9, 13)),
    ]
    return Scene([*desk.surfaces, *things], desk.lights, desk.ambient, desk.views)


def _hanging(start: np.ndarray, end: np.ndarray, count: int = 60) -> np.ndarray:
    """A line from above that sags as it comes down, and ends lying on the desk."""
    s = np.linspace(0, 1, count)[:, None]
    line = start + (end - start) * s
    line[:, 2] = np.maximum(start[2] + (end[2] - start[2]) * (s[:, 0] + 0.9 * s[:, 0] * (1 - s[:, 0])), end[2])
    return line


def _tube(name: str, line: np.ndarray, radius: float, picture: np.ndarray) -> Surface:
    """A round tube along a line (n, 3)."""
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, (0.3, 0.9, 0.1))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    angle = np.linspace(0, 2 * np.pi, 13)
    normals = side[:, None] * np.cos(angle)[:, None] + other[:, None] * np.sin(angle)[:, None]
    return Surface(name, shapes.Patch(line[:, None] + radius * normals, normals), picture)


def _tablet(rng: np.random.Generator, at: tuple[float, float, float], yaw: float, lean: float) -> list[Surface]:
    """A tablet that leans back a little; its face is glass."""
    tilt = np.radians(lean)
    T = furniture.placed(at, yaw)
    turn = np.eye(4)
    turn[1:3, 1:3] = [[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]
    dark = furniture.painted((36, 38, 44))
    body = furniture.block(rng, "tablet", (0.22, 0.15, 0.008), (0, 0, 0.03), paint=dark, T=T @ turn)
    foot = furniture.block(rng, "tablet", (0.06, 0.02, 0.03), (0, 0.04, 0), paint=dark, T=T)
    face = shapes.rectangle((-0.102, 0.067, 0.0385), (0.204, 0, 0), (0, -0.134, 0)).moved(T @ turn)
    return [*body, *foot, Surface(GLASS, face, textures.plain(rng, (40, 60), (24, 28, 40), 0.06))]


def shoot(desk: Scene, camera: PinholeCamera, rng: np.random.Generator) -> OutlierShot:
    """Lay the desk anew, take one frame of it, and label every measured point.

    Parameters
    ----------
    desk : the desk without the thin things.
    camera : intrinsics.
    rng : decides places, the camera's hand-held pose, and every error; the same state gives the same arrays.

    Returns
    -------
    OutlierShot. A point is an outlier if an error moved it farther than `NEAR_SURFACE` standard deviations of the noise
    at its depth from every surface; else it is a point of the surface that it lies on.
    """
    scene = add_thin_things(desk, rng)
    pose = look_at(np.array((-0.12, -0.66, 1.30)) + rng.uniform(-0.05, 0.05, 3), (-0.02, 0.06, 0.86))
    frame, labels = render_labelled(scene, camera, pose)
    measured = d455.measure(frame.depth, camera, rng)
    depth, artefacts = measured.depth.copy(), measured.artefacts.copy()
    _mirror(scene, camera, pose, labels, depth, artefacts, rng)
    _mismatch(camera, depth, artefacts, rng)
    there = depth > 0
    points = deproject(depth, camera)[there].astype(np.float32)
    kinds = _kinds(scene, camera, apply(pose, points.astype(float)), points[:, 2], labels[there], artefacts[there])
    color = d455.color_noise(frame.color, rng)
    arrays = {
        "color": color,
        "depth_raw": np.rint(depth * 1000).astype(np.uint16),
        "depth_truth": frame.depth,
        "labels": labels,
        "artefacts": artefacts,
    }
    return OutlierShot(arrays, pose, points, color[there], kinds)


def _mirror(
    scene: Scene, camera: PinholeCamera, pose: np.ndarray, labels: np.ndarray, depth: np.ndarray,
    artefacts: np.ndarray, rng: np.random.Generator,
) -> None:  # fmt: skip
    """Give parts of the glass the depth of what they mirror, in place."""
    on_glass = labels == scene.label(GLASS)
    patches = cv2.GaussianBlur(rng.standard_normal(depth.shape), (0, 0), camera.fx / 100)
    if not on_glass.any():
        return
    chosen = on_glass & (patches > np.quantile(patches[on_glass], 1 - MIRROR_SHARE))
    rays = pixel_rays(camera)[chosen] @ pose[:3, :3].T
    first = cast(scene, pose[:3, 3], rays)
    normal = first.normal.astype(float)
    back = rays - 2 * np.einsum("ij,ij->i", rays, normal)[:, None] * normal
    second = cast(scene, pose[:3, 3] + first.t[:, None] * rays + 1e-4 * back, back)
    # |back| = |rays|, so lengths along both add up, in units of z
    z = first.t + second.t
    disparity = camera.fx * d455.BASELINE / z + d455.SIGMA * rng.standard_normal(len(z))
    z = camera.fx * d455.BASELINE / (np.rint(np.maximum(disparity, d455.STEP) / d455.STEP) * d455.STEP)
    seen = np.isfinite(second.t) & (z < d455.FAR)
    depth[chosen] = np.where(seen, np.rint(z * 1000) / 1000, 0)
    artefacts[chosen] = np.where(seen, MIRRORED, d455.UNMATCHED)


def _mismatch(camera: PinholeCamera, depth: np.ndarray, artefacts: np.ndarray, rng: np.random.Generator) -> None:
    """Match some pixels wrongly, single ones and specks of four, in place."""
    start = rng.random(depth.shape) < WRONG_SHARE
    wide = start & (rng.random(depth.shape) < SPECKLE_SHARE)
    fb = camera.fx * d455.BASELINE
    disparity = np.where(start, rng.uniform(fb / FARTHEST, fb / NEAREST, depth.shape), 0)
    for dv, du in ((0, 1), (1, 0), (1, 1)):
        moved = np.zeros_like(disparity)
        moved[dv:, du:] = np.where(wide, disparity, 0)[: depth.shape[0] - dv, : depth.shape[1] - du]
        disparity = np.where(moved > 0, moved + d455.SIGMA * rng.standard_normal(depth.shape), disparity)
    wrong = disparity > 0
    disparity = np.maximum(np.rint(disparity / d455.STEP) * d455.STEP, fb / d455.FAR)
    depth[wrong] = (np.rint(fb / disparity * 1000) / 1000)[wrong]
    artefacts[wrong] = WRONG


def _kinds(
    scene: Scene, camera: PinholeCamera, world: np.ndarray, z: np.ndarray, labels: np.ndarray, artefacts: np.ndarray
) -> np.ndarray:
    """What each point is, (N,) uint8 index into `KINDS`."""
    found = scene.caster.compute_closest_points(o3d.core.Tensor(world.astype(np.float32)))
    off = np.linalg.norm(found["points"].numpy() - world, axis=1)
    nearest = scene.surface_label[scene.triangle_surface[found["primitive_ids"].numpy().astype(np.int64)]]
    wrong = (artefacts != d455.MEASURED) & (off > NEAR_SURFACE * d455.depth_sigma(z, camera))
    own = np.where(artefacts == d455.MEASURED, labels, nearest)
    thin = np.isin(own, [scene.label(name) for name in THIN_NAMES])
    kinds = np.where(thin, THIN, SURFACE)
    for artefact, kind in ((d455.FLYING, FLYING), (MIRRORED, REFLECTION), (WRONG, NOISE)):
        kinds[wrong & (artefacts == artefact)] = kind
    return kinds.astype(np.uint8)
