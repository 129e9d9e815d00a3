"""`check("03-2", my_function)`: run a task's public cases on an answer and show a card that teaches.

A first failure shows the size of the error, its axis and the worst case; a second what it looks like; a third where to
look. With `COURSE_STRICT=1` (tests, graders) an untouched stub raises its NotImplementedError and a wrong answer
CheckFailed, in one line. A card counts for nothing in a grade: graders run fresh cases of their own.
"""

from __future__ import annotations

import inspect
import math
import os
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from course_lib import tasks
from course_lib.notebook._card import BANDS, WHERE, Card
from course_lib.tasks.diagnosis.public_answers import recall
from course_lib.tasks.judging import UNSTEADY, Result, band
from course_lib.tasks.plain import describe
from course_lib.tasks.private import listed
from course_lib.tasks.released_cases import public_cases
from course_lib.tasks.running import Outcome
from course_lib.tasks.sources import forbidden

_failures: dict[str, tuple[int, object]] = {}
"""Task → how often it failed in this kernel, and what failed last."""


class CheckFailed(AssertionError):
    """A wrong answer under COURSE_STRICT=1; one line, shown without a traceback."""

    def _render_traceback_(self) -> list[str]:
        return [f"CheckFailed: {self}"]


def check(task_id: str, function: Callable[..., Any]) -> Card:
    """Check an answer on the task's public cases.

    Parameters
    ----------
    task_id : "03-2" is task 2 of lab 03.
    function : the function that you wrote; its name, without brackets.

    Returns
    -------
    A card; leave the call as the last line of its cell to see it.

    Raises
    ------
    ValueError
        If there is no such task.
    NotImplementedError, CheckFailed
        Only under COURSE_STRICT=1: an untouched stub; an answer that is not right.
    """
    unseen = listed().get(task_id)
    if unseen is not None:
        return _judged_later(unseen, function)
    task = tasks.get(task_id)
    strict = os.environ.get("COURSE_STRICT", "") not in ("", "0")
    refused = _refused(task, function) or _older(function) or forbidden(task, function)
    if refused:
        if strict:
            raise CheckFailed(f"{task.label}: {refused}") from None
        return Card("failed", task.label, "not yet", (refused,))
    load = _loader(task)
    cases, kept = public_cases(task, load)
    recall(task, cases)
    outcomes = tasks.run_all(function, cases, twice=task.kind == "open")
    result = tasks.judge_all(task, cases, outcomes)
    if result.status == "not started":
        if strict:
            raise NotImplementedError(task.label) from None
        call = task.signature.removeprefix("def ").rstrip(":")
        line = f"Replace the `raise` line in `{call}`, run that cell, then this one."
        return Card("not started", task.label, f"not started yet · {_points(task.points)}", (line,))
    if result.passed:
        _failures.pop(task.id, None)
        return _with_real(_passed(result, outcomes), task, load, kept)
    if strict:
        raise CheckFailed(result.line) from None
    return _with_real(_failed(result, outcomes, _count(task.id, function, result.error)), task, load, kept)


def _count(task_id: str, function: Callable[..., Any], error: str) -> int:
    """How often a task has failed, this time included; an answer that was not changed counts once."""
    count, last = _failures.get(task_id, (0, None))
    now = (_written(function), error)
    _failures[task_id] = (count if now == last else count + 1, now)
    return _failures[task_id][0]


def _written(function: Callable[..., Any]) -> object:
    """What somebody wrote: a function's text, or where nobody knows it, its code."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        code = getattr(function, "__code__", None)
        return (code.co_code, repr(code.co_consts), code.co_names) if code else id(function)


def _with_real(card: Card, task: tasks.Task, load: Callable[..., Any] | None, kept: bool) -> Card:
    """Say of a task whose real data are not here that only its made cases were judged; so where cases are `kept`."""
    if not task.data or (load is not None and not kept):
        return card
    words = "it is judged when you hand in"
    if not kept:
        words = f"its data are not here; get them with: python3 course.py data get {' '.join(task.data)}"
    return replace(card, details=(*card.details, ("The real case was left out", words)))


def _judged_later(unseen: dict, function: Any) -> Card:
    """The card of an instructor's own task, of which only the name is here."""
    if not callable(function):
        words = f"check wants the function itself: write {unseen['function']}, with no brackets after the name."
        return Card("failed", unseen["label"], "not yet", (words,))
    words = (
        "Your instructor's own task: no check of it is here. Try your function on cases that you can do in your head."
    )
    return Card("by hand", unseen["label"], f"judged when you hand in · {_points(unseen['points'])}", (words,))


