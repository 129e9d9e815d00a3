"""The verbs that tell: `feedback`, `export`, `class-report`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from course_lib.authoring.tree import CourseError
from course_lib.grading.ledger.attempts import Standing, standings
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.tell.export import FORMATS, write_export

__all__ = ["class_report", "export", "feedback", "grades_option", "lab_option"]

grades_option = click.option(
    "--grades",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("grades"),
    show_default=True,
    help="The folder that `course grade --out` made.",
)
lab_option = click.option("--lab", metavar="LAB", help="Only this lab.")


def _standings(grades: Path, lab: str | None, student: str | None = None) -> list[Standing]:
    with Ledger(grades / "ledger.sqlite", write=False) as ledger:
        found = standings(ledger, lab, student)
    if not found:
        wanted = " ".join(f"{what} {value}" for what, value in (("lab", lab), ("student", student)) if value)
        raise CourseError(f"{grades} holds nothing{' of ' + wanted if wanted else ''}.")
    return found


@click.command("feedback")
@grades_option
@lab_option
@click.option("--student", metavar="ID", help="Only this student.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Where to; else GRADES/feedback.")
def feedback(grades: Path, lab: str | None, student: str | None, out: Path | None) -> None:
    """Write an HTML page for each student and lab, and index.html for you."""
    from course_lib.grading.tell.feedback import write_feedback

    paths = write_feedback(_standings(grades, lab, student), out or grades / "feedback")
    click.echo(f"{len(paths) - 1} pages in {paths[-1].parent}.")


@click.command("export")
@grades_option
@lab_option
@click.option("--format", "form", type=click.Choice(FORMATS), required=True)
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), required=True, metavar="FILE")
def export(grades: Path, lab: str | None, form: str, out: Path) -> None:
    """Write grades for Canvas, Moodle or a spreadsheet."""
    found: list[Any] = _standings(grades, lab)
    left = write_export(found, form, out)
    rest = f"; {left} are left empty, because a person must look or mark first" if left else ""
    click.echo(f"{out}: {len(found)} rows{rest}.")


@click.command("class-report")
@grades_option
@lab_option
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), required=True, metavar="FILE")
def class_report(grades: Path, lab: str | None, out: Path) -> None:
    """Write a page that shows the class: scores, hard tasks, mistakes, odd and near-identical submissions."""
    from course_lib.grading.tell.class_report import write_report

    write_report(_standings(grades, lab), out)
    click.echo(f"{out} shows how the class did.")
