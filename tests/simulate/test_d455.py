from __future__ import annotations

import numpy as np
import pytest

from course_lib.camera.pinhole import preset
from course_lib.simulate import d455

CAMERA = preset("d455_depth_848x480")


def wall(z: float) -> np.ndarray:
    return np.full((480, 848), z, np.float32)


def relative_rms(z: float, seed: int = 0) -> float:
    measured = d455.measure(wall(z), CAMERA, np.random.default_rng(seed)).depth
    error = measured[measured > 0] - z
    return float(np.sqrt(np.mean(error.astype(float) ** 2)) / z)


def test_a_wall_at_4_m_has_the_noise_that_the_data_sheet_allows():
    assert relative_rms(4.0) == pytest.approx(0.0076, abs=0.0003)


def test_noise_grows_with_the_square_of_depth():
    assert relative_rms(4.0) * 4 / (relative_rms(2.0) * 2) == pytest.approx(4.0, rel=0.08)
    assert relative_rms(4.0) == pytest.approx(d455.depth_sigma(4.0, CAMERA) / 4.0, rel=0.03)


def test_noise_of_neighbours_is_alike_and_of_far_pixels_is_not():
    disparity = CAMERA.fx * d455.BASELINE / d455.measure(wall(2.0), CAMERA, np.random.default_rng(1)).depth[:, 100:]
    noise = disparity - disparity.mean()
    near = np.mean(noise[:, 1:] * noise[:, :-1]) / noise.var()
    far = np.mean(noise[:, 5:] * noise[:, :-5]) / noise.var()
    assert 0.3 < near < 0.8 and abs(far) < 0.02


def test_depth_is_in_whole_millimetres_and_disparity_in_steps():
    measured = d455.measure(wall(3.0), CAMERA, np.random.default_rng(2))
    assert measured.raw().dtype == np.uint16
    assert np.array_equal(measured.raw() / 1000.0, measured.depth.astype(float).round(6))
    step = CAMERA.fx * d455.BASELINE / measured.depth[measured.depth > 0] / d455.STEP
    assert np.abs(step - np.rint(step)).max() < 0.35  # millimetres blur the steps a little at 3 m


def test_the_nearest_depth_is_that_of_126_pixels():
    assert d455.min_depth(CAMERA) == pytest.approx(CAMERA.fx * 0.095 / 126)
    wide = preset("d455_depth_1280x720")
    assert d455.min_depth(wide) == pytest.approx(0.51, abs=0.01)
    near = np.full((720, 1280), 0.47, np.float32)
    assert not d455.measure(near, wide, np.random.default_rng(0)).depth.any()
    assert d455.measure(near + 0.1, wide, np.random.default_rng(0)).depth.any()


def test_nothing_outside_the_range_and_nothing_from_nothing():
    assert not d455.measure(wall(0.38), CAMERA, np.random.default_rng(0)).depth.any()
    assert not d455.measure(wall(7.0), CAMERA, np.random.default_rng(0)).depth.any()
    measured = d455.measure(wall(0.0), CAMERA, np.random.default_rng(0))
    assert not measured.depth.any() and (measured.artefacts == d455.NOTHING).all()


@pytest.fixture(scope="module")
def post():
    """A near post in columns 400–499 before a far wall, and its measurement."""
    true = wall(3.0)
    true[:, 400:500] = 1.0
    return true, d455.measure(true, CAMERA, np.random.default_rng(3))


def test_the_shadow_lies_left_of_a_near_thing_and_is_as_wide_as_geometry_says(post):
    _, measured = post
    focal_baseline = CAMERA.fx * d455.BASELINE
    width = focal_baseline / 1.0 - focal_baseline / 3.0  # difference of disparities, pixels
    hidden = (measured.artefacts == d455.HIDDEN).mean(axis=0)
    assert hidden[int(400 - width) + 2 : 400].min() == 1.0
    assert not hidden[: int(400 - width) - 2].any() and not hidden[400:].any()
    assert not measured.depth[:, int(400 - width) + 2 : 400].any()


def test_flying_pixels_hang_between_the_two_depths_at_edges_only(post):
    _, measured = post
    flying = measured.artefacts == d455.FLYING
    columns = np.flatnonzero(flying.any(axis=0))
    assert set(columns) <= {399, 400, 499, 500} and 500 in columns
    z = measured.depth[flying]
    assert ((z > 0.97) & (z < 3.2)).all() and ((z > 1.1) & (z < 2.8)).mean() > 0.3


def test_every_pixel_has_one_reason_and_depth_exactly_where_it_says(post):
    _, measured = post
    has_depth = measured.artefacts <= d455.FLYING
    assert np.array_equal(measured.depth > 0, has_depth)
    assert measured.artefacts.max() < len(d455.ARTEFACTS)
    outside = (measured.artefacts == d455.OUTSIDE).any(axis=0)
    assert np.flatnonzero(outside).max() == int(np.ceil(CAMERA.fx * d455.BASELINE / 3.0)) - 1


def test_what_cannot_be_matched_is_a_hole():
    mask = np.zeros((480, 848), bool)
    mask[100:200, 300:400] = True
    measured = d455.measure(wall(2.0), CAMERA, np.random.default_rng(0), unmeasurable=mask)
    assert not measured.depth[mask].any() and (measured.artefacts[mask] == d455.UNMATCHED).all()


def test_the_same_generator_gives_the_same_image():
    first, second = (d455.measure(wall(2.0), CAMERA, np.random.default_rng(5)).depth for _ in range(2))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, d455.measure(wall(2.0), CAMERA, np.random.default_rng(6)).depth)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((np.ones((10, 10), np.float32), CAMERA, np.random.default_rng(0)), "10x10"),
        ((wall(2.0), CAMERA, np.random.default_rng(0), -0.1), "baseline"),
        ((wall(2.0), CAMERA, 7), "default_rng"),
        ((wall(2000.0), CAMERA, np.random.default_rng(0)), "millimetres"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(arguments, words):
    with pytest.raises(ValueError, match=words) as caught:
        d455.measure(*arguments)
    assert "\n" not in str(caught.value)


def test_colour_noise_is_small_and_unbiased():
    color = np.full((200, 200, 3), 120, np.uint8)
    noisy = d455.color_noise(color, np.random.default_rng(0)).astype(float) - 120
    assert noisy.std() == pytest.approx(1.23, abs=0.05) and abs(noisy.mean()) < 0.02
