"""The stored notebooks that a run proves: all of them, or under `course test --quick` lesson 00 and lab 01."""

from __future__ import annotations

import os
from pathlib import Path

from course_lib.authoring.prove import QUICK_LAB, QUICK_LESSON
from course_lib.authoring.tree import Source, course_tree

TREE = course_tree()
QUICK = os.environ.get("COURSE_QUICK") == "1"


def sources() -> list[Source]:
    """Lessons and labs of this run."""
    lessons, labs = TREE.lessons(), TREE.labs()
    if QUICK:
        lessons = [lesson for lesson in lessons if lesson.number == QUICK_LESSON]
        labs = [lab for lab in labs if lab.number == QUICK_LAB]
    return lessons + labs


def notebooks() -> list[Path]:
    """Their notebooks, and where everything is proved every other notebook that lies beside them."""
    if QUICK:
        return [path for source in sources() for path in source.notebooks]
    folders = (TREE.lessons_folder, TREE.solutions_folder, TREE.exercises_folder)
    stored = {path for folder in folders for path in folder.glob("*.ipynb")}
    return sorted(stored | {path for source in sources() for path in source.notebooks})
