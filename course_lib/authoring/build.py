"""`course build`: from reviewed sources to the executed notebooks that people open, and the proof that both agree."""

from __future__ import annotations

import contextlib
import copy
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from nbformat import NotebookNode

from course_lib.notebook._errors import Refusal
from course_lib.tasks.registry import lab_numbers

from . import notebooks as nbs
from . import stubs
from .gates import findings
from .generated import stale, write_generated
from .kernels import CellFailed, execute
from .lab_pictures import write_pictures
from .lesson_files import lacking
from .minutes import counted
from .needed_data import prepare_data
from .outputs import keep_unchanged
from .public_answers import stale_public, write_public
from .solutions import ROOT
from .tree import CourseError, Source, Tree

GRADED = (
    "When it is graded, your answers run in a fresh kernel with other inputs. No file of your own is there, and nobody "
    "answers `input()`: what an answer needs stands in the notebook."
)
"""What every exercise says before its first task."""


def exercise_from(solution: NotebookNode) -> NotebookNode:
    """Make the learner's version of a lab: stubs for answers, and outputs only where the cell is tagged `expected`.

    Its first cell also says what is not there when it is graded. Cells keep the ids of the solution, so that an answer
    can be found again.
    """
    cells = copy.deepcopy(solution.cells)
    cells[0].source = f"{cells[0].source}\n\n{GRADED}"
    for cell, task in nbs.with_tasks(cells):
        if cell.cell_type != "code":
            continue
        tags = nbs.cell_tags(cell)
        if "expected" not in tags:
            cell.outputs = []
        cell.execution_count = None
        for output in cell.outputs:
            if output.output_type == "execute_result":
                output.execution_count = None
        if "task" in tags:
            if task is None:
                raise CourseError(f"the task cell {cell.id} stands before any heading `## Task N — title (P points)`.")
            cell.source = stubs.exercise_source(cell.source, task.number, task.title, task.number <= stubs.KEPT_PLANS)
    return nbs.notebook_of(cells)


def _stored_for_missing(
    nb: NotebookNode, old: NotebookNode | None, missing: set[str], source: Source
) -> dict[str, list[NotebookNode]]:
    """The stored outputs, by cell id, of the cells whose real data are not there; refuse where there are none."""
    stored = {cell.id: cell for cell in old.cells if cell.cell_type == "code"} if old else {}
    kept = {}
    for cell in nb.cells:
        names = set(nbs.real_data_of(cell)) & missing if cell.cell_type == "code" else set()
        if not names:
            continue
        before = stored.get(cell.id)
        if before is None or before.execution_count is None:
            name = sorted(names)[0]
            raise CourseError(
                f"{source.name} needs {name}: run `python3 course.py data get {name}`, or set COURSE_DATA_MIRROR."
            )
        kept[cell.id] = before.outputs
    return kept


def _explain(failure: CellFailed, nb: NotebookNode, source: Source, tree: Tree) -> CourseError:
    cell = nb.cells[failure.cell]
    place = f"{tree.relative(source.path)}:{nbs.line_of_cell(source.path, cell) + failure.line - 1}"
    lines = list(enumerate(cell.source.splitlines(), start=1))[max(failure.line - 4, 0) : failure.line + 2]
    text = "\n".join(f"  {'>' if number == failure.line else ' '} {line}" for number, line in lines)
    return CourseError(f"{place}: {failure}\n{text}\n  The notebook was left as it was.")


def build(
    source: Source,
    tree: Tree,
    say: Callable[[str], None] = lambda line: None,
    prepare: Callable[[NotebookNode], set[str]] = prepare_data,
) -> list[Path]:
    """Execute a source and store what came out.

    Parameters
    ----------
    say : prints a line.
    prepare : makes the data that a notebook names, and returns the names of what is missing.

    Returns
    -------
    The notebooks whose bytes changed.

    Raises
    ------
    CourseError
        If a cell fails or data are missing; the stored notebooks are then untouched.
    """
    nb = nbs.read_source(source.path)
    missing = prepare(nb)
    old = None
    with contextlib.suppress(CourseError):  # there is none, or it is beyond reading
        old = nbs.read_notebook(source.notebook)
    kept = _stored_for_missing(nb, old, missing, source)
    try:
        execute(nb, tree.root, strict=source.kind == "lab")
    except CellFailed as failure:
        raise _explain(failure, nb, source, tree) from failure
    for cell in nb.cells:
        if cell.id in kept:
            cell.outputs = kept[cell.id]
    if kept:
        say(f"  {len(kept)} real-data cells kept as stored: {', '.join(sorted(missing))} not there")
    if old is not None:
        keep_unchanged(old, nb)
    made = [(source.notebook, nb)]
    if source.exercise is not None:
        made.append((source.exercise, exercise_from(nb)))
    return [path for path, notebook in made if nbs.write_notebook(path, notebook)]


