"""Every algorithm over clouds, on every kind of cloud that breaks algorithms: a finite answer, or one sentence.

What the right answer *is* stands in the tests of each topic. Here nothing may crash, warn, hang, or answer with NaN.
"""

from __future__ import annotations

import array
import dataclasses
import warnings
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

from course_lib.camera import pinhole
from course_lib.cloud import clusters, downsample, floors, neighbours, normals, outliers, planes, pointcloud
from course_lib.geometry import transforms
from course_lib.registration import icp

RNG = np.random.default_rng(4)
SOLID = RNG.normal(size=(60, 3))
CLOUDS = {
    "no points": np.zeros((0, 3)),
    "one point": SOLID[:1],
    "two points": SOLID[:2],
    "three points": SOLID[:3],
    "all equal": np.tile(SOLID[:1], (40, 1)),
    "collinear": np.outer(np.linspace(-1, 1, 50), [1.0, 2.0, -0.5]) + 0.3,
    "collinear, far": np.outer(np.linspace(-1, 1, 50), [1.0, 2.0, -0.5]) + 1e6,
    "coplanar": np.c_[RNG.uniform(-1, 1, (60, 2)), np.full(60, 0.7)],
    "one NaN": np.vstack([SOLID, [[np.nan, 0, 0]]]),
    "one infinity": np.vstack([SOLID, [[0, -np.inf, 0]]]),
    "duplicates": np.repeat(SOLID[:20], 3, axis=0),
    "coordinates of a map": SOLID + 1e6,
    "float32": SOLID.astype(np.float32),
    "float32, of a map": (SOLID + 1e6).astype(np.float32),
    "tiny": SOLID * 1e-9,
    "whole numbers": np.round(SOLID * 10).astype(int),
    "a list": SOLID.tolist(),
    "a huge and a small part": np.vstack([SOLID * 1e-6, SOLID[:5] * 1e6]),
}
ALGORITHMS: dict[str, Callable[[Any], Any]] = {
    "nearest": lambda points: neighbours.Neighbours(points).nearest(points),
    "voxel_grid": lambda points: downsample.voxel_grid(points, 0.2),
    "voxel_downsample": lambda points: downsample.voxel_downsample(points, 0.2),
    "sample_random": lambda points: downsample.sample_random(points, 2, 0),
    "sample_uniform": lambda points: downsample.sample_uniform(points, 2),
    "sample_farthest": lambda points: downsample.sample_farthest(points, 2),
    "estimate_normals": normals.estimate_normals,
    "fit_surfels": normals.fit_surfels,
    "keep_by_statistics": outliers.keep_by_statistics,
    "keep_by_radius": lambda points: outliers.keep_by_radius(points, 0.3),
    "euclidean_clusters": lambda points: clusters.euclidean_clusters(points, 0.3),
    "fit_plane": planes.fit_plane,
    "find_plane": lambda points: planes.find_plane(points, 0.02),
    "find_planes": lambda points: list(planes.find_planes(points, 0.02, least=3)),
    "find_floor": lambda points: floors.find_floor(points, 0.02),
    "fit_rigid": lambda points: icp.fit_rigid(points, points),
    "icp to points": lambda points: icp.icp(points, points, 1.0),
    "icp to planes": lambda points: icp.icp(
        points, points, 1.0, normals=np.tile([0, 0, 1.0], (len(points), 1)), steps=5
    ),
    "icp, no overlap": lambda points: icp.icp(points, np.asarray(points, float) + 1e4, 1.0),
    "icp, no normals": lambda points: icp.icp(points, points, 1.0, normals=np.full((len(points), 3), np.nan)),
}


@pytest.mark.parametrize("cloud", sorted(CLOUDS))
@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_a_right_answer_or_one_sentence(name, cloud):
    given = CLOUDS[cloud]
    before = np.array(given, copy=True)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            answer = ALGORITHMS[name](given)
    except ValueError as error:
        said = str(error)
        assert said.endswith((".", "?")) and "\n" not in said and 20 < len(said) < 250, said
        assert "could not" not in said and "array at index" not in said, f"not a sentence of ours: {said}"
    else:
        assert "NaN" not in cloud and "infinity" not in cloud, "a cloud that holds no number was taken"
        for array in arrays(answer):
            if name not in ("estimate_normals", "fit_surfels", "nearest"):  # there NaN or infinity says: none
                assert np.isfinite(array).all()
    np.testing.assert_array_equal(np.array(given), before, err_msg="the input was changed")


@pytest.mark.parametrize("name", sorted(ALGORITHMS))
def test_an_ordinary_cloud_gets_an_answer(name):
    """So that no algorithm passes above by refusing everything."""
    room = np.vstack([np.c_[RNG.uniform(0, 2, (900, 2)), np.zeros(900)], RNG.uniform(0, 2, (100, 3))])
    if name in ("icp, no overlap", "icp, no normals"):
        with pytest.raises(ValueError):
            ALGORITHMS[name](room)
    else:
        assert list(arrays(ALGORITHMS[name](room)))


def arrays(answer: Any) -> Iterable[np.ndarray]:
    """The numbers of an answer, whatever it is made of."""
    if isinstance(answer, np.ndarray):
        yield answer
    elif isinstance(answer, bool | int | float):
        yield np.asarray(answer)
    elif hasattr(answer, "__dataclass_fields__"):
        for name in answer.__dataclass_fields__:
            yield from arrays(getattr(answer, name))
    elif isinstance(answer, Iterable) and not isinstance(answer, str):
        for part in answer:
            yield from arrays(part)


def test_a_cloud_where_points_are_wanted_and_none_for_a_pose():
    cloud = pointcloud.PointCloud(np.ones((5, 3)))
    with pytest.raises(ValueError, match="points: expected real numbers, got PointCloud; give its .points."):
        downsample.voxel_downsample(cloud, 0.1)
    with pytest.raises(ValueError, match="points: expected real numbers, got PointCloud; give its .points."):
        transforms.apply(np.eye(4), cloud)
    with pytest.raises(ValueError, match="T: expected real numbers, got NoneType; give a numeric array."):
        transforms.apply(None, cloud.points)


def test_floats_that_are_millimetres_are_refused_at_any_fraction():
    depth = np.full((48, 64), 1600.0) * 0.9997
    with pytest.raises(ValueError, match="depth: a median of 1599.52 looks like millimetres"):
        pinhole.deproject(depth, pinhole.PinholeCamera(64, 48, 50, 50, 31.5, 23.5))


def test_a_message_whose_data_is_a_list_is_refused_in_one_sentence():
    message = pointcloud.to_message(np.zeros(3, pointcloud.point_type("PointXYZ")))
    listed = dataclasses.replace(message, data=list(message.data))
    with pytest.raises(ValueError, match="message: data is a list; give bytes, as bytes.data. makes of a list."):
        pointcloud.message_to_xyz(listed)
    as_ros2 = dataclasses.replace(message, data=array.array("B", message.data))
    assert pointcloud.message_to_xyz(as_ros2).shape == (3, 3)
