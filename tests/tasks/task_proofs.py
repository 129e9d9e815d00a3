"""What every registered task must stand: one function a property; test_proofs.py shows each failing on a bad task."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from how_thorough import sample
from traitlets.config import Config

from course_lib import tasks
from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.diagnosis.recognition import is_far, recognise
from course_lib.tasks.judging import Result, judge_all
from course_lib.tasks.plain import Plain, from_wire, plain, same, to_wire
from course_lib.tasks.running import Outcome, run_all

SEEDS = range(sample(50, 10))
FEW_SEEDS = range(sample(5, 2))


class Shell:
    """Cells as a learner runs them: an IPython shell of its own, `check` from the real place."""

    def __init__(self) -> None:
        from IPython.core.interactiveshell import InteractiveShell

        self.shell = InteractiveShell(config=Config({"HistoryManager": {"enabled": False}}))
        self.run("import math\nimport numpy as np\nfrom course_lib.notebook.check import check")

    def run(self, cell: str) -> Any:
        """The value of a cell; what it raised is raised here."""
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            result = self.shell.run_cell(cell, store_history=False, silent=False)
        result.raise_error()
        return result.result


def defined(source: str, name: str, preamble: str = "") -> Callable[..., Any]:
    """The function of a piece of source, on a preamble of imports."""
    space: dict[str, Any] = {"np": np, "math": math, "__name__": "__main__"}
    exec(compile(preamble + "\n" + source, f"<source of {name}>", "exec"), space)
    return space[name]


def result_of(task: Task, function: Callable[..., Any], seed: int | None, load: Any = None) -> Result:
    """The result of a function on public (None) or fresh cases."""
    cases = task.public(load) if seed is None else tasks.fresh(task, seed, load)
    return judge_all(task, cases, run_all(function, cases))


def reference_stands(task: Task, function: Callable[..., Any], load: Any = None) -> None:
    """It passes on many seeds, with full points, an error ≤ 1/3 of the tolerance, and no misconception that fits."""
    for seed in (None, *SEEDS):
        cases = task.public(load) if seed is None else tasks.fresh(task, seed, load)
        outcomes = run_all(function, cases)
        result = judge_all(task, cases, outcomes)
        assert result.passed, f"seed {seed}: {result.line}"
        assert result.score == 1.0, f"seed {seed}: it earns {result.points:g} of {task.points:g}: {result.error}"
        fits = recognise(task, cases, outcomes, result.verdicts)
        assert not fits, f"seed {seed}: the right answer is taken for {[m.name for m in fits]}"
        if task.kind not in ("open", "explain"):
            worst = max(verdict.ratio for verdict in result.verdicts)
            assert worst <= 1 / 3, f"seed {seed}: the reference's own error is {worst:.2f} tolerances, more than 1/3"


def misconception_shows(task: Task, misconception: Misconception, load: Any = None) -> None:
    """It fails, is far from the truth in a public case, and is recognised as itself and nothing else, for any seed."""
    for source in misconception.sources:
        function = defined(source, task.function)
        for seed in (None, *FEW_SEEDS):
            result = result_of(task, function, seed, load)
            assert not result.passed, f"{misconception.name!r} passes (seed {seed})"
            ratios = [f"{verdict.ratio:.2g}" for verdict in result.verdicts]
            far = any(is_far(task, verdict) for verdict in result.verdicts)
            assert far, f"{misconception.name!r} is never 5 tolerances from the truth (seed {seed}: {ratios})"
            names = {m.name for m in result.recognised}
            expected = {misconception.name, *misconception.alike}
            assert names == expected, f"{misconception.name!r} is taken for {sorted(names)} (seed {seed}: {ratios})"
            assert misconception.message.strip().rstrip(".") in result.line
            assert "\n" not in result.line and "  " not in result.line


def garbage(truth: Plain) -> Iterator[tuple[str, Any, bool]]:
    """(name, answer, surely wrong) of answers that nobody should give; those of the truth's form are spoiled copies."""
    yield "None", None, True
    yield "a text", "rubbish", True
    yield "a type", int, True
    yield "a function", len, True
    yield "an object", object(), True
    yield "a generator", (n for n in range(3)), True
    yield "an empty list", [], True
    yield "a ragged list", [[1, 2], [3]], True
    yield "a set", {1, 2}, True
    yield "a dict of nothing", {}, True
    yield "a dict with odd keys", {(1, 2): 3}, True
    yield "a dict that holds itself", _own_tail(), True
    yield "a complex number", 1 + 2j, True
    yield "NaN", math.nan, True
    yield "infinity", -math.inf, True
    yield "a huge whole number", 10**400, True
    yield "an array of NaN", np.full((4, 4), np.nan), True
    yield "an empty array", np.empty((0, 3)), True
    yield "an object array", np.array([None, "x"], dtype=object), True
    yield "a text array", np.array(["a", "b"]), True
    yield "a date", np.datetime64("2026-11-21"), True
    yield "a masked array", np.ma.masked_all((2, 3)), True
    yield "a record array", np.zeros(3, dtype=[("x", "f4"), ("y", "i2")]), True
    yield "80 GB", np.broadcast_to(np.float64(0), (100_000, 100_000)), True
    yield "a million items", [0] * 1_000_000, True
    yield "a long text", "x" * 10_000_000, True
    yield "seven dimensions", np.zeros((1,) * 7), True
    yield from _spoiled(truth)


