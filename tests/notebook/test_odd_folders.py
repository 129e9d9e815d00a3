"""Recordings as other programs leave them: read whole, or refused in one sentence; nothing vanishes."""

import json

import cv2
import numpy as np
import pytest
from test_data_folder import CAMERA, DEPTH, record, values

from course_lib.camera.pinhole import PinholeCamera, preset
from course_lib.cloud.pointcloud import PointCloud
from course_lib.geometry.transforms import check_rigid, nearest_rigid, rotation_z
from course_lib.notebook import data, files
from course_lib.notebook._camera_files import read_camera
from course_lib.notebook._errors import Refusal
from course_lib.notebook._pairing import nearest_in_time

NAMES = ["0.png", "1.png"]
K = [[10.0, 0.0, 3.5], [0.0, 10.0, 2.5], [0.0, 0.0, 1.0]]
LENS = [0.2, -0.3, 0.01, 0.02, 0.1]
INFO = f"""image_width: 8
image_height: 6
camera_name: a
camera_matrix:
  rows: 3
  cols: 3
  data: {sum(K, [])}
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: {LENS}
"""


@pytest.mark.parametrize(
    ("name", "text", "lens"),
    [
        ("camera.json", json.dumps({"width": 8, "height": 6, "intrinsic_matrix": sum(K, [])}), False),
        (
            "camera.json",
            json.dumps({"width": 8, "height": 6, "intrinsic_matrix": np.transpose(K).ravel().tolist()}),
            False,
        ),
        (
            "camera.json",
            json.dumps({"intrinsic": {"width": 8, "height": 6, "intrinsic_matrix": K}, "extrinsic": []}),
            False,
        ),
        ("camera.json", json.dumps({**CAMERA, "distortion": LENS}), True),
        ("cam_params.json", json.dumps({**CAMERA, "model": "Inverse Brown Conrady", "coeffs": LENS}), True),
        ("camera_info.yaml", INFO, True),
        ("camera_info.yml", f"width: 8\nheight: 6\nK: {sum(K, [])}\nD: []\ndistortion_model: plumb_bob\n", False),
        ("camera-intrinsics.txt", "10 0 3.5\n0 10 2.5\n0 0 1\n", False),
        ("intrinsic_depth.txt", "10 0 3.5 0\n0 10 2.5 0\n0 0 1 0\n0 0 0 1\n", False),
        ("camera.txt", "10 10 3.5 2.5\n", False),
    ],
)
def test_intrinsics_as_others_write_them(tmp_path, name, text, lens):
    folder = record(tmp_path, NAMES, NAMES, camera=None)
    (folder / name).write_text(text)
    camera = data.from_folder(folder).camera
    assert np.array_equal(camera.matrix, K) and camera.distortion == (tuple(LENS) if lens else (0.0,) * 5)
    assert data.from_folder(folder, camera=name).camera.source == f"read from {name}"


def test_a_matrix_is_a_camera(tmp_path):
    folder = record(tmp_path, NAMES, NAMES, camera=None)
    for given in (K, np.array(K), tuple(sum(K, []))):
        camera = data.from_folder(folder, camera=given).camera
        assert (camera.width, camera.height, camera.cx, camera.source) == (8, 6, 3.5, "given by you")


@pytest.mark.parametrize(
    ("camera", "says"),
    [
        (
            dict(width=8, height=6, fx=0.04, fy=0.05, cx=0.5, cy=0.5),
            "are shares of the image, not pixels; multiply fx and",
        ),
        (
            dict(CAMERA, model="Kannala Brandt4", coeffs=LENS),
            "has a lens of the model 'Kannala Brandt4', which is not read",
        ),
        (dict(CAMERA, coeffs=[*LENS, 0.5, 0, 0]), "expected k1, k2, p1, p2, k3, got 8 numbers"),
        (dict(width=8, height=6, intrinsic_matrix=[1, 2, 3]), "expected a 3x3 matrix or its nine numbers"),
        (dict(width=8, height=6, K=[[10, 1, 3], [0, 10, 2], [0, 0, 1]]), "expected fx 0 cx, 0 fy cy, 0 0 1"),
    ],
)
def test_intrinsics_that_cannot_be_used_are_one_sentence(tmp_path, camera, says):
    folder = record(tmp_path, NAMES, NAMES, camera=camera)
    with pytest.raises(Refusal, match=says) as caught:
        data.from_folder(folder)
    assert "camera.json" in str(caught.value)


