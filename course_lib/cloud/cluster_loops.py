"""The loop of clusters: cubes whose points lie within reach of each other are joined.

References
----------
Tarjan and van Leeuwen, Worst-case analysis of set union algorithms, Journal of the ACM 31(2), 1984.
"""

from __future__ import annotations

import math

import numpy as np

from course_lib.cloud.gather_loops import GRID, Floats, Ints, Table, Whole, first_from, row_at
from course_lib.compiled import ROWS, TABLE, compiled, inlined

__all__ = ["join_cells"]


@inlined
def root_of(parent: Ints, one: Whole) -> Whole:
    """The first of a set, the way to it halved."""
    while parent[one] != one:
        parent[one] = parent[parent[one]]
        one = parent[one]
    return one


@compiled(f"boolean({ROWS}, {TABLE}, int64, int64, float64)")
def touch(points: Floats, cells: Table, one: Whole, other: Whole, radius: float) -> bool:
    """Whether two cubes hold points within the radius of each other."""
    for i in range(cells[one, 2], cells[one + 1, 2]):
        for j in range(cells[other, 2], cells[other + 1, 2]):
            dx, dy, dz = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
            if math.sqrt(dx * dx + dy * dy + dz * dz) <= radius:
                return True
    return False


@compiled(f"void({GRID}, float64, int64[::1])")
def join_cells(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    radius: float, parent: Ints,
) -> None:  # fmt: skip
    """Join cubes that hold points within the radius of each other; any two points of one cube are, by its size."""
    for cell in range(len(cells) - 1):
        row_x, row_y = np.int64(rows[cells[cell, 0], 0]), np.int64(rows[cells[cell, 0], 1])
        z = np.int64(cells[cell, 1])
        for x in range(row_x, row_x + 3):  # half of the cubes around: the others have looked from their side
            for y in range(row_y - 2 if x > row_x else row_y, row_y + 3):
                row = row_at(rows, table, wide, x, y)
                if row < 0:
                    continue
                end = np.int64(rows[row + 1, 2])
                same = x == row_x and y == row_y
                near = cell + 1 if same else first_from(cells, np.int64(rows[row, 2]), end, z - 2)
                while near < end and cells[near, 1] <= z + 2:
                    one, other = root_of(parent, cell), root_of(parent, near)
                    if one != other and touch(points, cells, cell, near, radius):
                        parent[max(one, other)] = min(one, other)
                    near += 1
