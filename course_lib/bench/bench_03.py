"""Benchmarks of lesson 03: lifting a 1280x720 depth image with 8 % holes, against Open3D's legacy cloud.

Both sides get the same float32 image in metres and the same intrinsics, do one frame a call, and allocate their result.
Ours uses one thread whatever is set.

Open3D is measured at whichever of its two ways is the faster one for the case: `project_valid_depth_only=False` also
returns a point (of NaN) for every pixel and is what the organised cloud is compared with; the compact cloud is compared
with the call that returns the same points in the same order.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d

from course_lib.bench.compare import Case
from course_lib.camera import pinhole

HOLES = 0.08  # share of pixels without depth
SEED = 3


def depth_image(camera: pinhole.PinholeCamera, seed: int = SEED) -> np.ndarray:
    """Return a (H, W) float32 depth image, metres: a slanted wall with relief, and `HOLES` of its pixels missing.

    Half of the missing pixels lie singly, half in blobs along one side, as a stereo camera has them.
    """
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    depth = 2.0 + u / camera.width + 0.2 * np.sin(u / 40.0) * np.cos(v / 30.0)
    depth[:, : round(camera.width * HOLES / 2)] = 0
    depth[rng.random(depth.shape) < HOLES / (2 - HOLES)] = 0
    return depth.astype(np.float32)


def cases() -> list[Case]:
    """Return the benchmark's cases: the organised float32 cloud and the compact float64 cloud."""
    camera = pinhole.preset("d455_depth_1280x720")
    depth = depth_image(camera)
    image = o3d.geometry.Image(depth)
    intrinsic = o3d.camera.PinholeCameraIntrinsic(
        camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
    )

    def open3d(valid_only: bool) -> o3d.geometry.PointCloud:
        return o3d.geometry.PointCloud.create_from_depth_image(
            image, intrinsic, depth_scale=1.0, depth_trunc=1000.0, project_valid_depth_only=valid_only
        )

    def organised_agrees() -> None:
        ours = pinhole.deproject(depth, camera).reshape(-1, 3)
        theirs = np.asarray(open3d(False).points)
        assert ours.shape == theirs.shape
        np.testing.assert_array_equal(np.isnan(ours).any(axis=1), ~np.isfinite(theirs).all(axis=1))
        np.testing.assert_allclose(ours, theirs, rtol=1e-6)

    def compact_agrees() -> None:
        ours = pinhole.deproject_compact(depth, camera)
        theirs = np.asarray(open3d(True).points)
        assert ours.dtype == theirs.dtype == np.float64 and ours.shape == theirs.shape
        np.testing.assert_allclose(ours, theirs, rtol=1e-14)

    return [
        Case(
            "deproject 1280x720, organised float32",
            (0.5, 0.5),
            lambda: pinhole.deproject(depth, camera),
            {"Open3D": lambda: open3d(False)},
            "Open3D's legacy create_from_depth_image, project_valid_depth_only=False: one point a pixel, as ours",
            organised_agrees,
        ),
        Case(
            "deproject 1280x720, compact float64",
            (1.0, 1.0),
            lambda: pinhole.deproject_compact(depth, camera),
            {"Open3D": lambda: open3d(True)},
            "Open3D's legacy create_from_depth_image, the same points in the same order",
            compact_agrees,
        ),
    ]
