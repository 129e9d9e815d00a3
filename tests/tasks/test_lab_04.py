"""The numbers that lesson 04 and its lab live on, each with a tolerance; the functions are the lesson's own."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
from lesson_helpers import functions_of, load
from scipy.spatial import cKDTree

from course_lib import tasks
from course_lib.cloud import downsample, normals, pointcloud
from course_lib.geometry import transforms
from course_lib.notebook import data
from course_lib.surface import metrics
from course_lib.tasks.labs.lab_04_downsampling.mistakes import CAUSE_OF

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def lesson() -> dict:
    names = "voxel_grid nearest_to_centre normal_of degrees_off towards describe"
    return functions_of("04", names, np=np, o3d=o3d)


@pytest.fixture(scope="module")
def animal():
    return load("bunny_like")


@pytest.fixture(scope="module")
def points(animal) -> np.ndarray:
    return animal.cloud.points.astype(float)


@pytest.fixture(scope="module")
def true(animal) -> np.ndarray:
    return animal.cloud.normals.astype(float)


@pytest.mark.parametrize("voxel", [0.005, 0.02])
def test_the_lessons_grid_is_the_librarys(lesson, points, voxel):
    kept, count = lesson["voxel_grid"](points, voxel, 0.003)
    grid = downsample.voxel_grid(points, voxel, (0.003, 0.003, 0.003))
    np.testing.assert_allclose(kept, downsample.voxel_downsample(points, voxel, (0.003,) * 3), atol=1e-12)
    np.testing.assert_array_equal(count, grid.count)
    np.testing.assert_array_equal(
        lesson["nearest_to_centre"](points, voxel), downsample.voxel_downsample(points, voxel, representative="nearest")
    )


def test_half_the_voxel_is_four_times_the_points(points):
    ratio = len(downsample.voxel_downsample(points, 0.005)) / len(downsample.voxel_downsample(points, 0.01))
    assert ratio == pytest.approx(4.0, abs=0.15)


def test_with_a_large_voxel_the_origin_decides(points):
    """50 mm on an animal of 186 mm: nearly twice as many points at one origin as at another; 5 mm: 3 %."""
    origins = np.random.default_rng(4).uniform(0, 0.05, (300, 3))
    large = [len(downsample.voxel_downsample(points, 0.05, start)) for start in origins]
    small = [len(downsample.voxel_downsample(points, 0.005, start)) for start in origins[:30]]
    assert (min(large), max(large)) == (24, 45)
    assert max(small) / min(small) == pytest.approx(1.03, abs=0.01)


def test_what_is_lost_grows_with_the_voxel_and_what_is_false_with_its_square(animal, points):
    voxels = np.array([0.005, 0.01, 0.02])
    lost, false = [], []
    for voxel in voxels:
        kept = downsample.voxel_downsample(points, voxel)
        lost.append(metrics.nearest_distances(points, kept).mean() / voxel)
        false.append(metrics.distance_to_surface(kept, animal.mesh).mean())
        real = downsample.voxel_downsample(points, voxel, representative="nearest")
        assert metrics.distance_to_surface(real, animal.mesh).max() < 1e-6, "a measured point stays on the surface"
    assert lost == pytest.approx([0.35] * 3, abs=0.015)
    slope = np.polyfit(np.log(voxels), np.log(false), 1)[0]
    assert slope == pytest.approx(2.05, abs=0.15)


def test_what_is_false_grows_more_slowly_once_a_cube_holds_whole_pieces(animal, points):
    voxels = np.array([0.02, 0.03, 0.05])
    false = [
        metrics.distance_to_surface(downsample.voxel_downsample(points, voxel), animal.mesh).mean() for voxel in voxels
    ]
    assert np.polyfit(np.log(voxels), np.log(false), 1)[0] == pytest.approx(1.2, abs=0.15)


def test_the_voxel_that_the_rule_chooses(animal, points):
    """The ears are 7 mm thick, 2 mm may be lost: 6 mm, and that is what is lost."""
    rays = np.hstack([points - 1e-5 * animal.cloud.normals, -animal.cloud.normals]).astype(np.float32)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor(animal.mesh.vertices.astype(np.float32)),
        o3d.core.Tensor(animal.mesh.triangles.astype(np.uint32)),
    )
    thickness = 1000 * scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()
    assert np.percentile(thickness, 1) == pytest.approx(7.4, abs=0.3)
    lost = metrics.nearest_distances(points, downsample.voxel_downsample(points, 0.006)).mean()
    assert 1000 * lost == pytest.approx(2.06, abs=0.06)


def test_the_budgets_row():
    """10 mm cubes move exact points about 1.5 m away by some hundredths of a millimetre from the surface."""
    room = load("living_room")
    frame, c = room.frames[15], room.camera
    truth = room.truth["depth"][15]
    v, u = np.indices(truth.shape)
    exact = np.stack([(u - c.cx) * truth / c.fx, (v - c.cy) * truth / c.fy, truth], axis=-1)[truth > 0]
    kept = downsample.voxel_downsample(exact, 0.01)
    near = np.abs(kept[:, 2] - 1.5) < 0.1
    off = 1000 * metrics.distance_to_surface(transforms.apply(frame.T_world_camera, kept[near]), room.mesh).mean()
    assert off == pytest.approx(0.015, abs=0.01)


def test_normals_of_the_animal(lesson, points, true):
    found = normals.estimate_normals(points, k=30)
    assert np.median(lesson["degrees_off"](found, true)) == pytest.approx(0.75, abs=0.03)
    nearest = cKDTree(points).query(points[:500], k=30)[1]
    ours = np.array([lesson["normal_of"](points[i])[0] for i in nearest])
    assert np.abs((ours * found[:500]).sum(axis=1)).min() > 1 - 1e-6


def test_three_slips(lesson, points, true):
    """A row is 51 degrees off, the largest eigenvalue 90, points that were not centred 29."""
    nearest = cKDTree(points).query(points[::20], k=30)[1]
    moved = points[nearest] + [0.2, 0.1, 1.0]
    offsets = moved - moved.mean(axis=1, keepdims=True)
    vectors = np.linalg.eigh(np.swapaxes(offsets, 1, 2) @ offsets)[1]
    uncentred = np.linalg.eigh(np.swapaxes(moved, 1, 2) @ moved)[1]
    off = [
        np.median(lesson["degrees_off"](wrong, true[::20]))
        for wrong in (vectors[:, :, 0], vectors[:, 0, :], vectors[:, :, 2], uncentred[:, :, 0])
    ]
    assert off == pytest.approx([0.76, 51, 90, 29], abs=2)


def test_the_best_number_of_neighbours_grows_with_the_noise(lesson, points, true):
    best = []
    for noise in (0.0003, 0.001):
        noisy = points + noise * np.random.default_rng(1).standard_normal(points.shape)
        curve = {
            k: np.median(lesson["degrees_off"](normals.estimate_normals(noisy, k=k), true)) for k in (10, 50, 100, 200)
        }
        best.append(min(curve, key=curve.get))
        assert curve[200] > curve[best[-1]] < curve[10]
    assert best == [50, 100]


def test_the_viewpoint_must_be_in_the_frame_of_the_points(lesson):
    frame = load("living_room").frames[15]
    scan = pointcloud.from_frame(frame).points
    scan = downsample.voxel_downsample(scan[scan[:, 2] < 2.2], 0.01)
    raw = normals.estimate_normals(scan, k=30)
    turned = lesson["towards"](raw, scan, np.zeros(3))
    assert ((turned * scan).sum(axis=1) <= 0).all()
    assert ((raw * scan).sum(axis=1) <= 0).mean() == pytest.approx(0.046, abs=0.01)
    T = frame.T_world_camera
    world = turned @ T[:3, :3].T
    lazy = lesson["towards"](world, transforms.apply(T, scan), np.zeros(3))
    assert ((lazy * world).sum(axis=1) < 0).mean() == pytest.approx(0.66, abs=0.02)


def test_the_three_angles_of_fpfh_are_bend_twist_and_rise_in_this_order():
    """Open3D's 33 numbers, rebuilt from what the lesson says of them."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-1, 1, (2, 60))
    points = np.column_stack([x, y, 0.3 * x**2 + 0.2 * x * y])
    arrows = np.column_stack([-0.6 * x - 0.2 * y, -0.2 * x, np.ones(60)])
    arrows /= np.linalg.norm(arrows, axis=1, keepdims=True)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = o3d.utility.Vector3dVector(arrows)
    search = o3d.geometry.KDTreeSearchParamRadius(0.5)
    theirs = o3d.pipelines.registration.compute_fpfh_feature(cloud, search).data.T.reshape(60, 3, 11)

    def angles(i: int, j: int) -> tuple[float, float, float]:
        line = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
        first, second = arrows[i], arrows[j]
        if abs(first @ line) < abs(second @ line):  # begin where the normal lies nearer to the line
            first, second, line = second, first, -line
        side = np.cross(line, first)
        side /= np.linalg.norm(side)
        forwards = np.cross(first, side)
        return np.arctan2(forwards @ second, first @ second) / np.pi, side @ second, first @ line

    around = [[j for j in near if j != i] for i, near in enumerate(cKDTree(points).query_ball_point(points, 0.5))]
    own = np.zeros((60, 3, 11))
    for i, near in enumerate(around):
        for j in near:
            for histogram, value in zip(own[i], angles(i, j), strict=True):
                histogram[min(int(11 * (value + 1) / 2), 10)] += 100 / len(near)
    for i, near in enumerate(around):
        weights = 1 / ((points[near] - points[i]) ** 2).sum(axis=1)
        added = np.tensordot(weights / weights.sum(), own[near], 1)
        np.testing.assert_allclose(theirs[i], own[i] + added, atol=1e-9)


