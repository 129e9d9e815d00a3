"""Task 3 of lab 02: mend the way from the world into each camera of a robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from course_lib.geometry import transforms
from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_array, quantity, rotation_degrees
from course_lib.tasks.mistakes import left_in, mended
from course_lib.tasks.plain import Plain

TOLERANCE = 1e-4  # metres
_HEAD = "def invert(T_world_robot, T_robot_cameras, points):\n"
GIVEN = {
    "order": (
        "T_robot_camera @ T_world_robot",
        "T_world_robot @ T_robot_camera",
        "poses multiplied in the wrong order: the frames that meet must be equal",
    ),
    "moved on": (
        "points -= T[:3, 3]\n        points = points @ T[:3, :3]{turn}\n        seen.append(points)",
        "seen.append((points - T[:3, 3]) @ T[:3, :3]{turn})",
        "a camera given what the one before it saw, in place of the world's points",
    ),
    "turned on": (
        ".T",
        "",
        "rows turned by R once more (@ R.T) in place of back (@ R)",
    ),
}


ALSO_MOVED_ON = (
    "points = (points - T[:3, 3]) @ T[:3, :3]{turn}\n        seen.append(points)",
    "points -= T[:3, 3]\n        seen.append(points @ T[:3, :3]{turn})",
)
"""How else points move on. (The given way also spoils what it has appended: `-=` works on that very array.)"""


def _program(left: tuple[str, ...], also: str = "") -> str:
    """The given program with only these mistakes still in it; with `also` in the place of how its points move on."""
    order, moved, turn = mended(GIVEN, left)
    moved = also or moved
    lines = (
        "    seen = []",
        "    for T_robot_camera in T_robot_cameras:",
        f"        T = {order}",
        f"        {moved.format(turn=turn)}",
        "    return np.array(seen)",
    )
    return _HEAD + "\n".join(lines) + "\n"


def _each(pose: str, answer: str) -> str:
    """One line for each camera: its pose, and what is answered with R, t and the points."""
    return (
        f"{_HEAD}    seen = []\n"
        "    for T_robot_camera in T_robot_cameras:\n"
        f"        T = {pose}\n"
        "        R, t = T[:3, :3], T[:3, 3]\n"
        f"        seen.append({answer})\n"
        "    return np.array(seen)\n"
    )


_CAMERA = "T_world_robot @ T_robot_camera"
_LESSON = (
    f"{_HEAD}    T = T_world_robot\n    back = np.eye(4)\n    back[:3, :3] = T[:3, :3].T\n"
    "    back[:3, 3] = -T[:3, :3].T @ T[:3, 3]\n"
)
_LEFT = [tuple(name for name in GIVEN if name in mistake.name) for mistake in left_in(GIVEN, _program)]
MISTAKES = (
    *(
        replace(mistake, variants=tuple(_program(left, also) for also in ALSO_MOVED_ON if "moved on" in left))
        for mistake, left in zip(left_in(GIVEN, _program), _LEFT, strict=True)
    ),
    Misconception(
        "the lesson's own code",
        "one pose undone, as in the lesson: here two poses lie between the world and a camera, and points are asked, "
        "those of each camera",
        _LESSON + "    return back\n",
        variants=(
            _LESSON + "    return points @ back[:3, :3].T + back[:3, 3]\n",
            _each(_CAMERA, "np.vstack([np.column_stack([R.T, -R.T @ t]), [0, 0, 0, 1]])"),
            _each(_CAMERA, "np.linalg.inv(T)[:3]"),
        ),
    ),
    Misconception(
        "number by number",
        "poses multiplied number by number: * does so, the poses of a chain are multiplied with @",
        _each("T_world_robot * T_robot_camera", "(points - t) @ R"),
    ),
    Misconception(
        "robot left out",
        "only the camera's pose on the robot undone: that leads from the robot to the camera, and the points are in "
        "the world",
        _each("T_robot_camera", "(points - t) @ R"),
    ),
    Misconception(
        "camera left out",
        "only the robot's pose undone: these are the points as the robot has them, not yet as its cameras do",
        _each("T_world_robot", "(points - t) @ R"),
    ),
    Misconception(
        "camera not undone",
        "the robot's pose undone and then the camera's applied: T_robot_camera leads from the camera to the robot, so "
        "it must be undone, too",
        _each("T_robot_camera", "(points - T_world_robot[:3, 3]) @ T_world_robot[:3, :3] @ R.T + t"),
    ),
    Misconception(
        "only the first camera",
        "the points of one camera: (K, N, 3) is asked, for each of the K cameras its own; does `return` stand inside "
        "the loop?",
        f"{_HEAD}    T = T_world_robot @ T_robot_cameras[0]\n    return (points - T[:3, 3]) @ T[:3, :3]\n",
        variants=(_each(_CAMERA, "(points - t) @ R").replace("    return", "        return"),),
    ),
    Misconception(
        "not undone",
        "R p + t, which leads from the camera to the world: here the way back is asked",
        _each(_CAMERA, "points @ R.T + t"),
    ),
    Misconception(
        "shift not turned back",
        "[Rᵀ, −t]: the shift was made in the world's directions, so take it away before you turn back",
        _each(_CAMERA, "points @ R - t"),
    ),
    Misconception(
        "sign of the shift",
        "the shift added: what was added on the way there must be subtracted on the way back",
        _each(_CAMERA, "(points + t) @ R"),
    ),
    Misconception(
        "shift turned the wrong way",
        "[Rᵀ, −R t]: the shift is turned back by the transpose, as the points are. A slice such as T[:3, :3] is a "
        "view: it changes with T",
        _each(_CAMERA, "points @ R - R @ t"),
    ),
    Misconception(
        "turned back twice",
        "the shift turned back twice: (p − t) turned back once is all",
        _each(_CAMERA, "points @ R - R.T @ R.T @ t"),
    ),
)


def _pose(rng: np.random.Generator, turns: bool = True) -> np.ndarray:
    """A pose that shifts by about a metre and turns by 40 to 120 degrees about a slanted axis."""
    axis = rng.normal(size=3)
    axis = np.sign(axis) * np.maximum(np.abs(axis), 0.3)
    turn = np.radians(rng.uniform(40, 120)) * axis / np.linalg.norm(axis)
    R = transforms.exp(np.concatenate([np.zeros(3), turn]))[:3, :3] if turns else np.eye(3)
    return transforms.from_rotation_translation(R, rng.choice([-1, 1], 3) * rng.uniform(0.4, 1.2, 3))


def _cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, robot_turns, cameras in (
        ("nothing turns, one camera", False, (False,)),
        ("one camera that looks aside, on a robot that turns", True, (True,)),
        ("three cameras", True, (True, False, True)),
    ):
        T_world_robot = _pose(rng, robot_turns)
        T_robot_cameras = np.stack([_pose(rng, turns) for turns in cameras])
        points = rng.uniform(-2, 2, (8, 3))
        if not robot_turns:  # the farthest point of all cases, as far in every drawing
            points[0] = T_world_robot[:3, 3] + T_robot_cameras[0, :3, 3] + [9, -9, 9]
        truth = []
        for T_robot_camera in T_robot_cameras:
            in_robot = (points - T_world_robot[:3, 3]) @ T_world_robot[:3, :3]
            truth.append((in_robot - T_robot_camera[:3, 3]) @ T_robot_camera[:3, :3])
        given = {"T_world_robot": T_world_robot, "T_robot_cameras": T_robot_cameras, "points": points}
        cases.append(Case(given, {"truth": np.array(truth)}, name))
    return cases


def _which_part(case: Case, answer: Plain) -> tuple[str, str] | None:
    """Which camera's points are wrong first; of these their shape, their turn, or only their place."""
    a, t = np.asarray(answer, float), np.asarray(case.truth)
    wrong = np.abs(a - t).max(axis=(1, 2)) > TOLERANCE
    k = int(np.argmax(wrong))
    if 0 < wrong.sum() < len(wrong) and k > 0:
        return "only later cameras", (
            f"Up to camera {k} the points are right, those of camera {k + 1} are not: does anything change from one "
            "turn of the loop to the next?"
        )
    mine, true = a[k] - a[k].mean(axis=0), t[k] - t[k].mean(axis=0)
    U, _, Vt = np.linalg.svd(mine.T @ true)
    R = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    if np.abs(mine @ R - true).max() > TOLERANCE:
        return "shape lost", (
            "The points have other distances from each other than in the world: a pose keeps them all. Is R used for "
            "columns where points are rows, or is something scaled?"
        )
    angle, shift = rotation_degrees(R, np.eye(3)), float(np.linalg.norm((a[k] - t[k]).mean(axis=0)))
    if angle < 0.01:
        return "only the shift", f"The turn is right; only the shift is wrong, by {quantity(shift, 'm')}."
    return "the rotation first", (
        f"The points are turned wrongly, by {angle:.1f}°; their place may only follow from it: mend the turn first."
    )


TASK = Task(
    id="02-3",
    title="Mend the way back",
    points=2,
    version=4,
    kind="mend",
    signature="def invert(T_world_robot, T_robot_cameras, points)",
    cases=_cases,
    judge=lambda case, answer: judge_array(answer, case.truth, TOLERANCE, "m", axes="xyz", what="the point"),
    misconceptions=MISTAKES,
    anatomy=_which_part,
    keeps_inputs=True,
    where="lesson 02, section 5 (frames and transforms) and Break it",
)
