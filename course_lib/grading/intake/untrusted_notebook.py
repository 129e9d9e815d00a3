"""From bytes that anybody handed in to a notebook that can be worked with; executes nothing, trusts nothing.

Outputs and metadata count for nothing and are dropped. What can still be read is read: another encoding, another
version, a missing id. What cannot is refused in one sentence that says what to do.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import nbformat

__all__ = ["IntakeLimits", "Unreadable", "notebook_of"]


@dataclass(frozen=True)
class IntakeLimits:
    """What is read of a download; each is named in the sentence that refuses."""

    notebook_bytes: int = 20_000_000
    cells: int = 2_000
    code_letters: int = 1_000_000
    depth: int = 100
    things: int = 500_000
    files: int = 20_000
    archive_members: int = 5_000
    archive_bytes: int = 200_000_000
    archive_ratio: int = 200


class Unreadable(Exception):
    """A file of which nothing can be graded: a fixed `code`, and a sentence for people."""

    def __init__(self, code: str, sentence: str) -> None:
        super().__init__(sentence)
        self.code, self.sentence = code, sentence


def notebook_of(data: bytes, limits: IntakeLimits) -> nbformat.NotebookNode:
    """Read a notebook: its code and markdown cells, each with source (str), id (str or "") and tags (list of str).

    Raises
    ------
    Unreadable
        If it is no notebook that can be read within the limits.
    """
    if len(data) > limits.notebook_bytes:
        most = limits.notebook_bytes // 1_000_000
        raise Unreadable(
            "too big", f"the file has {len(data) / 1e6:.0f} MB; a notebook may have {most} (clear outputs)."
        )
    tree = _json(_text(data), limits)
    if not isinstance(tree, dict):
        raise Unreadable("not a notebook", "the file is JSON, but no notebook.")
    cells = tree.get("cells")
    if cells is None and isinstance(tree.get("worksheets"), list):  # nbformat 3
        cells = [cell for sheet in tree["worksheets"] if isinstance(sheet, dict) for cell in _list(sheet.get("cells"))]
    if not isinstance(cells, list):
        raise Unreadable("not a notebook", "the file is JSON, but has no list of cells, so it is no notebook.")
    if len(cells) > limits.cells:
        raise Unreadable("too many cells", f"the notebook has {len(cells)} cells; {limits.cells} is the most.")
    kept = [found for cell in cells if (found := _cell(cell)) is not None]
    if not any(cell["cell_type"] == "code" for cell in kept):
        raise Unreadable("no code", "the notebook has no code cell.")
    letters = sum(len(cell["source"]) for cell in kept if cell["cell_type"] == "code")
    if letters > limits.code_letters:
        sentence = f"the notebook holds {letters:,} letters of code; {limits.code_letters:,} is the most."
        raise Unreadable("too much code", sentence)
    return nbformat.from_dict({"cells": kept, "metadata": {}, "nbformat": 4, "nbformat_minor": 5})


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _text(data: bytes) -> str:
    """The text of a file, in the encodings that editors really write."""
    if not data.strip():
        raise Unreadable("empty", "the file is empty: it was saved or uploaded before it was complete.")
    if data[:2] == b"PK":
        raise Unreadable("not a notebook", "the file is a zip with the name of a notebook.")
    for mark, name in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            return _decoded(data, name)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return _decoded(data, "cp1252")


def _decoded(data: bytes, name: str) -> str:
    try:
        return data.decode(name)
    except UnicodeDecodeError:
        sentence = "the file is no text in UTF-8: save the notebook in JupyterLab and hand that file in."
        raise Unreadable("encoding", sentence) from None


def _json(text: str, limits: IntakeLimits) -> Any:
    start = text.lstrip()[:200].lower()
    if start.startswith(("<!doctype", "<html", "<?xml")):
        raise Unreadable("a web page", "the file is a web page, perhaps of a log-in: download the notebook itself.")
    if text.count("[") + text.count("{") > limits.things and len(_brackets(text)) > 2 * limits.things:
        raise Unreadable("too many things", f"the file holds more than {limits.things:,} lists, as no notebook does.")
    if _depth(text) > limits.depth:
        raise Unreadable("too deep", f"the file is nested more than {limits.depth} deep, as no notebook is.")
    try:
        return json.loads(text, parse_int=_whole, parse_constant=lambda name: None)
    except (json.JSONDecodeError, RecursionError) as error:
        if not start.startswith("{"):
            sentence = "the file is no notebook: hand in the .ipynb file, not a script, a PDF or an export."
            raise Unreadable("not a notebook", sentence) from None
        if "Unterminated" in str(error) or getattr(error, "pos", 0) >= len(text.rstrip()) - 1:
            sentence = "the notebook ends in the middle: it was cut off when it was saved or uploaded."
            raise Unreadable("cut off", sentence) from None
        raise Unreadable("not JSON", f"the notebook is damaged: {str(error)[:120]}.") from None


def _whole(text: str) -> int:
    return int(text) if len(text) < 100 else 0  # thousands of digits take minutes


def _brackets(text: str) -> bytes:
    """The brackets outside of texts; each step is one pass, so that nothing runs out of stack, or of time."""
    plain = text.replace("\\\\", "").replace('\\"', "")  # backslashes stand in texts only
    outside = "".join(plain.split('"')[::2]).encode("utf-8", "replace")
    return outside.translate(None, delete=bytes(set(range(256)) - set(b"[]{}")))


def _depth(text: str) -> int:
    """How deep brackets are nested, outside of texts."""
    depth = deepest = 0
    for bracket in _brackets(text):
        depth += 1 if bracket in b"[{" else -1
        deepest = max(deepest, depth)
    return deepest


def _cell(cell: Any) -> dict[str, Any] | None:
    """A cell with what counts, or None for what is neither code nor text."""
    if not isinstance(cell, dict):
        return None
    kind = cell.get("cell_type")
    source = cell.get("source", cell.get("input", ""))
    if isinstance(source, list):
        source = "".join(part for part in source if isinstance(part, str))
    if kind not in ("code", "markdown") or not isinstance(source, str):
        return None
    metadata = cell.get("metadata")
    tags = _list(metadata.get("tags")) if isinstance(metadata, dict) else []
    name = cell.get("id")
    found = {
        "cell_type": kind,
        "id": name if isinstance(name, str) else "",
        "metadata": {"tags": [tag for tag in tags if isinstance(tag, str)]},
        "source": source.replace("\r\n", "\n").replace("\r", "\n").replace("\0", ""),
    }
    if kind == "code":
        found |= {"outputs": [], "execution_count": None}
    return found
