"""Point clouds, PCL's layouts and PointCloud2 messages: against hand-made bytes and for any layout (hypothesis)."""

from __future__ import annotations

import dataclasses
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from course_lib.camera import pinhole, rgbd
from course_lib.cloud import pointcloud
from course_lib.cloud.pointcloud import POINT_TYPES, PointCloud, PointCloud2, PointField
from course_lib.geometry import transforms

CUBE = np.array(np.meshgrid([0, 1], [0, 2], [0, 3])).reshape(3, -1).T.astype(float)


# --- clouds ---


def test_a_cloud_keeps_types_and_counts():
    cloud = PointCloud(CUBE.astype(np.float32), np.zeros((8, 3), np.uint8), labels=np.arange(8))
    assert len(cloud) == 8 and cloud.points.dtype == np.float32
    assert repr(cloud) == "PointCloud(8 points, with colors, labels)"
    assert PointCloud([[1, 2, 3]]).points.dtype == np.float64


def test_drop_nan_takes_every_attribute_along():
    points = np.array([[0, 0, 1], [np.nan, 0, 1], [0, 1, np.inf], [2, 2, 2.0]])
    colors = np.arange(12, dtype=np.uint8).reshape(4, 3)
    cloud = pointcloud.drop_nan(PointCloud(points, colors, normals=points, labels=[5, 6, 7, 8]))
    np.testing.assert_array_equal(cloud.points, points[[0, 3]])
    np.testing.assert_array_equal(cloud.colors, colors[[0, 3]])
    np.testing.assert_array_equal(cloud.normals, points[[0, 3]])
    np.testing.assert_array_equal(cloud.labels, [5, 8])


def a_frame(**changes) -> rgbd.RGBDFrame:
    rng = np.random.default_rng(2)
    camera = pinhole.preset("d455_depth_424x240")
    depth = rng.uniform(1, 3, (240, 424)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.1] = 0
    color = rng.integers(0, 256, (240, 424, 3), dtype=np.uint8)
    pose = transforms.look_at([1, 2, 1], [0, 0, 1])
    usual = {"color": color, "depth": depth, "camera": camera, "T_world_camera": pose}
    return rgbd.RGBDFrame(**{**usual, **changes})


def test_a_frame_and_its_organised_points_make_the_same_cloud():
    frame = a_frame()
    one = pointcloud.from_frame(frame)
    points = pinhole.deproject(frame.depth, frame.camera, dtype=np.float64)
    there = frame.depth > 0
    np.testing.assert_allclose(one.points, points[there], rtol=1e-14)
    np.testing.assert_array_equal(one.colors, frame.color[there])
    assert len(one) == np.count_nonzero(frame.depth)


def test_a_frame_in_the_world():
    frame = a_frame()
    camera, world = pointcloud.from_frame(frame).points, pointcloud.from_frame(frame, world=True).points
    np.testing.assert_allclose(world, transforms.apply(frame.T_world_camera, camera))


def test_colours_that_are_not_registered_are_not_used():
    assert pointcloud.from_frame(a_frame(registered=False)).colors is None


# --- PCL's layouts ---

LAYOUT = {  # name: size, {field: offset}, as PCL 1.13's point_types.hpp has them
    "PointXYZ": (16, {"x": 0, "y": 4, "z": 8}),
    "PointXYZI": (32, {"x": 0, "y": 4, "z": 8, "intensity": 16}),
    "PointXYZRGB": (32, {"x": 0, "y": 4, "z": 8, "rgb": 16}),
    "PointXYZRGBA": (32, {"x": 0, "y": 4, "z": 8, "rgba": 16}),
    "Normal": (32, {"normal_x": 0, "normal_y": 4, "normal_z": 8, "curvature": 16}),
    "PointNormal": (
        48,
        {"x": 0, "y": 4, "z": 8, "normal_x": 16, "normal_y": 20, "normal_z": 24, "curvature": 32},
    ),
}


def test_point_types_are_pcls_byte_for_byte():
    assert set(POINT_TYPES) == set(LAYOUT)
    for name, (size, offsets) in LAYOUT.items():
        kind = POINT_TYPES[name]
        assert kind.itemsize == size, name
        assert {field: kind.fields[field][1] for field in kind.names} == offsets, name
        assert all(kind.fields[field][0] == (np.uint32 if field == "rgba" else np.float32) for field in kind.names)


def test_one_coloured_point_as_bytes():
    point = np.zeros(1, POINT_TYPES["PointXYZRGB"])
    point["x"], point["y"], point["z"] = 1.0, 2.0, 3.0
    point["rgb"] = pointcloud.pack_rgb(np.array([[255, 128, 1]], np.uint8))
    # x, y, z, four bytes of padding, then b, g, r, 0, then twelve bytes of padding.
    assert point.tobytes() == struct.pack("<3f4x4B12x", 1, 2, 3, 1, 128, 255, 0)


