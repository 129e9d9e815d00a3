"""Clouds, meshes and images in files: what is whole comes back, what is not is said in one sentence."""

import errno
import os
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from data_helpers import MIRROR, needs_mirror

from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook import files
from course_lib.notebook._errors import CannotWrite, Refusal
from course_lib.notebook._ply import read_ply
from course_lib.surface.meshes import Mesh

RNG = np.random.default_rng(1)
CLOUD = PointCloud(
    RNG.random((1000, 3)).astype(np.float32),
    colors=RNG.integers(0, 256, (1000, 3), dtype=np.uint8),
    normals=np.tile(np.float32([0, 0, 1]), (1000, 1)),
)
MESH = Mesh(
    np.float64([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]),
    np.int32([[0, 1, 2], [1, 3, 2]]),
    colors=np.uint8([[255, 0, 0], [0, 255, 0], [0, 0, 255], [1, 2, 3]]),
)


@pytest.fixture
def quiet(capfd):
    """Nothing may be printed, by Python or by a C++ library."""
    yield
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("kind", [".ply", ".pcd"])
def test_a_cloud_comes_back(tmp_path, quiet, kind, ascii):
    path = files.write_cloud(tmp_path / f"wölkchen 云{kind}", CLOUD, ascii=ascii)
    back = files.read_cloud(path)
    np.testing.assert_allclose(back.points, CLOUD.points, atol=1e-6 if ascii else 0)
    np.testing.assert_array_equal(back.colors, CLOUD.colors)
    np.testing.assert_allclose(back.normals, CLOUD.normals)
    assert os.listdir(tmp_path) == [path.name]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_xyz_keeps_the_points(tmp_path, quiet, dtype):
    cloud = PointCloud(CLOUD.points.astype(dtype), colors=CLOUD.colors)
    back = files.read_cloud(files.write_cloud(tmp_path / "a.xyz", cloud))
    np.testing.assert_allclose(back.points, CLOUD.points, atol=1e-6)
    assert back.colors is None


def test_labels_and_doubles_and_gaps_are_kept(tmp_path, quiet):
    points = np.array([[0.1, 0.2, 0.3], [np.nan] * 3, [1e6 + 0.125, 2, 3]])
    cloud = PointCloud(points, labels=np.array([3, 0, 70000]))
    back = files.read_cloud(files.write_cloud(tmp_path / "a.ply", cloud))
    np.testing.assert_array_equal(back.points, points)
    np.testing.assert_array_equal(back.labels, cloud.labels)


@pytest.mark.parametrize("ascii", [False, True])
def test_a_mesh_comes_back(tmp_path, quiet, ascii):
    back = files.read_mesh(files.write_mesh(tmp_path / "m.ply", MESH, ascii=ascii))
    np.testing.assert_allclose(back.vertices, MESH.vertices)
    np.testing.assert_array_equal(back.triangles, MESH.triangles)
    np.testing.assert_array_equal(back.colors, MESH.colors)


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6, 0.95, 0.999])
@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize("kind", [".ply", ".pcd"])
def test_a_truncated_cloud_is_one_sentence(tmp_path, quiet, kind, ascii, share):
    """Open3D would return all 1000 points of the PLY, the last ones from nowhere, and print to stderr."""
    path = files.write_cloud(tmp_path / f"a{kind}", CLOUD, ascii=ascii)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    with pytest.raises(Refusal, match=rf"a\{kind} (is cut short: its header promises|is not a)") as caught:
        files.read_cloud(path)
    assert str(caught.value).count(". ") == 0


@pytest.mark.parametrize("share", [0.5, 0.8, 0.95])
@pytest.mark.parametrize("ascii", [False, True])
def test_a_truncated_mesh_is_one_sentence(tmp_path, quiet, ascii, share):
    path = files.write_mesh(tmp_path / "m.ply", MESH, ascii=ascii)
    content = path.read_bytes()
    header = content.index(b"end_header") + 11
    path.write_bytes(content[: header + int((len(content) - header) * share)])
    with pytest.raises(Refusal, match="m.ply is cut short: its header promises"):
        files.read_mesh(path)


def test_the_number_that_is_there_is_said(tmp_path):
    path = files.write_cloud(tmp_path / "a.ply", PointCloud(CLOUD.points))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) - 12 * 400])
    with pytest.raises(Refusal) as caught:
        files.read_cloud(path)
    assert str(caught.value).endswith(
        "a.ply is cut short: its header promises 1,000 of element vertex and the file ends after 600; copy or download "
        "it again."
    )


