"""`course bench --grading`: our grader against nbgrader's autograde, on the same cells, imports, inputs and judging.

nbgrader lives in an environment of its own (made by uv on first use); it never becomes a dependency. Its notebooks hold
exactly the cells that our kernel runs, with the same stand-ins on the path, and one locked cell a task that draws the
same fresh inputs and judges them in the kernel with the same judge. All run one after the other, in turns.
"""

from __future__ import annotations

import base64
import hashlib
import itertools
import json
import os
import re
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import nbformat
from rich.console import Console
from rich.table import Table

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.authoring.tree import CourseError, Tree
from course_lib.grading.intake.intake import IntakeLimits, notebook_of
from course_lib.grading.release.rebuild import rebuild
from course_lib.grading.release.released import released_lab
from course_lib.grading.run.kernel_imports import INSIDE, SILENT
from course_lib.grading.run.limits import read_limits
from course_lib.grading.run.pool import grade_jobs

LAB, SEED = "03", 20261124
NBGRADER = "nbgrader==0.9.6"
ONE_WORKER, TWO_WORKERS, OVERHEAD_SECONDS = 1.3, 0.7, 2.0
TURNS = 4

CONFIG = """\
c = get_config()
c.CourseDirectory.course_id = "bench"
c.CourseDirectory.root = {root!r}
c.ExecutePreprocessor.timeout = 120
c.ExecutePreprocessor.kernel_name = "python3"
c.IncludeHeaderFooter.header = ""
"""
JUDGE = """\
from course_lib import tasks as _tasks
_task = _tasks.get({task!r})
_cases = _tasks.fresh(_task, {seed})
_result = _tasks.judge_all(_task, _cases, _tasks.run_all({function}, _cases))
assert _result.passed, _result.line
"""


def honest(count: int) -> list[bytes]:
    """So many different honest submissions: the reference with names and comments of their own."""
    lab = released_lab(LAB)
    path = solutions.ROOT / "exercises" / f"{lab.name}.ipynb"
    found = []
    for i in range(count):
        nb = nbformat.read(path, as_version=4)
        for slot in lab.slots:
            cell = next(cell for cell in nb.cells if cell.id == slot.cell)
            text = solutions.reference(slot.task.id)
            if slot.task.kind in ("fill", "write", "mend"):  # the others hold names of causes, and sentences
                text = re.sub(r"\bz\b", f"depth_{i}", text)
            cell.source = f"{text}\n# handed in by number {i}\n"
        found.append(nbformat.writes(nb).encode())
    return found


def _cells(data: bytes) -> list[tuple[str, str]]:
    """(task, source) of the cells that our kernel runs, in order; a task's last is followed by its judging."""
    rebuilt = rebuild(notebook_of(data, IntakeLimits()), released_lab(LAB))
    cells = [("", piece.source) for piece in rebuilt.given]
    for answer in rebuilt.answers:
        cells += [(answer.slot.task.id, piece.source) for piece in answer.pieces]
    return cells


def _nbgrader_notebook(data: bytes) -> nbformat.NotebookNode:
    """A notebook in nbgrader's form: the same cells, and an autograder test after each task."""
    cells = []
    for task_id, pairs in itertools.groupby(_cells(data), key=lambda pair: pair[0]):
        cells += [nbformat.v4.new_code_cell(source) for _, source in pairs]
        if task_id:
            task = tasks.get(task_id)
            about = {"grade": True, "grade_id": f"task-{task.number}", "locked": True, "points": task.points}
            about |= {"schema_version": 3, "solution": False, "task": False}
            test = JUDGE.format(task=task_id, seed=SEED, function=task.function)
            cells.append(nbformat.v4.new_code_cell(test, metadata={"nbgrader": about}))
    for place, cell in enumerate(cells):
        cell.id = f"c{place}"
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    return nbformat.v4.new_notebook(cells=cells, metadata=kernel)


BOOT = """\
import sys
sys.path.insert(0, {root!r})
sys.path.insert(0, {inside!r})
from kernel_main import StandIns
sys.meta_path.insert(0, StandIns({silent!r}, []))
sys.path.remove({inside!r})
from ipykernel.kernelapp import IPKernelApp
IPKernelApp.launch_instance()
"""


def _nbgrader(folder: Path) -> Path:
    """The nbgrader of an environment of its own, made on first use below the course's cache."""
    place = folder / "nbgrader"
    program = place / "bin" / "nbgrader"
    if not program.exists():
        uv = shutil.which("uv") or next((str(path) for path in sorted((solutions.ROOT / ".uv").glob("uv-*/uv"))), None)
        if uv is None:
            raise CourseError("nbgrader is installed with uv, which is not here: run `python3 course.py doctor` first.")
        subprocess.run([uv, "venv", "--quiet", "--python", sys.executable, str(place)], check=True)
        subprocess.run([uv, "pip", "install", "--quiet", "--python", str(place / "bin/python"), NBGRADER], check=True)
    return program


def _course(folder: Path, data: list[bytes], program: Path, environment: dict[str, str]) -> None:
    """An nbgrader course with these submissions, ready to be autograded."""
    folder.mkdir(parents=True)
    (folder / "nbgrader_config.py").write_text(CONFIG.format(root=str(folder)), encoding="utf-8")
    source = folder / "source" / "lab" / "lab.ipynb"
    source.parent.mkdir(parents=True)
    nbformat.write(_nbgrader_notebook(data[0]), source)
    _run([str(program), "generate_assignment", "lab"], folder, environment)
    for i, one in enumerate(data):
        place = folder / "submitted" / f"s{i:03}" / "lab" / "lab.ipynb"
        place.parent.mkdir(parents=True)
        nbformat.write(_nbgrader_notebook(one), place)


