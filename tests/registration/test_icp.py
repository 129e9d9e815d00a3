"""ICP: exact fits, invariances, degenerate input, and what it reaches on simulated and real scans."""

from __future__ import annotations

import importlib.util
import os
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from course_lib.bench import inputs
from course_lib.cloud import downsample, neighbours, normals
from course_lib.geometry import transforms
from course_lib.notebook import data
from course_lib.registration.correspondences import Correspondences
from course_lib.registration.icp import fit_rigid, fit_rigid_to_planes, icp
from course_lib.registration.robust import robust_weights

open3d = pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="Open3D is not installed")
needs_mirror = pytest.mark.skipif(
    "COURSE_DATA_MIRROR" not in os.environ and not data.available("lidar_pair"), reason="the real data are not here"
)
SEEDS = st.integers(0, 2**32 - 1)


def solid(seed: int, n: int = 30) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, 3))


def apart(T: np.ndarray, other: np.ndarray, points: np.ndarray) -> float:
    """The farthest that two motions put one of these points apart, metres."""
    return float(np.linalg.norm(transforms.apply(T, points) - transforms.apply(other, points), axis=1).max())


@lru_cache(maxsize=4)
def field_pair(n: int = 3000, side: float = 6.0):
    """Source, target, its normals, and the true T_target_source: two samples of a surface, 3 degrees and 7 cm apart."""
    per_area = n / side**2
    target, other = inputs.field(n, 1, per_area, 0.002), inputs.field(n, 2, per_area, 0.002)
    middle = target.mean(axis=0)
    T = transforms.compose(
        transforms.from_rotation_translation(np.eye(3), middle + [0.05, 0.04, -0.03]),
        transforms.rotation_z(np.radians(3)),
        transforms.from_rotation_translation(np.eye(3), -middle),
    )
    return transforms.apply(transforms.invert(T), other), target, inputs.slope_normals(target), T


# ------------------------------------------------------------------------------------------------------ known pairs


@given(SEEDS, st.integers(3, 40))
def test_known_pairs_give_back_the_motion(seed, n):
    T = transforms.random(np.random.default_rng(seed), 180, 5)
    points = solid(seed, n)
    assert apart(fit_rigid(points, transforms.apply(T, points)), T, points) < 1e-9


@given(SEEDS)
def test_flat_clouds_are_turned_and_never_reflected(seed):
    rng = np.random.default_rng(seed)
    points = np.c_[rng.normal(size=(12, 2)), np.zeros(12)]
    T = transforms.random(rng, 180, 5)
    found = fit_rigid(points, transforms.apply(T, points))
    assert np.linalg.det(found[:3, :3]) == pytest.approx(1)
    assert apart(found, T, points) < 1e-9


def test_without_the_guard_about_half_of_the_flat_clouds_are_reflected_and_no_solid_one():
    """The claim of the lesson: the lecture's algorithm has no guard."""

    def determinant(points, moved):
        U, _, Vt = np.linalg.svd((moved - moved.mean(axis=0)).T @ (points - points.mean(axis=0)))
        return np.linalg.det(U @ Vt)

    rng = np.random.default_rng(7)
    flips = {"solid": 0, "flat": 0}
    for _ in range(400):
        T = transforms.random(rng, 180, 5)
        for kind in flips:
            points = rng.normal(size=(20, 3)) * ([1, 1, 0] if kind == "flat" else [1, 1, 1])
            points = transforms.apply(transforms.random(rng, 180, 5), points)
            flips[kind] += determinant(points, transforms.apply(T, points)) < 0
    assert flips["solid"] == 0
    assert 0.35 * 400 < flips["flat"] < 0.65 * 400


@given(SEEDS)
def test_a_mirrored_cloud_still_gets_the_best_rotation(seed):
    points = solid(seed)
    mirrored = points * [1, 1, -1]
    T = fit_rigid(points, mirrored)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
    best = np.linalg.norm(transforms.apply(T, points) - mirrored)
    rng = np.random.default_rng(seed)
    for _ in range(20):
        other = transforms.compose(T, transforms.random(rng, 20, 0.2))
        assert np.linalg.norm(transforms.apply(other, points) - mirrored) >= best - 1e-9