def test_truncated_xyz(tmp_path):
    path = tmp_path / "a.xyz"
    path.write_text("0 0 1\n0 1")
    with pytest.raises(Refusal, match="Line 2 of .*a.xyz holds no three numbers: the file is cut short or is not XYZ"):
        files.read_cloud(path)
    path.write_text("hello world again\n")
    with pytest.raises(Refusal, match="Line 1 of .* is not XYZ"):
        files.read_cloud(path)


def test_a_compressed_pcd_that_is_cut(tmp_path, quiet):
    path = tmp_path / "a.pcd"
    header = b"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
    path.write_bytes(header + b"DATA binary_compressed\n" + struct.pack("<II", 100, 24) + b"x" * 50)
    with pytest.raises(Refusal, match="promises 2 points and the compressed block is incomplete"):
        files.read_cloud(path)
    path.write_bytes(header + b"DATA packed\n")
    with pytest.raises(Refusal, match="is not a PCD file .it stores its points as 'packed'"):
        files.read_cloud(path)
    path.write_bytes(header[:30] + b"\nDATA ascii\n")
    with pytest.raises(Refusal, match="is not a PCD file .its header lacks a line"):
        files.read_cloud(path)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("a.ply", b"<html>not here</html>", "a.ply is not a PLY file .it does not begin with the word ply.: check"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 3\n", "the file ends inside the header"),
        ("a.ply", b"ply\nformat martian 1.0\nelement vertex 3\nend_header\n", "line 2 of its header is 'format mar"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n", "holds no points"),
        ("a.pcd", b"PK\x03\x04 zip\n", "a.pcd is not a PCD file .it does not begin with VERSION or FIELDS"),
        ("a.pcd", b"PK\x03\x04", "a.pcd is not a PCD file .it has no header"),
        ("a.xyz", b"", "a.xyz is empty .0 bytes.: copy or download it again"),
        ("a.stl", b"solid", "a.stl is not a cloud that the course reads: use .ply, .pcd, .xyz"),
    ],
)
def test_what_is_no_cloud_is_one_sentence(tmp_path, quiet, name, content, says):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(Refusal, match=says):
        files.read_cloud(tmp_path / name)


def test_missing_files_and_folders(tmp_path):
    files.write_cloud(tmp_path / "bunny.ply", CLOUD)
    with pytest.raises(Refusal, match="There is no file .*buny.ply: did you mean bunny.ply?"):
        files.read_cloud(tmp_path / "buny.ply")
    with pytest.raises(Refusal, match="There is no file .*x.ply: check the name and the folder"):
        files.read_cloud(tmp_path / "no" / "x.ply")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(Refusal, match="folder.ply is a folder, not a file: name one of the files in it"):
        files.read_cloud(tmp_path / "folder.ply")


def test_points_are_no_mesh(tmp_path):
    path = files.write_cloud(tmp_path / "a.ply", CLOUD)
    with pytest.raises(Refusal, match="a.ply holds points and no faces: read it with read_cloud"):
        files.read_mesh(path)
    with pytest.raises(Refusal, match="a.obj is not a mesh that the course reads: use .ply"):
        files.read_mesh(tmp_path / "a.obj")


def test_faces_of_any_size_are_measured_and_split(tmp_path, quiet):
    text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    text += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    text += "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
    path = tmp_path / "quad.ply"
    path.write_text(text)
    assert len(files.read_mesh(path).triangles) == 2
    path.write_text(text.replace("4 0 1 2 3\n", "4 0 1 2"))
    with pytest.raises(Refusal, match="promises 1 of element face and the last one is incomplete"):
        files.read_mesh(path)


