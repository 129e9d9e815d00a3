"""The loops over a grid: what lies around a point is found in the cubes around its own.

A cube's points ask together. The points of the cubes around it are copied side by side, once, and each point of the
cube looks through them: memory is read in its order, and a processor compares several at a time. Within so many cubes
everything is known up to the nearest outer wall, so an answer within that distance is exact. Where it is farther, one
more ring of cubes is taken; a point that RINGS rings do not serve, or whose cubes hold too many points, stays open: for
a k-d tree (`neighbours`).

Scratch memory is the caller's: floats (5, ROOM) and places (ROOM,), one for each thread.
"""

from __future__ import annotations

import math

import numpy as np

from course_lib.cloud.gather_loops import EXACT, GRID, Flags, Floats, Ints, Table, Whole, first_from, gather, row_at
from course_lib.compiled import compiled, inlined

__all__ = ["ROOM", "covariances", "has_others_within", "mean_distances"]

RINGS = 2
ROOM = 4096  # points that are looked through at most for one cube
GUESS = 1.4  # times the squared distance of the point before: almost always the k-th lies within


@compiled(f"int64({GRID}, int64, int64, float64[:, ::1], int64[::1])")
def gather_around(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    cell: int, ring: int, floats: Floats, places: Ints,
) -> int:  # fmt: skip
    """Gather the cubes within so many rings around a cube."""
    x, y = np.int64(rows[cells[cell, 0], 0]), np.int64(rows[cells[cell, 0], 1])
    z = np.int64(cells[cell, 1])
    return gather(
        points,
        cells,
        rows,
        table,
        wide,
        low,
        size,
        x - ring,
        x + ring,
        y - ring,
        y + ring,
        z - ring,
        z + ring,
        floats,
        places,
    )


@compiled("float64(float64[::1], int64, int64)")
def kth_smallest(numbers: Floats, count: int, k: int) -> float:
    """The k-th smallest of the first `count` numbers, from 0; their order is changed (Hoare's selection)."""
    left, right = 0, count - 1
    while right > left:
        a, b, c = numbers[left], numbers[(left + right) >> 1], numbers[right]
        pivot = max(min(a, b), min(max(a, b), c))
        i, j = left, right
        while i <= j:
            while numbers[i] < pivot:
                i += 1
            while numbers[j] > pivot:
                j -= 1
            if i <= j:
                numbers[i], numbers[j] = numbers[j], numbers[i]
                i += 1
                j -= 1
        if k <= j:
            right = j
        elif k >= i:
            left = i
        else:
            break
    kth: float = numbers[k]
    return kth


@inlined
def to_wall(low: Floats, size: float, x: Whole, y: Whole, z: Whole, px: float, py: float, pz: float) -> float:
    """How far a point of the cube x, y, z is from the nearest wall of its own cube."""
    fx, fy, fz = (px - low[0]) / size - x, (py - low[1]) / size - y, (pz - low[2]) / size - z
    inside = min(fx, 1 - fx, fy, 1 - fy, fz, 1 - fz)
    distance: float = max(0.0, inside) * size
    return distance


@compiled("float64(float64[:, ::1], int64, int64, float64, float64, float64, float64)")
def kth_distance(floats: Floats, found: int, k: int, x: float, y: float, z: float, guess: float) -> float:
    """Write the squared distances of gathered points to one, and return the k-th smallest, from 0."""
    for i in range(found):
        dx, dy, dz = floats[0, i] - x, floats[1, i] - y, floats[2, i] - z
        floats[3, i] = dx * dx + dy * dy + dz * dz
    some = 0
    for i in range(found):  # mostly few lie within the guess, and among these the k-th is found sooner
        floats[4, some] = floats[3, i]
        some += floats[3, i] <= guess
    if some <= k:
        some = found
        for i in range(found):
            floats[4, i] = floats[3, i]
    return kth_smallest(floats[4], some, k)


@compiled("int64(float64[:, ::1], int64, int64, float64, float64, int64[::1])")
def pick(floats: Floats, found: int, k: int, kth: float, most: float, picked: Ints) -> int:
    """Write which gathered points are the k nearest, of equal ones the first; none beyond `most` squared. How many."""
    count = 0
    for i in range(found):
        if floats[3, i] < kth and floats[3, i] <= most:
            picked[count] = i
            count += 1
    for i in range(found):
        if count < k and floats[3, i] == kth and kth <= most:
            picked[count] = i
            count += 1
    return count


