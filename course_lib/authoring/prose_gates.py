"""What the text of a stored notebook must satisfy: links that lead somewhere, no typed results, no empty words."""

from __future__ import annotations

import re
from collections.abc import Iterator

from .checked import Checked, allowed
from .links import anchors, dead_links

_NUMBER = re.compile(
    r"(?<![\w.,/^–-])(?P<number>\d{1,3}(?:,\d{3})+(?:\.\d+)?|\d+(?:\.\d+)?)\s?(?:mm|cm|m|km|%|°)(?![\w/²³^])"
)
_NOT_PROSE = re.compile(
    r"```.*?```|`[^`\n]*`|\$\$.*?\$\$|\$[^$\n]+\$|^[ \t]*[|>][^\n]*$|\[[^\]]*\]\([^)]*\)", re.S | re.M
)
_EMPTY_WORDS = re.compile(r"\b(?:simply|obviously)\b", re.I)


def links(checked: Checked) -> Iterator[str]:
    """A link or an image that leads nowhere; a lesson without a link to its lab, or a lab without one back."""
    prose = "\n\n".join(cell.source for _, cell in checked.prose())
    own = anchors(prose)
    other, what = ("exercises", "lab") if checked.kind == "lesson" else ("notebooks", "lesson")
    if not re.search(rf"\]\(\.\./{other}/\d\d_\w+\.ipynb[)#]", prose):
        yield f"{checked.name}: no link leads to its {what}: [{what} NN](../{other}/NN_name.ipynb)"
    for n, cell in checked.prose():
        for to in dead_links(cell.source, checked.path.parent, own):
            yield checked.at(n, f"dead link: {to}")


def typed_numbers(checked: Checked) -> Iterator[str]:
    """A measured number typed into a lesson's prose: three digits or more and a unit, outside tables and formulas."""
    if checked.kind != "lesson":
        return
    for n, cell in checked.prose():
        if allowed(cell, "typed number"):
            continue
        for match in _NUMBER.finditer(_NOT_PROSE.sub(" ", cell.source)):
            digits = match["number"].replace(",", "")
            digits = digits.replace(".", "").lstrip("0") if "." in digits else digits.strip("0")
            if len(digits) >= 3:
                yield checked.at(n, f"a result typed into prose: {match[0]!r} (print it, or give its source)")


def words(checked: Checked) -> Iterator[str]:
    """Words that tell a reader who is stuck that it was easy."""
    for n, cell in checked.prose():
        for match in _EMPTY_WORDS.finditer(_NOT_PROSE.sub(" ", cell.source)):
            yield checked.at(n, f"the word {match[0]!r}")
