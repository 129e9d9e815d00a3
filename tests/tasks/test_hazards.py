"""Every hazard that a lesson names is in a case: an answer that forgets it fails, in public and on fresh seeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from collected import TASKS

from course_lib import tasks

Given = Mapping[str, Any]
HAZARDS: dict[str, dict[str, Callable[[Given], bool]]] = {
    "01-1": {
        "a principal point beside the middle": lambda g: abs(g["cx"] - (g["depth"].shape[1] - 1) / 2) > 1,
    },
    "01-2": {
        "pixels without data": lambda g: (g["raw"] == 0).any(),
        "65535 where it is a depth": lambda g: (g["raw"] == 65535).any() and g["encoding"] != "realsense",
        "bits put in another order": lambda g: g["encoding"] == "sun",
    },
    "01-3": {
        "no data as 0": lambda g: (g["depth"] == 0).any(),
        "no data as NaN": lambda g: np.isnan(g["depth"]).any(),
    },
    "02-1": {"a width that the step does not divide": lambda g: g["width"] % g["step"] != 0},
    "02-2": {
        "bytes between points": lambda g: g["point_step"] > 12,
        "bytes at the end of a row": lambda g: g["row_step"] > g["width"] * g["point_step"],
        "as many of them as a point has": lambda g: g["row_step"] >= (g["width"] + 1) * g["point_step"],
        "a field at no multiple of 4": lambda g: any(at % 4 for at in g["offsets"]),
        "a point of no multiple of 4 bytes": lambda g: g["point_step"] % 4 != 0,
        "the larger byte first": lambda g: g["big_endian"],
        "points not measured": lambda g: any(
            np.isnan(g["data"][i : i + 4].view("<f4"))[0]
            for i in range(int(g["offsets"][0]), len(g["data"]) - 12, g["point_step"])
        ),
        "x not first": lambda g: g["offsets"][0] > 0,
        "another order of x, y and z": lambda g: list(g["offsets"]) != sorted(g["offsets"]),
    },
    "02-3": {"more than one to go through with the same input": lambda g: len(g["T_robot_cameras"]) > 1},
    "03-1": {"an odd number of pixels": lambda g: g["pixels"] % 2 == 1},
    "03-2": {
        "pixels without data": lambda g: (g["ranges"] == 0).any(),
        "fx and fy that differ": lambda g: g["fx"] != g["fy"],
        "a window that does not begin in the corner": lambda g: g["left"] > 0 and g["top"] > 0,
    },
    "03-3": {
        "pixels without data": lambda g: (g["raw"] == 0).any(),
        "beyond 30 m": lambda g: g["raw"].max() / g["units_per_metre"] > 30,
        "a tall image": lambda g: g["raw"].shape[0] > g["raw"].shape[1],
    },
    "03-5": {
        "a principal point beside the middle": lambda g: abs(g["cx"] - 319.5) > 20 and abs(g["cy"] - 239.5) > 20,
        "nonsense among the first items": lambda g: _first_are_wrong(g),
    },
    "04-1": {
        "points on the other side of the origin": lambda g: (g["points"] < g["origin"]).any(),
        "points on faces of cubes": lambda g: ((g["points"] - g["origin"]) / g["voxel"] % 1 == 0).any(axis=1).sum() > 1,
        "an origin that is not zero": lambda g: np.any(g["origin"]),
    },
    "04-2": {
        "points on the other side of the origin": lambda g: (g["points"] < g["origin"]).any(),
        "an origin that is not zero": lambda g: np.any(g["origin"]),
    },
    "04-3": {
        "a few points only": lambda g: len(g["neighbours"]) <= 5,
        "a surface that z = a x + b y + c cannot describe": lambda g: abs(_thin_direction(g["neighbours"])[2]) < 0.05,
        "a viewpoint on the side of the origin": lambda g: _side(g, np.zeros(3)) > 0,
        "a viewpoint on the other side": lambda g: _side(g, np.zeros(3)) < 0,
    },
    "05-1": {"a wrong point that costs more than a true one": lambda g: g["cost"] > 1},
    "05-2": {
        "points not measured": lambda g: np.isnan(g["points"]).any() or (g["points"] == 0).all(axis=1).any(),
        "points that stand twice": lambda g: len(np.unique(g["points"], axis=0)) < len(g["points"]) - 2,
        "depths that differ": lambda g: np.ptp(g["points"][:, 2]) > 0.3,
    },
    "05-3": {
        "others at exactly the radius": lambda g: (np.abs(_between(g) - g["radius"]) < 1e-12).sum() > 5,
        "others at the very place of a point": lambda g: (_between(g) == 0).any(),
    },
    "06-1": {"more than one plane": lambda g: len(g["shares"]) > 1},
    "06-2": {
        "points that are not all as good": lambda g: np.ptp(g["sigma"]) > 0,
        "eigenvalues that eig does not sort": lambda g: _unsorted(g),
    },
    "06-3": {
        "a normal that is not of length 1": lambda g: abs(np.linalg.norm(g["plane"][:3]) - 1) > 0.1,
        "a normal that points up": lambda g: g["plane"][3] > 0,
        "a normal that points down": lambda g: g["plane"][3] < 0,
        "points below the floor": lambda g: _heights(g).min() < 0,
    },
    "07-1": {"a turn before a shift": lambda g: len(g["steps"]) > 1},
    "07-2": {
        "marks that were not found": lambda g: np.isnan(g["source"]).any() and np.isnan(g["target"]).any(),
        "pairs of weight 0": lambda g: (g["weights"] == 0).any(),
        "a planar set, where a reflection fits as well": lambda g: _flatness(g["source"]) < 0.1,
        "marks far from the origin": lambda g: np.linalg.norm(np.nanmean(g["source"], axis=0)) > 1,
    },
    "07-3": {"points without a partner": lambda g: _without_partner(g) > 5},
    "07-5": {"a start that is far off": lambda g: np.linalg.norm(g["start"][:3, 3]) > 0.05},
}
"""Of each task, what its lesson warns of, and whether the inputs of a case hold it."""


def _first_are_wrong(given: Given) -> bool:
    rays = (given["pixels"] - [given["cx"], given["cy"]]) * given["depths"][..., None]
    across = np.linalg.norm(rays[:, 1] - rays[:, 0], axis=1)
    along = given["depths"][:, 1] - given["depths"][:, 0]
    with np.errstate(invalid="ignore"):
        f = across / np.sqrt(given["lengths"] ** 2 - along**2)
    wrong = ~(np.abs(f / np.nanmedian(f) - 1) < 0.1)
    return bool(wrong[0] and wrong[-1] and wrong[:10].sum() >= 5)


def _thin_direction(points: np.ndarray) -> np.ndarray:
    return np.linalg.svd(points - points.mean(axis=0))[2][2]


def _side(given: Given, other: np.ndarray) -> float:
    """Positive where the viewpoint is on the same side of the patch as another point."""
    middle = given["neighbours"].mean(axis=0)
    normal = _thin_direction(given["neighbours"])
    return float(((given["viewpoint"] - middle) @ normal) * ((other - middle) @ normal))


def _unsorted(given: Given) -> bool:
    weight = 1 / given["sigma"] ** 2
    offsets = given["points"] - weight @ given["points"] / weight.sum()
    values = np.linalg.eig((offsets * weight[:, None]).T @ offsets)[0]
    return int(np.argmin(values)) != 0


def _between(given: Given) -> np.ndarray:
    return np.linalg.norm(given["points"][:, None] - given["others"][None], axis=2)


def _flatness(points: np.ndarray) -> float:
    """The smallest spread over the middle one."""
    whole = points[np.isfinite(points).all(axis=1)]
    spreads = np.linalg.svd(whole - whole.mean(axis=0))[1]
    return float(spreads[2] / spreads[1])


def _without_partner(given: Given) -> int:
    moved = given["source"] @ given["T"][:3, :3].T + given["T"][:3, 3]
    nearest = np.linalg.norm(moved[:, None] - given["target"][None], axis=2).min(axis=1)
    return int((nearest > given["radius"]).sum())


def _heights(given: Given) -> np.ndarray:
    normal, d = given["plane"][:3], given["plane"][3]
    return (given["points"] @ normal + d) * np.sign(d) / np.linalg.norm(normal)


@pytest.mark.parametrize(
    ("task_id", "hazard"), [(name, hazard) for name, hazards in HAZARDS.items() for hazard in hazards]
)
def test_a_case_holds_the_hazard(task_id: str, hazard: str) -> None:
    task = tasks.get(task_id)
    for cases in (task.public(), *(tasks.fresh(task, seed) for seed in range(3))):
        assert any(HAZARDS[task_id][hazard](case.given) for case in cases), f"no case of {task_id} holds: {hazard}"


@pytest.mark.parametrize("task", [task for task in TASKS if task.data], ids=lambda task: task.id)
def test_without_its_real_data_a_task_has_three_made_cases(task: tasks.Task) -> None:
    assert len(tasks.fresh(task, 1)) >= 3
