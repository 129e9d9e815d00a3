"""Recordings of a RealSense: what librealsense itself wrote (recordings/make.py says how), and what others lack.

Both files hold the same: four depth images of 64x48 at 30 a second, of which pixel (u, v) of image k is 1500 + 10 u + k
mm deep, and colour images 0, 1 and 3, of which it is (4 u, 5 v, 60 k), through a lens with distortion, 59 mm beside and
turned by 0.05 rad about y.
"""

import shutil
import sqlite3
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from data_helpers import MIRROR, needs_mirror

from course_lib.camera.distortion import distort
from course_lib.camera.pinhole import PinholeCamera, deproject, project
from course_lib.geometry.transforms import apply, from_rotation_translation, invert, rotation_y
from course_lib.notebook import _bag_common, _recording, _rosbags, data
from course_lib.notebook._errors import Refusal
from course_lib.notebook._recording import _pair

HERE = Path(__file__).parent / "recordings"
ROS1, ROS2 = HERE / "librealsense_2_55.bag", HERE / "librealsense_2_59.db3"
DEPTH_CAMERA = PinholeCamera(64, 48, 50.0, 50.0, 32.0, 24.0)
T_COLOR_DEPTH = from_rotation_translation(rotation_y(0.05)[:3, :3], (0.059, 0.001, -0.002))
LENS = (-0.2, 0.1, -0.004, 0.004, -0.02)
both_formats = pytest.mark.parametrize("path", [ROS1, ROS2], ids=["bag", "db3"])


@both_formats
def test_all_frames_and_what_the_file_says_of_them(path, capfd):
    dataset = data.from_folder(path)
    assert dataset.kind == "yours" and len(dataset.frames) == 3 and "D455" in dataset.title
    assert dataset.encoding.units_per_metre == 1000
    camera = dataset.camera
    assert (camera.width, camera.height, camera.fx, camera.cx, camera.cy) == (64, 48, 55, 32, 24)
    assert path.name in camera.source and "straightened" in camera.source and not camera.distorted
    blues = [int(np.median(frame.color[..., 2])) for frame in dataset.frames]
    assert blues == [0, 60, 180]  # depth image 2 has no partner and is left out
    assert dataset.frames[0].registered and dataset.frames[2].name == f"{path.stem} 002"
    assert capfd.readouterr() == ("", "")


@both_formats
@pytest.mark.parametrize(("index", "image"), [(0, 0), (1, 1), (2, 3)])
def test_depth_is_the_depth_of_the_colour_camera(path, index, image):
    frame = data.from_folder(path).frames[index]
    measured = frame.depth > 0
    points = apply(invert(T_COLOR_DEPTH), deproject(frame.depth, frame.camera, dtype=np.float64)[measured])
    u, _ = project(points, DEPTH_CAMERA).T
    error = 1000 * points[:, 2] - (1500 + 10 * u + image)
    assert np.abs(np.median(error)) < 1 and np.abs(error).max() < 7.5  # mm: half a pixel is 5, and the unit 1
    assert measured.mean() > 0.95
    raw = data.from_folder(path).raw(index)[1]
    assert raw.dtype == np.uint16 and np.allclose(raw / 1000, frame.depth, atol=1e-6)
    copied = 1000 * frame.depth[measured] - (1500 + 10 * u + image)  # the number as it was, as librealsense leaves it
    assert np.percentile(np.abs(copied), 90) > 30


@both_formats
def test_colour_is_straightened(path):
    frame = data.from_folder(path).frames[1]
    v, u = np.mgrid[4:44, 4:60]
    there = distort(np.stack([(u - 32) / 55, (v - 24) / 55], axis=-1), LENS) * 55 + (32, 24)
    expected = np.stack([4 * there[..., 0], 5 * there[..., 1], np.full(u.shape, 60)], axis=-1)
    assert np.abs(frame.color[4:44, 4:60] - expected).max() < 1.5
    bent = np.stack([4 * u, 5 * v, np.full(u.shape, 60)], axis=-1)
    assert np.abs(frame.color[4:44, 4:60] - bent.astype(float)).max() > 3


