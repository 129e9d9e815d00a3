"""From a lab's task cell with its solution to the cell that learners get: pure text, no files.

The whole vocabulary, inside the function of a cell tagged `task`::

    def metres(depth_mm):
        # BEGIN SOLUTION
        # a millimetre is a thousandth of a metre      (a comment on a line of its own is the plan)
        return depth_mm / 1000
        # INSTEAD                                      (only where the task is to mend given wrong code)
        #| return depth_mm * 1000
        # END SOLUTION
"""

from __future__ import annotations

import io
import json
import tokenize
from dataclasses import dataclass

from course_lib.authoring.tree import CourseError

BEGIN, INSTEAD, END, GIVEN = "# BEGIN SOLUTION", "# INSTEAD", "# END SOLUTION", "#|"
KEPT_PLANS = 3  # tasks 1–3 keep the solution's comments as a plan
MEND = "# delete the next line, then mend what follows"


@dataclass(frozen=True)
class _Block:
    """One solution: line numbers from 0; `instead` is `end` where nothing wrong is given."""

    begin: int
    instead: int
    end: int
    indent: str


def exercise_source(source: str, number: int, title: str, keep_plan: bool = True) -> str:
    """The cell as learners get it.

    Parameters
    ----------
    source : the task cell of the lab's source, with its markers.
    number, title : of the task; they stand in the stub's `NotImplementedError("Task 2: title")`.
    keep_plan : whether comments of the solution that stand on lines of their own stay as a plan.

    Raises
    ------
    CourseError
        If the markers are missing or do not pair, or the cell is not Python.
    """
    message = json.dumps(f"Task {number}: {title}", ensure_ascii=False)
    stub = f"raise NotImplementedError({message})"
    lines, blocks = _parse(source)
    comments = _own_line_comments(source)
    result: list[str] = []
    done = 0
    for block in blocks:
        result += lines[done : block.begin]
        if keep_plan:
            result += [block.indent + comments[i] for i in range(block.begin + 1, block.instead) if i in comments]
        mend = block.instead < block.end
        result += [block.indent + line for line in ([MEND] if mend else []) + [stub]]
        result += _given(lines, block) if mend else []
        done = block.end + 1
    return "\n".join(result + lines[done:])


def reference_source(source: str) -> str:
    """The cell as a learner with the right answer would have it: the solution without its markers."""
    lines, blocks = _parse(source)
    dropped = {i for block in blocks for i in (block.begin, *range(block.instead, block.end + 1))}
    return "\n".join(line for i, line in enumerate(lines) if i not in dropped)


def solution_blocks(source: str) -> list[tuple[int, int]]:
    """The solutions of a task cell: for each the line of its BEGIN, from 1, and the last line of its code."""
    return [(block.begin + 1, block.instead) for block in _parse(source)[1]]


def _parse(source: str) -> tuple[list[str], list[_Block]]:
    lines = source.split("\n")
    blocks: list[_Block] = []
    begin = instead = -1
    for i, line in enumerate(lines):
        word = line.strip()
        if word == BEGIN:
            if begin >= 0:
                raise CourseError(f"line {i + 1} of a task cell: a second {BEGIN!r} before the first has ended.")
            begin, instead = i, -1
        elif word == INSTEAD:
            if begin < 0 or instead >= 0:
                raise CourseError(
                    f"line {i + 1} of a task cell: {INSTEAD!r} belongs once between {BEGIN!r} and {END!r}."
                )
            instead = i
        elif word == END:
            if begin < 0:
                raise CourseError(f"line {i + 1} of a task cell: {END!r} without {BEGIN!r}.")
            indent = lines[begin][: len(lines[begin]) - len(lines[begin].lstrip())]
            blocks.append(_Block(begin, i if instead < 0 else instead, i, indent))
            begin = -1
        elif instead >= 0 and begin >= 0 and word and not word.startswith(GIVEN):
            raise CourseError(f"line {i + 1} of a task cell: after {INSTEAD!r} every line starts with {GIVEN!r}.")
    if begin >= 0:
        raise CourseError(f"line {begin + 1} of a task cell: {BEGIN!r} without {END!r}.")
    if not blocks:
        raise CourseError(f"a task cell has no {BEGIN!r} and {END!r}: {lines[0][:60]!r}")
    return lines, blocks


def _given(lines: list[str], block: _Block) -> list[str]:
    """The lines after INSTEAD with `#| ` taken off; what stands behind the one blank keeps its indentation."""
    given = []
    for line in lines[block.instead + 1 : block.end]:
        code = line.strip().removeprefix(GIVEN).removeprefix(" ")
        given.append(block.indent + code if code else "")
    return given


def _own_line_comments(source: str) -> dict[int, str]:
    """Comments that stand on lines of their own, by line number from 0; `#` inside a text is none."""
    comments: dict[int, str] = {}
    try:
        for token in tokenize.generate_tokens(io.StringIO(source + "\n").readline):
            if token.type == tokenize.COMMENT and not token.line[: token.start[1]].strip():
                comments[token.start[0] - 1] = token.string
    except (tokenize.TokenError, IndentationError) as error:
        raise CourseError(f"a task cell is not Python: {error.args[0]}.") from error
    return comments
