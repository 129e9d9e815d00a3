"""How much a run proves: `course test` with --quick, without words, or with --thorough; pytest alone is the second."""

from __future__ import annotations

import os
from collections.abc import Sequence

DEPTH = os.environ.get("COURSE_PROOF", "all")
QUICK, THOROUGH = DEPTH == "quick", DEPTH == "thorough"


def sample(full: int, few: int) -> int:
    """How often: in full under --thorough, else a few times."""
    return full if THOROUGH else few


def some(things: Sequence, few: int) -> Sequence:
    """All of them under --thorough, else the first few."""
    return things if THOROUGH else things[:few]
