"""The proofs of test_every_task*.py: each passes on a sound task and fails on one that lacks its property."""

from __future__ import annotations

import numpy as np
import pytest
import task_proofs as proofs
from how_thorough import sample
from tiny_tasks import NO_FOCAL, OPEN, RIGHT, SHIFTED, TASK, cases, spoiled

from course_lib.tasks.core import Case, Misconception
from course_lib.tasks.judges import judge_array

reference = proofs.defined(RIGHT, "lift")


def test_sound_task_stands() -> None:
    proofs.reference_stands(TASK, reference)
    proofs.garbage_gets_a_sentence(TASK, reference)
    proofs.inputs_are_safe(TASK, reference)
    proofs.guessing_does_not_pay(OPEN)
    proofs.reference_stands(OPEN, proofs.defined("def level(values):\n    return float(values.mean())\n", "level"))
    for misconception in TASK.misconceptions:
        proofs.misconception_shows(TASK, misconception)
    failed, judged = proofs.unfair_share(TASK, reference)
    assert judged > 100 * sample(10, 3) and failed == 0


def test_wrong_reference_is_caught() -> None:
    with pytest.raises(AssertionError, match="seed None: Task 1"):
        proofs.reference_stands(TASK, proofs.defined(SHIFTED.source, "lift"))


def test_reference_that_fails_on_some_seed_is_caught() -> None:
    def rare(rng: np.random.Generator) -> list[Case]:
        drawn = cases(rng)
        return drawn if rng.random() > 0.1 else [Case(drawn[0].given, {"truth": drawn[0].truth + 1})]

    with pytest.raises(AssertionError, match=r"seed \d+"):
        proofs.reference_stands(spoiled(cases=rare), reference)


def test_tolerance_too_tight_is_caught() -> None:
    def rounded(pixels: np.ndarray, z: np.ndarray, f: float) -> np.ndarray:
        return reference(pixels, z, f) + 5e-5

    with pytest.raises(AssertionError, match=r"more than 1/3"):
        proofs.reference_stands(TASK, rounded)


def test_misconception_that_passes_is_caught() -> None:
    right = Misconception("not wrong at all", "nothing", RIGHT)
    with pytest.raises(AssertionError, match="passes"):
        proofs.misconception_shows(spoiled(misconceptions=(right,)), right)


def test_misconception_that_hides_is_caught() -> None:
    near = Misconception("hardly off", "a hair", "def lift(pixels, z, f):\n    return pixels * z / f + 3e-4\n")
    with pytest.raises(AssertionError, match="never 5 tolerances"):
        proofs.misconception_shows(spoiled(misconceptions=(near,)), near)


def test_two_that_cannot_be_told_apart_are_caught_unless_named_alike() -> None:
    source = "def lift(pixels, z, f):\n    return z * pixels\n"
    twin = Misconception("only multiplied", "two numbers multiplied", source)
    with pytest.raises(AssertionError, match="is taken for"):
        proofs.misconception_shows(spoiled(misconceptions=(NO_FOCAL, twin)), NO_FOCAL)
    first = Misconception(NO_FOCAL.name, NO_FOCAL.message, NO_FOCAL.source, alike=(twin.name,))
    task = spoiled(misconceptions=(first, twin))
    proofs.misconception_shows(task, first)
    line = proofs.result_of(task, proofs.defined(source, "lift"), None).line
    assert "no division by the focal length, or like two numbers multiplied." in line


def test_judge_that_stumbles_over_garbage_is_caught() -> None:
    def stumbles(case: Case, answer: object) -> object:
        return judge_array(answer + 0, case.truth, 1e-4, "m")

    with pytest.raises(TypeError):
        proofs.garbage_gets_a_sentence(spoiled(judge=stumbles), reference)


def test_judge_that_takes_garbage_is_caught() -> None:
    def lenient(case: Case, answer: object) -> object:
        return judge_array(np.nan_to_num(np.asarray(answer, float)), np.nan_to_num(case.truth), 1e9, "m")

    with pytest.raises((AssertionError, TypeError, ValueError)):
        proofs.garbage_gets_a_sentence(spoiled(judge=lenient), reference)


def test_cases_that_do_not_follow_from_the_seed_are_caught() -> None:
    other = np.random.default_rng(0)
    with pytest.raises(AssertionError, match="a seed is not a seed"):
        proofs.inputs_are_safe(spoiled(cases=lambda rng: cases(other)), reference)


def test_judge_that_sees_spoiled_inputs_is_no_concern_because_they_are_copies() -> None:
    def by_inputs(case: Case, answer: object) -> object:
        return judge_array(answer, case.given["pixels"] * case.given["z"] / 525.0, 1e-4, "m")

    proofs.inputs_are_safe(spoiled(judge=by_inputs), reference)


def test_guess_that_pays_is_caught() -> None:
    from dataclasses import replace

    lucky = replace(OPEN, guess=lambda rng: lambda values: float(values.mean()))
    with pytest.raises(AssertionError, match=f"{len(proofs.SEEDS)} of {len(proofs.SEEDS)} random settings"):
        proofs.guessing_does_not_pay(lucky)


def test_public_cases_that_are_too_easy_are_caught() -> None:
    def growing(rng: np.random.Generator) -> list[Case]:
        z = np.full(3, 10 ** rng.uniform(-3, 3))
        return [Case({"pixels": np.ones(3), "z": z, "f": 1.0}, {"truth": z})]

    failed, judged = proofs.unfair_share(spoiled(cases=growing), reference)
    assert failed > 0.01 * judged
