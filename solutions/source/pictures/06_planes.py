"""What the pictures of lab 06 are drawn from: the code that made it is the answer to its tasks."""

from __future__ import annotations

import numpy as np

from course_lib.camera import pinhole
from course_lib.notebook import data
from course_lib.tasks.core import fresh
from course_lib.tasks.labs.lab_06_planes.mistakes import CAUSE_OF
from course_lib.tasks.registry import get

FLOOR = np.array([-0.0491, 0.9897, 0.1348, -0.1616])  # of frame 2, found by RANSAC; its normal points down
STEP = 2  # every so many rows and columns of the frame


def arrays() -> dict[str, np.ndarray]:
    """All arrays, by the name of the task and what they are; numbers with a fraction have 32 bits."""
    made = {**tries(), **heights(), **causes(), **room()}
    return {name: one.astype(np.float32) if one.dtype == np.float64 else one for name, one in made.items()}


def tries() -> dict[str, np.ndarray]:
    """Task 1: samples needed by the share of all planes together, divided among one, two or three of them."""
    together = np.linspace(0.3, 0.95, 100)
    rows = []
    for count in (1, 2, 3):
        good = count * (together / count) ** 3
        rows.append(np.ceil(np.log(0.01) / np.log(1 - good)))
    return {"tries_share": together, "tries_needed": np.array(rows, np.int32)}


def heights() -> dict[str, np.ndarray]:
    """Task 3: a real frame, heights by the given code and right ones, in millimetres; -32768 where nothing is."""
    frame = data.load("realsense_planes").frames[2]
    points = pinhole.deproject(frame.depth, frame.camera, dtype=np.float64)[::STEP, ::STEP]
    normal, d = -3 * FLOOR[:3], -3 * FLOOR[3]  # of length 3, and up: the same plane
    wrong, right = np.abs(points @ normal - d), (points @ normal + d) / 3
    as_stored = {"heights_given": wrong, "heights_expected": right}
    stored = {name: np.nan_to_num(1000 * one, nan=-32768).round().astype(np.int16) for name, one in as_stored.items()}
    return {"heights_color": frame.color[::STEP, ::STEP], **stored}


def causes() -> dict[str, np.ndarray]:
    """Task 4: points of two boards and a heap, six planes in the order of their letters, as lines seen from above."""
    rng, turn, at = np.random.default_rng(60), np.radians(82), np.array([0.9, 0, 1.4])
    to_view = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
    board = np.column_stack([rng.uniform(-0.5, 0.5, 300), rng.uniform(-0.42, 0.42, 300), rng.normal(0, 0.04, 300)])
    spread = (rng.uniform(0.05, 0.5, 130), rng.uniform(-0.42, 0.42, 130), 0.22 + rng.normal(0, 0.04, 130))
    second = np.column_stack(spread)
    heap = np.column_stack([rng.uniform(-0.5, -0.2, 120), rng.uniform(-0.42, 0.42, 120), rng.uniform(-0.5, -0.15, 120)])
    first, second, heap = (part @ to_view.T + at for part in (board, second, heap))
    near, everything = np.vstack([first, second]), np.vstack([first, second, heap])
    made = {
        "mean not subtracted": (np.append(np.linalg.eigh(first.T @ first)[1][:, 0], 0), first),
        "largest eigenvector": (_fit(first, 2), first),
        "outliers in the fit": (_fit(everything), everything),
        "least squares in z": (_in_z(first), first),
        "offset with the wrong sign": (_fit(first) * [1, 1, 1, -1], first),
        "threshold too large": (_fit(near), near),
    }
    true, middle = np.append(to_view[:, 2], -to_view[:, 2] @ at), first.mean(axis=0)
    found = [made[cause] for _, cause in sorted(CAUSE_OF.items())]
    table = [
        [
            len(used),
            np.degrees(np.arccos(min(1, abs(plane[:3] @ true[:3])))),
            abs(plane[:3] @ middle + plane[3]),
            abs(plane[3]),
        ]
        for plane, used in found
    ]
    return {
        "causes_first": first[:, [0, 2]],
        "causes_second": second[:, [0, 2]],
        "causes_heap": heap[:, [0, 2]],
        "causes_true": _line(true),
        "causes_found": np.array([_line(plane) for plane, _ in found]),
        "causes_table": np.array(table),
    }


def room() -> dict[str, np.ndarray]:
    """Task 5: a furnished room from the side, its floor and all else; how a plane square to `up` would lie."""
    case = fresh(get("06-5"), 61)[0]
    points, normal, d = case.given["points"], case.truth[:3], case.truth[3]
    away = np.cross(normal, np.cross(case.given["up"], normal))  # along the floor, the way in which up leans
    away /= np.linalg.norm(away)
    height, along = points @ normal + d, points @ away
    floor = np.abs(height) <= case.given["threshold"]
    centre = case.hidden["around"].mean(axis=0) @ away
    slope = -(case.given["up"] @ away) / (case.given["up"] @ normal)
    square = np.array([[-1.3, -1.3 * slope], [1.3, 1.3 * slope]])
    seen = np.column_stack([along - centre, height])
    return {"room_floor": seen[floor], "room_others": seen[~floor], "room_square_to_up": square}


def _fit(points: np.ndarray, which: int = 0) -> np.ndarray:
    middle = points.mean(axis=0)
    normal = np.linalg.eigh((points - middle).T @ (points - middle))[1][:, which]
    return np.append(normal, -normal @ middle)


def _in_z(points: np.ndarray) -> np.ndarray:
    columns = np.column_stack([points[:, :2], np.ones(len(points))])
    a, b, c = np.linalg.lstsq(columns, points[:, 2], rcond=None)[0]
    return np.array([-a, -b, 1, -c]) / np.sqrt(a * a + b * b + 1)


def _line(plane: np.ndarray) -> np.ndarray:
    """(2, 2) ends, x and z, of a long piece of a plane that stands upright, seen from above."""
    across = plane[[0, 2]]
    base, way = -plane[3] * across / (across @ across), np.array([-across[1], across[0]]) / np.linalg.norm(across)
    return np.array([base - 4 * way, base + 4 * way])
