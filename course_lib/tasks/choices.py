"""Judges of choices, of words, and of open-ended results. Import them from `course_lib.tasks.judges`."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence

from course_lib.tasks.core import Verdict
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import expected, is_, quantity, refuse, up


def judge_choice(answer: Plain, truth: Plain, choices: Sequence[str], what: str = "the choice") -> Verdict:
    """One choice, or a dict or list of them; the score is the share that is right.

    Parameters
    ----------
    answer, truth : a text of `choices`, or a dict (or list) of such texts.
    """
    if isinstance(truth, str):
        problem = _choice_problem(answer, choices, what)
        if problem:
            return refuse(problem, 0.2, "wrong")
        if answer == truth:
            return Verdict(True, 0.0, 0.2, "wrong", what, f"{is_(what)} right.")
        return Verdict(False, 1.0, 0.2, "wrong", what, f"{is_(what)} not {answer!r}.")
    names = list(truth) if isinstance(truth, Mapping) else list(range(len(truth)))
    kind = "dict" if isinstance(truth, Mapping) else "list"
    if type(answer).__name__ != kind or len(answer) != len(names) or (kind == "dict" and set(answer) != set(names)):
        keys = ", ".join(repr(name) for name in names)
        form = f"a dict with the keys {keys}" if kind == "dict" else f"a list of {len(names)} texts"
        return refuse(expected(form, answer, what), 0.2, "wrong")
    for name in names:
        problem = _choice_problem(answer[name], choices, f"{what} for {name!r}")
        if problem:
            return refuse(problem, 0.2, "wrong")
    wrong = [name for name in names if answer[name] != truth[name]]
    message = f"Right: {len(names) - len(wrong)} of {len(names)}.{_repeated(answer, truth, names)}"
    return Verdict(not wrong, float(len(wrong)), 0.2, "wrong", what, message, 1 - len(wrong) / len(names))


def _repeated(answer: Plain, truth: Plain, names: Sequence) -> str:
    """Which choices an answer uses twice and which never, where the truth uses each once."""
    used, wanted = [answer[name] for name in names], [truth[name] for name in names]
    if len(set(wanted)) < len(wanted) or len(set(used)) == len(used):
        return ""
    twice = " and ".join(repr(choice) for choice in wanted if used.count(choice) > 1)
    never = " and ".join(repr(choice) for choice in wanted if choice not in used)
    return f" Used more than once: {twice}; never: {never}."


def _choice_problem(answer: Plain, choices: Sequence[str], what: str) -> str:
    if not isinstance(answer, str):
        return expected("one of the texts " + ", ".join(map(repr, choices)), answer, what)
    if answer in choices:
        return ""
    near = difflib.get_close_matches(answer, choices, 1)
    hint = f"did you mean {near[0]!r}?" if near else "the choices are " + ", ".join(map(repr, choices)) + "."
    return f"{up(what)}: {answer[:60]!r} is none of the choices; {hint}"


def judge_words(answer: Plain, most: int = 60) -> Verdict:
    """A text of 1 to `most` words, to be marked by hand: right here only means that it can be handed in."""
    if not isinstance(answer, str):
        return refuse(expected("a text in quotes", answer, "the answer"))
    count = len(answer.split())
    if count == 0 or set(answer) <= set(". …\n\t"):
        return refuse("The text is empty: write your explanation between the quotes.")
    if count > most:
        return Verdict(False, count, most, "words", "length", f"The text has {count} words: {most} are the most.")
    return Verdict(True, count, most, "words", "length", f"{count} of at most {most} words.")


def judge_band(
    value: float,
    bands: Sequence[tuple[float, float]],
    unit: str = "",
    *,
    better: str = "smaller",
    what: str = "the result",
) -> Verdict:
    """An open-ended result, scored by the best band that it reaches.

    Parameters
    ----------
    value : what was measured of the answer.
    bands : (threshold, score) from the hardest to the easiest: ((1e-3, 1.0), (3e-3, 0.7), (1e-2, 0.3)).
    better : "smaller" or "larger".

    Returns
    -------
    A verdict that passes with half the score; the message says the value, the band reached and the next one. Its error
    is what is missing to the hardest band, its tolerance the width of that band's step to the next.
    """
    sign = 1.0 if better == "smaller" else -1.0
    hardest = bands[0][0]
    step = abs(bands[1][0] - hardest) if len(bands) > 1 else abs(hardest)
    if not math.isfinite(value):
        return refuse(f"{is_(what)} not finite.", step, unit)
    reached = next((index for index, (limit, _) in enumerate(bands) if sign * value <= sign * limit), len(bands))
    score = bands[reached][1] if reached < len(bands) else 0.0
    bound = "under" if better == "smaller" else "over"
    where = f"{bound} {quantity(bands[reached][0], unit)}" if score else "in no band yet"
    message = f"{is_(what)} {quantity(float(value), unit)}, {where}"
    if reached > 0:
        message += f"; the next band begins {bound} {quantity(bands[reached - 1][0], unit)}"
    missing = max(0.0, sign * (float(value) - hardest))
    return Verdict(score >= 0.5, missing, step, unit, what, message + ".", score)
