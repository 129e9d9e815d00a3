"""Links and images in prose: that what they point to is there."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import nbformat

_CODE = re.compile(r"```.*?```|`[^`\n]*`", re.S)
_LINK = re.compile(
    r"(?P<image>!?)\[(?P<text>(?:[^\[\]]|\[[^\]]*\])*)\]\(\s*<?(?P<to>[^)\s>]*)>?(?:\s+\"[^\"]*\")?\s*\)"
)
_HTML = re.compile(r"<(?:a|img)\b[^>]*?\b(?:href|src)\s*=\s*[\"'](?P<to>[^\"']*)[\"']", re.I)
_IMG = re.compile(r"<img\b[^>]*>", re.I)
_ELSEWHERE = re.compile(r"^(?:[a-z][a-z0-9+.-]*:|//)", re.I)


def images_without_alt(markdown: str) -> list[str]:
    """The images of a text that say nothing to someone who cannot see them."""
    text = _CODE.sub("", markdown)
    silent = [m["to"] for m in _LINK.finditer(text) if m["image"] and not m["text"].strip()]
    silent += [tag[:60] for tag in _IMG.findall(text) if not re.search(r"\balt\s*=\s*([\"'])\s*(?!\1)\S", tag)]
    return silent


def anchors(markdown: str) -> set[str]:
    """Every anchor that a text offers: ids written in HTML, and its headings as GitHub and as Jupyter call them."""
    found = set(re.findall(r"<\w+[^>]*?\b(?:id|name)\s*=\s*[\"']([^\"']+)[\"']", markdown))
    for heading in re.findall(r"^#{1,6}\s+(.+?)\s*#*$", re.sub(r"```.*?```", "", markdown, flags=re.S), re.M):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|[*`]", r"\1", heading).strip()
        found |= {re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-"), plain.replace(" ", "-")}
    return found


@lru_cache(maxsize=256)
def _anchors_of(path: Path, _changed: int) -> frozenset[str]:
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = nbformat.reads(text, as_version=4).cells
        text = "\n\n".join(cell.source for cell in cells if cell.cell_type == "markdown")
    return frozenset(anchors(text))


def _is_address(target: str) -> bool:
    """Whether this could be an address on the web or of a mailbox, by its form alone."""
    try:
        parts = urlsplit(target)
        host = parts.hostname or ""
    except ValueError:
        return False
    if parts.scheme == "mailto":
        return re.fullmatch(r"[^@\s]+@[^@\s]+\.\w+", parts.path) is not None
    return parts.scheme in ("http", "https", "") and re.fullmatch(r"([\w-]+\.)+\w{2,}|localhost", host) is not None


def dead_links(markdown: str, folder: Path, own_anchors: set[str]) -> list[str]:
    """The links and images of a text that lead nowhere; addresses on the web are looked at and not visited.

    Parameters
    ----------
    markdown : the text of one cell, or of a page.
    folder : the folder that relative links start from.
    own_anchors : the anchors of the whole notebook or page.
    """
    text = _CODE.sub("", markdown)
    targets = [m["to"] for m in _LINK.finditer(text)] + [m["to"] for m in _HTML.finditer(text)]
    dead = []
    for target in targets:
        if _ELSEWHERE.match(target):
            dead += [] if _is_address(target) else [f"{target} is no address"]
            continue
        name, _, anchor = unquote(target).partition("#")
        path = (folder / name).resolve()
        if not name:
            if anchor not in own_anchors:
                dead.append(f"{target} is no heading here")
        elif not path.exists():
            dead.append(f"{target} is not there")
        elif anchor and path.suffix in (".md", ".ipynb"):
            if anchor not in _anchors_of(path, path.stat().st_mtime_ns):
                dead.append(f"{target}: {path.name} has no such heading")
    return dead
