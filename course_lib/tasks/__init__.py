"""What each lab asks: one definition for learners and graders.

How to write a task
-------------------
A lab's tasks stand in `course_lib/tasks/lab_NN.py` as `TASKS: tuple[Task, ...]`; the registry finds the module by its
name. A complete one::

    import numpy as np

    from course_lib.tasks.core import Case, Misconception, Task
    from course_lib.tasks.judges import judge_array

    def _cases(rng):                                   # fresh ones from any seed; the public ones are drawn likewise
        cases = []
        for count in (1, 7, 40):
            z = rng.uniform(0.5, 4.0, count)
            pixels = rng.uniform(-300, 300, count)
            cases.append(Case({"pixels": pixels, "z": z, "f": 525.0},   # plain data, in the order of the signature
                              {"truth": pixels * z / 525.0},            # only the judge sees this
                              name=f"{count} pixels"))
        return cases

    TASKS = (
        Task(
            id="03-1", title="lift pixels to metres", points=1, version=1, kind="fill",
            signature="def lift(pixels, z, f)",
            cases=_cases,
            judge=lambda case, answer: judge_array(answer, case.truth, 1e-4, "m", what="x"),
            misconceptions=(
                Misconception(
                    "focal length forgotten",
                    "pixels times depth with no division by the focal length: that is f times too far from the axis",
                    "def lift(pixels, z, f):\\n    return pixels * z\\n",
                ),
            ),
            may_call=("numpy",),
            hides=("course_lib.cameras.deproject",),
            where="lesson 03, section 1 (the pinhole model)",
        ),
    )

In the lab (solutions/source/03_….py) stands the cell tagged `task` with a `def` of this name, and after it one tagged
`check` with `check("03-1", lift)`. What tests/tasks then prove of every registered task, and so what to mind:

- **Truth under the key "truth"**, in the form of an answer. Then the judge also measures how far a learner's answer is
  from a misconception's, and recognition costs nothing. Otherwise give the task a `distance(case, a, b)` in tolerances.
- **A misconception's message** completes "This looks like …": say what happened, then what to do. Its `source` is
  learner code. It must be ≥ 5 tolerances from the truth in a public case (and for any seed), and no other misconception
  may fit it: design a case that tells them apart, or name them `alike`. A negative, odd, tiny or single one often does.
- **Tolerance ≥ 3 times the reference's own error**: leave room for float32 answers. Judges take any plain answer: use
  the helpers of `judges` (and `worst_of` for several parts), which turn garbage into one sentence.
- `cases(rng)` uses `rng` alone, is quick (< 0.2 s; images of 40x30 do), and draws inputs that fail for a reason: holes,
  a single point, a corner pixel. Give each case a `name` that may be read on the card.
- **Kinds**: fill (one line, two hints), write, mend, which (`judge_choice`), real (`data=("tum_pair",)`; then
  `cases(rng, load)` with `load("tum_pair")`), open (`judge_band`, and `guess(rng)`: a function with random settings),
  explain (`judge_words`, `rubric=(…0, …1, …2)`, points=2).
- Raise `version` when a change could change a grade.

How a task is used
------------------
`get("03-2")`, `lab("03")`, `all_tasks()`; `fresh(task, seed)` draws cases, `run_all(function, cases)` calls the
function on copies, `judge_all(task, cases, outcomes)` gives the `Result`. `to_wire` and `from_wire` carry what is given
and answered to another process and back.
"""

from __future__ import annotations

import difflib
import importlib
import pkgutil

from course_lib.tasks.core import Case, Misconception, Task, Verdict, fresh, public_seed
from course_lib.tasks.judging import Result, judge_all
from course_lib.tasks.plain import from_wire, plain, to_wire
from course_lib.tasks.private import private_tasks
from course_lib.tasks.running import Outcome, run, run_all

__all__ = [
    "Case",
    "Misconception",
    "Outcome",
    "Result",
    "Task",
    "Verdict",
    "all_tasks",
    "fresh",
    "from_wire",
    "get",
    "judge_all",
    "lab",
    "labs",
    "plain",
    "public_seed",
    "run",
    "run_all",
    "to_wire",
]


def labs() -> tuple[str, ...]:
    """The labs that have tasks: ("00", "01", …)."""
    return tuple(sorted(m.name[4:] for m in pkgutil.iter_modules(__path__) if m.name.startswith("lab_")))


def lab(number: str) -> tuple[Task, ...]:
    """The tasks of a lab, in order; an instructor's own tasks after the course's (see `private`).

    Raises
    ------
    ValueError
        If there is no such lab, or its module holds tasks that are not its own.
    """
    if number not in labs():
        raise ValueError(f"there is no lab {number!r}; there are {', '.join(labs())}.")
    tasks = importlib.import_module(f"{__name__}.lab_{number}").TASKS + private_tasks(number)
    if [task.id for task in tasks] != [f"{number}-{count}" for count in range(1, len(tasks) + 1)]:
        raise ValueError(f"lab_{number}.py: its tasks must be numbered {number}-1, {number}-2, … in order.")
    return tasks


def get(task_id: str) -> Task:
    """The task of an id such as "03-2".

    Raises
    ------
    ValueError
        If there is none; the nearest is suggested.
    """
    number = task_id[:2] if isinstance(task_id, str) else ""
    for task in lab(number) if number in labs() else ():
        if task.id == task_id:
            return task
    known = (
        [f"{n}-{count}" for n in labs() for count in range(1, 10)]
        if number not in labs()
        else [t.id for t in lab(number)]
    )
    near = difflib.get_close_matches(str(task_id), known, 1, 0.3)
    raise ValueError(f"there is no task {task_id!r}" + (f"; did you mean {near[0]!r}?" if near else "."))


def all_tasks() -> tuple[Task, ...]:
    """Every task of every lab."""
    return tuple(task for number in labs() for task in lab(number))
