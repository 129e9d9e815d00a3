"""Arrays that a lab's pictures are drawn from: made beside the solutions, stored beside the tasks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from course_lib.authoring.lab_pictures import alike, made_pictures, maker_of
from course_lib.authoring.solutions import ROOT
from course_lib.authoring.tree import CourseError, Tree
from course_lib.notebook import data
from course_lib.tasks import registry


@pytest.mark.parametrize("lab", registry.lab_numbers())
def test_stored_arrays_are_those_that_are_made(lab: str) -> None:
    maker = maker_of(lab, Tree(ROOT))
    assert alike(registry.pictures(lab), made_pictures(maker) if maker else {})
    assert not maker or data.of_lab(lab).keys() == registry.pictures(lab).keys()


def test_a_lab_without_arrays_says_so() -> None:
    with pytest.raises(data.Refusal, match="no arrays of a lab '99'"):
        data.of_lab("99")


def test_what_moved_is_not_alike() -> None:
    one = {"a": np.array([1.0, np.nan]), "b": np.array([1, 2])}
    assert alike(one, {"a": np.array([1.0 + 1e-9, np.nan]), "b": np.array([1, 2])})
    assert not alike(one, {"a": np.array([1.0 + 1e-3, np.nan]), "b": np.array([1, 2])})
    assert not alike(one, {"a": one["a"], "b": np.array([1, 3])})
    assert not alike(one, {"b": one["b"], "a": one["a"]})
    assert not alike(one, {"a": one["a"]})


def test_a_maker_returns_arrays(tmp_path: Path) -> None:
    maker = tmp_path / "90_lab.py"
    for text in ("", "def arrays():\n    return [1]\n", "def arrays():\n    return {'a': [1]}\n"):
        maker.write_text(text)
        with pytest.raises(CourseError, match=r"90_lab.py: a function arrays\(\)"):
            made_pictures(maker)
    maker.write_text("import numpy as np\ndef arrays():\n    return {'a': np.arange(3)}\n")
    assert made_pictures(maker)["a"].tolist() == [0, 1, 2]