@both_formats
def test_every_and_most(path):
    dataset = data.from_folder(path, every=2)
    assert [int(np.median(frame.color[..., 2])) for frame in dataset.frames] == [0, 180]
    assert dataset.meta["frames_recorded"] == 3
    assert len(data.from_folder(path, most=1).frames) == 1


@needs_mirror
def test_a_recording_of_a_real_camera(capfd):
    """One colour image and two depth images, 102 ms before and 65 ms after it by the recorder's clock."""
    path = Path(MIRROR) / "realsense_bag" / "single_depth_color_640x480.bag"
    dataset = data.from_folder(path)
    assert len(dataset.frames) == 1 and "D435" in dataset.title and dataset.encoding.units_per_metre == 1000
    frame = dataset.frames[0]
    assert frame.color.shape == (480, 640, 3) and frame.camera.fx == pytest.approx(613.2, abs=0.1)
    assert np.median(frame.depth[frame.depth > 0]) == pytest.approx(1.537, abs=0.01)
    assert (frame.depth > 0).mean() > 0.97
    color, raw = dataset.raw(0)
    assert raw.dtype == np.uint16 and (color == frame.color).all()
    assert path.name in dataset.camera.source and "straightened" not in dataset.camera.source
    assert capfd.readouterr() == ("", "")


def stream(stamps, *, clock="Hardware Clock", rate=30.0, arrivals=None) -> _bag_common.Stream:
    arrivals = stamps if arrivals is None else arrivals
    lens = ("Brown Conrady", (0.0,) * 5)
    units = np.full(len(stamps), np.nan)
    times = np.array(stamps), np.array(arrivals)
    return _bag_common.Stream("", DEPTH_CAMERA, lens, rate, "0", np.eye(4), clock, *times, units)


def test_images_pair_by_time():
    colour, depth = stream([0.0, 0.1, 0.2, 0.3]), stream([0.305, 0.202, 0.0, 0.17, 0.6])
    assert _pair(colour, depth) == [(0, 2), (2, 1), (3, 0)]  # 0.1 has nothing within a thirtieth of a second
    assert _pair(stream([0.0, 0.02]), stream([0.015])) == [(1, 0)]  # none is used twice
    assert _pair(stream([]), depth) == [] == _pair(colour, stream([]))


def test_clocks_that_differ_are_not_compared():
    colour = stream([1000.0, 1000.1], clock="System Time", arrivals=[0.0, 0.1])
    depth = stream([5.0, 5.1], arrivals=[0.101, 0.001])
    assert _pair(colour, depth) == [(0, 1), (1, 0)]


def changed(folder: Path, *statements: str) -> Path:
    """The .db3 with some of its rows changed."""
    path = folder / "walk.db3"
    shutil.copy(ROS2, path)
    with sqlite3.connect(path) as connection:
        for statement in statements:
            assert connection.execute(statement).rowcount > 0, statement
    connection.close()
    return path


def rename(old: str, new: str) -> str:
    return f"UPDATE topics SET name = replace(name, '{old}', '{new}') WHERE name LIKE '%{old}%'"


def rows(topic: str) -> str:
    return f"topic_id IN (SELECT id FROM topics WHERE name LIKE '%{topic}')"


def text(topic: str, old: str, new: str) -> str:
    """Another text of the same length in the messages of a topic."""
    assert len(old) == len(new)
    return f"UPDATE messages SET data = CAST(replace(CAST(data AS TEXT), '{old}', '{new}') AS BLOB) WHERE {rows(topic)}"


def rows_of_one(topic: str, old: str, new: str) -> str:
    """As `text`, in the last message only."""
    return text(topic, old, new) + f" AND id = (SELECT max(id) FROM messages WHERE {rows(topic)})"


NO_UNITS = text("/Depth_0/image/metadata", "depth_units", "depth_hints")


