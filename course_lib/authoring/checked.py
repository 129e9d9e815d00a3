"""A notebook under examination, and how a finding names its place."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from nbformat import NotebookNode

from .tree import Tree

Kind = Literal["lesson", "solution", "exercise"]


@dataclass(frozen=True)
class Checked:
    """A notebook under examination."""

    nb: NotebookNode
    path: Path
    kind: Kind
    tree: Tree

    @property
    def name(self) -> str:
        return self.tree.relative(self.path)

    def at(self, number: int, message: str) -> str:
        """One finding about one cell."""
        cell = self.nb.cells[number]
        return f"{self.name}: cell {number} ({cell.get('id', 'no id')}): {message}"

    def code(self) -> Iterator[tuple[int, NotebookNode]]:
        return ((n, cell) for n, cell in enumerate(self.nb.cells) if cell.cell_type == "code")

    def prose(self) -> Iterator[tuple[int, NotebookNode]]:
        return ((n, cell) for n, cell in enumerate(self.nb.cells) if cell.cell_type == "markdown")


def allowed(cell: NotebookNode, what: str) -> bool:
    """Whether a cell says `allow WHAT: reason`, in a comment."""
    return re.search(rf"(?:#|<!--)\s*allow {re.escape(what)}:\s*\w", cell.source) is not None
