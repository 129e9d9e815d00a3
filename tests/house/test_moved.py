"""A copy of a lesson or lab from before modules moved is told, in one sentence, where they are now."""

from __future__ import annotations

import importlib

import pytest

from course_lib import MOVED


@pytest.mark.parametrize(("name", "now"), MOVED.items())
def test_the_old_name_says_the_new_one(name: str, now: str) -> None:
    assert importlib.import_module(f"course_lib.{now}").__name__ == f"course_lib.{now}"
    package, _, module = f"course_lib.{name}".rpartition(".")
    for line in (f"import course_lib.{name}", f"from {package} import {module}"):
        with pytest.raises(ImportError) as error:
            exec(line, {})
        said = str(error.value)
        assert said.startswith(f"course_lib.{name} is now course_lib.{now}: ") and "course.py reset LAB" in said


def test_a_function_of_the_old_registration_is_told_where_to_look() -> None:
    from course_lib import registration

    with pytest.raises(AttributeError, match=r"course_lib\.registration\.icp; .*reset LAB"):
        registration.fit_rigid  # noqa: B018


def test_a_name_that_never_was_is_not_called_moved() -> None:
    with pytest.raises(ModuleNotFoundError, match="No module named 'course_lib.no_such'"):
        importlib.import_module("course_lib.no_such")
    with pytest.raises(ImportError, match="cannot import name 'no_such'"):
        exec("from course_lib import no_such", {})
