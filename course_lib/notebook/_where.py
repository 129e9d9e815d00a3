"""Where a lesson's sections lie, as links that work from my_work/ and from the shipped notebooks alike."""

from __future__ import annotations

import functools
import html
import json
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_NAMED = re.compile(
    r"lesson (?P<lesson>\d\d)"
    r"(?:, (?:sections? (?P<section>\d)|(?P<part>Break it|On real data|Key points|Going further)))?"
)


@functools.cache
def _headings(path: Path, _changed: int) -> tuple[str, ...]:
    """The second-level headings of a stored notebook, in order."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    prose = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return tuple(re.findall(r"^## +(.+?) *$", prose, re.M))


def heading_of(path: Path, section: str | None, part: str | None) -> str:
    """The heading of a section ("2" → "2 Depth is z, not range") or of a named part; "" where there is none."""
    wanted = f"{section} " if section else part
    found = _headings(path, path.stat().st_mtime_ns) if wanted else ()
    return next((heading for heading in found if heading.startswith(wanted)), "")


def named(text: str) -> list[tuple[str, Path | None, str]]:
    """Each place that a text names ("lesson 03, section 2"), the stored lesson (None: not here), and its heading."""
    return [(match[0], *_place(match)) for match in _NAMED.finditer(text)]


def _place(match: re.Match[str]) -> tuple[Path | None, str]:
    path = next(iter(sorted((ROOT / "notebooks").glob(f"{match['lesson']}_*.ipynb"))), None)
    return path, heading_of(path, match["section"], match["part"]) if path else ""


def _beside() -> str:
    """The folder of lessons, from that of the notebook which is running: it runs where it lies."""
    return "../lessons" if Path.cwd().is_relative_to(ROOT / "my_work") else "../notebooks"


def with_links(text: str) -> str:
    """A text as HTML in which each place of a lesson that it names is a link to that lesson."""

    def link(match: re.Match[str]) -> str:
        path, heading = _place(match)
        if path is None:
            return match[0]
        anchor = "#" + html.escape(heading.replace(" ", "-")) if heading else ""  # as JupyterLab calls headings
        return f'<a href="{_beside()}/{path.name}{anchor}">{match[0]}</a>'

    return _NAMED.sub(link, html.escape(text))
