"""Near-identical answers: a place to look, never a verdict.

Answers are compared as code, not as text: names of the learner's own are numbered in order, texts and comments left
out. Each run of `SPAN` tokens is a fingerprint, of which winnowing keeps the least in every window (Schleimer,
Wilkerson and Aiken, Winnowing: Local Algorithms for Document Fingerprinting, SIGMOD 2003). Fingerprints of the stub are
taken away, and those that many of the class share count for nothing: there are few ways to write a pinhole model.
"""

from __future__ import annotations

import ast
import builtins
import hashlib
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["Pair", "similar_answers"]

SPAN = 7
"""Tokens in a fingerprint: shorter ones are shared by chance."""
WINDOW = 4
SHORTEST = 60
"""Answers of fewer tokens are all alike, and left out."""
COMMON = 0.25
"""A fingerprint that more of the class have, with at least five of them, is a way to write it, not somebody's own."""
ALIKE = 0.8
"""Similarity from which a pair is shown."""


@dataclass(frozen=True)
class Pair:
    """Two answers to one task that share most of what is their own; `share` is between 0 and 1."""

    first: str
    second: str
    share: float


def similar_answers(answers: Mapping[str, str], stub: str = "") -> list[Pair]:
    """Pairs of near-identical answers, the most alike first.

    Parameters
    ----------
    answers : student to source, of one task.
    stub : the source that everybody was given.
    """
    given = set(_prints(_tokens(stub)))
    prints = {}
    for student, source in answers.items():
        tokens = _tokens(source)
        if len(tokens) >= SHORTEST:
            prints[student] = set(_prints(tokens)) - given
    counts = Counter(mark for marks in prints.values() for mark in marks)
    most = max(4, COMMON * len(prints))
    weights = {mark: 0.0 if n > most else 1.0 / math.log2(1 + n) for mark, n in counts.items()}
    own = {student: {mark for mark in marks if weights[mark] > 0} for student, marks in prints.items()}
    holders: dict[int, list[str]] = {}
    for student, marks in own.items():
        for mark in marks:
            holders.setdefault(mark, []).append(student)
    shared: Counter[tuple[str, str]] = Counter()
    for mark, students in holders.items():
        for i, first in enumerate(sorted(students)):
            for second in sorted(students)[i + 1 :]:
                shared[first, second] += weights[mark]
    found = []
    for (first, second), weight in shared.items():
        whole = sum(weights[mark] for mark in own[first] | own[second])
        few = min(len(own[first]), len(own[second])) < 5
        if not few and weight / whole >= ALIKE:
            found.append(Pair(first, second, weight / whole))
    return sorted(found, key=lambda pair: (-pair.share, pair.first, pair.second))


def _tokens(source: str) -> list[str]:
    """The code as words: kinds of nodes and public names; the learner's own names by the order of their appearance."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    own = _own_names(tree)
    order: dict[str, str] = {}
    words: list[str] = []

    def name(text: str) -> str:
        return order.setdefault(text, f"#{len(order)}") if text in own else text

    def walk(node: ast.AST) -> None:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            return
        words.append(type(node).__name__)
        if isinstance(node, ast.Name):
            words.append(name(node.id))
        elif isinstance(node, ast.arg):
            words.append(name(node.arg))
        elif isinstance(node, ast.Attribute):
            words.append(node.attr)
        elif isinstance(node, ast.Constant):
            words.append(repr(node.value)[:40])
        elif isinstance(node, (ast.Load, ast.Store)):
            words.pop()
        for child in ast.iter_child_nodes(node):
            walk(child)

    try:
        walk(tree)
    except RecursionError:
        return []
    return words


def _own_names(tree: ast.AST) -> set[str]:
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.FunctionDef):
            names.add(node.name)
    return names - set(dir(builtins))


def _prints(words: list[str]) -> list[int]:
    """The fingerprints that winnowing keeps."""
    hashes = [
        int.from_bytes(hashlib.blake2b("\0".join(words[i : i + SPAN]).encode(), digest_size=8).digest(), "big")
        for i in range(len(words) - SPAN + 1)
    ]
    if len(hashes) <= WINDOW:
        return hashes
    return list({min(hashes[i : i + WINDOW]) for i in range(len(hashes) - WINDOW + 1)})
