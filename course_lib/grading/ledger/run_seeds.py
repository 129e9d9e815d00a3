"""The seeds of a ledger: what nobody can guess who does not have it, and another for each later submission."""

from __future__ import annotations

import hashlib
import secrets
import sqlite3

from course_lib.grading.ledger.rows import Entry, Run

__all__ = ["seed_of", "seeds"]

SEEDS = 20
"""So many seeds a run may choose from."""


def seeds(db: sqlite3.Connection, typed: int | None) -> list[int]:
    """Seeds to choose from: random ones, or those that follow from a typed number and the secret of this ledger.

    A small number that somebody types could be guessed: an answer that tries some would know what it is asked.
    """
    if typed is None:
        return [secrets.randbelow(2**53) for _ in range(SEEDS)]
    row = db.execute("SELECT value FROM settings WHERE name = 'secret'").fetchone()
    secret = row["value"] if row else secrets.token_hex(32)
    if not row:
        db.execute("INSERT INTO settings VALUES ('secret', ?)", (secret,))
    digests = [hashlib.sha256(f"{secret} {typed} {i}".encode()).digest() for i in range(SEEDS)]
    return [int.from_bytes(digest[:6], "big") for digest in digests]


def seed_of(db: sqlite3.Connection, run: Run, entry: Entry) -> int:
    """The seed of a submission's inputs: the run's, or one that follows from it.

    It is the student's own where the run asks for that, and always another for a later submission of the same
    student: what was told of an earlier one must not help.
    """
    who = entry.student or entry.named
    earlier = db.execute(
        "SELECT COUNT(*) FROM entries WHERE lab = ? AND id < ? AND ? IN (student, named)",
        (entry.lab, entry.id, who),
    ).fetchone()[0]
    words = [who] * run.per_student + [f"after {earlier}"] * (earlier > 0)
    if not words:
        return run.seed
    text = " ".join([str(run.seed), *words]).encode("utf-8", "surrogatepass")
    return int.from_bytes(hashlib.sha256(text).digest()[:6], "big")
