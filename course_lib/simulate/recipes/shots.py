"""What recipes share that take pictures of a scene with a simulated D455."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from course_lib.camera.pinhole import PinholeCamera
from course_lib.simulate import d455
from course_lib.simulate.camera import render_labelled
from course_lib.simulate.recipes.recipe import Progress, RecipeOutput
from course_lib.simulate.scenes import Scene
from course_lib.simulate.trajectories import path_length


def _shoot(
    seed: int, scene: Scene, camera: PinholeCamera, poses: list[np.ndarray], progress: Progress, done: int
) -> list[dict[str, np.ndarray]]:
    """Take D455-like frames; each frame has its own noise, which depends on the seed and its number only."""
    unseen = [scene.label(name) for name in scene.unmeasurable]
    frames = []
    for number, T_world_camera in enumerate(poses):
        frame, labels = render_labelled(scene, camera, T_world_camera)
        rng = np.random.default_rng([seed, 455, number])
        measured = d455.measure(frame.depth, camera, rng, unmeasurable=np.isin(labels, unseen))
        frames.append(
            {
                "color": d455.color_noise(frame.color, rng),
                "depth_raw": measured.raw(),
                "depth_truth": frame.depth,
                "labels": labels,
                "artefacts": measured.artefacts,
            }
        )
        progress(done + number + 1, done + len(poses))
    return frames


def shots(
    seed: int, scene: Scene, camera: PinholeCamera, poses: list[np.ndarray], progress: Progress, title: str, **truth
) -> RecipeOutput:
    """The output of a recipe that takes pictures of a scene; preparing its light counts as a sixth of the work."""
    prepared = max(1, len(poses) // 5)
    progress(0, prepared + len(poses))
    mesh, labels = scene.labelled_mesh()
    progress(prepared, prepared + len(poses))
    frames = _shoot(seed, scene, camera, poses, progress, prepared)
    surface = {
        "vertices": mesh.vertices.astype(np.float32),
        "triangles": mesh.triangles,
        "colors": mesh.colors,
        "normals": mesh.normals.astype(np.float32),
        "labels": labels,
    }
    return RecipeOutput(
        frames=frames,
        encoding="realsense",
        camera=asdict(camera),
        poses=np.array(poses),
        meshes={"surface": surface},
        truth=truth,
        meta={
            "title": title,
            "label_names": list(scene.label_names),
            "artefact_names": list(d455.ARTEFACTS),
            "unmeasurable": list(scene.unmeasurable),
            "baseline_metres": d455.BASELINE,
            "disparity_sigma_pixels": d455.SIGMA,
            "path_metres": round(path_length(poses), 6),
            "up": "z",
            "units": "metres",
        },
    )
