"""predict: a cell that asks, a folded one that tells, and how far off a guess was."""

import pytest

from course_lib.notebook import predict
from course_lib.notebook.predict import Card, _compare


def asked(capsys, question, **kwargs):
    """What the first cell returns, and the lines that it shows."""
    prediction = predict(question, **kwargs)
    return prediction, capsys.readouterr().out.splitlines()


def told(capsys, guess, truth, unit="", question="How large is the error?", **kwargs) -> list[str]:
    """The lines that the second cell shows."""
    prediction, _ = asked(capsys, question, guess=guess, unit=unit)
    prediction.answer(truth, **kwargs)
    return capsys.readouterr().out.splitlines()


def test_the_first_cell_asks_and_says_how_to_answer(capsys):
    _, lines = asked(capsys, "How many points?", guess=None, unit="points")
    assert lines == [
        "Predict: How many points?",
        "Put your number in points in place of None, then run this cell and the folded one below it.",
    ]
    assert asked(capsys, "Which axis?")[1][1].startswith("Put your answer in place of None")


def test_the_first_cell_repeats_a_guess_and_refuses_what_is_none(capsys):
    assert asked(capsys, "How far?", guess=2, unit="m")[1][1] == "You say 2 m. Run the folded cell below."
    assert "without quotes" in asked(capsys, "How far?", guess="2 m", unit="m")[1][1]


def test_nobody_can_hand_the_truth_to_the_cell_that_asks():
    with pytest.raises(TypeError, match="positional"):
        predict("How many points?", None, 35947)


def test_without_a_guess_the_second_cell_keeps_the_answer_folded(capsys):
    lines = told(capsys, None, 35947, "points", why="It is the bunny.")
    assert lines == [
        "Predicted: How large is the error?",
        "No guess was made yet. Make one in the cell above, run it, then this one.",
        "Answer: 35,947 points. It is the bunny.",
    ]


def test_answer_and_reason_are_in_the_fold_which_a_guess_opens():
    card = Card("Predicted", "How far?", "No guess.", "2.00 m.", "It is a string.")
    before, fold = card._repr_html_().split("<details>")
    assert "2.00" not in before and "string" not in before and "2.00 m" in fold and "It is a string" in fold
    opened = Card("Predicted", "How far?", "You said 2.", "2.00 m.", "", opened=True)._repr_html_()
    assert "<details open>" in opened
    assert "details" not in Card("Predict", "How far?", "Put…")._repr_html_()
    assert "&lt;i&gt;" in Card("Predict", "<i>", "")._repr_html_()


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
    assert told(capsys, guess, 3.123, "mm", question=f"How large, {guess}?")[1] == reply


@pytest.mark.parametrize("guess", ["three", float("nan"), [1], True])
def test_what_is_no_number_gets_a_sentence_and_opens_nothing(capsys, guess):
    prediction, _ = asked(capsys, "How large?", guess=guess, unit="mm")
    prediction.answer(3.1)
    assert capsys.readouterr().out.splitlines()[1] == (
        f"{guess!r} is not a number: put one in mm in place of it, without the unit and without quotes."
    )


def test_a_question_may_have_a_word_as_its_answer(capsys):
    assert told(capsys, " Z ", "z", question="Which axis?")[1] == "You said Z: that is right."
    assert told(capsys, "x", "z", question="And which one?")[1:] == ["You said x: not so.", "Answer: z."]


def test_the_first_guess_stays_on_the_card_and_an_unchanged_one_counts_once(capsys):
    def reply(guess):
        return told(capsys, guess, 8.0, "m", question="How high?")[1]

    assert reply(2) == reply(2) == "You said 2 m: 4.0 times too small."
    assert reply(4) == reply(4) == "You said 4 m: 2.0 times too small. Your first guess was 2 m; this is guess 2."
    assert reply(8).endswith("exactly right. Your first guess was 2 m; this is guess 3.")


@pytest.mark.parametrize(
    ("guess", "says"),
    [
        (50, "You said 50 %: 21 percentage points too high, the right size."),
        (28, "very close, 1 percentage point too low"),
    ],
)
def test_shares_differ_by_percentage_points(guess, says):
    assert says in _compare(guess, 29, "%", 2)
