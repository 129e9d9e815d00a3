"""What each lab asks: one definition of a task for learners and graders. `get("03-2")` and `lab("03")` find tasks,
`fresh` draws their cases, `run_all` calls a function on copies of these, and `judge_all` gives the result.
"""

from course_lib.tasks.core import Case, Misconception, Task, Verdict, fresh, public_seed
from course_lib.tasks.judging import Result, judge_all
from course_lib.tasks.plain import from_wire, plain, to_wire
from course_lib.tasks.registry import all_tasks, get, lab, lab_numbers
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
    "lab_numbers",
    "plain",
    "public_seed",
    "run",
    "run_all",
    "to_wire",
]