def _run(words: list[str], folder: Path, environment: dict[str, str]) -> float:
    began = time.perf_counter()
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise CourseError(f"{Path(words[0]).name} {words[1]} failed: {done.stderr[-600:]}")
    return time.perf_counter() - began


def _kernel(folder: Path) -> None:
    """A kernelspec that starts this environment's kernel with the stand-ins that graded kernels have."""
    boot = BOOT.format(root=str(solutions.ROOT), inside=str(INSIDE), silent=list(SILENT))
    place = folder / "kernels" / "python3"
    place.mkdir(parents=True)
    spec = {
        "argv": [sys.executable, "-c", boot, "-f", "{connection_file}"],
        "display_name": "graded",
        "language": "python",
    }
    (place / "kernel.json").write_text(json.dumps(spec), encoding="utf-8")


def _nbgrader_points(folder: Path, count: int) -> list[float]:
    """What nbgrader gave to each, from its gradebook."""
    with sqlite3.connect(folder / "gradebook.db") as db:
        rows = db.execute(
            "SELECT s.student_id, SUM(g.auto_score) FROM grade g JOIN submitted_notebook n ON g.notebook_id = n.id "
            "JOIN submitted_assignment s ON n.assignment_id = s.id GROUP BY s.student_id ORDER BY s.student_id"
        ).fetchall()
    if len(rows) != count:
        raise CourseError(f"nbgrader graded {len(rows)} of {count}.")
    return [float(points) for _, points in rows]


def _own_seconds(data: bytes) -> float:
    """What the cells and the questions of one submission take by themselves, in a process that has imported all."""
    space: dict = {}
    began = time.perf_counter()
    for task_id, source in _cells(data):
        if task_id or "numpy" in source:  # what only draws is nobody's work here
            exec(source, space)
    for task in tasks.lab(LAB):
        tasks.run_all(space[task.function], tasks.fresh(task, SEED))
    return time.perf_counter() - began


def bench_grading(tree: Tree, count: int, say: Callable[[str], None]) -> int:
    """Measure, print a table, and return 1 if a bound does not hold.

    Parameters
    ----------
    count : submissions; they are split over a few turns, in each of which all graders run.
    """
    submissions = honest(count)
    sums = {"nbgrader": 0.0, "one worker": 0.0, "two workers": 0.0}
    with tempfile.TemporaryDirectory(prefix="course-bench-") as name:
        folder = Path(name)
        program = _nbgrader(tree.root / ".uv")
        _kernel(folder)
        environment = {**os.environ, "JUPYTER_PATH": str(folder), "JUPYTER_PREFER_ENV_PATH": "0", "COURSE_QUIET": "1"}
        environment["PATH"] = f"{program.parent}{os.pathsep}{environment['PATH']}"  # it calls alembic
        environment |= {"OPENBLAS_NUM_THREADS": "1", "JUPYTER_DATA_DIR": str(folder), "PYTHONPATH": ""}
        size = -(-count // TURNS)
        for turn in range(TURNS):
            some = submissions[turn * size : (turn + 1) * size]
            if not some:
                continue
            place = folder / f"course{turn}"
            _course(place, some, program, environment)
            theirs = _run([str(program), "autograde", "lab"], place, environment)
            points = _nbgrader_points(place, len(some))
            sums["nbgrader"] += theirs
            for workers, label in ((1, "one worker"), (2, "two workers")):
                records: dict = {}
                began = time.perf_counter()
                grade_jobs([_job(data) for data in some], workers, records.__setitem__)
                sums[label] += time.perf_counter() - began
                ours = [records[i]["points"] for i in range(len(some))]
                by_hand = sum(task.points for task in tasks.lab(LAB) if task.kind == "explain")
                if ours != [one - by_hand for one in points]:
                    raise CourseError(f"the graders disagree: {ours} and {points}.")
            say(f"turn {turn + 1} of {TURNS}: " + ", ".join(f"{key} {value:.1f} s" for key, value in sums.items()))
        own = min(_own_seconds(submissions[0]) for _ in range(3))
    return _table(sums, count, own)


def _job(data: bytes) -> dict:
    return {
        "submission": hashlib.sha256(data).hexdigest(),
        "notebook": base64.b64encode(data).decode(),
        "lab": LAB,
        "seed": SEED,
        "sandbox": "bwrap",
        "limits": read_limits().as_dict(),
    }


def _table(sums: dict[str, float], count: int, own: float) -> int:
    theirs = sums["nbgrader"]
    overhead = sums["one worker"] / count - own
    rows = [
        ("one worker / nbgrader", sums["one worker"] / theirs, ONE_WORKER),
        ("two workers / nbgrader", sums["two workers"] / theirs, TWO_WORKERS),
        ("overhead a submission (s)", overhead, OVERHEAD_SECONDS),
    ]
    table = Table(
        "measure", "value", "bound", "", title=f"{count} honest submissions of lab {LAB}; nbgrader {theirs:.0f} s"
    )
    for label, value, bound in rows:
        table.add_row(label, f"{value:.2f}", f"{bound:g}", "PASS" if value <= bound else "FAIL")
    Console().print(table)
    return int(any(value > bound for _, value, bound in rows))
