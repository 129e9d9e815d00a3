"""Numbers on the page: `report` prints one, `report_table` a few. Both round to what repeats on any machine."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import numpy as np
from IPython import get_ipython

from course_lib.notebook._words import amount, number


def report(name: str, value: object, unit: str = "", digits: int = 3, *, smallest: float | None = None) -> None:
    """Print one result as `name: value unit`.

    Rounding is to what repeats: another processor or thread count changes the last bits of a result, so only its first
    digits are printed. A rounded print proves nothing by itself; the numbers that matter are asserted in tests/.

    Parameters
    ----------
    name : what the number is.
    value : int (printed in full), float, bool ("yes"/"no") or a word. NaN prints "not measured".
    unit : such as "mm" or "%".
    digits : significant digits of a float.
    smallest : a float nearer to zero than this prints "below ...": down there a result is only one machine's rounding,
        and 0 is what another machine's may be. None: 1e-9, and 0 prints "0".

    Raises
    ------
    ValueError
        If value is an array, a list or anything else that is not one number.
    """
    if np.ndim(value) > 0 or isinstance(value, (Mapping, set)):
        form = f"an array of shape {np.shape(value)}" if isinstance(value, np.ndarray) else f"a {type(value).__name__}"
        raise ValueError(
            f"report prints one number and {name!r} is {form}: pass its norm, mean or worst, or use report_table."
        )
    if value is None:
        raise ValueError(f"report has no value for {name!r}: it is None, so compute it first.")
    print(f"{name}: {amount(value, unit, digits, smallest)}")


class Table:
    """A table that reads as text, and as HTML where the notebook shows HTML."""

    def __init__(self, rows: Sequence[Sequence[str]], columns: Sequence[str], right: Sequence[bool], title: str = ""):
        self.rows, self.columns, self.right, self.title = rows, columns, right, title

    def __repr__(self) -> str:
        widths = [max(len(row[i]) for row in [self.columns, *self.rows]) for i in range(len(self.columns))]
        lines = [self._line(self.columns, widths), "  ".join("-" * width for width in widths)]
        lines += [self._line(row, widths) for row in self.rows]
        return "\n".join(([self.title] if self.title else []) + lines)

    def _line(self, cells: Sequence[str], widths: Sequence[int]) -> str:
        parts = [c.rjust(w) if r else c.ljust(w) for c, w, r in zip(cells, widths, self.right, strict=True)]
        return "  ".join(parts).rstrip()

    def _repr_html_(self) -> str:
        def cells(row: Sequence[str], tag: str) -> str:
            sides = ["right" if right else "left" for right in self.right]
            scope = ' scope="col"' if tag == "th" else ""
            return "".join(
                f'<{tag}{scope} style="text-align: {side}">{html.escape(cell)}</{tag}>'
                for cell, side in zip(row, sides, strict=True)
            )

        caption = f"<caption>{html.escape(self.title)}</caption>" if self.title else ""
        head = f"<thead><tr>{cells(self.columns, 'th')}</tr></thead>"
        body = "\n".join(f"<tr>{cells(row, 'td')}</tr>" for row in self.rows)
        return f"<table>{caption}{head}\n<tbody>{body}</tbody></table>"


def report_table(
    rows: Sequence[Sequence] | Sequence[Mapping] | Mapping[str, Sequence],
    columns: Sequence[str] | None = None,
    *,
    digits: int = 3,
    title: str = "",
    smallest: float | None = None,
) -> None:
    """Show a small table, its numbers rounded as `report` rounds them.

    Parameters
    ----------
    rows : a list of rows (each a sequence or a dict), or a dict of first cell → the rest of the row.
    columns : headings, with units in them ("error (mm)"); for dict rows the keys of the first one stand in.
    digits : significant digits of floats; ints are printed in full.
    smallest : as for `report`, for all floats of the table.
    title : a line above.

    Raises
    ------
    ValueError
        If there is no row, or a row's length is not that of the columns.
    """
    if isinstance(rows, Mapping):
        rows = [[name, *(rest if np.ndim(rest) else [rest])] for name, rest in rows.items()]
    rows = list(rows)
    if not rows:
        raise ValueError("report_table got no rows: pass at least one.")
    if isinstance(rows[0], Mapping):
        columns = list(columns or rows[0])
        rows = [[row.get(column, "") for column in columns] for row in rows]
    if columns is None:
        raise ValueError("report_table needs columns: pass their headings, with units, as in ['view', 'error (mm)'].")
    wrong = next((row for row in rows if len(row) != len(columns)), None)
    if wrong is not None:
        raise ValueError(f"A row has {len(wrong)} cells for {len(columns)} columns: {list(wrong)!r}.")
    texts = [["" if cell is None else number(cell, digits, smallest) for cell in row] for row in rows]
    right = [any(not isinstance(row[i], str) for row in rows) for i in range(len(columns))]
    display_object(Table(texts, list(columns), right, title))


def display_object(thing: object) -> None:
    """Show in a notebook, or print outside of one."""
    if get_ipython() is None:
        print(repr(thing))
    else:
        from IPython.display import display

        display(thing)