def _differences(stored: NotebookNode, wanted: NotebookNode) -> list[str]:
    """What differs between a stored notebook and what its source gives, cell by cell, outputs left aside."""
    if len(stored.cells) != len(wanted.cells):
        known = {cell.get("id") for cell in stored.cells}
        first = next((cell.id for cell in wanted.cells if cell.id not in known), "its last cells")
        return [f"has {len(stored.cells)} cells where its source has {len(wanted.cells)} (first: {first})"]
    found = []
    for number, (a, b) in enumerate(zip(stored.cells, wanted.cells, strict=True)):
        parts = [key for key in ("cell_type", "source", "id", "metadata") if a.get(key) != b.get(key)]
        if parts:
            found.append(f"cell {number} ({b.id}) differs in {', '.join(parts).replace('cell_type', 'type')}")
    if stored.metadata != wanted.metadata:
        found.append("differs in its notebook metadata")
    return found


def check_agreement(source: Source, tree: Tree) -> list[str]:
    """Prove, without executing, that the stored notebooks of one source are what it gives.

    Returns
    -------
    One line for each difference, with the command that mends it; empty where all agree.
    """
    wanted = nbs.read_source(source.path)
    mend = f"mend: python3 course.py build {source.name}"
    found: list[tuple[Path, str]] = []
    path = source.notebook
    try:
        stored = nbs.read_notebook(path)
        lines = _differences(stored, wanted)
        counts = [cell.execution_count for cell in stored.cells if cell.cell_type == "code"]
        lines += [] if counts == list(range(1, len(counts) + 1)) else ["was not executed from top to bottom"]
        found += [(path, line) for line in lines + _not_canonical(path, stored)]
        if source.exercise is not None:
            path = source.exercise
            exercise, given = nbs.read_notebook(path), exercise_from(wanted if found else stored)
            lines = _differences(exercise, given)
            if not lines and not found and exercise != given:
                lines = ["has outputs that are not those of its solution's `expected` cells"]
            found += [(path, line) for line in lines + _not_canonical(path, exercise)]
    except CourseError as error:
        found.append((path, str(error).rstrip(".")))
    return [f"{tree.relative(path)}: {line}; {mend}" for path, line in found]


def _not_canonical(path: Path, nb: NotebookNode) -> list[str]:
    return [] if path.read_bytes() == nbs.as_bytes(nb) else ["is not stored as build stores it"]


def orphans(tree: Tree) -> list[str]:
    """Notebooks that no source gives."""
    known = {path.resolve() for source in tree.sources() for path in source.notebooks}
    folders = (tree.lessons_folder, tree.solutions_folder, tree.exercises_folder)
    return [
        f"{tree.relative(path)}: no source gives this notebook; mend: delete it, or write its source"
        for folder in folders
        for path in sorted(folder.glob("*.ipynb"))
        if path.resolve() not in known
    ]


def _asks(source: Source, tree: Tree) -> bool:
    """Whether a source is a lab of this course, whose tasks are registered."""
    return source.kind == "lab" and tree.root == ROOT and source.number in lab_numbers()


def build_all(names: Iterable[str], kind: str | None, tree: Tree, say: Callable[[str], None]) -> int:
    """Build what is named, one after the other, and print what the gates find; the others go on after a failure.

    The gates look when all is written: a lesson links to its lab and to its words in the glossary.

    Returns
    -------
    The exit code: 1 if a cell failed or a gate found something.
    """
    names = list(names)
    failed = 0
    built: list[Source] = []
    for source in [source for source in tree.find(names) if kind in (None, source.kind)]:
        started = time.perf_counter()
        say(tree.relative(source.path))
        if _asks(source, tree) and (drawn := write_pictures(source.number, tree)):
            say(f"  {drawn}")
        try:
            changed = build(source, tree, say)
        except Refusal as error:
            say(f"  {error}")
            failed += 1
            continue
        what = ", ".join(tree.relative(path) for path in changed) or "nothing changed"
        say(f"  {what} ({time.perf_counter() - started:.0f} s); it takes {counted(source.notebook, tree)} minutes")
        built.append(source)
    for line in filter(None, (write_public(source.number, tree) for source in built if _asks(source, tree))):
        say(line)
    for path in write_generated(tree):
        say(f"{tree.relative(path)}: its rows are new")
    found = [line for source in built for path in source.notebooks for line in findings(path, tree)]
    found += lacking(tree, names)
    for line in found:
        say(f"! {line}")
    if failed or found:
        say(f"{failed} sources failed, {len(found)} findings")
    return 1 if failed or found else 0


def check_all(names: Iterable[str], kind: str | None, tree: Tree, say: Callable[[str], None]) -> int:
    """Print every difference between sources and stored notebooks. Returns the exit code."""
    names = list(names)
    sources = [source for source in tree.find(names) if kind in (None, source.kind)]
    findings = [line for source in sources for line in check_agreement(source, tree)]
    findings += [line for source in sources if _asks(source, tree) for line in stale_public(source.number, tree)]
    findings += lacking(tree, names) + ([] if names else orphans(tree) + stale(tree))
    for line in findings:
        say(line)
    say(f"{len(sources)} sources, {len(findings)} differences")
    return 1 if findings else 0
