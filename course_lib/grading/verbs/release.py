"""The verbs `release` and `viva`."""

from __future__ import annotations

from pathlib import Path

import click

from course_lib import tasks
from course_lib.authoring.tree import CourseError, course_tree
from course_lib.grading.disks import disk_told

__all__ = ["release", "viva"]


@click.command("release")
@click.argument("labs", nargs=-1, metavar="LAB…")
@click.option("--out", required=True, type=click.Path(file_okay=False, path_type=Path), metavar="FOLDER")
@click.option("--hints", type=click.IntRange(0, 3), default=3, show_default=True, help="Hints of each task that stay.")
@click.option(
    "--private-tasks",
    "private",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Your own tasks: lab_NN.py and lab_NN_cells.py.",
)
@click.option("--worked-class", is_flag=True, help="Instead, write a class of twelve made-up students who handed in.")
def release(labs: tuple[str, ...], out: Path, hints: int, private: Path | None, worked_class: bool) -> None:
    """Make what students get of some labs: a folder, a zip beside it, and a manifest.

    LAB is a number (03) or a name (03_depth_to_points). With --worked-class: submissions of lab 03, a roster,
    extensions and a late policy, to try the other verbs on.
    """
    if worked_class == bool(labs):
        raise click.UsageError("say which LAB to release, or --worked-class.")
    if worked_class:
        from course_lib.grading.release.worked_class import write_class

        with disk_told(out):
            download = write_class(out)
        click.echo(f"A class of twelve is in {download}; its roster, extensions and late policy are beside it.")
        return
    from course_lib.grading.release.private import use_private
    from course_lib.grading.release.release import release as write

    if private is not None:
        use_private(private)

    numbers = [name[:2] if name[:2].isdigit() else name.zfill(2) for name in labs]
    for name, number in zip(labs, numbers, strict=True):
        if number not in tasks.lab_numbers():
            raise CourseError(f"there is no lab {name!r} to release; there are {', '.join(tasks.lab_numbers())}.")
    with disk_told(out):
        archive = write(numbers, out, course_tree(), hints)
    click.echo(f"{out} and {archive.name} hold lab {', '.join(sorted(set(numbers)))}: give students the zip.")


@click.command("viva")
@click.argument("student")
@click.argument("lab")
@click.option("--grades", type=click.Path(exists=True, file_okay=False, path_type=Path), default=Path("grades"))
@click.option("--task", "number", type=click.IntRange(1), help="Only this task.")
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Another seed, other inputs.")
@click.option("--answers", is_flag=True, help="Also what should come out, for you.")
def viva(student: str, lab: str, grades: Path, number: int | None, seed: int, answers: bool) -> None:
    """Questions to a student about their own code: one changed input a task, "what comes out?"."""
    from course_lib.grading.tell.viva import questions

    for line in questions(grades, student, lab, number, seed, answers):
        click.echo(line)
