"""Links that lead somewhere, links that do not, images that say nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from course_lib.authoring.links import anchors, dead_links, images_without_alt

FOLDER = Path(__file__).parent / "fixtures" / "tree" / "notebooks"


@pytest.mark.parametrize(
    "text",
    [
        "[a pixel](../docs/glossary.md#pixel)",
        "[the glossary](../docs/glossary.md)",
        "[a lab](../exercises/01_tiny.ipynb)",
        "[this part](01_tiny.ipynb#1-One-idea) and [the same](01_tiny.ipynb#1-one-idea)",
        "[here](#2-Own)",
        "[the web](https://example.org/none.md#x), [mail](mailto:a@example.org)",
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
