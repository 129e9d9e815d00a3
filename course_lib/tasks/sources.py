"""Reading an answer's source for calls that the task does not allow: the kind message, not the lock.

The lock is that a grader removes the modules of `Task.hides` from what can be imported.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from types import FunctionType, ModuleType
from typing import Any

from course_lib.tasks.core import HARMLESS, LIBRARY, Task


def forbidden(task: Task, function: Callable[..., Any]) -> str:
    """One sentence if a function, or one of the notebook's that it calls, uses what the task does not allow.

    Returns
    -------
    The sentence; "" if nothing was found, or if the source cannot be read.
    """
    return _sentence(task, list(dict.fromkeys(_used(function, set()))))


def forbidden_in_text(task: Task, source: str, given: str = "", apart: tuple[str, ...] = ()) -> str:
    """The same of code that nobody has run: the answer's functions and the functions of the text that they call.

    Parameters
    ----------
    source : the learner's code, helpers and all.
    given : the lab's own code before it, for its imports.
    apart : modules that are nobody's answer, such as what draws.
    """
    try:
        body = ast.parse(source).body
        imported = dict(_imports(ast.parse(given))) | dict(_imports(ast.Module(body, [])))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ""
    functions = {node.name: node for node in body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    values = {
        target.id: node
        for node in body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    parts = {**values, **functions}
    names: list[str] = []
    seen: set[str] = set()
    waiting = [task.function]
    while waiting:
        name = waiting.pop()
        if name in seen or name not in parts:
            continue
        seen.add(name)
        tree = parts[name]
        inside = dict(_imports(tree))
        names += inside.values()
        for root, chain in _chains(tree):
            if root in parts:
                waiting.append(root)
            elif root in imported or root in inside:
                names.append(".".join([{**imported, **inside}[root], *chain]))
    return _sentence(task, [name for name in dict.fromkeys(names) if not any(_within(name, free) for free in apart)])


def _shown(name: str) -> str:
    """A name as lessons write it: transforms.invert for course_lib.geometry.transforms.invert."""
    return re.sub(rf"^course_lib\.(?:(?:{'|'.join(LIBRARY)})\.)?", "", name)


def _sentence(task: Task, names: list[str]) -> str:
    allowed = ", ".join(task.may_call) or "plain Python"
    for name in names:
        if any(_within(name, hidden) for hidden in task.hides):
            return (
                f"Task {task.number} asks you to write it yourself: {_shown(name)} is the answer; "
                f"allowed here: {allowed}."
            )
    for name in names:
        if not any(_within(name, module) for module in (*task.may_call, *HARMLESS)):
            return f"Task {task.number} does not take {_shown(name)}; allowed here: {allowed}."
    return ""


def _within(name: str, outer: str) -> bool:
    return name == outer or name.startswith(outer + ".")


def _used(function: Callable[..., Any], seen: set[int]) -> Iterator[str]:
    """The dotted names of what a function mentions of other modules: 'course_lib.camera.pinhole.deproject'."""
    if not isinstance(function, FunctionType) or id(function) in seen:
        return
    seen.add(id(function))
    try:
        tree: ast.AST = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, SyntaxError):
        return
    if function.__name__ == "<lambda>":  # its source is the whole line that it stands on
        lambdas = [node for node in ast.walk(tree) if isinstance(node, ast.Lambda)]
        if len(lambdas) != 1:
            return
        tree = lambdas[0]
    imported = dict(_imports(tree))
    yield from imported.values()
    local = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    local |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    for root, chain in _chains(tree):
        if root in imported:
            yield ".".join([imported[root], *chain])
        elif root not in local and root in function.__globals__:
            thing = function.__globals__[root]
            if isinstance(thing, FunctionType) and thing.__globals__ is function.__globals__:
                yield from _used(thing, seen)
            else:
                yield from _names(thing, chain)


def _imports(tree: ast.AST) -> Iterator[tuple[str, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield (
                    (alias.asname or alias.name.split(".")[0]),
                    (alias.name if alias.asname else alias.name.split(".")[0]),
                )
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                yield (alias.asname or alias.name), f"{node.module or ''}.{alias.name}"


def _hints(tree: ast.AST) -> set[int]:
    """The nodes of type hints: naming a type is no call."""
    found: set[int] = set()
    for node in ast.walk(tree):
        for hint in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            if isinstance(hint, ast.AST):
                found |= {id(part) for part in ast.walk(hint)}
    return found


def _chains(tree: ast.AST) -> Iterator[tuple[str, list[str]]]:
    """Each a.b.c of a tree as ("a", ["b", "c"]), the longest only; type hints are left out."""
    inner = _hints(tree)
    for node in ast.walk(tree):
        if id(node) in inner or not isinstance(node, (ast.Name, ast.Attribute)):
            continue
        chain: list[str] = []
        while isinstance(node, ast.Attribute):
            chain.insert(0, node.attr)
            node = node.value
            inner.add(id(node))
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            yield node.id, chain


def _names(thing: Any, chain: list[str]) -> Iterator[str]:
    """The name of what a chain of attributes reaches: as it was written, or where it was defined."""
    if isinstance(thing, ModuleType):
        while chain and isinstance(getattr(thing, chain[0], None), ModuleType):
            thing, chain = getattr(thing, chain[0]), chain[1:]
        yield ".".join([thing.__name__, *chain])
    elif callable(thing) and getattr(thing, "__module__", None) not in (None, "__main__", "builtins"):
        yield ".".join([thing.__module__, getattr(thing, "__qualname__", type(thing).__name__), *chain])
