"""A name means one thing in a notebook: a cell can be run again after any later one, and finds its names unchanged."""

from __future__ import annotations

import ast
import symtable
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal

from nbformat import NotebookNode

from . import notebooks as nbs
from .parts import Part, parts_of
from .syntax import python_of, tree_of

EXCEPTED = {"rng", "_"}
Event = Literal["read", "bind", "pass"]  # "pass": bound by a loop, an import or an except

_COMPREHENSIONS = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp
_FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef


def _targets(node: ast.AST) -> list[str]:
    """The names that a target binds: of `(a, b[i])` a."""
    return [part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)]


def _each(nodes: Iterable[ast.AST | None], own: frozenset[str]) -> Iterator[tuple[Event, str]]:
    for node in nodes:
        if node is not None:
            yield from _events(node, own)


def _events(node: ast.AST, own: frozenset[str] = frozenset()) -> Iterator[tuple[Event, str]]:
    """What code outside functions does with global names, in the order in which it happens.

    Parameters
    ----------
    own : names that are local where the node stands: of a comprehension or a class.
    """
    if isinstance(node, ast.Name):
        if node.id not in own:
            yield "read" if isinstance(node.ctx, ast.Load) else "bind", node.id
    elif isinstance(node, ast.Assign):
        yield from _each((node.value, *node.targets), own)
    elif isinstance(node, ast.AnnAssign):
        yield from _each((node.value, node.target) if node.value else (), own)
    elif isinstance(node, ast.AugAssign):
        yield from (("read", name) for name in _targets(node.target) if name not in own)
        yield from _each((node.value, node.target), own)
    elif isinstance(node, ast.For | ast.AsyncFor):
        yield from _events(node.iter, own)
        yield from (("pass", name) for name in _targets(node.target) if name not in own)
        yield from _each((*node.body, *node.orelse), own)
    elif isinstance(node, _COMPREHENSIONS):
        yield from _events(node.generators[0].iter, own)
        inner = own | {name for part in node.generators for name in _targets(part.target)}
        yield from _each(ast.iter_child_nodes(node), inner)
    elif isinstance(node, _FUNCTIONS):
        yield from _each((*node.decorator_list, *node.args.defaults, *node.args.kw_defaults), own)
        yield from [("bind", node.name)] if node.name not in own else []
    elif isinstance(node, ast.Lambda):
        yield from _each((*node.args.defaults, *node.args.kw_defaults), own)
    elif isinstance(node, ast.ClassDef):
        yield from _each((*node.decorator_list, *node.bases, *node.keywords), own)
        inner = own | {name for part in node.body for event, name in _events(part) if event != "read"}
        yield from _each(node.body, inner)
        yield "bind", node.name
    elif isinstance(node, ast.Import | ast.ImportFrom):
        yield from (("pass", (alias.asname or alias.name).partition(".")[0]) for alias in node.names)
    else:
        if isinstance(node, ast.ExceptHandler) and node.name:
            yield "pass", node.name
        yield from _each(ast.iter_child_nodes(node), own)


@dataclass
class Names:
    """What a cell does with global names.

    Attributes
    ----------
    bound : all that it binds.
    lasting : what of these is no import and no loop variable.
    read : what it reads before it has bound it, or in a function without ever binding it.
    functions : what each function that it defines reads.
    """

    bound: set[str] = field(default_factory=set)
    lasting: set[str] = field(default_factory=set)
    read: set[str] = field(default_factory=set)
    functions: dict[str, set[str]] = field(default_factory=dict)


def _read_inside(table: symtable.SymbolTable) -> set[str]:
    """The global names that a function, and what is defined in it, reads."""
    own = {symbol.get_name() for symbol in table.get_symbols() if symbol.is_global() and symbol.is_referenced()}
    return own.union(*map(_read_inside, table.get_children()))


def names_of(source: str) -> Names:
    """What a cell does with global names; nothing where it is no Python."""
    names, tree = Names(), tree_of(source)
    for event, name in _events(tree):
        if event == "read":
            names.read |= {name} - names.bound
        else:
            names.bound.add(name)
            names.lasting |= {name} if event == "bind" else set()
    for table in symtable.symtable(python_of(source), "cell", "exec").get_children() if tree.body else ():
        inside = _read_inside(table)
        names.read |= inside - names.bound
        if table.get_type() == "function":
            names.functions.setdefault(table.get_name(), set()).update(inside)
    return names


@dataclass(frozen=True)
class _Cell:
    number: int
    part: int  # the number of its part
    names: Names
    reads: frozenset[str]  # also in functions of other cells that it calls


def _with_called(names: Names, functions: dict[str, set[str]]) -> frozenset[str]:
    """What a cell reads, also in the functions of other cells that it names."""
    found, new = set(names.read), set(names.read)
    while new:
        new = set().union(*(functions.get(name, ()) for name in new)) - found - names.bound
        found |= new
    return frozenset(found)


def _cells(nb: NotebookNode, parts: list[Part]) -> list[_Cell]:
    number_of = {id(cell): n for n, cell in enumerate(nb.cells)}
    found = [(number_of[id(cell)], n, names_of(cell.source)) for n, part in enumerate(parts) for cell in part.code]
    functions: dict[str, set[str]] = {}
    for _, _, names in found:
        for name, inside in names.functions.items():
            functions.setdefault(name, set()).update(inside)
    return [_Cell(n, part, names, _with_called(names, functions)) for n, part, names in found]


def second_meanings(nb: NotebookNode) -> Iterator[tuple[int, str]]:
    """Names that a section binds although a cell of an earlier one reads them without having bound them.

    Yields
    ------
    The number of the cell that first binds such a name anew, and what is wrong with it; one for each name.
    """
    parts = parts_of(nb)
    cells = _cells(nb, parts)
    excepted = EXCEPTED.union(*map(_asked_of_learners, nb.cells))
    for name in sorted(set().union(*(cell.names.lasting for cell in cells)) - excepted):
        readers = [cell for cell in cells if name in cell.reads]
        again = [cell for cell in cells if name in cell.names.lasting and readers and cell.part > readers[0].part]
        if again:
            first, then = parts[readers[0].part].heading, parts[again[0].part].heading
            before = [cell for cell in readers if cell.part < again[-1].part]
            others = f", {_numbers(again[1:])}" if again[1:] else ""
            yield again[0].number, f"`{name}` is bound anew in “{then}”{others}; from “{first}” on {_read(before)} it"


def _numbers(cells: list[_Cell]) -> str:
    return f"cell{'s' if len(cells) > 1 else ''} {', '.join(str(cell.number) for cell in cells)}"


def _read(cells: list[_Cell]) -> str:
    return f"{_numbers(cells)} read{'s' if len(cells) == 1 else ''}"


def _asked_of_learners(cell: NotebookNode) -> set[str]:
    """The functions that a task asks for."""
    return set(names_of(cell.source).functions) if "task" in nbs.cell_tags(cell) else set()