@given(SEEDS, st.sampled_from([1e-3, 1.0, 1e3]))
def test_the_fit_follows_motion_permutation_and_scale(seed, scale):
    rng = np.random.default_rng(seed)
    p, q = solid(seed), transforms.apply(transforms.random(rng, 90, 2), solid(seed)) + rng.normal(0, 0.05, (30, 3))
    T = fit_rigid(p, q)
    order = rng.permutation(30)
    assert apart(fit_rigid(p[order], q[order]), T, p) < 1e-9
    A, B = transforms.random(rng, 180, 3), transforms.random(rng, 180, 3)
    moved = fit_rigid(transforms.apply(A, p), transforms.apply(B, q))
    assert apart(moved, transforms.compose(B, T, transforms.invert(A)), transforms.apply(A, p)) < 1e-7
    scaled = fit_rigid(scale * p, scale * q)
    np.testing.assert_allclose(scaled[:3, :3], T[:3, :3], atol=1e-9)
    np.testing.assert_allclose(scaled[:3, 3], scale * T[:3, 3], atol=1e-9 * scale)


@given(SEEDS)
def test_the_way_back_is_the_inverse(seed):
    rng = np.random.default_rng(seed)
    p, q = solid(seed), solid(seed) + rng.normal(0, 0.1, (30, 3))
    assert apart(fit_rigid(q, p), transforms.invert(fit_rigid(p, q)), q) < 1e-9


def test_weights_of_zero_leave_pairs_out_and_whole_weights_repeat_them():
    p = solid(3)
    T = transforms.random(np.random.default_rng(4), 90, 2)
    q = transforms.apply(T, p)
    q[:5] += 10
    weights = np.r_[np.zeros(5), np.ones(25)]
    assert apart(fit_rigid(p, q, weights), T, p) < 1e-9
    q += np.random.default_rng(5).normal(0, 0.1, q.shape)
    twice = np.r_[np.arange(30), np.arange(10)]
    assert apart(fit_rigid(p, q, np.r_[2 * np.ones(10), np.ones(20)]), fit_rigid(p[twice], q[twice]), p) < 1e-9


@given(SEEDS)
def test_a_step_to_planes_undoes_a_small_motion(seed):
    rng = np.random.default_rng(seed)
    q, n = solid(seed), solid(seed + 1)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    T = transforms.random(rng, 0.5, 0.01)
    p = transforms.apply(transforms.invert(T), q)
    before, after = apart(np.eye(4), T, p), apart(fit_rigid_to_planes(p, q, n), T, p)
    assert after < 0.05 * before + 1e-12  # what linearising leaves goes with the square of the angle


def test_a_step_to_one_plane_does_not_slide():
    rng = np.random.default_rng(8)
    q = np.c_[rng.uniform(-1, 1, (40, 2)), np.zeros(40)]
    step = fit_rigid_to_planes(q + [0.3, -0.2, 0.1], q, np.tile([0, 0, 1.0], (40, 1)))
    np.testing.assert_allclose(step[:3, 3], [0, 0, -0.1], atol=1e-9)
    np.testing.assert_allclose(step[:3, :3], np.eye(3), atol=1e-9)


# --------------------------------------------------------------------------------------------------- degenerate input


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        (np.zeros((0, 3)), "there are none"),
        (np.zeros((1, 3)), "needs 3 pairs of points, there are 1"),
        (np.zeros((2, 3)), "needs 3 pairs of points, there are 2"),
        (np.ones((5, 3)), "lie on a line"),
        (np.outer(np.arange(5.0), [1, 2, 3]), "lie on a line"),
        (np.outer(np.arange(5.0), [1, 2, 3]) + 1e6, "lie on a line"),
        ([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]], "1 of 3 are NaN or infinite"),
        ([[np.inf, 0, 0], [1, 0, 0], [0, 1, 0]], "1 of 3 are NaN or infinite"),
        (np.zeros((4, 2)), "the last axis must have 3 entries"),
    ],
)
def test_points_that_fix_no_motion_get_one_sentence(points, sentence):
    with pytest.raises(ValueError, match=sentence) as caught:
        fit_rigid(points, points)
    assert "\n" not in str(caught.value)


