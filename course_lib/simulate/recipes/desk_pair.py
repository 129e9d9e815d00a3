"""Two D455-like close-ups of a desk, the motion between them exact."""

from __future__ import annotations

from course_lib.camera.pinhole import preset
from course_lib.geometry.transforms import compose, invert
from course_lib.simulate.recipes.recipe import Progress, Recipe, RecipeOutput
from course_lib.simulate.recipes.shots import shots
from course_lib.simulate.scenes import desk


def _desk_pair(seed: int, progress: Progress) -> RecipeOutput:
    scene, camera = desk(seed), preset("d455_depth_848x480")
    poses = [scene.views["first"], scene.views["second"]]
    T_first_second = compose(invert(poses[0]), poses[1])
    return shots(seed, scene, camera, poses, progress, "Two views of a desk", T_first_second=T_first_second)


RECIPE = Recipe(7, 1, "Two D455-like close-ups of a desk, the motion between them exact.", _desk_pair)
