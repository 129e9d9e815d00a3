"""What a stored notebook must satisfy: each gate returns findings, one line each, and never executes anything."""

from __future__ import annotations

import ast
import html
import re
from collections.abc import Iterator
from pathlib import Path

from nbformat import NotebookNode

from course_lib.notebook._cells import real_datasets

from . import notebooks as nbs
from .checked import Checked, Kind, allowed
from .choice_keys import told_keys
from .frame import lab_frame, lesson_frame
from .lab_keys import told_lines
from .links import images_without_alt
from .minutes import minutes_findings
from .one_meaning import second_meanings
from .outputs import decode_png
from .pictures import what_is_empty
from .predictions import gives_away
from .prose_gates import links, typed_numbers, words
from .tree import CourseError, Tree

MOST_BYTES = 1_200_000
MOST_COLUMNS = 80  # of code

_PATH = re.compile(r"(?<![\w.:/~-])/(?:home|root|work|tmp|Users|mnt|var/folders)/|\b[A-Za-z]:\\+Users\\")
_TIMING = re.compile(
    r"\b\d+(?:\.\d+)?\s?(?:ns|µs|μs|us|ms)\b"
    r"|\b(?:took|elapsed|within|after)\W+\d+(?:\.\d+)?\s?(?:s|sec|seconds?|minutes?)\b"
    r"|\b(?:Wall time|CPU times)\b|\bper loop\b"
)
_CLOCK = re.compile(r"^\s*%{1,2}time(?:it)?\b", re.M)
_ADDRESS = re.compile(r"\bat 0x[0-9a-fA-F]{6,}")
_NBVAL = re.compile(r"^\s*#+\s*(?:NBVAL_\w+|PYTEST_VALIDATE_IGNORE_OUTPUT)\s*$", re.M)


def _texts(cell: NotebookNode) -> Iterator[str]:
    """Every stored text of a code cell's outputs."""
    for output in cell.outputs:
        if output.output_type == "stream":
            yield output.text
        elif output.output_type == "error":
            yield "\n".join([output.ename, output.evalue, *output.traceback])
        else:
            texts = (value for key, value in output.data.items() if key.startswith("text/"))
            yield from (text for text in texts if isinstance(text, str))
            alts = (about.get("alt") for about in output.metadata.values() if isinstance(about, dict))
            yield from (alt for alt in alts if isinstance(alt, str))


def pictures(checked: Checked) -> Iterator[str]:
    """A picture that shows nothing."""
    for n, cell in checked.code():
        for output in cell.outputs:
            for kind in ("image/png", "image/jpeg"):
                if kind in output.get("data", {}):
                    try:
                        lacks = what_is_empty(decode_png(output.data[kind]))
                    except ValueError as error:
                        lacks = str(error)
                    if lacks:
                        yield checked.at(n, lacks)


