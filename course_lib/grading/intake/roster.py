"""Who is in the class, and what a download says of a person.

A roster is a CSV file with a heading; id is what the LMS calls a person in its downloads::

    id,name,group
    12345,"Doe, Jane",Monday
    12346,José Pérez,Tuesday

More columns are allowed and kept out. Names need not be unique, ids must be.
"""

from __future__ import annotations

import csv
import io
import itertools
import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from course_lib.authoring.tree import CourseError
from course_lib.grading.safe_text import shown

from .authorship import Author

__all__ = ["COLUMNS", "Person", "Roster", "kept_of", "read_roster", "rows_of", "student_id", "text_of"]

COLUMNS = ("id", "name", "group")


@dataclass(frozen=True)
class Person:
    """One student."""

    id: str
    name: str
    group: str = ""


@dataclass(frozen=True)
class Roster:
    """The class."""

    people: tuple[Person, ...]

    def match(self, who: Author) -> str:
        """The id of the one person who is meant; "" if nobody or several, and a person decides.

        A name counts only where the download gives no id: an unknown id is somebody who is not in the roster, and a
        known one beside another person's name contradicts itself.
        """
        ids = {shown(name) for name in who.ids}
        by_id = {person.id for person in self.people if person.id in ids}
        wanted = {_letters(name) for name in who.names} - {""}
        by_name = {person.id for person in self.people if _spellings(person.name) & wanted}
        if who.layout in ("moodle", "canvas"):
            found = by_id if not by_name or by_id <= by_name else set()
        else:
            found = by_id or by_name
        return found.pop() if len(found) == 1 else ""

    def person(self, student: str) -> Person | None:
        """The person of an id."""
        return next((person for person in self.people if person.id == student), None)


def _letters(name: str) -> str:
    """A name without case, accents and punctuation: "Doe, José" is "doejose"."""
    plain = unicodedata.normalize("NFKD", name).casefold()
    return "".join(letter for letter in plain if letter.isalnum())


@lru_cache(maxsize=4096)
def _spellings(name: str) -> set[str]:
    """A person's name in every order of its words, as downloads write it."""
    words = [letters for word in re.split(r"[\s,;_]+", name) if (letters := _letters(word))]
    orders = itertools.permutations(words) if len(words) <= 4 else [words, words[-1:] + words[:-1]]
    return {"".join(order) for order in orders}


def text_of(source: Path | str) -> tuple[str, str]:
    """The text and the name of a file that an instructor wrote; a text of one, which a ledger kept, stays as it is.

    Raises
    ------
    CourseError
        If it cannot be read or is not UTF-8.
    """
    if isinstance(source, str):
        return source, "the ledger"
    try:
        return source.read_text(encoding="utf-8-sig"), source.name
    except UnicodeDecodeError:
        raise CourseError(f"{source.name} is not UTF-8: save it as UTF-8 (of a spreadsheet, as CSV UTF-8).") from None
    except OSError as error:
        raise CourseError(f"{source.name} cannot be read: {error.strerror}.") from error


def rows_of(source: Path | str, needed: tuple[str, ...]) -> list[tuple[int, dict[str, str]]]:
    """The rows of a CSV file with a heading, each with its line.

    Raises
    ------
    CourseError
        If it cannot be read, is not UTF-8, or lacks a column.
    """
    text, name = text_of(source)
    first = text.split("\n", 1)[0]
    reader = csv.DictReader(io.StringIO(text), delimiter=";" if first.count(";") > first.count(",") else ",")
    names = [(column or "").strip().lower() for column in reader.fieldnames or ()]
    lacking = [column for column in needed if column not in names]
    if lacking:
        raise CourseError(f"{name}, line 1: there is no column {lacking[0]!r}; it needs {', '.join(needed)}.")
    reader.fieldnames = names
    rows = []
    for row in reader:
        values = {
            key: (value or "").strip()
            for key, value in row.items()
            if isinstance(key, str) and not isinstance(value, list)
        }
        if any(values.values()):
            rows.append((reader.line_num, values))
    return rows


def student_id(text: str) -> str:
    """An id as it can be typed, without the word that Moodle writes before it."""
    return shown(re.sub(r"^participant\s+", "", text, flags=re.I))


def kept_of(source: Path | str, columns: tuple[str, ...], without: str = "") -> str:
    """What a ledger keeps of such a file: these columns, and nothing of one student; the first column is the id."""
    out = io.StringIO()
    rows = [[row.get(column, "") for column in columns] for _, row in rows_of(source, columns[:1])]
    csv.writer(out).writerows([columns, *(row for row in rows if not without or student_id(row[0]) != without)])
    return out.getvalue()


def read_roster(source: Path | str) -> Roster:
    """Read a roster; see this module for its form. One from which everybody was erased is empty.

    Raises
    ------
    CourseError
        Naming file and line, if an id is missing or stands twice.
    """
    people: dict[str, Person] = {}
    name = text_of(source)[1]
    for line, row in rows_of(source, COLUMNS[:2]):
        student = student_id(row["id"])
        if not student:
            raise CourseError(f"{name}, line {line}: the id is missing.")
        if student in people:
            raise CourseError(f"{name}, line {line}: the id {student!r} stands there twice.")
        people[student] = Person(student, row["name"] or student, row.get("group", ""))
    if not people and isinstance(source, Path):
        raise CourseError(f"{name} names nobody.")
    return Roster(tuple(people.values()))
