"""limits.toml: every limit is explained there, and a file of the same form changes some."""

from __future__ import annotations

import tomllib
from dataclasses import fields

import pytest

from course_lib.authoring.tree import CourseError
from course_lib.grading.run.limits import DEFAULT, Limits, read_limits


def test_every_limit_stands_in_the_file_with_a_comment():
    lines = DEFAULT.read_text(encoding="utf-8").splitlines()
    explained = {line.split("=")[0].strip() for line in lines if "=" in line and "# " in line}
    assert explained == {field.name for field in fields(Limits)} == set(tomllib.loads("\n".join(lines)))


def test_a_file_changes_some_and_leaves_the_rest(tmp_path):
    (tmp_path / "limits.toml").write_text("cell_seconds = 5\n")
    limits = read_limits(tmp_path / "limits.toml")
    assert limits == read_limits().but(cell_seconds=5)
    assert Limits.from_dict(limits.as_dict()) == limits


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("cel_seconds = 5", "no limit 'cel_seconds'. Did you mean cell_seconds"),
        ("cell_seconds = 0", "must be a number above 0"),
        ("cell_seconds = 'long'", "must be a number above 0"),
        ("cell_seconds = true", "must be a number above 0"),
        ("cell_seconds", "not TOML"),
    ],
)
def test_a_wrong_file_says_so(tmp_path, text, sentence):
    (tmp_path / "limits.toml").write_text(text)
    with pytest.raises(CourseError, match=sentence):
        read_limits(tmp_path / "limits.toml")


def test_a_missing_file_says_so(tmp_path):
    with pytest.raises(CourseError, match="cannot be read"):
        read_limits(tmp_path / "limits.toml")
