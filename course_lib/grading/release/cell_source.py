"""A submitted cell as Python: magics taken out, names that it binds and uses, statements with their decorators."""

from __future__ import annotations

import ast
import builtins
import warnings
from collections.abc import Sequence

from IPython.core.inputtransformer2 import TransformerManager

MOST_MAGICS = 50
"""A cell with more magics, or longer than MOST_LETTERS, loses whole lines of them: IPython reads it anew for each."""
MOST_LETTERS = 20_000
BUILTINS = frozenset(dir(builtins))


def plain_python(source: str) -> str:
    """A cell without what only a notebook understands, as far as it stood outside the answer: magics, `!` and `?`."""
    if parse(source)[0] is not None:
        return source
    lines = source.split("\n")
    first = next((i for i, line in enumerate(lines) if line.strip()), 0)
    if lines[first].startswith("%%"):
        if lines[first].split()[0] not in ("%%time", "%%timeit", "%%capture", "%%prun"):
            return "\n".join(f"# {line}" for line in lines)
        lines[first] = f"# {lines[first]}"
    magics = sum(line.lstrip()[:1] in ("%", "!", "?") or line.rstrip()[-1:] == "?" for line in lines)
    if magics > MOST_MAGICS or len(source) > MOST_LETTERS:
        return "\n".join(f"# {line}" if line.lstrip()[:1] in ("%", "!", "?") else line for line in lines)
    try:
        text = TransformerManager().transform_cell("\n".join(lines))
    except Exception:  # IPython's own parser, on what anybody wrote
        return "\n".join(lines)
    tree = parse(text)[0]
    if tree is None:
        return "\n".join(lines)
    told = text.split("\n")
    for statement in tree.body:
        if isinstance(statement, ast.Expr) and _is_magic(statement.value):
            for i in range(statement.lineno - 1, statement.end_lineno or statement.lineno):
                told[i] = f"# {told[i]}"
    return "\n".join(told)


def _is_magic(node: ast.AST) -> bool:
    """Whether an expression is `get_ipython().…`, which IPython makes of a magic."""
    while isinstance(node, (ast.Attribute, ast.Call)):
        inner = node.func if isinstance(node, ast.Call) else node.value
        if isinstance(node, ast.Attribute) and isinstance(inner, ast.Call) and isinstance(inner.func, ast.Name):
            return inner.func.id == "get_ipython"
        node = inner
    return False


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
