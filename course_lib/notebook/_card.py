"""The card that `check` answers with: HTML for eyes, the same words as text for nbval, screen readers and terminals."""

from __future__ import annotations

import html
from dataclasses import dataclass

_TONES = {
    "passed": ("#009E73", "✓"),
    "by hand": ("#009E73", "✓"),
    "not started": ("#7A8794", "○"),
    "skipped": ("#7A8794", "○"),
    "failed": ("#D55E00", "✗"),
}
_FAINT = "rgba(127,127,127,0.35)"
BANDS = ("within tolerance", "up to 3 times", "up to 10 times", "more")
_STEPS = ("#009E73", "#56B4E9", "#E69F00", "#D55E00")


@dataclass(frozen=True)
class Card:
    """One answer of `check`.

    Parameters
    ----------
    tone : a key of the colours: "passed", "by hand", "not started", "skipped", "failed".
    title, state : the heading: "Task 1: millimetres to metres", "passed · 1 of 1 point".
    lines : (label, sentence) pairs; a label may be "".
    band : index into BANDS to point at, or None.
    """

    tone: str
    title: str
    state: str
    lines: tuple[tuple[str, str], ...] = ()
    band: int | None = None

    @property
    def text(self) -> str:
        """The card as plain text."""
        mark = _TONES[self.tone][1]
        parts = [f"{mark} {self.title} — {self.state}"]
        for label, sentence in self.lines:
            parts.append(f"  {label}: {sentence}" if label else f"  {sentence}")
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
        body = "".join(_line(label, sentence) for label, sentence in self.lines)
        frame = f"border:1px solid {_FAINT};border-left:6px solid {colour};border-radius:6px"
        return (
            f'<div role="note" style="{frame};padding:10px 14px;margin:4px 0;max-width:46em;line-height:1.5">'
            f"{head}{self._steps()}{body}</div>"
        )

    def _steps(self) -> str:
        """Four steps from right to far off; the one reached in colour and bold."""
        if self.band is None:
            return ""
        steps = []
        for index, words in enumerate(BANDS):
            colour, weight = (_STEPS[index], "bold") if index == self.band else (_FAINT, "normal")
            style = f"display:inline-block;padding:0 10px 1px 2px;margin-right:4px;font-size:85%;font-weight:{weight}"
            steps.append(f'<span style="{style};border-bottom:4px solid {colour}">{html.escape(words)}</span>')
        return _paragraph(6, "".join(steps))


def _line(label: str, sentence: str) -> str:
    name = f'<span style="opacity:0.75">{html.escape(label)}:</span> ' if label else ""
    return _paragraph(5, name + html.escape(sentence))


def _paragraph(above: int, inner: str) -> str:
    return f'<p style="margin:{above}px 0 0 0">{inner}</p>'
