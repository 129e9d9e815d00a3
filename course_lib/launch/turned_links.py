"""Links of what is copied to my_work/, turned so that they lead to the learner's copies and not to what is shipped."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from urllib.parse import quote, unquote

_LINK = re.compile(r"(?P<before>\]\(\s*<?|\b(?:href|src)\s*=\s*[\"'])(?P<to>[^)\s\"'>#]+)")
_NOT_HERE = re.compile(r"[a-z][a-z0-9+.-]*:|/", re.I)  # an address on the web, or a place on this machine


def linked(text: str, folder: Path) -> set[Path]:
    """The files and folders that a text's links name, which lie beside it or at any distance."""
    named = (match["to"] for match in _LINK.finditer(text))
    return {(folder / unquote(to)).resolve() for to in named if not _NOT_HERE.match(to)}


def turned(text: str, original: Path, copy: Path, copies: Mapping[Path, Path]) -> str:
    """A text whose links work from another folder.

    Parameters
    ----------
    original, copy : the file that it stands in, and where it will stand.
    copies : what is copied → where; a link to it leads to the copy, every other link to what it named.
    """

    def turn(match: re.Match[str]) -> str:
        if _NOT_HERE.match(match["to"]):
            return match[0]
        target = (original.parent / unquote(match["to"])).resolve()
        way = Path(os.path.relpath(copies.get(target, target), copy.parent)).as_posix()
        end = "/" if match["to"].endswith("/") else ""
        return match["before"] + quote(way, safe="/()!,'@&=+$~") + end

    return _LINK.sub(turn, text)


def prose(text: str) -> list[str]:
    """The Markdown cells of a notebook's text."""
    cells = json.loads(text)["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown"]


def turned_notebook(text: str, original: Path, copy: Path, copies: Mapping[Path, Path]) -> str:
    """A notebook's text with the links in its prose turned; as it is where none had to be."""
    notebook = json.loads(text)
    changed = False
    for cell in notebook["cells"]:
        if cell["cell_type"] == "markdown":
            source = "".join(cell["source"])  # stored as one text or as a list of lines
            new = turned(source, original, copy, copies)
            if new != source:
                cell["source"], changed = new.splitlines(keepends=True), True
    return json.dumps(notebook, ensure_ascii=False, indent=1, sort_keys=True) + "\n" if changed else text


def linked_pages(notebooks: Iterable[Path], folder: Path) -> list[Path]:
    """The pages of a folder that notebooks link to, and those that these link to."""
    waiting = {
        page for path in notebooks for text in prose(path.read_text("utf-8")) for page in linked(text, path.parent)
    }
    found: set[Path] = set()
    while waiting:
        page = waiting.pop()
        if page.parent == folder.resolve() and page.suffix == ".md" and page.is_file() and page not in found:
            found.add(page)
            waiting |= linked(page.read_text("utf-8"), page.parent)
    return sorted(found)