def _own_tail() -> dict[str, Any]:
    loop: dict[str, Any] = {}
    loop["again"] = loop
    return loop


def _spoiled(value: Plain) -> Iterator[tuple[str, Any, bool]]:
    """Copies of an answer of which one part was spoiled."""
    if isinstance(value, dict):
        for key in value:
            yield f"without {key!r}", {k: v for k, v in value.items() if k != key}, True
            for name, part, wrong in _spoiled(value[key]):
                yield f"{key!r}: {name}", {**value, key: part}, wrong
            yield f"{key!r}: None", {**value, key: None}, True
    elif isinstance(value, list):
        yield "one too many", [*value, value[-1] if value else 0], True
        for i in range(min(len(value), 3)):
            yield f"[{i}]: None", [*value[:i], None, *value[i + 1 :]], True
            for name, part, wrong in _spoiled(value[i]):
                yield f"[{i}]: {name}", [*value[:i], part, *value[i + 1 :]], wrong
    elif isinstance(value, np.ndarray) and value.dtype.names is None and value.size:
        yield "transposed", value.T, False
        yield "flattened", value.reshape(-1), False
        yield "a row missing", value[:-1], True
        yield "one more dimension", value[None], True
        yield "as text", value.astype(str), True
        yield "as objects", value.astype(object), True
        yield "as nested lists", value.tolist(), False
        if value.dtype.kind == "f" and np.isfinite(value).any():
            yield "all NaN", np.full_like(value, np.nan), True
            yield "all infinite", np.full_like(value, np.inf), True
            yield (
                "one NaN",
                np.where(np.arange(value.size).reshape(value.shape) == value.size // 2, np.nan, value),
                False,
            )
            yield "huge", np.where(np.isfinite(value), 1e300, value), True
            yield "as integers", np.nan_to_num(value).astype(np.int64), False
    elif isinstance(value, float):
        yield "NaN", math.nan, not math.isnan(value)
        yield "infinite", math.inf, True


def garbage_gets_a_sentence(task: Task, reference: Callable[..., Any], load: Any = None) -> None:
    """Every garbage answer gets one failed verdict with one readable sentence; no judge stumbles."""
    cases = task.public(load)
    answers = [outcome.answer for outcome in run_all(reference, cases)]
    spoiled = [list(garbage(answer)) for answer in answers]
    for index, (name, _, surely) in enumerate(spoiled[0]):
        outcomes = [_as_outcome(kinds[min(index, len(kinds) - 1)][1]) for kinds in spoiled]
        result = judge_all(task, cases, outcomes)
        is_text = isinstance(answers[0], str)
        if surely and not (is_text and name == "a text"):
            assert not result.passed, f"{name} passes"
            assert result.points <= task.points / 2, f"{name} earns {result.points}"
        sentence = result.error
        assert 8 < len(sentence) < 420 and "\n" not in sentence, f"{name}: {sentence!r}"
        assert sentence[0].isupper() or not sentence[0].isalpha() or sentence[0] in "xyzuv", f"{name}: {sentence!r}"
        assert sentence.rstrip().endswith((".", "?", "!")), f"{name}: {sentence!r}"
        assert "Traceback" not in sentence and "object at 0x" not in sentence, f"{name}: {sentence!r}"


def _as_outcome(value: Any) -> Outcome:
    return run_all(lambda: value, [Case({})])[0]


def inputs_are_safe(task: Task, reference: Callable[..., Any], load: Any = None) -> None:
    """A function that spoils its inputs harms nobody, and passes unless the task forbids it."""
    cases = task.public(load)
    before = [to_wire(dict(case.given)) for case in cases]

    def vandal(*arguments: Any) -> Any:
        answer = plain(reference(*arguments))
        for argument in arguments:
            if isinstance(argument, np.ndarray):
                argument[...] = np.zeros((), argument.dtype)
            elif isinstance(argument, (list, dict)):
                argument.clear()
        return answer

    result = judge_all(task, cases, run_all(vandal, cases))
    assert result.passed == (not task.keeps_inputs), result.line
    assert [to_wire(dict(case.given)) for case in cases] == before
    outcomes = run_all(reference, cases)
    for case, outcome, wire in zip(cases, outcomes, before, strict=True):
        given = from_wire(wire)
        assert list(given) == list(task.arguments)
        assert same(given, dict(case.given)), "what is given does not survive the wire"
        assert same(from_wire(to_wire(outcome.answer)), outcome.answer), "the answer does not survive the wire"
    again = tasks.fresh(task, 7, load)
    tasks.core._fresh.cache_clear()
    once_more = tasks.fresh(task, 7, load)
    assert [to_wire(dict(c.given)) for c in again] == [to_wire(dict(c.given)) for c in once_more], (
        "a seed is not a seed"
    )


def guessing_does_not_pay(task: Task, load: Any = None) -> None:
    """Of many functions with random settings none earns half of an open task."""
    assert task.guess is not None
    rng = np.random.default_rng(tasks.public_seed(task.id))
    scores = [result_of(task, task.guess(rng), None, load).score for _ in SEEDS]
    lucky = sum(score >= 0.5 for score in scores)
    assert not lucky, f"{lucky} of {len(scores)} random settings earn half or more: the best {max(scores):.2f}"


def unfair_share(
    task: Task, reference: Callable[..., Any], load: Any = None, seeds: int = sample(10, 3)
) -> tuple[int, int]:
    """How many of the answers that pass in public fail on fresh cases.

    The population is a model of honest answers: the right one in the forms that people give it (as it is, in float32,
    as nested lists), and the right one with errors of all sizes: times 1 ± e, or plus or minus e, with e log-uniform
    from 1e-9 to 1. Each that passes on the public cases is judged on `seeds` fresh drawings. What can fail there is an
    error near the tolerance, in a drawing whose values are larger than the public ones': a generator that always draws
    its largest value avoids that. Tasks without floats in their answers have only the forms.

    Returns
    -------
    (failures, judgements) over all pairs of a public-passing answer and a fresh drawing.
    """
    drawings = [task.public(load), *(tasks.fresh(task, seed, load) for seed in range(100, 100 + seeds))]
    answers = [[outcome.answer for outcome in run_all(reference, cases)] for cases in drawings]
    has_floats = any(not same(_on_floats(answer, lambda x: x * 0 + 1), answer) for answer in answers[0])

    def passes(which: int, change: Callable[[Plain], Plain]) -> bool:
        return _passes(task, drawings[which], [plain(change(answer)) for answer in answers[which]])

    failed = judged = 0
    for change in (*FORMS, *(_errors() if has_floats else ())):
        if passes(0, change):
            judged += seeds
            failed += sum(not passes(which, change) for which in range(1, len(drawings)))
    return failed, judged


def _passes(task: Task, cases: Sequence[Case], answers: Sequence[Plain]) -> bool:
    if task.kind == "open":
        return judge_all(task, cases, [Outcome("answer", answer) for answer in answers]).passed
    return all(task.judge(case, answer).passed for case, answer in zip(cases, answers, strict=True))


def _errors() -> Iterator[Callable[[Plain], Plain]]:
    for size in np.logspace(-9, 0, 91):
        for e in (-size, size):
            yield lambda value, e=e: _on_floats(value, lambda x: x * (1 + e))
            yield lambda value, e=e: _on_floats(value, lambda x: x + e)


def _on_floats(value: Plain, change: Callable[[Any], Any]) -> Plain:
    """A plain value with its floats changed."""
    if isinstance(value, dict):
        return {key: _on_floats(item, change) for key, item in value.items()}
    if isinstance(value, list):
        return [_on_floats(item, change) for item in value]
    if isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
        changed = change(value)
        return float(changed) if isinstance(value, float) else changed
    return value


FORMS: tuple[Callable[[Plain], Plain], ...] = (
    lambda value: value,
    lambda value: _on_floats(value, lambda x: np.asarray(x, np.float32).astype(np.float64)),
    lambda value: _on_floats(value, lambda x: x.tolist() if isinstance(x, np.ndarray) else x),
)