def _literals(source: str) -> set[str]:
    """Every text that stands whole in a cell's code."""
    try:
        nodes = ast.walk(ast.parse(re.sub(r"^\s*[%!].*$", "pass", source, flags=re.M)))
    except SyntaxError:
        return set(re.findall(r"[\"']([^\"'\n]+)[\"']", source))
    return {node.value.strip() for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def alt_texts(checked: Checked) -> Iterator[str]:
    """A picture without a description, or with one in which nothing was computed."""
    for n, cell in checked.code():
        shown = [output.data["text/html"] for output in cell.outputs if "text/html" in output.get("data", {})]
        folded = [text for text in shown if text.startswith("<details")]
        for output in cell.outputs:
            for kind in output.get("data", {}):
                if not kind.startswith("image/"):
                    continue
                about = output.metadata.get(kind, {})
                alt = about.get("alt", "") if isinstance(about, dict) else ""
                if not alt.strip():
                    yield checked.at(n, "its picture has no alt text: return show(...) or picture(fig, alt)")
                elif not re.search(r"\d", alt):
                    yield checked.at(n, f"its alt text has no number: {alt[:60]!r}")
                elif alt.strip() in _literals(cell.source):
                    yield checked.at(n, f"its alt text is typed, not computed: {alt[:60]!r}")
                elif not any(html.escape(alt) in text for text in folded):
                    yield checked.at(n, "its picture has no folded line that says it in words: build it again")
        bare = images_without_alt("\n".join(shown))
        yield from (checked.at(n, f"its HTML has an image without alt text: {image}") for image in bare)
    for n, cell in checked.prose():
        yield from (checked.at(n, f"image without alt text: {image}") for image in images_without_alt(cell.source))


def noise(checked: Checked) -> list[str]:
    """Stored output that is not the lesson's: stderr, addresses in memory, timings, widgets."""
    found = []
    for n, cell in checked.code():
        for output in cell.outputs:
            if output.output_type == "stream" and output.name == "stderr":
                found.append(checked.at(n, f"stored stderr: {output.text.strip()[:80]!r}"))
            if any("widget" in kind for kind in output.get("data", {})):
                found.append(checked.at(n, "a widget is stored, which shows nothing in a saved notebook"))
        if _CLOCK.search(cell.source):
            found.append(checked.at(n, "it times itself: cost belongs into `course bench`"))
        for text in _texts(cell):
            if match := _ADDRESS.search(text):
                found.append(checked.at(n, f"a memory address is stored: {match[0]}"))
            if (match := _TIMING.search(text)) and not allowed(cell, "timing"):
                found.append(checked.at(n, f"a timing is stored: {match[0]!r}"))
    return list(dict.fromkeys(found))


def paths(checked: Checked) -> Iterator[str]:
    """A path of the machine that built it."""
    own = [re.escape(place) for place in (str(checked.tree.root.resolve()), str(Path.home())) if len(place) > 5]
    absolute = re.compile("|".join([_PATH.pattern, *own]))
    for n, cell in enumerate(checked.nb.cells):
        texts = [cell.source, *(_texts(cell) if cell.cell_type == "code" else ())]
        match = next(filter(None, map(absolute.search, texts)), None)
        if match:
            yield checked.at(n, f"an absolute path: {match.string[match.start() :][:40].split()[0]}")


def errors(checked: Checked) -> Iterator[str]:
    """An error that is not declared, or a declared one that does not come."""
    for n, cell in checked.code():
        raised = [output.ename for output in cell.outputs if output.output_type == "error"]
        declared = "raises-exception" in nbs.cell_tags(cell)
        if raised and not declared:
            yield checked.at(n, f"it ends in {raised[0]} and is not tagged raises-exception")
        if declared and not raised and checked.kind != "exercise":
            yield checked.at(n, "it is tagged raises-exception and raises nothing")


def size(checked: Checked) -> Iterator[str]:
    """Too big a file."""
    stored = checked.path.stat().st_size
    if stored > MOST_BYTES:
        yield f"{checked.name}: {stored / 1e6:.2f} MB, more than 1.2 MB"


def stable(checked: Checked) -> Iterator[str]:
    """What JupyterLab would write otherwise: a notebook that is opened and saved stays as it is."""
    if checked.path.read_bytes() != nbs.as_bytes(checked.nb):
        yield f"{checked.name}: it is not stored as build stores it"
    if "version" in checked.nb.metadata.get("language_info", {}):
        yield f"{checked.name}: it names the version of the Python that ran it"
    for n, cell in checked.code():
        hidden = cell.metadata.get("jupyter", {}).get("outputs_hidden", False)
        if hidden != cell.metadata.get("collapsed", False):
            yield checked.at(n, "collapsed and jupyter.outputs_hidden must both be there, or neither")
        empty = [name for name in ("collapsed", "jupyter", "tags") if name in cell.metadata and not cell.metadata[name]]
        if empty or "execution" in cell.metadata or "trusted" in cell.metadata:
            yield checked.at(n, f"its metadata hold what a build does not write: {', '.join(sorted(cell.metadata))}")


def executed(checked: Checked) -> Iterator[str]:
    """A cell that nbval would pass over: never run, or told not to be compared."""
    for n, cell in checked.code():
        if checked.kind != "exercise" and cell.execution_count is None:
            yield checked.at(n, "it was never executed")
        if checked.kind == "exercise" and cell.outputs and "expected" not in nbs.cell_tags(cell):
            yield checked.at(n, "an exercise keeps outputs only in cells tagged expected")
        hidden = [tag for tag in nbs.cell_tags(cell) if tag.startswith("nbval")]
        if _NBVAL.search(cell.source) or hidden:
            yield checked.at(n, "it tells nbval not to compare it")


def real_data(checked: Checked) -> Iterator[str]:
    """The tag real-data without the line that names the datasets, or the line without the tag."""
    for n, cell in checked.code():
        names, tagged = real_datasets(cell.source), "real-data" in nbs.cell_tags(cell)
        if tagged and not names:
            yield checked.at(n, "it is tagged real-data: its first line must be `# real data: NAME`")
        if names and not tagged:
            yield checked.at(n, f"it needs {', '.join(names)}: tag it real-data")
        code = re.sub(r"#.*", "", cell.source)
        if tagged and re.search(r"\brng\b", code) and not re.search(r"^\s*rng = ", code, re.M):
            yield checked.at(n, "it draws from rng, which later cells draw from: without its data these would differ")


def wide_lines(checked: Checked) -> Iterator[str]:
    """Code that a projector at 150 % cuts off; of an exercise only what differs from its solution: the stubs."""
    for n, cell in checked.code():
        if checked.kind == "exercise" and "task" not in nbs.cell_tags(cell):
            continue
        lines = enumerate(cell.source.splitlines(), start=1)
        wide = [f"line {number} ({len(line)})" for number, line in lines if len(line) > MOST_COLUMNS]
        if wide:
            yield checked.at(n, f"{len(wide)} of its lines over {MOST_COLUMNS} characters: {', '.join(wide)}")


def one_meaning(checked: Checked) -> Iterator[str]:
    """A name that a later section gives another meaning."""
    if checked.kind != "exercise":
        yield from (checked.at(n, line) for n, line in second_meanings(checked.nb))


def lab_keys(checked: Checked) -> Iterator[str]:
    """What a lab tells of its answers outside them; the exercise is made of the same cells."""
    if checked.kind == "solution":
        told = (*told_lines(checked.nb), *told_keys(checked.nb))
        yield from (checked.at(n, line) for n, line in told)


def predictions(checked: Checked) -> Iterator[str]:
    """A prediction that gives itself away."""
    if checked.kind == "lesson":
        yield from (checked.at(n, line) for n, line in gives_away(checked.nb.cells))


def frame(checked: Checked) -> Iterator[str]:
    """A lesson or lab without a part of its frame, or with too much of one."""
    nb, name, kind = checked.nb, checked.path.stem, checked.kind
    lines = lesson_frame(nb, name) if kind == "lesson" else lab_frame(nb, name, kind == "exercise")
    return (f"{checked.name}: {line}" for line in lines)


def minutes(checked: Checked) -> Iterator[str]:
    """More minutes than a lesson or lab may take, or other minutes than are stated."""
    if checked.kind != "exercise":
        lines = minutes_findings(checked.path, checked.kind == "solution", checked.tree)
        yield from (f"{checked.name}: {line}" for line in lines)


GATES = (
    *(pictures, alt_texts, noise, paths, errors, size, stable, executed, real_data, links, typed_numbers, words),
    *(predictions, frame, minutes, wide_lines, one_meaning, lab_keys),
)


def kind_of(path: Path, tree: Tree) -> Kind:
    """What a notebook is, by the folder that it lies in."""
    folders: dict[Path, Kind] = {tree.solutions_folder: "solution", tree.exercises_folder: "exercise"}
    return next((kind for folder, kind in folders.items() if path.parent.resolve() == folder.resolve()), "lesson")


def findings(path: Path, tree: Tree) -> list[str]:
    """Everything that is wrong with a stored notebook, one line each."""
    try:
        nb = nbs.read_notebook(path)
    except CourseError as error:
        return [f"{tree.relative(path)}: {error}"]
    checked = Checked(nb, path, kind_of(path, tree), tree)
    return [line for gate in GATES for line in gate(checked)]
