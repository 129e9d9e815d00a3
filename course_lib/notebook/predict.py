"""Commit to a number before you see it, in two cells: one asks, the folded one below it tells how far you were off.

corner = predict("How far away is the corner of the wall?", guess=None, unit="m")    # what everybody reads

corner.answer(string[0, 0], why="…", digits=4)    # tagged hide-input and prediction: code and output are folded
"""

from __future__ import annotations

import html
import math
from dataclasses import dataclass
from numbers import Real

import numpy as np

from course_lib.notebook._words import amount
from course_lib.notebook.report import display_object

_guessed: dict[str, list[object]] = {}
"""Question → the guesses that it was answered with, in their order; the same again counts once."""


@dataclass(frozen=True)
class Card:
    """What a cell shows of a prediction: HTML with the answer folded, and the same as text."""

    lead: str
    text: str
    reply: str
    answer: str = ""
    why: str = ""
    opened: bool = False

    def __repr__(self) -> str:
        told = " ".join(filter(None, (self.answer, self.why)))
        return "\n".join([f"{self.lead}: {self.text}", self.reply] + ([f"Answer: {told}"] if told else []))

    def _repr_html_(self) -> str:
        return (
            '<div style="border-left: 4px solid #0072B2; padding: 0.2em 1em; margin: 0.5em 0">'
            f"<p><strong>{self.lead}.</strong> {html.escape(self.text)}</p><p>{html.escape(self.reply)}</p>"
            f"{self._folded()}</div>"
        )

    def _folded(self) -> str:
        if not self.answer:
            return ""
        why = f"<p>{html.escape(self.why)}</p>" if self.why else ""
        opened = " open" if self.opened else ""
        answer = f"<p><strong>{html.escape(self.answer)}</strong></p>"
        return f"<details{opened}><summary>Answer</summary>{answer}{why}</details>"


@dataclass(frozen=True)
class Prediction:
    """A question and the guess that was made; `answer` tells by how far it was off."""

    question: str
    guess: object
    unit: str

    def __repr__(self) -> str:
        return f"a prediction: {self.question}"  # the card was shown already

    def answer(self, truth: object, why: str = "", digits: int = 3) -> None:
        """Show how far the guess is from the truth, and why; without a guess the answer stays folded.

        Parameters
        ----------
        truth : the computed answer; a number or a word.
        why : one or two sentences that explain the answer.
        digits : significant digits of the truth.
        """
        told, refused = f"{amount(truth, self.unit, digits)}.", ""
        if self.guess is None:
            reply = "No guess was made yet. Make one in the cell above, run it, then this one."
        elif isinstance(truth, str):
            guess = str(self.guess).strip()
            right = guess.lower() == truth.strip().lower()
            reply = f"You said {guess}: {'that is right' if right else 'not so'}."
        else:
            guess, refused = _plain(self.guess), _no_number(self.guess, self.unit)
            reply = refused or _compare(guess, float(truth), self.unit, digits)
        guessed = self.guess is not None and not refused
        if guessed:
            reply += self._first(guess, digits)
        display_object(Card("Predicted", self.question, reply, told, why, opened=guessed))

    def _first(self, guess: object, digits: int) -> str:
        """Keep a guess, and name the first one where it was another: after an answer nobody predicts any more."""
        before = _guessed.setdefault(self.question, [])
        if guess not in before:
            before.append(guess)
        place = before.index(guess)
        first = amount(before[0], self.unit, digits)
        return f" Your first guess was {first}; this is guess {place + 1}." if place else ""


def predict(question: str, *, guess: object = None, unit: str = "") -> Prediction:
    """Ask a question whose answer the next cell tells.

    Parameters
    ----------
    question : what to predict, without anything that gives the answer away.
    guess : None until you commit; then a number (or a word, where the question asks for one).
    unit : of the number.

    Returns
    -------
    What the next cell calls `.answer(truth, why="…")` of.
    """
    if guess is None:
        form = f"your number in {unit}" if unit else "your answer"
        reply = f"Put {form} in place of None, then run this cell and the folded one below it."
    else:
        said = amount(_plain(guess), unit, 3) if _is_number(guess) else str(guess).strip()
        reply = (unit and _no_number(guess, unit)) or f"You say {said}. Run the folded cell below."
    display_object(Card("Predict", question, reply))
    return Prediction(question, guess, unit)


def _plain(guess: object) -> object:
    """The number in an array of one."""
    return guess.item() if isinstance(guess, (np.generic, np.ndarray)) and np.size(guess) == 1 else guess


def _is_number(guess: object) -> bool:
    guess = _plain(guess)
    return isinstance(guess, Real) and not isinstance(guess, bool) and math.isfinite(guess)


def _no_number(guess: object, unit: str) -> str:
    """Say what to put in place of a guess that is no number; "" where it is one."""
    if _is_number(guess):
        return ""
    in_unit = f" in {unit}" if unit else ""
    return f"{_plain(guess)!r} is not a number: put one{in_unit} in place of it, without the unit and without quotes."


def _compare(guess: float, truth: float, unit: str, digits: int) -> str:
    """Say in one sentence how far a guess is from a number."""
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
