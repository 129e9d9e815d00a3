"""Thirty hand-held D455-like frames around a table in a room."""

from __future__ import annotations

import numpy as np

from course_lib.camera.pinhole import preset
from course_lib.simulate.recipes.recipe import Progress, Recipe, RecipeOutput
from course_lib.simulate.recipes.shots import shots
from course_lib.simulate.scenes import TABLE, living_room
from course_lib.simulate.trajectories import handheld


def living_room_path(seed: int) -> list[np.ndarray]:
    """The 30 poses T_world_camera of living_room: from right to left around the table, 1.5 m from its middle."""
    rng = np.random.default_rng([seed, 30])
    aim = (TABLE[0], TABLE[1] + 0.10, TABLE[2] + 0.11)
    return handheld(30, rng, start=(0.53, -1.09, 1.42), target=aim, length=1.05, sweep=-0.78)


def _living_room(seed: int, progress: Progress) -> RecipeOutput:
    scene, camera = living_room(seed), preset("d455_depth_640x480")
    poses = living_room_path(seed)
    return shots(seed, scene, camera, poses, progress, "A living room", table_centre=np.array(TABLE))


RECIPE = Recipe(7, 1, "Thirty hand-held D455-like frames around a table in a room.", _living_room)
