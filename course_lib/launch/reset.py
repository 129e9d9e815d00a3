"""`reset`: a fresh copy of a lab beside the learner's, overwriting nothing."""

from __future__ import annotations

import click

from course_lib.authoring.tree import course_tree

from . import my_work


@click.command("reset")
@click.argument("lab")
@click.option("--lesson", is_flag=True, help="The lesson of this number or name, not the lab.")
def command(lab: str, lesson: bool) -> None:
    """Make a fresh copy of LAB (a number or a name) in my_work/, beside yours, overwriting nothing."""
    tree = course_tree()
    one = my_work.find(tree, "lesson" if lesson else "lab", lab)
    path = my_work.fresh_copy(tree, one)
    my_work.sign(tree)
    click.echo(f"A fresh {one.said}: {tree.relative(path)}")
