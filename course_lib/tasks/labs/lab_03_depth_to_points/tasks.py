"""Lab 03: focal lengths, deprojection, and what goes wrong on the way from a depth image to points.

Images are indexed [row v, column u], pixel centres lie at whole numbers, depth is z; the camera looks along +z with x
to the right and y down. Truth is computed pixel by pixel in float64 (`_lift`); the lab asks for the same in one go.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from course_lib.tasks.core import Case, Task, Verdict
from course_lib.tasks.judges import (
    judge_array,
    judge_number,
    refuse,
    worst_of,
)
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_03_depth_to_points.causes import CAUSE_OF, CAUSES, SIGNS, which_mistakes
from course_lib.tasks.labs.lab_03_depth_to_points.estimate_mistakes import ESTIMATE_MISTAKES
from course_lib.tasks.labs.lab_03_depth_to_points.focal_mistakes import FOCAL_MISTAKES
from course_lib.tasks.labs.lab_03_depth_to_points.mend_mistakes import MEND_MISTAKES
from course_lib.tasks.labs.lab_03_depth_to_points.mistakes import DEPROJECT_MISTAKES
from course_lib.tasks.labs.lab_03_depth_to_points.parts import (
    cloud_anatomy,
    deproject_anatomy,
    focal_anatomy,
)
from course_lib.tasks.labs.lab_03_depth_to_points.rods import focal_distance, guess_focal, judge_focal, rods
from course_lib.tasks.plain import Plain, describe

# --------------------------------------------------------------------------------------------------- 1 focal length

_FOCAL_TOLERANCE = 0.05  # pixels


def _focal_cases(rng: np.random.Generator) -> list[Case]:
    """Head-checkable 90 degrees, which hides two mistakes, and angles that do not."""
    angles = [
        (90.0, 640, "90 degrees, the one to do in your head"),
        (45.0, 640, "half of that angle"),
        (60.0, 480, "60 degrees from top to bottom"),
        (float(rng.uniform(95, 125)), 1280, "a wide lens"),
        (float(rng.uniform(20, 40)), 2 * int(rng.integers(150, 450)) + 1, "a narrow lens, an odd number of pixels"),
    ]
    return [
        Case({"fov_degrees": fov, "pixels": size}, {"truth": size / 2 / float(np.tan(np.deg2rad(fov) / 2))}, name)
        for fov, size, name in angles
    ]


# ---------------------------------------------------------------------------------------------------- 2 deprojection

POINT_TOLERANCE = 2e-4  # metres


def _lift(depth: np.ndarray, fx: float, fy: float, cx: float, cy: float) -> np.ndarray:
    """(H, W, 3) float64 points of a depth image in metres; NaN where it is 0."""
    height, width = depth.shape
    points = np.full((height, width, 3), np.nan)
    for u in range(width):
        for v in np.flatnonzero(depth[:, u] > 0):
            z = float(depth[v, u])
            points[v, u] = (u - cx) / fx * z, (v - cy) / fy * z, z
    return points


def surface(rng: np.random.Generator, height: int, width: int, near: float, far: float) -> np.ndarray:
    """(H, W) float64 depth in metres of a slanted wall with a nearer box in front of it; no holes."""
    v, u = np.indices((height, width))
    slant = (u / width) * rng.uniform(0.3, 0.6) + (v / height) * rng.uniform(0.2, 0.3)
    depth = near + (far - near) * (0.3 + 0.7 * slant / slant.max())
    top, left = height // 4 + int(rng.integers(3)), width // 4 + int(rng.integers(3))
    depth[top : top + height // 3, left : left + width // 3] = near
    return depth


def with_holes(rng: np.random.Generator, depth: np.ndarray, share: float) -> np.ndarray:
    """The same image with `share` of its pixels set to 0, the first one among them."""
    holes = rng.random(depth.shape) < share
    holes.flat[0] = True
    return np.where(holes, 0, depth)


def _window_case(z: np.ndarray, camera: tuple[float, float, float, float], left: int, top: int, name: str) -> Case:
    """A window of ranges, in float32, of a depth image (H, W) whose first pixel is [top, left] of the full one."""
    fx, fy, cx, cy = camera
    rays = _lift(np.ones(z.shape), fx, fy, cx - left, cy - top)
    length = np.linalg.norm(rays, axis=2)
    ranges = (z * length).astype(np.float32)
    points = np.where(ranges[..., None] > 0, rays * (ranges / length)[..., None], np.nan)
    given = {"ranges": ranges, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "left": left, "top": top}
    return Case(given, {"truth": points}, name)


def _window_cases(rng: np.random.Generator) -> list[Case]:
    wide = tuple(rng.uniform((56, 66, 42, 34), (64, 74, 46, 38)).tolist())
    tall = tuple(rng.uniform((55, 48, 30, 44), (60, 52, 34, 48)).tolist())
    walls = np.array([[2.0, 0.0, 4.0]])
    return [
        _window_case(walls, (4.0, 5.0, 0.0, 0.0), 3, 0, "three pixels; the first is a triangle of 3, 4 and 5"),
        _window_case(
            surface(rng, 30, 40, 0.8, 3.5),
            wide,
            int(rng.integers(48, 54)),
            int(rng.integers(5, 12)),
            "a wide window right of the principal point, without holes",
        ),
        _window_case(
            with_holes(rng, surface(rng, 36, 24, 0.6, 5.0), 0.2),
            tall,
            int(rng.integers(8, 14)),
            int(rng.integers(24, 34)),
            "a tall window with holes",
        ),
    ]


# ------------------------------------------------------------------------------------------------------------ 3 mend


def _raw_case(
    rng: np.random.Generator, shape: tuple[int, int], near: float, far: float, units: float, name: str
) -> Case:
    """A stored depth image, its colours and its camera, in the form of a real recording."""
    height, width = shape
    raw = np.rint(with_holes(rng, surface(rng, height, width, near, far), 0.15) * units).astype(np.uint16)
    color = rng.integers(0, 256, (height, width, 3)).astype(np.uint8)
    f = rng.uniform(0.8, 1.0) * width
    cx, cy = (width - 1) / 2 + rng.uniform(-1, 1), (height - 1) / 2 + rng.uniform(-1, 1)
    K = np.array([[f, 0, cx], [0, 1.1 * f, cy], [0, 0, 1]])
    points = _lift(raw / units, f, 1.1 * f, cx, cy)
    keep = raw > 0
    given = {"raw": raw, "color": color, "units_per_metre": float(units), "camera_matrix": K}
    return Case(given, {"truth": {"points": points[keep], "colors": color[keep]}}, name)


def _raw_cases(rng: np.random.Generator) -> list[Case]:
    return [
        _raw_case(rng, (24, 32), 0.7, 2.6, 5000.0, "5000 units a metre, a desk"),
        _raw_case(rng, (24, 32), 1.2, 6.5, 1000.0, "1000 units a metre, a corridor"),
        _raw_case(rng, (30, 20), 0.9, 5.5, 10000.0, "10,000 units a metre, a tall image"),
        _raw_case(rng, (18, 24), 2.0, 8.5, 5000.0, "5000 units a metre, a hall"),
        _raw_case(rng, (18, 24), 25.0, 55.0, 1000.0, "1000 units a metre, a hillside 30 m away and more"),
    ]


def _judge_cloud(case: Case, answer: Plain) -> Verdict:
    form = 'a dict with the keys "points" and "colors"'
    if not isinstance(answer, dict) or set(answer) != {"points", "colors"}:
        got = f"a dict with {sorted(map(str, answer))}"[:120] if isinstance(answer, dict) else describe(answer)
        missing = ": is the return missing?" if answer is None else "."
        return refuse(f"Expected {form}, got {got}{missing}", POINT_TOLERANCE, "m")
    points, truth = answer["points"], case.truth["points"]
    if isinstance(points, np.ndarray) and points.ndim == 2 and points.shape[1] == 3 and len(points) != len(truth):
        wrong = len(points) - len(truth)
        what = (
            f"{wrong:,} points too many: they come from pixels without data."
            if wrong > 0
            else (f"{-wrong:,} measured points are missing.")
        )
        return refuse(f"{len(points):,} points for {len(truth):,} measured pixels: {what}", POINT_TOLERANCE, "m")
    verdict = worst_of(
        judge_array(points, truth, POINT_TOLERANCE, "m", axes="xyz", what="the points"),
        judge_array(answer["colors"], case.truth["colors"], 0.2, "of 255", what="the colours", kind="int"),
    )
    return replace(verdict, score=float(verdict.passed))


# -------------------------------------------------------------------------------------------------------------- all

TASKS = (
    Task(
        id="03-1",
        title="focal length from the field of view",
        points=1,
        version=2,
        kind="fill",
        signature="def focal_length(fov_degrees, pixels)",
        cases=_focal_cases,
        judge=lambda case, answer: judge_number(answer, case.truth, _FOCAL_TOLERANCE, "px", "the focal length"),
        misconceptions=FOCAL_MISTAKES,
        hides=("course_lib.camera.pinhole.focal_length",),
        where="lesson 03, section 2 (the focal length comes from the field of view)",
        repeats=True,
    ),
    Task(
        id="03-2",
        title="deproject a window of ranges",
        points=3,
        version=2,
        kind="write",
        signature="def deproject(ranges, fx, fy, cx, cy, left, top)",
        cases=_window_cases,
        judge=lambda case, answer: judge_array(answer, case.truth, POINT_TOLERANCE, "m", axes="xyz", what="the image"),
        misconceptions=DEPROJECT_MISTAKES,
        anatomy=deproject_anatomy,
        hides=("course_lib.camera.pinhole.deproject",),
        where="lesson 03, section 3 (from a pixel back to a point) and section 4 (what goes wrong, in millimetres)",
    ),
    Task(
        id="03-3",
        title="mend a cloud from a stored frame",
        points=3,
        version=2,
        kind="mend",
        signature="def cloud_from_raw(raw, color, units_per_metre, camera_matrix)",
        cases=_raw_cases,
        judge=_judge_cloud,
        misconceptions=MEND_MISTAKES,
        anatomy=cloud_anatomy,
        hides=(
            "course_lib.camera.pinhole.deproject",
            "course_lib.cloud.pointcloud.from_frame",
            "course_lib.camera.rgbd.decode_depth",
        ),
        where="lesson 03, section 4 (what goes wrong, in millimetres)",
    ),
    which_cause(
        "03-4",
        "which mistake made this",
        CAUSE_OF,
        "the six clouds above",
        which_mistakes(CAUSE_OF),
        "lesson 03, section 4 (what goes wrong, in millimetres)",
        causes=CAUSES,
        signs=SIGNS,
        version=2,
    ),
    Task(
        id="03-5",
        title="find the focal length yourself",
        points=4,
        version=2,
        kind="open",
        signature="def estimate_focal(pixels, depths, lengths, cx, cy)",
        cases=lambda rng: [rods(rng)],
        judge=judge_focal,
        misconceptions=ESTIMATE_MISTAKES,
        distance=focal_distance,
        anatomy=focal_anatomy,
        guess=guess_focal,
        where="lesson 03, Break it, for the idea, then this task's hints, for what slants in depth",
    ),
    in_words(
        "03-6",
        "explain the front view",
        (
            "0: says that the picture, the depth or the camera must be faulty, or repeats that the scale is wrong.",
            "1: says that x, y and z have one factor, so each point stays on its ray and the picture is the same; or "
            "names lengths that tell a wrong scale from a wrong f.",
            "2: both: one factor for all three, so the front view cannot show it; and a length in depth and one across "
            "the image: the scale spoils both alike, a wrong f only the one across.",
        ),
        "lesson 03, Break it (the front view hides it) and section 4 (what goes wrong, in millimetres)",
        version=2,
    ),
)
