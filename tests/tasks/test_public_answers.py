"""What labs keep of their wrong answers: complete, small, and enough for a learner's session to run none of them."""

from __future__ import annotations

import numpy as np
import pytest

from course_lib import tasks
from course_lib.authoring import public_answers as made
from course_lib.authoring import solutions
from course_lib.authoring.tree import Tree
from course_lib.notebook import data
from course_lib.tasks.core import Case
from course_lib.tasks.diagnosis import diagnose, recognition
from course_lib.tasks.diagnosis.agreement import Sampled, leaves
from course_lib.tasks.diagnosis.public_answers import file_of, keep, name_of, recall, unpack
from course_lib.tasks.diagnosis.recognition import Wrong, known_of, load_source
from course_lib.tasks.running import Outcome, run_all

TREE = Tree(solutions.ROOT)
LABS = tasks.lab_numbers()


@pytest.mark.parametrize("lab", LABS)
def test_every_mistake_is_kept_and_the_file_is_small(lab):
    assert made.stale_public(lab, TREE) == []
    assert file_of(lab).stat().st_size <= made.MOST_BYTES


@pytest.mark.parametrize("lab", LABS)
def test_a_session_knows_mistakes_again_and_runs_none(lab, monkeypatch):
    def never(*given, **options):
        raise AssertionError("a wrong answer was run")

    for task in tasks.lab(lab):
        if any(not data.available(name) for name in task.data) or not task.misconceptions:
            continue
        monkeypatch.undo()
        cases = task.public(data.load if task.data else None)
        mistake = task.misconceptions[0]
        outcomes = run_all(load_source(mistake.source, task.function), cases)
        known_of.clear()
        recall(task, cases)
        monkeypatch.setattr(recognition, "run", never)
        monkeypatch.setattr(diagnose, "run", never)
        names = tasks.judge_all(task, cases, outcomes).diagnosis.names
        assert set(names) == {mistake.name, *mistake.alike}


def _from_the_other_end(u, v, width, height, step):
    return (height - 1 - v) // step * -(-width // step) + u // step


def test_slips_of_the_inputs_are_known_without_the_reference():
    task = tasks.get("02-1")
    cases = task.public()
    known_of.clear()
    outcomes = run_all(_from_the_other_end, cases)
    assert "slip" != getattr(tasks.judge_all(task, cases, outcomes).diagnosis, "kind", "")
    recall(task, cases)
    told = tasks.judge_all(task, cases, outcomes).diagnosis
    assert (told.kind, told.names) == ("slip", ("v from the other end of height",))


def test_the_same_answers_give_the_same_bytes():
    before = file_of("02").read_bytes()
    assert made.write_public("02", TREE) == "" and file_of("02").read_bytes() == before


def test_of_a_large_answer_numbers_are_kept_that_tell_it_from_others():
    truth = np.zeros((200, 3))
    answers = {"one": truth.copy(), "two": truth.copy(), "none": None}
    answers["one"][77, 1], answers["two"][78, 2] = 1.0, 1.0
    wrongs = {
        name: Wrong(Outcome("answer" if answer is not None else "raised", answer), True, False)
        for name, answer in answers.items()
    }
    kept = keep(wrongs, dict.fromkeys(wrongs, 0.01))
    assert (
        sum(len(at) for form in kept["forms"] for at in form["places"]) <= 256
        and kept["sampled"].tolist()[:2] == [True] * 2
    )
    form, places = kept["forms"][0]["form"], tuple(kept["forms"][0]["places"])
    stored = {n: Sampled(form, places, tuple(kept["values"][i]["values"]), 0.01) for i, n in enumerate(("one", "two"))}
    for name, sampled in stored.items():
        for other in ("one", "two"):
            assert sampled.agrees(answers[other]) == (name == other)
        assert sampled.agrees(answers[name] + 0.009) and not sampled.agrees(answers[name] + 0.02)
        assert not sampled.agrees(answers[name][:-1]) and not sampled.agrees(answers[name] > 0)
        assert not sampled.agrees(np.where(answers[name] > 0, np.nan, answers[name]))


def test_leaves_say_what_a_value_is_made_of():
    form, parts = leaves({"points": np.zeros((2, 3)), "n": 4, "names": ["a", "b"]})
    assert form == "{'n': number, 'names': ['a', 'b'], 'points': numbers (2, 3)}" and len(parts) == 2


def test_a_lab_whose_file_is_missing_runs_its_mistakes(tmp_path, monkeypatch):
    monkeypatch.setattr("course_lib.tasks.diagnosis.public_answers.file_of", lambda lab: tmp_path / "none.npz")
    task = tasks.get("02-1")
    case = Case(dict(task.public()[0].given), dict(task.public()[0].hidden))
    recall(task, [case])
    assert not known_of.get(case) and unpack(tmp_path / "none.npz") == {}
    assert recognition.wrong_answer(task, task.misconceptions[0].source, case).far
    assert (task.id, task.misconceptions[0].source) in known_of[case] and name_of("a", 0) == "mistake: a (0)"
