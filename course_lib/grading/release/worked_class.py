"""A class of twelve who never were, to try every verb on: `course release --worked-class --out FOLDER` writes it.

It is a Moodle download of lab 03 with its roster, extensions, late policy and limits. Two solved everything in their
own ways, others made the mistakes that people really make, some handed in oddly but honestly, one twice, one late, one
nothing that can be read, one nothing at all, and one is in no roster.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import nbformat

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.authoring.tree import CourseError, course_tree

from .released import released_lab

__all__ = ["LAB", "STUDENTS", "write_class"]

LAB = "03"
DUE = datetime(2026, 11, 24, 23, 0, tzinfo=UTC)
STUDENTS = (
    (101, "Ada Okafor", "A"),
    (102, "Ben Fischer", "A"),
    (103, "Chen Wei", "A"),
    (104, "Dora, née Szabó", "A"),
    (105, "Emil Sørensen", "A"),
    (106, "Fatima El-Sayed", "B"),
    (107, "Goran Petrović", "B"),
    (108, "Hana 🙂 Kim", "B"),
    (109, "Iris Blanc", "B"),
    (110, "Jonas Weber", "B"),
    (111, "Kofi Mensah", "B"),
    (112, "Lea Rossi", "B"),
)

ANOTHER_WAY = '''def deproject(ranges, fx, fy, cx, cy, left, top):
    """One row of the window after the other."""
    points = np.full((*ranges.shape, 3), np.nan)
    for v, row in enumerate(ranges):
        for u, length in enumerate(row):
            if length > 0:
                ray = np.array([(u + left - cx) / fx, (v + top - cy) / fy, 1.0])
                points[v, u] = length * ray / np.linalg.norm(ray)
    return points
'''
ENDLESS = "def deproject(ranges, fx, fy, cx, cy, left, top):\n    while True:\n        pass\n"


def write_class(folder: Path) -> Path:
    """Write the download, roster.csv, extensions.csv, late.toml and limits.toml into an empty or a new folder.

    Returns
    -------
    The folder of the download.

    Raises
    ------
    CourseError
        If the folder holds something.
    """
    if folder.exists() and any(folder.iterdir()):
        raise CourseError(f"{folder} is not empty: name a new folder.")
    download = folder / "submissions"
    for number, name, _ in STUDENTS:
        make = _MAKERS.get(number)
        if make is not None:
            _hand_in(download, number, name, make(), hours_late=30 if number == 110 else -2)
    _hand_in(download, 102, "Ben Fischer", _solved({}), hours_late=-1, name="03_depth_to_points-1.ipynb")
    _hand_in(download, 999, "Somebody Else", _solved({}), hours_late=-2)
    _write_csv(folder / "roster.csv", [["id", "name", "group"], *([*row] for row in STUDENTS)])
    _write_csv(folder / "extensions.csv", [["student", "lab", "due"], [111, LAB, "excused"]])
    due = DUE.isoformat()
    policy = (
        f'timezone = "Europe/Berlin"\ncounts = "last"\n\n[due]\n"{LAB}" = {due}\n\n[[steps]]\nhours = 0\nkeep = 80\n'
    )
    (folder / "late.toml").write_text(policy, encoding="utf-8")
    limits = "task_seconds = 4  # one student's loop never ends: nobody who tries this shall wait long\n"
    (folder / "limits.toml").write_text(limits, encoding="utf-8")
    return download


def _write_csv(path: Path, rows: list[list]) -> None:
    out = io.StringIO()
    csv.writer(out).writerows(rows)
    path.write_text(out.getvalue(), encoding="utf-8")


def _hand_in(
    download: Path, number: int, who: str, data: bytes, hours_late: float, name: str = "03_depth_to_points.ipynb"
) -> None:
    path = download / f"{who}_{number}_assignsubmission_file_" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    time = DUE.timestamp() + 3600 * hours_late
    os.utime(path, (time, time))


def _exercise() -> nbformat.NotebookNode:
    lab = released_lab(LAB)
    return nbformat.read(course_tree().exercises_folder / f"{lab.name}.ipynb", as_version=4)


def _notebook(answers: dict[int, str]) -> nbformat.NotebookNode:
    nb = _exercise()
    for slot in released_lab(LAB).slots:
        cell = next(cell for cell in nb.cells if cell.id == slot.cell)
        cell.source = answers.get(slot.task.number, cell.source)
    return nb


def _solved(but: dict[int, str]) -> bytes:
    """The reference, without its markers, with some answers exchanged."""
    right = {task.number: solutions.reference(task.id) for task in tasks.lab(LAB)}
    return nbformat.writes(_notebook(right | but)).encode()


def _mistakes(place: int) -> Callable[[], bytes]:
    """Of tasks 2 to 5 the mistake at this place in their lists."""

    def make() -> bytes:
        wrong = {t.number: t.misconceptions[place].source for t in tasks.lab(LAB)[1:5]}
        return _solved(wrong)

    return make


def _moved_and_helped() -> bytes:
    """Honest but odd: a helper in a cell of its own, an answer at the end, checks deleted."""
    nb = _notebook({task.number: solutions.reference(task.id) for task in tasks.lab(LAB)})
    nb.cells = [cell for cell in nb.cells if "check" not in cell.metadata.get("tags", [])]
    task = next(cell for cell in nb.cells if cell.id == "task-1")
    nb.cells.remove(task)
    task.source = "def focal_length(fov_degrees, pixels):\n    return pixels / 2 / half_tangent(fov_degrees)\n"
    helper = nbformat.v4.new_code_cell("def half_tangent(degrees):\n    return np.tan(np.radians(degrees) / 2)\n")
    nb.cells += [helper, task]
    return nbformat.writes(nb).encode()


_MAKERS: dict[int, Callable[[], bytes]] = {
    101: lambda: _solved({2: ANOTHER_WAY}),
    102: lambda: nbformat.writes(_exercise()).encode(),  # handed in again, solved
    103: _mistakes(0),
    104: _mistakes(1),
    105: _mistakes(2),
    106: lambda: nbformat.writes(_notebook({1: solutions.reference("03-1"), 2: ENDLESS})).encode(),
    107: _moved_and_helped,
    108: lambda: json.dumps(json.loads(_solved({4: solutions.stub("03-4")})), indent=None).encode("utf-16"),
    109: lambda: _solved({})[:20_000],
    110: lambda: _solved({}),
    112: lambda: nbformat.writes(_exercise()).encode(),
}
