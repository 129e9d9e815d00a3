"""What `check` shows: a card of HTML for eyes, and the same words as text."""

from __future__ import annotations

import html
import re
from dataclasses import dataclass

from course_lib.notebook._where import with_links

WHERE = "Where to look:"
_TONES = {
    "passed": ("#009E73", "✓"),
    "by hand": ("#0072B2", "→"),
    "not started": ("#7A8794", "○"),
    "failed": ("#D55E00", "↻"),
}
_FAINT = "rgba(127,127,127,0.35)"
BANDS = ("within tolerance", "up to 3 times", "up to 10 times", "more than that")
_STEPS = ("#009E73", "#56B4E9", "#E69F00", "#D55E00")


@dataclass(frozen=True)
class Card:
    """One answer of `check`: HTML for eyes, the same words as text for nbval, screen readers and terminals.

    Colours come from the notebook's theme, light or dark; without styles it reads as text.

    Parameters
    ----------
    tone : "passed", "by hand", "not started" or "failed".
    title, state : the heading: "Task 1: millimetres to metres", "passed · 1 point".
    lines : what there is to say: sentences, or (bold words, rest of the sentence).
    details : (label, text) pairs in smaller print.
    band : index into BANDS of the step to point at, or None.
    """

    tone: str
    title: str
    state: str
    lines: tuple[str | tuple[str, str], ...] = ()
    details: tuple[tuple[str, str], ...] = ()
    band: int | None = None

    @property
    def text(self) -> str:
        """The card as plain text."""
        parts = [f"{_TONES[self.tone][1]} {self.title} — {self.state}"]
        if self.band is not None:
            off = "more than 10 times" if self.band == 3 else BANDS[self.band]
            parts.append("  Within tolerance." if self.band == 0 else f"  Off by: {off} the tolerance.")
        parts += [f"  {line if isinstance(line, str) else ' '.join(line)}" for line in self.lines]
        parts += [f"  {label}: {text}" for label, text in self.details]
        return "\n".join(parts)

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        colour, mark = _TONES[self.tone]
        head = _paragraph(
            0,
            f'<span style="color:{colour};font-weight:bold" aria-hidden="true">{mark}</span> '
            f"<strong>{html.escape(self.title)}</strong> — {html.escape(self.state)}",
        )
        lines = "".join(_paragraph(6, _sentence(line)) for line in self.lines)
        details = "<br>".join(f"{html.escape(label)}: {_marked(text)}" for label, text in self.details)
        if details:
            details = _paragraph(8, details, ";font-size:88%;opacity:0.78")
        frame = f"border:1px solid {_FAINT};border-left:6px solid {colour};border-radius:6px"
        return (
            f'<div role="note" style="{frame};padding:10px 14px;margin:4px 0;max-width:48em;line-height:1.5">'
            f"{head}{self._steps()}{lines}{details}</div>"
        )

    def _steps(self) -> str:
        """Four steps from right to far off; the one reached in colour and bold."""
        if self.band is None:
            return ""
        steps = []
        for index, words in enumerate(BANDS):
            colour, weight = (_STEPS[index], "bold") if index == self.band else (_FAINT, "normal")
            style = f"display:inline-block;padding:0 12px 1px 2px;margin-right:4px;font-size:85%;font-weight:{weight}"
            steps.append(f'<span style="{style};border-bottom:4px solid {colour}">{html.escape(words)}</span>')
        return _paragraph(6, " ".join(steps))


def _sentence(line: str | tuple[str, str]) -> str:
    if isinstance(line, str):
        return _marked(line)
    rest = with_links(line[1]) if line[0] == WHERE else _marked(line[1])
    return f"<strong>{_marked(line[0])}</strong> {rest}"


def _marked(text: str) -> str:
    """Escaped text in which `code` between backticks is code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))


def _paragraph(above: int, inner: str, style: str = "") -> str:
    return f'<p style="margin:{above}px 0 0 0{style}">{inner}</p>'
