"""The items that nbval runs: the cells of a rebuilt notebook, after those of each task a probe; none is believed."""

from __future__ import annotations

import base64
import contextlib
import re
import secrets
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbval.plugin import IPyNbCell, IPyNbFile, NbCellError

from course_lib import tasks
from course_lib.grading.records import Notice

from .kernel import Kernel, Strike
from .kernel_imports import Room
from .limits import Limits
from .sandbox import Held

KINDS = ("answer", "not started", "raised", "not plain")
MOST_TEXT, MOST_LINE = 400, 90
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
IDLE_SECONDS = 15
"""So long a cell that has replied may take to say that it is idle."""


@dataclass
class Run:
    """What is known of one notebook's run: filled by its items, read by the judge.

    Parameters
    ----------
    outcomes : task to one outcome a case, as the kernel told.
    reasons : task to (code, sentence) where there is no answer.
    raised : task to the first error of its cells, as a sentence without its end.
    left : seconds of `limits.total_seconds` that the submission still has; all of them if it is not told.
    """

    held: Held
    room: Room
    limits: Limits
    folder: Path
    cases: dict[str, Sequence[tasks.Case]]
    outcomes: dict[str, list[tasks.Outcome]] = field(default_factory=dict)
    reasons: dict[str, tuple[str, str]] = field(default_factory=dict)
    raised: dict[str, str] = field(default_factory=dict)
    notices: list[Notice] = field(default_factory=list)
    nonces: dict[str, str] = field(default_factory=dict)
    came: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    strange: int = 0
    restarts: int = 0
    given_up: bool = False
    trouble: str = ""
    kernel: Kernel | None = None
    left: float = -1.0

    def __post_init__(self) -> None:
        if self.left < 0:
            self.left = self.limits.total_seconds

    def end_kernel(self) -> None:
        """End the kernel, and count how long it ran: what is left is for the next one."""
        if self.kernel is not None:
            self.left = max(0.0, self.left - self.kernel.age())
            self.kernel.stop()
            self.kernel = None

    def strike(self, task: str, strike: Strike) -> None:
        """A limit struck, or the kernel is gone: the running task has no answer."""
        if task:
            self.outcomes.pop(task, None)
            self.reasons.setdefault(task, (strike.code, strike.sentence))
        notice = Notice(code=strike.code, task=task, text=strike.sentence)
        if notice not in self.notices:
            self.notices.append(notice)

    def note_answer(self, content: Any) -> list[tasks.Outcome] | None:
        """Count an answer under its nonce; give its outcomes if the nonce is known."""
        nonce = content.get("nonce") if isinstance(content, dict) else None
        if not isinstance(nonce, str) or nonce not in self.nonces:
            self.strange += 1
            return None
        self.came[nonce] += 1
        return _outcomes(content.get("answers"), len(self.cases[self.nonces[nonce]]))


class File(IPyNbFile):
    """The rebuilt notebook; its kernel is ours, whatever a notebook asks for."""

    run: Run

    def setup(self) -> None:
        self.start()

    def start(self) -> None:
        run = self.run
        run.kernel = None
        try:
            run.kernel = Kernel(run.held, run.room, run.limits, run.folder, run.note_answer, run.left)
        except Exception as error:
            run.trouble = f"{type(error).__name__}: {error}"
            raise
        self.kernel = run.kernel

    def teardown(self) -> None:
        self.run.end_kernel()

    def collect(self) -> Iterator[pytest.Item]:
        self.nb = nbformat.read(str(self.path), as_version=4)
        for number, cell in enumerate(self.nb.cells):
            task = cell.metadata["task"]
            if cell.metadata["probe"]:
                yield Probe.from_parent(self, name=f"probe {task}", task=task)
                continue
            options = defaultdict(bool, check=False)  # what a comment or a tag asks of nbval is not asked here
            item = Cell.from_parent(self, name=f"cell {number}", cell_num=number, cell=cell, options=options)
            item.task, item.output_timeout = task, IDLE_SECONDS
            yield item

    def ready(self, task: str, upto: pytest.Item) -> None:
        """See to it that there is a kernel: after a death once more, with the cells of the tasks that are alive."""
        run = self.run
        if run.kernel is not None and run.kernel.alive():
            return
        if run.restarts or run.given_up:
            if not run.given_up:
                run.given_up = True
                text = "The kernel died a second time: the tasks that were still to come were not run."
                run.notices.append(Notice(code="given up", task="", text=text))
            raise Strike("died twice", "The kernel died twice; this task came after.")
        run.end_kernel()
        if run.left <= 0:
            told = f"total_seconds = {run.limits.total_seconds:g}"
            raise Strike("timeout", f"Time for the whole submission was up ({told}).")
        run.restarts += 1
        text = "The kernel was started again once, without the cells of the task that ended it."
        run.notices.append(Notice(code="restarted", task=task, text=text))
        self.start()
        self.timed_out = False
        for item in self.session.items:
            if item is upto:
                return
            if isinstance(item, Cell) and item.task not in run.reasons:
                with contextlib.suppress(NbCellError):
                    item.execute()


