"""How submissions are run, as `grade` and `regrade` are told: held how, by how many workers, here or on a cluster."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from course_lib.grading.run.grade_submission import held_by
from course_lib.grading.run.limits import Limits, read_limits
from course_lib.grading.run.pool import Engine, good_workers, grade_jobs
from course_lib.grading.run.sandbox import NoSandbox

__all__ = ["EXIT", "chosen_engine", "engine_options"]

EXIT = {"all": 0, "person": 1, "usage": 2, "no sandbox": 3, "infrastructure": 4, "interrupted": 130}
"""Exit codes: all graded; some need a person; usage; no sandbox; infrastructure failures are left; interrupted."""

_OPTIONS = (
    click.option("--workers", type=click.IntRange(1), help="Submissions at once; else as cores and memory allow."),
    click.option("--dask", metavar="ADDRESS", help="Grade on an existing Dask cluster (tls://…)."),
    click.option("--sandbox", type=click.Choice(["bwrap", "none"]), default="bwrap", show_default=True),
    click.option("--i-trust-these-submissions", "trust", is_flag=True, help="Needed with --sandbox none."),
)


def engine_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Let a command take --workers, --dask, --sandbox and --i-trust-these-submissions."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def chosen_engine(
    *own: Path, workers: int | None, dask: str | None, sandbox: str, trust: bool, limits: Limits | None = None
) -> Engine:
    """What grades jobs, by those options; ends with its exit code where nothing can hold them.

    Parameters
    ----------
    own : folders of which a kernel must see nothing.
    """
    if sandbox == "none" and not trust:
        raise click.UsageError(
            "--sandbox none runs submitted code with your rights, on your files: add --i-trust-these-submissions "
            "if you wrote them yourself."
        )
    try:
        held_by(sandbox, *own)
    except NoSandbox as error:
        click.echo(str(error), err=True)
        sys.exit(EXIT["no sandbox"])
    if dask is not None:
        from course_lib.grading.run.cluster import grade_on_cluster

        return lambda jobs, on_record: grade_on_cluster(dask, jobs, on_record)
    count = workers or good_workers((limits or read_limits()).memory_mb)
    return lambda jobs, on_record: grade_jobs(jobs, count, on_record)
