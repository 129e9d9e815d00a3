"""`check`: cards for learners, one line for tests and graders."""

from __future__ import annotations

import contextlib
import html
import io
import json
import re
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from course_lib import tasks
from course_lib.notebook import _where
from course_lib.notebook import check as _check  # noqa: F401 - loads the module below
from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_array, judge_band, judge_choice, judge_words, worst_of

module = sys.modules["course_lib.notebook.check"]
check, CheckFailed, Card, BANDS = module.check, module.CheckFailed, module.Card, module.BANDS

TRUTH = np.arange(12.0).reshape(4, 3)
WRONG = {"A": "flip", "B": "range"}


def _task(number: int, kind: str, signature: str, judge: object, given: dict, **more: object) -> Task:
    case = Case(given, {"truth": TRUTH if kind == "write" else dict(WRONG)}, "four <points>")
    return Task(id=f"90-{number}", title="a & b", points=4, version=1, kind=kind, signature=signature,
                cases=lambda rng: [case], judge=judge, where="lesson 90, section 1", **more)  # fmt: skip


POINTS = _task(
    1,
    "write",
    "def points(n)",
    lambda case, answer: judge_array(answer, case.truth, 1e-3, "m", axes="xyz"),
    {"n": 4},
    misconceptions=(
        Misconception(
            "shifted",
            "all of it 1 m aside: subtract <1>",
            "def points(n):\n    return np.arange(12.0).reshape(4, 3) + 1\n",
        ),
    ),
    hides=("course_lib.geometry.transforms.invert",),
)  # fmt: skip
WHICH = _task(2, "which", "def causes()", lambda c, a: judge_choice(a, c.truth, ("flip", "range")), {})
OPEN = _task(3, "open", "def guess(n)", lambda c, a: judge_band(a, ((1, 1.0), (2, 0.5), (3, 0.25)), "m"), {"n": 1},
             guess=lambda rng: lambda n: 9)  # fmt: skip
EXPLAIN = _task(4, "explain", "def explain()", lambda c, a: judge_words(a), {}, rubric=("0: a", "1: b", "2: c"))
TINY = {task.id: task for task in (POINTS, WHICH, OPEN, EXPLAIN)}