def test_a_camera_made_of_shares_is_refused_too(tmp_path):
    folder = record(tmp_path, NAMES, NAMES)
    with pytest.raises(ValueError, match="shares of the image"):
        data.from_folder(folder, camera=PinholeCamera(8, 6, 0.04, 0.05, 0.5, 0.5))


def test_scaling_is_hinted_at_only_where_the_picture_keeps_its_shape(tmp_path):
    folder = record(tmp_path / "a", NAMES, NAMES)
    with pytest.raises(Refusal, match=r"camera.scaled\(...\) if the images were resized"):
        data.from_folder(folder, camera=PinholeCamera(16, 12, 20, 20, 7.5, 5.5))
    big = np.full((480, 640), 1500, np.uint16)
    wide = record(tmp_path / "b", ["0.png"], ["0.png"], depth=big)
    with pytest.raises(
        Refusal, match="so this mode is cropped, not resized: pass its own, such as .*d455_depth_640x480"
    ) as e:
        data.from_folder(wide, camera="d455_depth_1280x720", registered=False)
    assert f"fx {preset('d455_depth_640x480').fx:.1f}" in str(e.value) and "scaled" not in str(e.value)


def test_clouds_of_one_stem_and_names_in_two_cases_all_stay(tmp_path):
    for name, n in (("scan.ply", 3), ("scan.pcd", 5), ("other.ply", 2), ("scan10.ply", 1), ("scan2.ply", 1)):
        files.write_cloud(tmp_path / name, PointCloud(np.ones((n, 3))))
    clouds = data.from_folder(tmp_path).clouds
    assert {name: len(cloud) for name, cloud in clouds.items()} == {
        "scan.ply": 3, "scan.pcd": 5, "other": 2, "scan10": 1, "scan2": 1,
    }  # fmt: skip
    assert [name for name in clouds if name[4:].isdigit()] == ["scan2", "scan10"]
    files.write_cloud(tmp_path / "A.ply", PointCloud(np.ones((6, 3))))
    files.write_cloud(tmp_path / "a.ply", PointCloud(np.ones((7, 3))))
    if len({one.name for one in tmp_path.iterdir()} & {"A.ply", "a.ply"}) == 2:  # not on every file system
        clouds = data.from_folder(tmp_path).clouds
        assert (len(clouds["A"]), len(clouds["a"])) == (6, 7)


def test_one_missing_pose_drops_no_other(tmp_path):
    times = [f"{1e9 + i * 0.033:.6f}.png" for i in range(5)]
    folder = record(tmp_path, times, times, kinds=("rgb", "depth"), depth=DEPTH * 5)
    lines = [f"{1e9 + i * 0.033:.4f} {i} 0 0 0 0 0 1\n" for i in range(4)]
    (folder / "groundtruth.txt").write_text("# time x y z and so on\n" + "".join(lines[::-1]))
    dataset = data.from_folder(folder)
    assert [None if T is None else T[0, 3] for T in dataset.poses] == [0, 1, 2, 3, None]
    assert dataset.title.endswith("; 1 of 5 frames have no pose in groundtruth.txt")
    assert "4 of 5 T_world_camera" in repr(dataset)
    (folder / "groundtruth.txt").write_text("5 0 0 0 0 0 0 1\n")
    dataset = data.from_folder(folder)
    assert not hasattr(dataset, "poses") and dataset.title.endswith("groundtruth.txt has no pose of these frames")


