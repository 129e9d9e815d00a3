"""Calling learners' functions: copies in, copies out, and a sentence for whatever they raise."""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pytest
import task_proofs as proofs
from tiny_tasks import RIGHT, TASK

from course_lib.tasks import Case, run, run_all

CASE = Case({"image": np.arange(6.0).reshape(2, 3), "scale": 1000, "options": {"names": ["a", "b"]}})


def outcome(body: str, arguments: str = "image, scale, options") -> object:
    return run(proofs.defined(f"def answer({arguments}):\n    {body}\n", "answer"), CASE)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("return image / 0 + missing", "raised NameError: name 'missing' is not defined. It was given image"),
        ("return answer(image, scale, options)", "RecursionError: it calls itself without end"),
        ("exit()", "raised SystemExit: it ended the program, where it should return an answer"),
        ("raise GeneratorExit", "raised GeneratorExit."),
        ("raise ValueError('two\\nlines  of' + 'x' * 500)", "raised ValueError: two lines ofxxx"),
        ("return image @ image", "raised ValueError: matmul"),
        ("assert False", "raised AssertionError."),
        ("raise Exception()", "raised Exception."),
    ],
)  # fmt: skip
def test_exceptions_become_a_sentence(body: str, words: str) -> None:
    result = outcome(body)
    assert result.kind == "raised"
    assert words in result.trouble
    assert "\n" not in result.trouble and len(result.trouble) < 420
    assert "scale = 1000" in result.trouble


def test_the_line_in_the_cell_is_shown() -> None:
    shell = proofs.Shell()
    shell.run("def helper(z):\n    return z / wrong\n\n\ndef answer(image, scale, options):\n    return helper(image)")
    result = run(shell.run("answer"), CASE)
    assert result.trouble.startswith("Line 2 of your cell, `return z / wrong`, raised NameError")
    shell.run("def answer(image, scale, options):\n    return np.linalg.inv(image)")
    assert run(shell.run("answer"), CASE).trouble.startswith(
        "Line 2 of your cell, `return np.linalg.inv(image)`, raised"
    )


def test_the_line_is_the_learners_and_not_one_of_a_compiled_module() -> None:
    shell = proofs.Shell()
    shell.run(
        "from scipy.spatial import cKDTree\n\n"
        "def answer(image, scale, options):\n    return cKDTree(np.zeros((2, 2))).query([np.nan, 0])"
    )
    assert run(shell.run("answer"), CASE).trouble.startswith("Line 4 of your cell, `return cKDTree(")


def test_only_an_open_stub_is_not_started() -> None:
    assert outcome('raise NotImplementedError("Task 1: x")').kind == "not started"
    shell = proofs.Shell()
    shell.run("class Table:\n    pass")
    assert outcome("return options.no_such_thing").kind == "raised"
    library = proofs.defined(
        "from concurrent.futures import Executor\n\ndef answer(image, scale, options):\n    Executor().submit(1)\n",
        "answer",
    )
    assert run(library, CASE).kind == "raised"


def test_a_stub_is_tried_once_and_a_half_done_answer_is_no_stub() -> None:
    calls = []

    def stub(pixels: object, z: object, f: object) -> None:
        calls.append(1)
        raise NotImplementedError("Task 1")

    assert [o.kind for o in run_all(stub, TASK.public())] == ["not started"] * 2
    assert len(calls) == 1

    def half(pixels: np.ndarray, z: np.ndarray, f: float) -> np.ndarray:
        if len(z) > 1:
            raise NotImplementedError("later")
        return pixels * z / f

    assert [o.kind for o in run_all(half, TASK.public())] == ["answer", "raised"]


def test_inputs_and_answers_are_copies() -> None:
    kept: list[np.ndarray] = []

    def sneaky(image: np.ndarray, scale: int, options: dict) -> np.ndarray:
        image += 1
        options["names"].append("c")
        kept.append(image)
        return image

    first = run(sneaky, CASE)
    kept[0][:] = 99
    assert first.answer.max() == 6
    assert CASE.given["image"].max() == 5
    assert CASE.given["options"] == {"names": ["a", "b"]}


def test_prints_and_warnings_are_kept_short() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = outcome("print('x' * 10_000_000); import sys; print('e', file=sys.stderr); return 1 / np.zeros(2)")
    assert result.kind == "answer"
    assert result.printed == "x" * 400
    assert result.warned == "RuntimeWarning: divide by zero encountered in divide"
    assert sys.stdout is not None


def test_what_is_not_plain_is_said() -> None:
    result = outcome("return (n for n in range(3))")
    assert result.kind == "not plain"
    assert result.trouble == "The answer is a generator, which holds no values yet: return a list or an array."


def test_interrupting_gets_out() -> None:
    with pytest.raises(KeyboardInterrupt):
        outcome("raise KeyboardInterrupt")


def test_right_answer() -> None:
    assert [o.kind for o in run_all(proofs.defined(RIGHT, "lift"), TASK.public())] == ["answer", "answer"]
