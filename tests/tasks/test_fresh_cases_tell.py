"""Fresh cases let no wrong answer through: each mistake, variant and slip passes on at most 2 of 100 seeds.

A slip that passes on every seed changes nothing that the task asks for (a floor of whole numbers): it is no slip there.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator

import pytest
from collected import TASKS, loader, reference
from how_thorough import sample

from course_lib import tasks
from course_lib.tasks.core import Case, Task
from course_lib.tasks.diagnosis.diagnose import changed, slipped
from course_lib.tasks.diagnosis.recognition import wrong_answer
from course_lib.tasks.diagnosis.slips import answer_slips, input_slips

SEEDS = range(500, 500 + sample(100, 10))
MOST = math.ceil(0.02 * len(SEEDS))
JUDGED = [task for task in TASKS if task.kind not in ("which", "explain")]
Passes = Callable[[Case], bool]


def wrong_answers(task: Task, first: Case, right: Callable) -> Iterator[tuple[str, Passes]]:
    """The name of each wrong answer, and whether it passes a case."""
    for mistake in task.misconceptions:
        for i, source in enumerate(mistake.sources):
            yield f"{mistake.name} ({i})", lambda case, source=source: wrong_answer(task, source, case).passes
    if task.kind == "open":
        return
    for slip in answer_slips(first.truth) if "truth" in first.hidden else ():
        yield (
            f"answer {slip.name}",
            lambda case, slip=slip: slipped(task, case, lambda c: slip.apply(c.truth)).passes,
        )
    for slip in input_slips(first.given):
        yield f"input {slip.name}", lambda case, slip=slip: changed(task, case, slip, right).passes


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("task", JUDGED, ids=[task.id for task in JUDGED])
def test_wrong_answers_pass_on_few_seeds(task: Task) -> None:
    load, right = loader(task), reference(task)
    passed: Counter[str] = Counter()
    mistakes: set[str] = set()
    for seed in SEEDS:
        cases = list(tasks.fresh(task, seed, load))
        for name, passes in wrong_answers(task, cases[0], right):
            if not name.startswith(("answer ", "input ")):
                mistakes.add(name)
            if all(passes(case) for case in cases):
                passed[name] += 1
    often = {name: count for name, count in passed.items() if count > MOST and (name in mistakes or count < len(SEEDS))}
    assert not often, f"on how many of {len(SEEDS)} seeds a wrong answer passes: {often}"
