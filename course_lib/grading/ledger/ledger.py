"""The one file that knows every grade: what came in, what was graded with which seed, and what people decided.

SQLite with a write-ahead log: a grader that is killed at any moment loses at most the submission that it worked on, and
the next run goes on from there. Only one writes at a time; readers may look meanwhile.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Sequence
from dataclasses import asdict, astuple, fields

from course_lib.authoring.tree import CourseError
from course_lib.grading.intake import roster
from course_lib.grading.intake.intake import Submission
from course_lib.grading.records import Record

from . import policy
from .database import Database
from .rows import TOLD, Decision, Entry, Run, now, row_of
from .run_seeds import seed_of, seeds
from .schema import NEWEST

__all__ = ["Decision", "Entry", "Ledger", "Run"]


class Ledger(Database):
    """The ledger of a folder of grades; use it in a `with`.

    Parameters
    ----------
    path : of ledger.sqlite.
    write : False only reads, and may go on beside a grader.
    make : whether who writes makes it, if it is not there.

    Raises
    ------
    CourseError
        If it is not there and not made, is damaged, is of another course, or another grader writes to it.
    """

    # runs

    def begin(
        self,
        *,
        lab: str,
        lab_version: str,
        seed: int | None,
        per_student: bool,
        environment: str,
        grader: str,
        isolation: str,
        limits: str | None = None,
        usual: str = "{}",
        draw: Callable[[str, Sequence[int]], int] = lambda lab, among: among[0],
    ) -> Run:
        """The run to grade under: the one that went before, or a new one with its seed.

        The seed is stored before anything is graded, so that a run that was killed goes on with the same inputs; and
        everybody gets the same, also where the grader changed meanwhile. A new version of the lab draws anew.

        Parameters
        ----------
        seed : a number that a person typed; with the secret of this ledger it decides the run's. None is random.
        limits : as JSON; None for those of the run that went before, or the usual ones.
        draw : chooses one of several seeds for a lab.
        """
        with self.all_or_nothing():
            among = seeds(self.db, seed)
            rows = self.db.execute(
                "SELECT * FROM runs WHERE lab = ? AND lab_version = ? AND per_student = ? ORDER BY id DESC",
                (lab, lab_version, per_student),
            )
            before = [row_of(Run, row) for row in rows if seed is None or row["seed"] in among]
            last = before[0] if before else None
            return self._run(
                Run(
                    id=0,
                    lab=lab,
                    lab_version=lab_version,
                    environment=environment,
                    grader=grader,
                    seed=last.seed if last else draw(lab, among),
                    per_student=per_student,
                    limits=limits or (last.limits if last else usual),
                    isolation=isolation,
                )
            )

    def begin_again(self, run: Run) -> Run:
        """The run like this one, with its seed and limits, that is in the ledger; added if there is none."""
        with self.all_or_nothing():
            return self._run(run)

    def _run(self, run: Run) -> Run:
        values = {name: value for name, value in asdict(run).items() if name != "id"}
        key = {name: value for name, value in values.items() if name != "isolation"}
        same = " AND ".join(f"{name} = :{name}" for name in key)
        found = self.db.execute(f"SELECT * FROM runs WHERE {same} ORDER BY id DESC", key).fetchone()
        if found is None:
            names = f"{', '.join(values)}, started) VALUES (:{', :'.join(values)}"
            self.db.execute(f"INSERT INTO runs ({names}, :started)", values | {"started": now()})
            found = self.db.execute("SELECT * FROM runs WHERE id = last_insert_rowid()").fetchone()
        return row_of(Run, found)

    def run(self, number: int) -> Run:
        """A run by its id."""
        return row_of(Run, self.db.execute("SELECT * FROM runs WHERE id = ?", (number,)).fetchone())

    def seed_of(self, run: Run, entry: Entry) -> int:
        """The seed of a submission's inputs (see `run_seeds`)."""
        return seed_of(self.db, run, entry)

    # submissions

    def take(self, submissions: Sequence[Submission]) -> list[Entry]:
        """Add what is new of one download, and give the entries of all of them."""
        with self.all_or_nothing():
            added = now()
            download = self.db.execute("SELECT coalesce(max(download), 0) + 1 FROM entries").fetchone()[0]
            for one in submissions:
                # of what is here already, who it is may have become known since, from a better roster
                self.db.execute(
                    f"INSERT INTO entries ({', '.join(TOLD)}, download, added) VALUES ({'?, ' * len(TOLD)}?, ?) "
                    "ON CONFLICT (lab, sha256, path) DO UPDATE SET student = excluded.student WHERE student = ''",
                    (*astuple(one), download, added),
                )
        keys = {(one.lab, one.sha256, one.path) for one in submissions}
        return [entry for entry in self.entries() if (entry.lab, entry.sha256, entry.path) in keys]

    def entries(self, lab: str | None = None) -> list[Entry]:
        """Every submission as it stands now, in the order of arrival."""
        rows = self.db.execute("SELECT * FROM attempts WHERE ? IS NULL OR lab = ? ORDER BY id", (lab, lab))
        return [row_of(Entry, row) for row in rows]

    # records

    def record(self, run: Run, entry: Entry, record: Record) -> None:
        """Keep a record, at once and for good.

        Raises
        ------
        CourseError
            If this submission has been graded in this run.
        """
        try:
            with self.all_or_nothing():
                self.db.execute(
                    "INSERT INTO records (entry, run, status, record, added) VALUES (?, ?, ?, ?, ?)",
                    (entry.id, run.id, record["status"], json.dumps(record), now()),
                )
        except sqlite3.IntegrityError as error:
            raise CourseError(f"{entry.path} has been graded already; nothing was changed.") from error

    def records(self, entry: Entry) -> list[Record]:
        """Every record of a submission, the oldest first."""
        rows = self.db.execute("SELECT record FROM records WHERE entry = ? ORDER BY id", (entry.id,))
        return [json.loads(row["record"]) for row in rows]

    def newest(self, entry: Entry) -> Record | None:
        """The record that counts: the newest grade, or else the newest failure to grade."""
        row = self.db.execute(f"SELECT record FROM records WHERE id = {NEWEST.format('?')}", (entry.id,)).fetchone()
        return json.loads(row["record"]) if row else None

    # decisions

    def decide(self, *decisions: Decision) -> None:
        """Append what a person decided, all or none."""
        names = [field.name for field in fields(Decision)]
        with self.all_or_nothing():
            self.db.executemany(
                f"INSERT INTO decisions ({', '.join(names)}) VALUES (:{', :'.join(names)})",
                [asdict(one) | {"added": now()} for one in decisions],
            )

    def decisions(self, student: str | None = None, lab: str | None = None) -> list[Decision]:
        """What people decided, the oldest first."""
        rows = self.db.execute(
            "SELECT * FROM decisions WHERE (? IS NULL OR student = ?) AND (? IS NULL OR lab = ?) ORDER BY id",
            (student, student, lab, lab),
        )
        return [row_of(Decision, row) for row in rows]

    # settings

    def set_settings(self, name: str, text: str) -> None:
        """Remember the text of a roster, of extensions or of a policy; a later one takes its place."""
        with self.all_or_nothing():
            self.db.execute("INSERT OR REPLACE INTO settings VALUES (?, ?)", (name, text))

    def settings(self, name: str) -> str:
        """The text that was remembered under a name; "" if none was."""
        row = self.db.execute("SELECT value FROM settings WHERE name = ?", (name,)).fetchone()
        return row["value"] if row else ""

    def forget(self, student: str) -> list[str]:
        """Erase a student; the hashes of originals that nobody else handed in.

        What is left of them in the file is overwritten (secure_delete) and the file is packed.
        """
        mine = [entry for entry in self.entries() if entry.student == student]
        others = {entry.sha256 for entry in self.entries() if entry.student != student}
        with self.all_or_nothing():
            self.db.execute("UPDATE about SET forgetting = 1")
            for entry in mine:
                self.db.execute("DELETE FROM entries WHERE id = ?", (entry.id,))
            self.db.execute("DELETE FROM decisions WHERE student = ?", (student,))
            for name, columns in (("roster", roster.COLUMNS), ("extensions", policy.COLUMNS)):
                if text := self.settings(name):
                    left = roster.kept_of(text, columns, without=student)
                    self.db.execute("UPDATE settings SET value = ? WHERE name = ?", (left, name))
            self.db.execute("UPDATE about SET forgetting = 0")
        self.db.execute("VACUUM")
        self.db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return sorted({entry.sha256 for entry in mine} - others - {""})
