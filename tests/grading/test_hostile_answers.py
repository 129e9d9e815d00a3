"""Answers that are forged, doubled, stale, oversized, pickled or not finite: none is believed."""

from __future__ import annotations

import base64
import pickle
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from grading_helpers import graded, need_sandbox, submission, task

from course_lib import tasks
from course_lib.grading.records import TaskRecord
from course_lib.grading.run import nbval_items
from course_lib.grading.run.inside.course_probe import MIME
from course_lib.tasks.core import Task

pytestmark = pytest.mark.slow

WRONG = "def metres(depth_mm):\n    return depth_mm * 0.0\n"
RIGHT = "def metres(depth_mm):\n    return depth_mm / 1000\n"
PATCH = f"""
import base64
import IPython.display
from course_lib.tasks.plain import from_wire, to_wire

send = IPython.display.publish_display_data
MIME = {MIME!r}


def outcome(answer):
    return {{"kind": "answer", "answer": base64.b64encode(to_wire(answer)).decode(), "trouble": "", "printed": "",
            "warned": ""}}


def forged(data, *given, **named):
    FORGE


IPython.display.publish_display_data = forged
"""


def forging(code: str, answer: str = WRONG) -> bytes:
    return submission("00", {1: PATCH.replace("FORGE", code.replace("\n", "\n    ")) + answer})


FORGED = {
    "another nonce": ("send({MIME: {**data[MIME], 'nonce': 'f' * 32}})", "no answer"),
    "no nonce": ("send({MIME: {'answers': data[MIME]['answers']}})", "no answer"),
    "no answers": ("send({MIME: {'nonce': data[MIME]['nonce']}})", "forged"),
    "too few": ("send({MIME: {**data[MIME], 'answers': data[MIME]['answers'][:1]}})", "forged"),
    "too many": ("send({MIME: {**data[MIME], 'answers': data[MIME]['answers'] * 2}})", "forged"),
    "a kind of their own": (
        "send({MIME: {**data[MIME], 'answers': [{**a, 'kind': 'passed'} for a in data[MIME]['answers']]}})",
        "forged",
    ),
    "a text": ("send({MIME: 'passed'})", "no answer"),
    "a verdict": ("send({MIME: {**data[MIME], 'passed': True, 'points': 1}})", "wrong"),
    "no base64": (
        "send({MIME: {**data[MIME], 'answers': [{**a, 'answer': '%%%'} for a in data[MIME]['answers']]}})",
        "forged",
    ),
    "names that are no texts": (
        "send({MIME: {**data[MIME], 'answers': [{**a, 'overwrote': [1]} for a in data[MIME]['answers']]}})",
        "forged",
    ),
    "silence": ("None", "no answer"),
    "bytes that are cut": (
        "send({MIME: {**data[MIME], 'answers': [{**a, 'answer': a['answer'][:40]} for a in data[MIME]['answers']]}})",
        "forged",
    ),
}


@pytest.fixture(autouse=True)
def _sandbox() -> None:
    need_sandbox()


def several(answer_of: Callable[[str, Task], str], kinds: Sequence[str], before: str = "") -> dict[str, TaskRecord]:
    """What each kind of answer gets, as the answer to one of the first tasks of lab 02: four share a notebook.

    Parameters
    ----------
    answer_of : the source of a task's cell.
    before : comes before it in the first cell of each notebook, with KINDS for the kinds in it.
    """
    got = {}
    for start in range(0, len(kinds), len(FOUR)):
        shared = dict(zip(FOUR, kinds[start:], strict=False))
        answers = {number: answer_of(kind, tasks.get(f"02-{number}")) for number, kind in shared.items()}
        answers[FOUR[0]] = before.replace("KINDS", repr(list(shared.values()))) + answers[FOUR[0]]
        record = graded("02", submission("02", answers))
        got |= {kind: task(record, number) for number, kind in shared.items()}
    return got


FOUR = (1, 2, 3, 5)


