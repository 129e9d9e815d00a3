"""The library without what would answer a task: functions that `Task.hides` names, cut out of their modules' source.

Two strengths. *Cut* replaces the body by a refusal: nothing of the answer is left. *Guarded* keeps the body for the
course's own pictures and judges and refuses to be called by anybody else: a courtesy to the learner, who can read the
file; what holds is that the kernel which grades has only the cut form (see `room`).
"""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType
from typing import Any

from course_lib.authoring.tree import CourseError

__all__ = ["Hidden", "find_hidden", "hidden_sources"]


@dataclass(frozen=True)
class Hidden:
    """One name to hide: as it is public, and where it is defined."""

    public: str
    path: Path
    name: str
    is_function: bool


def find_hidden(names: Iterable[str], root: Path) -> list[Hidden]:
    """Where the things are defined that dotted names of the course stand for; names of other packages are left out.

    Raises
    ------
    CourseError
        If there is no such thing, or it is neither a function nor a constant at the top of a module.
    """
    found = []
    for public in names:
        if not public.startswith("course_lib."):
            continue
        module, _, name = public.rpartition(".")
        try:
            thing = getattr(importlib.import_module(module), name)
            thing = getattr(thing, "py_func", thing)  # of a compiled loop
        except (ImportError, AttributeError) as error:
            raise CourseError(f"a task hides {public}, which does not exist.") from error
        is_function = isinstance(thing, FunctionType)
        home = thing.__module__ if is_function else _home(module, name, thing)
        path = root.joinpath(*home.split(".")).with_suffix(".py")
        found.append(Hidden(public, path, thing.__name__ if is_function else name, is_function))
    return found


def _home(module: str, name: str, thing: Any) -> str:
    """The module of the course whose source assigns a constant."""
    source = inspect.getsource(importlib.import_module(module))
    for node in ast.parse(source).body:
        if isinstance(node, ast.ImportFrom) and any((a.asname or a.name) == name for a in node.names):
            return _home(node.module or "", next(a.name for a in node.names if (a.asname or a.name) == name), thing)
        if name in _assigned(node):
            return module
    raise CourseError(f"a task hides {module}.{name}, which no module assigns at its top.")


def _assigned(node: ast.stmt) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [target.id for target in targets if isinstance(target, ast.Name)]


def hidden_sources(names: Iterable[str], root: Path, guarded: Iterable[str] = ()) -> dict[Path, str]:
    """The new text of each module that defines something hidden.

    Parameters
    ----------
    names : dotted public names, as in `Task.hides`.
    root : the folder that holds course_lib/.
    guarded : those of the names that the course itself needs: they keep their body and refuse other callers.
    """
    guarded = set(guarded)
    by_file: dict[Path, list[Hidden]] = {}
    for hidden in find_hidden(names, root):
        by_file.setdefault(hidden.path, []).append(hidden)
    return {path: _without(path.read_text(encoding="utf-8"), some, guarded) for path, some in by_file.items()}


def _without(text: str, hidden: list[Hidden], guarded: set[str]) -> str:
    lines = text.split("\n")
    wanted = {one.name: one for one in hidden}
    for node in reversed(ast.parse(text).body):
        name = getattr(node, "name", None) or next(iter(_assigned(node)), None)
        one = wanted.get(name)
        if one is None:
            continue
        end = node.end_lineno or node.lineno
        if not isinstance(node, ast.FunctionDef):
            if one.public not in guarded:
                lines[node.lineno - 1 : end] = [f"{name} = None  # {_sentence(name)}"]
            continue
        first = node.body[1] if ast.get_docstring(node) is not None and len(node.body) > 1 else node.body[0]
        refusal = f"raise RuntimeError({_sentence(name)!r})"
        if one.public in guarded:
            lines[first.lineno - 1 : first.lineno - 1] = [
                "    import sys as _sys",
                "",
                '    if not _sys._getframe(1).f_globals.get("__name__", "").startswith("course_lib."):',
                f"        {refusal}",
            ]
        else:
            lines[first.lineno - 1 : end] = [f"    {refusal}"]
    return "\n".join(lines)


def _sentence(name: str) -> str:
    return f"{name} is what a task of your lab asks you to write; it is not part of this copy."


def needed(names: Iterable[str], root: Path, sources: Iterable[str]) -> list[str]:
    """Those of some hidden names that modules use themselves, beside defining and re-exporting them."""
    texts = [_uses(source) for source in sources]
    found = []
    for hidden in find_hidden(names, root):
        short = hidden.public.rpartition(".")[2]
        if any(re.search(rf"\b{short}\b", text) for text in texts):
            found.append(hidden.public)
    return found


def _uses(text: str) -> str:
    """A module's code without imports, texts and the names that it defines."""
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise CourseError(f"a module of the course is not Python: {error}") from error
    return " ".join(
        node.id if isinstance(node, ast.Name) else node.attr
        for node in ast.walk(tree)
        if (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)) or isinstance(node, ast.Attribute)
    )