@pytest.mark.parametrize(
    ("statements", "says"),
    [
        ([rename("/device_0/", "/camera/")], "walk.db3 was not recorded by librealsense: record it with the Real"),
        ([rename("/Color_0/", "/Infra_0/")], "walk.db3 holds no colour: record both streams"),
        ([rename("/Depth_0/", "/Infra_0/")], "walk.db3 holds no depth: record both streams"),
        ([f"DELETE FROM messages WHERE {rows('/compressedDepth')}"], "holds no frame with both depth and colour"),
        ([rename("/Depth_Units/", "/No_Units/"), NO_UNITS], "walk.db3 does not say the unit of its depth: record"),
        ([rows_of_one("/Depth_0/image/metadata", "depth_units=0.001", "depth_units=0.002")], "changes the unit of its"),
        ([text("/Color_0/info", "RGB8", "Y16 ")], "walk.db3 holds Y16 : record Z16 depth and RGB8 colour"),
        ([text("/Color_0/camera_info", "fx=55", "fx= 0")], "says nothing usable of its cameras: record"),
        ([text("/Color_0/camera_info", "coeffs=-", "coeffs=z")], "walk.db3 is damaged inside .*: copy it again"),
        ([text("/Color_0/camera_info", "coeffs=-0.200000003", "coeffs=         nan")], "says nothing usable of its"),
        ([text("/Color_0/camera_info", "Inverse Brown Conrady", "Kannala Brandt 4-like")], "colour lens of the model"),
        ([text("/Depth_0/camera_info", "Brown Conrady", "Kannala Brand")], "is not of a stereo camera: its depth"),
        ([rename("/Color_0/tf/ref_1", "/Color_0/tf/ref_2")], "does not say where its cameras are to each other"),
        ([f"DELETE FROM messages WHERE {rows('/Color_0/camera_info')}"], "says nothing usable of its cameras: record"),
        ([rename("/Depth_0/tf/", "/Depth_0/no/")], "says nothing usable of its cameras: record it again"),
        ([f"UPDATE messages SET data = zeroblob(400) WHERE {rows('/Color_0/image/data/compressed')}"], "walk.db3 "),
        ([f"UPDATE messages SET data = substr(data, 1, 90) WHERE {rows('/compressedDepth')}"], "walk.db3 "),
        (["DROP TABLE messages"], "walk.db3 is damaged inside .*: copy it again"),
    ],
)
def test_what_a_recording_lacks_is_said(tmp_path, statements, says):
    if statements[0].startswith("DROP"):
        path = tmp_path / "walk.db3"
        shutil.copy(ROS2, path)
        with sqlite3.connect(path) as connection:
            connection.execute(statements[0])
        connection.close()
    else:
        path = changed(tmp_path, *statements)
    with pytest.raises(Refusal, match=says):
        data.from_folder(path)


def test_each_image_says_its_unit(tmp_path):
    """What the sensor was set to when the recording began is not what counts."""
    path = changed(tmp_path, text("/Depth_Units/value", "0.001000", "0.000100"))
    assert data.from_folder(path).encoding.units_per_metre == 1000
    path = changed(tmp_path, text("/Depth_0/image/metadata", "depth_units=0.001000", "depth_units=0.000500"))
    halved, whole = data.from_folder(path), data.from_folder(ROS2)
    assert halved.encoding.units_per_metre == 2000
    assert np.median(halved.frames[0].depth) == pytest.approx(0.5 * np.median(whole.frames[0].depth), rel=0.05)


@pytest.mark.parametrize("name", ["walk%201", "walk#2", "walk?3", "walk 4; 5"])
@both_formats
def test_names_that_mean_something_in_an_address(tmp_path, path, name):
    here = tmp_path / f"run #1 {name}"
    here.mkdir()
    shutil.copy(path, here / f"{name}{path.suffix}")
    (here / f"walk 1{path.suffix}").write_bytes(b"another")
    assert len(data.from_folder(here / f"{name}{path.suffix}").frames) == 3


