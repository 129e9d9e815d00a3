"""What the tests of every lesson's numbers share: the lesson's own functions, and data that may not be here."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import pytest

from course_lib.notebook import data

ROOT = Path(__file__).parents[2]


def lesson_source(number: str) -> Path:
    """The source of a lesson."""
    [path] = (ROOT / "notebooks" / "source").glob(f"{number}_*.py")
    return path


def functions_of(number: str, names: str, **modules: Any) -> dict[str, Any]:
    """Some functions that a lesson defines ("apply invert"), by name; `modules` is what they rely on."""
    return functions_in(lesson_source(number), names, **modules)


def functions_in(path: Path, names: str, **modules: Any) -> dict[str, Any]:
    """Some functions that a source defines."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name in names.split()]
    assert {function.name for function in functions} == set(names.split())
    space = dict(modules)
    exec(compile(ast.Module(functions, []), str(path), "exec"), space)
    return space


def load(name: str) -> Any:
    """A dataset; the test is skipped where it is real and not on this machine."""
    if not data.available(name):
        pytest.skip(f"the real data {name} are not on this machine")
    return data.load(name)