def test_three_points_and_doubled_points_are_enough():
    p = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    T = transforms.random(np.random.default_rng(1), 180, 3)
    assert apart(fit_rigid(p, transforms.apply(T, p)), T, p) < 1e-12
    twice = np.vstack([p, p, p])
    assert apart(fit_rigid(twice, transforms.apply(T, twice)), T, p) < 1e-12


def test_far_from_the_origin_no_digits_are_lost():
    p = solid(2)
    T = transforms.random(np.random.default_rng(3), 10, 1)
    far = p + 1e6
    assert apart(fit_rigid(far, transforms.apply(T, p)), transforms.compose(T, _shift([-1e6] * 3)), far) < 1e-6


def _shift(by) -> np.ndarray:
    return transforms.from_rotation_translation(np.eye(3), by)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"target": np.zeros((0, 3))}, "target.*there are none"),
        ({"source": np.zeros((0, 3))}, "source.*there are none"),
        ({"source": np.full((4, 3), np.nan)}, "source.*NaN or infinite"),
        ({"target": np.full((4, 3), np.inf)}, "target.*NaN or infinite"),
        ({"radius": 0.0}, "radius: expected a positive distance"),
        ({"radius": []}, "radius: expected a positive distance"),
        ({"radius": [1.0, -0.5]}, "radius: expected a positive distance"),
        ({"steps": 0}, "steps: expected a whole number"),
        ({"steps": True}, "steps: expected a whole number"),
        ({"keep": 0.0}, "keep: expected a share"),
        ({"keep": 1.1}, "keep: expected a share"),
        ({"kernel": "tukay"}, "kernel: 'tukay' is unknown"),
        ({"initial": np.diag([2.0, 2, 2, 1])}, "initial"),
        ({"normals": np.ones((3, 3))}, "normals: expected one a target point"),
        ({"normals": np.full((3000, 3), np.nan)}, "normals: all of them are NaN"),
    ],
)
def test_a_bad_argument_of_icp_gets_one_sentence(change, sentence):
    source, target, _, _ = field_pair()
    with pytest.raises(ValueError, match=sentence) as caught:
        icp(**{"source": source, "target": target, "radius": 0.5, **change})
    assert "\n" not in str(caught.value)


def test_clouds_that_do_not_overlap_are_refused():
    source, target, slopes, _ = field_pair()
    for given_normals in (None, slopes):
        with pytest.raises(ValueError, match="0 source points have a target point within 0.5 m"):
            icp(source + 100, target, 0.5, given_normals)


@pytest.mark.parametrize(
    ("points", "sentence"),
    [
        (np.zeros((1, 3)), "1 source points have"),
        (np.arange(6.0).reshape(2, 3), "2 source points have"),
        (np.ones((9, 3)), "lie on a line"),
        (np.outer(np.arange(9.0), [1, 0, 0]), "lie on a line"),
    ],
)
def test_clouds_that_fix_no_motion_are_refused(points, sentence):
    with pytest.raises(ValueError, match=sentence):
        icp(points, points, 0.5)


def test_three_points_flat_clouds_and_duplicates_are_registered():
    triangle = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0.0]])
    grid = np.stack(np.meshgrid(range(6), range(4), [0.0]), axis=-1).reshape(-1, 3) * [1.0, 1.3, 1]
    T = transforms.compose(_shift([0.1, -0.1, 0.05]), transforms.rotation_z(np.radians(2)))
    for cloud in (triangle, grid, np.vstack([grid, grid])):
        found = icp(transforms.apply(transforms.invert(T), cloud), cloud, 0.6).T_target_source
        assert apart(found, T, cloud) < 1e-9
        assert np.linalg.det(found[:3, :3]) == pytest.approx(1)


def test_a_single_plane_is_reached_but_not_slid_along():
    rng = np.random.default_rng(3)
    target = np.c_[rng.uniform(0, 4, (600, 2)), np.zeros(600)]
    source = target + [0.05, 0.02, 0.1]
    result = icp(source, target, 0.5, np.tile([0, 0, 1.0], (600, 1)))
    np.testing.assert_allclose(result.T_target_source[:3, 3], [0, 0, -0.1], atol=1e-9)
    assert result.converged and result.fitness == 1.0  # a fine fitness, and 5 cm off


