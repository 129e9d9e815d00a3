"""Commit to a number before you see it: `predict` asks, and afterwards says by how far you were off and why."""

from __future__ import annotations

import html
import math
from numbers import Real

import numpy as np

from course_lib.notebook._words import amount
from course_lib.notebook.report import display_object


class Prediction:
    """The card of one question: HTML with the answer folded, and the same as text."""

    def __init__(self, question: str, reply: str, answer: str, why: str, open_: bool):
        self.question, self.reply, self.answer, self.why, self.open = question, reply, answer, why, open_

    def __repr__(self) -> str:
        why = f" {self.why}" if self.why else ""
        return f"Predict: {self.question}\n{self.reply}\nAnswer: {self.answer}{why}"

    def _repr_html_(self) -> str:
        why = f"<p>{html.escape(self.why)}</p>" if self.why else ""
        return (
            '<div style="border-left: 4px solid #0072B2; padding: 0.2em 1em; margin: 0.5em 0">'
            f"<p><strong>Predict.</strong> {html.escape(self.question)}</p><p>{html.escape(self.reply)}</p>"
            f"<details{' open' if self.open else ''}><summary>Answer</summary>"
            f"<p><strong>{html.escape(self.answer)}</strong></p>{why}</details></div>"
        )


def predict(question: str, guess: object, truth: object, unit: str = "", why: str = "", digits: int = 3) -> None:
    """Show a question; once a guess is given, show how far it is from the truth.

    Parameters
    ----------
    question : what to predict.
    guess : None until you commit; then a number (or a word, where the truth is a word).
    truth : the computed answer; a number or a word.
    unit : of both.
    why : one or two sentences that explain the answer.
    digits : significant digits of the truth.
    """
    is_number = not isinstance(truth, str)
    answer = f"{amount(truth, unit, digits)}."
    if guess is None:
        form = f"your number in {unit}" if unit else "your number" if is_number else "your word"
        reply = f"Put {form} in place of None, run the cell again, and only then open the answer."
    elif is_number:
        reply = _compare(guess, float(truth), unit, digits)
    else:
        said = str(guess).strip()
        reply = (
            f"You said {said}: that is right." if said.lower() == truth.strip().lower() else f"You said {said}: not so."
        )
    display_object(Prediction(question, reply, answer, why, open_=guess is not None))


def _compare(guess: object, truth: float, unit: str, digits: int) -> str:
    """Say in one sentence how far a guess is from a number."""
    guess = guess.item() if isinstance(guess, (np.generic, np.ndarray)) and np.size(guess) == 1 else guess
    if isinstance(guess, bool) or not isinstance(guess, Real) or not math.isfinite(guess):
        in_unit = f" in {unit}" if unit else ""
        return f"{guess!r} is not a number: put one{in_unit} in place of it, without the unit and without quotes."
    said = f"You said {amount(guess, unit, digits)}"
    away = amount(abs(guess - truth), unit, 2)
    if unit == "%":  # 50 % is not 21 % more than 29 %
        away = away.replace(" %", " percentage point" if away == "1 %" else " percentage points")
    if amount(float(guess), unit, digits) == amount(truth, unit, digits):
        return f"{said}: exactly right."
    if truth == 0 or guess == 0 or (guess < 0) != (truth < 0):
        return f"{said}: {away} too {'high' if guess > truth else 'low'}."
    factor = max(abs(guess / truth), abs(truth / guess))
    if factor <= 1.1:
        return f"{said}: very close, {away} too {'high' if guess > truth else 'low'}."
    if factor < 2:
        return f"{said}: {away} too {'high' if guess > truth else 'low'}, the right size."
    return f"{said}: {amount(factor, '', 2)} times too {'large' if abs(guess) > abs(truth) else 'small'}."
