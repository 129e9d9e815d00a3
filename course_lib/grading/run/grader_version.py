"""The version of this grader: a hash over what can change a grade beside labs and tasks, which have their own."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from course_lib.authoring.tree import course_tree

PARTS = (
    *("intake/untrusted_notebook", "release/cell_source", "release/hiding", "release/rebuild", "release/released"),
    *("release/text_answers", "run/causes", "run/counting", "run/engine", "run/grade_submission", "run/kernel"),
    *("run/kernel_channels", "run/kernel_imports", "run/kernel_messages", "run/limits", "run/nbval_items"),
    *("run/reading", "run/sandbox", "run/watchdog"),
)
"""The modules of the grader that can change a grade; with them inside/ and what all tasks share."""


@lru_cache(maxsize=1)
def grader_version() -> str:
    """The version of this grader: a hash over what can change a grade beside labs and tasks, which have their own."""
    here = Path(__file__).parent
    paths = [here.parent / f"{name}.py" for name in PARTS] + sorted((here / "inside").glob("*.py"))
    paths += sorted((course_tree().root / "course_lib" / "tasks").glob("*.py"))
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]
