"""The public cases of a lab as data: what a release holds in the place of what draws them and of wrong answers' code.

Here there is no such file; `grading/release/bare_lab.py` writes it, and has a released lab's tasks ask this module.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from course_lib.tasks import registry
from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.diagnosis.public_answers import name_of, pack, unpack

FILE = "cases.npz"


def public_cases(task: Task, load: Callable[..., Any] | None) -> tuple[tuple[Case, ...], bool]:
    """The public cases of a task, drawn or, in a release, kept; and whether they are kept: then without real ones."""
    kept = _kept(task.id) if task.lab in registry.lab_numbers() else None
    if kept is None:
        return task.public(load), False
    cases = tuple(Case(case["given"], dict(case["hidden"]), case["name"]) for case in kept["cases"])
    if task.kind == "which":
        cases = tuple(Case(case.given, {**case.hidden, "truth": key(task.id)}, case.name) for case in cases)
    return cases, True


def mistakes(task_id: str) -> tuple[Misconception, ...]:
    """The mistakes of a task by name and words; what they answer is kept beside (see `public_answers`)."""
    return tuple(
        Misconception(
            one["name"],
            one["message"],
            name_of(one["name"], 0),
            tuple(one["alike"]),
            tuple(name_of(one["name"], i + 1) for i in range(one["variants"])),
        )
        for one in _of(task_id)["mistakes"]
    )


def key(task_id: str) -> dict[str, str]:
    """The key of a choice task, found by trying what its hashes may stand for: it is only not to be read by chance."""
    kept = _of(task_id)["key"]
    return {
        letter: next(cause for cause in kept["causes"] if _hash(kept["salt"], letter, cause) == digest)
        for letter, digest in kept["hashes"].items()
    }


def drawn_by_the_grader(*given: Any) -> Any:
    """Stands in a release for what draws cases or settings."""
    raise RuntimeError("this copy of the course holds the cases of its checks only; others are drawn when you hand in.")


def cases_file(tasks: Sequence[Task], choices: Mapping[str, Sequence[str]]) -> bytes:
    """The bytes of the file of a lab: made cases, mistakes by name, keys as salted hashes.

    Parameters
    ----------
    choices : what may be chosen in each choice task, by its id.
    """
    return pack({task.id: [_told(task, choices.get(task.id, ()))] for task in tasks})


def _told(task: Task, causes: Sequence[str]) -> dict[str, Any]:
    cases = [{"given": dict(c.given), "hidden": dict(c.hidden), "name": c.name} for c in task.public(None)]
    told: dict[str, Any] = {"cases": cases, "mistakes": [], "key": {}}
    for one in task.misconceptions:
        names = {"name": one.name, "message": one.message, "alike": list(one.alike), "variants": len(one.variants)}
        told["mistakes"].append(names)
    if task.kind == "which":
        salt = hashlib.sha256(f"key of {task.id}, version {task.version}".encode()).hexdigest()[:16]
        truth = cases[0]["hidden"].pop("truth")
        hashes = {letter: _hash(salt, letter, cause) for letter, cause in truth.items()}
        told["key"] = {"salt": salt, "hashes": hashes, "causes": list(causes)}
    return told


def _hash(salt: str, letter: str, cause: str) -> str:
    return hashlib.sha256(f"{salt} {letter} {cause}".encode()).hexdigest()


def _kept(task_id: str) -> dict[str, Any] | None:
    kept = unpack(registry.folder(task_id[:2]) / FILE).get(task_id)
    return kept[0] if kept else None


def _of(task_id: str) -> dict[str, Any]:
    kept = _kept(task_id)
    if kept is None:
        raise ValueError(f"no cases of task {task_id} are kept here.")
    return kept
