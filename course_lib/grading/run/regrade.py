"""After a judge was mended: grade the originals again with the same seeds; whose grade changes, and why."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from course_lib.grading.intake.intake import original
from course_lib.grading.ledger.ledger import Entry, Ledger, Run
from course_lib.grading.records import Record
from course_lib.grading.release.released import released_lab
from course_lib.grading.run.grade_submission import grader_version, held_by
from course_lib.grading.run.limits import read_limits
from course_lib.grading.run.sandbox import machine

__all__ = ["Change", "apply", "outdated", "rerun"]


@dataclass(frozen=True)
class Change:
    """One task of one student whose points change."""

    student: str
    lab: str
    task: str
    old: float
    new: float
    why: str


def outdated(ledger: Ledger, labs: Sequence[str]) -> list[tuple[Run, Entry, Record]]:
    """Graded submissions whose lab, tasks, grader or environment have changed since, with the run to grade them in."""
    found = []
    for lab in labs:
        version, grader, environment = released_lab(lab).version, grader_version(), machine()
        for entry in ledger.entries(lab):
            old = ledger.newest(entry)
            if old is None or old["status"] != "graded":
                continue
            if (old["lab_version"], old["grader"], old["environment"]) != (version, grader, environment):
                run = Run(0, lab, version, environment, grader, old["seed"], False, "")
                found.append((run, entry, old))
    return found


def rerun(
    found: Sequence[tuple[Run, Entry, Record]],
    store: Path,
    sandbox: str,
    engine: Callable[[Sequence[dict[str, Any]], Callable[[int, Record], None]], None],
) -> list[Record]:
    """Grade again; in the order of `found`."""
    held_by(sandbox, store)
    jobs = [
        {
            "submission": entry.sha256,
            "notebook": base64.b64encode(original(store, entry.sha256)).decode(),
            "lab": run.lab,
            "seed": run.seed,
            "sandbox": sandbox,
            "limits": read_limits().as_dict(),
        }
        for run, entry, _ in found
    ]
    records: dict[int, Record] = {}
    engine(jobs, records.__setitem__)
    return [records[i] for i in range(len(jobs))]


def changes(found: Sequence[tuple[Run, Entry, Record]], records: Sequence[Record]) -> list[Change]:
    """Whose points change, and the judge's words for it."""
    result = []
    for (run, entry, old), new in zip(found, records, strict=True):
        before = {task["id"]: task for task in old["tasks"]}
        for task in new["tasks"]:
            was = before.get(task["id"])
            if was is None or was["points"] == task["points"]:
                continue
            if was["version"] != task["version"]:
                cause = f"task version {was['version']} -> {task['version']}"
            elif old["lab_version"] != new["lab_version"]:
                cause = "the lab changed"
            else:
                cause = "the grader or its environment changed"
            points = (was["points"], task["points"])
            result.append(Change(entry.student, run.lab, task["id"], *points, f"{cause}; now: {task['error']}"))
    return result


def apply(
    ledger: Ledger,
    found: Sequence[tuple[Run, Entry, Record]],
    records: Sequence[Record],
    never_lower: bool,
) -> tuple[int, int]:
    """Append the new records; with `never_lower`, also a decision for each task that would have lost points.

    Returns
    -------
    How many records were kept, and how many could not be graded, which changes nothing.
    """
    kept = failed = 0
    lowered = [change for change in changes(found, records) if change.new < change.old]
    for (run, entry, _), record in zip(found, records, strict=True):
        if record["status"] != "graded":
            failed += 1
            continue
        ledger.record(run, entry, record)
        kept += 1
    if never_lower:
        why = "kept: a mended judge would have given less"
        decided = {(one.student, one.lab, one.task) for one in ledger.decisions()}
        rows = [
            (one.student, one.lab, one.task, "kept", one.old, "regrade --never-lower", why)
            for one in lowered
            if one.student and (one.student, one.lab, one.task) not in decided
        ]
        ledger.decide_all(rows)
    return kept, failed