def test_poses_that_lost_digits_are_made_exact_and_said(tmp_path):
    folder = record(tmp_path, NAMES, NAMES)
    T = rotation_z(0.3)
    T[:3, :3] *= 1 - 0.76e-4
    rows = "".join(" ".join(f"{number:.7f}" for number in row) + "\n" for row in T)
    (folder / "trajectory.log").write_text(f"0 0 1\n{rows}1 1 2\n{rows}")
    dataset = data.from_folder(folder)
    check_rigid(dataset.poses[0])
    assert dataset.title.endswith("; rotations of trajectory.log made exact (they missed by up to 8e-05)")


def test_a_pose_as_it_is_published_is_mended_by_the_function_that_the_message_names():
    """The 50 poses of a kitchen of 7-Scenes are rotations 0.8e-4 too short."""
    T = rotation_z(0.6435)
    T[:3, :3] *= 1 - 0.76e-4
    with pytest.raises(ValueError, match="or was rounded: transforms.nearest_rigid mends that"):
        check_rigid(T)
    np.testing.assert_allclose(nearest_rigid(T), rotation_z(0.6435), atol=1e-15)
    T[:3, :3] *= 1.002
    with pytest.raises(ValueError, match="no rotation is near its upper left 3x3 .the nearest misses by 0.0019"):
        nearest_rigid(T)
    with pytest.raises(ValueError, match="it scales or shears.$"):
        check_rigid(T)


def test_seven_scenes_lies_flat(tmp_path):
    for i in (2, 10):
        files.write_image(tmp_path / f"frame-{i:06d}.color.png", np.full((6, 8, 3), i, np.uint8))
        files.write_depth(tmp_path / f"frame-{i:06d}.depth.png", DEPTH + np.uint16(i))
        T = np.eye(4)
        T[0, 3] = i
        np.savetxt(tmp_path / f"frame-{i:06d}.pose.txt", T)
    np.savetxt(tmp_path / "camera-intrinsics.txt", K)
    dataset = data.from_folder(tmp_path)
    assert values(dataset) == [(2, 2), (10, 10)] and [T[0, 3] for T in dataset.poses] == [2, 10]
    np.savetxt(tmp_path / "frame-000002.pose.txt", np.full((4, 4), np.nan))  # tracking was lost
    dataset = data.from_folder(tmp_path)
    assert dataset.poses[0] is None and "1 of 2 frames have no pose in *.pose.txt" in dataset.title


def test_names_of_index_and_time(tmp_path):
    colors, depths = ([f"{i:07d}-{i * step + 7:012d}.png" for i in range(3)] for step in (33360, 33369))
    assert values(data.from_folder(record(tmp_path, colors, depths))) == [(0, 0), (1, 1), (2, 2)]


def test_two_images_of_one_number_are_refused(tmp_path):
    folder = record(tmp_path, ["a1.png", "b1.png"], ["0.png", "1.png"])
    with pytest.raises(Refusal, match="color/ has 2 images, depth/ has 2 and 1 numbers in their names agree"):
        data.from_folder(folder)


def test_depth_images_without_colour_are_said(tmp_path):
    times = [f"{1e9 + i * 0.033:.6f}.png" for i in range(3)]
    dataset = data.from_folder(record(tmp_path, times[:2], times, depth=DEPTH * 5))
    assert len(dataset.frames) == 2 and dataset.title.endswith("; 1 of 3 depth images have no colour and are left out")


@pytest.mark.parametrize("start", ["./rgb/{}.png", "rgb/{}.png", "rgb//{}.png"])
def test_lists_with_a_point_in_front(tmp_path, start):
    folder = record(tmp_path, NAMES, NAMES, kinds=("rgb", "depth"), depth=DEPTH * 5)
    lines = [f"{i} {start.format(i)} {i} {start.replace('rgb', 'depth').format(i)}\n" for i in (1, 0)]
    (folder / "associations.txt").write_text("".join(lines))
    frames = data.from_folder(folder).frames
    assert [int(frame.color[0, 0, 0]) for frame in frames] == [1, 0] and frames[0].depth[0, 0] == pytest.approx(
        1.5, abs=1e-3
    )


def floats(path, metres: np.ndarray) -> None:
    if path.suffix == ".npy":
        np.save(path, metres)
    else:
        cv2.imwrite(str(path), metres.astype(np.float32))


