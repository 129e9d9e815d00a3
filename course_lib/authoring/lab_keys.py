"""No cell of a lab holds a line of a task's solution: compared as syntax trees, whatever the names."""

from __future__ import annotations

import ast
import copy
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from nbformat import NotebookNode

from . import notebooks as nbs
from . import stubs
from .syntax import comments_of, tree_of

FEWEST_STEPS = 2  # operators or calls: fewer are nobody's idea


class _Blank(ast.NodeTransformer):
    """Variables lose their names; functions that are called by name, attributes and constants keep theirs."""

    def visit_Call(self, node: ast.Call) -> ast.Call:
        name = node.func.id if isinstance(node.func, ast.Name) else None
        self.generic_visit(node)
        if name is not None:
            node.func = ast.Name(name, ast.Load())
        return node

    def visit_Name(self, node: ast.Name) -> ast.Name:
        return ast.Name("_", ast.Load())

    def visit_Subscript(self, node: ast.Subscript) -> ast.Subscript:
        self.generic_visit(node)
        node.ctx = ast.Load()  # also where `a[i] += b` is written out
        return node

    def visit_arg(self, node: ast.arg) -> ast.arg:
        return ast.arg("_")


def _form(node: ast.AST) -> str:
    return ast.dump(_Blank().visit(copy.deepcopy(node)))


def _steps(node: ast.AST) -> int:
    """Operators and calls of an expression; a sign before a number is none."""
    count = 0
    for part in ast.walk(node):
        count += isinstance(part, ast.BinOp | ast.Call)
        count += isinstance(part, ast.UnaryOp) and not isinstance(part.operand, ast.Constant)
        count += len(part.values) - 1 if isinstance(part, ast.BoolOp) else 0
        count += len(part.ops) if isinstance(part, ast.Compare) else 0
    return count


def _written_out(tree: ast.AST) -> Iterator[ast.AST]:
    """Every node of a tree, and for `a += b` also `a + b`."""
    for node in ast.walk(tree):
        yield node
        if isinstance(node, ast.AugAssign):
            yield ast.BinOp(node.target, node.op, node.value)


def _lines(statement: ast.AST) -> Iterator[ast.expr]:
    """What a statement computes; of a tuple, list or dict also each of its parts."""
    values: list[ast.expr | None] = []
    if isinstance(statement, ast.AugAssign):
        values = [ast.BinOp(statement.target, statement.op, statement.value)]
    elif isinstance(statement, ast.Assign | ast.AnnAssign | ast.Return | ast.Expr):
        values = [statement.value]
    elif isinstance(statement, ast.If | ast.While | ast.Assert):
        values = [statement.test]
    elif isinstance(statement, ast.For):
        values = [statement.iter]
    for value in values:
        if isinstance(value, ast.Tuple | ast.List):
            values += value.elts
        if isinstance(value, ast.Dict):
            values += value.values
        if value is not None and _steps(value) >= FEWEST_STEPS:
            yield value


@dataclass(frozen=True)
class LabTask:
    """A task cell of a lab's source: the number of its task, and of its cell."""

    number: int
    cell: int
    source: str

    @cached_property
    def statements(self) -> list[ast.stmt]:
        """The statements of its solution."""
        blocks = stubs.solution_blocks(self.source)
        statements = (node for node in ast.walk(tree_of(self.source)) if isinstance(node, ast.stmt))
        return [node for node in statements if any(first < node.lineno <= last for first, last in blocks)]

    @cached_property
    def given(self) -> str:
        """The cell as learners get it."""
        return stubs.exercise_source(self.source, self.number, "", self.number <= stubs.KEPT_PLANS)

    @cached_property
    def secrets(self) -> dict[str, str]:
        """The lines of its solution, by form; where wrong code is to mend, without those that are given with it."""
        found = {_form(value): ast.unparse(value) for node in self.statements for value in _lines(node)}
        given = {_form(node) for node in _written_out(tree_of(self.given))} if stubs.INSTEAD in self.source else set()
        return {form: line for form, line in found.items() if form not in given}


def lab_tasks(nb: NotebookNode) -> list[LabTask]:
    """The tasks of a lab's solution."""
    number_of = {id(cell): n for n, cell in enumerate(nb.cells)}
    return [
        LabTask(task.number, number_of[id(cell)], cell.source)
        for cell, task in nbs.with_tasks(nb.cells)
        if task is not None and "task" in nbs.cell_tags(cell) and stubs.BEGIN in cell.source
    ]


def _said(comment: str) -> Iterator[ast.AST]:
    """The trees of a comment that is code, of what it says after a colon, and of what stands in backticks."""
    texts = [comment, *comment.split(": ")[1:], *re.findall(r"`([^`]+)`", comment)]
    for text in texts:
        yield from _written_out(tree_of(text.strip()))


def told_lines(nb: NotebookNode) -> Iterator[tuple[int, str]]:
    """Lines of solutions that stand elsewhere in a lab: in given code, in a picture's, in another stub, in a comment.

    Parameters
    ----------
    nb : the lab's solution.

    Yields
    ------
    The number of the cell, and the line that it tells.
    """
    tasks = lab_tasks(nb)
    given = {task.cell: task.given for task in tasks}
    for n, cell in enumerate(nb.cells):
        if cell.cell_type != "code":
            continue
        source = given.get(n, cell.source)
        in_code = {_form(node) for node in _written_out(tree_of(source)) if isinstance(node, ast.expr)}
        said = (node for text in comments_of(source) for node in _said(text))
        in_comments = {_form(node) for node in said if isinstance(node, ast.expr)}
        for task in tasks:
            for form, line in task.secrets.items():
                if form in in_code | in_comments:
                    where = "" if form in in_code else " in a comment"
                    yield n, f"it holds a line of task {task.number}'s solution{where}: {line:.70}"
