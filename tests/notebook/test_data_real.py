"""Real datasets, read from the mirror: what is in them, and that their numbers mean what the catalogue says."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from data_helpers import MIRROR, needs_mirror

from course_lib.geometry import transforms
from course_lib.notebook import _camera_files, _catalog, _poses, _real, data, files
from course_lib.notebook._errors import DataDamaged, Refusal
from course_lib.surface.metrics import nearest_distances

pytestmark = needs_mirror


@pytest.fixture
def own_mirror(tmp_path, monkeypatch):
    """A mirror of one dataset that a test may spoil, and an empty cache."""
    entry = _catalog.entry("tum_pair")
    for one in entry.files:
        target = tmp_path / "mirror" / one.path
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(Path(MIRROR) / one.path, target)
    monkeypatch.setenv("COURSE_DATA_MIRROR", str(tmp_path / "mirror"))
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "mirror" / entry.files[1].path


def test_the_bunny():
    bunny = data.load("stanford_bunny")
    assert len(bunny.cloud) == 35947 and len(bunny.mesh.triangles) == 69451
    assert {name: len(cloud) for name, cloud in bunny.clouds.items()} == {
        "bun_zipper": 35947,
        "bun_zipper_res2": 8171,
        "bun_zipper_res3": 1889,
        "bun_zipper_res4": 453,
        "bun000": 40256,
        "bun045": 40097,
    }
    size = np.ptp(bunny.cloud.points, axis=0)
    np.testing.assert_allclose(size, [0.156, 0.154, 0.121], atol=0.002)
    assert bunny.kind == "real" and "no commercial use" in bunny.licence


def test_the_scan_poses_put_one_scan_on_the_other():
    bunny = data.load("stanford_bunny")
    T = bunny.reference["scan_poses"]["bun045"]
    scan, other = bunny.clouds["bun045"].points[::20], bunny.clouds["bun000"].points
    assert np.median(nearest_distances(transforms.apply(T, scan), other)) < 0.0005
    as_written = T.copy()
    as_written[:3, :3] = T[:3, :3].T
    assert np.median(nearest_distances(transforms.apply(as_written, scan), other)) > 0.01
    np.testing.assert_allclose(bunny.reference["scan_poses"]["bun000"], np.eye(4), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "count", "median", "measured"),
    [
        ("tum_pair", 1, 2.415, 0.81),
        ("sun_pair", 1, 2.723, 0.82),
        ("nyu_pair", 1, 3.268, 0.93),
        ("redwood_frames", 5, 1.861, 0.87),
        ("realsense_planes", 11, 1.078, 0.996),
        ("realsense_slam", 10, 1.22, 0.90),
        ("tum_slambook", 5, 2.915, 0.68),
    ],
)
def test_frames_are_in_metres(name, count, median, measured):
    dataset = data.load(name)
    assert len(dataset.frames) == count
    frame = dataset.frames[0]
    valid = frame.depth > 0
    assert frame.depth.dtype == np.float32 and frame.color.shape == (480, 640, 3)
    assert np.median(frame.depth[valid]) == pytest.approx(median, abs=0.01)
    assert valid.mean() == pytest.approx(measured, abs=0.01)
    assert frame.camera == dataset.camera and dataset.camera.source
    color, raw = dataset.raw(0)
    assert raw.dtype == np.uint16 and (color == frame.color).all()
    assert frame.registered == (name not in ("nyu_pair", "realsense_slam"))


def test_colours_are_rgb():
    blue = data.load("tum_pair").frames[0].color[10:40, 50:90].reshape(-1, 3)  # the globe's sea
    assert np.median(blue[:, 2]) > np.median(blue[:, 0]) + 20


def test_the_given_intrinsics_are_read():
    assert data.load("realsense_planes").camera.fx == 617.25
    assert data.load("redwood_frames").camera.cx == 319.5


def warped_correlation(first, second, scale: float) -> float:
    """How well the second picture agrees with the first when carried over by depth, poses and intrinsics."""
    camera, depth = first.camera, first.depth.astype(np.float64) * scale
    v, u = np.mgrid[: camera.height, : camera.width]
    points = np.stack([(u - camera.cx) * depth / camera.fx, (v - camera.cy) * depth / camera.fy, depth], axis=-1)
    moved = transforms.apply(transforms.invert(second.T_world_camera) @ first.T_world_camera, points)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = moved[..., 0] / moved[..., 2] * camera.fx + camera.cx
        y = moved[..., 1] / moved[..., 2] * camera.fy + camera.cy
    seen = (depth > 0) & (moved[..., 2] > 0) & (x > 15) & (x < 625) & (y > 15) & (y < 465)
    grey = [cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY).astype(np.float32) for frame in (first, second)]
    warped = cv2.remap(grey[1], x.astype(np.float32), y.astype(np.float32), cv2.INTER_LINEAR)
    return float(np.corrcoef(warped[seen], grey[0][seen])[0, 1])


def test_the_five_frames_of_slambook_are_millimetres_and_their_poses_t_world_camera():
    """The card's claim: 1000 units a metre, not TUM's 5000, is what makes neighbouring frames agree."""
    frames = list(data.load("tum_slambook").frames)
    pairs = list(zip(frames, frames[1:], strict=False))
    assert min(warped_correlation(a, b, 1.0) for a, b in pairs) > 0.9
    assert max(warped_correlation(a, b, 0.2) for a, b in pairs) < 0.7


def test_the_pair_of_slambook_is_tum():
    pair = data.load("tum_slambook").parts["pair"]
    assert len(pair.frames) == 2 and pair.encoding.units_per_metre == 5000 and pair.camera.fx == 520.9
    assert np.median(pair.frames[0].depth[pair.frames[0].depth > 0]) == pytest.approx(1.5, abs=0.1)
    with pytest.raises(KeyError, match="tum_slambook has no 'pairs'. Did you mean pair?"):
        data.load("tum_slambook").parts["pairs"]


def test_the_trajectories_are_of_one_recording():
    reference = data.load("tum_slambook").reference
    times, poses = reference["trajectory_groundtruth"]
    other_times, other = reference["trajectory_estimated"]
    assert poses.shape == (len(times), 4, 4) and len(times) == len(other_times) == len(other) > 500
    assert np.abs(times - other_times).max() < 0.02
    np.testing.assert_allclose(np.linalg.det(poses[:, :3, :3]), 1)
    ends = [np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1).sum() for T in (poses, other)]
    assert ends[0] == pytest.approx(ends[1], rel=0.5)


def test_the_poses_of_redwood_are_t_world_camera():
    dataset = data.load("redwood_frames")
    clouds = []
    for frame in (dataset.frames[0], dataset.frames[4]):
        v, u = np.mgrid[:480:8, :640:8]
        z, c = frame.depth[::8, ::8], frame.camera
        points = np.stack([(u - c.cx) * z / c.fx, (v - c.cy) * z / c.fy, z], axis=-1)[z > 0]
        clouds.append((points, frame.T_world_camera))
    there = [transforms.apply(T, points) for points, T in clouds]
    inverse = [transforms.apply(transforms.invert(T), points) for points, T in clouds]
    assert np.median(nearest_distances(*there)) < 0.5 * np.median(nearest_distances(*inverse))
    trajectory, odometry = dataset.reference["trajectory"], dataset.reference["odometry"]
    motions = [transforms.invert(T[0]) @ T[4] for T in (trajectory, odometry)]
    assert transforms.pose_error(*motions).metres < 0.01


def test_the_organised_clouds_keep_their_gaps():
    dataset = data.load("pcl_tests")
    assert {name: len(cloud) for name, cloud in dataset.clouds.items()} == {
        "office1": 307200,
        "frame_20121214T142255.814212": 307200,
        "frame_20121214T142256.068683": 307200,
        "frame_20121214T142256.332395": 307200,
        "milk_color": 13704,
        "sac_plane_test": 3283,
        "noisy_slice_displaced": 3782,
        "bun0": 397,
        "bun4": 361,
    }
    points, colors = files.read_organised(dataset.files["office1.pcd"])
    assert points.shape == (480, 640, 3) and colors.shape == (480, 640, 3) and colors.dtype == np.uint8
    assert np.isnan(points[..., 2]).sum() == 52744
    assert dataset.clouds["bun0"].normals is not None
    with pytest.raises(Refusal, match="bun0.pcd is not organised .* use read_cloud"):
        files.read_organised(dataset.files["bun0.pcd"])


def test_a_mirror_with_a_wrong_hash_is_named_and_refused(own_mirror):
    assert data.load("tum_pair").frames[0].depth.any()
    content = own_mirror.read_bytes()
    own_mirror.write_bytes(content[:-1] + b"?")
    assert data.available("tum_pair")
    with pytest.raises(DataDamaged) as caught:
        data.load("tum_pair")
    assert str(caught.value) == (
        f"The mirror's file {own_mirror} is not the one of the catalogue (its sha256 differs), so it is refused: "
        "copy it there again, or unset COURSE_DATA_MIRROR."
    )
    own_mirror.write_bytes(content[:1000])
    with pytest.raises(DataDamaged, match="is not the one of the catalogue .its size differs., so it is refused"):
        data.load("tum_pair")


def test_a_good_fetched_copy_stands_in_for_a_bad_mirror(own_mirror, tmp_path):
    entry = _catalog.entry("tum_pair")
    target = tmp_path / "cache" / "real" / entry.files[1].path
    target.parent.mkdir(parents=True)
    shutil.copyfile(own_mirror, target)
    own_mirror.write_bytes(b"spoiled")
    assert data.load("tum_pair").files["depth.png"] == target


def test_a_damaged_fetched_file_is_named(own_mirror, tmp_path, monkeypatch):
    entry = _catalog.entry("tum_pair")
    monkeypatch.delenv("COURSE_DATA_MIRROR")
    shutil.copytree(tmp_path / "mirror", tmp_path / "cache" / "real")
    path = tmp_path / "cache" / "real" / entry.files[1].path
    path.write_bytes(path.read_bytes()[:-1] + b"?")
    with pytest.raises(DataDamaged) as caught:
        data.load("tum_pair")
    assert str(caught.value) == (
        f"{entry.files[1].path} of dataset tum_pair is damaged (its sha256 differs): run `python3 course.py data get "
        "tum_pair` to fetch it again."
    )


def test_each_file_is_hashed_once_in_a_process(own_mirror, monkeypatch):
    hashed = []
    sha256 = _real._stored.sha256
    monkeypatch.setattr(_real._stored, "sha256", lambda path: hashed.append(path.name) or sha256(path))
    data.load("tum_pair")
    data.load("tum_pair")
    assert sorted(hashed) == ["TUM_color.png", "TUM_depth.png"]


@pytest.mark.parametrize("name", [n for n in data.names() if _catalog.entry(n).kind == "real"])
def test_every_file_of_the_mirror_is_the_catalogues(name):
    assert set(_real.locate(_catalog.entry(name))) == {one.name for one in _catalog.entry(name).files}


@pytest.mark.parametrize(
    ("text", "read", "says"),
    [
        ("1 2 3\n", _poses.read_tum, "Line 1 of .* has 3 numbers: time tx ty tz qx qy qz qw on every line was"),
        ("# only\n", _poses.read_tum, "holds no numbers"),
        ("a b c d e f g h\n", _poses.read_tum, "Line 1 of .* is not made of numbers"),
        ("0 0 0 0 2 0 0 0\n", _poses.read_tum, "holds a quaternion of length 2, not 1"),
        ("0 0 0 0 0 0 1 0\n", _poses.read_quaternions, "has 8 numbers"),
        ("0 0 1\n1 0 0 0\n", _poses.read_log, "is cut short or no .log: five lines a frame"),
        ("0 0 1\n2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", _poses.read_log, "is no rotation and translation"),
        ("0 0 1\nx 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", _poses.read_log, "holds a word where a number was expected"),
        ("{", _camera_files.read_camera, "holds no intrinsics that the course reads: give JSON with width"),
        ('{"width": 4}', _camera_files.read_camera, "holds no intrinsics"),
        ("[1]", _camera_files.read_camera, "holds no intrinsics"),
    ],
)
def test_bad_text_files_are_one_sentence(tmp_path, text, read, says):
    path = tmp_path / "given.txt"
    path.write_text(text)
    with pytest.raises(Refusal, match=says):
        read(path)


def test_a_binary_trajectory_is_one_sentence(tmp_path):
    path = tmp_path / "given.txt"
    path.write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(Refusal, match="is not a text file"):
        _poses.read_tum(path)


def test_plain_and_realsense_intrinsics(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text('{"width": 4, "height": 3, "fx": 5, "fy": 6, "ppx": 1.5, "ppy": 1.0}')
    camera = _camera_files.read_camera(path)
    assert (camera.cx, camera.cy, camera.source) == (1.5, 1.0, "read from camera.json")


def test_the_lidar_pair_and_the_motion_between_its_scans():
    pair = data.load("lidar_pair")
    source, target = pair.clouds["source"].points, pair.clouds["target"].points
    assert (len(source), len(target)) == (69_792, 69_088)
    T = pair.reference["T_target_source"]
    error = transforms.pose_error(T, np.eye(4))
    assert error.metres == pytest.approx(0.504, abs=0.001) and error.degrees == pytest.approx(0.716, abs=0.001)

    def median(motion, source, target):
        return np.median(nearest_distances(transforms.apply(motion, source[::50]), target))

    # pulses that never came back lie at 0 0 0 in both scans: with them, no motion seems to fit best
    assert median(np.eye(4), source, target) < median(T, source, target)
    back = [points[(points != 0).any(axis=1)] for points in (source, target)]
    assert [len(source) - len(back[0]), len(target) - len(back[1])] == [5107, 5032]
    assert median(T, *back) < 0.8 * median(np.eye(4), *back)
    assert median(T, *back) < 0.5 * median(transforms.invert(T), *back)  # which way it maps


def test_a_matrix_that_is_none_is_refused(tmp_path):
    (tmp_path / "m.txt").write_text("1 0 0 0\n0 1 0 0\n")
    with pytest.raises(Refusal, match=r"m\.txt has 2 lines of numbers"):
        _poses.read_matrix(tmp_path / "m.txt")


def test_the_feature_clouds():
    clouds = data.load("feature_clouds").clouds
    assert set(clouds) == {"cloud_bin_0", "cloud_bin_1"}
    assert all(len(cloud) > 3000 and np.isfinite(cloud.points).all() for cloud in clouds.values())