@pytest.fixture(scope="module")
def forged() -> dict[str, TaskRecord]:
    """What each forged answer got; the forging takes its turn with each task that is asked."""
    need_sandbox()
    ways = "".join(f"{kind!r}: lambda data: {code}," for kind, (code, _) in FORGED.items())
    patch = PATCH.replace("FORGE", "ways[turns.pop(0)](data)") + f"ways = {{{ways}}}\nturns = KINDS\n"
    return several(lambda kind, one: f"def {one.function}(*given):\n    return [-1.0] * 99\n", sorted(FORGED), patch)


@pytest.mark.parametrize("kind", sorted(FORGED))
def test_forged_answers_earn_nothing_and_say_why(kind, forged):
    one = forged[kind]
    assert (one["points"], one["reason"]) == (0.0, FORGED[kind][1]), one["error"]


def test_doubled(monkeypatch):
    """The first is what their function gives, a second is what should have come: as if one might choose."""
    code = """send(data)
right = [outcome(x / 1000) for x in GIVEN]
send({MIME: {**data[MIME], 'answers': right}})"""
    source = code.replace("GIVEN", "seen")
    answer = "seen = []\ndef metres(depth_mm):\n    seen.append(depth_mm)\n    return depth_mm * 0.0\n"
    data = forging(source, answer)
    one = task(graded("00", data), 1)
    assert (one["points"], one["reason"]) == (0.0, "doubled")

    def last_counts(self, nonce, answers):  # the control: a grader that takes the last answer that came
        self.parent.run.outcomes[self.task] = answers[-1]
        self.parent.run.came[nonce] = 1

    monkeypatch.setattr(nbval_items.Probe, "keep", last_counts)
    assert task(graded("00", data), 1)["points"] == 1


def test_stale(monkeypatch):
    """An answer with the nonce of an earlier task is not read, and costs that task nothing but its doubled answer."""
    code = """old.append(data[MIME])
send(data)
if len(old) > 1:
    send({MIME: {**data[MIME], 'nonce': old[0]['nonce']}})"""
    patch = PATCH.replace("FORGE", code.replace("\n", "\n    ")) + "old = []\n"
    first = patch + "def row_of(u, v, width, height):\n    return v * width + u\n"
    record = graded("02", submission("02", {1: first}, solved=True))
    assert task(record, 1)["reason"] == "doubled" and task(record, 1)["points"] == 0
    assert [task(record, number)["reason"] for number in (2, 3, 4, 5)] == [""] * 4


def test_oversized():
    answer = "def metres(depth_mm):\n    return np.zeros(400_000)\n"
    one = task(graded("00", submission("00", {1: answer}), answer_mb=1.0), 1)
    assert (one["points"], one["reason"]) == (0.0, "oversized")
    assert "answer_mb = 1" in one["error"]
    assert task(graded("00", submission("00", {1: answer})), 1)["reason"] == "wrong"  # the control: then it is read


def test_pickled(tmp_path):
    """Where an answer is unpickled, it runs in the grader."""
    mark = tmp_path / "ran"

    class Evil:
        def __reduce__(self):
            return (open, (str(mark), "w"))

    evil = base64.b64encode(pickle.dumps(Evil())).decode()
    code = f"send({{MIME: {{**data[MIME], 'answers': [{{**a, 'answer': {evil!r}}} for a in data[MIME]['answers']]}}}})"
    one = task(graded("00", forging(code)), 1)
    assert (one["points"], one["reason"]) == (0.0, "forged") and not mark.exists()
    pickle.loads(base64.b64decode(evil)).close()
    assert mark.exists()  # the control


NOT_NUMBERS = ["np.nan", "np.inf", "np.full(4, np.nan)", "None", "'1.5'", "object()", "1j", "[[[[[[[[1]]]]]]]]"]


@pytest.fixture(scope="module")
def not_numbers() -> dict[str, TaskRecord]:
    need_sandbox()
    return several(lambda value, one: f"def {one.function}(*given):\n    return {value}\n", NOT_NUMBERS)


@pytest.mark.parametrize("value", NOT_NUMBERS)
def test_not_finite_or_not_plain(value, not_numbers):
    one = not_numbers[value]
    assert one["points"] == 0 and one["error"], value
    error = abs(np.nan - 1.5)
    assert not error > 0.01  # the control: a judge that asks whether the error is too large believes NaN
