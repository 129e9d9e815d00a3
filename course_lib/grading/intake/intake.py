"""From a download to submissions: who handed in what, for which lab. Runs nothing, follows no link, keeps bytes.

Understood are a folder a student, a Moodle download ("Jane Doe_12345_assignsubmission_file_/lab.ipynb"), a Canvas
download ("doejane_LATE_12345_678_lab-1.ipynb"), and loose files whose names begin with an id or a name; the folder may
be a zip, and so may what a student handed in. What matches nobody in the roster waits for a person.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import stat
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

from course_lib import tasks
from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.authorship import author
from course_lib.grading.release.released import lab_of_cells

from .archives import members
from .roster import Roster
from .untrusted_notebook import IntakeLimits, Unreadable, notebook_of

__all__ = ["IntakeLimits", "Submission", "Unreadable", "notebook_of", "original", "read_class"]

IGNORED = (".ipynb_checkpoints", "__MACOSX", ".DS_Store", "Thumbs.db", "desktop.ini", ".git")


@dataclass(frozen=True)
class Submission:
    """One file that was handed in.

    Parameters
    ----------
    student : id in the roster; "" waits for a person.
    named : what the download calls them; never trusted, never a path.
    lab : "03", or "" if unknown.
    sha256 : of the notebook's bytes; "" if there are none.
    path : where it lay, for people.
    received : ISO 8601 with offset, or "".
    late : marked so by the download.
    attempt : 1, 2, … of this student at this lab.
    layout : "folders", "moodle", "canvas" or "loose".
    trouble, code : why nothing can be run, as a sentence and as a fixed word; "" if it can.
    """

    student: str
    named: str
    lab: str
    sha256: str
    path: str
    received: str
    late: bool
    attempt: int
    layout: str
    trouble: str = ""
    code: str = ""


@dataclass(frozen=True)
class _File:
    """One file of the download: its parts below the top, its bytes, or why there are none."""

    parts: tuple[str, ...]
    data: bytes
    received: str
    code: str = ""
    trouble: str = ""


def read_class(
    folder: Path, *, lab: str | None, roster: Roster | None, limits: IntakeLimits, store: Path
) -> list[Submission]:
    """Every submission of a download, with its original kept in the store.

    Parameters
    ----------
    lab : the lab of all of them; None finds it out from names and cells.
    store : a folder; originals lie there under their hash, unchanged.

    Raises
    ------
    CourseError
        If the folder cannot be read at all, or holds more files than the limits.
    """
    found = []
    for file in _files(folder, limits):
        if file.trouble or file.parts[-1].lower().endswith(".ipynb"):
            found.append(_submission(file, lab, roster, limits, store))
        elif file.parts[-1].lower().endswith(".zip"):
            found += _unpacked(file, lab, roster, limits, store)
        else:
            sentence = f"{_shown(file.parts[-1])} is no notebook: hand in the .ipynb file."
            other = replace(file, data=b"", code="not a notebook", trouble=sentence)
            found.append(_submission(other, lab, roster, limits, store))
    useful = {(one.student or one.named) for one in found if one.code != "not a notebook"}
    once: dict[str, Submission] = {}
    for one in found:
        if one.code == "not a notebook" and (one.student or one.named) not in useful:
            once.setdefault(one.student or one.named, one)
    return _numbered([one for one in found if one.code != "not a notebook"] + list(once.values()))


def original(store: Path, sha256: str) -> bytes:
    """The bytes of a submission as handed in."""
    return (store / sha256[:2] / sha256).read_bytes()


def _files(folder: Path, limits: IntakeLimits) -> Iterator[_File]:
    """Every file of a folder, or of a zip in its place, in a fixed order."""
    if folder.is_file():
        data, code, trouble = _read(os.fsencode(folder), limits.archive_bytes)
        if trouble:
            raise CourseError(f"{folder.name}: {trouble}")
        try:
            for member in members(data, limits):
                parts = PurePosixPath(member.name.replace("\\", "/")).parts
                parts = tuple(part for part in parts if part not in ("/", "..")) or ("nameless",)
                if not _ignored(parts):
                    yield _File(parts, member.data, member.received, member.code, member.trouble)
        except Unreadable as error:
            raise CourseError(f"{folder.name}: {error.sentence}") from None
        return
    count = 0
    top = os.fsencode(folder)
    for where, folders, files in os.walk(top, followlinks=False):
        folders.sort()
        links = [name for name in folders if os.path.islink(os.path.join(where, name))]
        for name in sorted([*files, *links]):
            full = os.path.join(where, name)
            parts = tuple(os.fsdecode(part) for part in os.path.relpath(full, top).split(os.fsencode(os.sep)))
            if _ignored(parts):
                continue
            count += 1
            if count > limits.files:
                raise CourseError(f"{folder} holds more than {limits.files} files: is it the right folder?")
            data, code, trouble = _read(full, _most(parts[-1], limits))
            yield _File(parts, data, _mtime(full), code, trouble)


def _most(name: str, limits: IntakeLimits) -> int:
    return limits.archive_bytes if name.lower().endswith(".zip") else limits.notebook_bytes


def _ignored(parts: tuple[str, ...]) -> bool:
    return any(part in IGNORED or part.startswith("._") for part in parts)


def _mtime(path: bytes) -> str:
    try:
        return datetime.fromtimestamp(os.lstat(path).st_mtime, UTC).isoformat(timespec="seconds")
    except (OSError, OverflowError, ValueError):
        return ""


def _read(path: bytes, most: int) -> tuple[bytes, str, str]:
    """The bytes of a regular file, or a code and a sentence; never follows a link, never waits at a pipe."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        if error.errno == errno.ELOOP:
            return b"", "symlink", "it is a symbolic link, which is not followed."
        return b"", "unreadable file", f"it cannot be read: {error.strerror}."
    try:
        mode = os.fstat(handle).st_mode
        if not stat.S_ISREG(mode):
            kind = "a folder link" if stat.S_ISDIR(mode) else "a pipe or a device"
            return b"", "not a file", f"it is {kind}, not a file."
        with os.fdopen(os.dup(handle), "rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        return b"", "unreadable file", f"it cannot be read: {error.strerror}."
    finally:
        os.close(handle)
    if len(data) > most:
        return b"", "too big", f"it has more than {most // 1_000_000} MB: clear the outputs and hand it in again."
    return data, "", ""


def _unpacked(
    file: _File, lab: str | None, roster: Roster | None, limits: IntakeLimits, store: Path
) -> list[Submission]:
    """The notebooks in a zip that a student handed in."""
    found = []
    try:
        for member in members(file.data, limits):
            name = PurePosixPath(member.name.replace("\\", "/")).name or "nameless"
            if _ignored(tuple(member.name.split("/"))):
                continue
            if member.trouble or name.lower().endswith(".ipynb"):
                parts = (*file.parts[:-1], f"{file.parts[-1]}: {name}")
                one = _File(parts, member.data, file.received, member.code, member.trouble)
                found.append(_submission(one, lab, roster, limits, store, who=file.parts))
    except Unreadable as error:
        found.append(
            _submission(replace(file, data=b"", code=error.code, trouble=error.sentence), lab, roster, limits, store)
        )
    if not found:
        nothing = replace(file, data=b"", code="not a notebook", trouble="the zip holds no notebook.")
        found.append(_submission(nothing, lab, roster, limits, store))
    return found


def _submission(
    file: _File,
    lab: str | None,
    roster: Roster | None,
    limits: IntakeLimits,
    store: Path,
    who: tuple[str, ...] | None = None,
) -> Submission:
    layout, ids, names, late, attempt = author(who or file.parts)
    student = roster.match(ids, names) if roster else _cleaned(ids[0] if ids else names[0])
    digest = ""
    if file.data:
        digest = hashlib.sha256(file.data).hexdigest()
        _keep(store, digest, file.data)
    return Submission(
        student=student,
        named=_shown(names[0] if names else ids[0]),
        lab=lab or _lab(file, limits),
        sha256=digest,
        path=_shown("/".join(file.parts)),
        received=file.received,
        late=late,
        attempt=attempt,
        layout=layout,
        trouble=file.trouble,
        code=file.code,
    )


def _lab(file: _File, limits: IntakeLimits) -> str:
    """The lab that a file's name or its cells tell."""
    labs = tasks.lab_numbers()
    named = [number for number in re.findall(r"(?<!\d)(\d\d)_[a-z]", file.parts[-1]) if number in labs]
    if len(set(named)) == 1:
        return named[0]
    if not file.data:
        return ""
    try:
        nb = notebook_of(file.data, limits)
    except Unreadable:
        return ""
    return lab_of_cells([cell.source for cell in nb.cells if cell.cell_type == "code"])


def _keep(store: Path, digest: str, data: bytes) -> None:
    """Keep the original under its hash, whole or not at all."""
    place = store / digest[:2] / digest
    if place.exists():
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    part = place.with_name(f".{digest}.{os.getpid()}.part")
    try:
        part.write_bytes(data)
        part.chmod(0o400)
        part.rename(place)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise CourseError(f"{store} cannot hold the originals: {error.strerror}.") from error


def _shown(text: str) -> str:
    """A name as people can read it: bytes that are no UTF-8 as \\xNN."""
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _cleaned(text: str) -> str:
    return _shown(" ".join(text.split()))[:120]


def _numbered(found: list[Submission]) -> list[Submission]:
    """Number the attempts of each student at each lab: by the suffix, then by time, then by name."""
    groups: dict[tuple[str, str], list[Submission]] = {}
    for one in found:
        groups.setdefault((one.student or f"?{one.named}", one.lab), []).append(one)
    result = []
    for group in groups.values():
        group.sort(key=lambda one: (one.attempt, one.received, one.path))
        result += [replace(one, attempt=i + 1) for i, one in enumerate(group)]
    return sorted(result, key=lambda one: (one.lab, one.student, one.named, one.attempt))
