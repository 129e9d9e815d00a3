"""How a grade came to be: every step from the bytes handed in to the points, as text."""

from __future__ import annotations

from collections.abc import Iterator

from course_lib import tasks
from course_lib.grading.ledger.attempts import Standing, policy_of, standings
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.safe_text import clean

__all__ = ["explain", "waiting"]


def explain(ledger: Ledger, one: Standing, task: tasks.Task) -> Iterator[str]:
    """The lines that explain one task of one student."""
    yield f"{clean(one.name)} ({clean(one.student)}), lab {one.lab}, {task.label}"
    yield ""
    attempts = sorted(
        (entry for entry in ledger.entries(one.lab) if entry.student == one.student), key=lambda entry: entry.attempt
    )
    yield f"Handed in: {len(attempts)} of {len(attempts)} kept as they came."
    for entry in attempts:
        mark = "->" if one.entry is not None and entry.id == one.entry.id else "  "
        late = ", marked late" if entry.late else ""
        yield f" {mark} attempt {entry.attempt}: {clean(entry.path)}, received {entry.received or 'unknown'}{late}"
        yield f"      sha256 {entry.sha256 or 'none'}" + (f"; {clean(entry.trouble)}" if entry.trouble else "")
    yield f"The attempt that counts (->) is the {policy_of(ledger).counts} one."
    if one.record is None:
        yield "Nothing of it has been graded."
        return
    record = one.record
    yield ""
    yield f"Graded with lab version {record['lab_version']}, seed {record['seed']}, grader {record['grader']},"
    yield f"  {record['environment']}, held by {record['isolation'] or 'nothing: it was not run'}."
    for notice in record["notices"]:
        if notice["task"] in ("", task.id):
            yield f"  seen: {clean(notice['text'])} [{notice['code']}]"
    mine = next((item for item in one.tasks if item.id == task.id), None)
    if mine is None:
        yield f"No points: {clean(record['reason']) or 'the task is not in the record.'}"
        return
    yield ""
    yield "What was run:"
    yield from (f"  | {clean(line)}" for line in mine.record["source"].split("\n"))
    yield ""
    yield f"The judge: {mine.record['status']}. {clean(mine.record['error'], 2000)}"
    if mine.record["told"]:
        yield f"  In the case with {clean(mine.record['told'], 2000)}."
    if mine.record["looks_like"]:
        yield f"  {clean(mine.record['looks_like'], 2000)} [{', '.join(mine.record['misconceptions'])}]"
    yield f"Points by the grader: {mine.auto:g} of {mine.max:g} (task version {mine.record['version']})."
    numbers = {entry.id: f", attempt {entry.attempt}" for entry in attempts}
    for decision in ledger.decisions(one.student, one.lab):
        if decision.task in (task.id, ""):
            points = "" if decision.points is None else f" {decision.points:g} points"
            of = numbers.get(decision.entry, "") if len(attempts) > 1 else ""
            yield f"  {decision.added}{of}: {decision.kind}{points} by {clean(decision.who)}: {clean(decision.reason)}"
    if mine.before:
        yield "  Decide again: what was decided of an earlier attempt does not count for this one."
    yield f"Points that count: {mine.points:g} of {mine.max:g}{', and a person must decide' if mine.open else ''}."
    yield ""
    yield f"The lab: {one.raw:g} in sum. {one.late_reason or 'Not late.'} Total: {one.points:g} of {one.max:g}."
    if one.status != "graded":
        yield f"It stands as: {one.status}."


def waiting(ledger: Ledger) -> Iterator[str]:
    """What waits for a person, with the number of each submission."""
    everybody = ledger.entries()
    known = {(one.sha256, one.path) for one in everybody if one.lab}
    for entry in everybody:
        if not entry.lab and (entry.sha256, entry.path) not in known:
            why = clean(entry.trouble) or "say which lab with grade --lab NAME"
            yield f"no lab: {clean(entry.named)}, number {entry.id}, {clean(entry.path)}: {why}"
    for one in standings(ledger):
        where = f"{clean(one.name)}, lab {one.lab}"
        if one.entry is not None and (one.waits or one.status == "infrastructure"):
            reason = one.waits or (one.record["reason"] if one.record is not None else "not graded yet")
            what = "decide" if one.status == "graded" else one.status
            yield f"{what}: {where}, number {one.entry.id}, {clean(one.entry.path)}: {clean(reason, 2000)}"
        by_hand = [task for task in one.tasks if task.open and not task.before and task.record["reason"] == "by hand"]
        if one.to_mark and by_hand:
            yield f"to mark: {where}, {len(by_hand)} by hand"
