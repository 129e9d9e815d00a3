"""The wrong answers of lab 02, as learner code: what each looks like, and what to do about it."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import swapped

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


CAUSE_OF = {"A": "shift first", "B": "inverse", "C": "order", "D": "millimetres", "E": "stride"}
WHICH_MISTAKES = (
    Misconception(
        "order taken for inverse",
        "the inverse and the wrong order exchanged: put one point of the original, (0, 0, 0), through both by hand",
        swapped(CAUSE_OF, "inverse", "order"),
    ),
    Misconception(
        "shift first taken for inverse",
        "R (p + t) and the inverse exchanged: R (p + t) turns by the right angle, the inverse the other way",
        swapped(CAUSE_OF, "shift first", "inverse"),
    ),
    Misconception(
        "scale taken for stride",
        "millimetres and stride exchanged: a wrong unit keeps every shape, a wrong stride destroys it",
        swapped(CAUSE_OF, "millimetres", "stride"),
    ),
)


FEW_MISTAKES = (
    Misconception(
        "the first rows",
        "the first n rows of the list: neighbours in the list are often neighbours in space, the rest stays bare",
        "def few(points, n):\n    return np.arange(n)\n",
    ),
    Misconception(
        "the nearest ones",
        "the n points nearest to the middle: the far ends of the shape are left without any",
        "def few(points, n):\n    return np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[:n]\n",
    ),
    Misconception(
        "the outermost ones",
        "the n points farthest from the middle: they crowd on the bumps and leave the rest bare",
        "def few(points, n):\n    return np.argsort(np.linalg.norm(points - points.mean(axis=0), axis=1))[-n:]\n",
    ),
)
