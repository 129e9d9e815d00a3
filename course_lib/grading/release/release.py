"""What students get of a lab: a stand-alone copy of the course with the exercise and without what would answer it.

No solutions, no tests, nothing that grades, no other lab's tasks. MANIFEST.json says what a release holds: version,
cells, slots, points, and a hash of every file.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import tempfile
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path

import nbformat

from course_lib import tasks
from course_lib.authoring import notebooks as nbs
from course_lib.authoring.tree import CourseError, Tree
from course_lib.grading.module_graph import closure, imported_names
from course_lib.tasks.core import LIBRARY
from course_lib.tasks.private import LISTED, private_tasks

from .bare_lab import bare_lab
from .hiding import hidden_sources, needed
from .private import listing, with_private_cells
from .released import ReleasedLab, released_lab

__all__ = ["MANIFEST", "release"]

MANIFEST = "MANIFEST.json"
TOP = ("course.py", "pyproject.toml", "uv.lock", "LICENSE")
VERBS = ("start", "reset", "doctor", "data_verbs")
"""The modules of launch/ that students use; with them comes what they import."""
_HINT = re.compile(r"<details>\s*<summary>\s*Hint (\d+).*?</details>[ \t]*\n?", re.S)

README = """\
# {title}

Labs: {labs}.

```
python3 course.py start
```

sets everything up on the first run (Python 3.11 or newer, about two minutes) and opens JupyterLab. You work on copies
in `my_work/`. `python3 course.py doctor` says what works on your computer, and how to mend the rest.

Write your answers where a cell says `raise NotImplementedError`, and run the check below each. To hand in: restart the
kernel, run all cells, save, and give your instructor this one file: {files}. Keep its name.
"""


def release(labs: Sequence[str], out: Path, tree: Tree, hints: int = 3) -> Path:
    """Write the release of some labs as a folder and as a zip beside it.

    An instructor's own tasks (see `private`) are there by their cells and names only.

    Parameters
    ----------
    labs : numbers, such as "03".
    out : a folder that does not exist, is empty, or holds an earlier release, which is replaced.
    hints : how many hints of each task stay.

    Returns
    -------
    The path of the zip.

    Raises
    ------
    CourseError
        If a lab does not exist, or the folder holds something else.
    """
    released = [released_lab(number, tree.root) for number in sorted(set(labs))]
    if out.exists() and any(out.iterdir()) and not (out / MANIFEST).is_file():
        raise CourseError(f"{out} holds files that are no release: name an empty folder or a new one.")
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent) as name:
        folder = Path(name) / "release"
        folder.mkdir()
        kept = _write(folder, released, tree, hints)
        _write_manifest(folder, released, tree, kept, hints)
        archive = Path(name) / "release.zip"
        _zip(folder, archive, out.name)
        if out.exists():
            shutil.rmtree(out)
        folder.rename(out)
        return archive.rename(out.with_name(out.name + ".zip"))


def _write(folder: Path, released: Sequence[ReleasedLab], tree: Tree, hints: int) -> list[str]:
    """Write everything but the manifest; the hidden names that the course needs for itself."""
    numbers = [lab.number for lab in released]
    for name in TOP:
        shutil.copyfile(tree.root / name, folder / name)
    (folder / "exercises").mkdir()
    for lab in released:
        nb = with_private_cells(lab.number, nbs.read_notebook(tree.exercises_folder / f"{lab.name}.ipynb"))
        nbs.write_notebook(folder / "exercises" / f"{lab.name}.ipynb", fewer_hints(nb, hints))
    bare: dict[Path, bytes] = {}
    for lab in released:
        nb = nbs.read_notebook(tree.exercises_folder / f"{lab.name}.ipynb")
        bare |= bare_lab(lab.number, tree.root, _from_labs(nb))
    files = [path for path in library_files(numbers, tree.root) if path.parent not in {p.parent for p in bare}]
    texts = [path.read_text(encoding="utf-8") for path in files if path.suffix == ".py"]
    texts += [data.decode() for path, data in bare.items() if path.suffix == ".py"]
    hides = sorted({name for number in numbers for task in tasks.lab(number) for name in task.hides})
    hides = [name for name in hides if name.startswith("course_lib.")]
    kept = needed(hides, tree.root, texts)
    changed = hidden_sources(hides, tree.root, kept)
    for path in [*files, *bare, *_data_files(tree.root)]:
        place = folder / path.relative_to(tree.root)
        place.parent.mkdir(parents=True, exist_ok=True)
        if path in bare:
            place.write_bytes(bare[path])
        elif path in changed:
            place.write_text(changed[path], encoding="utf-8")
        else:
            shutil.copyfile(path, place)
    if any(private_tasks(number) for number in numbers):
        (folder / LISTED.relative_to(LISTED.parents[2])).write_text(listing(numbers), encoding="utf-8")
    title = "Labs of the course on 3D reconstruction"
    names = ", ".join(f"`my_work/labs/{lab.name}.ipynb`" for lab in released)
    text = README.format(title=title, labs=", ".join(lab.name for lab in released), files=names)
    (folder / "README.md").write_text(text, encoding="utf-8")
    return kept


def _from_labs(nb: nbformat.NotebookNode) -> set[str]:
    """The dotted names that a notebook imports from labs' packages."""
    code = [cell.source for cell in nb.cells if cell.cell_type == "code"]
    names = set().union(*(imported_names(source, ()) for source in code))
    return {name for name in names if name.startswith("course_lib.tasks.labs.")}