def test_packing_colours_undoes_itself_for_every_byte():
    colors = np.stack(np.meshgrid(*[[0, 1, 127, 128, 254, 255]] * 3), axis=-1).astype(np.uint8)
    packed = pointcloud.pack_rgb(colors)
    assert packed.dtype == np.float32 and packed.shape == colors.shape[:-1]
    np.testing.assert_array_equal(pointcloud.unpack_rgb(packed), colors)
    # With PCL's alpha of 255 the float is a NaN; its bits must survive all the same.
    opaque = (packed.view(np.uint32) | 0xFF000000).view(np.float32)
    assert np.isnan(opaque[3:]).any()
    np.testing.assert_array_equal(pointcloud.unpack_rgb(opaque), colors)
    np.testing.assert_array_equal(pointcloud.unpack_rgb(opaque.view(np.uint32)), colors)
    swapped = opaque.astype(opaque.dtype.newbyteorder(">"))
    np.testing.assert_array_equal(pointcloud.unpack_rgb(swapped), colors)


# --- PointCloud2 ---

XYZ = (PointField("x", 0, 7), PointField("y", 4, 7), PointField("z", 8, 7))


def by_hand(order: str) -> PointCloud2:
    """Two rows of two points: a point is x, y, z, two bytes of padding, u16 ring; a row ends with three bytes more."""
    points = [(1.0, 2.0, 3.0, 7), (4.0, 5.0, 6.0, 8), (float("nan"),) * 3 + (9,), (-1.0, 0.5, 65.0, 65535)]
    packed = [struct.pack(f"{order}3f2xH", *p) for p in points]
    data = packed[0] + packed[1] + b"\xab\xcd\xef" + packed[2] + packed[3] + b"\xab\xcd\xef"
    return PointCloud2(2, 2, (*XYZ, PointField("ring", 14, 4)), order == ">", 16, 35, data, False)


@pytest.mark.parametrize("order", ["<", ">"])
def test_bytes_made_by_hand(order):
    array = pointcloud.from_message(by_hand(order))
    assert array.shape == (2, 2) and array.dtype.itemsize == 16
    np.testing.assert_array_equal(array["ring"], [[7, 8], [9, 65535]])
    np.testing.assert_array_equal(array["x"], [[1, 4], [np.nan, -1]])
    assert array["z"].dtype == np.dtype(np.float32) and array["z"].dtype.isnative
    xyz = pointcloud.message_to_xyz(by_hand(order))
    assert xyz.shape == (4, 3) and xyz.dtype == np.float32
    assert len(pointcloud.drop_nan(xyz)) == 3


@pytest.mark.parametrize("order", ["<", ">"])
def test_writing_makes_those_bytes(order):
    message = by_hand(order)
    array = pointcloud.from_message(message)
    written = pointcloud.to_message(array, big_endian=order == ">", row_padding=3)
    clean = message.data.replace(b"\xab\xcd\xef", b"\0\0\0")
    assert written == dataclasses.replace(message, data=clean)


def test_the_last_row_may_lack_its_padding():
    message = by_hand("<")
    short = dataclasses.replace(message, data=message.data[:-3])
    np.testing.assert_array_equal(pointcloud.from_message(short)["ring"], pointcloud.from_message(message)["ring"])


@st.composite
def structured_arrays(draw):
    kinds = draw(st.lists(st.sampled_from("i1 u1 i2 u2 i4 u4 f4 f8".split()), min_size=1, max_size=6))
    offsets, end = [], 0
    for kind in kinds:
        end += draw(st.integers(0, 5))
        offsets.append(end)
        end += np.dtype(kind).itemsize
    names = [f"f{i}" for i in range(len(kinds))]
    size = end + draw(st.integers(0, 7))
    dtype = np.dtype({"names": names, "formats": kinds, "offsets": offsets, "itemsize": size})
    shape = draw(st.sampled_from([(1,), (6,), (2, 3), (3, 1)]))
    seed = draw(st.integers(0, 2**32 - 1))
    raw = np.random.default_rng(seed).integers(0, 256, (*shape, dtype.itemsize), dtype=np.uint8)
    return raw.reshape(*shape, -1).view(np.uint8).copy().view(dtype)[..., 0]


@given(structured_arrays(), st.booleans(), st.integers(0, 9), st.integers(0, 9))
def test_any_layout_comes_back(array, big_endian, padding, row_padding):
    message = pointcloud.to_message(array, big_endian=big_endian, padding=padding, row_padding=row_padding)
    assert message.point_step == array.dtype.itemsize + padding
    assert len(message.data) == message.height * message.row_step
    back = pointcloud.from_message(message)
    assert back.shape == (array.shape if array.ndim == 1 or array.shape[0] > 1 else array.shape[1:])
    for name in array.dtype.names:
        assert back[name].dtype == array[name].dtype
        assert back[name].tobytes() == array[name].tobytes()  # bits, so that NaNs count too


@pytest.mark.parametrize("name", sorted(POINT_TYPES))
def test_pcls_types_come_back_as_themselves(name):
    array = np.zeros(5, POINT_TYPES[name])
    assert pointcloud.from_message(pointcloud.to_message(array)).dtype == array.dtype


