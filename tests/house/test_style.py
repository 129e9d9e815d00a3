"""Style of the code and of the notebooks' sources, and types of the lower rooms, by the rules in pyproject.toml."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from test_floors import FLOOR_OF, MODULES

from course_lib.tasks.core import LIBRARY

ROOT = Path(__file__).parents[2]


def test_ruff_finds_nothing() -> None:
    _finds_nothing("ruff", "check", "--no-cache", "--output-format=concise", ".")


@pytest.mark.slow
def test_mypy_finds_nothing(tmp_path: Path) -> None:
    _finds_nothing("mypy", "--cache-dir", str(tmp_path))


def test_mypy_looks_at_every_lower_room() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]
    lower = {room for room, floor in FLOOR_OF.items() if floor <= FLOOR_OF[LIBRARY[-1]]}
    places = {"/".join(path.relative_to(ROOT).parts[:2]) for path in MODULES}
    there = {place for place in places if Path(place).stem in lower}
    assert settings["strict"] and len(there) > 2 and there <= set(settings["files"])


def _finds_nothing(*words: str) -> None:
    run = subprocess.run(
        [sys.executable, "-m", *words], cwd=ROOT, capture_output=True, text=True, encoding="utf-8", check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr
