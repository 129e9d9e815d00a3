"""RGB-D frames, depth encodings and resizing; the encodings also against Open3D on its own sample files."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import cv2
import numpy as np
import open3d as o3d
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from course_lib.camera import pinhole, rgbd

CAMERA = pinhole.preset("primesense")
ROOM = np.tile(np.linspace(1, 3, 640, dtype=np.float32), (480, 1))
PICTURE = np.zeros((480, 640, 3), np.uint8)


# --- encodings ---


def test_what_raw_values_mean():
    raw = np.array([[0, 5000, 65535]], np.uint16)
    np.testing.assert_allclose(rgbd.decode_depth(raw, "tum"), [[0, 1, 13.107]], rtol=1e-6)
    np.testing.assert_allclose(rgbd.decode_depth(raw, "redwood"), [[0, 5, 65.535]], rtol=1e-6)
    np.testing.assert_allclose(rgbd.decode_depth(raw, "realsense"), [[0, 5, 0]], rtol=1e-6)  # 65535 is no depth
    # SUN: 2720 mm = 0b0000_1010_1010_0000, rotated left by 3 in the file.
    np.testing.assert_allclose(rgbd.decode_depth(np.array([[2720 << 3]], np.uint16), "sun"), [[2.72]], rtol=1e-6)
    np.testing.assert_allclose(rgbd.decode_depth(np.array([[0b001]], np.uint16), "sun"), [[8.192]], rtol=1e-6)
    # NYU: disparity 992 with its bytes swapped; 351.3 / (1092.5 − 992) m, to the millimetre. 2047 is no depth.
    nyu = np.array([[992, 2047]], np.uint16).byteswap()
    np.testing.assert_allclose(rgbd.decode_depth(nyu, "nyu"), [[round(351.3 / 100.5, 3), 0]], rtol=1e-6)


@given(arrays(np.uint16, (7, 9)), st.sampled_from(["tum", "sun", "redwood"]))
def test_encoding_undoes_decoding(raw, name):
    depth = rgbd.decode_depth(raw, name)
    assert depth.dtype == np.float32
    if depth.any():
        np.testing.assert_array_equal(rgbd.encode_depth(depth, name), raw)


@given(arrays(np.float32, (5, 5), elements=st.floats(0.5, 6.0, width=32)), st.sampled_from(sorted(rgbd.ENCODINGS)))
def test_decoding_undoes_encoding_to_half_a_unit(depth, name):
    back = rgbd.decode_depth(rgbd.encode_depth(depth, name), name)
    # One step of the Kinect's disparity is z² / 351.3 metres wide.
    half = depth**2 / 351.3 / 2 * 1.05 + 5e-4 if name == "nyu" else 0.5 / rgbd.ENCODINGS[name].units_per_metre
    assert (np.abs(back - depth) <= half + 1e-6).all()


def test_no_data_of_any_kind_is_encoded_as_no_data():
    depth = np.array([[0.0, np.nan, np.inf, 1.5]])
    for name in rgbd.ENCODINGS:
        back = rgbd.decode_depth(rgbd.encode_depth(depth, name), name)
        np.testing.assert_array_equal(back[0, :3], 0, err_msg=name)
        assert back[0, 3] == pytest.approx(1.5, abs=0.004)


def test_an_encoding_of_ones_own():
    mine = rgbd.DepthEncoding("mine", 4000.0, np.uint16, (0, 9), "my sensor's manual")
    np.testing.assert_array_equal(rgbd.decode_depth(np.array([[9, 4000]], np.uint16), mine), [[0, 1]])


def samples() -> Path:
    mirror = os.environ.get("COURSE_DATA_MIRROR")
    folder = Path(mirror or ".") / "open3d_samples" / "RGBD"
    if not mirror or not folder.is_dir():
        pytest.skip("needs Open3D's RGB-D samples: set COURSE_DATA_MIRROR to the folder that holds open3d_samples")
    return folder


@pytest.mark.parametrize(
    "name, depth_file, color_file, reader, trunc, median",
    [
        ("tum", "other_formats/TUM_depth.png", "other_formats/TUM_color.png", "create_from_tum_format", 4.0, 2.415),
        ("sun", "other_formats/SUN_depth.png", "other_formats/SUN_color.jpg", "create_from_sun_format", 7.0, 2.723),
        ("nyu", "other_formats/NYU_depth.pgm", "other_formats/NYU_color.ppm", "create_from_nyu_format", 7.0, 3.268),
        ("redwood", "depth/00000.png", "color/00000.jpg", "create_from_redwood_format", 4.0, 1.861),
    ],
)
def test_real_files_decode_as_open3d_decodes_them(name, depth_file, color_file, reader, trunc, median):
    folder = samples()
    raw = cv2.imread(str(folder / depth_file), cv2.IMREAD_UNCHANGED)
    assert raw.dtype == np.uint16
    ours = rgbd.decode_depth(raw, name)
    assert np.median(ours[ours > 0]) == pytest.approx(median, abs=5e-4)
    color = cv2.imread(str(folder / color_file))[..., ::-1].copy()
    images = (o3d.geometry.Image(color), o3d.geometry.Image(raw.copy()))
    theirs = np.asarray(getattr(o3d.geometry.RGBDImage, reader)(*images).depth)
    # Open3D's readers drop, silently, what is at or beyond 4 or 7 m; ours drop nothing.
    np.testing.assert_array_equal(np.where(ours < trunc, ours, 0), theirs)
    np.testing.assert_array_equal(rgbd.encode_depth(ours, name), raw)


# --- frames ---


def test_a_frame_keeps_what_it_is_given():
    frame = rgbd.RGBDFrame(PICTURE, ROOM.astype(np.float64), CAMERA, np.eye(4), name="a room")
    assert frame.depth.dtype == np.float32 and frame.registered
    assert "a room" in repr(frame) and "640x480" in repr(frame)


def test_images_that_are_not_registered_may_differ_in_size():
    frame = rgbd.RGBDFrame(np.zeros((800, 1280, 3), np.uint8), ROOM, CAMERA, registered=False)
    assert frame.color.shape == (800, 1280, 3)


def test_a_frame_cannot_be_changed():
    with pytest.raises(AttributeError):
        rgbd.RGBDFrame(PICTURE, ROOM, CAMERA).depth = ROOM


# --- resizing ---


@given(
    arrays(np.float32, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.floats(0, 9, width=32)),
    st.integers(1, 20),
    st.integers(1, 20),
)
def test_resizing_depth_invents_no_value(depth, width, height):
    small = rgbd.resize_depth(depth, width, height)
    assert small.shape == (height, width) and small.dtype == np.float32
    assert set(small.ravel().tolist()) <= set(depth.ravel().tolist())


@pytest.mark.parametrize("width, height", [(320, 240), (213, 160), (848, 480), (1920, 1440)])
def test_resizing_depth_picks_within_half_a_pixel(width, height):
    u = np.tile(np.arange(1, 641, dtype=np.float32) / 100, (480, 1))  # the column, written as a depth
    picked = np.rint(rgbd.resize_depth(u, width, height)[0] * 100) - 1
    wanted = (np.arange(width) + 0.5) * 640 / width - 0.5
    assert np.abs(picked - wanted).max() <= 0.5


def test_shrinking_by_three_is_exact_and_the_camera_agrees():
    depth, camera = ROOM[:, :639], dataclasses.replace(CAMERA, width=639)
    small = pinhole.deproject(rgbd.resize_depth(depth, 213, 160), camera.scaled(213, 160))
    np.testing.assert_allclose(small, pinhole.deproject(depth, camera)[1::3, 1::3], atol=1e-6)


def test_an_edge_between_one_and_three_metres_stays_one():
    edge = np.repeat([[1.0, 3.0]], 5, axis=1)
    assert set(rgbd.resize_depth(edge, 3, 1).ravel()) <= {1.0, 3.0}
    bilinear = cv2.resize(edge.astype(np.float32), (3, 1), interpolation=cv2.INTER_LINEAR)
    assert (bilinear == 2.0).any()  # what other code makes of it: a wall where there is air


# --- display ---


def test_rescaling_for_display():
    depth = np.array([[0.0, 1.0, 2.0, 3.0, 9.0, np.nan]], np.float32)
    np.testing.assert_array_equal(rgbd.rescale_for_display(depth, 1, 3), [[0, 0, 128, 255, 255, 0]])
    np.testing.assert_array_equal(rgbd.rescale_for_display(depth, 0, 6), [[0, 43, 85, 128, 255, 0]])


def test_valid_mask():
    np.testing.assert_array_equal(rgbd.valid_mask([[0, 1.0, np.nan, np.inf]]), [[False, True, False, False]])


# --- refusals ---

EIGHT_BITS = np.full((480, 640), 200, np.uint8)
MILLIMETRES = np.tile(np.arange(400, 1040, dtype=np.float32), (480, 1))


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: rgbd.decode_depth(EIGHT_BITS, "tum"), "8-bit.*IMREAD_UNCHANGED"),
        (lambda: rgbd.check_depth(EIGHT_BITS), "8-bit"),
        (lambda: rgbd.RGBDFrame(PICTURE, EIGHT_BITS, CAMERA), "8-bit"),
        (lambda: rgbd.decode_depth(ROOM, "tum"), "decoded already"),
        (lambda: rgbd.decode_depth(PICTURE.astype(np.uint16), "tum"), "one channel"),
        (lambda: rgbd.decode_depth(np.full((2, 2), 70000), "tum"), "16 bits"),
        (lambda: rgbd.decode_depth(np.full((2, 2), -1), "tum"), "16 bits"),
        (lambda: rgbd.decode_depth(np.ones((2, 2), np.uint16), "redwod"), "did you mean 'redwood'"),
        (lambda: rgbd.decode_depth(np.ones((2, 2), np.uint16), "zed"), "known are"),
        (lambda: rgbd.decode_depth(None, "tum"), "real numbers"),
        (lambda: rgbd.encode_depth(np.full((2, 2), 14.0), "tum"), "does not fit"),
        (lambda: rgbd.encode_depth(np.full((2, 2), 65.535), "realsense"), "does not fit"),
        (lambda: rgbd.encode_depth(np.full((2, 2), 0.0001), "redwood"), "does not fit"),
        (lambda: rgbd.encode_depth(MILLIMETRES, "redwood"), "millimetres"),
        (lambda: rgbd.DepthEncoding("x", 0, np.uint16, (), ""), "positive"),
        (lambda: rgbd.DepthEncoding("x", 1, np.uint8, (), ""), "16-bit"),
        (lambda: rgbd.DepthEncoding("x", 1, np.uint16, (), "", "log"), "linear"),
        (lambda: rgbd.check_depth(MILLIMETRES), "millimetres"),
        (lambda: rgbd.check_depth(MILLIMETRES.astype(np.uint16)), "decode"),
        (lambda: rgbd.check_depth(-ROOM), "negative"),
        (lambda: rgbd.check_depth(np.zeros((0, 4))), r"\(H, W\)"),
        (lambda: rgbd.RGBDFrame(PICTURE[:240], ROOM, CAMERA), "640x240 but depth 640x480"),
        (lambda: rgbd.RGBDFrame(PICTURE, ROOM, CAMERA.scaled(320, 240)), "camera 320x240"),
        (lambda: rgbd.RGBDFrame(PICTURE[..., 0], ROOM, CAMERA), r"\(H, W, 3\)"),
        (lambda: rgbd.RGBDFrame(PICTURE / 255, ROOM, CAMERA), "uint8"),
        (lambda: rgbd.RGBDFrame(PICTURE, ROOM, CAMERA, 2 * np.eye(4)), "T_world_camera"),
        (lambda: rgbd.RGBDFrame(PICTURE, ROOM, None), "PinholeCamera"),
        (lambda: rgbd.resize_depth(EIGHT_BITS, 10, 10), "8-bit"),
        (lambda: rgbd.resize_depth(ROOM, 0, 10), "width"),
        (lambda: rgbd.resize_depth(ROOM, 10, 2.5), "height"),
        (lambda: rgbd.rescale_for_display(ROOM, 3, 1), "below far"),
        (lambda: rgbd.rescale_for_display(EIGHT_BITS, 1, 3), "8-bit"),
    ],
)
def test_bad_input_gets_one_sentence(call, words):
    with pytest.raises(ValueError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value) and str(caught.value).endswith((".", "?", ")."))
