"""The program of a worker: tied to the process that started it before its long imports begin."""

from __future__ import annotations

from course_lib.grading.run.die_with_parent import die_with_parent

if __name__ == "__main__":
    die_with_parent()
    from course_lib.grading.run import worker

    worker.main()
