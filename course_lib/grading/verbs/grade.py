"""`course grade FOLDER`: from a download to a ledger of grades. What is already graded is not graded again."""

from __future__ import annotations

import base64
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from course_lib import tasks
from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.intake import IntakeLimits, Submission, original, read_class
from course_lib.grading.intake.roster import read_roster
from course_lib.grading.ledger.ledger import Entry, Ledger, Run
from course_lib.grading.ledger.policy import read_extensions, read_policy
from course_lib.grading.records import Record
from course_lib.grading.release.private import keep_private, use_kept
from course_lib.grading.release.released import released_lab
from course_lib.grading.run.grade_submission import grader_version, held_by, unreadable_record
from course_lib.grading.run.limits import Limits, read_limits
from course_lib.grading.run.pool import Engine, good_workers, grade_jobs
from course_lib.grading.run.sandbox import NoSandbox, machine
from course_lib.grading.run.seeds import draw_seed
from course_lib.grading.safe_text import clean

__all__ = ["EXIT", "Settings", "grade", "grade_folder"]

EXIT = {"all": 0, "person": 1, "usage": 2, "no sandbox": 3, "infrastructure": 4, "interrupted": 130}
"""Exit codes: all graded; some need a person; usage; no sandbox; infrastructure failures are left; interrupted."""

MOST_LINE = 2_000


@dataclass(frozen=True)
class Settings:
    """What `course grade` was told."""

    folder: Path
    out: Path
    lab: str | None = None
    student: str | None = None
    seed: int | None = None
    seed_per_student: bool = False
    sandbox: str = "bwrap"
    roster: Path | None = None
    extensions: Path | None = None
    late_policy: Path | None = None
    limits: Limits | None = None
    private_tasks: Path | None = None


@click.command("grade")
@click.argument("folder", type=click.Path(exists=True, path_type=Path))
@click.option("--lab", metavar="NAME", help="Grade everything as this lab, instead of finding out.")
@click.option("--student", metavar="ID", help="Grade only this student's submissions.")
@click.option("--seed", type=click.IntRange(0, 2**62), help="Decides the inputs, with a secret of the ledger.")
@click.option("--seed-per-student", is_flag=True, help="Each student gets inputs of their own, derived from the seed.")
@click.option("--workers", type=click.IntRange(1), help="Submissions at once; without it, as cores and memory allow.")
@click.option("--dask", "dask", metavar="ADDRESS", help="Grade on an existing Dask cluster (tls://…).")
@click.option("--sandbox", type=click.Choice(["bwrap", "none"]), default="bwrap", show_default=True)
@click.option("--i-trust-these-submissions", "trust", is_flag=True, help="Needed with --sandbox none.")
@click.option("--roster", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="CSV: id,name,group.")
@click.option(
    "--extensions", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="CSV: student,lab,due."
)
@click.option("--late-policy", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="TOML.")
@click.option(
    "--private-tasks",
    "private_tasks",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Your own tasks, as given to release.",
)
@click.option("--limits", "limits", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="TOML.")
@click.option("--out", "out", required=True, type=click.Path(file_okay=False, path_type=Path), metavar="FOLDER")
def grade(workers: int | None, dask: str | None, trust: bool, limits: Path | None, **told: Any) -> None:
    """Grade a folder of submitted notebooks.

    FOLDER holds a folder a student, a Moodle or Canvas download, or loose files; it may be a zip. Run it again after an
    interruption: what is graded stays graded.

    Exit codes: 0 all graded, 1 some need a person, 2 usage, 3 no sandbox, 4 infrastructure failures left,
    130 interrupted.
    """
    if told["sandbox"] == "none" and not trust:
        raise click.UsageError(
            "--sandbox none runs submitted code with your rights, on your files: add --i-trust-these-submissions "
            "if you wrote them yourself."
        )
    settings = Settings(limits=read_limits(limits), **told)
    try:
        held_by(settings.sandbox, settings.folder, settings.out)
    except NoSandbox as error:
        click.echo(str(error), err=True)
        sys.exit(EXIT["no sandbox"])
    count = workers or good_workers(settings.limits.memory_mb)
    try:
        code = grade_folder(settings, _engine(dask, count), Console())
    except CourseError as error:
        click.echo(str(error), err=True)
        code = EXIT["usage"]
    except KeyboardInterrupt:
        click.echo("\nInterrupted. What was graded is kept; run the same command to go on.", err=True)
        code = EXIT["interrupted"]
    sys.exit(code)


def _engine(dask: str | None, workers: int) -> Engine:
    """What grades the jobs: workers of this machine, or of a cluster."""
    if dask is None:
        return lambda jobs, on_record: grade_jobs(jobs, workers, on_record)
    from course_lib.grading.run.cluster import grade_on_cluster

    return lambda jobs, on_record: grade_on_cluster(dask, jobs, on_record)


