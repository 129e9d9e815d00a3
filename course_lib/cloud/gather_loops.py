"""The loops that find the cubes of a grid and gather what lies in a box of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from course_lib.compiled import FLOATS, INTS, LIST, ROWS, TABLE, compiled, inlined

__all__ = [
    *("EXACT", "GRID", "Flags", "Floats", "Ints", "Table", "Whole"),
    *("fill_table", "first_from", "gather", "row_at"),
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Table = NDArray[np.int32]
Flags = NDArray[np.bool_]
Whole = int | np.int64  # plain Python counts in the one, and reads the other out of arrays

EXACT = 1 - 1e-9  # walls are this much nearer than computed, for rounding
GRID = f"{ROWS}, {TABLE}, {TABLE}, {LIST}, {INTS}, {FLOATS}, float64"  # points, cells, rows, table, wide, low, size


@inlined
def slot_of(x: Whole, y: Whole, mask: int) -> Whole:
    """Where a row's number stands first in a hashed table."""
    mixed = (x & 0x1FFFFF) * 73856093 ^ (y & 0x1FFFFF) * 19349663  # 49 bits
    mixed = ((mixed ^ (mixed >> 17)) & 0x7FFFFFFF) * 0x9E3779B1  # 63 bits, of which the upper ones are well mixed
    return (mixed >> 24) & mask


@compiled(f"void({TABLE}, {INTS}, int32[::1])")
def fill_table(rows: Table, wide: Ints, table: Table) -> None:
    """Put the number of each row into its place; in a hashed table at the first free place from its slot on."""
    mask = len(table) - 1
    for row in range(len(rows) - 1):
        x, y = np.int64(rows[row, 0]), np.int64(rows[row, 1])
        slot = x * wide[1] + y if wide[2] else slot_of(x, y, mask)
        while table[slot] >= 0:
            slot = (slot + 1) & mask
        table[slot] = row


@inlined
def row_at(rows: Table, table: Table, wide: Ints, x: Whole, y: Whole) -> Whole:
    """The number of the row at x and y; -1 where there is none."""
    if x < 0 or y < 0 or x >= wide[0] or y >= wide[1]:
        return -1
    if wide[2]:
        return np.int64(table[x * wide[1] + y])
    mask = len(table) - 1
    slot = slot_of(x, y, mask)
    while table[slot] >= 0:
        row = np.int64(table[slot])
        if rows[row, 0] == x and rows[row, 1] == y:
            return row
        slot = (slot + 1) & mask
    return -1


@inlined
def first_from(cells: Table, begin: Whole, end: Whole, z: Whole | float) -> Whole:
    """The first cube of begin to end whose z is at least this; end where there is none."""
    while end - begin > 4:
        middle = (begin + end) >> 1
        if cells[middle, 1] < z:
            begin = middle + 1
        else:
            end = middle
    while begin < end and cells[begin, 1] < z:
        begin += 1
    return begin


BOX = "int64, int64, int64, int64, int64, int64"  # the first and the last cube along x, along y and along z


@compiled(f"int64({GRID}, {BOX}, float64[:, ::1], int64[::1])")
def gather(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    x0: Whole, x1: Whole, y0: Whole, y1: Whole, z0: Whole, z1: Whole, floats: Floats, places: Ints,
) -> int:  # fmt: skip
    """Copy the points of a box of cubes side by side, and return how many; -1 where they are too many."""
    found = 0
    for x in range(max(0, x0), min(wide[0] - 1, x1) + 1):
        for y in range(max(0, y0), min(wide[1] - 1, y1) + 1):
            row = row_at(rows, table, wide, x, y)
            if row < 0:
                continue
            end = np.int64(rows[row + 1, 2])
            one = first_from(cells, np.int64(rows[row, 2]), end, z0)
            other = one
            while other < end and cells[other, 1] <= z1:
                other += 1
            begin, until = np.int64(cells[one, 2]), np.int64(cells[other, 2])
            if found + until - begin > len(places):
                return -1
            for place in range(begin, until):
                floats[0, found] = points[place, 0]
                floats[1, found] = points[place, 1]
                floats[2, found] = points[place, 2]
                places[found] = place
                found += 1
    return found
