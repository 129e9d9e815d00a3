"""A closed, lop-eared animal of about 36,000 vertices, 0.15 m long."""

from __future__ import annotations

import numpy as np

from course_lib.simulate import shapes
from course_lib.simulate.recipes.recipe import Progress, Recipe, RecipeOutput


def _bunny_like(seed: int, progress: Progress) -> RecipeOutput:
    progress(0, 1)
    solid = shapes.organic_shape(seed=seed)
    arrays = {
        "colors": shapes.animal_colors(solid, seed),
        "normals": solid.normals.astype(np.float32),
        "labels": (solid.part + 1).astype(np.uint8),
    }
    points = solid.vertices.astype(np.float32)
    progress(1, 1)
    return RecipeOutput(
        meshes={"surface": {"vertices": points, "triangles": solid.triangles, **arrays}},
        clouds={"cloud": {"points": points, **arrays}},
        meta={"title": "An animal of clay", "label_names": ["nothing", *shapes.PARTS], "up": "z", "units": "metres"},
    )


RECIPE = Recipe(7, 1, "A closed, lop-eared animal of about 36,000 vertices, 0.15 m long.", _bunny_like)