@pytest.mark.parametrize("kind", [".npy", ".tiff"])
def test_depth_as_floats(tmp_path, kind):
    folder = record(tmp_path, NAMES, [])
    depth = np.full((6, 8), 1.25)
    depth[0, 0] = np.nan
    for i in range(2):
        floats(folder / "depth" / f"{i}{kind}", depth + i)
    dataset = data.from_folder(folder)
    assert dataset.encoding.name == "metres" and "1 units a metre (assumed)" in dataset.title
    assert [frame.depth[1, 1] for frame in dataset.frames] == [1.25, 2.25] and dataset.frames[0].depth[0, 0] == 0
    for i in range(2):
        floats(folder / "depth" / f"{i}{kind}", 1000 * depth)
    with pytest.raises(ValueError, match="millimetres or raw units, not metres"):
        data.from_folder(folder)
    assert data.from_folder(folder, encoding=1000).frames[0].depth[1, 1] == 1.25


@pytest.mark.parametrize("kind", [".npy", ".tif"])
def test_depth_as_whole_numbers_in_other_files(tmp_path, kind):
    folder = record(tmp_path, NAMES, [])
    for i in range(2):
        path = folder / "depth" / f"{i}{kind}"
        np.save(path, DEPTH.astype(np.int32)) if kind == ".npy" else cv2.imwrite(str(path), DEPTH)
    assert data.from_folder(folder).frames[1].depth[0, 0] == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("array", "says"),
    [
        (np.array(["a", "b"]), "holds no image of numbers"),
        (np.array([{}], object), "cannot be read as an array of numbers"),
        (np.full((6, 8), -1), "holds -1 to -1: depth was expected, 0 to 65535"),
        (np.zeros((6, 8, 3)), "has 3 channels and depth has one"),
        (np.zeros((6, 8), np.uint8), "has 8 bits"),
    ],
)
def test_arrays_that_are_no_depth(tmp_path, array, says):
    np.save(tmp_path / "a.npy", array, allow_pickle=True)
    with pytest.raises(Refusal, match=says):
        files.read_depth(tmp_path / "a.npy")
    (tmp_path / "a.npy").write_bytes((tmp_path / "a.npy").read_bytes()[:-5])
    with pytest.raises(Refusal, match="a.npy"):
        files.read_depth(tmp_path / "a.npy")


def test_an_encoding_by_its_number(tmp_path):
    dataset = data.from_folder(record(tmp_path, NAMES, NAMES, depth=DEPTH * 10), encoding=10000)
    assert dataset.frames[0].depth[0, 0] == pytest.approx(1.5) and "10000 units a metre;" in dataset.title
    with pytest.raises(ValueError, match="units_per_metre: -1 is not positive"):
        data.from_folder(tmp_path, encoding=-1)


def test_nearest_times_are_those_of_comparing_all():
    rng = np.random.default_rng(0)
    for count in (1, 2, 3, 200):
        times, asked = rng.uniform(0, 5, count), np.sort(rng.uniform(-1, 6, 300))
        apart = np.abs(times[None] - asked[:, None])
        nearest, near = nearest_in_time(times, asked)
        np.testing.assert_array_equal(apart[np.arange(300), nearest], apart.min(axis=1))
        np.testing.assert_array_equal(near, apart.min(axis=1) < 0.02)


def test_many_times_need_no_table_of_all_pairs():
    """A list of a million times and 3,000 asked would be 24 GB."""
    nearest, near = nearest_in_time(np.arange(1e6) * 0.01, np.arange(3000) * 0.1)
    assert near.all() and nearest[-1] == 29990


def test_a_camera_file_that_is_missing_is_one_sentence(tmp_path):
    folder = record(tmp_path, NAMES, NAMES)
    with pytest.raises(Refusal, match="There is no file .*camera_info.yaml"):
        data.from_folder(folder, camera="camera_info.yaml")
    (tmp_path / "k.yaml").write_text("a: [1, 2")
    with pytest.raises(Refusal, match="k.yaml holds no intrinsics that the course reads"):
        read_camera(tmp_path / "k.yaml")
