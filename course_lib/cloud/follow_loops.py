"""The loop of one nearest point, for queries that move: what was found the last time says how far to look.

Queries that stand next to each other in the list are near each other, mostly. A few of them are asked together: what
may be near any of them is copied side by side, once, and each looks through it.

References
----------
Greenspan and Godin, A nearest neighbor method for efficient ICP, 3DIM 2001.
"""

from __future__ import annotations

import math

import numpy as np

from course_lib.cloud.gather_loops import EXACT, GRID, Flags, Floats, Ints, Table, Whole, first_from, gather, row_at
from course_lib.compiled import FLAGS, ROWS, compiled, inlined

__all__ = ["TOGETHER", "follow"]

TOGETHER = 24  # queries at most that are asked together,
APART = 3.0  # cubes at most along each axis from the first of them
FARTHEST = 9.0  # cubes: the largest ball in which the nearest point is looked for
HIGHEST = 2.0**32  # cubes: higher than any grid
SLACK = 0.15  # of a cube, by which the ball is larger than needed: so long a way, and longer, nobody asks again
FEW = "int64[::1], float64[::1], float64[:, ::1], int64[::1]"  # asked, balls, floats, places
KNOWN = "int64[::1], float64[:, ::1], float64[::1], float64[::1]"  # place, seen, others, distance


@inlined
def somewhere_near(cells: Table, rows: Table, table: Table, wide: Ints, fx: float, fy: float, fz: float) -> Whole:
    """A point above or below; -1 where there is none. Its distance is no more than a bound for the nearest's."""
    if not (0 <= fx < wide[0] and 0 <= fy < wide[1]):
        return -1
    row = row_at(rows, table, wide, int(fx), int(fy))
    if row < 0:
        return -1
    end = np.int64(rows[row + 1, 2])
    cell = first_from(cells, np.int64(rows[row, 2]), end, fz - 1)
    return np.int64(cells[min(cell, end - 1), 2])


@inlined
def sorted_in(far: float, best: float, second: float) -> tuple[float, float]:
    """The two smallest of three numbers, of which two are in order."""
    more = max(far, best)
    return min(far, best), min(more, second)


@inlined
def two_smallest(numbers: Floats, count: int, most: float) -> tuple[float, float]:
    """The smallest and the second of the first numbers, but no more than `most`; of every fourth first."""
    for i in range(count, count + 3):
        numbers[i] = most
    a = b = c = d = a2 = b2 = c2 = d2 = most
    for i in range(0, count, 4):  # four chains, of which no one waits for the others
        a, a2 = sorted_in(numbers[i], a, a2)
        b, b2 = sorted_in(numbers[i + 1], b, b2)
        c, c2 = sorted_in(numbers[i + 2], c, c2)
        d, d2 = sorted_in(numbers[i + 3], d, d2)
    a, a2 = sorted_in(b, a, min(a2, b2))
    c, c2 = sorted_in(d, c, min(c2, d2))
    return sorted_in(c, a, min(a2, c2))


@compiled(
    f"boolean({GRID}, {ROWS}, float64, int64[::1], float64[::1], int64, int64, float64[:, ::1], int64[::1], {KNOWN})"
)
def answer(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    queries: Floats, radius: float, asked: Ints, balls: Floats, first: int, last: int, floats: Floats, places: Ints,
    place: Ints, seen: Floats, others: Floats, distance: Floats,
) -> bool:  # fmt: skip
    """Answer some of the asked queries together; False where too many points would have to be looked through."""
    inverse = 1.0 / size
    x0 = y0 = z0 = math.inf
    x1 = y1 = z1 = -math.inf
    for i in range(first, last):
        query, ball = asked[i], balls[i] * inverse / EXACT
        fx, fy = (queries[query, 0] - low[0]) * inverse, (queries[query, 1] - low[1]) * inverse
        fz = (queries[query, 2] - low[2]) * inverse
        x0, x1, y0, y1 = min(x0, fx - ball), max(x1, fx + ball), min(y0, fy - ball), max(y1, fy + ball)
        z0, z1 = min(z0, fz - ball), max(z1, fz + ball)
    found = gather(
        points, cells, rows, table, wide, low, size,
        int(np.floor(x0)), int(x1), int(np.floor(y0)), int(y1), int(np.floor(z0)), int(z1),
        floats, places,
    )  # fmt: skip
    for i in range(first, last if found >= 0 else first):
        query = asked[i]
        px, py, pz = queries[query, 0], queries[query, 1], queries[query, 2]
        for j in range(found):
            dx, dy, dz = floats[0, j] - px, floats[1, j] - py, floats[2, j] - pz
            floats[3, j] = dx * dx + dy * dy + dz * dz
        most = balls[i] * balls[i]
        best, second = two_smallest(floats[3], found, most)
        at = 0
        while best < most and floats[3, at] != best:
            at += 1
        place[query] = places[at] if best < most else -1
        seen[query, 0], seen[query, 1], seen[query, 2] = px, py, pz
        others[query] = math.sqrt(second)
        distance[query] = math.sqrt(best) if best < most and math.sqrt(best) <= radius else math.inf
    return found >= 0


