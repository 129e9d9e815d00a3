"""Making what a lab keeps of its wrong answers: each registered mistake and slip of the inputs, on each public case."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.authoring.needed_data import missing_data
from course_lib.authoring.tree import Tree
from course_lib.notebook import data
from course_lib.tasks.core import Case, Task
from course_lib.tasks.diagnosis.agreement import leaves
from course_lib.tasks.diagnosis.diagnose import changed, slip_key
from course_lib.tasks.diagnosis.public_answers import Kept, file_of, keep, name_of, pack, unpack
from course_lib.tasks.diagnosis.recognition import Wrong, wrong_answer
from course_lib.tasks.diagnosis.slips import input_slips
from course_lib.tasks.plain import same

MOST_BYTES = 1_000_000
MOVED = 1e-6
"""Relative: values that moved by less are kept as they stand."""


def wrong_answers(task: Task, case: Case, right: Callable[..., Any] | None) -> dict[str, Wrong]:
    """By name, what each mistake and each slip of the inputs answers to a case."""
    found = {
        name_of(m.name, i): wrong_answer(task, source, case)
        for m in task.misconceptions
        for i, source in enumerate(m.sources)
    }
    if right is not None:
        found |= {slip_key(slip): changed(task, case, slip, right) for slip in input_slips(case.given)}
    return found


def kept_of(task: Task, tree: Tree) -> list[Kept]:
    """What is kept of a task, a case after the other; slips that are far from the truth in no case are left out."""
    cases = task.public(data.load if task.data else None)
    right = solutions.right_function(task, tree.root)
    answers = [wrong_answers(task, case, right) for case in cases]
    telling = {name for each in answers for name, wrong in each.items() if wrong.far or name.startswith("mistake: ")}
    return [
        keep(
            {name: wrong for name, wrong in each.items() if name in telling},
            {name: _tolerance(task, case, wrong) for name, wrong in each.items()},
            case.name,
        )
        for case, each in zip(cases, answers, strict=True)
    ]


def _tolerance(task: Task, case: Case, wrong: Wrong) -> float:
    return task.judge(case, wrong.outcome.answer).tolerance if wrong.outcome.kind == "answer" else 0.0


def write_public(lab: str, tree: Tree) -> str:
    """Write what a lab keeps; what is said of it, "" where nothing changed.

    A task whose real data are not here keeps what stands there, and so does one whose values did not move.
    """
    path = file_of(lab)
    old = unpack(path)
    new = {}
    for task in tasks.lab(lab):
        if not task.misconceptions and task.kind in ("open", "which", "explain"):
            continue
        made = old.get(task.id, []) if missing_data(set(task.data)) else kept_of(task, tree)
        new[task.id] = old[task.id] if task.id in old and _alike(old[task.id], made) else made
    content = pack(new)
    if path.is_file() and path.read_bytes() == content:
        return ""
    path.write_bytes(content)
    return f"{tree.relative(path)} ({len(content) / 1e3:.0f} kB)"


def _alike(old: list[Kept], new: list[Kept]) -> bool:
    return len(old) == len(new) and same(old, new, MOVED)


def stale_public(lab: str, tree: Tree) -> list[str]:
    """What is wrong with the file of a lab, without running anything: names that lack or are too many, its size."""
    path = file_of(lab)
    kept = unpack(path)
    found = []
    for task in tasks.lab(lab):
        wanted = {name_of(m.name, i) for m in task.misconceptions for i in range(len(m.sources))}
        for case in kept.get(task.id, [{"names": []}] if wanted else []):
            there = {name for name in case["names"] if name.startswith("mistake: ")}
            if there != wanted:
                found.append(f"{tree.relative(path)}: task {task.id} has other mistakes than are kept; build lab {lab}")
                break
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        found.append(f"{tree.relative(path)} has {path.stat().st_size / 1e6:.1f} MB: 1 MB is the most")
    return found


def told_apart(kept: list[Kept]) -> tuple[list[tuple[int, int]], int, int]:
    """How many wrong answers show in each case and how many different ones these are; the same over all cases."""
    rows = []
    every: dict[str, list[bytes]] = {}
    for case in kept:
        keys = [_key(case, i) for i in range(len(case["names"]))]
        shown = [key for key, far in zip(keys, case["far"], strict=True) if far]
        rows.append((len(shown), len(set(shown))))
        for name, key, far in zip(case["names"], keys, case["far"], strict=True):
            every.setdefault(name, []).append(key if far else b"")
    anywhere = [tuple(keys) for keys in every.values() if any(keys)]
    return rows, len(anywhere), len(set(anywhere))


def _key(case: Kept, i: int) -> bytes:
    """What tells one answer of a case from another, to nine digits."""
    value = case["values"][i]
    form, parts = (case["forms"][value["form"]]["form"], value["values"]) if case["sampled"][i] else leaves(value)
    digits = [f"{number:.9g}" for part in parts for number in part.reshape(-1).astype(float)]
    return "|".join([form, *digits]).encode()


def table(tree: Tree) -> str:
    """For each task, how many wrong answers its checks know and how many of them each public case tells apart."""
    rows = ["| task | mistakes | slips | shown, different | in each case |", "|---|---|---|---|---|"]
    for lab in tasks.lab_numbers():
        for task_id, kept in sorted(unpack(file_of(lab)).items()):
            if not kept:
                continue
            names = kept[0]["names"]
            mistakes = sum(name.startswith("mistake: ") for name in names)
            cases, shown, different = told_apart(kept)
            each = ", ".join(f"{some}/{few}" for some, few in cases)
            rows.append(f"| {task_id} | {mistakes} | {len(names) - mistakes} | {shown}, {different} | {each} |")
    return "\n".join(rows)
