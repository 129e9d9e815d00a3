"""Benchmarks of lessons 06 and 07: a plane among stray points, and ICP, against Open3D's C++ on the same points."""

from __future__ import annotations

import numpy as np
import open3d as o3d

from course_lib.bench import inputs
from course_lib.bench.compare import Case, Scaling
from course_lib.cloud import planes
from course_lib.geometry import transforms
from course_lib.registration import icp

THRESHOLD = 0.015  # metres, three times the noise
TRIALS = 256
STEPS = 20
REACH = 0.5  # metres, pairs farther apart do not count
TURN_DEGREES, SHIFT = 3.0, 0.07  # between the two clouds
EXPONENT = 1.25
PER_AREA = 125.0  # 50,000 on 20 x 20 m


def _plane() -> list[Case]:
    points = inputs.plane_among_points(200_000, 7)
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    tensor = o3d.t.geometry.PointCloud(o3d.core.Tensor(points.astype(np.float32)))

    def of_legacy() -> tuple:
        o3d.utility.random.seed(3)
        return legacy.segment_plane(THRESHOLD, 3, TRIALS)

    def of_tensor() -> tuple:
        o3d.utility.random.seed(3)
        return tensor.segment_plane(THRESHOLD, 3, TRIALS)

    def agree() -> None:
        ours = int(np.count_nonzero(planes.find_plane(points, THRESHOLD)[1]))
        best = max(len(of_legacy()[1]), len(of_tensor()[1]))
        assert ours >= best, f"{ours} inliers, Open3D found {best}"

    return [
        Case(
            f"plane by RANSAC, 200k points, 60 % inliers, {name}",
            0.5,
            lambda: planes.find_plane(points, THRESHOLD),
            theirs,
            f"Open3D {name} segment_plane({TRIALS} samples); ours has at least the inliers of the better one",
            agree,
        )
        for name, theirs in (("legacy", of_legacy), ("tensor", of_tensor))
    ]


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
    cloud, model = (o3d.geometry.PointCloud(o3d.utility.Vector3dVector(each)) for each in (source, target))
    model.normals = o3d.utility.Vector3dVector(normals)
    module = o3d.pipelines.registration
    way = module.TransformationEstimationPointToPlane if to_planes else module.TransformationEstimationPointToPoint
    never = module.ICPConvergenceCriteria(-1.0, -1.0, STEPS)

    def ours() -> icp.IcpResult:
        return icp.icp(source, target, REACH, normals if to_planes else None, steps=STEPS, tolerance=0.0)

    def theirs():
        return module.registration_icp(cloud, model, REACH, np.eye(4), way(), never)

    def agree() -> None:
        result = ours()
        assert len(result.steps) == STEPS
        other = np.array(theirs().transformation)
        turned = transforms.pose_error(result.T_target_source, other).degrees
        middle = source.mean(axis=0, keepdims=True)
        moved = np.linalg.norm(transforms.apply(result.T_target_source, middle) - transforms.apply(other, middle))
        assert turned <= 1e-3 and moved <= 1e-4, f"{turned} degrees, {1000 * moved} mm apart"

    name = "to plane" if to_planes else "to point"
    return Case(
        f"ICP, 50k on 50k points, {STEPS} steps, point {name}",
        1.7 if to_planes else 1.3,
        ours,
        theirs,
        "Open3D legacy registration_icp, the same steps; final poses within 0.001 degrees and 0.1 mm",
        agree,
    )


def cases() -> list[Case]:
    """Return the benchmark's cases."""
    return [*_plane(), _icp(False), _icp(True)]


def scalings() -> list[Scaling]:
    """Return how each grows, at the density of its case."""

    def plane(n: int):
        points = inputs.plane_among_points(n, 7)
        return lambda: planes.find_plane(points, THRESHOLD)

    def moving(to_planes: bool):
        def make(n: int):
            source, target, normals = _two_clouds(n, PER_AREA)
            given = normals if to_planes else None
            return lambda: icp.icp(source, target, REACH, given, steps=5, tolerance=0.0)

        return make

    return [
        Scaling("plane by RANSAC", EXPONENT, plane),
        Scaling("ICP to points, 5 steps", EXPONENT, moving(False)),
        Scaling("ICP to planes, 5 steps", EXPONENT, moving(True)),
    ]
