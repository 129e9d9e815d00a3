"""The pinhole camera against OpenCV, Open3D and what can be done in the head."""

from __future__ import annotations

import cv2
import numpy as np
import open3d as o3d
import pytest

from course_lib.camera import pinhole
from course_lib.camera.pinhole import PinholeCamera

KINECT = pinhole.preset("primesense")
# A strong but ordinary lens: 8 % barrel at the corner, with tangential terms.
LENS = (-0.28, 0.11, 0.0012, -0.0008, -0.02)
CURVED = PinholeCamera(640, 480, 520.0, 515.0, 318.0, 243.0, LENS)


def holed_depth(shape: tuple[int, int], seed: int, dtype=np.float32) -> np.ndarray:
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.4, 6.0, shape).astype(dtype)
    depth[rng.random(shape) < 0.08] = 0
    return depth


# --- fields of view ---


def test_focal_length_uses_the_half_angle():
    assert pinhole.focal_length(np.radians(90), 640) == pytest.approx(320, abs=1e-12)
    assert pinhole.focal_length(np.radians(45), 640) == pytest.approx(772.548, abs=1e-3)
    assert pinhole.field_of_view(pinhole.focal_length(0.7, 333), 333) == pytest.approx(0.7, abs=1e-15)


def test_equations_1_to_4_of_the_uav_document():
    fov, width, height = np.radians(60), 640, 480
    camera = pinhole.camera_from_fov(fov, width, height, axis="horizontal", centre="half")
    assert camera.fx == pytest.approx(0.5 * width / np.tan(fov / 2))  # (1)
    assert camera.fy == camera.fx  # (2)
    assert (camera.cx, camera.cy) == (width / 2, height / 2)  # (3), (4)
    ours = pinhole.camera_from_fov(fov, width, height, axis="horizontal")
    assert (ours.cx, ours.cy) == ((width - 1) / 2, (height - 1) / 2)


def test_a_vertical_angle_is_another_camera():
    camera = pinhole.camera_from_fov(np.radians(60), 640, 480, axis="vertical")
    assert camera.fx == pytest.approx(415.69, abs=0.01)
    assert pinhole.field_of_view(camera.fy, 480) == pytest.approx(np.radians(60))


# --- scaling ---


@pytest.mark.parametrize("width, height", [(320, 240), (1280, 960), (213, 97), (1, 1)])
def test_scaling_moves_pixels_as_resizing_does(width, height):
    small = KINECT.scaled(width, height)
    points = np.array([[0.3, -0.2, 1.7], [0.0, 0.0, 1.0], [-0.5, 0.4, 2.0]])
    old, new = pinhole.project(points, KINECT), pinhole.project(points, small)
    # Edges of the picture, at −0.5 and W − 0.5, stay edges.
    np.testing.assert_allclose((new + 0.5) / [width, height], (old + 0.5) / [640, 480], atol=1e-12)


def test_scaling_back_is_the_same_camera():
    back = KINECT.scaled(160, 120).scaled(640, 480)
    assert (back.fx, back.fy, back.cx, back.cy) == (KINECT.fx, KINECT.fy, KINECT.cx, KINECT.cy)
    assert "scaled from 640x480" in KINECT.scaled(160, 120).source


def test_matrix():
    np.testing.assert_array_equal(KINECT.matrix, [[525, 0, 319.5], [0, 525, 239.5], [0, 0, 1]])


# --- projection and distortion ---


def test_projection_agrees_with_opencv():
    points = np.random.default_rng(1).uniform([-1, -0.8, 1.2], [1, 0.8, 4], (500, 3))
    for camera in (KINECT, CURVED):
        theirs = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, np.array(camera.distortion))[0]
        np.testing.assert_allclose(pinhole.project(points, camera), theirs[:, 0], rtol=0, atol=1e-9)