def grade_folder(settings: Settings, engine: Engine, console: Console) -> int:
    """Grade what is new in a folder, and return the exit code.

    Raises
    ------
    CourseError
        If a file that was named cannot be used, or another grader works on the same ledger.
    """
    roster = read_roster(settings.roster) if settings.roster else None
    settings.out.mkdir(parents=True, exist_ok=True)
    if settings.private_tasks is not None:
        keep_private(settings.private_tasks, settings.out)
    else:
        use_kept(settings.out)
    if settings.lab is not None:
        released_lab(settings.lab)
    with Ledger(settings.out / "ledger.sqlite") as ledger:
        _keep_settings(ledger, settings, roster)
        found = read_class(
            settings.folder,
            lab=settings.lab,
            roster=roster,
            limits=IntakeLimits(),
            store=settings.out / "originals",
        )
        if settings.student is not None:
            found = [one for one in found if one.student == settings.student]
        if not found:
            raise CourseError(f"{settings.folder} holds no submission{_of(settings.student)}: is it the right folder?")
        tally = _Tally(console)
        for number in sorted({one.lab for one in found}):
            some = [one for one in found if one.lab == number]
            if number in tasks.lab_numbers():
                _grade_lab(ledger, settings, number, some, engine, tally)
            else:
                _wait_for_lab(ledger, some, tally)
        return tally.finish()


def _of(student: str | None) -> str:
    return f" of {student}" if student else ""


def _keep_settings(ledger: Ledger, settings: Settings, roster: Any) -> None:
    """Remember roster, extensions and policy: everything that counts later comes from the ledger."""
    if roster is not None:
        ledger.set_settings("roster", roster.as_dict())
    if settings.extensions:
        ledger.set_settings("extensions", read_extensions(settings.extensions).as_dict())
    if settings.late_policy:
        ledger.set_settings("policy", read_policy(settings.late_policy).as_dict())


def _grade_lab(
    ledger: Ledger, settings: Settings, number: str, found: list[Submission], engine: Engine, tally: _Tally
) -> None:
    lab = released_lab(number)
    run = ledger.begin(
        lab=number,
        lab_version=lab.version,
        seed=settings.seed,
        per_student=settings.seed_per_student,
        environment=machine(),
        grader=grader_version(),
        isolation=held_by(settings.sandbox).words,
        draw=draw_seed,
    )
    entries = ledger.take(run, found)
    pending = ledger.pending(run, entries)
    tally.say(f"Lab {number}: {len(entries)} handed in, {len(pending)} to grade, seed {run.seed}.")
    ready: list[tuple[Entry, dict[str, Any]]] = []
    for entry in pending:
        job = _job(ledger, run, entry, settings)
        if entry.trouble:
            ledger.record(run, entry, unreadable_record(job, entry.code, entry.trouble))
        else:
            ready.append((entry, job))

    def keep(place: int, record: Record) -> None:
        entry = ready[place][0]
        ledger.record(run, entry, record)
        tally.graded(entry, record)

    if ready:
        with tally.progress(len(ready)):
            engine([job for _, job in ready], keep)
    for entry in entries:
        tally.count(entry, ledger.newest(entry))


def _job(ledger: Ledger, run: Run, entry: Entry, settings: Settings) -> dict[str, Any]:
    data = original(settings.out / "originals", entry.sha256) if entry.sha256 and not entry.trouble else b""
    return {
        "submission": entry.sha256,
        "notebook": base64.b64encode(data).decode(),
        "lab": run.lab,
        "seed": ledger.seed_of(run, entry),
        "sandbox": settings.sandbox,
        "limits": (settings.limits or read_limits()).as_dict(),
    }


def _wait_for_lab(ledger: Ledger, found: list[Submission], tally: _Tally) -> None:
    """Submissions of no known lab: kept, and shown to a person."""
    run = ledger.begin(
        lab="", lab_version="", seed=0, per_student=False, environment="", grader=grader_version(), isolation=""
    )
    for entry in ledger.take(run, found):
        tally.count(entry, None)
        tally.say(f"  {entry.path}: {entry.trouble or 'no lab fits it; say which with --lab NAME.'}")


class _Tally:
    """Says what happens, a line a submission, and counts for the exit code."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.counts = {"graded": 0, "person": 0, "infrastructure": 0}
        self._bar: Progress | None = None
        self._task: Any = None
        self._started = time.monotonic()

    def say(self, text: str) -> None:
        self.console.print(clean(text, MOST_LINE), markup=False, highlight=False)

    def progress(self, total: int) -> Progress:
        self._bar = Progress(
            TextColumn("grading"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=self.console,
            transient=True,
        )
        self._task = self._bar.add_task("grading", total=total)
        return self._bar

    def graded(self, entry: Entry, record: Record) -> None:
        who = entry.student or f"{entry.named} (not in the roster)"
        points = f"{record['points']:g} of {record['max']:g}"
        if record["status"] != "graded":
            points = f"{record['status']}: {record['reason']}"
        odd = [notice["code"] for notice in record["notices"]]
        self.say(f"  {who}  lab {record['lab']}  {points}" + (f"  ({', '.join(dict.fromkeys(odd))})" if odd else ""))
        if self._bar is not None:
            self._bar.advance(self._task)

    def count(self, entry: Entry, record: Record | None) -> None:
        if record is not None and record["status"] == "infrastructure":
            self.counts["infrastructure"] += 1
        elif record is None or record["status"] == "unreadable" or not entry.student:
            self.counts["person"] += 1
            if record is not None:
                why = record["reason"] or "matches nobody in the roster"
                self.say(f"  {entry.path} needs a person: {why}")
        else:
            self.counts["graded"] += 1

    def finish(self) -> int:
        self.say(
            f"{self.counts['graded']} graded, {self.counts['person']} need a person, "
            f"{self.counts['infrastructure']} could not be graded and are tried again next time."
        )
        if self.counts["infrastructure"]:
            return EXIT["infrastructure"]
        return EXIT["person"] if self.counts["person"] else EXIT["all"]
