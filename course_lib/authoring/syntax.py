"""The code of a cell as Python reads it: IPython's magics are taken for one statement each."""

from __future__ import annotations

import ast
import io
import re
import tokenize

_MAGIC = re.compile(r"^(\s*)(?:[%!].*|[\w.]+\?{1,2}\s*)$", re.M)


def python_of(source: str) -> str:
    """A cell's code with `pass` for each magic, on the same lines; a cell of another language becomes one `pass`."""
    return "pass" if source.lstrip().startswith("%%") else _MAGIC.sub(r"\1pass", source)


def tree_of(source: str) -> ast.Module:
    """The syntax tree of a cell; an empty one where it is no Python (a cell may show that error)."""
    try:
        return ast.parse(python_of(source))
    except SyntaxError:
        return ast.Module([], [])


def logical_lines(source: str) -> list[int]:
    """The physical line, from 1, on which each logical line ends that is neither blank nor comment."""
    text = python_of(source)
    try:
        tokens = list(tokenize.generate_tokens(io.StringIO(text + "\n").readline))
    except (tokenize.TokenError, SyntaxError):
        lines = enumerate(map(str.strip, text.splitlines()), start=1)
        return [number for number, line in lines if line and not line.startswith("#")]
    return [token.start[0] for token in tokens if token.type == tokenize.NEWLINE]


def comments_of(source: str) -> list[str]:
    """The texts of a cell's comments, without their `#`."""
    try:
        tokens = list(tokenize.generate_tokens(io.StringIO(python_of(source) + "\n").readline))
    except (tokenize.TokenError, SyntaxError):
        return []
    return [token.string.lstrip("# ") for token in tokens if token.type == tokenize.COMMENT]
