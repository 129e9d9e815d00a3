"""Depth moved to the pixels of another camera, against what that camera truly sees."""

import numpy as np
import pytest

from course_lib.camera.depth_alignment import align_depth
from course_lib.camera.pinhole import PinholeCamera, pixel_rays
from course_lib.geometry.transforms import compose, from_rotation_translation, invert, look_at, rotation_x, rotation_y
from course_lib.simulate import camera as virtual
from course_lib.simulate import shapes
from course_lib.simulate.scenes import Scene, Surface

DEPTH_CAMERA = PinholeCamera(212, 120, 106.0, 106.0, 105.5, 59.5)
COLOR_CAMERA = PinholeCamera(320, 180, 158.0, 158.0, 160.2, 88.7)
ASIDE = from_rotation_translation(np.eye(3), (0.059, 0.001, 0.0))
T_COLOR_DEPTH = compose(rotation_y(0.012), rotation_x(-0.004), ASIDE)
GREY = np.full((4, 4, 3), 128, np.uint8)
T_WORLD_DEPTH = look_at((0.1, -1.0, 0.9), (0.1, 0.0, 0.85))


def true_depth(scene: Scene, camera: PinholeCamera, T_world_camera: np.ndarray) -> np.ndarray:
    """(H, W) metres, exact; 0 where nothing is."""
    rays = pixel_rays(camera).reshape(-1, 3) @ T_world_camera[:3, :3].T
    t = virtual.cast(scene, T_world_camera[:3, 3], rays).t.reshape(camera.height, camera.width)
    return np.where(np.isfinite(t), t, 0.0)


def room() -> Scene:
    """A wall that runs away at 45 degrees, a wall across, and a ball 0.9 m before it."""
    slanted = shapes.rectangle((-1.6, 1.2, 1.6), (1.4, 1.4, 0), (0, 0, -1.6))
    across = shapes.rectangle((-0.2, 2.6, 1.8), (2.6, 0, 0), (0, 0, -2.0))
    ball = shapes.sphere(0.25, 64).moved(from_rotation_translation(np.eye(3), (0.35, 0.4, 0.75)))
    return Scene([Surface(name, one, GREY) for name, one in (("a", slanted), ("b", across), ("c", ball))])


@pytest.fixture(scope="module")
def aligned_and_true() -> tuple[np.ndarray, np.ndarray]:
    """Depth measured by the one camera and moved, and what the other camera would measure."""
    scene = room()
    aligned = align_depth(true_depth(scene, DEPTH_CAMERA, T_WORLD_DEPTH), DEPTH_CAMERA, COLOR_CAMERA, T_COLOR_DEPTH)
    return aligned, true_depth(scene, COLOR_CAMERA, T_WORLD_DEPTH @ invert(T_COLOR_DEPTH))


def test_it_is_what_the_colour_camera_sees(aligned_and_true):
    aligned, true = aligned_and_true
    assert aligned.dtype == np.float32 and aligned.shape == (180, 320)
    both = (aligned > 0) & (true > 0)
    error = 1000 * (aligned - true)[both]
    slope = 1000 * np.hypot(*np.gradient(true))[both]  # mm from one colour pixel to the next
    assert abs(np.median(error)) < 0.5
    assert np.percentile(np.abs(error) / np.maximum(slope, 0.1), 90) < 0.75  # half a depth pixel
    assert (np.abs(error) > 100).mean() < 0.01  # rims
    assert both.sum() > 0.98 * (true > 0).sum()


def test_the_other_cameras_number_would_be_wrong():
    """Beside the axis, a turn of 0.7 degrees is more than a centimetre."""
    wall = Scene([Surface("wall", shapes.rectangle((-3, 1.5, 3), (6, 0, 0), (0, 0, -6)), GREY)])
    ahead = look_at((0, 0, 0), (0, 1, 0))
    aligned = align_depth(true_depth(wall, DEPTH_CAMERA, ahead), DEPTH_CAMERA, COLOR_CAMERA, T_COLOR_DEPTH)
    true = true_depth(wall, COLOR_CAMERA, ahead @ invert(T_COLOR_DEPTH))
    seen = aligned > 0
    assert np.abs(aligned - true)[seen].max() < 2e-4  # three quarters of a pixel of the slope that the turn makes
    assert np.abs(1.5 - true)[seen].max() > 0.015


