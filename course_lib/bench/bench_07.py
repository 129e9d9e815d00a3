"""Benchmarks of lesson 07: ICP, against Open3D's and small_gicp's C++ on the same points.

Open3D's clouds are made before timing, and small_gicp's target with its normals; its source and its tree are built in
the timed part, as ours are.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import open3d as o3d
import small_gicp

from course_lib.bench import inputs
from course_lib.bench.compare import Case
from course_lib.bench.scaling import EXPONENT, Scaling
from course_lib.compiled import threads
from course_lib.geometry import transforms
from course_lib.registration import icp

STEPS = 20
REACH = 0.5  # metres, pairs farther apart do not count
TURN_DEGREES, SHIFT = 3.0, 0.07  # between the two clouds
PER_AREA = 125.0  # 50,000 on 20 x 20 m


def _two_clouds(n: int, per_area: float | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Source, target and the target's normals: two independent samples of the surface, turned and shifted.

    At a given density a larger field is turned by less, so that its corners are as many spacings off as those of the
    50,000 points: else a larger field is a harder problem, in which a third of a million points have no partner within
    reach.
    """
    target, other = inputs.field(n, 1, per_area), inputs.field(n, 2, per_area)
    middle = target.mean(axis=0)
    smaller = 1.0 if per_area is None else inputs.SIDE / np.sqrt(n / per_area)
    turn = transforms.rotation_z(np.radians(TURN_DEGREES * smaller))
    shifted = transforms.apply(turn, other - middle) + middle + np.array([SHIFT, 0, 0])
    return shifted, target, inputs.slope_normals(target)


def _icp(to_planes: bool) -> Case:
    source, target, normals = _two_clouds(50_000)
    cloud, model = (inputs.open3d_cloud(each) for each in (source, target))
    model.normals = o3d.utility.Vector3dVector(normals)
    module = o3d.pipelines.registration
    way = module.TransformationEstimationPointToPlane if to_planes else module.TransformationEstimationPointToPoint
    never = module.ICPConvergenceCriteria(-1.0, -1.0, STEPS)
    other = small_gicp.PointCloud(target)
    small_gicp.estimate_normals(other, num_threads=threads())

    def ours() -> icp.IcpResult:
        return icp.icp(source, target, REACH, normals if to_planes else None, steps=STEPS, tolerance=0.0)

    def of_open3d() -> np.ndarray:
        return module.registration_icp(cloud, model, REACH, np.eye(4), way(), never).transformation

    def of_small_gicp() -> np.ndarray:
        return small_gicp.align(
            other,
            small_gicp.PointCloud(source),
            small_gicp.KdTree(other, num_threads=threads()),
            registration_type="PLANE_ICP" if to_planes else "ICP",
            max_correspondence_distance=REACH,
            num_threads=threads(),
            max_iterations=STEPS,
            rotation_epsilon=0.0,
            translation_epsilon=0.0,
        ).T_target_source

    def agree() -> None:
        result = ours()
        assert len(result.steps) == STEPS
        middle = source.mean(axis=0, keepdims=True)
        # small_gicp estimates normals of its own, and damps its steps
        for T, degrees, metres in ((of_open3d(), 1e-3, 1e-4), (of_small_gicp(), 0.02, 5e-3)):
            turned = transforms.pose_error(result.T_target_source, T).degrees
            moved = np.linalg.norm(transforms.apply(result.T_target_source, middle) - transforms.apply(T, middle))
            assert turned <= degrees and moved <= metres, f"{turned} degrees, {1000 * moved} mm apart"

    name = "to plane" if to_planes else "to point"
    return Case(
        f"ICP, 50k on 50k points, {STEPS} steps, point {name}",
        (0.9, 0.5),
        ours,
        {"Open3D": of_open3d, "small_gicp": of_small_gicp},
        "Open3D's legacy registration_icp, the same steps and pose (0.001 degrees, 0.1 mm); small_gicp's, as many",
        agree,
    )


def cases() -> list[Case]:
    return [_icp(False), _icp(True)]


def scalings() -> list[Scaling]:
    def job(to_planes: bool, n: int) -> Callable[[], icp.IcpResult]:
        source, target, normals = _two_clouds(n, PER_AREA)
        return partial(icp.icp, source, target, REACH, normals if to_planes else None, steps=5, tolerance=0.0)

    return [
        Scaling("ICP to points, 5 steps", EXPONENT, partial(job, False)),
        Scaling("ICP to planes, 5 steps", EXPONENT, partial(job, True)),
    ]
