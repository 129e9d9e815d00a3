"""The verbs with which people decide, and ask why: `regrade`, `adjust`, `marks`, `explain`, `forget`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from course_lib import tasks
from course_lib.authoring.tree import CourseError
from course_lib.grading.ledger.ledger import Decision, Ledger
from course_lib.grading.ledger.resolve import find_lab, find_standing, find_submission, find_task
from course_lib.grading.safe_text import clean, shown

from .engine import chosen_engine, engine_options
from .tell import grades_option

__all__ = ["adjust", "explain", "forget", "marks", "regrade"]


def _ledger(grades: Path, write: bool = False) -> Ledger:
    return Ledger(grades / "ledger.sqlite", write, make=False)


@click.command("regrade")
@click.argument("labs", nargs=-1, metavar="[LAB…]")
@grades_option
@click.option("--dry-run", is_flag=True, help="Only list whose grade would change.")
@click.option("--never-lower", is_flag=True, help="Nobody loses points by it.")
@click.option("--yes", is_flag=True, help="Change without asking.")
@engine_options
def regrade(
    labs: tuple[str, ...], grades: Path, dry_run: bool, never_lower: bool, yes: bool, sandbox: str, **told: Any
) -> None:
    """Grade again what was graded by an earlier version of a lab, its judges or the grader, with the same seeds.

    Lists whose grade changes, and why, before it changes any.
    """
    from course_lib.grading.run.regrade import apply, changes, outdated, rerun

    with _ledger(grades, write=not dry_run) as ledger:
        found = outdated(ledger, [find_lab(lab) for lab in labs] or list(tasks.lab_numbers()))
        click.echo(f"{len(found)} submissions were graded by an earlier version.")
        if not found:
            return
        engine = chosen_engine(grades, sandbox=sandbox, **told)
        records = rerun(found, grades / "originals", sandbox, engine)
        changed = changes(found, records)
        table = Table("student", "task", "points", "why", title=f"{len(changed)} grades change")
        for one in changed:
            kept = never_lower and one.new < one.old
            points = f"{one.old:g}, kept" if kept else f"{one.old:g} -> {one.new:g}"
            table.add_row(clean(one.entry.student or one.entry.named), one.task, points, clean(one.why))
        Console(markup=False, highlight=False).print(table)
        if dry_run:
            click.echo("Nothing was changed (--dry-run).")
            return
        if changed and not yes:
            click.confirm("Change them?", abort=True)
        kept, failed = apply(ledger, found, records, never_lower)
    click.echo(f"{kept} regraded, {failed} could not be graded and stay as they were.")


@click.command("adjust")
@click.argument("student")
@click.argument("lab")
@click.argument("task")
@grades_option
@click.option("--points", type=float, metavar="N", help="What the task is to count.")
@click.option("--excuse", is_flag=True, help="Excuse from the whole lab (TASK is then `all`); this is not 0.")
@click.option("--assign", is_flag=True, help="Give a waiting submission to STUDENT; TASK is its number or path.")
@click.option("--by", "who", required=True, metavar="WHO")
@click.option("--reason", required=True, metavar="TEXT")
def adjust(
    student: str,
    lab: str,
    task: str,
    grades: Path,
    points: float | None,
    excuse: bool,
    assign: bool,
    who: str,
    reason: str,
) -> None:
    """Change the points of one task by hand. What was before stays in the ledger.

    TASK is a number (2) or an id (03-2).
    """
    if [points is not None, excuse, assign].count(True) != 1:
        raise click.UsageError("say one of --points N, --excuse and --assign.")
    number = find_lab(lab)
    with _ledger(grades, write=True) as ledger:
        student = shown(student)
        if assign:
            entry = find_submission(ledger, number, task)
            ledger.decide(Decision(student, number, "assign", who, reason, entry.id))
            click.echo(f"{clean(entry.path)} is now {clean(student)}'s.")
            return
        one = find_standing(ledger, student, number)
        if excuse:
            if task != "all":
                raise click.UsageError("one is excused from a whole lab: write `all` for TASK.")
            ledger.decide(Decision(student, number, "excuse", who, reason))
            click.echo(f"{student} is excused from lab {number}.")
            return
        which = find_task(number, task)
        if not 0 <= points <= which.points:
            raise CourseError(f"{points:g} points are not between 0 and {which.points:g}.")
        before = next((item.points for item in one.tasks if item.id == which.id), None)
        if before is None or one.entry is None:
            raise CourseError(f"{student} has no graded submission of lab {number} whose points could change.")
        ledger.decide(Decision(student, number, "adjust", who, reason, one.entry.id, which.id, points))
    click.echo(f"{student}, {which.id}: {before:g} -> {points:g} of {which.points:g}.")


@click.group("marks")
def marks() -> None:
    """Tasks that are marked by hand: their answers out, the points in."""


@marks.command("out")
@click.argument("lab")
@grades_option
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), required=True, metavar="FILE")
def marks_out(lab: str, grades: Path, out: Path) -> None:
    """Write a CSV with every answer to mark, its rubric, and empty columns for points and comment."""
    from course_lib.grading.tell.marks import write_marks

    with _ledger(grades) as ledger:
        click.echo(f"{out}: {write_marks(ledger, find_lab(lab), out)} answers to mark.")


@marks.command("in")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@grades_option
@click.option("--by", "who", required=True, metavar="WHO")
def marks_in(file: Path, grades: Path, who: str) -> None:
    """Take the points of such a CSV over, all or none; rows without points are left."""
    from course_lib.grading.tell.marks import read_marks

    with _ledger(grades, write=True) as ledger:
        click.echo(f"{read_marks(ledger, file, who)} marks taken over.")


@click.command("explain")
@click.argument("student", required=False)
@click.argument("lab", required=False)
@click.argument("task", required=False)
@grades_option
def explain(student: str | None, lab: str | None, task: str | None, grades: Path) -> None:
    """Say how a grade came to be, from the bytes handed in to the points.

    Without STUDENT, LAB and TASK it lists what waits for a person.
    """
    from course_lib.grading.tell.explain import explain as lines
    from course_lib.grading.tell.explain import waiting

    with _ledger(grades) as ledger:
        if not student:
            found = list(waiting(ledger))
            click.echo("\n".join(found) or "Nothing waits for a person.")
            return
        if not (lab and task):
            raise click.UsageError("say which: STUDENT LAB TASK.")
        number = find_lab(lab)
        for line in lines(ledger, find_standing(ledger, student, number), find_task(number, task)):
            click.echo(line)


@click.command("forget")
@click.argument("student")
@grades_option
@click.option("--yes", is_flag=True, help="Without asking.")
def forget(student: str, grades: Path, yes: bool) -> None:
    """Erase a student: submissions, grades, decisions, feedback. It cannot be undone."""
    from course_lib.grading.ledger.erase_student import forget as erase

    with _ledger(grades, write=True) as ledger:
        if not yes:
            click.confirm(f"Erase everything of {student} in {grades}?", abort=True)
        gone = erase(ledger, student, grades)
    click.echo(f"{student} is forgotten here ({gone} files erased). Exports that you made before still name them.")
