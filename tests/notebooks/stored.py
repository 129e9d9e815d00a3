"""The stored notebooks that a run proves: all of them, or of a quick proof the first lesson and the first labs."""

from __future__ import annotations

from pathlib import Path

from how_thorough import QUICK

from course_lib.authoring.prove import proved
from course_lib.authoring.tree import Source, course_tree

TREE = course_tree()


def sources() -> list[Source]:
    """Lessons and labs of this run."""
    return proved(TREE, "quick" if QUICK else "all")


def notebooks() -> list[Path]:
    """Their notebooks, and where everything is proved every other notebook that lies beside them."""
    if QUICK:
        return [path for source in sources() for path in source.notebooks]
    folders = (TREE.lessons_folder, TREE.solutions_folder, TREE.exercises_folder)
    stored = {path for folder in folders for path in folder.glob("*.ipynb")}
    return sorted(stored | {path for source in sources() for path in source.notebooks})