def test_target_points_without_a_normal_are_not_used():
    source, target, slopes, T = field_pair()
    holes = slopes.copy()
    holes[::3] = np.nan
    assert apart(icp(source, target, 0.5, holes).T_target_source, T, source) < 0.003


def test_float32_and_far_coordinates():
    source, target, slopes, T = field_pair()
    for given_normals in (None, slopes):
        whole = icp(source, target, 0.5, given_normals, steps=15).T_target_source
        single = icp(source.astype(np.float32), target.astype(np.float32), 0.5, given_normals, steps=15)
        assert apart(single.T_target_source, whole, source) < 1e-4
        far = icp(source + 1e6, target + 1e6, 0.5, given_normals, steps=15).T_target_source
        assert apart(transforms.compose(_shift([-1e6] * 3), far, _shift([1e6] * 3)), whole, source) < 1e-4


# -------------------------------------------------------------------------------------------------------- registering


@pytest.mark.parametrize("to_planes", [False, True])
def test_two_samples_of_a_surface(to_planes):
    """Points to points are off by a share of the spacing, as no point has its true partner; planes are not."""
    source, target, slopes, T = field_pair()
    result = icp(source, target, [0.5, 0.2], slopes if to_planes else None, steps=60)
    spacing = np.median(neighbours.Neighbours(target).mean_distances(1))
    assert apart(result.T_target_source, T, source) < (0.002 if to_planes else spacing)
    assert result.fitness > 0.97 and result.rmse < 0.1


def test_planes_take_fewer_steps_than_points():
    source, target, slopes, T = field_pair()

    def steps_until(given_normals, metres):
        for steps in range(1, 60):
            found = icp(source, target, 0.5, given_normals, steps=steps, tolerance=0.0).T_target_source
            if apart(found, T, source) < metres:
                return steps
        return 60

    assert 3 * steps_until(slopes, 0.02) <= steps_until(None, 0.02)


def test_the_first_step_is_the_fit_of_brute_force_pairs():
    source, target, slopes, _ = field_pair(400, 3.0)
    distance = np.linalg.norm(source[:, None] - target[None], axis=-1)
    partner, near = distance.argmin(axis=1), distance.min(axis=1) <= 0.3
    p, q, n = source[near], target[partner[near]], slopes[partner[near]]
    one = icp(source, target, 0.3, steps=1)
    assert apart(one.T_target_source, fit_rigid(p, q), source) < 1e-9
    assert one.steps[0].pairs == near.sum()
    assert one.steps[0].rmse == pytest.approx(np.sqrt(np.mean(distance.min(axis=1)[near] ** 2)))
    plane = icp(source, target, 0.3, slopes, steps=1)
    assert apart(plane.T_target_source, fit_rigid_to_planes(p, q, n), source) < 1e-9


@pytest.mark.parametrize("to_planes", [False, True])
def test_partners_kept_from_earlier_steps_are_the_nearest_ones(to_planes):
    """Step by step from fresh, and all at once: the bookkeeping of partners must not change the result."""
    source, target, slopes, _ = field_pair()
    given_normals = slopes if to_planes else None
    T = np.eye(4)
    for _ in range(8):
        T = icp(source, target, 0.4, given_normals, initial=T, steps=1, tolerance=0.0).T_target_source
    assert apart(icp(source, target, 0.4, given_normals, steps=8, tolerance=0.0).T_target_source, T, source) < 1e-9


