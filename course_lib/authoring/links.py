"""Links and images in prose: that what they point to is there."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import nbformat

__all__ = ["anchors", "dead_links", "images_without_alt"]

_CODE = re.compile(r"```.*?```|`[^`\n]*`", re.S)
_LINK = re.compile(
    r"(?P<image>!?)\[(?P<text>(?:[^\[\]]|\[[^\]]*\])*)\]\(\s*<?(?P<to>[^)\s>]*)>?(?:\s+\"[^\"]*\")?\s*\)"
)
_HTML = re.compile(r"<(?:a|img)\b[^>]*?\b(?:href|src)\s*=\s*[\"'](?P<to>[^\"']*)[\"']", re.I)
_IMG = re.compile(r"<img\b[^>]*>", re.I)
_ELSEWHERE = re.compile(r"^(?:[a-z][a-z0-9+.-]*:|//)", re.I)


def _without_code(markdown: str) -> str:
    return _CODE.sub("", markdown)


def images_without_alt(markdown: str) -> list[str]:
    """The images of a text that say nothing to someone who cannot see them."""
    text = _without_code(markdown)
    silent = [m["to"] for m in _LINK.finditer(text) if m["image"] and not m["text"].strip()]
    silent += [tag[:60] for tag in _IMG.findall(text) if not re.search(r"\balt\s*=\s*([\"'])\s*(?!\1)\S", tag)]
    return silent


def slugs(heading: str) -> set[str]:
    """What a heading is called in a link: on GitHub (small letters) and in Jupyter (as written)."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|[*`]", r"\1", heading).strip()
    github = re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")
    return {github, plain.replace(" ", "-")}


def anchors(markdown: str) -> set[str]:
    """Every anchor that a text offers: its headings, and ids written in HTML."""
    found = set(re.findall(r"<\w+[^>]*?\b(?:id|name)\s*=\s*[\"']([^\"']+)[\"']", markdown))
    for heading in re.findall(r"^#{1,6}\s+(.+?)\s*#*$", re.sub(r"```.*?```", "", markdown, flags=re.S), re.M):
        found |= slugs(heading)
    return found


def _text_of(path: Path) -> str:
    if path.suffix == ".ipynb":
        nb = nbformat.reads(path.read_text(encoding="utf-8"), as_version=4)
        return "\n\n".join(cell.source for cell in nb.cells if cell.cell_type == "markdown")
    return path.read_text(encoding="utf-8")


@lru_cache(maxsize=256)
def _anchors_of(path: Path, _changed: int) -> frozenset[str]:
    return frozenset(anchors(_text_of(path)))


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
    text = _without_code(markdown)
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
