"""Tasks 02-1 to 02-3 as they were while they asked for the lesson's code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from course_lib.geometry import transforms
from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.judges import judge_array, judge_number, judge_transform
from course_lib.tasks.plain import Plain

_ROW = "def row_of(u, v, width, height):\n    return "
ROW_MISTAKES = (
    Misconception(
        "columns first",
        "u · height + v, which counts column by column: images are stored row by row, v rows of `width` come first",
        _ROW + "u * height + v\n",
    ),
    Misconception(
        "height for width",
        "v · height + u: a full row of the image has `width` pixels, not `height`",
        _ROW + "v * height + u\n",
    ),
    Misconception(
        "u and v exchanged",
        "u · width + v: v counts the rows that lie above, and each of them has `width` pixels",
        _ROW + "u * width + v\n",
    ),
    Misconception(
        "counted from one",
        "rows counted from one: the first pixel is row 0 of the list, and the first row is v = 0",
        _ROW + "(v - 1) * width + u\n",
    ),
)


def _reader(
    rows: str = "data.reshape(height, row_step)[:, :width * point_step].reshape(height * width, point_step)",
    fields: str = "rows[:, x_offset:x_offset + 12]",
    order: str = "'>f4' if big_endian else '<f4'",
    answer: str = "points",
) -> str:
    return (
        "def read_points(data, height, width, point_step, row_step, x_offset, big_endian):\n"
        f"    rows = {rows}\n"
        f"    xyz = np.ascontiguousarray({fields})\n"
        f"    points = xyz.view({order}).astype(float).reshape(-1, 3)\n"
        f"    return {answer}\n"
    )


def _one_by_one(start: str) -> str:
    """A reader that goes from point to point; `start` is where the point of a row and column begins."""
    return (
        "def read_points(data, height, width, point_step, row_step, x_offset, big_endian):\n"
        "    order, data = '>f4' if big_endian else '<f4', data.tobytes()\n"
        f"    starts = [{start} for row in range(height) for column in range(width)]\n"
        "    return np.array([np.frombuffer(data, order, 3, at) for at in starts], float)\n"
    )


READER_MISTAKES = (
    Misconception(
        "12 bytes a point",
        "three floats read after three floats: go `point_step` bytes from point to point, whatever lies between",
        _reader(
            rows="data.reshape(height, row_step)[:, :width * 12].reshape(height * width, 12)",
            fields="rows[:, 0:12]",
        ),
        variants=(_one_by_one("row * row_step + x_offset + 12 * column"),),
    ),
    Misconception(
        "whole numbers for floats",
        "the four bytes of a float read as a whole number: they are 32-bit floats, '<f4' or '>f4'",
        _reader(order="'>i4' if big_endian else '<i4'"),
        variants=(_reader(order="'>u4' if big_endian else '<u4'"),),
    ),
    Misconception(
        "NaN left out",
        "points that were not measured left out: they stay, as NaN, or all later ones move up by a row",
        _reader(answer="points[~np.isnan(points).any(axis=1)]"),
    ),
    Misconception(
        "0 for NaN",
        "0 where nothing was measured, which is a place (the camera's own): NaN stays NaN",
        _reader(answer="np.nan_to_num(points)"),
    ),
    Misconception(
        "offset forgotten",
        "the first 12 bytes of each point taken: x begins `x_offset` bytes into it",
        _reader(fields="rows[:, 0:12]"),
    ),
    Misconception(
        "padding of the rows forgotten",
        "points read on across the end of a row: rows are `row_step` bytes apart, padding included",
        _reader(rows="data[:height * width * point_step].reshape(height * width, point_step)"),
    ),
    Misconception(
        "byte order ignored",
        "big-endian bytes read as little-endian, which gives absurd numbers: use '>f4' where big_endian is True",
        _reader(order="'<f4'"),
    ),
    Misconception(
        "byte order turned round",
        "the two byte orders exchanged: '>f4' is big-endian, '<f4' little-endian",
        _reader(order="'<f4' if big_endian else '>f4'"),
    ),
)


_BACK = "def invert(T):\n    back = np.eye(4)\n    R, t = T[:3, :3], T[:3, 3]\n"
BACK_MISTAKES = (
    Misconception(
        "shift not turned back",
        "[Rᵀ, −t]: the shift was made in the world's directions, so it must be turned back too: −Rᵀ t",
        _BACK + "    back[:3, :3], back[:3, 3] = R.T, -t\n    return back\n",
    ),
    Misconception(
        "shift not undone",
        "[Rᵀ, t]: the turn is undone and the shift is still there: −Rᵀ t takes it back",
        _BACK + "    back[:3, :3], back[:3, 3] = R.T, t\n    return back\n",
    ),
    Misconception(
        "turn not undone",
        "[R, −t]: a rotation is undone by its transpose",
        _BACK + "    back[:3, :3], back[:3, 3] = R, -t\n    return back\n",
    ),
    Misconception(
        "sign of the shift",
        "[Rᵀ, Rᵀ t]: what was added must be subtracted",
        _BACK + "    back[:3, :3], back[:3, 3] = R.T, R.T @ t\n    return back\n",
    ),
    Misconception(
        "shift turned the wrong way",
        "[Rᵀ, −R t]: the shift is turned back by the transpose, as the points are",
        _BACK + "    back[:3, :3], back[:3, 3] = R.T, -(R @ t)\n    return back\n",
    ),
    Misconception(
        "the pose itself",
        "the pose handed back as it came: `T_world_camera` leads to the world, its inverse back to the camera",
        "def invert(T):\n    return T\n",
    ),
)


# Task 1: where is the pixel in the list?


def _row_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, (width, height) in (
        ("a wide image", (int(rng.integers(60, 90)), int(rng.integers(20, 40)))),
        ("a tall image", (int(rng.integers(20, 40)), int(rng.integers(60, 90)))),
    ):
        u, v = int(rng.integers(11, width - 2)), int(rng.integers(3, 10))
        index = np.arange(width * height).reshape(height, width)
        cases.append(Case({"u": u, "v": v, "width": width, "height": height}, {"truth": int(index[v, u])}, name))
    return cases


OLD_1 = Task(
    id="02-1",
    title="Where is the pixel in the list?",
    points=1,
    version=1,
    kind="fill",
    signature="def row_of(u, v, width, height)",
    cases=_row_cases,
    judge=lambda case, answer: judge_number(answer, case.truth, 0.1, "rows", "the row"),
    misconceptions=ROW_MISTAKES,
    where="lesson 02, section 2 (ordered and unordered)",
)


# Task 2: points out of bytes


def _message_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, step, row_padding, offset, big in (
        ("points packed tightly", 12, 0, 0, False),
        ("PointXYZ with 4 bytes of padding, two points not measured", 16, 0, 0, False),
        ("x behind 8 bytes of other fields, rows with padding", 28, 20, 8, False),
        ("big-endian numbers", 16, 0, 0, True),
    ):
        height, width = int(rng.integers(3, 6)), int(rng.integers(4, 8))
        points = np.round(rng.uniform(-4, 4, (height, width, 3)), 3).astype(np.float32)
        if big or step == 16:  # pixels that saw nothing
            points[rng.integers(height), rng.integers(width)] = np.nan
            points[height - 1, width - 1] = np.nan
        row_step = width * step + row_padding
        # what is not x, y, z is small floats, so that a careless reader sees plausible numbers
        data = np.resize(
            rng.uniform(-4, 4, 64).astype(">f4" if big else "<f4").view(np.uint8), (height, row_step)
        ).copy()
        for column in range(width):
            start = column * step + offset
            block = np.ascontiguousarray(points[:, column], dtype=">f4" if big else "<f4").view(np.uint8)
            data[:, start : start + 12] = block.reshape(height, 12)
        given = {
            "data": data.ravel(),
            "height": height,
            "width": width,
            "point_step": step,
            "row_step": row_step,
            "x_offset": offset,
            "big_endian": big,
        }
        cases.append(Case(given, {"truth": points.reshape(-1, 3).astype(np.float64)}, name))
    return cases


def _judge_points(case: Case, answer: Plain) -> Verdict:
    return judge_array(answer, case.truth, 1e-5, "m", axes="xyz", what="the point")


OLD_2 = Task(
    id="02-2",
    title="Points out of bytes",
    points=3,
    version=2,
    kind="real",
    signature="def read_points(data, height, width, point_step, row_step, x_offset, big_endian)",
    cases=_message_cases,
    judge=_judge_points,
    misconceptions=READER_MISTAKES,
    may_call=("numpy", "struct"),
    hides=("course_lib.cloud.pointcloud.from_message", "course_lib.cloud.pointcloud.message_to_xyz"),
    where="lesson 02, section 3 (points as bytes)",
)


# Task 3: mend the way back


def _pose(rng: np.random.Generator, least_degrees: float = 40) -> np.ndarray:
    """A pose that turns by 40 to 120 degrees about a slanted axis and shifts by about a metre."""
    axis = rng.normal(size=3)
    axis = np.sign(axis) * np.maximum(np.abs(axis), 0.3)
    axis /= np.linalg.norm(axis)
    turn = np.radians(rng.uniform(least_degrees, 120)) * axis
    R = transforms.exp(np.concatenate([np.zeros(3), turn]))[:3, :3]
    t = rng.choice([-1, 1], 3) * rng.uniform(0.4, 1.2, 3)
    return transforms.from_rotation_translation(R, t)


def _back_cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, T in (
        ("a pose that turns and shifts", _pose(rng)),
        ("another one that turns and shifts", _pose(rng)),
        ("a pose that only shifts", transforms.from_rotation_translation(np.eye(3), rng.uniform(0.3, 1, 3))),
    ):
        R, t = T[:3, :3], T[:3, 3]
        truth = np.eye(4)
        truth[:3, :3], truth[:3, 3] = R.T, -(R.T @ t)
        cases.append(Case({"T": T}, {"truth": truth}, name))
    return cases


def _judge_back(case: Case, answer: Plain) -> Verdict:
    """All or nothing: a right turn with a wrong shift is what the learner was given to mend."""
    verdict = judge_transform(answer, case.truth, degrees=0.01, metres=1e-4, what="the inverse")
    return replace(verdict, score=float(verdict.passed))


OLD_3 = Task(
    id="02-3",
    title="Mend the way back",
    points=2,
    version=2,
    kind="mend",
    signature="def invert(T)",
    cases=_back_cases,
    judge=_judge_back,
    misconceptions=BACK_MISTAKES,
    hides=("course_lib.geometry.transforms.invert", "numpy.linalg.inv"),
    where="lesson 02, section 5 (frames and transforms)",
)


FORMS = (
    (
        OLD_1,
        """def row_of(u, v, width, height):
    # v full rows of the image come first, then u points
    return v * width + u
""",
    ),
    (
        OLD_2,
        """def read_points(data, height, width, point_step, row_step, x_offset, big_endian):
    # rows of bytes; drop the padding at the end of each
    rows = data.reshape(height, row_step)[:, : width * point_step]
    # points of bytes; keep the 12 that hold x, y, z
    xyz = rows.reshape(height * width, point_step)[:, x_offset : x_offset + 12]
    # bytes to floats, in the right byte order
    return np.ascontiguousarray(xyz).view(">f4" if big_endian else "<f4").astype(float)
""",
    ),
    (
        OLD_3,
        """def invert(T):
    back = np.eye(4)
    R, t = T[:3, :3], T[:3, 3]
    back[:3, :3] = R.T
    back[:3, 3] = -R.T @ t
    return back
""",
    ),
)
