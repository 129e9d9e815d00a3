"""Recipes: how each synthetic dataset of the course is made, from a seed, as plain arrays together with their truth.

A recipe knows nothing of files. ``RECIPES[name].make(seed, progress)`` returns a `RecipeOutput`, which whoever stores
datasets can write generically, because every field has one fixed form:

==============  ======================================================================================================
field           content
==============  ======================================================================================================
``frames``      list of dicts of arrays, all (H, W): ``color`` (H, W, 3) uint8 RGB, ``depth_raw`` uint16 in the units of
                ``encoding`` (the sensor's noisy depth, 0 = no data), ``depth_truth`` float32 metres (exact, 0 = the ray
                left the scene), ``labels`` uint8 (index into ``meta["label_names"]``, 0 = nothing), ``artefacts`` uint8
                (index into ``meta["artefact_names"]``: what the sensor did to this pixel). May be empty.
``encoding``    name of an entry of `course_lib.rgbd.ENCODINGS` for ``depth_raw``; "" where there are no frames
``camera``      dict of the arguments of `course_lib.cameras.PinholeCamera`; empty where there are no frames
``poses``       (n_frames, 4, 4) float64, T_world_camera of each frame; (0, 4, 4) where there are no frames
``meshes``      name → dict of arrays: ``vertices`` (V, 3) float32 m, ``triangles`` (T, 3) int32 and, where they exist,
                ``colors`` (V, 3) uint8, ``normals`` (V, 3) float32, ``labels`` (V,) uint8. "surface": the true one.
``clouds``      name → dict of arrays: ``points`` (N, 3) float32 m and, where they exist, ``colors`` (N, 3) uint8,
                ``normals`` (N, 3) float32, ``labels`` (N,) uint8. "cloud" is the dataset's main one.
``truth``       name → array: whatever else is known exactly
``meta``        JSON-able facts: ``title``, ``label_names`` (list; index = label), sensor settings
==============  ======================================================================================================
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field

import numpy as np

from course_lib.cameras import PinholeCamera, preset
from course_lib.simulate import d455, outlier_desk, shapes
from course_lib.simulate.camera import render_labelled, render_paint
from course_lib.simulate.scenes import DESK_TOP, TABLE, Scene, check_seed, desk, living_room
from course_lib.simulate.trajectories import handheld, path_length
from course_lib.transforms import compose, invert, look_at

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class RecipeOutput:
    """What a recipe returns: arrays, strings and numbers only; the module's docstring gives the form of each field."""

    frames: list[dict[str, np.ndarray]] = field(default_factory=list)
    encoding: str = ""
    camera: dict[str, object] = field(default_factory=dict)
    poses: np.ndarray = field(default_factory=lambda: np.zeros((0, 4, 4)))
    meshes: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    clouds: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    truth: dict[str, np.ndarray] = field(default_factory=dict)
    meta: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Recipe:
    """A named way to make a dataset.

    Attributes
    ----------
    name : the dataset's name.
    seed : the seed of the published dataset.
    version : raised whenever the arrays change; part of a cache's key.
    about : one sentence for a card.
    maker : called as ``maker(seed, progress)``.
    """

    name: str
    seed: int
    version: int
    about: str
    maker: Callable[[int, Progress], RecipeOutput]

    def make(self, seed: int | None = None, progress: Progress | None = None) -> RecipeOutput:
        """Make the dataset; the same seed gives the same arrays, bit for bit, in any process and with any thread count.

        Parameters
        ----------
        seed : a non-negative integer, or None for the published dataset's seed.
        progress : called as ``progress(done, total)`` while the recipe works; the last call has ``done == total``.

        Raises
        ------
        ValueError
            If the seed is not a non-negative integer.
        """
        seed = check_seed(self.seed if seed is None else seed)
        return self.maker(seed, progress or (lambda done, total: None))


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


def _shots(
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


def living_room_path(seed: int) -> list[np.ndarray]:
    """The 30 poses T_world_camera of living_room: from right to left around the table, 1.5 m from its middle."""
    rng = np.random.default_rng([seed, 30])
    aim = (TABLE[0], TABLE[1] + 0.10, TABLE[2] + 0.11)
    return handheld(30, rng, start=(0.53, -1.09, 1.42), target=aim, length=1.05, sweep=-0.78)


def _living_room(seed: int, progress: Progress) -> RecipeOutput:
    scene, camera = living_room(seed), preset("d455_depth_640x480")
    poses = living_room_path(seed)
    return _shots(seed, scene, camera, poses, progress, "A living room", table_centre=np.array(TABLE))


def _desk_pair(seed: int, progress: Progress) -> RecipeOutput:
    scene, camera = desk(seed), preset("d455_depth_848x480")
    poses = [scene.views["first"], scene.views["second"]]
    T_first_second = compose(invert(poses[0]), poses[1])
    return _shots(seed, scene, camera, poses, progress, "Two views of a desk", T_first_second=T_first_second)


def _lettered_box(seed: int, progress: Progress) -> RecipeOutput:
    scene, camera = desk(seed), preset("d455_depth_848x480")
    eyes = ((-0.33, -0.44, 1.03), (-0.12, -0.42, 1.06), (-0.50, -0.36, 1.08))
    poses = [look_at(eye, (-0.30, 0.12, 0.81)) for eye in eyes]
    box = scene.label("box")
    sides = [surface.shape.points for surface in scene.surfaces if surface.name == "box"]
    ends = np.concatenate([side[[0, 0, -1, -1], [0, -1, 0, -1]] for side in sides])
    out = _shots(
        seed, scene, camera, poses, progress, "A black box with white text on a desk",
        desk_plane=np.array([0.0, 0.0, 1.0, -DESK_TOP]),
        box_corners=np.unique(ends.round(6), axis=0),
    )
    white = [render_paint(scene, camera, T).min(axis=-1) > 128 for T in poses]
    seen = [frame["labels"] == box for frame in out.frames]
    out.truth["ink"] = np.stack([w & s for w, s in zip(white, seen, strict=True)])
    return out


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


RECIPES: dict[str, Recipe] = {
    recipe.name: recipe
    for recipe in (
        Recipe("bunny_like", 7, 1, "A closed, lop-eared animal of about 36,000 vertices, 0.15 m long.", _bunny_like),
        Recipe("living_room", 7, 1, "Thirty hand-held D455-like frames around a table in a room.", _living_room),
        Recipe("desk_outliers", 7, 1, "Six D455-like desks, each point labelled with its kind.", _desk_outliers),
        Recipe("desk_pair", 7, 1, "Two D455-like close-ups of a desk, the motion between them exact.", _desk_pair),
        Recipe("lettered_box", 7, 1, "Three close-ups of a black box with white text, all of it known.", _lettered_box),
    )
}
