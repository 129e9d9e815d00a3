"""The same grading on an existing Dask cluster: bytes over, small JSON back, nothing of a student pickled.

Every worker of the cluster needs this course installed, at the same version, and bubblewrap. A Dask worker hands each
job to a `WorkerProcess` of its own, so that submissions run there as they do locally. An address must be `tls://…`
(with the certificates of Dask's configuration) or `inproc://…`: over plain TCP, whoever reaches the port can run code.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Sequence
from typing import Any

from course_lib.authoring.tree import CourseError
from course_lib.grading.records import Record
from course_lib.grading.release.released import released_lab

from .grade_submission import grader_version
from .pool import TRIES, WorkerProcess, repeat_late

__all__ = ["grade_on_cluster"]

SECONDS_TO_CONNECT = 20
_local = threading.local()


def _version(labs: Sequence[str]) -> list[str]:
    """What must be the same everywhere; runs on a worker."""
    return [grader_version(), *(released_lab(lab).version for lab in labs)]


def _grade(job: bytes) -> bytes:
    """Grade one job; runs on a worker, in one of its threads, on a process of that thread."""
    if not hasattr(_local, "process"):
        _local.process = WorkerProcess()
    return json.dumps(_local.process.grade(json.loads(job))).encode()


def grade_on_cluster(
    address: str, jobs: Sequence[dict[str, Any]], on_record: Callable[[int, Record], None], security: Any = None
) -> None:
    """Grade jobs on a cluster.

    Parameters
    ----------
    address : of the scheduler, "tls://host:8786" or "inproc://…".
    on_record : called once a job, in this thread, with its place and its record; what ran out of time is repeated.
    security : a `distributed.Security`; by default what Dask's configuration says.

    Raises
    ------
    CourseError
        If distributed is missing, the address is open to anybody, nobody answers there, or versions differ.
    """
    try:
        from distributed import Client, Security
    except ImportError:
        raise CourseError("grading on a cluster needs Dask: install the extra `dask` (uv sync --extra dask).") from None
    if not address.startswith(("tls://", "inproc://")):
        raise CourseError(f"{address} is open to everybody who reaches it: use a scheduler with TLS (tls://…).")
    try:
        client = Client(address, security=security or Security(), timeout=SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        raise CourseError(f"no Dask scheduler answers at {address}: {error}.") from error
    with client:
        _compare(client, sorted({job["lab"] for job in jobs}))
        repeat_late(lambda some, keep: _grade_some(client, some, keep), jobs, on_record)


def _grade_some(client: Any, jobs: Sequence[dict[str, Any]], on_record: Callable[[int, Record], None]) -> None:
    from distributed import as_completed

    tries = dict.fromkeys(range(len(jobs)), 1)
    places = {_submit(client, job): place for place, job in enumerate(jobs)}
    waiting = as_completed(list(places), loop=client.loop)
    for future in waiting:
        place = places[future]
        record = _record(future)
        if record is None or (record["status"] == "infrastructure" and tries[place] < TRIES):
            tries[place] += 1
            if tries[place] > 2 * TRIES:
                raise CourseError("the cluster loses every worker that grades: see its logs.")
            again = _submit(client, jobs[place])
            places[again] = place
            waiting.add(again)
        else:
            on_record(place, record)


def _submit(client: Any, job: dict[str, Any]) -> Any:
    """Send one job; never cached, since two students may hand in the same bytes."""
    return client.submit(_grade, json.dumps(job).encode(), pure=False, retries=TRIES)


def _record(future: Any) -> Record | None:
    """The record of a job, or None if its worker was lost."""
    if future.status != "finished":
        return None
    return json.loads(future.result())


def _compare(client: Any, labs: list[str]) -> None:
    """See to it that every worker grades as this copy does."""
    mine = _version(labs)
    theirs = client.run(_version, labs)
    if not theirs:
        raise CourseError("the cluster has no workers.")
    for worker, version in theirs.items():
        if version != mine:
            raise CourseError(f"the worker {worker} has another version of the course or its labs: update it.")