def test_fpfh_of_a_plane_a_ball_and_an_edge(lesson):
    """On a plane each angle has one bin; on a ball few; where planes meet many. Angles do not change when all turns."""
    rng = np.random.default_rng(5)
    plane = np.column_stack([rng.uniform(-0.2, 0.2, (9000, 2)), np.full(9000, 1.0)])
    arrows = rng.normal(size=(9000, 3))
    ball = 0.1 * arrows / np.linalg.norm(arrows, axis=1, keepdims=True) + [0, 0, 1.0]
    half = plane - [0, 0, 1.0]
    edge = np.concatenate([half[half[:, 0] > 0], half[half[:, 0] > 0][:, [2, 1, 0]]]) + [0, 0, 1.0]
    bins = {}
    for name, cloud, spot in (("plane", plane, [0, 0, 1]), ("ball", ball, [0, 0, 0.9]), ("edge", edge, [0, 0, 1])):
        where, _, fpfh = lesson["describe"](cloud, 0.01)
        i = np.argmin(np.linalg.norm(where - spot, axis=1))
        assert fpfh[i].sum() == pytest.approx(600, abs=1)
        bins[name] = int((fpfh[i] > 10).sum())
    assert bins["plane"] == 3
    assert bins["plane"] < bins["ball"] < bins["edge"]


