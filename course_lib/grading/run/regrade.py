"""After a judge was mended: grade the originals again with the same seeds; whose grade changes, and why."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from course_lib.grading.intake.intake import original
from course_lib.grading.ledger.ledger import Decision, Entry, Ledger, Run
from course_lib.grading.records import Record
from course_lib.grading.release.released import released_lab
from course_lib.grading.run.grade_submission import grader_version
from course_lib.grading.run.sandbox import machine

from .pool import Engine

__all__ = ["Change", "apply", "changes", "job_of", "outdated", "rerun"]

Outdated = tuple[Run, Entry, Record]
"""The run to grade in, the submission, and the record that it has."""


@dataclass(frozen=True)
class Change:
    """One task of one submission whose points change."""

    entry: Entry
    task: str
    old: float
    new: float
    why: str


def job_of(store: Path, run: Run, entry: Entry, seed: int, sandbox: str) -> dict[str, Any]:
    """What a worker needs to grade a submission in a run."""
    data = original(store, entry.sha256) if entry.sha256 and not entry.trouble else b""
    return {
        "submission": entry.sha256,
        "notebook": base64.b64encode(data).decode(),
        "lab": run.lab,
        "seed": seed,
        "sandbox": sandbox,
        "limits": json.loads(run.limits),
    }


def outdated(ledger: Ledger, labs: Sequence[str]) -> list[Outdated]:
    """Graded submissions whose lab, tasks, grader or environment have changed since."""
    found = []
    for lab in labs:
        for entry in ledger.entries(lab):
            if entry.run is None or entry.status == "infrastructure" or entry.trouble:
                continue
            before = ledger.run(entry.run)
            run = replace(before, lab_version=released_lab(lab).version, environment=machine(), grader=grader_version())
            if run != before:
                found.append((run, entry, ledger.newest(entry)))
    return found


def rerun(found: Sequence[Outdated], store: Path, sandbox: str, engine: Engine) -> list[Record]:
    """Grade again, with the seeds and limits of before; in the order of `found`."""
    jobs = [job_of(store, run, entry, old["seed"], sandbox) for run, entry, old in found]
    records: dict[int, Record] = {}
    engine(jobs, records.__setitem__)
    return [records[i] for i in range(len(jobs))]


def changes(found: Sequence[Outdated], records: Sequence[Record]) -> list[Change]:
    """Whose points change, and the judge's words for it; of what could not be graded nothing does."""
    result = []
    for (_, entry, old), new in zip(found, records, strict=True):
        before = {task["id"]: task for task in old["tasks"]}
        for task in new["tasks"] if _counts(old, new) else ():
            was = before.get(task["id"])
            if was is None or was["points"] == task["points"]:
                continue
            if was["version"] != task["version"]:
                cause = f"task version {was['version']} -> {task['version']}"
            elif old["lab_version"] != new["lab_version"]:
                cause = "the lab changed"
            else:
                cause = "the grader or its environment changed"
            result.append(Change(entry, task["id"], was["points"], task["points"], f"{cause}; now: {task['error']}"))
    return result


def _counts(old: Record, new: Record) -> bool:
    """Whether a new record may take the place of the old one: a grade always, no grade only that of none."""
    return new["status"] == "graded" or new["status"] == old["status"]


def apply(ledger: Ledger, found: Sequence[Outdated], records: Sequence[Record], never_lower: bool) -> tuple[int, int]:
    """Append the new records; with `never_lower`, also a decision for each task that would have lost points.

    Returns
    -------
    How many records were kept, and how many could not be graded, which changes nothing.
    """
    kept = 0
    for (run, entry, old), record in zip(found, records, strict=True):
        if _counts(old, record):
            ledger.record(ledger.begin_again(replace(run, isolation=record["isolation"])), entry, record)
            kept += 1
    if never_lower:
        decided = {(one.entry, one.task) for one in ledger.decisions()}
        why = "kept: a mended judge would have given less"
        ledger.decide(
            *(
                Decision(one.entry.student, one.entry.lab, "kept", "regrade --never-lower", why, *place, one.old)
                for one in changes(found, records)
                if one.new < one.old and (place := (one.entry.id, one.task)) not in decided
            )
        )
    return kept, len(found) - kept
