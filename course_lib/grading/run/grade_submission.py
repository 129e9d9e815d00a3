"""The unit of grading: the bytes of one notebook in, a record out. Runs in a process of its own (see `worker`)."""

from __future__ import annotations

import base64
import contextlib
import dataclasses
import hashlib
import tempfile
import time
import traceback
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from course_lib import tasks
from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.intake import Unreadable
from course_lib.grading.records import FORMAT, Notice, Record, TaskRecord
from course_lib.grading.release.rebuild import Answer, Rebuilt
from course_lib.grading.release.released import ReleasedLab, released_lab
from course_lib.grading.run.grader_version import grader_version
from course_lib.tasks.judging import UNSTEADY, Result
from course_lib.tasks.running import answered, asked

from .causes import with_causes
from .kernel_imports import Room, build_room, rooms_of
from .limits import Limits
from .reading import read_submission
from .sandbox import Held, NoSandbox, machine, probe_sandbox

if TYPE_CHECKING:
    from .engine import Run

__all__ = [
    *("Job", "failed_record", "fresh_cases", "grade_one", "grader_version", "held_by", "load_data", "prepare"),
    *("right_function", "unreadable_record"),
]

ROOT = Path(__file__).resolve().parents[3]
MOST_SOURCE = 20_000


class Job(TypedDict):
    """What `grade_one` needs; plain JSON, so that it travels anywhere."""

    submission: str
    notebook: str
    """The bytes as handed in, base64."""
    lab: str
    seed: int
    sandbox: str
    limits: dict[str, float]


def held_by(kind: str, *own: Path) -> Held:
    """How kernels are to be held, and see nothing of some folders. Raises NoSandbox where "bwrap" does not hold."""
    if kind == "none":
        return Held("none", (), "none: submitted code ran with the rights of the grader")
    return probe_sandbox(own)


def load_data() -> Callable[..., Any]:
    """The loader of real data for tasks that need them."""
    from course_lib.notebook import data

    return data.load


@dataclasses.dataclass(frozen=True)
class Prepared:
    """What all submissions of one lab share."""

    lab: ReleasedLab
    rooms: tuple[tuple[tuple[tasks.Task, ...], Room], ...]


_prepared: dict[tuple[str, str, str], tuple[Prepared, tempfile.TemporaryDirectory]] = {}


def prepare(number: str, limits: Limits, sandbox: str) -> Prepared:
    """The lab and the rooms of its tasks; made once a process, removed when it ends."""
    lab = released_lab(number)
    key = (lab.version, repr(limits), sandbox)
    if key not in _prepared:
        folder = tempfile.TemporaryDirectory(prefix="course-room-")
        rooms = []
        for i, group in enumerate(rooms_of(slot.task for slot in lab.slots)):
            place = Path(folder.name) / f"room{i}"
            place.mkdir()
            rooms.append((group, build_room(place, group, limits)))
        _prepared[key] = (Prepared(lab, tuple(rooms)), folder)
    return _prepared[key][0]


def grade_one(job: Job) -> Record:
    """Grade one submission.

    Parameters
    ----------
    job : plain JSON; the seed decides the fresh inputs.

    Returns
    -------
    A record; of status "infrastructure" where the grader itself failed, which is never scored.
    """
    started = time.perf_counter()
    limits = Limits.from_dict(job.get("limits", {}))
    record = _empty(job)
    try:
        held = held_by(job["sandbox"])
        record["isolation"] = held.words
        prepared = prepare(job["lab"], limits, job["sandbox"])
        _grade(job, record, prepared, held, limits)
    except NoSandbox as error:
        _failed(record, "no sandbox", str(error))
    except Exception as error:  # the grader's own trouble, whatever it is: said, kept, retried, never scored
        where = traceback.extract_tb(error.__traceback__)[-1]
        _failed(record, "grader", f"{type(error).__name__}: {error} ({Path(where.filename).name}, line {where.lineno})")
    record["seconds"]["all"] = round(time.perf_counter() - started, 3)
    return record


def _empty(job: Job) -> Record:
    lab = released_lab(job["lab"])
    return Record(
        format=FORMAT,
        submission=job["submission"],
        lab=job["lab"],
        lab_version=lab.version,
        seed=job["seed"],
        environment=machine(),
        grader=grader_version(),
        isolation="",
        status="graded",
        reason="",
        notices=[],
        tasks=[],
        points=0.0,
        max=lab.points,
        seconds={},
    )


def failed_record(job: Job, code: str, sentence: str) -> Record:
    """The record of a submission that the grader could not grade."""
    record = _empty(job)
    _failed(record, code, sentence)
    return record


def unreadable_record(job: Job, code: str, sentence: str) -> Record:
    """The record of a submission of which nothing could be run: 0 points, its reason, and work for a person."""
    record = _empty(job)
    record.update(status="unreadable", reason=sentence)
    record["notices"].append(Notice(code=code, task="", text=sentence))
    slots = released_lab(job["lab"]).slots
    record["tasks"] = [_task_record(slot.task, "missing", "unreadable", sentence) for slot in slots]
    return record


def _failed(record: Record, code: str, sentence: str) -> None:
    record.update(status="infrastructure", reason=sentence, tasks=[], points=0.0)
    record["notices"].append(Notice(code=code, task="", text=sentence))


