"""The wings of course_lib import only from those before them: topics, simulate, tasks, notebook, classroom."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import course_lib

ROOT = Path(course_lib.__file__).parent
ORDER = ("topics", "simulate", "tasks", "notebook", "classroom")


def wing_of(parts: tuple[str, ...]) -> str:
    """The wing of a module named by the parts after course_lib."""
    return parts[0] if parts and parts[0] in ORDER else "topics"


def imported(tree: ast.AST, package: tuple[str, ...]) -> set[tuple[str, ...]]:
    """What a module imports from course_lib, as parts after course_lib, wherever in it the import stands."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ["course_lib", *package][: 1 + len(package) - node.level + 1] if node.level else []
            base = [*base, *(node.module.split(".") if node.module else [])]
            names = [[*base, alias.name] for alias in node.names]
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("importlib.import_module", "import_module"):
            literal = node.args[0].value if node.args and isinstance(node.args[0], ast.Constant) else ""
            names = [str(literal).split(".")]
        else:
            continue
        found |= {tuple(name[1:]) for name in names if name[0] == "course_lib"}
    return found


def modules() -> list[tuple[str, ...]]:
    return sorted(path.relative_to(ROOT).with_suffix("").parts for path in ROOT.rglob("*.py"))


def violations(parts: tuple[str, ...], source: str) -> list[str]:
    own = wing_of(parts)
    package = parts[:-1]
    return [
        f"course_lib.{'.'.join(parts)} ({own}) imports course_lib.{'.'.join(target)} ({wing_of(target)})"
        for target in sorted(imported(ast.parse(source), package))
        if ORDER.index(wing_of(target)) > ORDER.index(own)
    ]


@pytest.mark.parametrize("parts", modules(), ids=".".join)
def test_a_module_imports_only_from_wings_before_its_own(parts):
    source = ROOT.joinpath(*parts).with_suffix(".py").read_text(encoding="utf-8")
    assert violations(parts, source) == []


@pytest.mark.parametrize(
    "parts, source",
    [
        (("cameras",), "from course_lib import simulate"),
        (("cameras",), "import course_lib.notebook.show"),
        (("cameras",), "def f():\n    from course_lib.tasks.core import Task"),
        (("__init__",), "from .classroom import cli"),
        (("simulate", "scenes"), "from ..tasks import core"),
        (("tasks", "core"), "import importlib\nimportlib.import_module('course_lib.classroom.bench')"),
        (("notebook", "show"), "from course_lib.classroom.gates import alt_text"),
    ],
)
def test_the_proof_sees_what_it_must(parts, source):
    assert len(violations(parts, source)) == 1


@pytest.mark.parametrize(
    "parts, source",
    [
        (("cameras",), "import numpy\nfrom course_lib import checks\nfrom . import distortion"),
        (("simulate", "scenes"), "from . import shapes\nfrom ..meshes import Mesh\nfrom .. import cameras"),
        (("classroom", "bench"), "from course_lib.notebook import data\nfrom course_lib.tasks import core"),
    ],
)
def test_the_proof_lets_pass_what_is_right(parts, source):
    assert violations(parts, source) == []


def test_topics_read_no_files_and_print_nothing():
    for parts in modules():
        if wing_of(parts) != "topics":
            continue
        tree = ast.parse(ROOT.joinpath(*parts).with_suffix(".py").read_text(encoding="utf-8"))
        calls = {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
        assert not calls & {"print", "open", "input", "exec", "eval"}, parts