@compiled(f"void({GRID}, int64, int64, int64, float64[:, ::1], int64[::1], float64[::1], boolean[::1])")
def mean_distances(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    start: int, stop: int, k: int, floats: Floats, places: Ints, mean: Floats, open_: Flags,
) -> None:  # fmt: skip
    """The mean distance of the points of some cubes to their k nearest others; `open_` stays True where none is."""
    for cell in range(start, stop):
        x, y, z = rows[cells[cell, 0], 0], rows[cells[cell, 0], 1], cells[cell, 1]
        for ring in range(1, RINGS + 1):
            found = gather_around(points, cells, rows, table, wide, low, size, cell, ring, floats, places)
            if found < 0:
                break
            everything = found == len(points)
            guess, waiting = math.inf, False
            for own in range(cells[cell, 2], cells[cell + 1, 2]):
                if not open_[own]:
                    continue
                if found <= k:
                    waiting = True
                    continue
                px, py, pz = points[own, 0], points[own, 1], points[own, 2]
                kth = kth_distance(floats, found, k, px, py, pz, guess)
                wall = (ring * size + to_wall(low, size, x, y, z, px, py, pz)) * EXACT
                if kth > wall * wall and not everything:
                    waiting = True
                    continue
                guess = GUESS * kth
                total, nearer = 0.0, 0
                for i in range(found):
                    if floats[3, i] < kth:
                        total += math.sqrt(floats[3, i])
                        nearer += 1
                mean[own] = (total + (k + 1 - nearer) * math.sqrt(kth)) / k
                open_[own] = False
            if not waiting:
                break


@compiled(
    f"void({GRID}, int64, int64, int64, float64, float64[:, ::1], int64[::1], int64[::1], float64[:, ::1], "
    "int64[::1], boolean[::1])"
)
def covariances(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    start: int, stop: int, k: int, most: float, floats: Floats, places: Ints, picked: Ints,
    six: Floats, count: Ints, open_: Flags,
) -> None:  # fmt: skip
    """xx, yy, zz, xy, xz, yz of the covariance of each point's k nearest, itself too; none beyond `most`."""
    for cell in range(start, stop):
        x, y, z = rows[cells[cell, 0], 0], rows[cells[cell, 0], 1], cells[cell, 1]
        for ring in range(1, RINGS + 1):
            found = gather_around(points, cells, rows, table, wide, low, size, cell, ring, floats, places)
            if found < 0:
                break
            everything = found == len(points)
            guess, waiting = math.inf, False
            for own in range(cells[cell, 2], cells[cell + 1, 2]):
                if not open_[own]:
                    continue
                if found < k:
                    waiting = True
                    continue
                px, py, pz = points[own, 0], points[own, 1], points[own, 2]
                kth = kth_distance(floats, found, k - 1, px, py, pz, guess)
                wall = (ring * size + to_wall(low, size, x, y, z, px, py, pz)) * EXACT
                if min(kth, most) > wall * wall and not everything:
                    waiting = True
                    continue
                guess = GUESS * kth
                number = pick(floats, found, k, kth, most, picked)
                sx = sy = sz = xx = yy = zz = xy = xz = yz = 0.0
                for j in range(number):
                    i = picked[j]
                    dx, dy, dz = floats[0, i] - px, floats[1, i] - py, floats[2, i] - pz
                    sx += dx
                    sy += dy
                    sz += dz
                    xx += dx * dx
                    yy += dy * dy
                    zz += dz * dz
                    xy += dx * dy
                    xz += dx * dz
                    yz += dy * dz
                share = 1.0 / number
                sx, sy, sz = sx * share, sy * share, sz * share
                six[own, 0] = xx * share - sx * sx
                six[own, 1] = yy * share - sy * sy
                six[own, 2] = zz * share - sz * sz
                six[own, 3] = xy * share - sx * sy
                six[own, 4] = xz * share - sx * sz
                six[own, 5] = yz * share - sy * sz
                count[own] = number
                open_[own] = False
            if not waiting:
                break


@compiled(f"void({GRID}, int64, int64, int64, float64, boolean[::1])")
def has_others_within(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    start: int, stop: int, least: int, most: float, enough: Flags,
) -> None:  # fmt: skip
    """Whether each point of some cubes has at least so many others, none beyond `most` squared; a cube is as wide."""
    for cell in range(start, stop):
        row_x, row_y = np.int64(rows[cells[cell, 0], 0]), np.int64(rows[cells[cell, 0], 1])
        z = np.int64(cells[cell, 1])
        for own in range(cells[cell, 2], cells[cell + 1, 2]):
            missing = least + 1  # the point itself is found, too
            for x in range(row_x - 1, row_x + 2):
                for y in range(row_y - 1, row_y + 2):
                    row = row_at(rows, table, wide, x, y) if missing > 0 else -1
                    if row < 0:
                        continue
                    end = np.int64(rows[row + 1, 2])
                    near = first_from(cells, np.int64(rows[row, 2]), end, z - 1)
                    while near < end and cells[near, 1] <= z + 1 and missing > 0:
                        for place in range(cells[near, 2], cells[near + 1, 2]):
                            dx = points[place, 0] - points[own, 0]
                            dy = points[place, 1] - points[own, 1]
                            dz = points[place, 2] - points[own, 2]
                            missing -= dx * dx + dy * dy + dz * dz <= most
                            if missing == 0:
                                break
                        near += 1
            enough[own] = missing <= 0