@given(SEEDS, st.integers(1, 40), st.lists(st.tuples(st.floats(0, 1), st.floats(0.05, 3)), min_size=2, max_size=8))
@pytest.mark.parametrize("small", [0, 2000], ids=["grid", "tree"])
def test_correspondences_on_any_way_are_those_of_brute_force(small, seed, n, way):
    """Large moves and small ones, radii that shrink and grow, points that lose their partner and find another."""
    rng = np.random.default_rng(seed)
    source, target = rng.uniform(-2, 2, (40, 3)), rng.uniform(-1, 1, (n, 3))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(neighbours, "SMALL", small)
        partners, T = Correspondences(target, None, source), np.eye(4)
    for size, radius in way:
        T = transforms.compose(transforms.random(rng, 60 * size**3, 2 * size**3), T)
        distance = partners.find(T, radius)
        moved = transforms.apply(T, source)
        true = np.linalg.norm(moved[:, None] - target[None], axis=-1).min(axis=1)
        inside = true <= radius
        np.testing.assert_array_equal(distance <= radius, inside)
        np.testing.assert_allclose(distance[inside], true[inside], rtol=0, atol=1e-12)
        np.testing.assert_allclose(partners.moved, moved, rtol=0, atol=1e-12)
        to_partner = np.linalg.norm(partners.target[partners.place] - partners.moved, axis=1)
        np.testing.assert_allclose(to_partner[inside], true[inside], rtol=0, atol=1e-12)


@settings(max_examples=8)
@given(SEEDS, st.sampled_from([False, True]))
def test_icp_follows_motion_permutation_and_scale(seed, to_planes):
    source, target, slopes, _ = field_pair(400, 3.0)
    given_normals = slopes if to_planes else None
    rng = np.random.default_rng(seed)
    T = icp(source, target, 0.5, given_normals, steps=6, tolerance=0.0).T_target_source
    some, other = rng.permutation(len(source)), rng.permutation(len(target))
    mixed = icp(source[some], target[other], 0.5, slopes[other] if to_planes else None, steps=6, tolerance=0.0)
    assert apart(mixed.T_target_source, T, source) < 1e-8
    A = transforms.random(rng, 180, 3)
    turned = None if given_normals is None else slopes @ A[:3, :3].T
    moved = icp(transforms.apply(A, source), transforms.apply(A, target), 0.5, turned, steps=6, tolerance=0.0)
    assert apart(transforms.compose(transforms.invert(A), moved.T_target_source, A), T, source) < 1e-7
    large = icp(8 * source, 8 * target, 4.0, given_normals, steps=6, tolerance=0.0).T_target_source
    large[:3, 3] /= 8
    assert apart(large, T, source) < 1e-8


def test_fitness_is_a_share_of_the_source():
    source, target, _, T = field_pair()
    doubled = np.vstack([source, source + [0, 0, 50]])
    assert icp(doubled, target, 0.5, initial=T, steps=2).fitness == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("how", [{"keep": 0.6}, {"kernel": "huber"}, {"kernel": "tukey"}])
def test_trimming_and_kernels_resist_what_does_not_belong(how):
    source, target, slopes, T = field_pair()
    rng = np.random.default_rng(6)
    spoilt = source.copy()
    spoilt[:900] += np.c_[np.zeros((900, 2)), rng.uniform(0.1, 0.4, 900)]
    plain = apart(icp(spoilt, target, 0.5, slopes, steps=30).T_target_source, T, source)
    robust = apart(icp(spoilt, target, 0.5, slopes, steps=30, **how).T_target_source, T, source)
    assert plain > 0.02
    assert robust < 0.35 * plain


def test_the_history_tells_what_happened():
    source, target, _, _ = field_pair()
    result = icp(source, target, [0.8, 0.2], steps=5, tolerance=0.0)
    assert [step.radius for step in result.steps] == [0.8] * 5 + [0.2] * 5
    assert not result.converged
    assert all(0 < step.pairs <= len(source) for step in result.steps)
    assert result.steps[4].rmse < result.steps[0].rmse


def test_more_pairs_do_not_mean_a_better_pose():
    """Report, section 9: the count of correspondences cannot tell a wrong pose from the true one."""
    source, target, _, T = field_pair()
    wrong = transforms.compose(_shift([0.4, 0, 0]), T)

    def score(pose):
        return icp(source, target, 1.0, initial=pose, steps=1, tolerance=0.0).steps[0]

    assert score(wrong).pairs == score(T).pairs == len(source)
    assert score(wrong).rmse > 1.5 * score(T).rmse


