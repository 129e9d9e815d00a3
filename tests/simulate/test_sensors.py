from __future__ import annotations

import numpy as np
import pytest
from walls import grey, upright_wall

from course_lib.camera.pinhole import PinholeCamera, preset
from course_lib.geometry.transforms import look_at
from course_lib.simulate import sensors, shapes
from course_lib.simulate.scenes import Scene, Surface

FORWARD = look_at((0, 0, 0), (0, 1, 0))
CAMERA = preset("d455_depth_424x240")


@pytest.fixture(scope="module")
def hall() -> Scene:
    """A box of 6 x 4 x 3 m seen from inside, the sensor's place at its middle."""
    T = np.eye(4)
    T[2, 3] = -1.5
    faces = [patch.moved(T) for patch in shapes.box((6, 4, 3)).values()]
    return Scene([Surface("hall", patch, grey()) for patch in faces])


def test_laser_points_lie_on_the_walls_of_the_hall(hall):
    scan = sensors.laser_scan(hall, np.eye(4), np.radians([-15, 0, 15]), 360)
    beyond = np.abs(scan.points) / (3, 2, 1.5)
    assert np.abs(beyond.max(axis=1) - 1).max() < 1e-5
    assert len(scan.points) == 3 * 360 and set(scan.rings) == {0, 1, 2}
    assert np.allclose(np.linalg.norm(scan.points, axis=1), scan.ranges)
    ahead = scan.points[(scan.rings == 1) & (scan.azimuths == 0)]
    assert np.allclose(ahead, [[3, 0, 0]], atol=1e-5)  # x is forward


def test_laser_noise_is_along_the_beam(hall):
    clean = sensors.laser_scan(hall, np.eye(4), [0.1], 2000)
    noisy = sensors.laser_scan(hall, np.eye(4), [0.1], 2000, rng=np.random.default_rng(0), sigma=0.02)
    assert (noisy.ranges - clean.ranges).std() == pytest.approx(0.02, rel=0.1)
    assert np.allclose(np.cross(noisy.points, clean.points), 0, atol=1e-6)


def test_laser_refuses_no_beams_and_empty_space(hall):
    with pytest.raises(ValueError, match="elevations"):
        sensors.laser_scan(hall, np.eye(4), [])
    with pytest.raises(ValueError, match="nothing within"):
        sensors.laser_scan(hall, np.eye(4), [0.0], max_range=0.5)


def test_stripes_on_a_wall_shift_by_the_disparity_between_projector_and_camera():
    projector, base = PinholeCamera(640, 480, 400.0, 400.0, 319.5, 239.5), 0.2
    T_lamp = FORWARD.copy()
    T_lamp[:3, 3] += base * FORWARD[:3, 0]
    for z in (1.0, 2.0):
        scene = Scene([upright_wall(z)])
        pattern = sensors.stripes(640, 480, 32)
        view = sensors.structured_light(scene, CAMERA, FORWARD, projector, T_lamp, pattern)
        v, u = 120, 212
        x = (u - CAMERA.cx) / CAMERA.fx * z
        assert view.projector_uv[v, u, 0] == pytest.approx(319.5 + 400 * (x - base) / z, abs=1e-3)
        bright = view.image[v, :, 1].astype(float)
        lit = np.isfinite(view.projector_uv[v, :, 0])
        expected = pattern[0][np.rint(view.projector_uv[v, lit, 0]).astype(int)]
        assert np.corrcoef(bright[lit], expected)[0, 1] > 0.9


def test_a_near_thing_throws_a_shadow(sphere_and_wall):
    projector = PinholeCamera(640, 480, 400.0, 400.0, 319.5, 239.5)
    T_lamp = FORWARD.copy()
    T_lamp[:3, 3] += 0.3 * FORWARD[:3, 0]
    pattern = np.ones((480, 640), np.float32)
    view = sensors.structured_light(sphere_and_wall, CAMERA, FORWARD, projector, T_lamp, pattern)
    dark = ~np.isfinite(view.projector_uv[120, :, 0])
    ball = int(CAMERA.cx + CAMERA.fx * 0.1 / 2.0)
    assert not dark[ball] and dark[ball - 80 : ball].any()  # the lamp is on the right: the shadow falls to the left


def test_structured_light_refuses_a_pattern_of_another_size():
    with pytest.raises(ValueError, match="pattern"):
        sensors.structured_light(Scene([upright_wall(2.0)]), CAMERA, FORWARD, CAMERA, FORWARD, np.ones((3, 3)))


@pytest.mark.slow
def test_stereo_disparity_moves_the_picture_of_the_wall(desk_scene):
    pair = sensors.stereo_pair(desk_scene, CAMERA, desk_scene.views["first"], 0.05)
    visible = (pair.disparity > 0) & ~pair.occluded
    v, u = np.nonzero(visible)
    partner = np.rint(u - pair.disparity[visible]).astype(int)
    keep = partner >= 0
    left = pair.left.color[v[keep], u[keep]].astype(float)
    right = pair.right.color[v[keep], partner[keep]].astype(float)
    assert np.median(np.abs(left - right)) < 4
    same = np.abs(pair.right.depth[v[keep], partner[keep]] - pair.left.depth[v[keep], u[keep]])
    assert np.median(same) < 0.005
    assert pair.occluded.any() and pair.occluded.mean() < 0.3
    z = pair.left.depth[visible]
    assert np.allclose(pair.disparity[visible] * z, CAMERA.fx * 0.05, rtol=1e-5)


def test_stereo_occlusion_is_left_of_the_near_ball(sphere_and_wall):
    pair = sensors.stereo_pair(sphere_and_wall, CAMERA, FORWARD, 0.2)
    row = pair.occluded[120]
    row[: int(CAMERA.fx * 0.2 / 4) + 2] = False  # the band outside the second image
    columns = np.flatnonzero(row)
    left_rim = CAMERA.cx + CAMERA.fx * (0.1 - 0.5) / 2.0
    assert len(columns) and columns.max() < left_rim + 3


def test_stereo_refuses_a_baseline_of_zero_and_distortion(sphere_and_wall):
    with pytest.raises(ValueError, match="baseline"):
        sensors.stereo_pair(sphere_and_wall, CAMERA, FORWARD, 0.0)
    bent = PinholeCamera(320, 240, 250.0, 250.0, 159.5, 119.5, distortion=(-0.1, 0, 0, 0, 0))
    with pytest.raises(ValueError, match="distortion"):
        sensors.stereo_pair(sphere_and_wall, bent, FORWARD, 0.1)


def test_infrared_dots_repeat_for_a_seed_and_give_texture_to_a_bare_wall():
    scene = Scene([upright_wall(1.5)])
    first, second = (sensors.infrared_dots(scene, CAMERA, FORWARD, np.random.default_rng(1)) for _ in range(2))
    assert first.shape == (240, 424) and first.dtype == np.uint8 and np.array_equal(first, second)
    assert first.std() > 15