def test_dense_means_no_nan_in_a_coordinate():
    array = np.zeros(3, POINT_TYPES["PointXYZRGB"])
    assert pointcloud.to_message(array).is_dense
    array["rgb"] = np.array([0xFFFFFFFF], np.uint32).view(np.float32)  # a colour whose bits spell NaN
    assert pointcloud.to_message(array).is_dense
    array["y"][1] = np.nan
    assert not pointcloud.to_message(array).is_dense


def test_height_folds_a_list_into_rows():
    array = np.zeros(12, POINT_TYPES["PointXYZ"])
    array["x"] = np.arange(12)
    message = pointcloud.to_message(array, height=3, frame_id="camera")
    assert (message.height, message.width, message.row_step, message.frame_id) == (3, 4, 64, "camera")
    np.testing.assert_array_equal(pointcloud.from_message(message)["x"], np.arange(12).reshape(3, 4))


def test_fields_may_come_in_any_order_and_hold_several_numbers():
    fields = (PointField("z", 8, 7), PointField("rgb", 12, 2, 3), PointField("x", 0, 7), PointField("y", 4, 7, 0))
    message = PointCloud2(1, 1, fields, False, 15, 15, struct.pack("<3f3B", 1, 2, 3, 4, 5, 6), True)
    array = pointcloud.from_message(message)
    np.testing.assert_array_equal(array["rgb"], [[4, 5, 6]])
    np.testing.assert_array_equal(pointcloud.message_to_xyz(message), [[1, 2, 3]])
    assert pointcloud.from_message(pointcloud.to_message(array)).tobytes() == array.tobytes()


def with_(**changes) -> PointCloud2:
    return dataclasses.replace(by_hand("<"), **changes)


NAN3 = np.full((4, 3), np.nan)


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: PointCloud(np.zeros((0, 3))), "none"),
        (lambda: PointCloud(np.zeros((4, 2))), "last axis"),
        (lambda: PointCloud(np.zeros((2, 4, 3))), r"\(N, 3\)"),
        (lambda: PointCloud(CUBE, np.zeros((8, 3))), "uint8.*255"),
        (lambda: PointCloud(CUBE, np.zeros((7, 3), np.uint8)), r"\(8, 3\)"),
        (lambda: PointCloud(CUBE, normals=CUBE[:3]), "normals"),
        (lambda: PointCloud(CUBE, labels=np.zeros(8)), "8 integers"),
        (lambda: PointCloud(CUBE).select(np.zeros(8, bool)), "none"),
        (lambda: pointcloud.drop_nan(NAN3), "all 4 points"),
        (lambda: pointcloud.from_frame(CUBE), "RGBDFrame"),
        (lambda: pointcloud.from_frame(a_frame(T_world_camera=None), world=True), "unknown"),
        (lambda: pointcloud.from_frame(a_frame(depth=np.zeros((240, 424), np.float32))), "no pixel"),
        (lambda: pointcloud.point_type("PointXYZRBG"), "did you mean 'PointXYZRGB'"),
        (lambda: pointcloud.pack_rgb(np.zeros((3, 3))), "uint8"),
        (lambda: pointcloud.unpack_rgb(np.zeros(3)), "float32 or uint32"),
        (lambda: pointcloud.to_message(CUBE), "structured"),
        (lambda: pointcloud.to_message(np.zeros(0, POINT_TYPES["PointXYZ"])), "with points"),
        (lambda: pointcloud.to_message(np.zeros(5, POINT_TYPES["PointXYZ"]), height=2), "divide"),
        (lambda: pointcloud.to_message(np.zeros(5, POINT_TYPES["PointXYZ"]), padding=-1), "bytes from 0"),
        (lambda: pointcloud.to_message(np.zeros(5, POINT_TYPES["PointXYZ"]), height=0), "height"),
        (lambda: pointcloud.from_message(b"bytes"), "expected a PointCloud2"),
        (lambda: PointCloud(CUBE).select([0, 8]), "indices below 8"),
        (lambda: PointCloud(CUBE).select([True, False]), "mask of 8"),
        (lambda: pointcloud.to_message(np.zeros(5, [("t", "i8")])), "no datatype"),
        (lambda: pointcloud.from_message(with_(data=by_hand("<").data[:-10])), "truncated"),
        (lambda: pointcloud.from_message(with_(point_step=12)), "point_step is only 12"),
        (lambda: pointcloud.from_message(with_(row_step=31)), "row_step 31"),
        (lambda: pointcloud.from_message(with_(width=0)), "no point"),
        (lambda: pointcloud.from_message(with_(fields=())), "no field"),
        (lambda: pointcloud.from_message(with_(fields=(PointField("x", 0, 9),))), "datatype 9"),
        (lambda: pointcloud.from_message(with_(fields=(*XYZ, PointField("x", 12, 2)))), "two fields"),
        (lambda: pointcloud.message_to_xyz(with_(fields=XYZ[:2])), "no field z"),
    ],
)
def test_bad_input_gets_one_sentence(call, words):
    with pytest.raises(ValueError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value) and str(caught.value).endswith((".", "?"))
