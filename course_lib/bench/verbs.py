"""The verb bench."""

from __future__ import annotations

import sys

import click

from course_lib.authoring.tree import course_tree


@click.command("bench")
@click.option("--notebooks", is_flag=True, help="Seconds and memory of each lesson in a fresh kernel, instead.")
@click.option("--grading", is_flag=True, help="Our grader against nbgrader on the same submissions, instead.")
@click.option("--count", type=click.IntRange(4), default=48, show_default=True, help="Submissions for --grading.")
@click.option("--only", "only", metavar="WORD", default="", help="Only cases or lessons with this in their name.")
@click.option("--write", is_flag=True, help="Write docs/benchmarks.md.")
def bench(notebooks: bool, grading: bool, count: int, only: str, write: bool) -> None:
    """Measure the library against the professional tools, side by side, on the same number of threads."""
    if grading:
        from .bench_grading import bench_grading

        sys.exit(bench_grading(course_tree(), count, click.echo))
    if notebooks:
        from .notebook_cost import weigh_lessons

        sys.exit(weigh_lessons(course_tree(), only, click.echo))
    from .run_cases import bench_cases

    sys.exit(bench_cases(course_tree(), only, write, click.echo))
