"""Make the recordings beside this file, with librealsense itself and a camera that exists in software only.

    python make.py out.bag        under pyrealsense2 2.55, which writes ROS 1
    python make.py out.db3        under pyrealsense2 2.59, which writes ROS 2

Not part of the tests: pyrealsense2 is not among the course's packages. What the camera sees: test_recording.py.
"""

import sys
import time

import numpy as np
import pyrealsense2 as rs

WIDTH, HEIGHT, FRAMES = 64, 48, 4
DEPTH_FOCAL, COLOR_FOCAL, TILT = 50.0, 55.0, 0.05
LENS = [-0.2, 0.1, -0.004, 0.004, -0.02]
v, u = np.mgrid[:HEIGHT, :WIDTH]


def intrinsics(focal: float, model: rs.distortion, coefficients: list[float]) -> rs.intrinsics:
    one = rs.intrinsics()
    one.width, one.height, one.fx, one.fy, one.ppx, one.ppy = WIDTH, HEIGHT, focal, focal, 32.0, 24.0
    one.model, one.coeffs = model, coefficients
    return one


def stream(kind: rs.stream, form: rs.format, size: int, number: int, lens: rs.intrinsics) -> rs.video_stream:
    one = rs.video_stream()
    one.type, one.index, one.uid, one.width, one.height, one.fps = kind, 0, number, WIDTH, HEIGHT, 30
    one.bpp, one.fmt, one.intrinsics = size, form, lens
    return one


def frame(profile: rs.stream_profile, number: int, size: int, pixels: np.ndarray) -> rs.software_video_frame:
    one = rs.software_video_frame()
    one.stride, one.bpp, one.timestamp, one.frame_number = WIDTH * size, size, 33.3 * number, number
    one.domain, one.profile, one.pixels = rs.timestamp_domain.hardware_clock, profile, pixels.tobytes()
    if size == 2:
        one.depth_units = 0.001
    return one


def main(out: str) -> None:
    device = rs.software_device()
    for name, text in (
        (rs.camera_info.name, "Intel RealSense D455"),
        (rs.camera_info.serial_number, "1"),
        (rs.camera_info.firmware_version, "5.16.0.1"),
        (rs.camera_info.product_id, "0B5C"),
        (rs.camera_info.product_line, "D400"),
    ):
        device.register_info(name, text)
    stereo, rgb = device.add_sensor("Stereo Module"), device.add_sensor("RGB Camera")
    straight = intrinsics(DEPTH_FOCAL, rs.distortion.brown_conrady, [0.0] * 5)
    depth = stereo.add_video_stream(stream(rs.stream.depth, rs.format.z16, 2, 1, straight))
    bent = intrinsics(COLOR_FOCAL, rs.distortion.inverse_brown_conrady, LENS)
    color = rgb.add_video_stream(stream(rs.stream.color, rs.format.rgb8, 3, 2, bent))
    stereo.add_read_only_option(rs.option.depth_units, 0.001)
    pose = rs.extrinsics()
    R = np.array([[np.cos(TILT), 0, np.sin(TILT)], [0, 1, 0], [-np.sin(TILT), 0, np.cos(TILT)]])
    pose.rotation, pose.translation = R.T.ravel().tolist(), [0.059, 0.001, -0.002]
    depth.register_extrinsics_to(color, pose)
    recorder = rs.recorder(out, device)
    sensors, queue = recorder.query_sensors(), rs.syncer()
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles()[0])
        sensor.start(queue)
    for k in range(FRAMES):
        z = (1500 + 10 * u + k).astype(np.uint16)
        stereo.on_video_frame(frame(depth.as_video_stream_profile(), k, 2, z))
        if k != 2:  # one colour image is lost
            pixels = np.dstack([4 * u, 5 * v, np.full_like(u, 60 * k)]).astype(np.uint8)
            rgb.on_video_frame(frame(color.as_video_stream_profile(), k, 3, pixels))
        time.sleep(0.05)
    for sensor in sensors:
        sensor.stop()
        sensor.close()


main(sys.argv[1])