def test_undistortion_agrees_with_opencv_to_a_millionth_of_a_pixel():
    u, v = np.meshgrid(np.linspace(0, 639, 41), np.linspace(0, 479, 31))
    pixels = np.stack([u, v], axis=-1).reshape(-1, 2)
    normalised = (pixels - [CURVED.cx, CURVED.cy]) / [CURVED.fx, CURVED.fy]
    ours = pinhole.undistort(normalised, LENS)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-14)
    theirs = cv2.undistortPoints(pixels[:, None], CURVED.matrix, np.array(LENS), criteria=criteria)[:, 0]
    assert np.abs((ours - theirs) * [CURVED.fx, CURVED.fy]).max() < 1e-6
    assert np.abs((pinhole.distort(ours, LENS) - normalised) * CURVED.fx).max() < 1e-9


def test_rays_of_a_curved_lens_project_back_onto_their_pixels():
    camera = CURVED.scaled(320, 240)
    u, v = np.meshgrid(np.arange(320), np.arange(240))
    rays = pinhole.pixel_rays(camera)
    assert rays.shape == (240, 320, 3) and (rays[..., 2] == 1).all()
    np.testing.assert_allclose(pinhole.project(2.5 * rays, camera), np.stack([u, v], axis=-1), atol=1e-8)


def test_undistort_keeps_nan_and_shape_and_passes_zero_distortion():
    xy = np.array([[[0.1, 0.2], [np.nan, 0.0]]])
    np.testing.assert_array_equal(pinhole.undistort(xy, np.zeros(5))[0, 0], xy[0, 0])
    assert pinhole.undistort(xy, LENS).shape == xy.shape
    assert np.isnan(pinhole.undistort(xy, LENS)[0, 1]).all()
    assert pinhole.undistort(np.zeros((0, 2)), LENS).shape == (0, 2)


def test_undistort_never_returns_a_root_beyond_the_fold():
    fold = (-0.5, 0.0, 0.0, 0.0, 0.0)  # x (1 − x² / 2) turns back at x = sqrt(2/3), where it is 0.5443
    near = pinhole.undistort([[0.5443, 0.0]], fold)
    assert near[0, 0] < np.sqrt(2 / 3)
    with pytest.raises(ValueError, match="folds over"):
        pinhole.undistort([[0.6, 0.0]], fold)


def test_points_behind_the_camera_have_no_pixel():
    pixels = pinhole.project([[0, 0, -1.0], [0, 0, 0], [0, 0, 1], [np.nan] * 3], KINECT)
    np.testing.assert_array_equal(np.isnan(pixels).all(axis=1), [True, True, False, True])


# --- deprojection ---


def open3d_points(depth: np.ndarray, camera: PinholeCamera) -> np.ndarray:
    intrinsic = o3d.camera.PinholeCameraIntrinsic(
        camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
    )
    image = o3d.geometry.Image(depth.astype(np.float32))
    cloud = o3d.geometry.PointCloud.create_from_depth_image(
        image, intrinsic, depth_scale=1.0, depth_trunc=np.inf, project_valid_depth_only=True
    )
    return np.asarray(cloud.points)