def fewer_hints(nb: nbformat.NotebookNode, most: int) -> nbformat.NotebookNode:
    """The notebook with at most so many hints a task."""
    for cell in nb.cells:
        if cell.cell_type == "markdown":
            cell.source = _HINT.sub(lambda m: m[0] if int(m[1]) <= most else "", cell.source).rstrip()
    return nb


def library_files(numbers: Sequence[str], root: Path) -> list[Path]:
    """The modules of course_lib that students of some labs need, and the files beside them."""
    library = root / "course_lib"
    files = [path for path in library.glob("*.py")]
    for room in (*LIBRARY, "simulate", "notebook"):
        files += [p for p in (library / room).rglob("*") if p.is_file() and "__pycache__" not in p.parts]
    files += [library / "launch" / f"{name}.py" for name in VERBS] + [*(library / "launch/bootstrap").glob("*.py")]
    for number in numbers:
        files += [p for p in library.glob(f"tasks/labs/lab_{number}_*/*") if p.suffix in (".py", ".npz")]
    return closure([*files, library / "tasks/__init__.py"], root, lambda path: library / "grading" in path.parents)


def _data_files(root: Path) -> list[Path]:
    folder = root / "datasets"
    return sorted(
        path for path in folder.rglob("*") if path.is_file() and "cache" not in path.relative_to(folder).parts
    )


def _write_manifest(folder: Path, released: Sequence[ReleasedLab], tree: Tree, kept: list[str], hints: int) -> None:
    version = tomllib.loads((tree.root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    labs = {}
    for lab in released:
        nb = nbs.read_notebook(folder / "exercises" / f"{lab.name}.ipynb")
        slots = [
            {
                "task": slot.task.id,
                "version": slot.task.version,
                "cell": slot.cell,
                "signature": slot.task.signature,
                "points": slot.task.points,
            }
            for slot in lab.slots
        ]
        cells = [{"id": cell.id, "sha256": _sha(cell.source.encode())} for cell in nb.cells]
        labs[lab.number] = {
            "name": lab.name,
            "version": lab.version,
            "points": lab.points,
            "slots": slots,
            "cells": cells,
        }
    files = {p.relative_to(folder).as_posix(): _sha(p.read_bytes()) for p in sorted(folder.rglob("*")) if p.is_file()}
    text = json.dumps(
        {"course": version, "hints": hints, "labs": labs, "kept for display": kept, "files": files}, indent=1
    )
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")


def _sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _zip(folder: Path, archive: Path, top: str) -> None:
    """The same files always give the same bytes."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for path in sorted(p for p in folder.rglob("*") if p.is_file()):
            info = zipfile.ZipInfo(f"{top}/{path.relative_to(folder).as_posix()}", (2020, 1, 1, 0, 0, 0))
            info.external_attr, info.compress_type = 0o100644 << 16, zipfile.ZIP_DEFLATED
            file.writestr(info, path.read_bytes())
