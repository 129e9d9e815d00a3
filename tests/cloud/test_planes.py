"""Planes: best fits, RANSAC, several planes and the floor, against truth, against Open3D, and where there is none."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from course_lib.bench import inputs
from course_lib.cloud import floors, planes
from course_lib.cloud.planes import Plane
from course_lib.geometry import transforms

LINE = np.linspace(0, 1, 9)[:, None] * [1.0, 2.0, -1.0]
TILTED = np.array([-0.3, 0.2, 1.0]) / np.sqrt(1.13)  # the normal of inputs.plane_among_points


def board(seed: int, count: int = 400, noise: float = 0.005, tilt: float = 35.0) -> tuple[np.ndarray, np.ndarray]:
    """Points of a board two metres ahead, 1.0 x 0.6 m, and its true normal."""
    rng = np.random.default_rng(seed)
    R = transforms.rotation_x(np.radians(tilt))[:3, :3]
    flat = np.column_stack([rng.uniform(-0.5, 0.5, count), rng.uniform(-0.3, 0.3, count), rng.normal(0, noise, count)])
    return flat @ R.T + [0, 0, 2], R[:, 2]


def degrees(a: np.ndarray, b: np.ndarray) -> float:
    """Angle between two directions, signs ignored; exact for small ones."""
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), abs(a @ b))))


def same(a: Plane, b: Plane, tolerance: float = 1e-9) -> bool:
    return degrees(a.normal, b.normal) < 1e-5 and abs(abs(a.offset) - abs(b.offset)) <= tolerance


# --- the plane itself ---


def test_a_plane_is_stored_with_a_unit_normal_and_one_sign():
    for scale in (1, -1, 7.5, -0.02):
        plane = Plane(np.multiply((0.0, -3.0, 4.0), scale), 10 * scale)
        assert plane.normal.tolist() == pytest.approx([0, -0.6, 0.8]) and plane.offset == pytest.approx(2)
    assert Plane((0, 0, -1), 2).distances(np.zeros((4, 5, 3))).shape == (4, 5)


@pytest.mark.parametrize("normal", [(0, 0, 0), (np.nan, 0, 1), (np.inf, 0, 0), (1, 0), "abc"])
def test_a_plane_needs_a_direction(normal):
    with pytest.raises(ValueError, match=r"^normal: .+\.$"):
        Plane(normal, 1)


# --- the best fit ---


@pytest.mark.parametrize("tilt", [0, 20, 80, 90])
def test_the_fit_is_that_of_the_singular_values(tilt):
    points, true = board(3, tilt=tilt)
    plane = planes.fit_plane(points)
    normal = np.linalg.svd(points - points.mean(axis=0))[2][2]
    assert degrees(plane.normal, normal) < 1e-5 and degrees(plane.normal, true) < 0.3
    assert plane.distances(points.mean(axis=0)) == pytest.approx(0, abs=1e-12)
    for off in np.random.default_rng(1).normal(0, 0.01, (50, 4)):  # no plane near by has a smaller sum of squares
        other = Plane(plane.normal + off[:3], plane.offset + off[3])
        assert np.sum(other.distances(points) ** 2) >= np.sum(plane.distances(points) ** 2)


def test_without_the_mean_the_normal_is_a_right_angle_off():
    """The lecture's matrix: 90 degrees at a board two metres ahead, 70 where it is tilted by 20."""
    for tilt, wanted in ((0, 90), (20, 70)):
        points, true = board(6, count=4000, tilt=tilt)
        printed = np.linalg.eigh(points.T @ points)[1]
        assert degrees(printed[:, 0], true) == pytest.approx(wanted, abs=1)
        assert degrees(printed[:, 2], true) == pytest.approx(tilt, abs=1)


@given(st.integers(0, 10**6), st.floats(0.01, 100), st.floats(-50, 50))
def test_a_fit_moves_turns_and_scales_with_its_points(seed, scale, shift):
    points, _ = board(seed, count=60, noise=0.02)
    T = transforms.random(np.random.default_rng(seed))
    moved = transforms.apply(T, points) * scale + shift
    plane, image = planes.fit_plane(points), planes.fit_plane(moved)
    assert degrees(T[:3, :3] @ plane.normal, image.normal) < 1e-4
    assert np.allclose(np.abs(image.distances(moved)), scale * np.abs(plane.distances(points)), atol=1e-6 * scale)
    shuffled = np.random.default_rng(seed).permutation(points)
    assert same(plane, planes.fit_plane(shuffled))


