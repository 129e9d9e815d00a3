"""Reading XYZ files: a point a line, as text."""

from __future__ import annotations

from pathlib import Path

from course_lib.notebook._columns import XYZ, Stored, text_table
from course_lib.notebook._errors import Refusal, shown


def read_xyz(path: Path) -> Stored:
    """Read the first three numbers of every line, in float64; more columns are left, lines that begin with # too.

    Raises
    ------
    Refusal
        If a line does not hold three numbers.
    """
    content = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    lines = [(number, line) for number, line in enumerate(content.splitlines(), 1) if line.strip()]
    lines = [one for one in lines if not one[1].lstrip().startswith(b"#")]
    if short := next((number for number, line in lines if len(line.split(None, 3)) < 3), None):
        raise Refusal(f"Line {short} of {shown(path)} holds no three numbers: the file is cut short or is not XYZ.")
    try:
        table = text_table(path, lines, XYZ, exact=False)
    except Refusal as refusal:
        raise Refusal(str(refusal).replace("write it again", "the file is damaged or is not XYZ")) from None
    return Stored(path, len(table), {name: table[:, i] for i, name in enumerate(XYZ)})
