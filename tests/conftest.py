"""What every test may rely on, whether pytest runs alone or under `course test`."""

from __future__ import annotations

import pytest
from how_thorough import sample
from hypothesis import settings

# No clock judges an example, and every machine draws the same ones.
settings.register_profile("course", deadline=None, derandomize=True, database=None, max_examples=sample(60, 15))
settings.load_profile("course")


@pytest.fixture(autouse=True)
def as_without_a_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    """`course test` sets these for the kernels that it proves; a test that wants them sets them itself."""
    for name in ("COURSE_QUIET", "COURSE_STRICT"):
        monkeypatch.delenv(name, raising=False)
