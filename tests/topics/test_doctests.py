"""The examples in the docstrings of the topic modules run and print what they say."""

from __future__ import annotations

import doctest
import importlib
import inspect
from pathlib import Path

import pytest

import course_lib

MODULES = sorted(path.stem for path in Path(course_lib.__file__).parent.glob("*.py") if path.stem != "__init__")


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    result = doctest.testmod(importlib.import_module(f"course_lib.{name}"))
    assert result.failed == 0


@pytest.mark.parametrize("name", MODULES)
def test_every_public_function_says_what_it_does_and_what_it_raises(name):
    module = importlib.import_module(f"course_lib.{name}")
    for word, thing in vars(module).items():
        own = getattr(thing, "__module__", None) == module.__name__
        if word.startswith("_") or not own or not (inspect.isfunction(thing) or inspect.isclass(thing)):
            continue
        assert thing.__doc__ and len(thing.__doc__) > 20, f"{name}.{word} has no docstring"
        if inspect.isfunction(thing) and "raise ValueError" in inspect.getsource(thing) and name != "checks":
            assert "ValueError" in thing.__doc__, f"{name}.{word} raises ValueError without saying so"


@pytest.mark.parametrize("name", MODULES)
def test_modules_stay_short(name):
    lines = len(Path(course_lib.__file__).with_name(f"{name}.py").read_text(encoding="utf-8").splitlines())
    assert 30 <= lines <= 300
