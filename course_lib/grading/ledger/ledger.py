"""The one file that knows every grade: what came in, what was graded with which seed, and what people decided.

SQLite with a write-ahead log: a grader that is killed at any moment loses at most the submission that it worked on, and
the next run goes on from there. Only one writes at a time; readers may look meanwhile.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.intake import Submission
from course_lib.grading.ledger.rows import FIELDS, Decision, Entry, Run, now, run_of
from course_lib.grading.records import Record
from course_lib.grading.release.private import use_kept

from .run_seeds import seed_of, seeds
from .schema import SCHEMA, VERSION

__all__ = ["Decision", "Entry", "Ledger", "Run"]


class Ledger:
    """The ledger of a folder of grades; use it in a `with`.

    Parameters
    ----------
    path : of ledger.sqlite; made if it is not there.
    write : False only reads, and may go on beside a grader.

    Raises
    ------
    CourseError
        If it is not there (for reading), is damaged, is of a newer course, or another grader writes to it.
    """

    def __init__(self, path: Path, write: bool = True) -> None:
        self.path = path
        self._write = write
        self._lock = FileLock(str(path) + ".lock")

    def __enter__(self) -> Ledger:
        if not self._write and not self.path.is_file():
            raise CourseError(f"{self.path.parent} holds no grades: make them with `course.py grade FOLDER --out …`.")
        if self._write:
            try:
                self._lock.acquire(timeout=0)
            except Timeout:
                raise CourseError(f"another grader works on {self.path.parent}: wait until it has ended.") from None
            except OSError as error:
                raise CourseError(f"{self.path.parent} cannot be written: {error.strerror}.") from error
        try:
            self._open()
        except sqlite3.Error as error:
            self._lock.release()
            raise CourseError(f"{self.path} is no ledger, or damaged ({error}); it was left as it is.") from error
        except CourseError:
            self._lock.release()
            raise
        use_kept(self.path.parent)
        return self

    def _open(self) -> None:
        fresh = not self.path.exists()
        self.db = sqlite3.connect(self.path, timeout=30, isolation_level=None)
        self.db.row_factory = sqlite3.Row
        self.db.execute("PRAGMA foreign_keys = ON")
        self.db.execute("PRAGMA secure_delete = ON")
        if self._write:
            self.db.execute("PRAGMA journal_mode = WAL")
        tables = {row[0] for row in self.db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if self._write and (fresh or not tables):
            self.db.executescript(f"BEGIN IMMEDIATE; {SCHEMA} COMMIT;")
        elif "about" not in tables:
            raise CourseError(f"{self.path} is no ledger of this course; it was left as it is.")
        version = self.db.execute("SELECT version FROM about").fetchone()[0]
        if version > VERSION:
            raise CourseError(f"{self.path} was made by a newer course: update this copy. It was left as it is.")

    def __exit__(self, *raised: object) -> None:
        self.db.close()
        self._lock.release()

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        try:
            self.db.execute("BEGIN IMMEDIATE")
            yield
            self.db.execute("COMMIT")
        except sqlite3.OperationalError as error:
            if self.db.in_transaction:
                self.db.execute("ROLLBACK")
            raise CourseError(f"the ledger could not be written ({error}); what it held is safe.") from error
        except BaseException:
            if self.db.in_transaction:
                self.db.execute("ROLLBACK")
            raise

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
        draw: Callable[[str, Sequence[int]], int] = lambda lab, among: among[0],
    ) -> Run:
        """The run to grade under: the one that went before under the same versions, or a new one.

        Its seed is stored before anything is graded, so that a run that was killed goes on with the same inputs. It is
        one of several that `seed`, which a person typed, and the ledger's secret decide (None: chance), as `draw` says.
        """
        with self._all_or_nothing():
            among = seeds(self.db, seed)
            rows = self.db.execute(
                "SELECT * FROM runs WHERE lab = ? AND lab_version = ? AND environment = ? AND grader = ? "
                "AND per_student = ? ORDER BY id DESC",
                (lab, lab_version, environment, grader, per_student),
            ).fetchall()
            fitting = [row for row in rows if seed is None or row["seed"] in among]
            if fitting:
                return run_of(fitting[0])
            drawn = draw(lab, among)
            self.db.execute(
                "INSERT INTO runs (lab, lab_version, environment, grader, seed, per_student, isolation, started) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                (lab, lab_version, environment, grader, drawn, per_student, isolation, now()),
            )
            return run_of(self.db.execute("SELECT * FROM runs WHERE id = last_insert_rowid()").fetchone())

    def seed_of(self, run: Run, entry: Entry) -> int:
        """The seed of a submission's inputs (see `run_seeds`)."""
        return seed_of(self.db, run, entry)

    # submissions

    def take(self, run: Run, submissions: Sequence[Submission]) -> list[Entry]:
        """Add what is new, and give the entries of all of them."""
        with self._all_or_nothing():
            for one in submissions:
                values = [getattr(one, name) for name in FIELDS]
                self.db.execute(
                    f"INSERT OR IGNORE INTO entries ({', '.join(FIELDS)}, added) "
                    f"VALUES ({', '.join('?' * len(FIELDS))}, ?)",
                    (*values, now()),
                )
                # who it is may have become known since, from a better roster
                self.db.execute(
                    "UPDATE entries SET student = ?, attempt = ? WHERE lab = ? AND sha256 = ? AND path = ? AND student "
                    "IN ('', ?)",
                    (one.student, one.attempt, one.lab, one.sha256, one.path, one.student),
                )
        keys = {(one.lab, one.sha256, one.path) for one in submissions}
        return [entry for entry in self.entries(run.lab) if (entry.lab, entry.sha256, entry.path) in keys]

    def entries(self, lab: str | None = None) -> list[Entry]:
        """Every submission, with its student as a person may have decided."""
        given = {
            (row["lab"], row["task"]): row["student"]
            for row in self.db.execute("SELECT * FROM decisions WHERE kind = 'assign' ORDER BY id")
        }
        rows = self.db.execute("SELECT * FROM entries WHERE ? IS NULL OR lab = ? ORDER BY id", (lab, lab))
        found = []
        for row in rows:
            values = {name: row[name] for name in FIELDS}
            student = given.get((row["lab"], row["path"]), row["student"])
            found.append(Entry(**{**values, "late": bool(row["late"]), "student": student}, id=row["id"]))
        return found

    # records

    def pending(self, run: Run, entries: Iterable[Entry]) -> list[Entry]:
        """Those that have no grade under this run's versions and seed yet."""
        return [entry for entry in entries if not self._graded(run, entry)]

    def _graded(self, run: Run, entry: Entry) -> bool:
        key = (entry.id, run.lab_version, run.environment, run.grader, self.seed_of(run, entry))
        return (
            self.db.execute(
                "SELECT 1 FROM records WHERE entry = ? AND lab_version = ? AND environment = ? AND grader = ? "
                "AND seed = ? AND status <> 'infrastructure'",
                key,
            ).fetchone()
            is not None
        )

    def record(self, run: Run, entry: Entry, record: Record) -> None:
        """Keep a record, at once and for good.

        Raises
        ------
        CourseError
            If this submission already has a grade under these versions and this seed.
        """
        try:
            with self._all_or_nothing():
                self.db.execute(
                    "INSERT INTO records "
                    "(entry, lab_version, environment, grader, seed, status, points, record, added) "
                    "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                    (
                        entry.id,
                        record["lab_version"],
                        record["environment"],
                        record["grader"],
                        record["seed"],
                        record["status"],
                        record["points"],
                        json.dumps(record),
                        now(),
                    ),
                )
        except sqlite3.IntegrityError as error:
            raise CourseError(f"{entry.path} has been graded already; nothing was changed.") from error

    def records(self, entry: Entry) -> list[Record]:
        """Every record of a submission, the oldest first."""
        rows = self.db.execute("SELECT record FROM records WHERE entry = ? ORDER BY id", (entry.id,))
        return [json.loads(row["record"]) for row in rows]

    def newest(self, entry: Entry) -> Record | None:
        """The record that counts: the newest grade, or else the newest failure to grade."""
        records = self.records(entry)
        graded = [record for record in records if record["status"] != "infrastructure"]
        return (graded or records or [None])[-1]

    # decisions

    def decide(self, student: str, lab: str, task: str, kind: str, points: float | None, who: str, reason: str) -> None:
        """Append what a person decided."""
        self.decide_all([(student, lab, task, kind, points, who, reason)])

    def decide_all(self, rows: Sequence[tuple[str, str, str, str, float | None, str, str]]) -> None:
        """Append several decisions, all or none."""
        with self._all_or_nothing():
            self.db.executemany(
                "INSERT INTO decisions (student, lab, task, kind, points, who, reason, added) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                [(*row, now()) for row in rows],
            )

    def decisions(self, student: str | None = None, lab: str | None = None) -> list[Decision]:
        """What people decided, the oldest first."""
        rows = self.db.execute(
            "SELECT student, lab, task, kind, points, who, reason, added FROM decisions "
            "WHERE (? IS NULL OR student = ?) AND (? IS NULL OR lab = ?) ORDER BY id",
            (student, student, lab, lab),
        )
        return [Decision(*row) for row in rows]

    # settings

    def set_settings(self, name: str, value: dict[str, Any]) -> None:
        """Remember a roster, extensions or a policy as plain data; a later one takes its place."""
        with self._all_or_nothing():
            self.db.execute("INSERT OR REPLACE INTO settings VALUES (?, ?)", (name, json.dumps(value)))

    def settings(self, name: str) -> dict[str, Any] | None:
        """What was remembered under a name."""
        row = self.db.execute("SELECT value FROM settings WHERE name = ?", (name,)).fetchone()
        return json.loads(row["value"]) if row else None

    def forget(self, student: str) -> list[str]:
        """Erase a student; the hashes of originals that nobody else handed in.

        What is left of them in the file is overwritten (secure_delete) and the file is packed.
        """
        mine = [entry for entry in self.entries() if entry.student == student]
        others = {entry.sha256 for entry in self.entries() if entry.student != student}
        with self._all_or_nothing():
            self.db.execute("UPDATE about SET forgetting = 1")
            for entry in mine:
                self.db.execute("DELETE FROM entries WHERE id = ?", (entry.id,))
            self.db.execute("DELETE FROM decisions WHERE student = ?", (student,))
            roster = self.settings("roster")
            if roster is not None:
                roster["people"] = [row for row in roster["people"] if row[0] != student]
                self.db.execute("UPDATE settings SET value = ? WHERE name = 'roster'", (json.dumps(roster),))
            extensions = self.settings("extensions")
            if extensions is not None:
                extensions["rows"] = [row for row in extensions["rows"] if row[0] != student]
                self.db.execute("UPDATE settings SET value = ? WHERE name = 'extensions'", (json.dumps(extensions),))
            self.db.execute("UPDATE about SET forgetting = 0")
        self.db.execute("VACUUM")
        self.db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return sorted({entry.sha256 for entry in mine} - others - {""})
