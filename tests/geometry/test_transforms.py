"""Rigid transforms: what must hold for every pose (hypothesis), and what is known in the head."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from course_lib.geometry import transforms

coordinate = st.floats(-10, 10, allow_nan=False)
vector = st.tuples(coordinate, coordinate, coordinate).map(np.array)
seeds = st.integers(0, 2**32 - 1)


@st.composite
def twists(draw, largest: float = np.pi):
    """Twists whose rotation angle is below `largest`, with the hard neighbourhoods of 0 and π drawn often."""
    axis = np.random.default_rng(draw(seeds)).normal(size=3)
    angle = draw(
        st.one_of(
            st.floats(0, largest),
            st.floats(-18, -1).map(lambda e: 10.0**e),
            st.floats(-15, -1).map(lambda e: largest - 10.0**e),
        )
    )
    return np.concatenate([draw(vector), axis / np.linalg.norm(axis) * min(angle, largest)])


@st.composite
def poses(draw):
    return transforms.random(np.random.default_rng(draw(seeds)), max_metres=5.0)


@given(twists())
def test_log_undoes_exp(twist):
    T = transforms.exp(twist)
    found = transforms.log(T)
    # At an angle of π − ε the matrix holds ε to 1e-16, so both signs of the axis are equally near below 1e-7.
    if np.pi - np.linalg.norm(twist[3:]) < 1e-7:
        np.testing.assert_allclose(transforms.exp(found), T, rtol=0, atol=1e-12)
    else:
        np.testing.assert_allclose(found, twist, rtol=0, atol=1e-12 * (1 + np.linalg.norm(twist[:3])))


@given(twists())
def test_exp_is_the_matrix_exponential(twist):
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = transforms.hat(twist[3:]), twist[:3]
    np.testing.assert_allclose(transforms.exp(twist), expm(generator), rtol=0, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1e-8, 1e-4, 0.299999, 0.300001, 1.0, 3.0, np.pi - 1e-9, np.pi])
@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (-0.48, 0.6, 0.64)])
def test_log_keeps_every_digit_of_the_angle(axis, angle):
    w = np.array(axis, float) * angle
    found = transforms.log(transforms.exp(np.concatenate([[1.0, -2.0, 3.0], w])))
    assert np.linalg.norm(found[3:]) == pytest.approx(angle, rel=1e-14, abs=1e-300)
    assert min(np.abs(found[3:] - w).max(), np.abs(found[3:] + w).max()) <= 1e-13 * max(angle, 1e-300)


def test_the_screw_of_a_quarter_turn():
    # A quarter turn about z while moving along a circle of radius 1: from the origin to (1, 1, 0).
    T = transforms.exp([np.pi / 2, 0, 0, 0, 0, np.pi / 2])
    np.testing.assert_allclose(T[:3, 3], [1, 1, 0], atol=1e-15)


@given(poses(), poses())
def test_inverse_of_a_chain(T_a_b, T_b_c):
    T_a_c = transforms.compose(T_a_b, T_b_c)
    np.testing.assert_allclose(transforms.compose(T_a_b, transforms.invert(T_a_b)), np.eye(4), atol=1e-14)
    np.testing.assert_allclose(
        transforms.invert(T_a_c), transforms.compose(transforms.invert(T_b_c), transforms.invert(T_a_b)), atol=1e-13
    )
    np.testing.assert_allclose(transforms.invert(T_a_b), np.linalg.inv(T_a_b), atol=1e-13)


@given(poses(), vector, vector)
def test_distances_stay(T, p, q):
    before, after = np.linalg.norm(p - q), np.linalg.norm(transforms.apply(T, p) - transforms.apply(T, q))
    assert after == pytest.approx(before, abs=1e-12)


@given(poses(), poses(), vector)
def test_apply_of_a_chain_is_a_chain_of_applies(A, B, p):
    np.testing.assert_allclose(
        transforms.apply(transforms.compose(A, B), p), transforms.apply(A, transforms.apply(B, p)), atol=1e-12
    )


def test_apply_keeps_shape_type_and_nan():
    points = np.ones((4, 5, 3), np.float32)
    points[1, 2] = np.nan
    moved = transforms.apply(transforms.rotation_x(0.3), points)
    assert moved.shape == points.shape and moved.dtype == np.float32
    assert np.isnan(moved[1, 2]).all() and np.isnan(moved).sum() == 3
    assert transforms.apply(np.eye(4), [[1, 2, 3]]).dtype == np.float64


def test_it_turns_first_and_moves_then():
    T = transforms.from_rotation_translation(transforms.rotation_y(np.radians(30))[:3, :3], [1.0, 0.0, 0.5])
    np.testing.assert_allclose(transforms.apply(T, [0, 0, 1]), [1.5, 0, 0.5 + np.sqrt(0.75)], atol=1e-15)


def test_hat_and_vee():
    w = np.array([0.1, -0.2, 0.3])
    np.testing.assert_array_equal(transforms.vee(transforms.hat(w)), w)
    np.testing.assert_allclose(transforms.hat(w) @ [1, 2, 3], np.cross(w, [1, 2, 3]), atol=1e-16)


@pytest.mark.parametrize(
    "rotation, source, target",
    [
        (transforms.rotation_x, [0, 1, 0], [0, 0, 1]),
        (transforms.rotation_y, [0, 0, 1], [1, 0, 0]),
        (transforms.rotation_z, [1, 0, 0], [0, 1, 0]),
    ],
)
def test_quarter_turns_are_right_handed(rotation, source, target):
    np.testing.assert_allclose(transforms.apply(rotation(np.pi / 2), source), target, atol=1e-15)


@given(poses())
def test_quaternions_agree_with_scipy(T):
    q = transforms.to_quaternion_xyzw(T)
    assert q[3] >= 0
    np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), T[:3, :3], atol=1e-14)
    np.testing.assert_allclose(transforms.from_quaternion_xyzw(q, T[:3, 3]), T, atol=1e-14)
    np.testing.assert_allclose(transforms.from_quaternion_xyzw(-q, T[:3, 3]), T, atol=1e-14)


@pytest.mark.parametrize("diagonal", [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
def test_quaternions_of_half_turns(diagonal):
    T = np.diag([*map(float, diagonal), 1.0])
    np.testing.assert_allclose(transforms.from_quaternion_xyzw(transforms.to_quaternion_xyzw(T)), T, atol=1e-15)


def test_look_at_is_upright_and_looks_there():
    eye, target = np.array([2.0, -1.0, 1.5]), np.array([0.0, 3.0, 0.7])
    T_world_camera = transforms.look_at(eye, target)
    transforms.check_rigid(T_world_camera)
    np.testing.assert_allclose(T_world_camera[:3, 3], eye)
    seen = transforms.apply(transforms.invert(T_world_camera), target)
    np.testing.assert_allclose(seen, [0, 0, np.linalg.norm(target - eye)], atol=1e-14)
    above = transforms.apply(transforms.invert(T_world_camera), target + [0, 0, 0.1])
    assert above[1] < 0 and abs(above[0]) < 1e-14  # up in the world is up in the image: y is down


def test_look_at_along_x_in_the_head():
    T = transforms.look_at([0, 0, 0], [1, 0, 0])
    np.testing.assert_allclose(T[:3, :3], [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-15)


@given(poses(), poses())
def test_pose_error_is_symmetric_and_sees_no_frame_change_on_the_left(A, B):
    forth, back = transforms.pose_error(A, B), transforms.pose_error(B, A)
    assert forth.degrees == pytest.approx(back.degrees, abs=1e-9) and forth.metres == pytest.approx(back.metres)
    assert 0 <= forth.degrees <= 180
    moved = transforms.pose_error(transforms.compose(A, A), transforms.compose(A, B))
    assert moved.degrees == pytest.approx(forth.degrees, abs=1e-6) and moved.metres == pytest.approx(forth.metres)
    assert transforms.pose_error(A, A).metres == 0 and transforms.pose_error(A, A).degrees < 1e-6


@pytest.mark.parametrize("degrees", [1e-10, 1e-6, 0.5, 90, 179.9999999])
def test_pose_error_reads_small_and_large_angles(degrees):
    error = transforms.pose_error(transforms.rotation_y(np.radians(degrees)), np.eye(4))
    assert error.degrees == pytest.approx(degrees, rel=1e-9)


def test_random_keeps_its_limits_and_repeats():
    poses = [transforms.random(np.random.default_rng(s), max_degrees=20, max_metres=0.3) for s in range(200)]
    errors = [transforms.pose_error(T, np.eye(4)) for T in poses]
    assert max(e.degrees for e in errors) <= 20 and max(e.metres for e in errors) <= 0.3
    assert max(e.degrees for e in errors) > 18 and max(e.metres for e in errors) > 0.28
    np.testing.assert_array_equal(poses[7], transforms.random(np.random.default_rng(7), 20, 0.3))


SHEAR = np.eye(4)
SHEAR[0, 1] = 0.01
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
TRANSPOSED = np.eye(4)
TRANSPOSED[3, :3] = 1, 2, 3


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: transforms.check_rigid(SHEAR), "scales or shears"),
        (lambda: transforms.check_rigid(1000 * np.eye(4)), "last row"),
        (lambda: transforms.check_rigid(MIRROR), "reflection"),
        (lambda: transforms.check_rigid(TRANSPOSED), "transposed"),
        (lambda: transforms.check_rigid(np.full((4, 4), np.nan)), "NaN"),
        (lambda: transforms.check_rigid(np.eye(3)), "4x4"),
        (lambda: transforms.check_rigid("T"), "real numbers"),
        (lambda: transforms.check_rigid([[1, 2], [3]]), "different lengths"),
        (lambda: transforms.compose(), "at least one"),
        (lambda: transforms.compose(np.eye(4), SHEAR), "transform 2"),
        (lambda: transforms.invert(SHEAR), "scales or shears"),
        (lambda: transforms.apply(np.eye(4), np.ones((4, 2))), "last axis"),
        (lambda: transforms.apply(np.eye(4), None), "real numbers"),
        (lambda: transforms.from_rotation_translation(2 * np.eye(3), [0, 0, 0]), "scales"),
        (lambda: transforms.from_rotation_translation(np.eye(4), [0, 0, 0]), "3x3"),
        (lambda: transforms.from_rotation_translation(np.eye(3), [0, np.nan, 0]), "finite"),
        (lambda: transforms.hat([1, 2]), "3 numbers"),
        (lambda: transforms.vee(np.eye(3)), "skew"),
        (lambda: transforms.exp([1, 2, 3]), "6 numbers"),
        (lambda: transforms.log(SHEAR), "scales"),
        (lambda: transforms.rotation_x([1, 2]), "one finite number"),
        (lambda: transforms.look_at([0, 0, 0], [0, 0, 0]), "same point"),
        (lambda: transforms.look_at([0, 0, 3], [0, 0, 0]), "parallel to up"),
        (lambda: transforms.pose_error(np.eye(4), MIRROR), "T_true"),
        (lambda: transforms.from_quaternion_xyzw([1, 1, 1, 1]), "length 1"),
        (lambda: transforms.from_quaternion_xyzw([0, 0, 0, 0]), "length 1"),
        (lambda: transforms.random(7), "default_rng"),
        (lambda: transforms.random(np.random.default_rng(0), max_degrees=400), "0 and 180"),
        (lambda: transforms.random(np.random.default_rng(0), max_metres=-1), "negative"),
    ],
)
def test_bad_input_gets_one_sentence(call, words):
    with pytest.raises(ValueError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value) and str(caught.value).endswith((".", "?"))
