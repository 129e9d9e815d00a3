"""Links that lead somewhere, links that do not, images that say nothing."""

from __future__ import annotations

from pathlib import Path

import pytest
from tracked_files import ROOT, tracked

from course_lib.authoring.links import anchors, dead_links, images_without_alt

FIXTURES = Path(__file__).parent / "fixtures"
FOLDER = FIXTURES / "tree" / "notebooks"
WORDS = ROOT / "docs" / "glossary"  # parts of docs/glossary.md: their links start from there, and are read there
PAGES = sorted(
    {*ROOT.glob("*.md"), *(ROOT / "datasets").glob("*.md")}
    | {path for name in ("docs", "solutions") for path in (ROOT / name).rglob("*.md") if path.parent != WORDS}
)


@pytest.mark.parametrize(
    "text",
    [
        "[a pixel](../docs/glossary.md#pixel)",
        "[the glossary](../docs/glossary.md)",
        "[a lab](../exercises/01_tiny.ipynb)",
        "[this part](01_tiny.ipynb#1-One-idea) and [the same](01_tiny.ipynb#1-one-idea)",
        "[here](#2-Own)",
        "[the web](https://example.org/none.md#x), [mail](mailto:a@example.org), [here](http://localhost:8888/lab)",
        "`[code](none.md)` and\n```\n![x](none.png)\n```",
        '<a href="../docs/glossary.md">words</a>',
    ],
)
def test_living_links(text: str) -> None:
    assert dead_links(text, FOLDER, anchors("## 2 Own")) == []


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[x](../docs/glossary.md#voxel)", "has no such heading"),
        ("[x](../docs/none.md)", "../docs/none.md is not there"),
        ("![a disc of 3 pixels](none.png)", "none.png is not there"),
        ('<img src="none.png" alt="a disc of 3 pixels">', "none.png is not there"),
        ("[x](#nowhere)", "#nowhere is no heading here"),
        ("[x](01_tiny.ipynb#2-Own)", "has no such heading"),
        ("[x](https:/example.org/a)", "https:/example.org/a is no address"),
        ("[x](htps://example.org)", "is no address"),
        ("[x](https://example)", "is no address"),
        ("[x](mailto:example.org)", "is no address"),
    ],
)
def test_dead_links(text: str, says: str) -> None:
    found = dead_links(text, FOLDER, anchors("## 2 Own"))
    assert len(found) == 1
    assert says in found[0]


def test_anchors_are_headings_and_written_ids() -> None:
    text = '# A *pixel*: what?\n\n```\n# no heading\n```\n<a id="here"></a>'
    assert anchors(text) == {"a-pixel-what", "A-pixel:-what?", "here"}


def test_images_without_alt_text() -> None:
    assert images_without_alt("![](a.png) ![ ](b.png) ![a disc](c.png) `![](d.png)`") == ["a.png", "b.png"]
    assert len(images_without_alt('<img src="a.png"> <img alt="" src="b.png"> <img alt="c" src="c.png">')) == 2


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_of_pages_live(page: Path) -> None:
    """Those of notebooks are read by a gate."""
    text = page.read_text(encoding="utf-8")
    assert dead_links(text, page.parent, anchors(text)) == []
    assert images_without_alt(text) == []


@pytest.mark.skipif(not tracked(), reason="git does not know this copy of the course")
def test_every_tracked_page_is_among_them() -> None:
    pages = {path for path in tracked() if path.suffix == ".md" and FIXTURES not in path.parents}
    assert pages - set(PAGES) == {path for path in pages if path.parent == WORDS}
