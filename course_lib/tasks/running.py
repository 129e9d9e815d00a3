"""Calling a learner's function on cases: on copies, whatever it prints, warns or raises."""

from __future__ import annotations

import contextlib
import io
import linecache
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from course_lib.tasks.core import Case, Task
from course_lib.tasks.plain import Plain, describe, plain, same

MAX_PRINTED = 400


@dataclass(frozen=True)
class Outcome:
    """What came of one call.

    Parameters
    ----------
    kind : "answer", "not started" (it raised NotImplementedError), "raised" or "not plain".
    answer : plain data; None unless `kind` is "answer".
    trouble : one sentence; why there is no answer.
    printed, warned : the beginning of what it printed, its first warning.
    overwrote : names of what it was given and changed.
    unsteady : whether it answered the same question otherwise when it was asked again.
    """

    kind: str
    answer: Plain = None
    trouble: str = ""
    printed: str = ""
    warned: str = ""
    overwrote: tuple[str, ...] = ()
    unsteady: bool = False


class _Limited(io.TextIOBase):
    """A text stream that keeps the beginning of what is written to it."""

    def __init__(self) -> None:
        self.kept = ""

    def write(self, text: str) -> int:
        self.kept += writable(text[: max(0, MAX_PRINTED - len(self.kept))])
        return len(text)


def run(function: Callable[..., Any], case: Case, *, as_given: bool = False) -> Outcome:
    """Call a function on copies of what a case gives (`as_given`: on these things). Only KeyboardInterrupt gets out."""
    given = dict(case.given) if as_given else {name: plain(value) for name, value in case.given.items()}
    told = given_text(case.given)
    stream = _Limited()
    value, problem = None, None
    with (
        warnings.catch_warnings(record=True) as caught,
        contextlib.redirect_stdout(stream),
        contextlib.redirect_stderr(stream),
        np.errstate(),
    ):
        warnings.simplefilter("default")
        try:
            value = function(*given.values())
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # also exit(): it must not end the learner's kernel
            problem = error
    first = f"{caught[0].category.__name__}: {_short(str(caught[0].message))}" if caught else ""
    if problem is not None:
        open_stub = isinstance(problem, NotImplementedError) and _innermost_is_learners(problem.__traceback__)
        return Outcome("not started" if open_stub else "raised", None, _sentence(problem, told), stream.kept, first)
    try:
        changed = () if as_given else tuple(n for n, v in case.given.items() if not same(plain(given[n]), v, 0.0))
        return Outcome("answer", plain(value), "", stream.kept, first, changed)
    except ValueError as error:
        return Outcome("not plain", None, _capital(str(error)), stream.kept, first)


def run_all(function: Callable[..., Any], cases: Sequence[Case], *, twice: bool = False) -> list[Outcome]:
    """Call a function on each case; where it is "not started" in the first, the others are not tried.

    Parameters
    ----------
    twice : ask the first case once more, so that randomness without a seed shows.
    """
    first = run(function, cases[0])
    if first.kind == "not started":
        return [first] * len(cases)
    others = [run(function, case) for case in cases[1:]]
    if twice:
        first = _compared(first, run(function, cases[0]))
    return [first, *(replace(other, kind="raised") if other.kind == "not started" else other for other in others)]


def asked(task: Task, cases: Sequence[Case]) -> Sequence[Case]:
    """What a grader asks: of an open task the first case once more, so that randomness without a seed shows."""
    return (*cases, cases[0]) if task.kind == "open" else cases


def answered(task: Task, outcomes: Sequence[Outcome]) -> list[Outcome]:
    """An outcome for each case, of what came of `asked`."""
    if task.kind != "open":
        return list(outcomes)
    return [_compared(outcomes[0], outcomes[-1]), *outcomes[1:-1]]


def _compared(first: Outcome, again: Outcome) -> Outcome:
    """The first outcome, knowing whether the second call with the same inputs came to another answer."""
    if first.kind != "answer":
        return first
    return replace(first, unsteady=again.kind != "answer" or not same(again.answer, first.answer, 1e-9))


def given_text(given: Mapping[str, Plain]) -> str:
    """What went in, by name: 'depth (480, 640) float32, scale = 1000'."""
    parts = []
    for name, value in given.items():
        told = describe(value).removeprefix("a ").removesuffix(" array")
        parts.append(f"{name} {told}" if isinstance(value, np.ndarray) else f"{name} = {told}")
    return ", ".join(parts) or "nothing"


def _sentence(error: BaseException, told: str) -> str:
    name = type(error).__name__
    text = f"{name}: {_short(str(error))}" if str(error) else name
    if isinstance(error, RecursionError):
        text = "RecursionError: it calls itself without end"
    elif isinstance(error, SystemExit):
        text = "SystemExit: it ended the program, where it should return an answer"
    place = _place(error.__traceback__)
    return f"{place} raised {text.rstrip('.')}. It was given {told}."


def _frames(trace: TracebackType | None) -> list[tuple[str, int]]:
    frames = []
    while trace is not None:
        frames.append((trace.tb_frame.f_code.co_filename, trace.tb_lineno))
        trace = trace.tb_next
    return frames


_PACKAGES = str(Path(np.__file__).parents[1])
_OTHERS = tuple(sorted({str(Path(__file__).parents[1]), os.path.dirname(os.__file__), sys.prefix, _PACKAGES}))


def _is_learners(filename: str) -> bool:
    """Whether a file is a cell or the learner's own: neither installed, compiled, of the course nor of Python."""
    return not filename.startswith(("<frozen", *_OTHERS)) and not filename.endswith((".pyx", ".pxd", ".pxi"))


def _innermost_is_learners(trace: TracebackType | None) -> bool:
    frames = _frames(trace)
    return len(frames) > 1 and _is_learners(frames[-1][0])


def _place(trace: TracebackType | None) -> str:
    inside = [(filename, line) for filename, line in _frames(trace)[1:] if _is_learners(filename)]
    if not inside:
        return "Calling your function"
    filename, line = inside[-1]
    text = linecache.getline(filename, line).strip()
    return f"Line {line} of your cell, `{_short(text, 90)}`," if text else f"Line {line} of your code"


def writable(text: str) -> str:
    """A text that any file and any message can hold: half a character, as r"\\ud83d" is one, becomes its number."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _short(text: str, most: int = 200) -> str:
    text = writable(" ".join(text.split()))
    return text if len(text) <= most else text[: most - 1] + "…"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