class Cell(IPyNbCell):
    """One statement, run by nbval."""

    task = ""

    def setup(self) -> None:
        """Not nbval's: after a time-out it would call later failures expected."""

    def execute(self) -> None:
        kernel = self.parent.run.kernel
        with kernel.limit("cell_seconds"):
            try:
                IPyNbCell.runtest(self)
            except (NbCellError, Strike):
                raise
            except Exception as error:  # what a kernel sends can upset nbval; it must not upset the whole run
                raise NbCellError(self.cell_num, f"nbval: {error}", self.cell.source, "") from error

    def runtest(self) -> None:
        run = self.parent.run
        if self.task in run.reasons:
            pytest.skip("its task has no answer")
        try:
            self.parent.ready(self.task, self)
            self.execute()
        except NbCellError as error:
            if self.task:
                what = _last_line(error.inner_traceback or str(error))
                run.raised.setdefault(self.task, f"{_first_line(self.cell.source)} raised {what}")
            raise
        except Strike as strike:
            run.strike(self.task, strike)
            raise


class Probe(pytest.Item):
    """Asks the function of one task, once, on fresh inputs."""

    def __init__(self, *, task: str, **rest: Any) -> None:
        super().__init__(**rest)
        self.task = task

    def runtest(self) -> None:
        run = self.parent.run
        if self.task in run.reasons:
            pytest.skip("its task has no answer")
        try:
            self.parent.ready(self.task, self)
            nonce = secrets.token_hex(16)
            run.nonces[nonce] = self.task
            with run.kernel.limit("task_seconds"):
                answers = run.kernel.ask(*_question(tasks.get(self.task), nonce, run.cases[self.task]))
            self.keep(nonce, answers)
        except Strike as strike:
            run.strike(self.task, strike)
            raise

    def keep(self, nonce: str, answers: list[Any]) -> None:
        run = self.parent.run
        if run.came[nonce] > 1:
            raise Strike("doubled", "More than one answer came back for one question, so none counts.")
        if not answers or answers[0] is None:
            why = "forged" if run.came[nonce] else "no answer"
            raise Strike(
                why,
                {
                    "forged": "What came back was not an answer of the form that the grader asked for.",
                    "no answer": "No answer came back.",
                }[why],
            )
        run.outcomes[self.task] = answers[0]

    def repr_failure(self, excinfo: Any) -> str:
        return str(excinfo.value)

    def reportinfo(self) -> tuple[Path, int, str]:
        return self.path, 0, self.name


def _question(task: tasks.Task, nonce: str, cases: Sequence[tasks.Case]) -> tuple[str, list[bytes]]:
    """The statement that asks, and the inputs beside it: as text in it, IPython would take 1 s to read 1 MB of them."""
    given = [tasks.to_wire(dict(case.given)) for case in cases]
    return f"import course_probe; course_probe.answer({nonce!r}, {task.function})", given


def _outcomes(told: Any, count: int) -> list[tasks.Outcome] | None:
    """Outcomes of what a kernel told, or None if it is not of their form."""
    if not isinstance(told, list) or len(told) != count:
        return None
    outcomes = []
    for item in told:
        if not isinstance(item, dict) or item.get("kind") not in KINDS:
            return None
        texts = [item.get(key, "") for key in ("trouble", "printed", "warned")]
        overwrote = item.get("overwrote", [])
        if not isinstance(overwrote, list) or not all(isinstance(text, str) for text in (*texts, *overwrote)):
            return None
        answer = None
        if item["kind"] == "answer":
            try:
                answer = tasks.from_wire(base64.b64decode(item["answer"], validate=True))
            except Exception:  # whatever is wrong with bytes that anybody may have made
                return None
        trouble, printed, warned = (text[:MOST_TEXT] for text in texts)
        if item["kind"] != "answer" and not trouble:
            trouble = "It gave no answer and no reason."
        outcomes.append(tasks.Outcome(item["kind"], answer, trouble, printed, warned, tuple(overwrote)))
    return outcomes


def _first_line(source: str) -> str:
    """Where a statement stands in its cell, whose lines before it are empty comments here."""
    lines = source.split("\n")
    number = next((i for i, line in enumerate(lines) if line != "#"), 0)
    return f"line {number + 1}, `{lines[number].strip()[:MOST_LINE]}`,"


def _last_line(text: str) -> str:
    lines = [line.strip() for line in _COLOURS.sub("", text).splitlines() if line.strip()]
    return lines[-1][:MOST_TEXT].rstrip(".") if lines else "an error"
