"""What the pictures of lab 02 are drawn from: its cells show the arrays and do not tell how they were made."""

from __future__ import annotations

import numpy as np

from course_lib import tasks
from course_lib.notebook import data
from course_lib.tasks.diagnosis.recognition import load_source
from course_lib.tasks.labs.lab_02_point_clouds.causes import CAUSE_OF
from course_lib.tasks.labs.lab_02_point_clouds.way_back import GIVEN, _program

STEP = 2.0**-12  # a quarter of a millimetre, and few digits in a file


def pose_2d(degrees: float, x: float, y: float) -> np.ndarray:
    """A turn to the left and a shift in the plane: (3, 3)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])


def move(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (N, 2) moved by a pose of the plane."""
    return points @ T[:2, :2].T + T[:2, 2]


def spoiled() -> dict[str, np.ndarray]:
    """Task 4: by the letter of each cause, where the cloud belongs and where the mistake moved it."""
    animal = data.load("bunny_like").cloud.points.astype(float)[::20]
    animal = 2 * (animal - animal.mean(axis=0))  # a larger one, to see its direction
    flat = animal[:, :2]  # from above
    first, second = pose_2d(40, 0.25, 0), pose_2d(30, 0, 0.2)
    padded = np.column_stack([animal, np.zeros(len(animal))])
    strided = padded.ravel()[: 3 * len(animal)].reshape(-1, 3)[:, :2]
    belongs = move(first, flat)
    made = {
        "millimetres": (belongs, move(first, 1000 * flat)),
        "stride": (belongs, move(first, strided)),
        "inverse": (belongs, move(np.linalg.inv(first), flat)),
        "shift first": (belongs, (flat + first[:2, 2]) @ first[:2, :2].T),
        "order": (move(second, belongs), move(first, move(second, flat))),
    }
    arrays = {"start": flat, "turned": flat @ first[:2, :2].T, "right": belongs, "shift": first[:2, 2]}
    for letter, cause in CAUSE_OF.items():
        arrays[f"right_{letter}"], arrays[f"wrong_{letter}"] = made[cause]
    return arrays


def robot() -> dict[str, np.ndarray]:
    """Task 3: an animal, a robot with two cameras, and what each sees of it, by the given and by a right program."""
    animal = data.load("bunny_like").cloud.points.astype(float)[::30]
    animal = 4 * (animal - animal.mean(axis=0)) + [1.5, 1.6, 0.5]
    T_robot = np.eye(4)
    c, s = np.cos(np.radians(40)), np.sin(np.radians(40))
    T_robot[:3, :3], T_robot[:3, 3] = [[c, -s, 0], [s, c, 0], [0, 0, 1]], [0.4, 0.3, 0]
    ahead, left = np.eye(4), np.eye(4)
    ahead[:3, :3], ahead[:3, 3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [0.3, 0, 0.4]
    left[:3, :3], left[:3, 3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]], [0, 0.2, 0.4]
    cameras = np.stack([ahead, left])
    given, right = (load_source(_program(mistakes), "invert") for mistakes in (tuple(GIVEN), ()))
    return {
        "world": animal,
        "poses": np.stack([T_robot, *(T_robot @ cameras)]),
        "asked": right(T_robot, cameras, animal.copy()),
        "came": given(T_robot, cameras, animal.copy()),
    }


def blind() -> dict[str, np.ndarray]:
    """Task 5: a shape like those of the task, and how far each of its points is from one of 60 drawn blindly."""
    case = tasks.fresh(tasks.get("02-5"), 4)[0]
    shape, n = np.asarray(case.given["points"]), int(case.given["n"])
    kept = shape[np.random.default_rng(1).choice(len(shape), n, replace=False)]
    return {"shape": shape, "gaps": np.linalg.norm(shape[:, None] - kept, axis=2).min(axis=1)}


def arrays() -> dict[str, np.ndarray]:
    """Everything that lab 02's pictures are drawn from, in metres."""
    made = spoiled() | robot() | blind()
    return {name: (STEP * np.round(array / STEP)).astype(np.float32) for name, array in made.items()}