@compiled(f"void({GRID}, {ROWS}, int64, int64, float64, {FEW}, {KNOWN}, {FLAGS})")
def follow(
    points: Floats, cells: Table, rows: Table, table: Table, wide: Ints, low: Floats, size: float,
    queries: Floats, start: int, stop: int, radius: float, asked: Ints, balls: Floats, floats: Floats, places: Ints,
    place: Ints, seen: Floats, others: Floats, distance: Floats, open_: Flags,
) -> None:  # fmt: skip
    """The nearest point of queries that move: asked again only where it may be another by now.

    When a query was asked at `seen`, all points but its nearest were at least `others` away. Since then it has moved
    by m: so they are at least `others` - m away, and where the nearest is nearer, it still is the nearest. Else it says
    how far to look: in the ball around the query that reaches to it.

    Parameters
    ----------
    asked, balls : (TOGETHER,) scratch memory, as `floats` and `places`.
    place : (M,) the nearest point, or -1 where none is within the radius and some way beyond; as told the last time.
    seen, others : (M, 3), (M,) as above; `others` is -1 where nothing is known.
    distance : (M,) to the nearest point; infinite where it is beyond the radius.
    open_ : (M,) becomes False where this is told.
    """
    inverse, query, count, last = 1.0 / size, start, 0, -1
    ax = ay = az = 0.0
    while query < stop or count > 0:
        ends = query == stop
        if not ends:
            px, py, pz = queries[query, 0], queries[query, 1], queries[query, 2]
            fx, fy, fz = (px - low[0]) * inverse, (py - low[1]) * inverse, (pz - low[2]) * inverse
            ends = count == TOGETHER or (count > 0 and max(abs(fx - ax), abs(fy - ay), abs(fz - az)) > APART)
        if ends:
            together = answer(
                points, cells, rows, table, wide, low, size,
                queries, radius, asked, balls, 0, count, floats, places, place, seen, others, distance,
            )  # fmt: skip
            for i in range(count):
                open_[asked[i]] = not together and not answer(
                    points, cells, rows, table, wide, low, size,
                    queries, radius, asked, balls, i, i + 1, floats, places, place, seen, others, distance,
                )  # fmt: skip
                if place[asked[i]] >= 0:
                    last = place[asked[i]]
            count = 0
            continue
        at = place[query]
        if at < 0:
            at = somewhere_near(cells, rows, table, wide, fx, fy, fz) if others[query] < 0 else -1
            if at < 0:
                at = last  # the one of a query before
        to_it = math.inf
        if at >= 0:
            dx, dy, dz = points[at, 0] - px, points[at, 1] - py, points[at, 2] - pz
            to_it = math.sqrt(dx * dx + dy * dy + dz * dz)
        reach = min(radius, to_it)
        if others[query] >= 0:
            dx, dy, dz = seen[query, 0] - px, seen[query, 1] - py, seen[query, 2] - pz
            free = (others[query] - math.sqrt(dx * dx + dy * dy + dz * dz)) * EXACT
            if reach < free:
                distance[query] = to_it if place[query] >= 0 and to_it <= radius else math.inf
                open_[query] = False
                query += 1
                continue
        ball = reach + SLACK * size
        wall = ball * inverse / EXACT
        outside = min(fx, fy) < -wall or fx > wide[0] + wall or fy > wide[1] + wall or abs(fz) > HIGHEST
        if outside or ball > FARTHEST * size:
            seen[query, 0], seen[query, 1], seen[query, 2] = px, py, pz
            others[query], place[query], distance[query] = ball if outside else -1.0, -1, math.inf
            open_[query] = not outside
        else:
            if count == 0:
                ax, ay, az = fx, fy, fz
            asked[count], balls[count] = query, ball
            count += 1
        query += 1
