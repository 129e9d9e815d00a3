"""The numbers that lesson 03 and its lab live on, each with a tolerance; the functions are the lesson's own."""

from __future__ import annotations

import re

import cv2
import numpy as np
import open3d as o3d
import pytest
from lesson_helpers import functions_of, lesson_source, load

from course_lib import tasks
from course_lib.authoring import solutions, stubs
from course_lib.camera import pinhole
from course_lib.geometry import transforms
from course_lib.notebook import data
from course_lib.tasks.diagnosis.recognition import load_source
from course_lib.tasks.labs.lab_03_depth_to_points.causes import CAUSE_OF


@pytest.fixture(scope="module")
def lesson() -> dict:
    names = "project focal_length deproject by_default outlines agreement"
    return functions_of("03", names, np=np, cv2=cv2, o3d=o3d)


@pytest.fixture(scope="module")
def wall() -> np.ndarray:
    """A flat wall 1.5 m before a 640x480 camera."""
    return np.full((480, 640), 1.5)


def test_project_and_deproject_are_inverse(lesson, wall):
    camera = (525.0, 520.0, 317.0, 245.0)
    v, u = np.indices(wall.shape)
    pixels = lesson["project"](lesson["deproject"](wall, *camera), *camera)
    assert np.abs(pixels - np.stack([u, v], axis=-1)).max() < 1e-9


def test_deproject_is_the_librarys(lesson, wall):
    camera = pinhole.PinholeCamera(640, 480, 404.7, 404.7, 319.5, 239.5)
    wall[::7, ::5] = 0
    ours = lesson["deproject"](wall, camera.fx, camera.fy, camera.cx, camera.cy)
    assert np.allclose(ours, pinhole.deproject(wall, camera, dtype=np.float64), atol=1e-12, equal_nan=True)
    wall[:] = 1.5


@pytest.mark.parametrize(
    ("fov", "size", "f"), [(90, 640, 320.0), (60, 640, 554.256), (60, 480, 415.692), (45, 640, 772.548)]
)
def test_focal_lengths(lesson, fov, size, f):
    assert lesson["focal_length"](fov, size) == pytest.approx(f, abs=1e-3)


def test_ninety_degrees_hides_two_mistakes():
    """At 90 degrees the upside-down tangent and the proportion are right; at 45 they are off by hundreds of pixels."""
    task = tasks.get("03-1")
    wrong = {m.name: m for m in task.misconceptions}
    for name in ("tangent upside down", "angle in proportion"):
        namespace: dict = {"np": np}
        exec(wrong[name].source, namespace)
        assert namespace["focal_length"](90, 640) == pytest.approx(320, abs=1e-9)
        assert abs(namespace["focal_length"](45, 640) - 772.548) > 100


def test_range_at_the_corner_is_a_quarter_longer(lesson):
    """640x480 with f 525: the corner of a wall 2.000 m deep is 2.513 m away."""
    corner = lesson["deproject"](np.full((480, 640), 2.0), 525, 525, 319.5, 239.5)[0, 0]
    assert np.linalg.norm(corner) == pytest.approx(2.513, abs=1e-3)
    assert np.linalg.norm(corner) / 2.0 - 1 == pytest.approx(0.2564, abs=1e-4), "the centre of the corner pixel"
    edge = lesson["deproject"](np.full((1, 1), 2.0), 525, 525, 320, 240)[0, 0]
    assert np.linalg.norm(edge) / 2.0 - 1 == pytest.approx(0.2572, abs=1e-4), "the outer corner of the image"


@pytest.mark.parametrize(("f", "millimetres"), [(404.7, 2.621), (525.0, 2.020), (617.0, 1.719)])
def test_half_a_pixel_at_a_metre_and_a_half(lesson, wall, f, millimetres):
    right = lesson["deproject"](wall, f, f, 319.5, 239.5)
    half = lesson["deproject"](wall, f, f, 320.0, 240.0)
    off = 1000 * np.linalg.norm(half - right, axis=-1)
    assert off.mean() == pytest.approx(millimetres, abs=2e-3)
    assert off.std() < 1e-9, "half a pixel moves every point of a flat wall alike"


