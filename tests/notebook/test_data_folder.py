"""A learner's own recording, in the layouts that people have."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from data_helpers import MIRROR, needs_mirror

from course_lib.camera.pinhole import PinholeCamera
from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook import data, files
from course_lib.notebook._errors import Refusal

CAMERA = {"width": 8, "height": 6, "fx": 10.0, "fy": 10.0, "cx": 3.5, "cy": 2.5}
DEPTH = np.full((6, 8), 1500, np.uint16)


def record(
    folder: Path, colors: list[str], depths: list[str], *, kinds=("color", "depth"), camera=CAMERA, depth=DEPTH
) -> Path:
    """Write a recording; image i of either kind has the value i in it."""
    for kind, names in zip(kinds, (colors, depths), strict=True):
        (folder / kind).mkdir(parents=True)
        for number, name in enumerate(names):
            if kind == kinds[0]:
                files.write_image(folder / kind / name, np.full((6, 8, 3), number, np.uint8))
            else:
                files.write_depth(folder / kind / name, depth + np.uint16(number))
    if camera:
        (folder / "camera.json").write_text(json.dumps(camera))
    return folder


def values(dataset) -> list[tuple[int, int]]:
    """The number of the colour and of the depth image of each frame."""
    frames = [dataset.raw(i) for i in range(len(dataset.frames))]
    return [(int(color[0, 0, 0]), int(raw[0, 0]) - 1500) for color, raw in frames]


def test_color_and_depth_with_a_camera(tmp_path):
    dataset = data.from_folder(record(tmp_path / "mine", ["0.png", "1.png", "10.png"], ["0.png", "1.png", "10.png"]))
    assert dataset.kind == "yours" and dataset.name == "mine" and len(dataset.frames) == 3
    assert values(dataset) == [(0, 0), (1, 1), (2, 2)]
    frame = dataset.frames[0]
    assert np.allclose(frame.depth, 1.5) and frame.camera.fx == 10 and frame.camera.source == "read from camera.json"
    assert "1000 units a metre (assumed)" in dataset.title and frame.registered
    assert not hasattr(dataset, "truth") and not hasattr(dataset, "poses")


def test_names_pair_by_their_number(tmp_path):
    folder = record(tmp_path, ["color_2.png", "color_10.png"], ["depth_0002.png", "depth_0010.png"])
    assert values(data.from_folder(folder)) == [(0, 0), (1, 1)]


def test_every_and_most(tmp_path):
    names = [f"{i}.png" for i in range(10)]
    assert values(data.from_folder(record(tmp_path, names, names), every=3, most=2)) == [(0, 0), (3, 3)]
    with pytest.raises(Refusal, match="every and most count frames from 1 on, not every=0"):
        data.from_folder(tmp_path, every=0)


def test_a_camera_that_is_passed(tmp_path):
    folder = record(tmp_path, ["0.png"], ["0.png"], camera=None)
    assert data.from_folder(folder, camera=PinholeCamera(**CAMERA)).camera.source == "given by you"
    (tmp_path / "elsewhere.json").write_text(json.dumps(CAMERA))
    assert data.from_folder(folder, camera=str(tmp_path / "elsewhere.json")).camera.fy == 10
    assert data.from_folder(folder, camera="elsewhere.json").camera.fy == 10
    with pytest.raises(Refusal, match="There is no file elswhere.json"):
        data.from_folder(folder, camera="elswhere.json")
    with pytest.raises(Refusal, match="holds no intrinsics: put camera.json .* or pass camera=, such as a preset's"):
        data.from_folder(folder)
    with pytest.raises(Refusal, match="The intrinsics are for 640x480 and the depth images are 8x6: pass those of 8x6"):
        data.from_folder(folder, camera="primesense")
    with pytest.raises(ValueError, match="did you mean 'primesense'"):
        data.from_folder(folder, camera="primesence")


def test_open3d_intrinsics(tmp_path):
    camera = {"width": 8, "height": 6, "intrinsic_matrix": [10, 0, 0, 0, 11, 0, 3.5, 2.5, 1]}
    assert data.from_folder(record(tmp_path, ["0.png"], ["0.png"], camera=camera)).camera.fy == 11


TIMES = ["1305031526.60", "1305031526.63", "1305031526.67"]
SHIFTED = ["1305031526.61", "1305031526.64", "1305031527.90"]


@pytest.mark.parametrize("listed", [True, False])
def test_tum_layout_pairs_by_time(tmp_path, listed):
    names = [[f"{time}.png" for time in times] for times in (TIMES, SHIFTED)]
    if listed:
        for kind, times in (("rgb", TIMES), ("depth", SHIFTED)):
            lines = [f"{time} {kind}/{i}.png" for i, time in enumerate(times)]
            tmp_path.joinpath(f"{kind}.txt").write_text("# timestamp filename\n" + "\n".join(lines))
        names = [["0.png", "1.png", "2.png"]] * 2
    dataset = data.from_folder(record(tmp_path, *names, kinds=("rgb", "depth")))
    assert values(dataset) == [(0, 0), (1, 1)]
    assert dataset.encoding.name == "tum" and np.allclose(dataset.frames[0].depth, 0.3)
    assert "5000 units a metre (assumed)" in dataset.title


@pytest.mark.parametrize("depth_first", [True, False])
def test_associations_and_poses(tmp_path, depth_first):
    record(tmp_path, ["a.png", "b.png"], ["c.png", "d.png"], kinds=("rgb", "depth"))
    rows = [("1.00", "rgb/b.png", "1.01", "depth/c.png"), ("2.00", "rgb/a.png", "2.01", "depth/d.png")]
    rows = [row[2:] + row[:2] if depth_first else row for row in rows]
    (tmp_path / "associations.txt").write_text("\n".join(" ".join(row) for row in rows))
    (tmp_path / "groundtruth.txt").write_text(
        "# time tx ty tz qx qy qz qw\n0.9 9 9 9 0 0 0 1\n1.01 1 2 3 0 0 0 1\n2.02 4 5 6 0 0 0 1\n"
    )
    dataset = data.from_folder(tmp_path, encoding="realsense")
    assert values(dataset) == [(1, 0), (0, 1)]
    assert [T[:3, 3].tolist() for T in dataset.poses] == [[1, 2, 3], [4, 5, 6]]
    assert dataset.frames[1].T_world_camera[0, 3] == 4 and dataset.meta["poses_from"] == "groundtruth.txt"
    (tmp_path / "associations.txt").write_text("1.00 rgb/b.png\n")
    with pytest.raises(Refusal, match="associations.txt must hold time, image, time, image on every line: write"):
        data.from_folder(tmp_path)


def test_an_open3d_trajectory(tmp_path):
    folder = record(tmp_path, ["0.png", "1.png"], ["0.png", "1.png"])
    one = "0 0 1\n1 0 0 {}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
    (folder / "trajectory.log").write_text(one.format(0) + one.format(2))
    assert data.from_folder(folder).poses[1][0, 3] == 2
    (folder / "trajectory.log").write_text(one.format(0))
    dataset = data.from_folder(folder)
    assert dataset.poses[0] is not None and dataset.poses[1] is None and dataset.frames[1].T_world_camera is None
    assert dataset.title.endswith("; 1 of 2 frames have no pose in trajectory.log")
    (folder / "trajectory.log").write_text(one.format(0).replace("0 0 1\n", "7 7 8\n", 1))
    with pytest.raises(Refusal, match="trajectory.log has 1 poses and there are 2 frames: they must agree"):
        data.from_folder(folder)


def test_a_folder_of_clouds_and_one_cloud(tmp_path):
    files.write_cloud(tmp_path / "scan_1.ply", PointCloud(np.eye(3)))
    files.write_cloud(tmp_path / "scan_2.xyz", PointCloud(np.ones((5, 3))))
    dataset = data.from_folder(tmp_path)
    assert {name: len(cloud) for name, cloud in dataset.clouds.items()} == {"scan_1": 3, "scan_2": 5}
    assert len(data.from_folder(tmp_path / "scan_2.xyz").cloud) == 5


def test_what_is_not_there(tmp_path):
    (tmp_path / "recording").mkdir()
    with pytest.raises(Refusal, match="There is no folder .*recordin: did you mean recording?"):
        data.from_folder(tmp_path / "recordin")
    with pytest.raises(Refusal, match="recording is empty: put color/ and depth/ .16-bit PNG. into it, or clouds"):
        data.from_folder(tmp_path / "recording")
    (tmp_path / "recording" / "notes.txt").touch()
    with pytest.raises(Refusal, match="holds no recording that the course reads: color/ and depth/, or clouds"):
        data.from_folder(tmp_path / "recording")
    (tmp_path / "recording" / "walk.bag").touch()
    with pytest.raises(Refusal, match="name the file walk.bag itself"):
        data.from_folder(tmp_path / "recording")
    (tmp_path / "recording" / "depth").mkdir()
    with pytest.raises(Refusal, match=r"has depth/ but no color/ \(or rgb/\): both are needed"):
        data.from_folder(tmp_path / "recording")
    (tmp_path / "recording" / "color").mkdir()
    with pytest.raises(Refusal, match=r"color is empty: it should hold images \(.png"):
        data.from_folder(tmp_path / "recording")


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("a.mcap", "is a recording of ROS 2's own nodes: extract color/ and depth/"),
        ("a.mkv", "is an Azure Kinect recording: extract color/ and depth/"),
        ("a.mp4", "is a film, which has no depth"),
        ("a.zip", "is packed: unpack it"),
        ("a.doc", "is of a kind that the course does not read: name a folder, a .bag or a .db3"),
    ],
)
def test_other_recordings_are_refused_plainly(tmp_path, name, says):
    (tmp_path / name).write_bytes(b"content")
    with pytest.raises(Refusal, match=says):
        data.from_folder(tmp_path / name)


def test_images_that_do_not_pair(tmp_path):
    folder = record(tmp_path, ["1.png", "2.png", "3.png"], ["1.png", "2.png"])
    with pytest.raises(Refusal, match="color/ has 3 images, depth/ has 2 and 2 numbers in their names agree: give"):
        data.from_folder(folder)


def test_images_without_a_time_in_common(tmp_path):
    folder = record(tmp_path, ["1.00.png"], ["2.00.png"])
    with pytest.raises(Refusal, match="No image of color/ was taken within 0.02 s of one of depth/"):
        data.from_folder(folder)


def test_sizes_that_differ(tmp_path):
    folder = record(tmp_path, ["0.png"], ["0.png"])
    files.write_image(folder / "color" / "0.png", np.zeros((12, 16, 3), np.uint8))
    with pytest.raises(Refusal, match="0.png is 16x12 and 0.png 8x6: align depth to colour when recording, or say"):
        data.from_folder(folder)
    dataset = data.from_folder(folder, registered=False)
    assert not dataset.frames[0].registered and "not aligned" in dataset.title


def test_8_bit_depth_and_empty_depth_and_wrong_units(tmp_path):
    folder = record(tmp_path / "a", ["0.png"], ["0.png"], depth=np.zeros((6, 8), np.uint16))
    with pytest.raises(Refusal, match="0.png holds no measured pixel: check the recording"):
        data.from_folder(folder)
    files.write_image(folder / "depth" / "0.png", np.zeros((6, 8, 3), np.uint8))
    with pytest.raises(Refusal, match="has 8 bits, which leaves 256 distances at most"):
        data.from_folder(folder)
    folder = record(tmp_path / "b", ["0.png"], ["0.png"], depth=np.full((6, 8), 12075, np.uint16))
    with pytest.raises(Refusal, match="would be 12.1 m deep in the median: say how it is stored, such as"):
        data.from_folder(folder)
    assert np.allclose(data.from_folder(folder, encoding="tum").frames[0].depth, 2.415)
    assert np.allclose(data.from_folder(folder, encoding="realsense").frames[0].depth, 12.075)


@needs_mirror
def test_a_published_folder_loads_as_ones_own():
    dataset = data.from_folder(Path(MIRROR) / "realsense_planes" / "data")
    assert len(dataset.frames) == 10 and dataset.camera.fx == 617.25
    published = data.load("realsense_planes")
    np.testing.assert_array_equal(dataset.frames[3].depth, published.frames[3].depth)


def test_a_recording_that_may_not_be_read(tmp_path):
    folder = record(tmp_path, ["0.png"], ["0.png"])
    path = folder / "depth" / "0.png"
    path.chmod(0)
    if os.access(path, os.R_OK):
        pytest.skip("root may read everything")
    with pytest.raises(Refusal, match="0.png may not be read by you: change its permissions or copy it elsewhere"):
        data.from_folder(folder)
