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
from course_lib.grading.disks import disk_told
from course_lib.grading.intake.authorship import author
from course_lib.grading.release.released import lab_of_cells
from course_lib.grading.safe_text import shown

from .archives import Member, members
from .roster import Roster
from .untrusted_notebook import IntakeLimits, Unreadable, notebook_of

__all__ = ["IntakeLimits", "Submission", "Unreadable", "notebook_of", "original", "read_class"]

COPIES = ".ipynb_checkpoints"
IGNORED = ("__MACOSX", ".DS_Store", "Thumbs.db", "desktop.ini", ".git")
NO_NOTEBOOK = ("not a notebook", "checkpoint")


@dataclass(frozen=True)
class Submission:
    """One file that was handed in.

    Parameters
    ----------
    student : id in the roster; "" waits for a person.
    named : what the download calls them; never trusted, never a path.
    lab : "03", or "" if unknown.
    sha256 : of the notebook's bytes; "" if there are none.
    path : where it lay, for people; it can be typed as it is shown.
    received : ISO 8601 in UTC, or "".
    late : marked so by the download.
    suffix : 2 of "lab-2.ipynb", as an LMS counts what is handed in again; 0 where there is none.
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
    suffix: int
    layout: str
    trouble: str = ""
    code: str = ""


@dataclass(frozen=True)
class _File:
    """One file of the download.

    Parameters
    ----------
    parts : its parts below the top; of a file in a zip, those of the zip.
    data : its bytes, or b"" and why there are none.
    inside : its name in the zip that a student handed in.
    """

    parts: tuple[str, ...]
    data: bytes
    received: str
    code: str = ""
    trouble: str = ""
    inside: str = ""

    @property
    def name(self) -> str:
        return PurePosixPath(self.inside or self.parts[-1]).name or "nameless"

    @property
    def path(self) -> str:
        return shown("/".join(self.parts) + (f": {self.inside}" if self.inside else ""))


def read_class(
    folder: Path, *, lab: str | None, roster: Roster | None, limits: IntakeLimits, store: Path
) -> tuple[list[Submission], list[str]]:
    """Every submission of a download, with its original kept in the store, and the paths of files that are none.

    A file that is no notebook is a submission, for a person, where its student handed in no notebook of its lab; else
    it is among those paths.

    Parameters
    ----------
    lab : the lab of all of them; None finds it out from names and cells.
    store : a folder; originals lie there under their hash, unchanged.

    Raises
    ------
    CourseError
        If the folder cannot be read at all, or holds more files than the limits.
    """
    found = [
        _submission(one, lab, roster, limits, store) for file in _files(folder, limits) for one in _judged(file, limits)
    ]
    kept = [one for one in found if one.code not in NO_NOTEBOOK]
    whose = {(one.student or one.named, number) for one in kept for number in (one.lab, "")}
    left = []
    for one in sorted((one for one in found if one.code in NO_NOTEBOOK), key=lambda one: not one.lab):
        who = one.student or one.named
        if (who, one.lab) not in whose:
            whose |= {(who, one.lab), (who, "")}
            kept.append(one)
        elif one.code != "checkpoint":  # Jupyter's own copy of what is there is nothing that was handed in
            left.append(one.path)
    return sorted(kept, key=lambda one: (one.lab, one.student, one.named, one.received, one.suffix, one.path)), left


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
                if not _ignored(_parts(member)):
                    yield _File(_parts(member), member.data, member.received, member.code, member.trouble)
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


def _judged(file: _File, limits: IntakeLimits) -> Iterator[_File]:
    """A file as it came or with what is wrong with it; of a zip that a student handed in, each file in it."""
    kind = PurePosixPath(file.name.lower()).suffix
    if COPIES in (*file.parts, *PurePosixPath(file.inside).parts):
        sentence = f"only Jupyter's own copy in {COPIES} came: ask for the notebook itself."
        yield replace(file, data=b"", code="checkpoint", trouble=sentence)
    elif kind not in (".ipynb", ".zip") and file.code in ("", "too big"):
        sentence = f"{shown(file.name)} is no notebook: hand in the .ipynb file."
        yield replace(file, data=b"", code="not a notebook", trouble=sentence)
    elif kind == ".zip" and not file.trouble:
        sentence = "it is a zip in a zip: hand in the .ipynb file."
        inner = replace(file, data=b"", code="not a notebook", trouble=sentence)
        yield from [inner] if file.inside else _unpacked(file, limits)
    else:
        yield file


def _unpacked(file: _File, limits: IntakeLimits) -> Iterator[_File]:
    """The files of a zip that a student handed in."""
    empty = True
    try:
        for member in members(file.data, limits):
            if not _ignored(_parts(member)):
                empty = False
                one = replace(file, data=member.data, code=member.code, trouble=member.trouble)
                yield from _judged(replace(one, inside="/".join(_parts(member))), limits)
    except Unreadable as error:
        yield replace(file, data=b"", code=error.code, trouble=error.sentence)
    else:
        if empty:
            yield replace(file, data=b"", code="not a notebook", trouble="the zip holds no notebook.")


def _parts(member: Member) -> tuple[str, ...]:
    """The parts of a name in a zip, none of which leads anywhere."""
    parts = PurePosixPath(member.name.replace("\\", "/")).parts
    return tuple(part for part in parts if part not in ("/", "..")) or ("nameless",)


def _submission(file: _File, lab: str | None, roster: Roster | None, limits: IntakeLimits, store: Path) -> Submission:
    who = author(file.parts)
    digest = ""
    if file.data:
        digest = hashlib.sha256(file.data).hexdigest()
        _keep(store, digest, file.data)
    return Submission(
        student=roster.match(who) if roster else shown(" ".join(who.ids[0].split()))[:120],
        named=_said(who.names[0]),
        lab=lab or _lab(file, limits),
        sha256=digest,
        path=file.path,
        received=file.received,
        late=who.late,
        suffix=who.suffix,
        layout=who.layout,
        trouble=file.trouble,
        code=file.code,
    )


def _lab(file: _File, limits: IntakeLimits) -> str:
    """The lab that a file's name or its cells tell."""
    labs = tasks.lab_numbers()
    named = [number for number in re.findall(r"(?<!\d)(\d\d)_[a-z]", file.name) if number in labs]
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
    part = place.with_name(f".{digest}.{os.getpid()}.part")
    with disk_told(store):
        place.parent.mkdir(parents=True, exist_ok=True)
        try:
            part.write_bytes(data)
            part.chmod(0o400)
            part.rename(place)
        except OSError:
            part.unlink(missing_ok=True)
            raise


def _said(name: str) -> str:
    """A name as people write it: bytes that are no UTF-8 as \\xNN."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
