"""The examples in the docstrings of the library's rooms run and print what they say."""

from __future__ import annotations

import doctest
import importlib
import inspect
from pathlib import Path

import pytest

import course_lib
from course_lib.tasks.core import LIBRARY

ROOT = Path(course_lib.__file__).parent
PATHS = [ROOT / "checks.py", *(path for room in LIBRARY for path in sorted(ROOT.glob(f"{room}/[a-z]*.py")))]
MODULES = [path.relative_to(ROOT.parent).with_suffix("").as_posix().replace("/", ".") for path in PATHS]


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    assert doctest.testmod(importlib.import_module(name)).failed == 0


@pytest.mark.parametrize("name", MODULES)
def test_every_public_function_says_what_it_does_and_what_it_raises(name):
    module = importlib.import_module(name)
    for word, thing in vars(module).items():
        own = getattr(thing, "__module__", None) == module.__name__
        if word.startswith("_") or not own or not (inspect.isfunction(thing) or inspect.isclass(thing)):
            continue
        assert thing.__doc__ and len(thing.__doc__) > 20, f"{name}.{word} has no docstring"
        if inspect.isfunction(thing) and "raise ValueError" in inspect.getsource(thing) and not name.endswith("checks"):
            assert "ValueError" in thing.__doc__, f"{name}.{word} raises ValueError without saying so"