@open3d
@pytest.mark.parametrize("to_planes", [False, True])
def test_open3d_ends_at_the_same_pose(to_planes):
    import open3d as o3d

    source, target, slopes, _ = field_pair()
    cloud, model = (o3d.geometry.PointCloud(o3d.utility.Vector3dVector(each)) for each in (source, target))
    model.normals = o3d.utility.Vector3dVector(slopes)
    module = o3d.pipelines.registration
    way = module.TransformationEstimationPointToPlane if to_planes else module.TransformationEstimationPointToPoint
    never = module.ICPConvergenceCriteria(-1.0, -1.0, 10)
    theirs = module.registration_icp(cloud, model, 0.5, np.eye(4), way(), never)
    ours = icp(source, target, 0.5, slopes if to_planes else None, steps=10, tolerance=0.0)
    assert apart(ours.T_target_source, np.array(theirs.transformation), source) < 1e-4
    assert ours.fitness == pytest.approx(theirs.fitness, abs=1e-3)
    assert ours.rmse == pytest.approx(theirs.inlier_rmse, rel=1e-3)


# -------------------------------------------------------------------------------------------------------- real scans


@lru_cache(maxsize=1)
def lidar():
    pair = data.load("lidar_pair")
    source, target = (downsample.voxel_downsample(pair.clouds[name].points, 0.1) for name in ("source", "target"))
    return source, target, normals.estimate_normals(target, k=20), pair.reference["T_target_source"]


COARSE_TO_FINE = (2.0, 1.0, 0.5, 0.25)


@needs_mirror
@pytest.mark.parametrize("to_planes", [False, True])
def test_the_lidar_pair_from_identity_in_one_call(to_planes):
    source, target, slopes, T = lidar()
    found = icp(source, target, COARSE_TO_FINE, slopes if to_planes else None, steps=40, tolerance=1e-4)
    error = transforms.pose_error(found.T_target_source, T)
    assert error.metres <= 0.016 and error.degrees <= 0.2


@pytest.mark.parametrize("off", [0.0, 1e-4])
def test_a_kernel_works_where_most_pairs_fit_exactly(off):
    """400 of 1000 points moved by 12 mm: whether the start is exact or nearly so, they do not pull."""
    rng = np.random.default_rng(0)
    target = rng.uniform(0, 1, (1000, 3))
    source = target.copy()
    source[:400] += [0.012, 0, 0]
    start = transforms.from_rotation_translation(np.eye(3), (off, 0, 0))
    found = icp(source, target, 0.05, initial=start, kernel="tukey")
    assert np.linalg.norm(found.T_target_source[:3, 3]) < 1e-6


def test_weights_where_the_median_is_zero():
    assert robust_weights(np.array([0.0, 0, 0, 100]), "tukey").tolist() == [1, 1, 1, 0]
    assert robust_weights(np.array([0.0, 0, 0, 100]), "huber").tolist() == [1, 1, 1, 0]
    assert robust_weights(np.array([0.0, 1]), "none") is None
    with pytest.raises(ValueError, match="a NaN or infinite residual has no weight"):
        robust_weights(np.array([0.0, np.nan, 1.0]), "tukey")


def test_normals_that_are_none_and_a_share_that_is_too_small():
    grid = np.stack(np.meshgrid(*[np.arange(7.0)] * 3), axis=-1).reshape(-1, 3)
    up = np.tile([0, 0, 1.0], (len(grid), 1))
    for bad in (np.nan, 0.0, 2.0):
        spoiled = up.copy()
        spoiled[5] *= bad
        with pytest.raises(ValueError, match="normals: some are NaN or not of length 1; leave those pairs out"):
            fit_rigid_to_planes(grid, grid, spoiled)
        with pytest.raises(ValueError, match="normals: all of them are NaN or not of length 1"):
            icp(grid + 0.01, grid, 0.5, bad * up)
    with pytest.raises(ValueError, match="343 source points have .* 2 of them are kept, .* larger radius or keep"):
        icp(grid + 0.01, grid, 0.5, keep=0.005)
    with pytest.raises(ValueError, match="keep: expected real numbers"):
        icp(grid, grid, 0.5, keep="x")
