"""What a task is: cases drawn from a seed, a judge, the wrong answers that people really give, points.

A task is judged by what its function returns for plain inputs; nothing here knows notebooks, files or processes.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from course_lib.tasks.plain import Plain, plain

KINDS = ("fill", "write", "mend", "which", "real", "open", "explain")
LIBRARY = ("geometry", "camera", "cloud", "surface", "registration", "robot")
"""The rooms of course_lib that lessons import from, from the ground up."""
SCENES, SCENES_SHOWN = 7, 3
"""An open task earns what it earns in the worst of so many scenes; so many a learner's check shows."""
HARMLESS = ("builtins", "math", "cmath", "typing", "collections", "itertools", "functools", "operator", "__future__")
"""Modules that every task may use."""


@dataclass(frozen=True, eq=False)
class Case:
    """One question: what the function is given, and what only the judge knows.

    Parameters
    ----------
    given : argument name to plain value; the function is called `function(*given.values())` with copies.
    hidden : for the judge alone. By convention `hidden["truth"]` is the true answer in the form of an answer: then
        misconceptions are recognised with no more work (see `Task.distance`). Where many answers are right,
        `hidden["form"]` may hold something of their form.
    name : what is special about it, for the card: "a depth image with holes".
    """

    given: Mapping[str, Plain]
    hidden: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""

    @property
    def truth(self) -> Plain:
        """The true answer, `hidden["truth"]`."""
        return self.hidden["truth"]


@dataclass(frozen=True)
class Verdict:
    """What a judge says of one answer to one case.

    Parameters
    ----------
    passed : whether the answer is right.
    error, tolerance : in `unit`, at the worst place; `inf` where the answer has no size of error (wrong shape, NaN).
    unit : "m", "rad", "deg", "px", "" …
    axis : where it is worst: "x", "rotation", "label".
    message : one sentence with the error in physical units; of a right answer too.
    score : 0 to 1; by default 1 if passed, else 0.
    """

    passed: bool
    error: float = 0.0
    tolerance: float = 0.0
    unit: str = ""
    axis: str = ""
    message: str = ""
    score: float = -1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "score", float(self.passed) if self.score < 0 else float(self.score))

    @property
    def ratio(self) -> float:
        """The error in tolerances; infinite for a wrong answer that has no size of error."""
        if self.tolerance > 0 and np.isfinite(self.error):
            return float(self.error / self.tolerance)
        return 0.0 if self.passed else float("inf")


@dataclass(frozen=True)
class Misconception:
    """A wrong answer that people really give.

    Parameters
    ----------
    name : short, lower case, unique in its task: "millimetres for metres". It is what the class report counts.
    message : completes "This looks like …" with what happened and what to do; no full stop needed.
    source : learner code, a `def` with the task's function name; `np` and `math` are there, other imports stand in it.
    alike : names of misconceptions of the same task that no case can tell from this one; they are reported together.
    variants : more learner code of the same mistake that answers differently (uint16 overflows, floats do not).
    """

    name: str
    message: str
    source: str
    alike: tuple[str, ...] = ()
    variants: tuple[str, ...] = ()

    @property
    def sources(self) -> tuple[str, ...]:
        """The source and its variants."""
        return (self.source, *self.variants)


def lowest(verdicts: Sequence[Verdict]) -> int:
    """The case of the lowest score, which an open task is scored by and spoken of; of several the farthest off."""
    return min(range(len(verdicts)), key=lambda i: (verdicts[i].score, -verdicts[i].ratio, i))


Judge = Callable[[Case, Plain], Verdict]


