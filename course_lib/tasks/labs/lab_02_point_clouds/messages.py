"""Task 2 of lab 02: points out of the bytes of a message whose x, y and z stand anywhere in a point."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_array

_HEAD = "def read_points(data, height, width, point_step, row_step, offsets, big_endian):\n"


_ROWS = "data.reshape(height, row_step)[:, :width * point_step].reshape(height * width, point_step)"
_ORDER = "'>f4' if big_endian else '<f4'"


def _reader(
    rows: str = _ROWS,
    fields: str = "[rows[:, at:at + 4] for at in offsets]",
    order: str = _ORDER,
    answer: str = "points",
) -> str:
    return (
        f"{_HEAD}    rows = {rows}\n"
        f"    fields = {fields}\n"
        f"    columns = [np.ascontiguousarray(field).view({order}) for field in fields]\n"
        "    points = np.hstack(columns).astype(float)\n"
        f"    return {answer}\n"
    )


def _one_by_one(start: str, order: str = _ORDER) -> str:
    """A reader that goes from point to point and reads three floats there; `start` is where that of a pixel begins."""
    return (
        f"{_HEAD}    data = data.tobytes()\n"
        f"    starts = [{start} for v in range(height) for u in range(width)]\n"
        f"    return np.array([np.frombuffer(data, {order}, 3, at) for at in starts], float)\n"
    )


_POINT_AT = "v * row_step + u * point_step + offsets[0]"
MISTAKES = (
    Misconception(
        "the lesson's own code",
        "the lesson's reader: here rows have padding, y and z have offsets of their own, and the numbers may be "
        "big-endian",
        _one_by_one(_POINT_AT, "'<f4'"),
        variants=(
            f"{_HEAD}    rows = np.frombuffer(data, np.uint8).reshape(-1, point_step)\n"
            "    return np.ascontiguousarray(rows[:, :12]).view('<f4')\n",
        ),
    ),
    Misconception(
        "y and z right behind x",
        "three floats read in a row from where x begins: y and z each have their own offset",
        _one_by_one(_POINT_AT),
        variants=(_reader(fields="[rows[:, offsets[0] + 4 * i:offsets[0] + 4 * i + 4] for i in range(3)]"),),
    ),
    Misconception(
        "in the order of the bytes",
        "fields taken in the order in which they stand in the point: `offsets` belong to x, y and z in this order",
        _reader(fields="[rows[:, at:at + 4] for at in sorted(offsets)]"),
    ),
    Misconception(
        "offsets in floats",
        "offsets divided by 4, as if they counted floats: they count bytes, as slices of `data` do",
        _reader(fields="[rows[:, at // 4:at // 4 + 4] for at in offsets]"),
    ),
    Misconception(
        "offsets times 4",
        "offsets multiplied by 4, as if they counted floats: they count bytes, as slices of `data` do",
        f"{_HEAD}    data = data.tobytes() + bytes(400)\n"
        f"    kind = {_ORDER}\n"
        "    starts = [v * row_step + u * point_step for v in range(height) for u in range(width)]\n"
        "    return np.array([[np.frombuffer(data, kind, 1, s + 4 * at)[0] for at in offsets] for s in starts])\n",
    ),
    Misconception(
        "whole points as floats",
        "whole points viewed as floats, and every fourth byte counted: a field may begin at any byte, and `point_step` "
        "need not be a multiple of 4: cut out the 4 bytes at each offset first",
        f"{_HEAD}    rows = np.ascontiguousarray({_ROWS})\n"
        f"    return rows.view({_ORDER})[:, np.asarray(offsets) // 4]\n",
    ),
    Misconception(
        "astype for view",
        "each byte made a number of its own: astype converts values, .view reads four bytes as one float",
        f"{_HEAD}    rows = {_ROWS}\n    return np.hstack([rows[:, at:at + 4].astype({_ORDER}) for at in offsets])\n",
        variants=(f"{_HEAD}    rows = {_ROWS}\n    return rows[:, offsets].astype(float)\n",),
    ),
    Misconception(
        "one after the other",
        "all x, then all y, then all z, cut into rows of three: put them side by side, as columns (np.hstack), not one "
        "after the other",
        _reader(answer="np.concatenate(columns).reshape(-1, 3).astype(float)"),
    ),
    Misconception(
        "12 bytes a point",
        "three floats read after three floats: go `point_step` bytes from point to point, whatever lies between",
        _reader(
            rows="data.reshape(height, row_step)[:, :width * 12].reshape(height * width, 12)",
            fields="[rows[:, 4 * i:4 * i + 4] for i in range(3)]",
        ),
        variants=(_one_by_one("v * row_step + offsets[0] + 12 * u"),),
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
        "offsets forgotten",
        "the first 12 bytes of each point taken: x, y and z begin where `offsets` say",
        _reader(fields="[rows[:, 4 * i:4 * i + 4] for i in range(3)]"),
    ),
    Misconception(
        "padding of the rows forgotten",
        "points read on across the end of a row: rows are `row_step` bytes apart, padding included",
        _reader(rows="data[:height * width * point_step].reshape(height * width, point_step)"),
    ),
    Misconception(
        "padding cut off in front",
        "padding cut off at the beginning of each row: it stands at its end, behind the last point",
        _reader(
            rows="data.reshape(height, row_step)[:, row_step - width * point_step:].reshape(-1, point_step)",
        ),
    ),
    Misconception(
        "padding taken for points",
        "as many points read from a row as fit into `row_step`: a row has `width` points, and what follows is padding, "
        "however long",
        _reader(
            rows="data.reshape(height, row_step)[:, :row_step // point_step * point_step].reshape(-1, point_step)",
        ),
    ),
    Misconception(
        "whole points turned round",
        "all bytes of a point turned round, which moves its fields, too: only the four bytes of each float stand in "
        "the other order, as '>f4' reads them",
        _reader(rows=f"{_ROWS}[:, ::-1 if big_endian else 1]", order="'<f4'"),
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


def _cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, step, row_padding, offsets, big in (
        ("points packed tightly", 12, 0, (0, 4, 8), False),
        ("PointXYZ with 4 bytes of padding, two points not measured", 16, 0, (0, 4, 8), False),
        ("x behind 5 bytes of other fields, rows with as much padding as a point", 28, 28, (5, 12, 18), False),
        ("big-endian numbers", 16, 0, (0, 4, 8), True),
        ("z first, and another field between x and y", 22, 10, (4, 12, 0), False),
    ):
        height, width = int(rng.integers(3, 6)), int(rng.integers(5, 8))
        points = np.round(rng.uniform(0.5, 4, (height, width, 3)) * rng.choice([-1, 1], 3), 3).astype(np.float32)
        if big or step == 16:  # pixels that saw nothing
            points[rng.integers(height), rng.integers(width)] = np.nan
            points[height - 1, width - 1] = np.nan
        row_step = width * step + row_padding
        order = ">f4" if big else "<f4"
        # what is not x, y, z is small floats, so that a careless reader sees plausible numbers
        data = np.resize(rng.uniform(-4, 4, 64).astype(order).view(np.uint8), (height, row_step)).copy()
        for column in range(width):
            for axis, offset in enumerate(offsets):
                start = column * step + offset
                number = np.ascontiguousarray(points[:, column, axis], dtype=order)
                data[:, start : start + 4] = number.view(np.uint8).reshape(height, 4)
        given = {
            "data": data.ravel(),
            "height": height,
            "width": width,
            "point_step": step,
            "row_step": row_step,
            "offsets": np.array(offsets),
            "big_endian": big,
        }
        cases.append(Case(given, {"truth": points.reshape(-1, 3).astype(np.float64)}, name))
    return cases


TASK = Task(
    id="02-2",
    title="Points out of bytes",
    points=3,
    version=4,
    kind="real",
    signature="def read_points(data, height, width, point_step, row_step, offsets, big_endian)",
    cases=_cases,
    judge=lambda case, answer: judge_array(answer, case.truth, 1e-5, "m", axes="xyz", what="the point"),
    misconceptions=MISTAKES,
    may_call=("numpy", "struct"),
    hides=("course_lib.cloud.pointcloud.from_message", "course_lib.cloud.pointcloud.message_to_xyz"),
    where="lesson 02, section 3 (points as bytes)",
)
