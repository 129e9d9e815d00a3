"""Where points land in a picture: the same for both renderers, true to scale, the right way up."""

import numpy as np
import pytest
from show_things import box_cloud, wall_cloud

from course_lib.camera import pinhole
from course_lib.notebook._views import VIEWS, guess_frame, layout, look


def seen(name, points, frame, **how):
    view = layout([look(name, points, frame, **how)], [points], 600)[0]
    return view, view.project(points)[0]


def test_every_parallel_view_is_a_right_handed_frame_that_shows_everything():
    points = box_cloud().points
    for frame in ("camera", "world", "object"):
        for name in set(VIEWS) - {"camera"}:
            view, pixels = seen(name, points, frame)
            np.testing.assert_allclose(np.cross(view.right, view.up), -view.forward, atol=1e-12)
            assert (pixels > 0).all() and (pixels < [view.width, view.height]).all(), (frame, name)


def test_equal_axes_and_a_true_scale():
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 0, 1), (0, 1, 0)], dtype=float)
    view, pixels = seen("front", points, "world")
    assert np.linalg.norm(pixels[1] - pixels[0]) == pytest.approx(view.pixels_per_metre)
    assert np.linalg.norm(pixels[2] - pixels[0]) == pytest.approx(view.pixels_per_metre)


@pytest.mark.parametrize(
    ("frame", "name", "right", "up"),
    [
        ("camera", "front", (1, 0, 0), (0, -1, 0)),
        ("camera", "back", (-1, 0, 0), (0, -1, 0)),
        ("camera", "side", (0, 0, 1), (0, -1, 0)),
        ("camera", "top", (1, 0, 0), (0, 0, 1)),
        ("world", "front", (1, 0, 0), (0, 0, 1)),
        ("world", "side", (0, 1, 0), (0, 0, 1)),
        ("world", "top", (1, 0, 0), (0, 1, 0)),
        ("object", "front", (1, 0, 0), (0, 1, 0)),
        ("object", "side", (0, 0, -1), (0, 1, 0)),
    ],
)
def test_what_is_right_and_up_in_each_view(frame, name, right, up):
    view = look(name, box_cloud().points, frame)
    np.testing.assert_allclose(view.right, right, atol=1e-12)
    np.testing.assert_allclose(view.up, up, atol=1e-12)


def test_the_sensors_view_agrees_with_the_pinhole_model():
    camera = pinhole.PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
    rng = np.random.default_rng(3)
    points = rng.uniform((-0.5, -0.4, 1), (0.5, 0.4, 3), size=(50, 3))
    view, pixels = seen("camera", points, "camera")
    expected = pinhole.project(points, camera)
    expected = expected[..., :2] if isinstance(expected, np.ndarray) else np.stack(expected[:2], axis=-1)
    ours = (pixels - [view.width / 2, view.height / 2]) / (view.height / 2 / view.scale)
    np.testing.assert_allclose(ours, (expected - [319.5, 239.5]) / 525.0, atol=1e-9)


def test_a_pose_as_a_view_is_the_same_as_moving_the_points():
    points = wall_cloud().points
    pose = np.eye(4)
    pose[:3, 3] = (0.1, 0.2, -0.5)
    moved = points + pose[:3, 3]
    _, from_pose = seen(pose, moved, "world")
    _, from_sensor = seen("camera", points, "camera")
    np.testing.assert_allclose(from_pose, from_sensor, atol=1e-6)


def test_views_of_one_picture_share_their_scale():
    points = box_cloud().points
    views = layout([look(name, points, "world") for name in ("front", "side", "top")], [points] * 3, 300)
    assert len({view.scale for view in views}) == 1
    assert len({(view.width, view.height) for view in views}) == 1


def test_one_point_alone_can_be_looked_at():
    view, pixels = seen("front", np.array([[1.0, 2.0, 3.0]]), "world")
    np.testing.assert_allclose(pixels[0], [view.width / 2, view.height / 2])


def test_the_frame_is_guessed_from_what_one_sensor_can_see():
    assert guess_frame(wall_cloud().points) == "camera"
    assert guess_frame(box_cloud().points) == "world"
    beside = wall_cloud().points + [5, 0, 0]
    assert guess_frame(beside) == "world"
    room = np.random.default_rng(0).uniform((-2, -2, 0.15), (2, 2, 2.5), size=(500, 3))
    assert guess_frame(room) == "world"
