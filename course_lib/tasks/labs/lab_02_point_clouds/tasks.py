"""Lab 02: lists, bytes and frames of point clouds."""

from __future__ import annotations

from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_02_point_clouds import few, list_rows, messages, way_back
from course_lib.tasks.labs.lab_02_point_clouds.causes import CAUSE_OF, SIGNS, WHICH_MISTAKES

# Task 4: which mistake moved it?

_TASK_4 = which_cause(
    "02-4",
    "Which mistake moved it?",
    CAUSE_OF,
    "the five clouds above",
    WHICH_MISTAKES,
    "lesson 02, sections 3 and 5",
    signs=SIGNS,
)

# Task 6: explain

_TASK_6 = in_words(
    "02-6",
    "Explain",
    (
        "0: neither what NaN saves you from nor what it costs",
        "1: that a zero is taken for a place (at the camera) and a NaN is not, or that the order of the pixels is kept",
        "2: both: a zero is a wrong point at the camera that enters every mean unnoticed; NaN keeps pixels in place",
    ),
    "lesson 02, section 2 (ordered and unordered)",
)

TASKS = (list_rows.TASK, messages.TASK, way_back.TASK, _TASK_4, few.TASK, _TASK_6)