# --- how often to try ---


def test_iterations_are_the_smallest_number_that_is_enough():
    assert planes.iterations_needed(0.6, 3, 0.99) == 19
    for w in (0.3, 0.45, 0.9, 0.999):
        for sample in (1, 2, 3, 5):
            n = planes.iterations_needed(w, sample, 0.99)
            assert (1 - w**sample) ** n <= 0.01 + 1e-12
            assert n == 1 or (1 - w**sample) ** (n - 1) > 0.01
    assert planes.iterations_needed(1.0) == 1


def test_the_wrong_formulas_give_6_and_70():
    assert planes.iterations_needed(0.6, 1, 0.99) == 6, "w for w cubed"
    assert planes.iterations_needed(0.4, 3, 0.99) in (70, 71), "the share of outliers"


def test_the_number_of_iterations_keeps_its_promise():
    rng = np.random.default_rng(6)
    samples = rng.random((20_000, 19, 3)) < 0.6
    assert samples.all(axis=2).any(axis=1).mean() == pytest.approx(1 - (1 - 0.6**3) ** 19, abs=0.003)


@pytest.mark.parametrize(("share", "confidence"), [(0, 0.9), (-0.1, 0.9), (2, 0.9), (0.5, 0), (0.5, 1), (np.nan, 0.5)])
def test_iterations_refuse_what_is_no_share(share, confidence):
    with pytest.raises(ValueError, match=r"^(inlier_share|confidence): .+\.$"):
        planes.iterations_needed(share, 3, confidence)


# --- RANSAC ---


def most_of_a_flat_count(inside: int, outside: int, noise: float, threshold: float) -> float:
    """How far, in metres, the rim of a plane of the most inliers can be off, for inputs.plane_among_points.

    The plane's own points are 10 m wide, so a tilt that moves the rim by r moves a point by at most r, evenly spread.
    With s the noise across the plane, k = threshold / s, and phi the normal density, it loses
    inside * k * phi(k) / 3 * (r / s)^2 of them on average (to first order none: as many come in as go).
    But counts of two planes differ by chance, too: by the root of the number of points that enter or leave, in layers
    of r / 2 on average, at both edges of the band. A refit with fewer inliers is dropped, so the plane kept has lost no
    more than chance explains. Five standard deviations of that: a * r^2 = 5 * sqrt(b * r).
    """
    s = noise / np.sqrt(1.13)  # the noise of inputs.plane_among_points is along z
    k = threshold / s
    edge = np.exp(-(k**2) / 2) / np.sqrt(2 * np.pi)
    a = inside * k * edge / (3 * s**2)
    b = inside * edge / s + outside * np.sqrt(1.13) / 8  # the others fill 8 m of height
    return float((25 * b / a**2) ** (1 / 3))


@pytest.mark.parametrize("seed", range(8))
def test_the_plane_is_found_among_others_with_at_least_open3ds_inliers(seed):
    points = inputs.plane_among_points(20_000, seed)
    plane, inliers = planes.find_plane(points, 0.015, seed=seed)
    o3d.utility.random.seed(seed)
    theirs = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).segment_plane(0.015, 3, 256)[1]
    assert np.count_nonzero(inliers) >= len(theirs)
    rim = 5 * np.radians(degrees(plane.normal, TILTED))  # the plane is 10 m wide
    most = most_of_a_flat_count(12_000, 8_000, 0.005, 0.015)
    assert most < 0.005, "less than the noise of one point"
    assert rim < most
    assert np.array_equal(inliers, np.abs(plane.distances(points)) <= 0.015)


def test_one_seed_gives_one_plane_and_few_inliers_are_enough():
    points = inputs.plane_among_points(20_000, 1, share=0.15)
    first, again = planes.find_plane(points, 0.015, seed=4), planes.find_plane(points, 0.015, seed=4)
    assert same(first[0], again[0], 0) and np.array_equal(first[1], again[1])
    assert degrees(first[0].normal, TILTED) < 0.05


