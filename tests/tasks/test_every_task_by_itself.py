"""Every task of every lab there is, outside a notebook: on many drawings, on garbage, on guesses.

These take as long as those of test_every_task.py; two files can run side by side.
"""

from __future__ import annotations

import pytest
import task_proofs as proofs
from collected import TASKS, each_task, loader, reference

from course_lib.tasks.core import Task


@each_task
def test_reference_passes_on_many_seeds(task: Task) -> None:
    proofs.reference_stands(task, reference(task), loader(task))


@each_task
def test_garbage_gets_a_sentence(task: Task) -> None:
    proofs.garbage_gets_a_sentence(task, reference(task), loader(task))


@each_task
def test_inputs_are_safe(task: Task) -> None:
    proofs.inputs_are_safe(task, reference(task), loader(task))


@pytest.mark.parametrize("task", [t for t in TASKS if t.kind == "open"], ids=lambda task: task.id)
def test_guessing_does_not_pay(task: Task) -> None:
    proofs.guessing_does_not_pay(task, loader(task))


@each_task
def test_what_passes_in_public_passes_on_fresh_cases(task: Task) -> None:
    failed, judged = proofs.unfair_share(task, reference(task), loader(task))
    assert judged > 0
    assert failed < 0.01 * judged, f"{failed} of {judged} fail on fresh cases only"
