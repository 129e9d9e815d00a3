"""Six D455-like desks, each point labelled with its kind."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from course_lib.camera.pinhole import preset
from course_lib.simulate import d455, outlier_desk
from course_lib.simulate.recipes.recipe import Progress, Recipe, RecipeOutput
from course_lib.simulate.scenes import desk

OUTLIER_DESKS = 6


def _desk_outliers(seed: int, progress: Progress) -> RecipeOutput:
    """The desk laid anew six times; a cloud a frame, each point labelled with its kind."""
    progress(0, OUTLIER_DESKS)
    scene, camera = desk(seed), preset("d455_depth_480x270")
    shots = []
    for number in range(OUTLIER_DESKS):
        shots.append(outlier_desk.shoot(scene, camera, np.random.default_rng([seed, 505, number])))
        progress(number + 1, OUTLIER_DESKS)
    names = outlier_desk.add_thin_things(scene, np.random.default_rng(0)).label_names
    return RecipeOutput(
        frames=[shot.frame for shot in shots],
        encoding="realsense",
        camera=asdict(camera),
        poses=np.array([shot.pose for shot in shots]),
        clouds={
            f"desk_{number}": {"points": shot.points, "colors": shot.colors, "labels": shot.kinds}
            for number, shot in enumerate(shots)
        },
        meta={
            "title": "Six desks with every kind of outlier",
            "label_names": list(names),
            "kind_names": list(outlier_desk.KINDS),
            "artefact_names": list(outlier_desk.ARTEFACTS),
            "baseline_metres": d455.BASELINE,
            "disparity_sigma_pixels": d455.SIGMA,
            "near_surface_sigmas": outlier_desk.NEAR_SURFACE,
            "wrong_match_share": outlier_desk.WRONG_SHARE,
            "speckle_share": outlier_desk.SPECKLE_SHARE,
            "mirror_share_of_glass": outlier_desk.MIRROR_SHARE,
            "units": "metres",
        },
    )


RECIPE = Recipe(7, 1, "Six D455-like desks, each point labelled with its kind.", _desk_outliers)
