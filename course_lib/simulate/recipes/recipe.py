"""A recipe: how a synthetic dataset is made, from a seed, as plain arrays together with their truth.

A recipe knows nothing of files. ``recipe(name).make(seed, progress)`` returns a `RecipeOutput`, which whoever stores
datasets can write generically, because every field has one fixed form:

==============  ======================================================================================================
field           content
==============  ======================================================================================================
``frames``      list of dicts of arrays, all (H, W): ``color`` (H, W, 3) uint8 RGB, ``depth_raw`` uint16 in the units of
                ``encoding`` (the sensor's noisy depth, 0 = no data), ``depth_truth`` float32 metres (exact, 0 = the ray
                left the scene), ``labels`` uint8 (index into ``meta["label_names"]``, 0 = nothing), ``artefacts`` uint8
                (index into ``meta["artefact_names"]``: what the sensor did to this pixel). May be empty.
``encoding``    name of an entry of `course_lib.camera.rgbd.ENCODINGS` for ``depth_raw``; "" where there are no frames
``camera``      dict of the arguments of `course_lib.camera.pinhole.PinholeCamera`; empty where there are no frames
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

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from course_lib.simulate.scenes import check_seed

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
    """A way to make a dataset; the `RECIPE` of a module that is called as the dataset.

    Attributes
    ----------
    seed : the seed of the published dataset.
    version : raised whenever the arrays change; part of a cache's key.
    about : one sentence for a card.
    maker : called as ``maker(seed, progress)``.
    """

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


def recipe(name: str) -> Recipe | None:
    """The recipe of a name; None where there is none.

    Parameters
    ----------
    name : of a module beside this one: "living_room".
    """
    package = importlib.import_module(__package__)
    if name not in {module.name for module in pkgutil.iter_modules(package.__path__)}:
        return None
    return getattr(importlib.import_module(f"{__package__}.{name}"), "RECIPE", None)