@pytest.mark.parametrize(
    ("write", "thing", "name", "says"),
    [
        (files.write_cloud, CLOUD, "a.txt", "a.txt cannot hold a cloud: end the name in .ply, .pcd, .xyz"),
        (files.write_mesh, MESH, "a.obj", "a.obj cannot hold a mesh: end the name in .ply"),
        (files.write_image, np.zeros((2, 2, 3), np.uint8), "a.gif", "a.gif cannot hold this image: end the name"),
        (files.write_image, np.zeros((2, 2)), "a.png", r"A colour image is .* uint8 and this is \(2, 2\) float64"),
        (files.write_depth, np.zeros((2, 2), np.float32), "a.png", "holds .* uint16 and this is .* rgbd.encode_depth"),
        (files.write_depth, np.zeros((2, 2), np.uint16), "a.jpg", "a.jpg cannot hold this image: end the name in"),
        (files.write_cloud, CLOUD, "no/a.ply", "no is not a folder: make it first, or save elsewhere"),
    ],
)
def test_what_cannot_be_written_is_one_sentence(tmp_path, write, thing, name, says):
    with pytest.raises(Refusal, match=says):
        write(tmp_path / name, thing)
    assert os.listdir(tmp_path) == []


def test_images_come_back(tmp_path, quiet):
    color = RNG.integers(0, 256, (6, 8, 3), dtype=np.uint8)
    raw = RNG.integers(0, 65536, (6, 8), dtype=np.uint16)
    for kind in (".png", ".ppm"):
        np.testing.assert_array_equal(files.read_image(files.write_image(tmp_path / f"bild ü{kind}", color)), color)
    for kind in (".png", ".pgm"):
        np.testing.assert_array_equal(files.read_depth(files.write_depth(tmp_path / f"tiefe ü{kind}", raw)), raw)
    assert files.read_image(files.write_image(tmp_path / "a.jpg", color)).shape == color.shape
    assert len(os.listdir(tmp_path)) == 5
    assert cv2.imread(str(tmp_path / "bild ü.png"))[0, 0].tolist() == color[0, 0, ::-1].tolist()


def test_grey_and_transparent_images_become_rgb(tmp_path):
    grey = np.arange(6, dtype=np.uint8).reshape(2, 3)
    cv2.imwrite(str(tmp_path / "grey.png"), grey)
    np.testing.assert_array_equal(files.read_image(tmp_path / "grey.png"), np.repeat(grey[..., None], 3, axis=2))
    cv2.imwrite(str(tmp_path / "alpha.png"), np.uint8([[[1, 2, 3, 4]]]))
    assert files.read_image(tmp_path / "alpha.png").tolist() == [[[3, 2, 1]]]


@pytest.fixture
def png(tmp_path):
    return files.write_depth(tmp_path / "depth.png", RNG.integers(0, 65536, (60, 80), dtype=np.uint16))


@pytest.mark.parametrize("share", [0.001, 0.3, 0.7, 0.999])
def test_a_truncated_png_is_one_sentence(png, quiet, share):
    content = png.read_bytes()
    png.write_bytes(content[: max(4, int(len(content) * share))])
    with pytest.raises(Refusal, match="depth.png is cut short: the image is not complete; copy or download it again"):
        files.read_depth(png)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"<!DOCTYPE html><html>", "depth.png is not a PNG, its bytes are a web page: check what was saved"),
        (b"\xff\xd8\xff\xe0", "is not a PNG, its bytes are a JPEG"),
        (b"version https://git-lfs.github.com/spec/v1", "is not a PNG, its bytes are a Git LFS pointer"),
        (b"12345", "is not a PNG, its bytes are something else"),
        (b"", "depth.png is empty .0 bytes.: copy or download it again"),
    ],
)
@pytest.mark.parametrize("read", [files.read_depth, files.read_image])
def test_a_png_that_is_not_one_is_one_sentence(png, quiet, read, content, says):
    png.write_bytes(content)
    with pytest.raises(Refusal, match=says):
        read(png)