@pytest.fixture(autouse=True)
def session(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A session with four small tasks, in which nothing has failed yet."""
    real = tasks.get
    monkeypatch.setattr(tasks, "get", lambda name: TINY[name] if name in TINY else real(name))
    monkeypatch.setattr(module, "_failures", {})
    monkeypatch.delenv("COURSE_STRICT", raising=False)
    yield


def off(by: float) -> object:
    return lambda n: TRUTH + by


def test_passing_card() -> None:
    card = check("90-1", off(0))
    assert card.text == "✓ Task 1: a & b — passed · 4 points\n  Right, well within tolerance."
    assert repr(card) == card.text
    assert check("90-1", off(5e-4)).text.endswith("Right, within tolerance.")


def edited(by: float, times: int) -> object:
    """An answer that is off by so much, and was edited so often."""
    return eval(f"lambda n: ({times}, TRUTH + {by})[1]", {"TRUTH": TRUTH})


def test_help_grows_with_each_failure() -> None:
    first, second, third = (check("90-1", edited(1, times)).text for times in range(3))
    assert "x is off by 1 m at worst (row [0] of 4); 1 mm is allowed." in first
    assert "more than 10 times the tolerance" in first
    assert "This looks like" not in first and "Where to look" not in first
    assert "the next card says more" in first and "the next card says more" in second
    assert "This looks like all of it 1 m aside" in second and "Where to look" not in second
    assert "This looks like all of it 1 m aside" in third and "Where to look: lesson 90, section 1." in third
    assert "the next card" not in third


def test_failures_are_counted_by_task_and_forgotten_when_it_passes() -> None:
    check("90-1", edited(1, 0))
    check("90-2", lambda: {})
    assert "This looks like" in check("90-1", edited(1, 1)).text
    check("90-1", off(0))
    assert "This looks like" not in check("90-1", edited(1, 2)).text


def test_an_answer_that_was_not_changed_counts_once() -> None:
    same = [check("90-1", edited(1, 0)).text for _ in range(4)]
    assert set(same) == {same[0]}
    assert "change something in the cell above, run it, then this one" in same[0]
    assert "This looks like" in check("90-1", edited(1, 1)).text
    assert "Where to look" not in check("90-1", edited(1, 1)).text
    assert "Where to look" in check("90-1", edited(1, 2)).text


def test_an_answer_whose_number_stands_in_another_cell_counts_as_changed_with_it() -> None:
    names = {"TRUTH": TRUTH, "by": 1.0}
    answer = eval("lambda n: TRUTH + by", names)
    assert "This looks like" not in check("90-1", answer).text
    names["by"] = 2.0
    assert "off by 2 m" in check("90-1", answer).text
    assert module._failures["90-1"][0] == 2


@pytest.mark.parametrize(
    ("folder", "beside"), [("my_work/labs", "../lessons"), ("exercises", "../notebooks"), (".", "../notebooks")]
)
def test_where_to_look_is_a_link_from_wherever_a_lab_runs(folder: str, beside: str, monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(_where, "ROOT", tmp_path)
    for place in ("notebooks", folder):
        (tmp_path / place).mkdir(parents=True, exist_ok=True)
    cells = [{"cell_type": "markdown", "source": ["# 03 Depth\n", "\n", "## 1 Rays\n", "## 2 Depth is z, not 1 < 2"]}]
    (tmp_path / "notebooks" / "03_depth.ipynb").write_text(json.dumps({"cells": cells}), "utf-8")
    monkeypatch.chdir(tmp_path / folder)
    where = "lesson 03, sections 2 and 9 (a < b); lesson 03; lesson 77"
    card = module.Card("failed", "t", "s", (("Where to look:", where),))
    link = f'<a href="{beside}/03_depth.ipynb#2-Depth-is-z,-not-1-&lt;-2">lesson 03, sections 2</a> and 9 (a &lt; b)'
    assert link in card._repr_html_()
    assert f'<a href="{beside}/03_depth.ipynb">lesson 03</a>; lesson 77' in card._repr_html_()
    assert where in card.text


def test_unknown_mistake_is_said_to_be_unknown() -> None:
    check("90-1", edited(0.37, 0))
    card = check("90-1", edited(0.37, 1)).text
    assert card.count("It is not a mistake that this check knows.") == 1
    assert card.index("Every value is 370 mm too large") < card.index("It is not a mistake")


@pytest.mark.parametrize(
    ("task", "answer"),
    [
        ("90-1", [[1, 2], [3]]),
        ("90-1", TRUTH.T),
        ("90-1", TRUTH * np.nan),
        ("90-2", {"A": "flip"}),
        ("90-2", {"A": "flap", "B": "range"}),
        ("90-4", "word " * 100),
    ],
)
def test_a_mistake_that_was_just_named_is_not_called_unknown(task: str, answer: object) -> None:
    function = {"90-1": lambda n: answer, "90-2": lambda: answer, "90-4": lambda: answer}[task]
    for _ in range(3):
        card = check(task, function)
        assert card.state == "not yet" and "None of the usual" not in card.text


@pytest.mark.parametrize(("by", "step"), [(2e-3, 1), (9e-3, 2), (1e-1, 3)])
def test_error_is_shown_in_bands(by: float, step: int) -> None:
    card = check("90-1", off(by))
    assert card.band == step
    shown = re.findall(r"font-weight:(\w+)[^>]*>([^<]+)</span>", card._repr_html_().split("</p>", 1)[1])
    assert [words for weight, words in shown if weight == "bold"] == [BANDS[step]]


def test_card_is_escaped_and_valid_html() -> None:
    check("90-1", edited(1, 0))
    page = check("90-1", edited(1, 1))._repr_html_()
    assert "subtract &lt;1&gt;" in page and "four &lt;points&gt;" in page and "a &amp; b" in page
    assert "<script" not in page and "<style" not in page and "class=" not in page
    for tag in ("div", "p", "span", "strong", "code"):
        assert page.count(f"<{tag}") == page.count(f"</{tag}>")
    assert len(page) < 3000


def test_html_and_text_say_the_same() -> None:
    card = check("90-1", off(1))
    words = re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", " ", card._repr_html_())))
    for line in card.lines:
        assert (line if isinstance(line, str) else line[1]) in words
    for label, text in card.details:
        assert f"{label}: {text}" in words


def test_own_exception_is_shown_with_what_went_in() -> None:
    text = check("90-1", lambda n: n.no_such_thing).text
    assert "raised AttributeError: 'int' object has no attribute 'no_such_thing'. It was given n = 4." in text
    answer = lambda n: 1 / 0  # noqa: E731
    check("90-1", answer)
    assert "None of the usual" not in check("90-1", answer).text


def test_prints_and_warnings_stand_on_the_card() -> None:
    def talks(n: int) -> np.ndarray:
        print("<b>here</b>")
        return np.log(np.zeros((4, 3)))

    card = check("90-1", talks)
    assert ("It printed", "<b>here</b>") in card.details
    assert ("Python warned", "RuntimeWarning: divide by zero encountered in log") in card.details
    assert "<b>here" not in card._repr_html_()


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (TRUTH, 'wants the function itself, not a (4, 3) float64 array: write check("90-1", points), with no'),
        (None, "check wants the function itself, not None"),
        (lambda: 1, "The task calls points(n), which your function does not take: too many positional arguments."),
        (lambda a, b: 1, "missing a required argument: 'b'."),
    ],
)  # fmt: skip
def test_what_is_no_fitting_function_gets_a_sentence(
    thing: object, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    card = check("90-1", thing)
    assert card.tone == "failed" and words in card.text
    monkeypatch.setenv("COURSE_STRICT", "1")
    with pytest.raises(CheckFailed) as caught:
        check("90-1", thing)
    assert words in str(caught.value)


def test_stub_is_not_started(monkeypatch: pytest.MonkeyPatch) -> None:
    def points(n: int) -> None:
        raise NotImplementedError("Task 1: a & b")

    card = check("90-1", points)
    assert card.text == (
        "○ Task 1: a & b — not started yet · 4 points\n"
        "  Replace the `raise` line in `points(n)`, run that cell, then this one."
    )
    assert "<code>points(n)</code>" in card._repr_html_()
    monkeypatch.setenv("COURSE_STRICT", "1")
    with pytest.raises(NotImplementedError, match=r"^Task 1: a & b$") as caught:
        check("90-1", points)
    assert type(caught.value) is NotImplementedError
    assert caught.value.__cause__ is None and caught.value.__suppress_context__


def test_strict_failure_is_one_line_with_error_and_misconception(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COURSE_STRICT", "1")
    with pytest.raises(CheckFailed) as caught:
        check("90-1", off(1))
    assert str(caught.value) == (
        "Task 1: a & b: x is off by 1 m at worst (row [0] of 4); 1 mm is allowed. "
        "This looks like all of it 1 m aside: subtract <1>."
    )
    assert check("90-1", off(0)).tone == "passed"


def test_strict_failure_prints_no_traceback_in_a_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    from IPython.core.interactiveshell import InteractiveShell
    from traitlets.config import Config

    shell = InteractiveShell(config=Config({"HistoryManager": {"enabled": False}}))
    shell.user_ns.update(check=check, wrong=off(1))
    monkeypatch.setenv("COURSE_STRICT", "1")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        result = shell.run_cell('check("90-1", wrong)')
    assert isinstance(result.error_in_exec, CheckFailed)
    lines = printed.getvalue().strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("CheckFailed: Task 1: a & b: x is off by 1 m")


def test_calling_the_answer_is_refused_kindly(monkeypatch: pytest.MonkeyPatch) -> None:
    def points(n: int) -> object:
        from course_lib.geometry.transforms import invert

        return invert(n)

    words = "Task 1 asks you to write it yourself: transforms.invert is the answer; allowed here: numpy."
    assert words in check("90-1", points).text
    monkeypatch.setenv("COURSE_STRICT", "1")
    with pytest.raises(CheckFailed, match=re.escape(words)):
        check("90-1", points)


def test_choices_show_how_many_and_so_far() -> None:
    card = check("90-2", lambda: {"A": "flip", "B": "flip"})
    assert card.state == "so far 2 of 4 points" and card.band is None
    assert "Right: 1 of 2." in card.text
    assert check("90-2", lambda: dict(WRONG)).text.endswith("Right.")


def test_open_task_shows_bands_and_points() -> None:
    assert check("90-3", lambda n: 0.5).state == "passed · 4 of 4 points"
    half = check("90-3", lambda n: 1.5)
    assert half.state == "passed · 2 of 4 points" and "the next band begins under 1 m" in half.text
    low = check("90-3", lambda n: 2.5)
    assert low.tone == "failed" and low.state == "so far 1 of 4 points" and low.band is None


def test_open_task_is_the_worst_scene_and_says_what_a_grade_will_be() -> None:
    values = iter([0.5, 1.5, 0.5, 0.5])
    card = check("90-3", lambda n: next(values))
    assert card.state == "passed · 2 of 4 points"
    assert "The result is 1.5 m, under 2 m" in card.text
    assert "the worst of 3 scenes; a grade is what the worst of 7 earns" in card.text
    assert "differently" not in card.text


def test_randomness_without_a_seed_is_told() -> None:
    values = iter([0.5, 0.5, 0.5, 0.6])
    assert "Asked twice with the same input, it answered differently" in check("90-3", lambda n: next(values)).text
    values = iter([9.0, 9.0, 9.0, 9.5])
    failed = check("90-3", lambda n: next(values))
    assert failed.tone == "failed" and "answered differently" in failed.text


def test_explanation_is_ready_to_hand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COURSE_STRICT", "1")
    card = check("90-4", lambda: "because")
    assert card.text == (
        "→ Task 4: a & b — written, not judged here · up to 4 points, marked by hand\n"
        "  1 of at most 60 words. Nobody has judged yet what they say; your instructor gives 0 to 4."
    )
    with pytest.raises(CheckFailed, match="write your explanation"):
        check("90-4", lambda: " ")


def test_without_its_real_data_a_task_is_judged_on_its_made_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    real = Task(
        id="90-5", title="t", points=1, version=1, kind="real", signature="def points(n)", where="w",
        data=("tum_pair", "sun_pair"), judge=POINTS.judge,
        cases=lambda rng, load: [Case({"n": 4}, {"truth": TRUTH})] * (3 if load is None else 4),
    )  # fmt: skip
    monkeypatch.setitem(TINY, "90-5", real)
    monkeypatch.setattr(module, "_loader", lambda task: None)
    for answer, tone in ((off(0), "passed"), (off(0.37), "failed")):
        card = check("90-5", answer)
        assert card.tone == tone and "python3 course.py data get tum_pair sun_pair" in card.text
    assert "right in 0 of 3 cases" in card.text
    monkeypatch.setenv("COURSE_STRICT", "1")
    with pytest.raises(CheckFailed, match="off by 370 mm"):
        check("90-5", off(0.37))


def test_real_data_come_through_the_loader(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []
    real = Task(
        id="90-6", title="t", points=1, version=1, kind="real", signature="def points(n)", where="w",
        data=("tum_pair",), judge=POINTS.judge,
        cases=lambda rng, load: [Case({"n": load("tum_pair")}, {"truth": TRUTH})],
    )  # fmt: skip
    monkeypatch.setitem(TINY, "90-6", real)
    monkeypatch.setattr(module, "_loader", lambda task: lambda name: seen.append(name) or 4)
    assert check("90-6", off(0)).tone == "passed"
    assert seen == ["tum_pair"]


def test_unknown_task_suggests_the_nearest() -> None:
    with pytest.raises(ValueError, match="there is no task '00-9'; did you mean '00-1'"):
        check("00-9", off(0))


def test_parts_together() -> None:
    both = worst_of(judge_array(TRUTH, TRUTH, 1, "m"), judge_array(TRUTH + 9, TRUTH, 1, "m", what="the colours"))
    assert not both.passed and "The colours are off by 9 m" in both.message


def test_card_without_anything_to_say() -> None:
    assert Card("not started", "T", "s").text == "○ T — s"
    assert Card("failed", "T", "s", band=0).text.endswith("Within tolerance.")


@pytest.mark.parametrize("broken", ["def points(n):\n    return TRUTH +\n", "1 / 0\ndef points(n):\n    return None\n"])
def test_an_older_function_than_the_cell_says_is_not_judged(broken: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from IPython.core.interactiveshell import InteractiveShell
    from traitlets.config import Config

    shell = InteractiveShell(config=Config({"HistoryManager": {"hist_file": ":memory:"}}))
    monkeypatch.setattr("IPython.get_ipython", lambda: shell)
    shell.user_ns.update(check=check, TRUTH=TRUTH)
    good = "def points(n):\n    return TRUTH\n"
    for cells, tone in (((good,), "passed"), ((good, broken), "failed"), ((good, broken, good), "passed")):
        for cell in cells:
            shell.run_cell(cell, store_history=True)
        card = shell.run_cell('check("90-1", points)', store_history=True).result
        assert card.tone == tone, card.text
        if tone == "failed":
            assert "an older points would be judged: mend that cell, run it, then this one." in card.text
