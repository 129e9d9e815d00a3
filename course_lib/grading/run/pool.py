"""Several workers on this machine: jobs in, records out, in whatever order they are done."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import psutil

from course_lib.grading.records import Record

from .grade_submission import failed_record
from .scratch_folders import private_folder

__all__ = ["Engine", "WorkerProcess", "good_workers", "grade_jobs", "repeat_late"]

ROOT = Path(__file__).resolve().parents[3]
COMMAND = ("-P", "-m", "course_lib.grading.run.start_worker")
SECONDS_TO_END = 5
Engine = Callable[[Sequence[dict[str, Any]], Callable[[int, Record], None]], None]
"""What grades jobs and tells each record with its place."""
TRIES = 3
"""So often is an infrastructure failure tried before it is left in the ledger as one."""


def good_workers(memory_mb: float) -> int:
    """As many workers as there are cores, and as fit into the memory that is free."""
    free = psutil.virtual_memory().available / 1e6
    return max(
        1,
        min(
            len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1,
            int(free / (memory_mb + 500)),
        ),
    )


class WorkerProcess:
    """One worker process; it is started again if it dies."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def grade(self, job: dict[str, Any]) -> Record:
        """The record of one job; of status "infrastructure" if the worker died over it."""
        process = self._process
        if process is None or process.poll() is not None:
            process = self._process = _start()
        try:
            process.stdin.write(json.dumps(job).encode() + b"\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except (BrokenPipeError, OSError):
            line = b""
        if not line:
            self.stop()
            return failed_record(job, "worker", "the worker that graded this submission ended.")
        return json.loads(line)

    def stop(self, gently: bool = True) -> None:
        """End the worker and what it started; gently lets it tidy up, which one that grades would not notice."""
        process, self._process = self._process, None  # the thread that waits for its record may stop it, too
        if process is None:
            return
        process.stdin.close()
        try:
            process.wait(SECONDS_TO_END if gently else 0.05)
        except subprocess.TimeoutExpired:
            process.terminate()
            try:
                process.wait(SECONDS_TO_END)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        process.stdout.close()


def _start() -> subprocess.Popen[bytes]:
    environment = {
        **os.environ,
        "TMPDIR": str(private_folder()),
        "PYTHONPATH": str(ROOT),
        "OPENBLAS_NUM_THREADS": "1",
        "COURSE_QUIET": "1",
    }
    return subprocess.Popen(
        [sys.executable, *COMMAND], stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd="/", env=environment
    )


def grade_jobs(jobs: Sequence[dict[str, Any]], workers: int, on_record: Callable[[int, Record], None]) -> None:
    """Grade jobs on workers of this machine; what runs out of time beside others is repeated alone.

    Parameters
    ----------
    on_record : called in this thread with the place of a job and its record, as soon as that is final.
    """
    if min(workers, len(jobs)) == 1:
        _grade_beside(jobs, 1, on_record)
    else:
        repeat_late(lambda some, keep: _grade_beside(some, workers, keep), jobs, on_record)


def repeat_late(grade: Engine, jobs: Sequence[dict[str, Any]], on_record: Callable[[int, Record], None]) -> None:
    """Grade jobs; those that ran out of time once more, one by one, when nobody else's code takes theirs."""
    late: list[int] = []

    def keep(place: int, record: Record) -> None:
        if any(task["reason"] == "timeout" for task in record["tasks"]):
            late.append(place)
        else:
            on_record(place, record)

    grade(jobs, keep)
    for place in late:
        grade([jobs[place]], lambda _, record, place=place: on_record(place, record))


def _grade_beside(jobs: Sequence[dict[str, Any]], workers: int, on_record: Callable[[int, Record], None]) -> None:
    private_folder()  # once, before there are threads
    waiting: queue.SimpleQueue[int] = queue.SimpleQueue()
    done: queue.SimpleQueue[tuple[int, Record | BaseException]] = queue.SimpleQueue()
    for place in range(len(jobs)):
        waiting.put(place)
    processes = [WorkerProcess() for _ in range(min(workers, len(jobs)))]
    ended = threading.Event()

    def serve(process: WorkerProcess) -> None:
        while not ended.is_set():
            try:
                place = waiting.get_nowait()
            except queue.Empty:
                return
            try:
                for _ in range(TRIES):
                    record = process.grade(jobs[place])
                    if record["status"] != "infrastructure" or ended.is_set():
                        break
                done.put((place, record))
            except BaseException as error:  # shown where the jobs were given
                done.put((place, error))
                return

    threads = [threading.Thread(target=serve, args=(process,), daemon=True) for process in processes]
    finished = False
    try:
        for thread in threads:
            thread.start()
        for _ in range(len(jobs)):
            place, record = done.get()
            if isinstance(record, BaseException):
                raise record
            on_record(place, record)
        finished = True
    finally:
        ended.set()
        for process in processes:
            process.stop(gently=finished)
        for thread in threads:
            thread.join(5)