def test_a_changed_byte_in_a_png_is_noticed(png, quiet):
    content = bytearray(png.read_bytes())
    content[len(content) // 2] ^= 1
    png.write_bytes(content)
    with pytest.raises(Refusal, match="depth.png is damaged: a checksum inside it is wrong"):
        files.read_depth(png)


def test_other_truncated_images(tmp_path, quiet):
    color = RNG.integers(0, 256, (60, 80, 3), dtype=np.uint8)
    for name in ("a.jpg", "a.ppm"):
        path = files.write_image(tmp_path / name, color)
        path.write_bytes(path.read_bytes()[:-200])
        with pytest.raises(Refusal, match=f"{name} is cut short"):
            files.read_image(path)
        path.write_bytes(b"P3 text")
        with pytest.raises(Refusal, match=f"{name} is not a"):
            files.read_image(path)
    with pytest.raises(Refusal, match="a.tif is not an image that the course reads: use .png"):
        files.read_image(tmp_path / "a.tif")


def test_8_bit_depth_is_refused(tmp_path):
    cv2.imwrite(str(tmp_path / "depth.png"), np.zeros((4, 4), np.uint8))
    with pytest.raises(Refusal, match="depth.png has 8 bits, which leaves 256 distances at most: .* as a 16-bit PNG"):
        files.read_depth(tmp_path / "depth.png")


def test_colours_are_no_depth_and_depth_is_no_picture(tmp_path, png):
    cv2.imwrite(str(tmp_path / "c.png"), np.zeros((4, 4, 3), np.uint16))
    with pytest.raises(Refusal, match="c.png has 3 channels and depth has one: choose the depth image"):
        files.read_depth(tmp_path / "c.png")
    with pytest.raises(Refusal, match="depth.png has 16 bits a channel, so it is no colour picture: .* read_depth"):
        files.read_image(png)


WRITERS = [
    (files.write_cloud, CLOUD, "a.ply"),
    (files.write_cloud, CLOUD, "a.xyz"),
    (files.write_mesh, MESH, "m.ply"),
    (files.write_image, np.zeros((9, 9, 3), np.uint8), "i.png"),
    (files.write_depth, np.zeros((9, 9), np.uint16), "d.png"),
]


@pytest.mark.parametrize(("write", "thing", "name"), WRITERS)
@pytest.mark.parametrize("stop", [OSError, KeyboardInterrupt])
def test_a_failed_write_keeps_the_old_file_and_leaves_nothing(tmp_path, monkeypatch, write, thing, name, stop):
    (tmp_path / name).write_bytes(b"old")

    def fail(source, target):
        raise stop(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(CannotWrite if stop is OSError else KeyboardInterrupt) as caught:
        write(tmp_path / name, thing)
    assert os.listdir(tmp_path) == [name] and (tmp_path / name).read_bytes() == b"old"
    if stop is OSError:
        assert "The disk is full:" in str(caught.value) and "nothing half-written stays; free some" in str(caught.value)


@pytest.mark.parametrize(("write", "thing", "name"), WRITERS)
def test_a_nearly_full_disk_is_refused_beforehand(tmp_path, monkeypatch, write, thing, name):
    usage = type("usage", (), {"free": 1000})
    monkeypatch.setattr("course_lib.notebook._atomic.shutil.disk_usage", lambda folder: usage)
    with pytest.raises(CannotWrite, match="has 0 MB free and 1 MB are needed: free some space"):
        write(tmp_path / name, thing)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(("write", "thing", "name"), WRITERS[:3])
def test_a_writer_that_stops_early_is_noticed(tmp_path, monkeypatch, write, thing, name):
    """Open3D reports success when the disk fills up under it."""
    import open3d as o3d

    def short(path, *args, **options):
        Path(path).write_bytes(b"ply\n")
        return True

    monkeypatch.setattr(o3d.t.io, "write_point_cloud", short)
    monkeypatch.setattr(o3d.io, "write_point_cloud", short)
    monkeypatch.setattr(o3d.io, "write_triangle_mesh", short)
    with pytest.raises(CannotWrite, match=f"{name} was not written whole and was removed: is the disk full?"):
        write(tmp_path / name, thing)
    assert os.listdir(tmp_path) == []


@needs_mirror
def test_the_bunny_has_35947_points(quiet):
    path = Path(MIRROR) / "stanford_bunny" / "bun_zipper.ply"
    assert len(files.read_cloud(path)) == 35947
    stored = read_ply(path)
    assert (stored.count, {corners: len(rows) for corners, rows in stored.faces.items()}) == (35947, {3: 69451})
    assert tuple(stored.columns) == ("x", "y", "z", "confidence", "intensity")


@needs_mirror
@pytest.mark.parametrize("share", [0.3, 0.6, 0.97])
def test_a_truncated_bunny_is_one_sentence(tmp_path, quiet, share):
    content = (Path(MIRROR) / "stanford_bunny" / "bun_zipper.ply").read_bytes()
    path = tmp_path / "bunny.ply"
    path.write_bytes(content[: int(len(content) * share)])
    with pytest.raises(Refusal, match="bunny.ply is cut short: its header promises .* copy or download it again"):
        files.read_cloud(path)
