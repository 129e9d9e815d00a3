"""The learner's own copies in my_work/: made by `start` and `reset`, never overwritten, told when the original changes.

A copy is the original with its links turned: to other copies, so that nobody works in what is shipped by following a
link; pages of docs/ are copied for that. What was copied when is kept in my_work/.jupyter/copies.json, so that a lab
that changed upstream can be told from one that its learner changed.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from course_lib.authoring.tree import CourseError, Tree, nearest
from course_lib.notebook._atomic import atomic_file

from .turned_links import linked_pages, turned, turned_notebook

Kind = Literal["lesson", "lab"]
FOLDERS: dict[Kind, str] = {"lesson": "lessons", "lab": "labs"}
_TASK = re.compile(r"^##\s+(Task\s+\d+\b.*)$", re.M)


@dataclass(frozen=True)
class Material:
    """A lesson or a lab: the original that the course ships, and the copy that the learner works in."""

    kind: Kind
    original: Path
    copy: Path

    @property
    def name(self) -> str:
        """For example 03_depth_to_points."""
        return self.original.stem

    @property
    def said(self) -> str:
        """As a person calls it: lesson 03, lab 03."""
        return f"{self.kind} {self.name[:2]}"


def work_folder(tree: Tree) -> Path:
    """Where the learner works."""
    return tree.root / "my_work"


def private_folder(tree: Tree) -> Path:
    """What Jupyter keeps about this course: settings, trust, running servers, and the record of copies."""
    return work_folder(tree) / ".jupyter"


def materials(tree: Tree, kind: Kind | None = None) -> list[Material]:
    """Every lesson and lab that the course ships, in order."""
    originals: dict[Kind, Path] = {"lesson": tree.lessons_folder, "lab": tree.exercises_folder}
    return [
        Material(one, path, work_folder(tree) / FOLDERS[one] / path.name)
        for one in originals
        if kind in (None, one)
        for path in sorted(originals[one].glob("[0-9][0-9]_*.ipynb"))
    ]


def find(tree: Tree, kind: Kind, word: str) -> Material:
    """Find a lesson or lab by its number (3, 03) or its name, with or without the number.

    Raises
    ------
    CourseError
        If there is none; the nearest is suggested.
    """
    known = materials(tree, kind)
    plain = re.sub(r"\.ipynb$", "", word.strip().lower()).replace("-", "_").replace(" ", "_")
    plain = re.sub(rf"^{kind}_?(?=\d)", "", plain)
    for one in known:
        if plain in (one.name, one.name[3:]) or (plain.isdigit() and plain.zfill(2) == one.name[:2]):
            return one
    numbers = ", ".join(one.name[:2] for one in known) or "none yet"
    names = [name for one in known for name in (one.name, one.name[3:])]
    raise CourseError(f"There is no {kind} {word!r}.{nearest(plain, names) or f' There are: {numbers}.'}")


def copies(tree: Tree) -> dict[Path, Path]:
    """What is copied → where it lies in my_work/: lessons, labs, and the pages of docs/ that they lead to."""
    there = {one.original.resolve(): one.copy for one in materials(tree)}
    pages = linked_pages(there, tree.docs_folder)
    return there | {page: work_folder(tree) / "docs" / page.name for page in pages}


def copy_text(one: Material, there: dict[Path, Path]) -> str:
    """The text of a copy: the original, its links in prose leading to what else is copied."""
    return turned_notebook(one.original.read_text(encoding="utf-8"), one.original, one.copy, there)


def _update_pages(record: _Record, there: dict[Path, Path]) -> bool:
    """Bring the pages up to date in which nobody wrote; say whether one is new."""
    new = False
    for page, copy in there.items():
        if page.suffix != ".md":
            continue
        text = turned(page.read_text(encoding="utf-8"), page, copy, there)
        key, wanted = f"docs/{copy.name}", _digest(text)
        stands = _digest(copy.read_text(encoding="utf-8", errors="replace")) if copy.exists() else None
        if stands == wanted or (stands and record.copies.get(key) != {"page": stands}):
            continue
        _write(copy, text)
        record.copies[key], new = {"page": wanted}, True
    return new


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()[:16]


def _cells(text: str) -> dict[str, str] | None:
    """The id of every cell with a digest of its source; None for what is no notebook (any more)."""
    try:
        cells = json.loads(text)["cells"]
        return {cell.get("id", str(place)): _digest("".join(cell["source"])) for place, cell in enumerate(cells)}
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def _changed_tasks(text: str, before: dict[str, str]) -> list[str]:
    """The headings of the tasks in which a cell is new or differs."""
    heading, found = "", []
    for cell in json.loads(text)["cells"]:
        source = "".join(cell["source"])
        titles = _TASK.findall(source) if cell["cell_type"] == "markdown" else []
        heading = titles[-1].strip() if titles else heading
        if before.get(cell.get("id", "")) != _digest(source) and heading and heading not in found:
            found.append(heading)
    return found


def _key(one: Material) -> str:
    return f"{FOLDERS[one.kind]}/{one.copy.name}"


class _Record:
    """my_work/.jupyter/copies.json: for each copy, its original's digest, its cells, and what has been said."""

    def __init__(self, tree: Tree) -> None:
        self.path = private_folder(tree) / "copies.json"
        try:
            self.copies: dict[str, dict[str, Any]] = dict(json.loads(self.path.read_text(encoding="utf-8"))["copies"])
        except (OSError, ValueError, KeyError, TypeError):  # none yet, or damaged: every copy counts as the learner's
            self.copies = {}

    def note(self, one: Material, text: str) -> None:
        """A copy was made of the original as it is now."""
        original = _digest(one.original.read_text(encoding="utf-8"))
        self.copies[_key(one)] = {"original": original, "cells": _cells(text)}

    def save(self) -> None:
        _write(self.path, json.dumps({"copies": self.copies}, indent=1, sort_keys=True) + "\n")


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def update(tree: Tree) -> list[str]:
    """Copy what is not in my_work/ yet, and say what is new. Callers hold the lock of `start`.

    A file that its learner changed is never touched; one in which nobody wrote anything is brought up to date.

    Returns
    -------
    Sentences for the learner; none where nothing is new.
    """
    record, said, copied, there = _Record(tree), [], [], copies(tree)
    for one in materials(tree):
        original = _digest(one.original.read_text(encoding="utf-8"))
        known = record.copies.get(_key(one))
        if one.copy.exists():
            if known is None or original in (known["original"], known.get("told")):
                continue
            if _cells(one.copy.read_text(encoding="utf-8", errors="replace")) != known["cells"]:
                known["told"] = original
                said.append(_news(one, known["cells"]))
                continue
            said.append(
                f"{one.said.capitalize()} has changed; you had written nothing in your copy, so it is the new one."
            )
        else:
            copied.append(one)
        text = copy_text(one, there)
        _write(one.copy, text)
        record.note(one, text)
    if copied:
        said.insert(0, f"Copied to my_work/ for you to work in: {', '.join(one.said for one in copied)}.")
    if _update_pages(record, there) or said:
        record.save()
    return said