@pytest.mark.parametrize("f", [404.7, 423.0, 617.0])
def test_a_wrong_focal_length_keeps_the_front_view(lesson, wall, f):
    """x and y times f / 525, z untouched, so every point stays on its ray up to one magnification of the picture."""
    right = lesson["deproject"](wall, f, f, 319.5, 239.5)
    wrong = lesson["deproject"](wall, 525, 525, 319.5, 239.5)
    assert np.abs(wrong[..., 2] - right[..., 2]).max() == 0
    ratio = wrong[..., :2] / right[..., :2]
    assert np.abs(ratio - f / 525).max() < 1e-9
    picture = lesson["project"](wrong, 525, 525, 319.5, 239.5)
    assert np.abs(picture - lesson["project"](right, f, f, 319.5, 239.5)).max() < 1e-9
    assert 525 * ratio.mean() == pytest.approx(f, abs=1e-6), "one known length gives f back"


def test_the_flip_is_a_rotation_that_moves_points_by_twice_their_height_and_depth(lesson, wall):
    points = lesson["deproject"](wall, 525, 525, 319.5, 239.5)
    moved = np.linalg.norm(points * [1, -1, -1] - points, axis=-1)
    assert np.linalg.det(np.diag([1, -1, -1])) == pytest.approx(1)
    assert np.allclose(moved, 2 * np.hypot(points[..., 1], points[..., 2]))
    assert moved.min() >= 3.0


def test_open3d_truncates_at_three_metres_by_default(lesson):
    depth = np.linspace(0.5, 6.0, 640 * 480, dtype=np.float32).reshape(480, 640)
    kept = lesson["by_default"](np.zeros((480, 640, 3), np.uint8), depth)
    assert kept.max() == pytest.approx(3.0, abs=1e-3)
    assert (kept > 0).mean() == pytest.approx(2.5 / 5.5, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "points", "median", "dropped"),
    [("tum_pair", 248_250, 2.415, 8.18), ("sun_pair", 251_188, 2.723, 37.74), ("redwood_frames", 267_129, 1.861, 0.0)],
)
def test_real_pairs(lesson, name, points, median, dropped):
    frame = load(name).frames[0]
    k = frame.camera
    lifted = lesson["deproject"](frame.depth, k.fx, k.fy, k.cx, k.cy)
    measured = np.isfinite(lifted).all(axis=-1)
    assert measured.sum() == points
    assert np.median(lifted[measured][:, 2]) == pytest.approx(median, abs=1e-3)
    kept = (lesson["by_default"](frame.color, frame.depth) > 0).sum()
    assert 100 * (1 - kept / points) == pytest.approx(dropped, abs=0.01)


def agreement_by_zoom(lesson, name: str) -> dict[int, float]:
    """Mean agreement of a recording's first three frames, by ten times the zoom."""
    few = load(name).frames[:3]
    return {
        zoom: float(np.mean([lesson["agreement"](one.color, one.depth, zoom / 10) for one in few]))
        for zoom in range(8, 21)
    }


@pytest.mark.parametrize("name", ["tum_pair", "sun_pair", "redwood_frames", "realsense_planes"])
def test_registered_recordings_agree_best_as_stored(lesson, name):
    curve = agreement_by_zoom(lesson, name)
    assert max(curve, key=curve.get) == 10
    assert curve[10] > 0.72


def test_the_unregistered_recording_is_found_out(lesson):
    curve = agreement_by_zoom(lesson, "realsense_slam")
    assert curve[10] == pytest.approx(0.54, abs=0.02), "near chance, 0.5"
    assert max(curve, key=curve.get) in (15, 16, 17)
    assert 0.07 < max(curve.values()) - curve[10], "a zoom helps"
    assert max(curve.values()) < 0.68, "and brings it nowhere near the others"


def test_the_stickers_of_break_it_lie_across_the_image(lesson):
    """In the lesson's frame both are measured, at nearly one depth, so one known length gives the focal length back."""
    room = data.load("living_room")
    number = int(re.search(r"room\.frames\[(\d+)\]", lesson_source("03").read_text(encoding="utf-8"))[1])
    frame, c = room.frames[number], room.camera
    stickers = np.array([[-0.65, -0.22, 0.75], [0.65, -0.22, 0.75]])
    points = transforms.apply(transforms.invert(frame.T_world_camera), stickers)
    pixels = np.rint(lesson["project"](points, c.fx, c.fy, c.cx, c.cy)).astype(int)
    assert np.abs(frame.depth[pixels[:, 1], pixels[:, 0]] - points[:, 2]).max() < 0.03
    assert abs(points[0, 2] - points[1, 2]) < 0.1
    lazy = lesson["deproject"](frame.depth, 525, 525, c.cx, c.cy)[pixels[:, 1], pixels[:, 0]]
    measured = np.linalg.norm(lazy[1] - lazy[0])
    assert measured == pytest.approx(1.3 * c.fx / 525, abs=0.02)
    assert 525 * measured / 1.3 == pytest.approx(c.fx, rel=0.015)


