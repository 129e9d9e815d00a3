from __future__ import annotations

import numpy as np
import pytest
from walls import upright_wall

from course_lib.camera.pinhole import PinholeCamera, deproject, preset, project
from course_lib.geometry.transforms import apply, look_at
from course_lib.simulate import camera as virtual
from course_lib.simulate.scenes import Scene

FORWARD = look_at((0, 0, 0), (0, 1, 0))
CAMERA = preset("d455_depth_640x480")
SKEWED = PinholeCamera(320, 240, 250.0, 262.0, 151.3, 126.8)
BENT = PinholeCamera(320, 240, 250.0, 250.0, 159.5, 119.5, distortion=(-0.12, 0.05, 0.001, -0.002, 0.0))


def distance_to_truth(points: np.ndarray) -> np.ndarray:
    """Distance (m) of world points to the wall y = 4 or to the sphere of the fixture, whichever is nearer."""
    wall = np.abs(points[:, 1] - 4.0)
    ball = np.abs(np.linalg.norm(points - (0.1, 2.0, 0.0), axis=1) - 0.5)
    return np.minimum(wall, ball)


@pytest.mark.slow
@pytest.mark.parametrize("camera", [CAMERA, SKEWED, BENT], ids=["d455", "off-centre", "distorted"])
@pytest.mark.parametrize("turn", [FORWARD, look_at((0.4, -0.2, 0.3), (0.2, 2, -0.1))], ids=["straight", "slanted"])
def test_deprojected_depth_lies_on_the_true_surface(sphere_and_wall, camera, turn):
    frame = virtual.render(sphere_and_wall, camera, turn)
    points = apply(turn, deproject(frame.depth, camera, dtype=np.float64)[frame.depth > 0])
    error = distance_to_truth(points)
    assert error.mean() < 1e-5  # 0.01 mm
    assert len(points) > 0.5 * camera.width * camera.height


@pytest.mark.slow
def test_half_a_pixel_would_be_seen(sphere_and_wall):
    turn = look_at((0.4, -0.2, 0.3), (0.2, 2, -0.1))
    frame = virtual.render(sphere_and_wall, CAMERA, turn)
    wrong = PinholeCamera(640, 480, CAMERA.fx, CAMERA.fy, CAMERA.cx + 0.5, CAMERA.cy + 0.5)
    points = apply(turn, deproject(frame.depth, wrong, dtype=np.float64)[frame.depth > 0])
    assert distance_to_truth(points).mean() > 3e-4


def test_depth_is_z_and_not_range():
    frame = virtual.render(Scene([upright_wall(2.0, half=5.0)]), CAMERA, FORWARD)
    assert np.abs(frame.depth - 2.0).max() < 1e-6


def test_a_picture_appears_where_projection_says_and_upright():
    picture = np.zeros((400, 400, 3), np.uint8)
    picture[:200, :200] = (255, 0, 0)  # top left, as seen from the front
    picture[300:, 300:] = (0, 255, 0)
    scene = Scene([upright_wall(2.0, half=1.0, picture=picture)])
    frame = virtual.render(scene, CAMERA, FORWARD)
    u, v = project(np.array([-0.5, -0.5, 2.0]), CAMERA).round().astype(int)  # camera y is down: the upper left
    assert frame.color[v, u].tolist() == [255, 0, 0]
    u, v = project(np.array([0.75, 0.75, 2.0]), CAMERA).round().astype(int)
    assert frame.color[v, u].tolist() == [0, 255, 0]
    assert frame.color[0, 0].tolist() == [0, 0, 0] and frame.depth[0, 0] == 0  # beside the wall there is nothing
    edge = frame.color[CAMERA.height // 4, :, 0]  # the red quarter ends on the axis, between columns 319 and 320
    assert edge[318] > 200 and edge[321] < 60


def test_labels_name_what_each_pixel_sees(sphere_and_wall):
    frame, labels = virtual.render_labelled(sphere_and_wall, CAMERA, FORWARD)
    assert labels.dtype == np.uint8 and labels.shape == frame.depth.shape
    assert sphere_and_wall.label_names == ("nothing", "wall", "ball")
    ball = labels == sphere_and_wall.label("ball")
    assert 0 < ball.mean() < 0.3
    assert frame.depth[ball].max() < 2.01 and frame.depth[labels == sphere_and_wall.label("wall")].min() > 3.99
    assert labels[240, 340] == sphere_and_wall.label("ball")


@pytest.mark.slow
def test_light_makes_shadow_and_falls_off(desk_scene):
    colors = virtual.render(desk_scene, preset("d455_depth_424x240"), desk_scene.views["first"]).color
    spread = colors.reshape(-1, 3).astype(float).std(axis=0)
    assert (spread > 30).all()  # neither flat nor washed out
    assert (colors == 255).all(axis=2).mean() < 0.02 and (colors < 8).all(axis=2).mean() < 0.05


def test_a_camera_that_sees_nothing_is_told_so(sphere_and_wall):
    with pytest.raises(ValueError, match="sees nothing") as caught:
        virtual.render(sphere_and_wall, CAMERA, look_at((0, 5, 0), (0, 9, 0)))
    assert "\n" not in str(caught.value)


def test_a_pose_that_is_not_rigid_is_refused(sphere_and_wall):
    with pytest.raises(ValueError):
        virtual.render(sphere_and_wall, CAMERA, 2 * np.eye(4))


def test_no_surface_and_unknown_names_are_refused(sphere_and_wall):
    with pytest.raises(ValueError, match="at least one surface"):
        Scene([])
    with pytest.raises(ValueError, match="no object 'bal'"):
        sphere_and_wall.mesh("bal")
    with pytest.raises(ValueError, match="uint8"):
        upright_wall(1.0, picture=np.zeros((4, 4, 3)))
