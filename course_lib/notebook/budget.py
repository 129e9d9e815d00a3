"""The course's running error budget: which errors add up to the error of a surface, and which lesson measures each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Stage:
    """One row of the budget.

    Attributes
    ----------
    key : how lessons name it.
    name : what it is, in the table.
    unit : of the measured value.
    lesson : which lesson measures it.
    """

    key: str
    name: str
    unit: str
    lesson: str


STAGES: tuple[Stage, ...] = (
    Stage("depth_step", "one step of the stored depth", "mm", "01_rgbd_images"),
    Stage("depth_noise", "depth noise of one pixel", "mm", "01_rgbd_images"),
    Stage("frames", "rounding of transforms and files", "mm", "02_point_clouds"),
    Stage("intrinsics", "pixel centres half a pixel off", "px", "03_depth_to_points"),
    Stage("downsampling", "voxel grid", "mm", "04_downsampling"),
    Stage("outliers", "outliers left in", "%", "05_outliers"),
    Stage("plane", "tilt of a plane fitted to a table", "deg", "06_planes"),
    Stage("registration", "registration of two views", "mm", "07_icp"),
    Stage("drift", "drift of odometry", "%", "10_rgbd_odometry"),
    Stage("calibration", "calibration", "px", "11_d455_calibration"),
    Stage("matching", "pixel error of stereo matching", "px", "14_sensing_depth"),
    Stage("surface", "fused surface, everything together", "mm", "13_many_views"),
)
"""In the order in which errors arise: pixels, depth, registration, surface."""

EFFECT = "effect on the surface at 1.5 m (mm)"
