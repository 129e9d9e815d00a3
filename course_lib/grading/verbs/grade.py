"""`course grade FOLDER`: from a download to a ledger of grades. What is already graded is not graded again."""

from __future__ import annotations

import json
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
from course_lib.grading.disks import disk_told
from course_lib.grading.intake.intake import IntakeLimits, Submission, read_class
from course_lib.grading.intake.roster import COLUMNS, kept_of, read_roster, text_of
from course_lib.grading.ledger import policy
from course_lib.grading.ledger.attempts import standings
from course_lib.grading.ledger.ledger import Entry, Ledger
from course_lib.grading.records import Record
from course_lib.grading.release.private import keep_private, use_kept
from course_lib.grading.release.released import released_lab
from course_lib.grading.run.grade_submission import grader_version, held_by, unreadable_record
from course_lib.grading.run.limits import Limits, read_limits
from course_lib.grading.run.pool import Engine
from course_lib.grading.run.regrade import job_of, outdated
from course_lib.grading.run.sandbox import machine
from course_lib.grading.run.seeds import draw_seed
from course_lib.grading.safe_text import clean, shown

from .engine import EXIT, chosen_engine, engine_options

__all__ = ["EXIT", "Settings", "grade", "grade_folder"]

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
@engine_options
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
    settings = Settings(limits=read_limits(limits) if limits else None, **told)
    engine = chosen_engine(
        *(settings.folder, settings.out),
        workers=workers,
        dask=dask,
        sandbox=settings.sandbox,
        trust=trust,
        limits=settings.limits,
    )
    try:
        code = grade_folder(settings, engine, Console())
    except CourseError as error:
        click.echo(str(error), err=True)
        code = EXIT["usage"]
    except KeyboardInterrupt:
        click.echo("\nInterrupted. What was graded is kept; run the same command to go on.", err=True)
        code = EXIT["interrupted"]
    sys.exit(code)


def grade_folder(settings: Settings, engine: Engine, console: Console) -> int:
    """Grade what is new in a folder, and return the exit code.

    Raises
    ------
    CourseError
        If a file that was named cannot be used, or another grader works on the same ledger.
    """
    roster = read_roster(settings.roster) if settings.roster else None
    with disk_told(settings.out):
        settings.out.mkdir(parents=True, exist_ok=True)
        if settings.private_tasks is not None:
            keep_private(settings.private_tasks, settings.out)
    if settings.private_tasks is None:
        use_kept(settings.out)
    if settings.lab is not None:
        released_lab(settings.lab)
    with Ledger(settings.out / "ledger.sqlite") as ledger:
        _keep_settings(ledger, settings)
        found, left = read_class(
            settings.folder,
            lab=settings.lab,
            roster=roster,
            limits=IntakeLimits(),
            store=settings.out / "originals",
        )
        if settings.student is not None:
            found = [one for one in found if one.student == shown(settings.student)]
        if not found:
            raise CourseError(f"{settings.folder} holds no submission{_of(settings.student)}: is it the right folder?")
        tally = _Tally(console)
        for path in left:
            tally.say(f"  {path} is left out: it is no notebook.")
        for number in sorted({one.lab for one in found}):
            some = [one for one in found if one.lab == number]
            if number in tasks.lab_numbers():
                _grade_lab(ledger, settings, number, some, engine, tally)
            else:
                for entry in ledger.take(some):
                    tally.person(entry.path, entry.trouble or "no lab fits it; say which with --lab NAME.")
        return tally.finish()


def _of(student: str | None) -> str:
    return f" of {student}" if student else ""


def _keep_settings(ledger: Ledger, settings: Settings) -> None:
    """Remember roster, extensions and policy: everything that counts later comes from the ledger."""
    if settings.roster:
        ledger.set_settings("roster", kept_of(settings.roster, COLUMNS))
    if settings.extensions:
        policy.read_extensions(settings.extensions)
        ledger.set_settings("extensions", kept_of(settings.extensions, policy.COLUMNS))
    if settings.late_policy:
        policy.read_policy(settings.late_policy)
        ledger.set_settings("policy", text_of(settings.late_policy)[0])


def _grade_lab(
    ledger: Ledger, settings: Settings, number: str, found: list[Submission], engine: Engine, tally: _Tally
) -> None:
    entries = ledger.take(found)
    pending = [entry for entry in entries if entry.status in ("", "infrastructure")]
    tally.say(f"Lab {number}: {len(entries)} handed in, {len(pending)} to grade.")
    if done := len(entries) - len(pending):
        old = {entry.id for _, entry, _ in outdated(ledger, [number])} & {entry.id for entry in entries}
        why = f", {len(old)} by an earlier version of lab or grader" if old else ""
        tally.say(
            f"  Graded already: {done}{why}. That stays as it is; `course.py regrade {number} --dry-run --grades "
            f"{settings.out}` says what would change."
        )
    if pending:
        _grade_pending(ledger, settings, number, pending, engine, tally)
    tally.count(ledger, number, entries)


def _grade_pending(
    ledger: Ledger, settings: Settings, number: str, pending: list[Entry], engine: Engine, tally: _Tally
) -> None:
    run = ledger.begin(
        lab=number,
        lab_version=released_lab(number).version,
        seed=settings.seed,
        per_student=settings.seed_per_student,
        environment=machine(),
        grader=grader_version(),
        isolation=held_by(settings.sandbox).words,
        limits=json.dumps(settings.limits.as_dict()) if settings.limits else None,
        usual=json.dumps(read_limits().as_dict()),
        draw=draw_seed,
    )
    ready: list[tuple[Entry, dict[str, Any]]] = []
    for entry in pending:
        job = job_of(settings.out / "originals", run, entry, ledger.seed_of(run, entry), settings.sandbox)
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


class _Tally:
    """Says what happens, a line a submission, and counts for the exit code."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self.counts = {"graded": 0, "person": 0, "infrastructure": 0}
        self._bar: Progress | None = None
        self._task: Any = None
        self._started = time.monotonic()

    def say(self, text: str) -> None:
        self.console.print(clean(text, MOST_LINE), markup=False, highlight=False, soft_wrap=True)

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

    def person(self, what: str, why: str) -> None:
        self.counts["person"] += 1
        self.say(f"  {what} needs a person: {why}")

    def count(self, ledger: Ledger, number: str, entries: list[Entry]) -> None:
        """Count whose submissions came at a lab, by what counts of each now."""
        students, here = {entry.student for entry in entries} - {""}, {entry.id for entry in entries}
        failed = [one for one in ledger.entries(number) if one.id in here and one.status == "infrastructure"]
        self.counts["infrastructure"] += len(failed)
        for one in standings(ledger, number):
            if one.entry is None or not (one.student in students or one.entry.id in here):
                continue
            if one.entry.id not in here:
                self.say(f"  {one.student}: an attempt of another download counts, {one.entry.path}.")
            if one.waits:
                self.person(one.entry.path, one.waits)
            elif one.status != "infrastructure":
                self.counts["graded"] += 1

    def finish(self) -> int:
        self.say(
            f"{self.counts['graded']} graded, {self.counts['person']} need a person, "
            f"{self.counts['infrastructure']} could not be graded and are tried again next time."
        )
        if self.counts["infrastructure"]:
            return EXIT["infrastructure"]
        return EXIT["person"] if self.counts["person"] else EXIT["all"]
