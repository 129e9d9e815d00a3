"""Synthetic datasets on disk: made once by a recipe, whole or not at all, and proved by their hashes when loaded.

A made dataset is a folder `NAME-VERSION-SEED` of PNG files (8-bit colour and labels, 16-bit depth) and NPZ files
(everything else), with a manifest that holds the sha256 of each. A file that does not fit is named, and the dataset is
made again. Two processes that want the same dataset wait for each other, and the second uses what the first made.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from course_lib.notebook import _places
from course_lib.notebook._atomic import atomic_folder, locked
from course_lib.notebook._catalog import Entry
from course_lib.notebook._errors import DataDamaged, Refusal
from course_lib.notebook._stored import MANIFEST, is_whole, sha256, write

if TYPE_CHECKING:
    from course_lib.simulate.recipes.recipe import Recipe

FORMAT = 2
"""Raised when the layout below changes: older folders are then made again."""
SIMULATE = Path(__file__).resolve().parents[1] / "simulate"
SPACE_BYTES = 120_000_000
"""Free space asked for before a dataset is made; the largest takes about half."""


def key(entry: Entry, seed: int) -> str:
    """The folder's name."""
    return f"{entry.name}-{entry.version}-{seed}"


def fingerprint(entry: Entry, seed: int) -> str:
    """Hash what decides the content: the layout, the recipe, its version and the seed."""
    decisive = {"format": FORMAT, "recipe": entry.recipe, "version": entry.version, "seed": seed}
    return hashlib.sha256(json.dumps(decisive, sort_keys=True).encode()).hexdigest()


def code() -> dict[str, str]:
    """Hash the modules that recipes are made of: file name → sha256."""
    return {path.relative_to(SIMULATE).as_posix(): sha256(path) for path in sorted(SIMULATE.rglob("*.py"))}


def recipe_of(entry: Entry) -> Recipe:
    """Find the recipe of an entry; imported only when something has to be made.

    Raises
    ------
    Refusal
        If there is none of that name, or its version is not the catalogue's.
    """
    from course_lib.simulate.recipes.recipe import recipe as find

    recipe = find(entry.recipe)
    if recipe is None or recipe.version != entry.version:
        there = "there is none" if recipe is None else f"the library has version {recipe.version}"
        raise Refusal(
            f"The catalogue wants version {entry.version} of recipe {entry.recipe!r} and {there}: "
            f"update datasets/{entry.name}.toml and the library together."
        )
    return recipe


def proved(folder: Path, wanted: str) -> dict[str, Any]:
    """Return the manifest of a made dataset, after hashing every file of it once in this process.

    Raises
    ------
    DataDamaged
        If the manifest or a file is missing, or a hash differs; the message names the file. Also if the recipes' code
        has changed since; where some of that code is not installed, that is not asked.
    """
    path = folder / MANIFEST
    try:
        content = path.read_bytes()
        manifest = json.loads(content)
        files = manifest["files"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataDamaged(f"{folder.name}/{MANIFEST} is missing or damaged") from error
    made_by, now = manifest.get("made_by", {}), code()
    changed = [name for name in made_by if now.get(name) != made_by[name]]
    if changed and set(made_by) <= set(now):
        raise DataDamaged(f"{folder.name} was made by older code ({changed[0]} has changed)")
    if manifest.get("fingerprint") != wanted:
        raise DataDamaged(f"{folder.name}/{MANIFEST} belongs to other settings")
    for name, facts in files.items():
        one = folder / name
        if not one.is_file():
            raise DataDamaged(f"{folder.name}/{name} is missing")
        if not is_whole(one, facts["sha256"]):
            raise DataDamaged(f"{folder.name}/{name} is damaged (its sha256 differs)")
    return manifest


def find(entry: Entry, seed: int) -> tuple[Path, dict[str, Any]] | None:
    """Return folder and manifest of a made dataset, or None where it has to be made; say what was damaged."""
    damage = []
    for root in _places.cache_roots():
        folder = root / key(entry, seed)
        if folder.is_dir():
            try:
                return folder, proved(folder, fingerprint(entry, seed))
            except DataDamaged as error:
                damage.append(str(error))
    if damage:
        _places.notice(f"{damage[0]}, so {entry.name} is made again.")
    return None


def make(entry: Entry, seed: int | None = None) -> tuple[Path, dict[str, Any]]:
    """Return folder and manifest of a synthetic dataset, making it where it is missing or damaged.

    Nothing half-made stays, whatever interrupts: Ctrl-C, a full disk, a killed process.

    Raises
    ------
    CannotWrite
        If no folder can be written or the disk is full.
    """
    seed = entry.seed if seed is None else seed
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise Refusal(f"A seed is a whole number from 0 on, not {seed!r}: leave it out for the published dataset.")
    seed = int(seed)
    found = find(entry, seed)
    if found:
        return found
    root = _places.writable_root()
    waiting = f"Another process is making {entry.name}: waiting for it."
    with locked(root / f".{key(entry, seed)}.lock", waiting, _places.notice):
        folder = root / key(entry, seed)
        try:
            return folder, proved(folder, fingerprint(entry, seed))  # another process made it while this one waited
        except DataDamaged:
            recipe = recipe_of(entry)
        made_by = code()
        title = f"making {entry.name} (first use only)"
        with atomic_folder(folder, SPACE_BYTES) as partial, _places.Bar(title) as step:
            output = recipe.make(seed, step)
            about = {"name": entry.name, "recipe": entry.recipe, "version": entry.version, "seed": seed}
            about |= {"fingerprint": fingerprint(entry, seed), "made_by": made_by}
            manifest = write(partial, output, about)
        return folder, manifest


def clear(name: str) -> int:
    """Remove every made version of a dataset, and return the bytes that this freed."""
    freed = 0
    for root in _places.cache_roots():
        for path in [*root.glob(f"{name}-*-*"), *root.glob(f".{name}-*-*")]:
            if path.is_dir():
                freed += sum(one.stat().st_size for one in path.rglob("*") if one.is_file())
                shutil.rmtree(path)
            elif path.suffix == ".lock" and os.access(root, os.W_OK):
                path.unlink(missing_ok=True)
    return freed
