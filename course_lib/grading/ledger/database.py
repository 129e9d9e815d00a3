"""The ledger's file: opened by one who writes, or by who only reads; a change is made whole or not at all."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from filelock import FileLock, Timeout

from course_lib.authoring.tree import CourseError
from course_lib.grading.disks import DiskTrouble
from course_lib.grading.release.private import use_kept

from .schema import SCHEMA, VERSION

__all__ = ["Database"]


class Database:
    """The file of a ledger; `db` is open within a `with`."""

    db: sqlite3.Connection

    def __init__(self, path: Path, write: bool = True, make: bool = True) -> None:
        self.path = path
        self._write, self._make = write, write and make
        self._lock = FileLock(str(path) + ".lock")

    def __enter__(self) -> Self:
        if not self._make and not self.path.is_file():
            raise CourseError(f"{self.path.parent} holds no grades: make them with `course.py grade FOLDER --out …`.")
        if self._write:
            try:
                self._lock.acquire(timeout=0)
            except Timeout:
                raise CourseError(f"another grader works on {self.path.parent}: wait until it has ended.") from None
            except OSError as error:
                raise DiskTrouble(self.path.parent, error.strerror or str(error)) from error
        try:
            self._open()
        except sqlite3.OperationalError as error:
            self._lock.release()
            raise DiskTrouble(self.path, str(error)) from error
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
        self.db = self._connected()
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
        if version != VERSION:
            do = "update this copy" if version > VERSION else "go on with that one, or grade into a new folder"
            age = "a newer" if version > VERSION else "an older"
            raise CourseError(f"{self.path} was made by {age} version of the course: {do}. It was left as it is.")

    def _connected(self) -> sqlite3.Connection:
        """The database; on a disk that cannot be written and where no grader left a log, read as it lies there."""
        db = sqlite3.connect(self.path, timeout=30, isolation_level=None)
        if not self._write and not Path(f"{self.path}-wal").exists():
            try:
                db.execute("SELECT 1 FROM sqlite_master")
            except sqlite3.OperationalError:
                db.close()
                db = sqlite3.connect(f"{self.path.absolute().as_uri()}?immutable=1", uri=True, isolation_level=None)
        return db

    def __exit__(self, *raised: object) -> None:
        self.db.close()
        self._lock.release()

    @contextmanager
    def all_or_nothing(self) -> Iterator[None]:
        """Within this, all changes are made or none."""
        try:
            self.db.execute("BEGIN IMMEDIATE")
            yield
            self.db.execute("COMMIT")
        except sqlite3.OperationalError as error:
            if self.db.in_transaction:
                self.db.execute("ROLLBACK")
            raise DiskTrouble(self.path, str(error)) from error
        except BaseException:
            if self.db.in_transaction:
                self.db.execute("ROLLBACK")
            raise