def test_the_near_hides_the_far_and_leaves_a_strip_that_nobody_saw(aligned_and_true):
    aligned, true = aligned_and_true
    ball = (true > 0) & (true < 1.8)
    assert ball.sum() > 2000
    assert (aligned[ball] > 1.9).mean() < 0.01
    row = np.flatnonzero(ball.any(axis=1)).mean().astype(int)
    left, right = np.flatnonzero(ball[row])[[0, -1]]
    # The wall behind, 2.7 m away, moves by f B (1/z_ball - 1/z_wall) = 2 to 3 pixels to the right of the ball's motion.
    assert (aligned[row, left - 12 : left] == 0).sum() in (2, 3, 4)
    assert (aligned[row, right + 2 : right + 12] > 1.9).all()


def test_a_slanted_wall_has_no_cracks(aligned_and_true):
    aligned, true = aligned_and_true
    wall = true > 1.9
    inside = wall & np.roll(wall, 1, 0) & np.roll(wall, -1, 0)
    for step in range(1, 5):
        inside &= np.roll(wall, step, 1) & np.roll(wall, -step, 1)
    inside[:, 75:] = False  # the wall across begins
    assert inside.sum() > 2500 and (aligned[inside] > 0).all()


def test_the_same_camera_changes_nothing():
    depth = np.random.default_rng(0).uniform(0.5, 5, (120, 212)).astype(np.float32)
    depth[::7, ::5] = 0
    depth[3, 3], depth[4, 4] = np.nan, np.inf
    measured = np.isfinite(depth) & (depth > 0)
    same = align_depth(depth, DEPTH_CAMERA, DEPTH_CAMERA, np.eye(4))
    np.testing.assert_array_equal(same[measured], depth[measured])


def test_a_distorted_depth_camera_is_straightened_first():
    bent = PinholeCamera(212, 120, 106.0, 106.0, 105.5, 59.5, distortion=(-0.1, 0.02, 0.001, -0.001, 0.0))
    scene = room()
    aligned = align_depth(true_depth(scene, bent, T_WORLD_DEPTH), bent, COLOR_CAMERA, T_COLOR_DEPTH)
    true = true_depth(scene, COLOR_CAMERA, T_WORLD_DEPTH @ invert(T_COLOR_DEPTH))
    both = (aligned > 0) & (true > 0)
    assert abs(1000 * np.median((aligned - true)[both])) < 0.5 and both.sum() > 0.95 * (true > 0).sum()


def test_nothing_measured_or_nothing_seen_is_nothing():
    depth = np.zeros((120, 212))
    assert not align_depth(depth, DEPTH_CAMERA, COLOR_CAMERA, T_COLOR_DEPTH).any()
    behind = from_rotation_translation(np.eye(3), (0, 0, -5.0))
    assert not align_depth(depth + 2.0, DEPTH_CAMERA, COLOR_CAMERA, behind).any()
    at_the_lens = from_rotation_translation(np.eye(3), (0, 0, -1.999))
    assert not align_depth(depth + 2.0, DEPTH_CAMERA, COLOR_CAMERA, at_the_lens).any()


@pytest.mark.parametrize(
    ("depth", "T", "says"),
    [
        (np.full((120, 212), 1500, np.uint16), np.eye(4), "uint16 values are raw device units, not metres"),
        (np.full((120, 211), 1.5), np.eye(4), "depth is 211x120 but the camera 212x120; use the intrinsics"),
        (np.full((120, 212), 1.5), 2 * np.eye(4), "T_color_depth"),
        (np.full((120, 212), -1.5), np.eye(4), "-1.5 is negative"),
    ],
)
def test_bad_input_gets_one_sentence(depth, T, says):
    with pytest.raises(ValueError, match=says):
        align_depth(depth, DEPTH_CAMERA, COLOR_CAMERA, T)
