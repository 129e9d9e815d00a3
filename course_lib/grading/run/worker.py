"""A process that grades one submission after another, each in a child of its own.

It has imported everything, knows the lab and has drawn the fresh inputs, so that a child starts at once; and nothing
that a submission does to the process that grades it can reach the next. Jobs come as lines of JSON on the standard
input, records go out likewise. Its children never outlive it: a sandbox that is being built cannot yet notice that its
parent is gone (bubblewrap asks for that only when it is done), so this process adopts whatever is left of a child, and
ends it after each job and when it must itself end.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import tempfile
import time
from typing import Any

import psutil

from course_lib.grading.records import Record

from . import engine  # noqa: F401 - for the children: each would import it again
from .die_with_parent import adopt_orphans, die_with_parent
from .grade_submission import failed_record, fresh_cases, grade_one, held_by, prepare, right_function
from .limits import Limits
from .reading import all_of

__all__ = ["main"]

SLACK_SECONDS = 60
"""What a child may take beyond the limits of its submission (start, judging) before it counts as hung."""
SECONDS_TO_END = 4
"""What ending a family may take, less than the pool waits: what is killed is gone at once, unless a disk holds it."""


def main() -> None:
    """Read jobs until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that gives the jobs
    signal.signal(signal.SIGTERM, _leave)
    adopt_orphans()
    die_with_parent(signal.SIGTERM)
    jobs = os.fdopen(os.dup(0), "rb")
    records = os.fdopen(os.dup(1), "wb")
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, 0)
    os.dup2(null, 1)
    for line in jobs:
        job = json.loads(line)
        record = grade_apart(job)
        _end_family()
        records.write(json.dumps(record).encode() + b"\n")
        records.flush()


def grade_apart(job: dict[str, Any]) -> Record:
    """Grade one job in a child process; a child that dies or hangs is an infrastructure failure."""
    limits = Limits.from_dict(job.get("limits", {}))
    _warm(job, limits)
    place = tempfile.mkdtemp(prefix="j")
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        code = 1
        try:
            tempfile.tempdir = place
            os.setsid()
            die_with_parent()
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, signal.SIG_DFL)
            with os.fdopen(writer, "wb") as out:
                out.write(json.dumps(grade_one(job)).encode())
            code = 0
        finally:
            os._exit(code)
    os.close(writer)
    try:
        text = all_of(reader, time.monotonic() + limits.total_seconds + limits.start_seconds + SLACK_SECONDS)
    finally:
        os.close(reader)
        _end(child)
        shutil.rmtree(place, ignore_errors=True)
    if not text:
        return failed_record(job, "grader", "the process that graded this submission ended without a word.")
    return json.loads(text)


def _warm(job: dict[str, Any], limits: Limits) -> None:
    """Do once what every child would do again; what fails here fails in the child, too, and is told there."""
    try:
        held_by(job["sandbox"])
        prepared = prepare(job["lab"], limits, job["sandbox"])
        for slot in prepared.lab.slots:
            fresh_cases(slot.task, job["seed"])
            right_function(slot.task)
    except Exception:
        return


def _end(child: int) -> None:
    """End a child, which has not been waited for yet, and everything that it started."""
    _kill_below(child)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _leave(number: int, frame: Any) -> None:
    """End with everything that was started, also what lost its parent on the way."""
    _end_family()
    os._exit(1)


def _end_family() -> None:
    """End every process below this one."""
    end = time.monotonic() + SECONDS_TO_END
    while _kill_below(os.getpid()) and time.monotonic() < end:
        try:
            while os.waitpid(-1, os.WNOHANG) != (0, 0):
                pass
        except ChildProcessError:
            return
        time.sleep(0.001)


def _kill_below(process: int) -> bool:
    """Kill every process below one; whether there was any."""
    family = psutil.Process(process).children(recursive=True)
    for one in family:
        with contextlib.suppress(psutil.NoSuchProcess):
            one.kill()
    return bool(family)
