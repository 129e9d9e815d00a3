"""The verbs of those who make the course: build and test. A release for students leaves them out."""

from __future__ import annotations

import sys

import click

from .tree import course_tree


@click.command("build")
@click.argument("names", nargs=-1, metavar="[NAME…]")
@click.option("--check", "only_check", is_flag=True, help="Prove that notebooks and sources agree; execute nothing.")
@click.option("--lessons", "kind", flag_value="lesson", help="Only lessons.")
@click.option("--labs", "kind", flag_value="lab", help="Only labs.")
def build(names: tuple[str, ...], only_check: bool, kind: str | None) -> None:
    """Turn sources into executed notebooks; a lab gives its solution and its exercise.

    NAME is a number (03), a name (03_depth_to_points) or a path; without one, everything is built.
    """
    from .build import build_all, check_all

    sys.exit((check_all if only_check else build_all)(names, kind, course_tree(), click.echo))


@click.command("test", context_settings={"ignore_unknown_options": True})
@click.option("--quick", "depth", flag_value="quick", help="The library, the tools, the first lesson and labs.")
@click.option("--thorough", "depth", flag_value="thorough", help="With all drawings, kills and repeated trials.")
@click.option("--workers", type=click.IntRange(1), default=2, show_default=True, help="Processes that run at once.")
@click.argument("more", nargs=-1, type=click.UNPROCESSED, metavar="[-- PYTEST WORDS…]")
def test(depth: str | None, workers: int, more: tuple[str, ...]) -> None:
    """Prove the library, the tools, and every stored number of every lesson and solution.

    Real-data cells are compared where their data are: set COURSE_DATA_MIRROR to a folder that holds them.
    """
    from .prove import prove

    sys.exit(prove(course_tree(), depth or "all", workers, more, click.echo))
