"""nbval runs the rebuilt notebook; after the cells of each task a probe asks its function, and nothing is believed.

The items are nbval's own cells and one probe a task. The kernel behind them is watched from outside: its death, its
memory, its processes, what it prints and how long it takes. What strikes names its limit, and costs the task that runs.
"""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest

from course_lib.grading.records import Notice
from course_lib.grading.release.rebuild import Rebuilt
from course_lib.grading.run.nbval_items import File, Run

from .kernel import Strike

__all__ = ["Run", "run_notebook"]

INI = "[pytest]\naddopts =\n"
MOST_LINES = 2_000
"""A cell's lines are counted in messages up to here; a million empty ones before each statement would fill memory."""


class _Plugin:
    """Collects the one notebook."""

    def __init__(self, run: Run) -> None:
        self.run = run

    def pytest_collect_file(self, file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
        if file_path.suffix != ".ipynb":
            return None
        file = File.from_parent(parent, path=file_path)
        file.run = self.run
        return file


@contextlib.contextmanager
def _no_other_plugins() -> Iterator[None]:
    """Within this block pytest loads no plugin but those that are named: not what else is installed here."""
    name = "PYTEST_DISABLE_PLUGIN_AUTOLOAD"
    before = os.environ.get(name)
    os.environ[name] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def run_notebook(run: Run, rebuilt: Rebuilt) -> None:
    """Run the rebuilt notebook of one room under pytest and nbval; what comes of it is in `run`.

    Raises
    ------
    RuntimeError
        If pytest or the kernel could not start: the grader's own trouble, never the learner's.
    """
    place = run.folder / "pytest"
    place.mkdir()
    cells = []

    def add(task: str, source: str, line: int = 1, probe: bool = False) -> None:
        cell = nbformat.v4.new_code_cell(
            "#\n" * min(line - 1, MOST_LINES) + source, metadata={"task": task, "probe": probe}
        )
        cells.append(cell)

    for piece in rebuilt.given:
        add("", piece.source, piece.line)
    for answer in rebuilt.answers:
        task = answer.slot.task.id
        if task in run.cases and answer.state == "found":
            for piece in answer.pieces:
                add(task, piece.source, piece.line)
            add(task, "", probe=True)
    if not any(cell.metadata["probe"] for cell in cells):
        return
    nbformat.write(nbformat.v4.new_notebook(cells=cells), place / "lab.ipynb")
    (place / "pytest.ini").write_text(INI, encoding="utf-8")
    words = ["-c", str(place / "pytest.ini"), "--rootdir", str(place), "--noconftest", "-p", "no:cacheprovider"]
    words += ["-p", "no:faulthandler", "-p", "no:unraisableexception", "-p", "no:threadexception", "--capture=no"]
    words += ["-q", "--color=no", "--tb=no", "-p", "nbval.plugin", str(place / "lab.ipynb")]
    said = io.StringIO()
    with _no_other_plugins(), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = pytest.main(words, plugins=[_Plugin(run)])
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        raise RuntimeError(f"pytest ended with {code!r}: {said.getvalue()[-600:]}")
    if run.trouble:
        raise RuntimeError(run.trouble)
    probed = {cell.metadata["task"] for cell in cells if cell.metadata["probe"]}
    lost = sorted(probed - set(run.outcomes) - set(run.reasons))
    if lost:
        raise RuntimeError(f"{lost} was not asked: {said.getvalue()[-600:]}")
    for nonce, count in run.came.items():
        if count > 1 and run.nonces[nonce] in run.outcomes:
            run.strike(run.nonces[nonce], Strike("doubled", "A second answer came late, so none counts."))
    if run.strange:
        text = f"{run.strange} answers came that nobody had asked for; they were not read."
        run.notices.append(Notice(code="strange answers", task="", text=text))