@given(st.integers(0, 10**6), st.floats(0.05, 20))
def test_the_plane_found_moves_with_its_points(seed, scale):
    points = inputs.plane_among_points(3000, seed)
    T = transforms.random(np.random.default_rng(seed))
    plane, inliers = planes.find_plane(points, 0.015)
    image, moved = planes.find_plane(transforms.apply(T, points) * scale, 0.015 * scale)
    assert degrees(T[:3, :3] @ plane.normal, image.normal) < 0.1
    assert np.mean(inliers == moved) > 0.99
    shuffle = np.random.default_rng(seed).permutation(len(points))
    other, mask = planes.find_plane(points[shuffle], 0.015)
    assert degrees(plane.normal, other.normal) < 0.1 and np.mean(mask == inliers[shuffle]) > 0.99


def test_float32_far_away_and_duplicates():
    points = inputs.plane_among_points(5000, 2)
    plane, inliers = planes.find_plane(points, 0.015)
    single = planes.find_plane(points.astype(np.float32), 0.015)[0]
    assert degrees(plane.normal, single.normal) < 0.01
    far = np.array([1e6, -2e6, 1e6])
    shifted, mask = planes.find_plane(points + far, 0.015)
    assert degrees(plane.normal, shifted.normal) < 0.01 and np.mean(mask == inliers) > 0.999
    twice, both = planes.find_plane(np.repeat(points, 2, axis=0), 0.015)
    assert degrees(plane.normal, twice.normal) < 0.01 and abs(both.sum() - 2 * inliers.sum()) < 0.01 * inliers.sum()


TRIANGLE = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1.0]])


@pytest.mark.parametrize("function", [planes.fit_plane, lambda points: planes.find_plane(points, 0.01)[0]])
def test_three_points_and_coplanar_points_give_their_plane(function):
    rng = np.random.default_rng(0)
    coplanar = np.column_stack([rng.uniform(size=(30, 2)), np.ones(30)])
    for points in (TRIANGLE, TRIANGLE + [1e6, 1e6, 0], coplanar, np.repeat(TRIANGLE, 5, axis=0)):
        plane = function(points)
        assert degrees(plane.normal, np.array([0, 0, 1.0])) < 1e-4 and plane.offset == pytest.approx(-1, abs=1e-6)


@pytest.mark.parametrize(
    "function",
    [
        planes.fit_plane,
        lambda points: planes.find_plane(points, 0.01),
        lambda points: list(planes.find_planes(points, 0.01)),
        lambda points: floors.find_floor(points, 0.01),
        lambda points: floors.remove_floor(points, 0.01),
    ],
    ids=["fit_plane", "find_plane", "find_planes", "find_floor", "remove_floor"],
)
@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        TRIANGLE[:1],
        TRIANGLE[:2],
        np.ones((20, 3)),
        np.full((20, 3), 1e6),
        LINE,
        LINE + 1e6,
        np.repeat(LINE[:2], 4, axis=0),
        np.vstack([TRIANGLE, [[np.nan, 0, 0]]]),
        np.vstack([TRIANGLE, [[np.inf, 0, 0]]]),
        np.zeros((5, 2)),
        "points",
    ],
    ids=["0", "1", "2", "equal", "equal far away", "line", "line far away", "two places", "NaN", "inf", "2D", "text"],
)
def test_where_there_is_no_plane_one_sentence_says_so(function, points):
    with pytest.raises(ValueError, match=r"^points: [^\n]+[.)]\.?$"):
        function(points)


@pytest.mark.parametrize("threshold", [0, -1, np.nan, np.inf, "x"])
def test_a_threshold_is_a_length(threshold):
    with pytest.raises(ValueError, match=r"^threshold: .+\.$"):
        planes.find_plane(TRIANGLE, threshold)


# --- several, and the floor ---


def room(seed: int = 0, floor_points: int = 3000) -> tuple[np.ndarray, np.ndarray]:
    """A floor at 0, a larger table top at 0.75 m, a wall, and a heap on the floor; and which is which (0 to 3)."""
    rng = np.random.default_rng(seed)
    noise = [rng.normal(0, 0.003, n) for n in (floor_points, 5000, 2500)]
    floor = np.column_stack([rng.uniform(-2, 2, (floor_points, 2)), noise[0]])
    table = np.column_stack([rng.uniform(-0.7, 0.7, (5000, 2)), 0.75 + noise[1]])
    wall = np.column_stack([rng.uniform(-2, 2, 2500), 2 + noise[2], rng.uniform(0.1, 2.4, 2500)])
    heap = rng.uniform((0.9, -1, 0.05), (1.8, 1, 0.6), (1500, 3))
    parts = [floor, table, wall, heap]
    return np.vstack(parts), np.repeat(np.arange(4), [len(part) for part in parts])


