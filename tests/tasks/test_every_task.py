"""Every task of every lab there is, and so of those to come: the checks are proved before learners meet them."""

from __future__ import annotations

import ast
import importlib
import re
from typing import Any

import pytest
import task_proofs as proofs
from collected import PROBLEMS, TASKS, each_task, loader, reference

from course_lib import tasks
from course_lib.authoring import solutions, stubs
from course_lib.notebook import _where
from course_lib.tasks.core import Task
from course_lib.tasks.sources import forbidden


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> proofs.Shell:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("IPYTHONDIR", str(tmp_path_factory.mktemp("ipython")))
        return proofs.Shell()


@pytest.fixture(autouse=True)
def _fresh_session(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test is a session in which nothing has failed yet."""
    module = importlib.import_module("course_lib.notebook.check")
    monkeypatch.setattr(module, "_failures", {})


def strict_line(shell: proofs.Shell, monkeypatch: pytest.MonkeyPatch, task: Task, source: str) -> str:
    """What `check` raises under COURSE_STRICT=1 for a cell of learner code: "Type: message"; "" if nothing."""
    monkeypatch.setenv("COURSE_STRICT", "1")
    shell.run(solutions.preamble(task.lab))
    shell.run(source)
    try:
        shell.run(f'check("{task.id}", {task.function})')
    except (NotImplementedError, AssertionError) as error:
        return f"{type(error).__name__}: {error}"
    return ""


@pytest.mark.parametrize("number", sorted(PROBLEMS))
def test_lab_is_sound(number: str) -> None:
    assert PROBLEMS[number] == ""
    lab = solutions.lab_tasks(number)
    registered = tasks.lab(number)
    assert [task.number for task in lab] == [task.number for task in registered]
    names = [task.function for task in registered if task.function != "explain"]
    assert len(set(names)) == len(names), f"lab {number}: two tasks have the same function name"


@each_task
def test_lab_and_task_agree(task: Task) -> None:
    lab = solutions.task_of_lab(task.id)
    assert lab.title == task.title
    assert lab.points == task.points
    definition = next(
        n for n in ast.parse(lab.source).body if isinstance(n, ast.FunctionDef) and n.name == task.function
    )
    assert tuple(argument.arg for argument in definition.args.args) == task.arguments
    assert re.fullmatch(rf'check\("{task.id}", {task.function}\)', lab.check.splitlines()[-1].strip()), lab.check
    least = 2 if task.kind in ("fill", "which", "explain") else 3
    assert lab.hints >= least, f"{lab.hints} hints; a {task.kind} task has at least {least}"


@each_task
def test_where_to_look_names_a_place_that_is_there(task: Task) -> None:
    """The card makes a link of it."""
    places = _where.named(task.where)
    assert places and places[0][0].startswith(f"lesson {task.lab}"), task.where
    for words, path, heading in places:
        assert path is not None and (heading or "," not in words), f"{words}: there is no such part"
        if said := re.search(rf"{re.escape(words)} \(([^)]+)\)", task.where):
            assert heading.partition(" ")[2].lower() == said[1] or not heading[0].isdigit(), (heading, said[1])


@each_task
def test_version_points_and_misconceptions(task: Task) -> None:
    assert task.version >= 1
    assert task.points > 0
    assert task.misconceptions or task.kind == "explain"
    for misconception in task.misconceptions:
        assert misconception.name == misconception.name.strip() and 3 <= len(misconception.name) <= 48
        assert 15 <= len(misconception.message) <= 240, f"{misconception.name}: {len(misconception.message)} letters"
        assert not re.match(r"(This|It) looks like", misconception.message)
        others = {m.name for m in task.misconceptions} - {misconception.name}
        assert set(misconception.alike) <= others, f"{misconception.name} is alike to one that is not there"


@each_task
def test_reference_passes_in_a_notebook(task: Task, shell: proofs.Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    loader(task)
    assert strict_line(shell, monkeypatch, task, solutions.reference(task.id)) == ""
    monkeypatch.delenv("COURSE_STRICT")
    cards = [shell.run(f'check("{task.id}", {task.function})') for _ in range(2)]
    assert cards[0].text == cards[1].text
    assert cards[0]._repr_html_() == cards[1]._repr_html_()
    assert cards[0].text.startswith("→" if task.kind == "explain" else "✓")
    assert "object at 0x" not in cards[0].text


@each_task
def test_answer_keeps_to_what_may_be_called(task: Task) -> None:
    assert forbidden(task, reference(task)) == ""
    for hidden in task.hides:
        parts = hidden.split(".")
        assert parts[0] == "course_lib" or parts[0] in ("numpy", "scipy", "cv2", "open3d"), hidden
        if parts[0] == "course_lib":
            module = importlib.import_module(".".join(parts[:3]))
            assert len(parts) == 3 or hasattr(module, parts[3]), f"{hidden} does not exist"


@each_task
def test_stub_is_not_started(task: Task, shell: proofs.Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    loader(task)
    stub = solutions.stub(task.id)
    assert strict_line(shell, monkeypatch, task, stub) == f"NotImplementedError: {task.label}"
    monkeypatch.delenv("COURSE_STRICT")
    card = shell.run(f'check("{task.id}", {task.function})')
    assert card.tone == "not started"
    assert "not started" in card.text
    with pytest.raises(NotImplementedError, match=re.escape(task.label)):
        function = shell.run(task.function)
        function(*[None] * len(task.arguments))


@each_task
def test_given_wrong_code_is_recognised(task: Task, shell: proofs.Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    stub = solutions.stub(task.id)
    assert (stubs.MEND in stub) == (task.kind == "mend"), "a mend task, and no other, has # INSTEAD and #| lines"
    if task.kind == "mend":
        given = re.sub(rf"^ *{re.escape(stubs.MEND)}\n.*\n", "", stub, flags=re.M)
        loader(task)
        line = strict_line(shell, monkeypatch, task, given)
        assert line.startswith("CheckFailed:") and "This looks like" in line, line


@pytest.mark.parametrize(
    ("task", "misconception"),
    [pytest.param(t, m, id=f"{t.id}-{m.name.replace(' ', '_')}") for t in TASKS for m in t.misconceptions],
)
def test_misconception(task: Task, misconception: Any, shell: proofs.Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    proofs.misconception_shows(task, misconception, loader(task))
    for source in misconception.sources:
        line = strict_line(shell, monkeypatch, task, source)
        assert line.startswith(f"CheckFailed: {task.label}: "), line
        assert misconception.message.strip().rstrip(".") in line
        told = line.partition("This looks like ")[2].replace(misconception.message.strip().rstrip("."), "")
        for other in task.misconceptions:
            if other is not misconception and other.name not in misconception.alike:
                assert other.message.strip().rstrip(".") not in told


@each_task
def test_where_to_look_is_there(task: Task) -> None:
    """The third help names a lesson, and sections and headings that it has."""
    number = re.match(r"lesson (\d\d)\b", task.where)
    assert number, f"{task.where!r} begins with the lesson: 'lesson 03, section 2 (the pinhole model)'"
    sources = list((solutions.ROOT / "notebooks" / "source").glob(f"{number[1]}_*.py"))
    if not sources:
        pytest.skip(f"lesson {number[1]} is not written yet")
    headings = dict(re.findall(r"^# ## (\d+)\s+(.+?)\s*$", sources[0].read_text(encoding="utf-8"), re.M))
    titles = re.findall(r"^# ## ([A-Z].+?)\s*$", sources[0].read_text(encoding="utf-8"), re.M)
    for section, title in re.findall(r"\bsection (\d)(?: \(([^)]*)\))?", task.where):
        assert section in headings, f"lesson {number[1]} has no section {section}"
        assert not title or title.lower() == headings[section].lower(), f"section {section} is {headings[section]!r}"
    if "Break it" in task.where:
        assert "Break it" in titles
