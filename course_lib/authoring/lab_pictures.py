"""What the pictures of a lab are drawn from, where the code that made it would be the answer.

`solutions/source/pictures/NN_name.py` has a function `arrays()` that returns named NumPy arrays. A build writes them to
`pictures.npz` in the folder of the lab's tasks; the lab reads them with `data.of_lab("NN")`.
"""

from __future__ import annotations

import io
import runpy
from pathlib import Path

import numpy as np

from course_lib.tasks import registry

from .tree import CourseError, Tree

MOVED = 1e-6
"""Relative to the largest value of an array: what moved by less is kept as it stands."""


def maker_of(lab: str, tree: Tree) -> Path | None:
    """The file that makes the arrays of a lab; None where its pictures need none."""
    return next(iter(sorted((tree.solutions_folder / "source" / "pictures").glob(f"{lab}_*.py"))), None)


def made_pictures(maker: Path) -> dict[str, np.ndarray]:
    """The arrays that a maker makes.

    Raises
    ------
    CourseError
        If it has no function `arrays()` that returns arrays by name.
    """
    arrays = runpy.run_path(str(maker)).get("arrays")
    made = arrays() if callable(arrays) else None
    if not isinstance(made, dict) or not all(
        isinstance(one, np.ndarray) and one.dtype != object for one in made.values()
    ):
        raise CourseError(f"{maker.name}: a function arrays() that returns NumPy arrays by name is needed.")
    return made


def write_pictures(lab: str, tree: Tree) -> str:
    """Write the arrays of a lab where a value moved; what is said of it, "" where nothing changed."""
    maker = maker_of(lab, tree)
    path = registry.pictures_file(lab)
    if maker is None or alike(registry.pictures(lab), made := made_pictures(maker)):
        return ""
    content = io.BytesIO()
    np.savez_compressed(content, **made)
    path.write_bytes(content.getvalue())
    return f"{tree.relative(path)} ({path.stat().st_size / 1e3:.0f} kB)"


def alike(old: dict[str, np.ndarray], new: dict[str, np.ndarray]) -> bool:
    """Whether two sets of arrays show the same."""
    return list(old) == list(new) and all(_alike(old[name], new[name]) for name in new)


def _alike(old: np.ndarray, new: np.ndarray) -> bool:
    if old.shape != new.shape or old.dtype != new.dtype:
        return False
    if new.dtype.kind not in "fc":
        return bool((old == new).all())
    most = float(np.nanmax(np.abs(new), initial=0.0, where=np.isfinite(new)))
    return bool(np.allclose(old, new, rtol=0, atol=MOVED * most, equal_nan=True))