WIDER = 404.65 / 300  # by the right focal length over the one that task 4 takes


@pytest.mark.parametrize(
    ("cause", "shown"),
    [
        ("cut off at 3 m", lambda now, true: now[4] < true[4]),
        ("another camera's depth scale", lambda now, true: np.allclose(now[:4], 2 * true[:4])),
        ("another camera's focal length", lambda now, true: np.allclose(now / true, [WIDER, WIDER, 1, 1, 1])),
        ("rows for columns", lambda now, true: now[0] < now[1] and np.allclose(now[2:], true[2:])),
        ("z taken for range", lambda now, true: 0.5 * true[3] < now[3] < true[3] and now[4] == true[4]),
        ("flip left in", lambda now, true: np.allclose(now[:3], true[:3]) and np.isclose(now[3], -true[3])),
    ],
)
def test_each_letter_of_task_4_shows_its_cause_and_no_other(cause, shown):
    """Width, height, depth, median z and number of points, as the lab's table has them, tell the six apart."""
    true, *measures = data.of_lab("03")["measures"]
    fitting = [letter for letter, now in zip("ABCDEF", measures, strict=True) if shown(now, true)]
    assert [CAUSE_OF[letter] for letter in fitting] == [cause]


def test_the_given_cloud_of_task_3_is_what_its_code_gives():
    """On the lab's frame, stored with 1500 steps a metre; of every second row and column."""
    stub = solutions.stub("03-3")
    given = load_source(re.sub(rf"^ *{re.escape(stubs.MEND)}\n.*\n", "", stub, flags=re.M), "cloud_from_raw")
    room = data.load("living_room")
    raw = np.round(1500 * room.truth["depth"][15]).astype(np.uint16)
    few = np.zeros_like(raw)
    few[::2, ::2] = raw[::2, ::2]
    answer = given(few, room.frames[15].color, 1500.0, room.camera.matrix)
    drawn = data.of_lab("03")
    assert np.abs(answer["points"] - drawn["given_points"] / 1000).max() < 1e-3
    assert (answer["colors"] == drawn["given_colors"]).all()


def test_the_lessons_deproject_fails_on_a_window_of_ranges(lesson):
    """It is right only where both are undone before: the window, and the length of the ray."""
    for case in tasks.get("03-2").public():
        ranges, fx, fy, cx, cy, left, top = case.given.values()
        v, u = np.indices(ranges.shape)
        ray = np.linalg.norm(lesson["deproject"](np.ones(ranges.shape), fx, fy, cx - left, cy - top), axis=-1)
        right = lesson["deproject"](ranges / ray, fx, fy, cx - left, cy - top)
        assert np.nanmax(np.abs(right - case.truth)) < 1e-6
        assert np.nanmax(np.abs(lesson["deproject"](ranges, fx, fy, cx, cy) - case.truth)) > 0.1
        assert np.nanmax(np.abs(lesson["deproject"](ranges, fx, fy, cx - left, cy - top) - case.truth)) > 0.1


def test_the_things_of_task_5_leave_no_naive_rule_a_chance():
    """Nonsense lies at both ends of the list, and the principal point well beside the middle, to where things lean."""
    for seed in range(20):
        for case in tasks.fresh(tasks.get("03-5"), seed):
            pixels, depths, lengths, cx, cy = case.given.values()
            ends = (pixels - [cx, cy]) * depths[..., None]
            with np.errstate(invalid="ignore"):
                beside = np.sqrt(lengths**2 - (depths[:, 0] - depths[:, 1]) ** 2)
            off = np.abs(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) / beside / case.truth - 1)
            nonsense = ~(off < 0.04)
            assert nonsense.sum() >= 12 and nonsense[:10].sum() >= 5 and nonsense[-10:].sum() >= 4
            assert np.abs([cx - 319.5, cy - 239.5]).min() > 20
            toward = np.einsum("ij,j->i", pixels[:, 1] - pixels[:, 0], [cx - 319.5, cy - 239.5])
            assert (np.sign(depths[:, 1] - depths[:, 0]) == np.sign(toward))[~nonsense].mean() > 0.9