def test_planes_come_largest_first_and_share_no_point():
    points, kind = room()
    found = list(planes.find_planes(points, 0.01, most=3))
    assert [np.bincount(kind[index]).argmax() for _, index in found] == [1, 0, 2]
    every = np.concatenate([index for _, index in found])
    assert len(set(every.tolist())) == len(every)
    for (plane, _), true in zip(found, ([0, 0, 1], [0, 0, 1], [0, 1, 0]), strict=True):
        assert degrees(plane.normal, np.array(true, float)) < 0.2
    assert len(list(planes.find_planes(points, 0.01, least=4000))) == 1


def test_the_floor_is_the_lowest_level_plane_not_the_largest():
    points, kind = room()
    floor = floors.find_floor(points, 0.01)
    assert floor.offset == pytest.approx(0, abs=2e-3)
    kept = floors.remove_floor(points, 0.01, clearance=0.03)
    removed = ~kept
    assert (removed & (kind == 0)).sum() / removed.sum() > 0.99, "precision"
    assert (removed & (kind == 0)).sum() / (kind == 0).sum() > 0.99, "recall"


@pytest.mark.parametrize("seed", range(4))
def test_the_floor_in_a_cameras_frame(seed):
    points, kind = room(seed)
    T = transforms.invert(transforms.look_at((0.3, -3.0, 1.4), (0, 0.5, 0.8)))
    up = T[:3, :3] @ [0, 0, 1.0]
    here = transforms.apply(T, points)
    floor = floors.find_floor(here, 0.01, up=up * 5)
    height = floors.heights_above(here, floor, up)
    assert np.allclose(height, points[:, 2], atol=0.02)
    assert floors.heights_above(np.zeros(3), floor, up) == pytest.approx(1.4, abs=0.01), "the camera's own height"
    tilted = floors.find_floor(here, 0.01, up=(0, -1, 0), most_degrees=30)
    assert same(floor, tilted, 1e-6)


def test_a_room_without_a_floor_and_odd_arguments_get_a_sentence():
    points, _ = room()
    wall = points[np.abs(points[:, 1] - 2) < 0.02]
    with pytest.raises(ValueError, match="within 15 degrees of level"):
        floors.find_floor(wall, 0.01)
    with pytest.raises(ValueError, match="up: it is zero"):
        floors.find_floor(points, 0.01, up=(0, 0, 0))
    with pytest.raises(ValueError, match="between 0 and 90"):
        floors.find_floor(points, 0.01, most_degrees=90)
    with pytest.raises(ValueError, match="clearance: expected a positive length"):
        floors.remove_floor(points, 0.01, clearance=0)
    with pytest.raises(ValueError, match="stands upright"):
        floors.heights_above(points, Plane((0, 1, 0), 0))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((1e-110,), "inlier_share: expected a share in .0, 1., and not one near 0, got 1e-110"),
        (("a",), "inlier_share: expected real numbers"),
        ((0.5, 0), "sample"),
        ((0.5, -2), "sample"),
        ((0.5, 2.5), "sample"),
        ((0.5, 3, 1.0), "confidence: expected a probability"),
    ],
)
def test_iterations_of_what_is_no_sample(arguments, says):
    with pytest.raises(ValueError, match=says):
        planes.iterations_needed(*arguments)


@pytest.mark.parametrize("pitch", [0, 10, 20, 25, 29])
def test_the_floor_is_the_floor_where_up_is_not_exact(pitch):
    """A floor 1.2 m below the camera, far away, and a table near by: along the camera's own up the table is lower."""
    rng = np.random.default_rng(0)
    floor = np.column_stack([rng.uniform(-1, 1, 6000), np.full(6000, 1.2), rng.uniform(1.5, 4.5, 6000)])
    table = np.column_stack([rng.uniform(-0.5, 0.5, 3000), np.full(3000, 0.45), rng.uniform(0.6, 1.3, 3000)])
    level = np.concatenate([floor, table]) + rng.normal(0, 0.002, (9000, 3))
    turned = level @ transforms.rotation_x(np.radians(pitch))[:3, :3].T
    found = floors.find_floor(turned, 0.01, up=(0, -1, 0), most_degrees=30)
    assert abs(found.offset) == pytest.approx(1.2, abs=0.01)
