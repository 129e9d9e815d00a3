"""The numbers that lesson 02 and its lab live on, each with a tolerance; the functions are the lesson's own."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
from lesson_helpers import functions_in, functions_of

from course_lib import tasks
from course_lib.cloud import pointcloud
from course_lib.geometry import transforms
from course_lib.tasks.sources import forbidden

ROOT = Path(__file__).parents[2]
LAB = ROOT / "solutions" / "source" / "02_point_clouds.py"


@pytest.fixture(scope="module")
def lesson() -> dict:
    """The functions that the lesson defines, by name."""
    return functions_of("02", "count row_of point_at meet apply invert careless_invert", np=np, struct=struct)


@pytest.fixture(scope="module")
def turning() -> np.ndarray:
    """A pose that turns by 30 degrees about y and shifts by (1, 0, 0.5) metres."""
    return transforms.from_rotation_translation(transforms.rotation_y(np.radians(30))[:3, :3], [1, 0, 0.5])


@pytest.fixture(scope="module")
def organised() -> np.ndarray:
    """A cloud of 6 rows and 8 columns, some of it not measured."""
    points = np.random.default_rng(0).uniform(-2, 3, (6, 8, 3)).astype(np.float32)
    points[2, 5] = np.nan
    return points


def test_row_of_is_the_order_of_reshape(lesson, organised):
    listed = organised.reshape(-1, 3)
    for v, u in np.ndindex(6, 8):
        assert np.array_equal(listed[lesson["row_of"](u, v, 8)], organised[v, u], equal_nan=True)


@pytest.mark.parametrize("row_padding", [0, 20])
@pytest.mark.parametrize("name", ["PointXYZ", "PointXYZRGB", "PointNormal"])
def test_point_at_finds_each_point_in_the_bytes(lesson, organised, name, row_padding):
    structured = np.zeros(organised.shape[:2], pointcloud.POINT_TYPES[name])
    structured["x"], structured["y"], structured["z"] = np.moveaxis(organised, -1, 0)
    message = pointcloud.to_message(structured, row_padding=row_padding)
    for v, u in np.ndindex(6, 8):
        assert np.array_equal(lesson["point_at"](message, u, v), organised[v, u], equal_nan=True)


def test_sizes_of_the_lectures_point_types():
    sizes = {name: kind.itemsize for name, kind in pointcloud.POINT_TYPES.items()}
    assert sizes == {
        "PointXYZ": 16, "PointXYZI": 32, "PointXYZRGB": 32, "PointXYZRGBA": 32, "Normal": 32, "PointNormal": 48
    }  # fmt: skip
    assert 640 * 480 * 30 * sizes["PointXYZRGB"] / 1e6 == pytest.approx(294.912)


def test_apply_and_invert_are_the_librarys(lesson, turning):
    points = np.random.default_rng(1).normal(size=(500, 3))
    theirs = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).transform(turning)
    assert np.allclose(lesson["apply"](turning, points), theirs.points, atol=1e-12)
    assert np.allclose(lesson["apply"](turning, points), transforms.apply(turning, points), atol=1e-12)
    assert np.allclose(lesson["invert"](turning), np.linalg.inv(turning), atol=1e-12)
    back = lesson["apply"](lesson["invert"](turning), lesson["apply"](turning, points))
    assert np.abs(back - points).max() < 1e-12


def test_minus_t_is_off_by_more_than_half_a_metre(lesson, turning):
    """30 degrees and a shift of 1.12 m: 0.58 m, the same for every point, and nothing without a turn."""
    points = np.random.default_rng(1).normal(size=(500, 3))
    right = lesson["apply"](lesson["invert"](turning), points)
    off = np.linalg.norm(lesson["apply"](lesson["careless_invert"](turning), points) - right, axis=1)
    assert off.mean() == pytest.approx(2 * np.sin(np.radians(15)) * np.hypot(1, 0.5), abs=1e-9)
    assert off.mean() == pytest.approx(0.579, abs=1e-3) and off.std() < 1e-9
    straight = transforms.from_rotation_translation(np.eye(3), [1, 0, 0.5])
    assert np.allclose(lesson["careless_invert"](straight), lesson["invert"](straight))


def test_shift_first_lands_elsewhere(lesson, turning):
    p = np.array([[1.0, 0.0, 0.0]])
    assert lesson["apply"](turning, p) == pytest.approx(np.array([[1.866, 0, 0]]), abs=1e-3)
    assert (p + turning[:3, 3]) @ turning[:3, :3].T == pytest.approx(np.array([[1.982, 0, -0.567]]), abs=1e-3)


def test_two_rays_meet_where_the_point_is(lesson):
    """A point 0.4 m to the right and 2.5 m ahead, seen from 0 and from 0.15 m to the right."""
    a, b = np.array([0.4 / 2.5]), np.array([(0.4 - 0.15) / 2.5])
    assert lesson["meet"](a, b, 0.15) == pytest.approx(2.5, abs=1e-6)
    assert lesson["meet"](a, a, 0.15) == 0, "parallel rays meet nowhere"


def test_rounding_is_below_a_thousandth_of_a_millimetre_indoors_and_half_a_metre_on_a_map(lesson, turning):
    points = np.random.default_rng(1).uniform(-4, 4, (5000, 3))
    stored = lesson["apply"](turning, points).astype(np.float32).astype(float)
    moved = np.linalg.norm(lesson["apply"](lesson["invert"](turning), stored) - points, axis=1)
    assert 1e-8 < np.sqrt((moved**2).mean()) < 1e-6
    assert np.spacing(np.float32(5e6)) == 0.5


def _load(name: str):
    from course_lib.notebook import data

    if not data.available(name):
        pytest.skip(f"the real data {name} are not on this machine")
    return data.load(name)


def test_the_bunny_has_35947_points(lesson):
    path = _load("stanford_bunny").files["bun_zipper.ply"]
    header = path.read_bytes().split(b"end_header")[0].decode("ascii")
    assert len(o3d.io.read_point_cloud(str(path)).points) == lesson["count"](header, "vertex") == 35_947
    assert lesson["count"](header, "face") == 69_451


def test_the_pose_brings_the_raw_scans_together(lesson):
    from course_lib.surface import metrics

    real = _load("stanford_bunny")
    first = lesson["apply"](real.reference["scan_poses"]["bun000"], real.clouds["bun000"].points)
    T, scan = real.reference["scan_poses"]["bun045"], real.clouds["bun045"].points
    raw, posed = (np.median(metrics.nearest_distances(p, first)) for p in (scan, lesson["apply"](T, scan)))
    assert posed < 0.0006 < 5 * posed < raw
    right, careless = (
        np.median(metrics.nearest_distances(lesson["apply"](lesson[undo](T), first), scan))
        for undo in ("invert", "careless_invert")
    )
    assert right < 0.0006 < 5 * right < careless, "only the shift is wrong"


def test_the_missing_of_the_real_kinect_cloud_is_mostly_its_border():
    from course_lib.notebook import files

    hole = np.isnan(files.read_organised(_load("pcl_tests").files["office1.pcd"])[0][..., 2])
    rows, columns = np.flatnonzero(~hole.all(axis=1)), np.flatnonzero(~hole.all(axis=0))
    inside = hole[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    assert inside.sum() < 0.5 * hole.sum() and inside.mean() < (_load("living_room").frames[0].depth == 0).mean()


def test_the_labs_reader_may_unpack_with_struct():
    def read_points(data, height, width, point_step, row_step, x_offset, big_endian):
        letters = ">3f" if big_endian else "<3f"
        starts = [v * row_step + u * point_step + x_offset for v in range(height) for u in range(width)]
        return np.array([struct.unpack_from(letters, data, start) for start in starts])

    task = tasks.get("02-2")
    cases = tasks.fresh(task, 0)
    assert forbidden(task, read_points) == ""
    assert tasks.judge_all(task, cases, tasks.run_all(read_points, cases)).score == 1


def test_the_unmended_inverse_earns_nothing(lesson):
    task = tasks.get("02-3")
    cases = tasks.fresh(task, 0)
    for name, score in (("careless_invert", 0), ("invert", 1)):
        assert tasks.judge_all(task, cases, tasks.run_all(lesson[name], cases)).score == score


def test_the_labs_reader_reads_the_real_message():
    from course_lib.notebook import files

    office, _ = files.read_organised(_load("pcl_tests").files["office1.pcd"])
    assert office.shape == (480, 640, 3)
    structured = np.zeros(office.shape[:2], pointcloud.POINT_TYPES["PointXYZRGB"])
    structured["x"], structured["y"], structured["z"] = np.moveaxis(office, -1, 0)
    message = pointcloud.to_message(structured, row_padding=64)
    read_points = functions_in(LAB, "read_points", np=np, struct=struct)["read_points"]
    xyz = read_points(
        np.frombuffer(message.data, np.uint8), message.height, message.width, message.point_step, message.row_step,
        message.fields[0].offset, message.is_bigendian,
    )  # fmt: skip
    assert np.array_equal(xyz, office.reshape(-1, 3).astype(float), equal_nan=True)


def test_the_letters_of_task_4_are_those_of_its_picture():
    """The lab shuffles its five clouds by a seed; the task's truth must name them in that order."""
    source = LAB.read_text(encoding="utf-8")
    lines = source.split("makers = [\n")[1].split("\n]")[0].split("\n")
    marks = {
        "shift first": "flat + first[:2, 2]", "inverse": "np.linalg.inv(first)", "order": "move(second, flat))",
        "millimetres": "1000 * flat", "stride": "strided",
    }  # fmt: skip
    made = [next(cause for cause, mark in marks.items() if mark in line) for line in lines]
    seed = int(re.search(r"default_rng\((\d+)\)\.permutation\(5\)", source)[1])
    order = np.random.default_rng(seed).permutation(5)
    truth = tasks.fresh(tasks.get("02-4"), 0)[0].truth
    assert {letter: made[i] for letter, i in zip("ABCDE", order, strict=True)} == truth


@pytest.mark.parametrize("answer", [np.zeros(60, int), np.arange(60) // 2])
def test_repeated_rows_are_no_misconception(answer):
    task = tasks.get("02-5")
    cases = tasks.fresh(task, 0)
    result = tasks.judge_all(task, cases, tasks.run_all(lambda points, n: answer, cases))
    assert result.score == 0 and "different" in result.error and not result.recognised


def test_few_says_the_learners_own_distance():
    task = tasks.get("02-5")
    case = tasks.fresh(task, 0)[0]
    said = task.judge(case, np.arange(60)).message
    assert re.match(r"The loneliest point's distance is \d+ mm, in no band yet", said)


def test_farthest_point_sampling_reaches_the_highest_band_and_blind_rows_do_not():
    task = tasks.get("02-5")
    few = functions_in(LAB, "few", np=np, struct=struct)["few"]
    for seed in range(5):
        cases = tasks.fresh(task, seed)
        assert tasks.judge_all(task, cases, tasks.run_all(few, cases)).score == 1
        blind = task.guess(np.random.default_rng(seed))
        assert tasks.judge_all(task, cases, tasks.run_all(blind, cases)).score < 0.5
