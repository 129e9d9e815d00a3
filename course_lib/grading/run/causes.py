"""What lies behind the error that a learner's code ends with: told, so that nobody looks in the wrong line."""

from __future__ import annotations

from course_lib.grading.records import TaskRecord

from .limits import Limits

__all__ = ["with_causes"]

SYSTEM_ERRORS = (
    ("No space left on device", "folder_mb"),
    ("File too large", "file_mb"),
    ("Too many open files", "open_files"),
    ("Unable to allocate", "memory_mb"),
    ("MemoryError", "memory_mb"),
    ("can't start new thread", "threads"),
    ("Resource temporarily unavailable", "threads"),
)
"""What the system says inside when a limit strikes there, and which limit it is."""
NOT_THERE = (
    ("FileNotFoundError", "No file of your own is there when a lab is graded."),
    ("StdinNotImplementedError", "Nobody is there to answer input() when a lab is graded."),
)
"""What Python says inside of what every learner has and no graded notebook."""


def with_causes(task: TaskRecord, raised: str, limits: Limits) -> str:
    """The error with what lies behind it: a line of the cell that failed first, a limit, what is not there.

    It stands before the inputs, which a student is not told.
    """
    error, given, inputs = task["error"].partition(" It was given ")
    if raised and raised not in error:
        error += f" Before that, {raised}."
    if task["status"] == "raised":
        name = next((name for words, name in SYSTEM_ERRORS if words in error), "")
        error += f" That is a limit of grading: {name} = {getattr(limits, name):g}." if name else ""
    return "".join([error, *(f" {text}" for word, text in NOT_THERE if word in error), given, inputs])
