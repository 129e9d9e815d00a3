"""Every lab there is, graded as a class would be: solved, untouched, and with each mistake that people really make."""

from __future__ import annotations

import html
from collections.abc import Callable

import pytest
from fakes import standing_of
from grading_helpers import graded, need_sandbox, submission
from how_thorough import some

from course_lib import notebook, tasks
from course_lib.grading.safe_text import clean
from course_lib.grading.tell.feedback import feedback_page

PATIENT = {"cell_seconds": 60.0, "task_seconds": 60.0}  # what is asked here is not how fast this machine is


@pytest.fixture(autouse=True)
def _sandbox() -> None:
    need_sandbox()


@pytest.fixture
def here() -> Callable[[str], None]:
    """Skip a lab whose real data are not here."""

    def look(lab: str) -> None:
        lacking = [n for task in tasks.lab(lab) for n in task.data if not notebook.data.available(n)]
        if lacking:
            pytest.skip(f"lab {lab} needs {', '.join(lacking)}")

    return look


@pytest.mark.parametrize("lab", tasks.lab_numbers())
def test_solution_earns_everything(lab, here):
    here(lab)
    record = graded(lab, submission(lab, solved=True), **PATIENT)
    assert record["status"] == "graded", record["reason"]
    assert record["notices"] == []
    for one in record["tasks"]:
        wanted = ("by hand", 0.0) if one["kind"] == "explain" else ("passed", one["max"])
        assert (one["status"], one["points"]) == wanted, one["error"]
        assert bool(one["text"]) == (one["kind"] == "explain")


@pytest.mark.parametrize("lab", tasks.lab_numbers())
def test_untouched_exercise_earns_nothing_and_is_told_kindly(lab, here):
    here(lab)
    record = graded(lab, submission(lab), **PATIENT)
    assert record["status"] == "graded" and record["points"] == 0 and record["notices"] == []
    assert {one["status"] for one in record["tasks"]} == {"not started"}
    told = feedback_page(standing_of(record))
    assert told.count("Not started") == len(record["tasks"]) and 'class="wrong"' not in told
    assert all(one["error"] == "" and one["where"].startswith("Where to look: lesson") for one in record["tasks"])


def _rounds() -> list[tuple[str, int]]:
    """Each lab as often as its task with the most mistakes has some: one of each task is handed in at a time.

    That each mistake is told from all others is proved without a kernel, in tests/tasks.
    """
    return [
        (lab, i)
        for lab in tasks.lab_numbers()
        for i in some(range(max(sum(len(m.sources) for m in task.misconceptions) for task in tasks.lab(lab))), 1)
    ]


@pytest.mark.parametrize(("lab", "i"), _rounds())
def test_misconceptions_are_named_in_the_record(lab, i, here):
    here(lab)
    wrong = {task.number: [(m, source) for m in task.misconceptions for source in m.sources] for task in tasks.lab(lab)}
    chosen = {number: all_[i] for number, all_ in wrong.items() if i < len(all_)}
    record = graded(lab, submission(lab, {number: source for number, (_, source) in chosen.items()}), **PATIENT)
    told = feedback_page(standing_of(record))
    for one in record["tasks"]:
        if one["number"] not in chosen:
            assert one["status"] == "not started"
            continue
        mistake = chosen[one["number"]][0]
        assert one["points"] < one["max"], f"{one['id']}: {mistake.name} earned everything"
        assert mistake.name in one["misconceptions"], f"{one['id']}: {mistake.name} is told as {one['misconceptions']}"
        assert set(one["misconceptions"]) <= {mistake.name, *mistake.alike, "input overwritten"}
        assert mistake.message.strip().rstrip(".") in one["looks_like"]
        assert html.escape(clean(one["looks_like"]), quote=False) in told.replace("&#39;", "'").replace("&#34;", '"')


def test_chance_without_a_seed_is_told():
    drawn = "np.random.default_rng().choice(len(points), count, replace=False)"
    source = f"def thin_out(points, count):\n    return {drawn}\n"
    record = graded("04", submission("04", {5: source}), **PATIENT)
    found = record["tasks"][4]
    assert "Asked twice with the same input, it answered differently" in found["error"]
    assert "differently" in html.unescape(feedback_page(standing_of(record)))


def test_a_right_answer_that_changes_what_it_was_given_is_graded_as_it_is_checked():
    source = """def invert(T_world_robot, T_robot_cameras, points):
    given, seen = points.copy(), []
    for T_robot_camera in T_robot_cameras:
        T = T_world_robot @ T_robot_camera
        points -= T[:3, 3]
        seen.append(points @ T[:3, :3])
        points += T[:3, 3]
    return np.array(seen)
"""
    kept = source.replace("points += T[:3, 3]", "points[:] = given")
    found, right = (graded("02", submission("02", {3: one}), **PATIENT)["tasks"][2] for one in (source, kept))
    assert found["points"] == 0 and found["error"].startswith("It changes `points`, which whoever called it still")
    assert found["misconceptions"] == ["input overwritten"]
    assert right["points"] == right["max"]