def test_a_small_file_that_promises_a_huge_picture_is_not_unpacked(tmp_path, monkeypatch):
    path = tmp_path / "walk.db3"
    shutil.copy(ROS2, path)
    small, huge = (b"IHDR" + struct.pack(">II", *size) for size in ((64, 48), (20_000, 20_000)))
    with sqlite3.connect(path) as connection:
        select = f"SELECT id, data FROM messages WHERE {rows('/Color_0/image/data/compressed')}"
        for number, content in connection.execute(select).fetchall():
            at = content.index(small)
            header = huge + content[at + len(small) : at + 17]
            whole = content[:at] + header + struct.pack(">I", zlib.crc32(header)) + content[at + 21 :]
            connection.execute("UPDATE messages SET data = ? WHERE id = ?", (whole, number))
    connection.close()
    monkeypatch.setattr(_rosbags.cv2, "imdecode", lambda *_: pytest.fail("unpacked"))
    with pytest.raises(Refusal, match="walk.db3 (holds colour that cannot be read|is damaged inside)"):
        data.from_folder(path)


def test_too_many_frames_for_the_memory_are_refused_first(monkeypatch):
    monkeypatch.setattr(_recording, "MOST_BYTES", 30_000)
    with pytest.raises(Refusal, match="3 frames take 0.0 GB: say most= or every="):
        data.from_folder(ROS2)
    assert len(data.from_folder(ROS2, most=1).frames) == 1


def test_the_clock_must_be_one_all_the_time(tmp_path):
    """Where it changes while recording, stamps before and after it have nothing in common: arrival counts."""
    other = rows_of_one("/Color_0/image/metadata", "Hardware Clock", "Global Time   ")
    path = changed(tmp_path, other, rows_of_one("/Color_0/image/metadata", "timestamp=99.9", "timestamp=9e99"))
    assert [int(np.median(frame.color[..., 2])) for frame in data.from_folder(path).frames] == [0, 60, 180]


def test_frames_without_a_stamp_go_by_their_arrival(tmp_path):
    path = changed(tmp_path, f"DELETE FROM messages WHERE {rows('/image/metadata')}")
    assert [int(np.median(frame.color[..., 2])) for frame in data.from_folder(path).frames] == [0, 60, 180]


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.bag", b"", "a.bag is empty: record it again"),
        ("a.db3", b"", "a.db3 is empty: record it again"),
        ("a.bag", b"#ROSBAG V1.2\n", "a.bag is not a ROS 1 bag: record it again"),
        ("a.db3", b"#ROSBAG V2.0\n", "a.db3 is not a ROS 2 recording: record it again"),
        ("a.db3", b"SQLite format 3\0" + bytes(4096), "a.db3 is damaged inside .*: copy it again"),
        ("a.bag", b"#ROSBAG V2.0\nE\0\0\0\x12\0\0\0index_pos=" + bytes(8), "a.bag was never closed .it has no index"),
        ("a.bag", b"#ROSBAG V2.0\nE\0\0\0\x12\0\0\0index_pos=\xff\xff" + bytes(6), "is cut short: its index lies"),
    ],
)
def test_what_is_no_recording(tmp_path, name, content, says):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(Refusal, match=says):
        data.from_folder(tmp_path / name)


@both_formats
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_recording_that_was_cut(tmp_path, path, share):
    cut = tmp_path / f"walk{path.suffix}"
    cut.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(Refusal, match=f"walk{path.suffix} is (cut short|damaged inside).*: .*copy it again"):
        data.from_folder(cut)


@both_formats
def test_bytes_that_changed_are_one_sentence_or_a_frame(tmp_path, path):
    """Wherever a file is spoiled: it loads, or it is refused in one sentence that names it."""
    content, rng = path.read_bytes(), np.random.default_rng(0)
    spoiled, refused = tmp_path / f"walk{path.suffix}", 0
    for _ in range(60):
        start = int(rng.integers(64, len(content) - 200))
        spoiled.write_bytes(content[:start] + rng.bytes(200) + content[start + 200 :])
        try:
            frames = data.from_folder(spoiled).frames
        except Refusal as refusal:
            refused += 1
            assert spoiled.name in str(refusal) and "\n" not in str(refusal)
        else:
            assert all(frame.color.shape == (48, 64, 3) for frame in frames)
    assert refused > 5
