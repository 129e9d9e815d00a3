"""What went wrong: the first that fits of a registered mistake, the form, a slip, and the anatomy of the error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task, Verdict
from course_lib.tasks.diagnosis.agreement import near, same_kind
from course_lib.tasks.diagnosis.anatomy import anatomy
from course_lib.tasks.diagnosis.forms import COUNTS, form_problem, gap_problem
from course_lib.tasks.diagnosis.named_errors import always_the_same, part_of
from course_lib.tasks.diagnosis.recognition import Wrong, known_of, recognise, recognise_several, wrong_of
from course_lib.tasks.diagnosis.slips import Slip, answer_slips, input_slips
from course_lib.tasks.plain import Plain, same
from course_lib.tasks.running import Outcome, run

UNKNOWN = "It is not a mistake that this check knows."
MANY = 3
"""If so many slips of the inputs fit, none of them is what happened."""


@dataclass(frozen=True)
class Diagnosis:
    """What an answer is told.

    Parameters
    ----------
    kind : "form", "mistake", "slip" or "anatomy".
    names : of what fits; several where the cases cannot tell them apart.
    says : a sentence, with "This looks like" where something was recognised.
    mistakes : the registered ones among them.
    """

    kind: str
    names: tuple[str, ...]
    says: str
    mistakes: tuple[Misconception, ...] = ()

    @property
    def counted(self) -> tuple[str, ...]:
        """Names that are worth counting over a class."""
        return self.names if self.says and self.kind != "anatomy" else ()


ONLY_OVERWRITTEN = Diagnosis(
    "slip",
    ("input overwritten",),
    "The answers themselves are right. What is taken away in place and added again comes back rounded, so that is no "
    "way out.",
)
"""What is told of right answers that changed what they were given."""


def diagnose(
    task: Task,
    cases: Sequence[Case],
    outcomes: Sequence[Outcome],
    verdicts: Sequence[Verdict],
    reference: Callable[..., Any] | None = None,
) -> Diagnosis | None:
    """Say what is wrong with answers that were judged; None where nothing is, or there is no answer to speak of.

    Parameters
    ----------
    verdicts : on the answers alone, whatever became of the inputs.
    reference : a right function of this task, to try slips of the inputs on; without it those are tried whose answers
        are kept (`public_answers`).
    """
    if task.kind == "explain":
        return None
    if all(verdict.passed for verdict in verdicts):
        return ONLY_OVERWRITTEN if task.keeps_inputs and any(outcome.overwrote for outcome in outcomes) else None
    mistakes = recognise(task, cases, outcomes, verdicts)
    form = None if mistakes else _form(cases, outcomes, verdicts)
    if form and form.names[0] not in COUNTS:
        return form
    found = _mistakes(mistakes, ", or like ") if mistakes else _values(task, cases, outcomes, verdicts, reference, form)
    overwritten = [o.overwrote for o, v in zip(outcomes, verdicts, strict=True) if o.overwrote and not v.passed]
    if overwritten and (found is None or found.kind != "form"):
        names = " and ".join(f"`{name}`" for name in overwritten[0])
        says = f"The function changes {names}, which it was given; what is read from there later (a slice, too) is new."
        return Diagnosis(
            "slip",
            ("input overwritten", *(found.names if found else ())),
            f"{says} {found.says if found else ''}".strip(),
            found.mistakes if found else (),
        )
    return found


def _form(cases: Sequence[Case], outcomes: Sequence[Outcome], verdicts: Sequence[Verdict]) -> Diagnosis | None:
    """What is wrong with the form of the first answer that is refused for it and of which something can be said."""
    refused = [
        (outcome.answer, case.hidden.get("truth", case.hidden.get("form")))
        for case, outcome, verdict in zip(cases, outcomes, verdicts, strict=True)
        if outcome.kind == "answer" and not verdict.passed and not math.isfinite(verdict.error)
    ]
    for i, (answer, truth) in enumerate(refused):
        found = form_problem(answer, truth, refused[:i] + refused[i + 1 :])
        if found:
            return Diagnosis("form", (found[0],), found[1])
    return None


def _values(
    task: Task,
    cases: Sequence[Case],
    outcomes: Sequence[Outcome],
    verdicts: Sequence[Verdict],
    reference: Callable[..., Any] | None,
    form: Diagnosis | None,
) -> Diagnosis | None:
    """What is wrong with answers that no registered mistake explains alone; `form` if they are too many or too few."""
    answers = [outcome.answer if outcome.kind == "answer" else None for outcome in outcomes]
    if constant := always_the_same(cases, answers):
        return Diagnosis("anatomy", (constant[0],), constant[1])
    slips = _slips(task, cases, outcomes, verdicts, reference) if any(a is not None for a in answers) else []
    if slips:
        *others, last = dict.fromkeys(slip.message for slip in slips)
        words = ", or like ".join([*(other.rstrip("?") for other in others), last])
        end = "" if last.endswith("?") else "."
        return Diagnosis("slip", tuple(slip.name for slip in slips), f"This looks like {words}{end}")
    several = () if task.kind == "open" else recognise_several(task, cases, outcomes, verdicts)  # draws are of one kind
    if several:
        return _mistakes(several, ", and in another case like ")
    refused = [
        i
        for i, (v, o) in enumerate(zip(verdicts, outcomes, strict=True))
        if not v.passed and not math.isfinite(v.error) and o.kind != "raised"
    ]
    if refused:
        asked = (part_of(task, cases[i], answers[i], refused=True) for i in refused if answers[i] is not None)
        if found := next(filter(None, asked), None):
            return Diagnosis("anatomy", *_told(found))
        gaps = (gap_problem(answers[i], cases[i].hidden.get("truth")) for i in refused)
        gap = next(filter(None, gaps), None)
        return Diagnosis("form", *_told(gap)) if gap else form or Diagnosis("form", ("as the judge says",), "")
    found = anatomy(task, cases, answers, verdicts)
    return Diagnosis("anatomy", *_told(found)) if found else None


def _told(found: tuple[str, str]) -> tuple[tuple[str, ...], str]:
    return (found[0],), found[1]


def _mistakes(found: Sequence[Misconception], between: str) -> Diagnosis:
    says = "This looks like " + between.join(m.message.strip().rstrip(".") for m in found) + "."
    return Diagnosis("mistake", tuple(m.name for m in found), says, tuple(found))


def _slips(
    task: Task,
    cases: Sequence[Case],
    outcomes: Sequence[Outcome],
    verdicts: Sequence[Verdict],
    reference: Callable[..., Any] | None,
) -> list[Slip]:
    """The slips of the answer that fit, else those of the inputs; the worst case is asked first.

    An answer that is nearly empty, nearly full or nearly zero fits many slips of the inputs, which then say nothing.
    """
    order = sorted(
        range(len(cases)), key=lambda i: (outcomes[i].kind != "answer", verdicts[i].passed, -verdicts[i].ratio)
    )
    first = order[0]
    some = [(cases[i], outcomes[i], verdicts[i]) for i in order]
    fitting: list[Slip] = []
    if all("truth" in case.hidden for case in cases) and same_kind(some[0][1].answer, cases[first].truth):
        for slip in answer_slips(cases[first].truth):
            wrongs = (slipped(task, case, lambda c, s=slip: s.apply(c.truth)) for case, *_ in some)
            if _fits(task, wrongs, some):
                fitting.append(slip)
    if any(slip.name == "cut to whole numbers" for slip in fitting):  # then nothing has overflowed
        fitting = [slip for slip in fitting if not slip.name.endswith("overflow")]
    if fitting:
        return fitting
    for slip in input_slips(cases[first].given):
        if reference is None and (task.id, slip_key(slip)) not in known_of.get(cases[first], {}):
            continue
        wrongs = (changed(task, case, slip, reference) for case, *_ in some)
        if _fits(task, wrongs, some):
            fitting.append(slip)
    return fitting if len(fitting) < MANY else []


def slipped(task: Task, case: Case, made: Callable[[Case], Plain]) -> Wrong:
    """What a slip makes of the true answer to a case; no answer where it cannot be made of it."""
    try:
        with np.errstate(all="ignore"):
            outcome = Outcome("answer", made(case))
    except (ValueError, TypeError, IndexError, OverflowError, ZeroDivisionError, np.linalg.LinAlgError):
        return Wrong(Outcome("raised"), False, False)
    return wrong_of(task, case, outcome)


def slip_key(slip: Slip) -> str:
    """What the answer of a slip of the inputs is remembered under."""
    return f"input slip: {slip.name}"


def changed(task: Task, case: Case, slip: Slip, reference: Callable[..., Any] | None) -> Wrong:
    """What the reference answers to a case whose inputs slipped; remembered as long as the case lives."""
    known = known_of.setdefault(case, {})
    key = (task.id, slip_key(slip))
    if key not in known and reference is None:
        return Wrong(Outcome("raised"), False, False)
    if key not in known:
        try:
            with np.errstate(all="ignore"):
                given = slip.apply(case.given)
            known[key] = wrong_of(task, case, run(reference, Case(given), as_given=True))
        except (ValueError, TypeError, IndexError, OverflowError, ZeroDivisionError, np.linalg.LinAlgError):
            known[key] = Wrong(Outcome("raised"), False, False)
    return known[key]


def _fits(task: Task, wrongs: Iterable[Wrong], some: Sequence[tuple[Case, Outcome, Verdict]]) -> bool:
    """Whether an answer equals a slip in every case where the slip is wrong (there must be one), and else is right."""
    shown = False
    for wrong, (case, outcome, verdict) in zip(wrongs, some, strict=True):
        if wrong.outcome.kind != "answer":
            if outcome.kind == "answer" and not verdict.passed:
                return False
            continue
        if outcome.kind != "answer" or wrong.passes != verdict.passed:
            return False
        if not wrong.passes and not (
            same(outcome.answer, wrong.outcome.answer, 1e-5)
            if wrong.refused
            else near(task, case, outcome.answer, wrong.outcome.answer)
        ):
            return False
        shown |= wrong.far
    return shown
