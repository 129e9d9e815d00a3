"""predict: a question with a folded answer, and how far off a guess was."""

import pytest

from course_lib.notebook import predict
from course_lib.notebook.predict import Prediction, _compare


def said(capsys, *args, **kwargs) -> list[str]:
    predict(*args, **kwargs)
    return capsys.readouterr().out.splitlines()


def test_without_a_guess_it_asks_and_says_how_to_answer(capsys):
    lines = said(capsys, "How many points?", None, 35947, "points", why="It is the bunny.")
    assert lines == [
        "Predict: How many points?",
        "Put your number in points in place of None, run the cell again, and only then open the answer.",
        "Answer: 35,947 points. It is the bunny.",
    ]


def test_the_answer_is_folded_until_there_is_a_guess():
    asked = Prediction("How far?", "…", "2.00 m", "", open_=False)._repr_html_()
    assert "<details><summary>Answer</summary>" in asked
    assert "<details open>" in Prediction("How far?", "…", "2.00 m", "", open_=True)._repr_html_()
    assert "&lt;i&gt;" in Prediction("<i>", "", "", "", open_=False)._repr_html_()


@pytest.mark.parametrize(
    ("guess", "reply"),
    [
        (3.12, "You said 3.12 mm: exactly right."),
        (3.0, "You said 3.00 mm: very close, 0.12 mm too low."),
        (4, "You said 4 mm: 0.88 mm too high, the right size."),
        (31.23, "You said 31.2 mm: 10 times too large."),
        (0.3123, "You said 0.312 mm: 10 times too small."),
        (0, "You said 0 mm: 3.1 mm too low."),
        (-3.123, "You said -3.12 mm: 6.2 mm too low."),
    ],
)
def test_a_guess_is_told_how_far_off_it_was(capsys, guess, reply):
    assert said(capsys, "How large is the error?", guess, 3.123, "mm")[1] == reply


@pytest.mark.parametrize("guess", ["three", float("nan"), [1], True])
def test_what_is_no_number_gets_a_sentence(capsys, guess):
    assert said(capsys, "How large?", guess, 3.1, "mm")[1] == (
        f"{guess!r} is not a number: put one in mm in place of it, without the unit and without quotes."
    )


def test_a_question_may_have_a_word_as_its_answer(capsys):
    assert said(capsys, "Which axis?", None, "z")[1].startswith("Put your word in place of None")
    assert said(capsys, "Which axis?", " Z ", "z")[1] == "You said Z: that is right."
    assert said(capsys, "Which axis?", "x", "z")[1:] == ["You said x: not so.", "Answer: z."]


@pytest.mark.parametrize(
    ("guess", "says"),
    [
        (50, "You said 50 %: 21 percentage points too high, the right size."),
        (28, "very close, 1 percentage point too low"),
    ],
)
def test_shares_differ_by_percentage_points(guess, says):
    assert says in _compare(guess, 29, "%", 2)
