"""Making submissions for tests: a released exercise with other sources in its cells; grading one."""

from __future__ import annotations

import base64
import hashlib
import os
import time
from collections.abc import Sequence
from pathlib import Path

import nbformat
import psutil
import pytest

from course_lib.authoring import solutions
from course_lib.grading.records import Record, TaskRecord
from course_lib.grading.release.released import released_lab
from course_lib.grading.run.grade_submission import grade_one
from course_lib.grading.run.sandbox import NoSandbox, probe_sandbox

ROOT = Path(__file__).resolve().parents[2]
QUICK = {"cell_seconds": 3.0, "task_seconds": 3.0, "grace_seconds": 0.5}


def exercise(lab: str) -> nbformat.NotebookNode:
    """The exercise of a lab, as released."""
    return nbformat.read(next((ROOT / "exercises").glob(f"{lab}_*.ipynb")), as_version=4)


def submission(lab: str, answers: dict[int, str] | None = None, *, solved: bool = False) -> bytes:
    """A notebook handed in: sources by task number; with `solved`, the reference for all others."""
    nb = exercise(lab)
    for slot in released_lab(lab).slots:
        cell = next(cell for cell in nb.cells if cell.id == slot.cell)
        if solved:
            cell.source = solutions.reference(slot.task.id)
        cell.source = (answers or {}).get(slot.task.number, cell.source)
    return nbformat.writes(nb).encode()


def job(lab: str, data: bytes, *, seed: int = 5, sandbox: str = "bwrap", **limits: float) -> dict:
    """What `grade_one` takes."""
    return {
        "submission": hashlib.sha256(data).hexdigest(),
        "notebook": base64.b64encode(data).decode(),
        "lab": lab,
        "seed": seed,
        "sandbox": sandbox,
        "limits": {**QUICK, **limits},
    }


def graded(lab: str, data: bytes, **rest: float) -> Record:
    """Grade bytes in this process."""
    return grade_one(job(lab, data, **rest))


def task(record: Record, number: int) -> TaskRecord:
    """One task of a record."""
    return next(one for one in record["tasks"] if one["number"] == number)


def need_sandbox() -> None:
    """Skip where submitted code cannot be held; fail there if COURSE_REQUIRE_SANDBOX=1 (as .ci/run asks)."""
    try:
        probe_sandbox()
    except NoSandbox as error:
        if os.environ.get("COURSE_REQUIRE_SANDBOX") == "1":
            pytest.fail(f"the sandbox tests must run here, and cannot: {error}")
        pytest.skip(f"NOT TESTED: no submitted code can be held here: {error}")


def alive_after(family: Sequence[psutil.Process], seconds: float = 10) -> list[psutil.Process]:
    """Those that still run after so long at most; one that has ended and waits to be collected does not run."""
    end = time.monotonic() + seconds
    while (alive := [one for one in family if _runs(one)]) and time.monotonic() < end:
        time.sleep(0.02)
    return alive


def _runs(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
