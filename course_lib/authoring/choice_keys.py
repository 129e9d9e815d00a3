"""The key of a task "which mistake made this?" stands nowhere in its lab, in plain or in order."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass

from nbformat import NotebookNode

from . import notebooks as nbs
from .lab_keys import LabTask, lab_tasks
from .syntax import tree_of

FEWEST_CHOICES = 3
SHUFFLES = ("permutation", "permuted", "shuffle", "sample")


@dataclass(frozen=True)
class Key:
    """The answer to a choice task: its letters in order, and the cause of each."""

    task: LabTask
    causes: dict[str, str]

    @property
    def letters(self) -> list[str]:
        return list(self.causes)


def _text(node: ast.AST | None) -> str | None:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def _texts(node: ast.AST) -> list[str | None]:
    """The items of a written list or tuple; of a text its letters; of `list("ABC")` too."""
    if isinstance(node, ast.List | ast.Tuple | ast.Set):
        return [_text(item) for item in node.elts]
    if isinstance(node, ast.Call) and len(node.args) == 1:
        return _texts(node.args[0])
    return list(_text(node) or "")


def keys_of(nb: NotebookNode) -> list[Key]:
    """The keys of a lab's solution: what a task returns that is a dict of texts by single letters."""
    found = []
    for task in lab_tasks(nb):
        returned = [node.value for node in task.statements if isinstance(node, ast.Return)]
        for value in returned:
            if isinstance(value, ast.Dict) and len(value.keys) >= FEWEST_CHOICES:
                pairs = [(_text(letter), _text(cause)) for letter, cause in zip(value.keys, value.values, strict=True)]
                if all(letter and cause and len(letter) == 1 for letter, cause in pairs):
                    found.append(Key(task, dict(sorted(pairs))))
    return found


def _tells_by_letter(node: ast.Dict, key: Key) -> bool:
    """Whether a dict says what each letter was made of: not where all are taken from one store in the same way."""
    said = {_text(name): value for name, value in zip(node.keys, node.values, strict=True)}
    values = [(letter, said[letter]) for letter in key.letters if letter in said]
    ways = {ast.dump(value).replace(repr(letter), "LETTER") for letter, value in values}
    made = [value for _, value in values if not isinstance(value, ast.Constant) or value.value in key.causes.values()]
    return len(made) > 1 and len(ways) > 1


def _tells_by_cause(node: ast.Dict, key: Key) -> bool:
    """Whether a dict from causes names their letters."""
    said = {_text(name): _text(value) for name, value in zip(node.keys, node.values, strict=True)}
    return any(said.get(cause) == letter for letter, cause in key.causes.items())


def _in_order(items: list[str | None], key: Key) -> bool:
    """Whether the causes among some items stand in the order of their letters."""
    told = [item for item in items if item in key.causes.values()]
    wanted = [cause for cause in key.causes.values() if cause in told]
    return len(told) >= max(FEWEST_CHOICES, len(key.letters) - 1) and told == wanted


def _is_order(node: ast.AST, key: Key) -> bool:
    """Whether letters, or numbers from 0 or 1, are written down in another order than their own."""
    if not isinstance(node, ast.List | ast.Tuple | ast.Constant):
        return False
    items = [item.value if isinstance(item, ast.Constant) else None for item in getattr(node, "elts", ())]
    if len(items) == len(key.letters) and all(type(item) is int for item in items):
        return min(items) in (0, 1) and items != sorted(items) and len(set(items)) == max(items) - min(items) + 1
    texts = _texts(node)
    return None not in texts and texts != key.letters and sorted(texts) == key.letters


def _draws_order(node: ast.AST, key: Key) -> bool:
    """Whether a call shuffles as many things as there are letters."""
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute) or node.func.attr not in SHUFFLES:
        return False
    count = node.args[0].value if node.args and isinstance(node.args[0], ast.Constant) else None
    return count in (None, len(key.letters)) if node.func.attr == "permutation" else True


def _pairs_made(node: ast.AST, key: Key, made: dict[str, int]) -> bool:
    """Whether `zip` lays letters beside things that are made here one by one.

    Parameters
    ----------
    made : how many items the written lists of this cell have, by name.
    """
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name) or node.func.id != "zip":
        return False
    others = [arg for arg in node.args if _texts(arg) != key.letters]
    sizes = [len(arg.elts) if hasattr(arg, "elts") else made.get(getattr(arg, "id", ""), 0) for arg in others]
    return len(others) < len(node.args) and max(sizes, default=0) >= len(key.letters)


def _written_lists(tree: ast.Module) -> dict[str, int]:
    """How many items the lists have that a cell writes out, by name."""
    return {
        target.id: len(node.value.elts)
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.List | ast.Tuple)
        for target in node.targets
        if isinstance(target, ast.Name)
    }


def _in_code(tree: ast.Module, key: Key, near: bool) -> Iterator[str]:
    """How code tells a key; `near`: in the part of the task itself."""
    made = _written_lists(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Dict):
            if _tells_by_letter(node, key):
                yield "a dict says what each letter is"
            if _tells_by_cause(node, key):
                yield "a dict says which letter each cause is"
            if _in_order([_text(name) for name in node.keys], key):
                yield "the causes stand in the order of the letters"
        if isinstance(node, ast.List | ast.Tuple | ast.Set) and _in_order(_texts(node), key):
            yield "the causes stand in the order of the letters"
        if near and _is_order(node, key):
            yield "an order is written down"
        if near and _draws_order(node, key):
            yield "the order is drawn here, and whoever runs it has it"
        if near and _pairs_made(node, key, made):
            yield "the letters are laid beside what is made for each"


def _in_text(text: str, key: Key) -> Iterator[str]:
    """How prose tells a key."""
    for letter, cause in key.causes.items():
        if re.search(rf"[\"']{letter}[\"']\s*:\s*[\"']{re.escape(cause)}[\"']", text):
            yield f"it says what {letter} is"
    places = [text.find(f'"{cause}"') for cause in key.causes.values()]
    if min(places) >= 0 and places == sorted(places):
        yield "it lists the causes in the order of the letters"


def told_keys(nb: NotebookNode) -> Iterator[tuple[int, str]]:
    """Cells of a lab's solution, other than the answers, that tell the key of a choice task.

    Yields
    ------
    The number of the cell, and how it tells it.
    """
    for key in keys_of(nb):
        for n, (cell, task) in enumerate(nbs.with_tasks(nb.cells)):
            near = task is not None and task.number == key.task.number
            if cell.cell_type == "markdown":
                ways = _in_text(cell.source, key) if near else iter(())
            else:
                source = key.task.given if n == key.task.cell else cell.source
                ways = _in_code(tree_of(source), key, near)
            for way in dict.fromkeys(ways):
                yield n, f"it tells the key of task {key.task.number}: {way}; draw pictures from stored arrays"