@dataclass(frozen=True, eq=False)
class Task:
    """One task of a lab; the package's docstring has a complete example.

    Parameters
    ----------
    id : "03-2": lab 03, task 2.
    title : as in the lab's heading and in the stub's `NotImplementedError("Task 2: <title>")`.
    points : what it is worth.
    version : raised whenever cases, judge or tolerances change what an answer earns.
    signature : "def deproject(depth, camera_matrix)", as the lab shows it.
    cases : draws cases from a NumPy generator; for tasks with `data` it is called `cases(rng, load)`, and draws
        only its made cases, three or more, where `load` is None.
    judge : `judge(case, answer) -> Verdict` for a plain answer; must not raise, whatever the answer.
    misconceptions : the wrong answers that people give.
    may_call : modules that the answer may use beside `HARMLESS`: ("numpy", "course_lib.geometry.transforms").
    hides : dotted names that are the answer: ("course_lib.camera.pinhole.deproject",). The grader cuts them out.
    kind : one of KINDS.
    where : what to read again: "lesson 03, section 2 (the pinhole model)".
    distance : `distance(case, a, b)` in tolerances, where the default will not do. The default judges `a` with `b` in
        the place of `hidden["truth"]`.
    anatomy : for answers whose parts have names: `anatomy(case, answer)` says which part is wrong, the one that causes
        the others first, as (name, sentence); None for the usual one.
    refused : the same of answers that the judge refuses; it may be the same function, if it knows any form.
    data : names of real datasets that the cases need; makes `cases` take `load` (the notebook's `data.load`).
    guess : for open tasks: `guess(rng)` returns a function with random settings, which must earn less than half.
    rubric : for explain tasks: what earns 0, 1 and 2.
    repeats : whether the lesson's own code answers it; of a lab at most two tasks, worth a quarter of its points.
    keeps_inputs : whether an answer that changes what it was given fails, right as it may be.
    """

    id: str
    title: str
    points: float
    version: int
    signature: str
    cases: Callable[..., Sequence[Case]]
    judge: Judge
    misconceptions: tuple[Misconception, ...] = ()
    may_call: tuple[str, ...] = ("numpy",)
    hides: tuple[str, ...] = ()
    kind: str = "write"
    where: str = ""
    distance: Callable[[Case, Plain, Plain], float] | None = None
    anatomy: Callable[[Case, Plain], tuple[str, str] | None] | None = None
    refused: Callable[[Case, Plain], tuple[str, str] | None] | None = None
    data: tuple[str, ...] = ()
    guess: Callable[[np.random.Generator], Callable[..., Any]] | None = None
    rubric: tuple[str, ...] = ()
    repeats: bool = False
    keeps_inputs: bool = False

    def __post_init__(self) -> None:
        if not re.fullmatch(r"\d\d-\d+", self.id):
            raise ValueError(f"the task id {self.id!r} is not of the form '03-2' (lab 03, task 2).")
        if self.kind not in KINDS:
            raise ValueError(f"task {self.id}: its kind {self.kind!r} is none of {', '.join(KINDS)}.")
        if self.points <= 0 or self.version < 1 or not self.where:
            raise ValueError(f"task {self.id}: points, version and where (the section to read again) are needed.")
        if len(self.rubric) != (3 if self.kind == "explain" else 0):
            raise ValueError(f"task {self.id}: an explain task, and no other, has a rubric of three lines (0, 1, 2).")
        if (self.guess is not None) != (self.kind == "open"):
            raise ValueError(f"task {self.id}: an open task, and no other, has guess(rng): random settings.")
        names = [misconception.name for misconception in self.misconceptions]
        if len(set(names)) != len(names):
            raise ValueError(f"task {self.id}: two misconceptions have the same name.")
        _ = self.function

    @property
    def lab(self) -> str:
        """ "03" of "03-2"."""
        return self.id[:2]

    @property
    def number(self) -> int:
        """2 of "03-2"."""
        return int(self.id[3:])

    @property
    def label(self) -> str:
        """ "Task 2: <title>", the message of the stub's NotImplementedError."""
        return f"Task {self.number}: {self.title}"

    @property
    def function(self) -> str:
        """The name of the function to write."""
        return self._definition().name

    @property
    def arguments(self) -> tuple[str, ...]:
        """The names of its arguments."""
        return tuple(argument.arg for argument in self._definition().args.args)

    def _definition(self) -> ast.FunctionDef:
        try:
            node = ast.parse(self.signature.strip().rstrip(":") + ": ...").body[0]
        except SyntaxError as error:
            raise ValueError(f"task {self.id}: the signature {self.signature!r} is not a def line.") from error
        if not isinstance(node, ast.FunctionDef):
            raise ValueError(f"task {self.id}: the signature {self.signature!r} is not a def line.")
        return node

    @property
    def draws(self) -> int:
        """How many seeds fresh cases are drawn from: an open task earns what it earns in the worst of seven scenes."""
        return SCENES if self.kind == "open" else 1

    @property
    def shown(self) -> int:
        """How many of them a learner's check shows."""
        return SCENES_SHOWN if self.kind == "open" else 1

    def public(self, load: Callable[..., Any] | None = None) -> tuple[Case, ...]:
        """The cases of `check`: fresh cases of a seed that follows from the id; of an open task three scenes."""
        return fresh(self, public_seed(self.id), load, self.shown)


def public_seed(task_id: str) -> int:
    """The seed of a task's public cases."""
    return int.from_bytes(hashlib.sha256(f"public cases of {task_id}".encode()).digest()[:6], "big")


def fresh(task: Task, seed: int, load: Callable[..., Any] | None = None, draws: int | None = None) -> tuple[Case, ...]:
    """Cases of a task for a seed: one drawing, of an open task seven.

    Parameters
    ----------
    task : the task.
    seed : any whole number ≥ 0; the same seed gives the same cases.
    load : `course_lib.notebook.data.load`, or what stands for it; without it a task with `data` is asked on its made
        cases alone.
    draws : of so many drawings; by default `task.draws`.

    Raises
    ------
    ValueError
        If the task draws no cases, or cases that are not plain.
    """
    return _fresh(task, int(seed), load, task.draws if draws is None else draws)


@lru_cache(maxsize=16)
def _fresh(task: Task, seed: int, load: Callable[..., Any] | None, draws: int) -> tuple[Case, ...]:
    cases: list[Case] = []
    for draw in range(draws):
        rng = np.random.default_rng([seed, draw])
        drawn = task.cases(rng, load) if task.data else task.cases(rng)
        if not drawn:
            raise ValueError(f"task {task.id} drew no case.")
        for case in drawn:
            if tuple(case.given) != task.arguments:
                raise ValueError(f"task {task.id}: a case gives {tuple(case.given)}, the signature {task.arguments}.")
            cases.append(Case({name: plain(value, name) for name, value in case.given.items()}, case.hidden, case.name))
    return tuple(cases)