def _news(one: Material, before: dict[str, str]) -> str:
    tasks = _changed_tasks(one.original.read_text(encoding="utf-8"), before) if one.kind == "lab" else []
    what = f" ({'; '.join(tasks)})" if tasks else ""
    option = " --lesson" if one.kind == "lesson" else ""
    return (
        f"{one.said.capitalize()} has changed since you began it{what}. Your file stays as it is; "
        f"`python3 course.py reset {one.name[:2]}{option}` puts the new one beside it."
    )


def fresh_copy(tree: Tree, one: Material) -> Path:
    """Make a fresh copy beside the learner's, under a name that is free, and return its path."""
    text = copy_text(one, copies(tree))
    for ending in itertools.chain(["", "-fresh"], (f"-fresh-{number}" for number in itertools.count(2))):
        path = one.copy.with_name(f"{one.name}{ending}.ipynb")
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            path.touch(exist_ok=False)  # claims the name, also against another `reset` at this moment
        except FileExistsError:
            continue
        try:
            _write(path, text)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        if path == one.copy:
            record = _Record(tree)
            record.note(one, text)
            record.save()
        return path


def sign(tree: Tree, more: Iterable[Path] = ()) -> int:
    """Let Jupyter trust every notebook that the course ships and every copy of one; return how many were new.

    Trust hangs on the content: what a learner brings from elsewhere into my_work/ is not trusted by this.
    """
    shipped = [one.original for one in materials(tree)] + sorted(tree.solutions_folder.glob("[0-9][0-9]_*.ipynb"))
    texts = {path.read_text(encoding="utf-8") for path in [*shipped, *more]}
    there = copies(tree)
    texts |= {copy_text(one, there) for one in materials(tree)}
    data = private_folder(tree) / "data"
    note = data / "signed.json"
    try:
        known = set(json.loads(note.read_text(encoding="utf-8"))) if (data / "nbsignatures.db").exists() else set()
    except (OSError, ValueError):
        known = set()
    new = {digest: text for text in texts if (digest := _digest(text)) not in known}
    if new:
        import nbformat
        from nbformat.sign import NotebookNotary

        data.mkdir(parents=True, exist_ok=True)
        notary = NotebookNotary(data_dir=str(data))
        for text in new.values():
            notary.sign(nbformat.reads(text, as_version=4))
        notary.store.close()
        _write(note, json.dumps(sorted(known | set(new))))
    return len(new)
