"""The numbers that lesson 02 and its lab live on, each with a tolerance; the functions are the lesson's own."""

from __future__ import annotations

import re
import runpy
import struct
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
from lesson_helpers import functions_in, functions_of

from course_lib import tasks
from course_lib.cloud import pointcloud
from course_lib.geometry import transforms
from course_lib.tasks.diagnosis.recognition import load_source
from course_lib.tasks.sources import forbidden

ROOT = Path(__file__).parents[2]
LAB = ROOT / "solutions" / "source" / "02_point_clouds.py"
PICTURES = LAB.parent / "pictures" / LAB.name


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
    def read_points(data, height, width, point_step, row_step, offsets, big_endian):
        letter = ">f" if big_endian else "<f"
        starts = [v * row_step + u * point_step for v in range(height) for u in range(width)]
        return np.array([[struct.unpack_from(letter, data, start + at)[0] for at in offsets] for start in starts])

    task = tasks.get("02-2")
    cases = tasks.fresh(task, 0)
    assert forbidden(task, read_points) == ""
    assert tasks.judge_all(task, cases, tasks.run_all(read_points, cases)).score == 1


def test_any_inverse_may_be_called_on_the_way_back():
    def invert(T_world_robot, T_robot_cameras, points):
        ways = [np.linalg.inv(T_world_robot @ T_robot_camera) for T_robot_camera in T_robot_cameras]
        return np.array([points @ back[:3, :3].T + back[:3, 3] for back in ways])

    task = tasks.get("02-3")
    cases = tasks.fresh(task, 0)
    assert forbidden(task, invert) == ""
    assert tasks.judge_all(task, cases, tasks.run_all(invert, cases)).score == 1


def way_back(after: str = ""):
    """A way back that overwrites `points`; `after` is what it does with them before the next camera."""
    return load_source(
        "def invert(T_world_robot, T_robot_cameras, points):\n"
        "    given, seen = points.copy(), []\n"
        "    for T_robot_camera in T_robot_cameras:\n"
        "        T = T_world_robot @ T_robot_camera\n"
        "        points -= T[:3, 3]\n"
        f"        seen.append(points @ T[:3, :3])\n        {after}\n"
        "    return np.array(seen)\n",
        "invert",
    )


def test_points_that_are_overwritten_are_wrong_for_the_next_camera():
    task = tasks.get("02-3")
    cases = tasks.fresh(task, 0)
    result = tasks.judge_all(task, cases, tasks.run_all(way_back(), cases))
    assert result.score == 0 and not any(verdict.passed for verdict in result.verdicts)
    assert len(cases[result.worst].given["T_robot_cameras"]) > 1, "where the answer is wrong, too"
    assert "input overwritten" in result.diagnosis.names and "moved on left in" in result.diagnosis.names


def test_points_come_out_of_the_way_back_as_they_went_in():
    """Added again they come back rounded, which a caller may not want; put back as they were they are right."""
    task = tasks.get("02-3")
    cases = tasks.fresh(task, 0)
    added, put_back = (
        tasks.judge_all(task, cases, tasks.run_all(way_back(after), cases))
        for after in ("points += T[:3, 3]", "points[:] = given")
    )
    assert put_back.score == 1
    assert added.score == 0 and added.diagnosis.names == ("input overwritten",)
    assert added.error == (
        "It changes `points`, which whoever called it still needs: work on a copy (p = points - t makes one, "
        "points -= t does not)."
    )


def test_padding_may_be_as_long_as_points():
    """So that whoever reads as many points of a row as fit into it reads too many."""
    cases = tasks.fresh(tasks.get("02-2"), 0)
    spare = [c.given["row_step"] - c.given["width"] * c.given["point_step"] >= c.given["point_step"] for c in cases]
    assert sum(spare) == 1


def test_each_case_of_the_thinned_list_tells_what_it_is_there_for():
    """Where the step divides the width one column too many shows, where it does not the lost last column."""
    task = tasks.get("02-1")
    sources = {mistake.name: mistake.source for mistake in task.misconceptions}
    for case in tasks.fresh(task, 0):
        divides = case.given["width"] % case.given["step"] == 0
        lost, extra = (
            task.judge(case, load_source(sources[name], "row_of")(**case.given)).passed
            for name in ("the last column lost", "one column too many")
        )
        assert (lost, extra) == (divides, not divides)


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
        np.array([field.offset for field in message.fields[:3]]), message.is_bigendian,
    )  # fmt: skip
    assert np.array_equal(xyz, office.reshape(-1, 3).astype(float), equal_nan=True)


@pytest.fixture(scope="module")
def shown() -> dict[str, np.ndarray]:
    """What the lab's pictures are drawn from, as its maker makes it."""
    return runpy.run_path(str(PICTURES))["arrays"]()


def test_the_letters_of_task_4_are_those_of_its_picture(shown):
    """What each letter shows, measured: the task's truth must name it."""
    truth = tasks.fresh(tasks.get("02-4"), 0)[0].truth
    for letter, cause in truth.items():
        grey, moved = (shown[f"{name}_{letter}"].astype(float) for name in ("right", "wrong"))
        a, b = ((points - points.mean(axis=0)) @ [1, 1j] for points in (grey, moved))
        best = np.vdot(a, b) / np.vdot(a, a)  # the turn and scale that bring grey nearest
        rest = np.linalg.norm(b - best * a) / np.linalg.norm(b)
        turn = np.degrees(np.angle(best))
        assert (rest > 0.5) == (cause == "stride")
        if cause != "stride":
            assert abs(best) == pytest.approx(1000 if cause == "millimetres" else 1, rel=0.01)
            assert turn == pytest.approx(-80 if cause == "inverse" else 0, abs=0.5)
        if cause == "shift first":  # R t in the place of t
            assert np.degrees(np.angle((moved - grey).mean(axis=0) @ [1, 1j])) == pytest.approx(110, abs=0.5)
        alone = np.abs(grey - shown["right"]).max() < 1e-3
        assert alone == (cause != "order"), "only there grey is moved by two poses"


@pytest.mark.parametrize(
    ("answer", "names"),
    [(np.zeros(60, int), ["the kept one again", "one length for all"]), (np.arange(60) // 2, [])],
)
def test_repeated_rows_are_a_misconception_only_where_they_are_its_own(answer, names):
    task = tasks.get("02-5")
    cases = tasks.fresh(task, 0)
    result = tasks.judge_all(task, cases, tasks.run_all(lambda points, n: answer, cases))
    assert result.score == 0 and "different" in result.error
    assert [mistake.name for mistake in result.recognised] == names


def test_a_bare_side_is_told_with_its_length():
    def few(points, n):
        _, first = np.unique(np.floor(points / 0.05).astype(int), axis=0, return_index=True)
        return first[:n]

    task = tasks.get("02-5")
    for seed in range(5):
        cases = tasks.fresh(task, seed)
        result = tasks.judge_all(task, cases, tasks.run_all(few, cases))
        assert result.diagnosis.names == ("a side left bare",)
        points = cases[result.worst].given["points"]
        bare = points[:, 0].max() - points[few(points, 60), 0].max()
        assert f"in the last {1000 * bare:.0f} mm of the shape along x" in result.looks_like


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