def _grade(job: Job, record: Record, prepared: Prepared, held: Held, limits: Limits) -> None:
    from .engine import Run, run_notebook  # brings pytest and nbval: 0.3 s that most verbs can do without

    lab = prepared.lab
    try:
        older, rebuilt, refused = read_submission(base64.b64decode(job["notebook"]), lab, limits)
    except Unreadable as error:
        record.update(unreadable_record(job, error.code, error.sentence) | {"isolation": record["isolation"]})
        return
    if older:
        _failed(record, "older release", older)
        return
    cases = {slot.task.id: fresh_cases(slot.task, job["seed"]) for slot in lab.slots}
    done: dict[str, Run] = {}
    left = limits.total_seconds
    for group, room in prepared.rooms:
        with tempfile.TemporaryDirectory(prefix="cg-", ignore_cleanup_errors=True) as name:
            wanted = {task.id: asked(task, cases[task.id]) for task in group if not refused.get(task.id)}
            run = Run(held, room, limits, Path(name), wanted, left=left)
            began = time.perf_counter()
            run_notebook(run, _part(rebuilt, set(wanted)))
            left = run.left
            record["seconds"]["run"] = record["seconds"].get("run", 0.0) + round(time.perf_counter() - began, 3)
        done |= {task.id: run for task in group}
        record["notices"] += run.notices
    record["notices"] = rebuilt.notices + record["notices"]
    record["tasks"] = [
        _judge(answer, cases[answer.slot.task.id], done[answer.slot.task.id], refused.get(answer.slot.task.id, ""))
        for answer in rebuilt.answers
    ]
    for task in record["tasks"]:
        if task["points"] < task["max"]:
            task["error"] = with_causes(task, done[task["id"]].raised.get(task["id"], ""), limits)
    record["points"] = round(sum(task["points"] for task in record["tasks"]), 2)


def fresh_cases(task: tasks.Task, seed: int) -> tuple[tasks.Case, ...]:
    """The inputs of a task under the seed of a run: from a stream of its own, so that no task's tell another's."""
    own = int.from_bytes(hashlib.sha256(f"inputs of {task.id} {seed}".encode()).digest()[:8], "big")
    return tasks.fresh(task, own, load_data() if task.data else None)


def _part(rebuilt: Rebuilt, wanted: set[str]) -> Rebuilt:
    """The rebuilt notebook with the answers of some tasks only."""
    return Rebuilt(rebuilt.given, [a for a in rebuilt.answers if a.slot.task.id in wanted], [])


def _judge(answer: Answer, cases: tuple[tasks.Case, ...], run: Run, refused: str) -> TaskRecord:
    """What one answer earned."""
    task = answer.slot.task
    if answer.state == "stub":
        return _task_record(task, "not started", "not started", "", answer)
    if answer.state == "text":
        record = _task_record(task, "by hand", "text cell", answer.trouble, answer)
        return {**record, "text": record["source"]}
    if answer.state == "missing":
        return _task_record(task, "missing", "missing", f"No cell defines {task.function}.", answer)
    if answer.state == "broken":
        return _task_record(task, "raised", "not Python", f"Its cell is not Python: {answer.trouble}.", answer)
    if refused:
        return _task_record(task, "refused", "refused", refused, answer)
    if task.id in run.reasons:
        code, sentence = run.reasons[task.id]
        if code == "no function" and task.id in run.raised:
            return _task_record(task, "raised", "raised", f"In its cell, {run.raised[task.id]}.", answer)
        return _task_record(task, "no answer", code, sentence, answer)
    outcomes = answered(task, run.outcomes[task.id])
    result = tasks.judge_all(task, cases, outcomes, right_function(task))
    return _of_result(result, answer, outcomes)


@lru_cache(maxsize=64)
def right_function(task: tasks.Task) -> Callable[..., Any] | None:
    """The course's own answer, by which slips of the inputs are known again; an instructor's task may have none."""
    from course_lib.authoring import solutions

    with contextlib.suppress(CourseError):
        return solutions.right_function(task)
    return None


def _of_result(result: Result, answer: Answer, outcomes: list[tasks.Outcome]) -> TaskRecord:
    reason = {"passed": "", "failed": "wrong"}.get(result.status, result.status)
    record = _task_record(result.task, result.status, reason, result.error, answer)
    record["points"] = result.points
    record["looks_like"] = result.looks_like
    record["misconceptions"] = list(result.diagnosis.counted) if result.diagnosis else []
    record["told"] = result.told
    record["error"] += f" {UNSTEADY}" if result.unsteady else ""
    if result.task.kind == "explain" and outcomes[0].kind == "answer":
        record["text"] = str(outcomes[0].answer)[:MOST_SOURCE]
    return record


def _task_record(task: tasks.Task, status: Any, reason: str, error: str, answer: Answer | None = None) -> TaskRecord:
    return TaskRecord(
        id=task.id,
        number=task.number,
        title=task.title,
        kind=task.kind,
        version=task.version,
        max=float(task.points),
        points=0.0,
        status=status,
        reason=reason,
        error=error,
        looks_like="",
        misconceptions=[],
        where=f"Where to look: {task.where}.",
        told="",
        source=answer.source[:MOST_SOURCE] if answer else "",
        text="",
    )