@pytest.fixture(scope="module")
def by_origin() -> dict:
    """Noise left on a sheet of 2 mm noise, and how much of an edge is rounded off, over 16 origins, in mm."""
    rng = np.random.default_rng(6)
    n = 60_000
    sheet = np.column_stack([rng.uniform(0, 0.4, (n, 2)), 0.002 * rng.standard_normal(n)])
    side = rng.uniform(0, 0.4, (n, 2))
    corner = np.concatenate([np.column_stack([side, np.zeros(n)]), np.column_stack([np.zeros(n), side])])
    found = {}
    for voxel in (0.002, 0.005, 0.01, 0.02, 0.04):
        flat, cut = [], []
        for start in rng.uniform(0, voxel, (16, 3)):
            flat.append(1000 * np.std(downsample.voxel_downsample(sheet, voxel, start)[:, 2]))
            edge = downsample.voxel_downsample(corner, voxel, start)
            cut.append(1000 * np.minimum(edge[:, 0], edge[:, 2]).max())
        found[voxel] = min(flat), max(flat), np.mean(cut)
    return found


def test_noise_reduction_is_three_things(by_origin):
    """Small voxels let noise grow; large ones average it if no face cuts the sheet; every one rounds the edge off."""
    assert by_origin[0.005][1] > 2.4, "more than the 2 mm that went in"
    assert by_origin[0.04][0] < 0.15, "averaged, with a lucky origin"
    assert by_origin[0.04][1] > 2.4, "two layers, with an unlucky one"
    edges = [cut for _, _, cut in by_origin.values()]
    assert edges == sorted(edges) and edges[-1] > 2.5


