"""Cells that need real data. Their first line says so: `# real data: tum_pair, sun_pair`.

Where a named dataset is not on this machine, IPython shows what the shipped notebook has stored of the cell, below a
line that says so (of a cell that was edited, the line alone), and Run All goes on. Cells that use variables of such a
cell carry the same line.
"""

from __future__ import annotations

import html
import re
from collections.abc import Sequence

from course_lib import compiled
from course_lib.notebook import _catalog
from course_lib.notebook._errors import Refusal
from course_lib.notebook._places import told
from course_lib.notebook._shipped import show_again, stored_outputs

_MARK = re.compile(r"\A\s*#\s*real data:(?P<names>[^\n]*)")


def real_datasets(source: str) -> tuple[str, ...]:
    """The datasets that the first line of a cell names."""
    match = _MARK.match(source)
    return tuple(name.strip() for name in match["names"].split(",") if name.strip()) if match else ()


def missing(names: Sequence[str]) -> list[str]:
    """Those of the named datasets that are not on this machine.

    Raises
    ------
    Refusal
        If a name is unknown; the nearest is suggested.
    """
    from course_lib.notebook import _real

    entries = [_catalog.entry(name) for name in names]
    return [entry.name for entry in entries if entry.kind == "real" and _real.missing(entry)]


class Skipped:
    """What a cell shows that could not run: one line, and below it what is stored of it."""

    def __init__(self, names: Sequence[str], outputs: Sequence[dict] = ()):
        self.names, self.outputs = list(names), list(outputs)

    def _ipython_display_(self) -> None:
        from IPython.display import display

        display({"text/plain": repr(self), "text/html": self._repr_html_()}, raw=True)
        show_again(self.outputs)

    def __repr__(self) -> str:
        them, words = ", ".join(self.names), " ".join(self.names)
        what = "stored: what follows was made" if self.outputs else "skipped: this cell needs real data"
        where = f"where the real data are ({them})" if self.outputs else f"({them})"
        return f"{what} {where}; get it with: python3 course.py data get {words}"

    def _repr_html_(self) -> str:
        before, _, command = repr(self).partition("python3")
        style = "border-left:4px solid #999999;padding:0.2em 1em;margin:0.5em 0"
        return f'<div style="{style}">{html.escape(before)}<code>python3{html.escape(command)}</code></div>'


def refuse(sentence: str) -> None:
    """Say in the cell what is wrong with its first line."""
    raise Refusal(sentence)


def skip_cells(lines: list[str]) -> list[str]:
    """IPython input transformer: replace a cell whose real data are missing."""
    names = real_datasets("".join(lines))
    if not names:
        return lines
    try:
        absent = missing(names)
    except Refusal as refusal:
        return [f"__import__('course_lib.notebook._cells', fromlist=['refuse']).refuse({str(refusal)!r})\n"]
    if not absent:
        return lines
    return [f"__import__('course_lib.notebook._cells', fromlist=['instead']).instead({absent!r}, {''.join(lines)!r})\n"]


def instead(names: Sequence[str], source: str) -> Skipped:
    """What is shown instead of running a cell."""
    return Skipped(names, stored_outputs(source))


def register() -> bool:
    """Make IPython skip such cells from the next one on, and say what it waits for where loops are compiled.

    Returns
    -------
    False where there is no IPython session.
    """
    from IPython import get_ipython

    shell = get_ipython()
    if shell is None:
        return False
    transformers = shell.input_transformers_cleanup
    if not any(getattr(one, "__name__", "") == skip_cells.__name__ for one in transformers):
        transformers.insert(0, skip_cells)
    compiled.announce = told
    return True
