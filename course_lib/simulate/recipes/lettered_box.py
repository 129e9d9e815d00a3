"""Three close-ups of a black box with white text, all of it known."""

from __future__ import annotations

import numpy as np

from course_lib.camera.pinhole import preset
from course_lib.geometry.transforms import look_at
from course_lib.simulate.camera import render_paint
from course_lib.simulate.recipes.recipe import Progress, Recipe, RecipeOutput
from course_lib.simulate.recipes.shots import shots
from course_lib.simulate.scenes import DESK_TOP, desk


def _lettered_box(seed: int, progress: Progress) -> RecipeOutput:
    scene, camera = desk(seed), preset("d455_depth_848x480")
    eyes = ((-0.33, -0.44, 1.03), (-0.12, -0.42, 1.06), (-0.50, -0.36, 1.08))
    poses = [look_at(eye, (-0.30, 0.12, 0.81)) for eye in eyes]
    box = scene.label("box")
    sides = [surface.shape.points for surface in scene.surfaces if surface.name == "box"]
    ends = np.concatenate([side[[0, 0, -1, -1], [0, -1, 0, -1]] for side in sides])
    out = shots(
        seed,
        scene,
        camera,
        poses,
        progress,
        "A black box with white text on a desk",
        desk_plane=np.array([0.0, 0.0, 1.0, -DESK_TOP]),
        box_corners=np.unique(ends.round(6), axis=0),
    )
    white = [render_paint(scene, camera, T).min(axis=-1) > 128 for T in poses]
    seen = [frame["labels"] == box for frame in out.frames]
    out.truth["ink"] = np.stack([w & s for w, s in zip(white, seen, strict=True)])
    return out


RECIPE = Recipe(7, 1, "Three close-ups of a black box with white text, all of it known.", _lettered_box)
