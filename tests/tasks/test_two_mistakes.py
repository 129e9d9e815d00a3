"""Two mistakes in one answer are told apart, case by case."""

import numpy as np

from course_lib import tasks
from course_lib.tasks import judge_all, run_all


def both_wrong(raw, encoding):
    """65535 believed, and SUN's bits shifted, not rotated; TUM is right."""
    if encoding == "sun":
        raw = raw >> 3
    return raw / (5000 if encoding == "tum" else 1000)


def overflow_only(raw, encoding):
    if encoding == "sun":
        raw = (raw >> 3) | (raw << 13)
    return raw / (5000 if encoding == "tum" else 1000)


def overflow_and_something_else(raw, encoding):
    return overflow_only(raw, encoding) + (0.3 if encoding == "sun" else 0.0)


def judged(function):
    task = tasks.get("01-2")
    cases = task.public()
    return judge_all(task, cases, run_all(function, cases))


def test_each_mistake_is_named() -> None:
    result = judged(both_wrong)
    assert {m.name for m in result.recognised} == {"65535 believed", "SUN shifted, not rotated"}
    assert ", and in another case like " in result.looks_like


def test_one_mistake_stays_one() -> None:
    result = judged(overflow_only)
    assert [m.name for m in result.recognised] == ["65535 believed"]
    assert ", and in another case" not in result.looks_like


def test_an_unexplained_case_leaves_all_unsaid() -> None:
    assert judged(overflow_and_something_else).recognised == ()


def test_a_right_answer_has_none() -> None:
    def right(raw, encoding):
        raw = np.where(raw == 65535, 0, raw) if encoding == "realsense" else raw
        return overflow_only(raw, encoding)

    assert judged(right).passed and judged(right).recognised == ()