def test_how_often_a_voxel_grid_halves_the_noise():
    """2 mm of noise, 100 origins: never with 10 mm, for a third of them with 20 mm, for two thirds with 40 mm."""
    rng = np.random.default_rng(6)
    sheet = np.column_stack([rng.uniform(0, 0.2, (15_000, 2)), 0.002 * rng.standard_normal(15_000)])
    share = [
        np.mean(
            [
                np.std(downsample.voxel_downsample(sheet, voxel, start)[:, 2]) < 0.001
                for start in rng.uniform(0, voxel, (100, 3))
            ]
        )
        for voxel in (0.01, 0.02, 0.04)
    ]
    assert share == pytest.approx([0, 0.33, 0.67], abs=0.1)


def test_the_average_over_a_cube_is_noise_over_root_n():
    """When one layer of cubes holds the sheet: sigma over the root of the points in a cube."""
    rng = np.random.default_rng(7)
    sheet = np.column_stack([rng.uniform(0, 0.4, (100_000, 2)), 0.002 * rng.standard_normal(100_000)])
    grid = downsample.voxel_grid(sheet, 0.02, (0, 0, -0.01))
    kept = downsample.voxel_downsample(sheet, 0.02, (0, 0, -0.01))
    assert np.std(kept[:, 2]) == pytest.approx(0.002 * np.sqrt(np.mean(1 / grid.count)), rel=0.1)


def test_the_reports_function_at_its_own_voxel(lesson, points, true):
    """0.05: a few dozen points, normals 44 degrees off, and features that see the whole animal."""
    moved = points - [0, 1.0, 0]
    for voxel, size, degrees, share in ((0.05, 39, 44, 100), (0.005, 3063, 4.9, 4.1)):
        where, found, fpfh = lesson["describe"](moved, voxel)
        assert len(where) == size and fpfh.shape == (size, 33)
        owner = cKDTree(moved).query(where)[1]
        assert np.median(lesson["degrees_off"](found, true[owner])) == pytest.approx(degrees, rel=0.1)
        around = [len(x) for x in cKDTree(where).query_ball_point(where, 5 * voxel)]
        assert 100 * np.mean(around) / size == pytest.approx(share, rel=0.05)


def test_a_thin_board_loses_its_sides_for_six_origins_in_ten():
    rng = np.random.default_rng(8)
    board = np.column_stack([rng.uniform(0, 0.5, (40_000, 2)), 0.008 * rng.integers(0, 2, 40_000)])
    merged = []
    for start in np.arange(20) / 20 * 0.02:
        kept = downsample.voxel_downsample(board, 0.02, [0, 0, start])
        merged.append(np.abs(kept[:, 2] - 0.004).max() < 0.002)
    assert np.mean(merged) == pytest.approx(0.6, abs=0.05), "one minus thickness over voxel"