@pytest.mark.parametrize("name", ["primesense", "d455_depth_848x480", "d455_depth_424x240", "d455_color_1280x800"])
def test_the_compact_cloud_is_open3ds_point_for_point(name):
    camera = pinhole.preset(name)
    depth = holed_depth((camera.height, camera.width), 3)
    ours, theirs = pinhole.deproject_compact(depth, camera), open3d_points(depth, camera)
    assert ours.dtype == np.float64 and ours.shape == theirs.shape
    np.testing.assert_allclose(ours, theirs, rtol=1e-14, atol=0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("source", [np.float32, np.float64])
@pytest.mark.parametrize("camera", [KINECT, CURVED.scaled(160, 120), PinholeCamera(7, 33, 4.0, 5.0, 3.0, 15.0)])
def test_the_organised_cloud_is_depth_times_ray(dtype, source, camera):
    depth = holed_depth((camera.height, camera.width), 4, source)
    depth[0, 0], depth[1, 1] = np.nan, np.inf
    points = pinhole.deproject(depth, camera, dtype=dtype)
    assert points.shape == (camera.height, camera.width, 3) and points.dtype == dtype
    measured = (depth > 0) & np.isfinite(depth)
    assert np.isnan(points[~measured]).all() and not np.isnan(points[measured]).any()
    expected = (pinhole.pixel_rays(camera) * depth[..., None].astype(np.float64))[measured]
    np.testing.assert_allclose(points[measured], expected, rtol=1e-6 if dtype == np.float32 else 1e-14)
    np.testing.assert_allclose(pinhole.deproject_compact(depth, camera), expected, rtol=1e-14)


def test_deprojection_undoes_projection():
    for camera in (KINECT, CURVED.scaled(160, 120)):
        depth = holed_depth((camera.height, camera.width), 5)
        pixels = pinhole.project(pinhole.deproject(depth, camera, dtype=np.float64), camera)
        v, u = np.nonzero(depth)
        np.testing.assert_allclose(pixels[v, u], np.stack([u, v], axis=1), atol=1e-8)


def test_a_flat_wall_stays_flat_and_its_corner_is_farther_away():
    points = pinhole.deproject(np.full((480, 640), 2.0, np.float32), KINECT, dtype=np.float64)
    assert (points[..., 2] == 2).all()
    assert np.linalg.norm(points[0, 0]) == pytest.approx(2.513, abs=5e-4)  # range, not depth


def test_out_is_filled_and_returned():
    depth = holed_depth((480, 640), 6)
    out = np.full((480, 640, 3), 7.0, np.float32)
    assert pinhole.deproject(depth, KINECT, out=out) is out
    np.testing.assert_array_equal(out, pinhole.deproject(depth, KINECT))


def test_views_and_strided_images_are_welcome():
    wide = holed_depth((480, 1280), 7)
    half = wide[:, ::2]
    np.testing.assert_array_equal(pinhole.deproject(half, KINECT), pinhole.deproject(half.copy(), KINECT))
    np.testing.assert_array_equal(
        pinhole.deproject_compact(half, KINECT), pinhole.deproject_compact(half.copy(), KINECT)
    )


def test_the_input_is_left_alone():
    depth = holed_depth((480, 640), 8)
    before = depth.copy()
    pinhole.deproject(depth, KINECT)
    pinhole.deproject_compact(depth, KINECT)
    np.testing.assert_array_equal(depth, before)


# --- presets ---


def test_every_preset_is_centred_and_says_where_it_comes_from():
    for name, camera in pinhole.PRESETS.items():
        assert "nominal" in camera.source and len(camera.source) > 30, name
        assert (camera.cx, camera.cy) == ((camera.width - 1) / 2, (camera.height - 1) / 2), name
        if name.startswith("d455"):
            assert name.endswith(f"{camera.width}x{camera.height}") and "own calibration" in camera.source
    assert {"d455_depth_1280x720", "d455_depth_848x480", "d455_depth_640x480", "d455_color_1280x800"} <= set(
        pinhole.PRESETS
    )


def test_d455_presets_keep_the_data_sheets_fields_of_view():
    def degrees(name):
        camera = pinhole.preset(name)
        focal, size = (camera.fx, camera.fy), (camera.width, camera.height)
        return [np.degrees(pinhole.field_of_view(f, n)) for f, n in zip(focal, size, strict=True)]

    # Data sheet 337029, with its own tolerances: depth 87±3 x 58±3, at 4:3 75±3 x 62±3, colour 90±3 x 65±3.
    for name, sheet in (
        ("d455_depth_1280x720", (87, 58)),
        ("d455_depth_848x480", (87, 58)),
        ("d455_depth_640x480", (75, 62)),
        ("d455_color_1280x800", (90, 65)),
    ):
        np.testing.assert_allclose(degrees(name), sheet, atol=3.0, err_msg=name)
    assert degrees("d455_depth_848x480")[0] == pytest.approx(87)


def test_d455_modes_are_scaled_like_those_of_a_real_device():
    # Focal lengths that a real device of the family lists (realsense-ros issue 2788).
    listed = {"424x240": 212.1145, "480x270": 240.1297, "640x360": 320.1729, "640x480": 384.2075, "848x480": 424.2291}
    ours = [pinhole.preset(f"d455_depth_{mode}").fx for mode in listed]
    ratios = np.array(ours) / list(listed.values())
    np.testing.assert_allclose(ratios, ratios[0], rtol=1e-5)


def test_the_shortest_distance_of_the_d455():
    # Min-Z = f B / 126 with B = 95 mm: 0.51 m at 1280x720 (the maker says about 0.52 m) and 0.34 m at 848x480.
    assert pinhole.preset("d455_depth_1280x720").fx * 0.095 / 126 == pytest.approx(0.51, abs=0.005)
    assert pinhole.preset("d455_depth_848x480").fx * 0.095 / 126 == pytest.approx(0.34, abs=0.005)


# --- refusals ---

GOOD = np.ones((480, 640), np.float32)
MILLIMETRES = np.random.default_rng(9).integers(400, 4000, (480, 640)).astype(np.float32)
HALF_PIXEL = {"axis": "horizontal", "centre": "corner"}


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: PinholeCamera(640, 480, -1, 525, 0, 0), "positive"),
        (lambda: PinholeCamera(640.5, 480, 525, 525, 0, 0), "whole number"),
        (lambda: PinholeCamera(640, 0, 525, 525, 0, 0), "height"),
        (lambda: PinholeCamera(640, 480, np.nan, 525, 0, 0), "fx"),
        (lambda: PinholeCamera(640, 480, 525, 525, 0, 0, (0, 0, 0, 0)), "5 numbers"),
        (lambda: KINECT.scaled(0, 10), "width"),
        (lambda: pinhole.focal_length(60, 640), "degrees"),
        (lambda: pinhole.focal_length(-1, 640), "positive angle"),
        (lambda: pinhole.focal_length(1, 0), "size"),
        (lambda: pinhole.field_of_view(0, 640), "positive"),
        (lambda: pinhole.camera_from_fov(87, 640, 480, axis="horizontal"), "degrees"),
        (lambda: pinhole.camera_from_fov(1, 640, 480, axis="diagonal"), "horizontal"),
        (lambda: pinhole.camera_from_fov(1, 640, 480, **HALF_PIXEL), "integer"),
        (lambda: pinhole.project(np.ones((4, 2)), KINECT), "last axis"),
        (lambda: pinhole.project(np.ones((4, 3)), KINECT.matrix), "PinholeCamera"),
        (lambda: pinhole.pixel_rays(None), "PinholeCamera"),
        (lambda: pinhole.distort(np.ones(3), LENS), "last axis"),
        (lambda: pinhole.undistort(np.ones(2), LENS[:4]), "5 numbers"),
        (lambda: pinhole.deproject(GOOD[:240], KINECT), "640x240 but the camera 640x480"),
        (lambda: pinhole.deproject((GOOD * 100).astype(np.uint8), KINECT), "8-bit"),
        (lambda: pinhole.deproject((GOOD * 1000).astype(np.uint16), KINECT), "decode"),
        (lambda: pinhole.deproject(MILLIMETRES, KINECT), "millimetres"),
        (lambda: pinhole.deproject(-GOOD, KINECT), "negative"),
        (lambda: pinhole.deproject(np.ones((480, 640, 3), np.float32), KINECT), r"\(H, W\)"),
        (lambda: pinhole.deproject(GOOD, KINECT, dtype=np.float16), "float32 or float64"),
        (lambda: pinhole.deproject(GOOD, KINECT, out=np.empty((480, 640, 3))), "out"),
        (lambda: pinhole.deproject(GOOD, KINECT, out=np.empty((3, 480, 640), np.float32).T), "out"),
        (lambda: pinhole.deproject_compact(0 * GOOD, KINECT), "no pixel"),
        (lambda: pinhole.deproject_compact(MILLIMETRES, KINECT), "millimetres"),
        (lambda: pinhole.preset("d455_dept_848x480"), "did you mean 'd455_depth_848x480'"),
        (lambda: pinhole.preset("D455 DEPTH 1280x720"), "did you mean 'd455_depth_1280x720'"),
        (lambda: pinhole.preset("?"), "known are"),
    ],
)
def test_bad_input_gets_one_sentence(call, words):
    with pytest.raises(ValueError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value) and str(caught.value).endswith((".", "?", ")."))