def _refused(task: tasks.Task, function: Any) -> str:
    """Why what was handed to check cannot be called; "" if it can."""
    call = f'check("{task.id}", {task.function})'
    if not callable(function):
        return (
            f"check wants the function itself, not {describe(function)}: write {call}, with no brackets after the name."
        )
    try:
        inspect.signature(function).bind(*task.arguments)
    except TypeError as error:
        return (
            f"The task calls {task.function}({', '.join(task.arguments)}), which your function does not take: {error}."
        )
    except ValueError:
        return ""  # some built-in functions do not tell their arguments; the call will
    return ""


def _older(function: Callable[..., Any]) -> str:
    """Why a function is an older one than its cell says; "" where it is that of the cell, or nobody can tell."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    name = getattr(function, "__name__", "")
    if shell is None or not name.isidentifier():
        return ""
    cells = [str(cell) for cell in shell.user_ns.get("In", ())]
    last = next((cell for cell in reversed(cells) if re.search(rf"^def {name}\b", cell, re.M)), None)
    try:
        source = inspect.getsource(function)
    except (OSError, TypeError):
        return ""
    if last is None or f"{source.rstrip()}\n" in f"{last.rstrip()}\n":
        return ""
    return (
        f"The cell that was run last with `def {name}` did not come to its end, so an older {name} would be judged: "
        "mend that cell, run it, then this one."
    )


def _loader(task: tasks.Task) -> Callable[..., Any] | None:
    """The notebook's data.load where all the data of a task are here."""
    if not task.data:
        return None
    from course_lib.notebook import data

    return data.load if all(data.available(name) for name in task.data) else None


def _points(points: float) -> str:
    return f"{points:g} {'point' if points == 1 else 'points'}"


_COUNTED = ("%", "wrong", "points")
"""Units of verdicts on things that are counted: of these, right is right."""


def _passed(result: Result, outcomes: list[Outcome]) -> Card:
    task, count = result.task, len(result.verdicts)
    said = _said(outcomes)
    if result.status == "by hand":
        words = f"{result.error} Nobody has judged yet what they say; your instructor gives 0 to {task.points:g}."
        state = f"written, not judged here · up to {_points(task.points)}, marked by hand"
        return Card("by hand", task.label, state, (words,), said)
    if task.kind == "open":
        state = f"passed · {result.points:g} of {_points(task.points)}"
        worst = f"This is the worst of {count} scenes; a grade is what the worst of {task.draws} earns."
        return Card("passed", task.label, state, (f"{result.error} {worst}", *_luck(result)), said)
    cases = {1: "", 2: " in both cases"}.get(count, f" in all {count} cases")
    worst = max(verdict.ratio for verdict in result.verdicts)
    counted = result.verdict.unit in _COUNTED
    words = f"Right{cases}." if counted else f"Right{cases}, {band(worst)}."
    return Card("passed", task.label, f"passed · {_points(task.points)}", (words,), said)


def _luck(result: Result) -> tuple[str, ...]:
    return (UNSTEADY,) if result.unsteady else ()


def _failed(result: Result, outcomes: list[Outcome], failures: int) -> Card:
    """The first failure tells the error, the second also what it looks like, the third also where to look."""
    task, ratio, total = result.task, result.verdict.ratio, len(result.verdicts)
    lines: list[str | tuple[str, str]] = [result.error, *_luck(result)]
    formal = result.diagnosis is not None and result.diagnosis.kind == "form"
    if result.looks_like and (failures >= 2 or formal):
        start, says = "This looks like", result.looks_like
        lines.append((start, says.removeprefix(start + " ")) if says.startswith(start) else says)
    if failures >= 3:
        lines.append((WHERE, result.where.removeprefix(f"{WHERE} ")))
    details = [] if result.status == "raised" or result.told.startswith("nothing") else [("It was given", result.told)]
    if task.kind != "open" and total > 1:
        right = sum(verdict.passed for verdict in result.verdicts)
        details.append(("So far", f"right in {right} of {total} cases"))
    said = list(_said(outcomes))
    if failures < 3:
        said.append(("Next", "change something in the cell above, run it, then this one; the next card says more"))
    sized = math.isfinite(ratio) and task.kind not in ("which", "open", "explain") and result.verdict.unit != "points"
    step = next((i for i, most in enumerate((1, 3, 10)) if ratio <= most), len(BANDS) - 1) if sized else None
    state = f"so far {result.points:g} of {_points(task.points)}" if result.points else "not yet"
    return Card("failed", task.label, state, tuple(lines), (*details, *said), step)


def _said(outcomes: list[Outcome]) -> tuple[tuple[str, str], ...]:
    """What the function printed and the first warning, of the first case that has any."""
    printed = " ".join(next((outcome.printed for outcome in outcomes if outcome.printed.strip()), "").split())
    warned = next((outcome.warned for outcome in outcomes if outcome.warned), "")
    short = printed if len(printed) <= 160 else printed[:159] + "…"
    return tuple((label, text) for label, text in (("It printed", short), ("Python warned", warned)) if text)
