"""The command line: `python3 course.py VERB`. A verb imports what it needs when it runs."""

from __future__ import annotations

import importlib
import importlib.util
import sys

import click

from course_lib.authoring.tree import CourseError
from course_lib.launch.bootstrap.verbs import VERBS
from course_lib.notebook._errors import Refusal, nearest

__all__ = ["main"]


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
        module, _, name = f"course_lib.{VERBS[cmd_name].place}".partition(":")
        if not _is_here(module):
            raise CourseError(f"the verb {cmd_name!r} is not part of this copy of the course.")
        return getattr(importlib.import_module(module), name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in VERBS:
            raise click.UsageError(f"there is no verb {args[0]!r}.{nearest(args[0], VERBS)}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Verbs"):
            formatter.write_dl([(name, verb.line) for name, verb in VERBS.items()])


@click.command(cls=_Verbs, subcommand_metavar="VERB …", context_settings={"help_option_names": ["-h", "--help"]})
def course() -> None:
    """A course on 3D reconstruction. `python3 course.py VERB --help` explains a verb."""


def main(args: list[str] | None = None) -> None:
    """Run one verb; what a person can mend is said in one sentence."""
    try:
        course.main(args, prog_name="python3 course.py")
    except Refusal as error:
        click.echo(f"{error}", err=True)
        sys.exit(error.exit_code)


if __name__ == "__main__":
    main()