def test_the_bunny_of_the_report(lesson):
    bunny = load("stanford_bunny").cloud.points.astype(float)
    counts = {
        "zero": np.floor(bunny / 0.05),
        "lowest": np.floor((bunny - bunny.min(axis=0)) / 0.05),
        "rounded": np.rint(bunny / 0.05),
        "int()": (bunny / 0.05).astype(int),
    }
    assert {name: len(np.unique(i, axis=0)) for name, i in counts.items()} == {
        "zero": 32, "lowest": 26, "rounded": 35, "int()": 14,
    }  # fmt: skip
    ratio = len(lesson["voxel_grid"](bunny, 0.005)[0]) / len(lesson["voxel_grid"](bunny, 0.01)[0])
    assert ratio == pytest.approx(3.97, abs=0.1)


def test_the_letters_of_task_4_are_those_of_its_picture():
    """The arrays of the five clouds are those that the task's truth names, told by what each mistake leaves."""
    drawn = data.of_lab("04")
    scene, right = drawn["scene"], drawn["right"]
    found = {}
    for letter in CAUSE_OF:
        cloud = drawn[letter]
        measured = cKDTree(scene).query(cloud)[0]
        if measured.max() == 0:
            found[letter] = "every k-th point"
        elif np.allclose(cloud / 0.2 - 0.5, np.rint(cloud / 0.2 - 0.5)):
            found[letter] = "centres of the cubes"
        elif len(np.unique(np.floor(cloud[:, 0] / 0.2))) == len(cloud):
            found[letter] = "height left out"
        else:
            shared = (cKDTree(right).query(cloud)[0] < 1e-9).mean()
            found[letter] = "int() for floor()" if shared > 0.5 else "twice the voxel"
    assert found == CAUSE_OF


@pytest.mark.parametrize("seed", range(5))
def test_a_voxel_grid_earns_a_quarter_of_task_5_and_farthest_points_all(seed):
    task = tasks.get("04-5")
    cases = tasks.fresh(task, seed)

    def by_grid(points: np.ndarray, count: int) -> np.ndarray:
        low, high = 0.05, 2.0  # the smallest voxel that keeps no more than count
        for _ in range(20):
            middle = (low + high) / 2
            many = len(downsample.voxel_downsample(points, middle)) > count
            low, high = (middle, high) if many else (low, middle)
        kept = downsample.voxel_downsample(points, high, representative="nearest")
        chosen = np.unique(cKDTree(points).query(kept)[1])
        rest = np.setdiff1d(np.arange(len(points)), chosen)
        return np.concatenate([chosen, rest[: count - len(chosen)]])

    scores = [
        tasks.judge_all(task, cases, tasks.run_all(function, cases)).score
        for function in (by_grid, downsample.sample_farthest)
    ]
    assert 0 < scores[0] < 0.5
    assert scores[1] == 1.0


def test_task_1_tells_the_first_wrong_number_beside_the_right_one():
    task = tasks.get("04-1")
    cases = tasks.fresh(task, 0)
    outcomes = tasks.run_all(lambda points, voxel, origin: ((points - origin) / voxel).astype(int), cases[:1])
    message = tasks.judge_all(task, cases[:1], outcomes).error
    assert message == "Row 1, x: expected -1, got 0 (1 of 2 rows are wrong)."


def test_task_5_tells_your_own_gap_and_the_next_band():
    task = tasks.get("04-5")
    cases = tasks.fresh(task, 0)
    said = {}
    for name, function in (
        ("first", lambda points, count: np.arange(count)),
        ("random", lambda points, count: np.random.default_rng(0).choice(len(points), count, replace=False)),
        ("farthest", downsample.sample_farthest),
    ):
        said[name] = tasks.judge_all(task, cases, tasks.run_all(function, cases)).error
    assert re.match(r"The widest gap is 2\.\d+ m, in no band yet; the next band begins under 430 mm\.", said["first"])
    assert re.match(r"The widest gap is \d{3} mm, .*; the next band begins under \d{3} mm\.", said["random"])
    assert re.match(r"The widest gap is 2\d\d mm, under \d{3} mm\.", said["farthest"])
