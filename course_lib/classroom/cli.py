"""The command line: `python3 course.py VERB`. A verb imports what it needs when it runs."""

from __future__ import annotations

import importlib
import importlib.util
import sys

import click

from course_lib.notebook._errors import Refusal

from .tree import CourseError, nearest

__all__ = ["main"]


_GRADING = "course_lib.classroom.grading"

# verb: (its click command, or the module and the name that hold it; one line for --help)
VERBS: dict[str, tuple[click.Command | tuple[str, str], str]] = {
    "start": (("course_lib.classroom.start", "command"), "Open JupyterLab on the course, labs as your own copies."),
    "test": (("course_lib.classroom.develop", "test"), "Prove the library, the tools and every notebook."),
    "build": (("course_lib.classroom.develop", "build"), "Turn sources into executed notebooks."),
    "bench": (("course_lib.classroom.develop", "bench"), "Measure speed against the professional tools."),
    "data": (("course_lib.classroom.data_verbs", "data_group"), "List and fetch datasets."),
    "reset": (("course_lib.classroom.reset", "command"), "Make a fresh copy of a lab, overwriting nothing."),
    "release": ((f"{_GRADING}.verbs_release", "release"), "Make what students get of a lab: a folder and a zip."),
    "grade": ((f"{_GRADING}.verbs_grade", "grade"), "Grade a folder of submitted notebooks."),
    "regrade": ((f"{_GRADING}.verbs_people", "regrade"), "After a judge was mended: whose grade changes, and why."),
    "adjust": ((f"{_GRADING}.verbs_people", "adjust"), "Change a task's points by hand, with a reason."),
    "marks": ((f"{_GRADING}.verbs_people", "marks"), "Hand-marked tasks: a rubric as CSV, out and in."),
    "feedback": ((f"{_GRADING}.verbs_tell", "feedback"), "Write an HTML page for each student."),
    "export": ((f"{_GRADING}.verbs_tell", "export"), "Write grades for Canvas, Moodle or a spreadsheet."),
    "class-report": ((f"{_GRADING}.verbs_tell", "class_report"), "Write a page that shows how the class did."),
    "explain": ((f"{_GRADING}.verbs_people", "explain"), "Say how a grade came to be, step by step."),
    "viva": ((f"{_GRADING}.verbs_release", "viva"), "Questions to a student about their own code."),
    "forget": ((f"{_GRADING}.verbs_people", "forget"), "Erase a student from the ledger."),
    "doctor": (("course_lib.classroom.doctor", "command"), "Say what works here, and how to mend the rest."),
}


def _is_here(module: str) -> bool:
    """Whether a module is part of this copy; a release for students lacks some, with their packages."""
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


class _Verbs(click.Group):
    """A click group that imports another module's verb only when that verb is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS:
            return None
        where, _ = VERBS[cmd_name]
        if isinstance(where, click.Command):
            return where
        if not _is_here(where[0]):
            raise CourseError(f"the verb {cmd_name!r} is not part of this copy of the course.")
        return getattr(importlib.import_module(where[0]), where[1])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in VERBS:
            raise click.UsageError(f"there is no verb {args[0]!r}.{nearest(args[0], VERBS)}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Verbs"):
            formatter.write_dl([(verb, line) for verb, (_, line) in VERBS.items()])


@click.command(cls=_Verbs, subcommand_metavar="VERB …", context_settings={"help_option_names": ["-h", "--help"]})
def course() -> None:
    """A course on 3D reconstruction. `python3 course.py VERB --help` explains a verb."""


def main(args: list[str] | None = None) -> None:
    """Run one verb; what a person can mend is said in one sentence."""
    try:
        course.main(args, prog_name="python3 course.py")
    except (CourseError, Refusal) as error:
        click.echo(f"{error}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
