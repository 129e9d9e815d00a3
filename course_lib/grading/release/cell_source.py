"""A submitted cell as Python: magics taken out, names that it binds and uses, statements with their decorators."""

from __future__ import annotations

import ast
import builtins
import re
import warnings
from collections.abc import Sequence

BUILTINS = frozenset(dir(builtins))


_MARKS = re.compile(r"""\\.|\'{3}|"{3}|['"#()\[\]{}]""", re.S)
RUNS = ("%%time", "%%timeit", "%%capture", "%%prun")
"""Magics of a whole cell under which it is run as Python."""


def plain_python(source: str) -> str:
    """A cell without what only a notebook understands: magics, `!` and `?`. Each line stays in its place.

    It is read once, line by line: IPython reads a cell anew for each magic.
    """
    if parse(source)[0] is not None:
        return source
    lines = source.split("\n")
    first = next((i for i, line in enumerate(lines) if line.strip()), 0)
    if lines[first].startswith("%%"):
        if lines[first].split()[0] not in RUNS:
            return "\n".join(f"# {line}" for line in lines)
        lines[first] = f"# {lines[first]}"
    quotes, depth, goes_on, magic = "", 0, False, False
    for i, line in enumerate(lines):
        if not (quotes or depth or goes_on) or magic:
            lines[i] = f"# {line}" if magic else _without_magic(line)
        magic = lines[i] != line and line.endswith("\\")
        quotes, depth = _after(lines[i], quotes, depth)
        goes_on = line.endswith("\\")
    return "\n".join(lines)


def _without_magic(line: str) -> str:
    """A line at which a statement begins; what is a magic becomes a comment, what it gives to a name is None."""
    text = line.strip()
    indent = line[: len(line) - len(line.lstrip())]
    asks = text.endswith("?") and text.rstrip("?").replace(".", "").isidentifier()
    if text[:1] in ("%", "!", "?") or asks:
        return f"{indent}pass  # {text}" if indent else f"# {text}"
    left, _, right = line.partition("=")
    return f"{left}= None  #{right}" if right.lstrip()[:1] in ("%", "!") and left.strip() else line


def _after(line: str, quotes: str, depth: int) -> tuple[str, int]:
    """The quotes of the text and the depth of the brackets that go on after a line."""
    for match in _MARKS.finditer(line):
        mark = match[0]
        if quotes:
            quotes = "" if mark.startswith(quotes) else quotes
        elif mark == "#":
            break
        elif mark[0] in "'\"":
            quotes = mark
        elif mark in "([{":
            depth += 1
        elif mark in ")]}":
            depth = max(0, depth - 1)
    return (quotes if len(quotes) == 3 else ""), depth


def parse(source: str) -> tuple[ast.Module | None, str]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a learner's "\d" is no trouble of ours
            return ast.parse(source), ""
    except SyntaxError as error:
        return None, f"{type(error).__name__}: {error.msg} (line {error.lineno} of the cell)"
    except (ValueError, RecursionError, MemoryError) as error:
        return None, f"it is not Python: {type(error).__name__}"


def normal(tree: ast.AST) -> str:
    try:
        return ast.dump(tree)
    except RecursionError:
        return str(id(tree))


def bound(statement: ast.stmt) -> set[str]:
    """The names that a top-level statement gives a value."""
    names: set[str] = set()
    waiting: list[ast.AST] = [statement]
    while waiting:
        node = waiting.pop()
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            names.add(node.name)
            continue
        if isinstance(node, (ast.Lambda, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)):
            continue
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names |= {(alias.asname or alias.name).split(".")[0] for alias in node.names}
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.ExceptHandler) and node.name:
            names.add(node.name)
        waiting += ast.iter_child_nodes(node)
    return names


def imported(tree: ast.AST) -> set[str]:
    """The modules that are imported, and the names from modules, with dots."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def used(statement: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(statement) if isinstance(node, ast.Name)} - BUILTINS


def with_decorators(lines: Sequence[str], statement: ast.stmt) -> str:
    first = min([statement.lineno, *(d.lineno for d in getattr(statement, "decorator_list", []))])
    return "\n".join(lines[first - 1 : statement.end_lineno])
