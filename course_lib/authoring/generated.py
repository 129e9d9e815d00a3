"""The parts of pages that follow from files: rows between two markers, `<!-- name -->` and `<!-- /name -->`.

In the source of a notebook, rows and markers are comments; the stored notebook gets the same rows without being run.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from textwrap import indent

from course_lib.notebook import _catalog
from course_lib.notebook.lessons import lessons

from . import notebooks as nbs
from .minutes import WHAT_IS_COUNTED, counted
from .public_answers import table
from .tree import CourseError, Tree

_WORD = re.compile(r"((?:<a id=\"[^\"]+\"></a>)+)\*\*([^*]+)\*\* — .+")


COUNTED = f"Minutes are counted: {WHAT_IS_COUNTED}."


def _minutes(tree: Tree) -> dict[str, tuple[str, str]]:
    """For each lesson what it and its lab count, as stored; nothing where they are not built yet."""

    def one(path: Path) -> str:
        return str(counted(path, tree)) if path.is_file() else ""

    labs = {source.name: one(source.notebook) for source in tree.labs()}
    return {source.name: (one(source.notebook), labs.get(source.name, "")) for source in tree.lessons()}


def _lessons(tree: Tree) -> str:
    """README's course map."""
    rows = ["| Lesson | What you can do after it | Lesson, minutes | Lab, minutes |", "|---|---|---|---|"]
    there = _minutes(tree)
    for one in lessons(tree.lessons_folder / "source"):
        title = f"{one.number} {one.title}"
        if one.name in there:
            rows.append(f"| [{title}](notebooks/{one.name}.ipynb) | {one.does} | {' | '.join(there[one.name])} |")
        else:
            rows.append(f"| {title} | *to come* | | |")
    return "\n".join([*rows, "", COUNTED])


def _map(tree: Tree) -> str:
    """Lesson 00's map of the course, every lesson and lab a link."""
    rows = ["| Lesson | Lab | Minutes, lesson + lab | You will be able to |", "|---|---|---|---|"]
    there = _minutes(tree)
    for one in lessons(tree.lessons_folder / "source"):
        title, does = f"{one.number} {one.title}", one.does or "*to come*"
        if one.name in there:
            lab = f"[lab](../exercises/{one.name}.ipynb)"
            minutes = " + ".join(filter(None, there[one.name]))
            rows.append(f"| [{title}]({one.name}.ipynb) | {lab} | {minutes} | {does} |")
        else:
            rows.append(f"| {title} | | | {does} |")
    return "\n".join(rows)


def _words(tree: Tree) -> str:
    """The glossary, from docs/glossary/NN_name.md; each word with the lesson that defines it."""
    there = {source.name for source in tree.lessons()}
    found: list[tuple[str, str]] = []
    for path in sorted((tree.docs_folder / "glossary").glob("[0-9][0-9]_*.md")):
        number = path.stem[:2]
        lesson = f"[{number}](../notebooks/{path.stem}.ipynb)" if path.stem in there else number
        for entry in path.read_text(encoding="utf-8").strip().split("\n\n"):
            match = _WORD.fullmatch(entry)
            if match is None:
                form = '<a id="word"></a>**Word** — meaning'
                raise CourseError(f"{tree.relative(path)}: an entry reads {form}, and not {entry!r:.60}.")
            found.append((match[2].lower(), f"{entry} *(lesson {lesson})*"))
    return "\n\n".join(entry for _, entry in sorted(found))


def _notes(tree: Tree) -> str:
    """The instructor's notes, lesson by lesson, with the minutes of somebody who works alone."""
    rows, there = [], _minutes(tree)
    for path in sorted((tree.solutions_folder / "notes").glob("[0-9][0-9]_*.md")):
        title = path.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ")
        lesson, lab = there.get(path.stem, ("", ""))
        rows.append(f"- [{title}](notes/{path.name}): {lesson} minutes alone, and {lab} for the lab")
    return "\n".join([*rows, "", COUNTED])


def _datasets(tree: Tree) -> str:
    """The table of datasets."""
    rows = ["| name | kind | what it is |", "|---|---|---|"]
    rows += [f"| [{e.name}]({e.name}.md) | {e.kind} | {e.title} |" for e in _catalog.catalogue().values()]
    return "\n".join(rows)


START = "notebooks/source/00_start_here.py"
PAGES: dict[str, tuple[str, Callable[[Tree], str]]] = {
    "README.md": ("lessons", _lessons),
    START: ("map", _map),
    "docs/glossary.md": ("words", _words),
    "solutions/README.md": ("notes", _notes),
    "datasets/README.md": ("datasets", _datasets),
    "docs/checks.md": ("checks", table),
}


def margin(name: str) -> str:
    """What stands before each line of a page's rows."""
    return "# " if name.endswith(".py") else ""


def _pages(tree: Tree) -> list[tuple[Path, str, str]]:
    """Each page that has rows, as it stands and as it should stand."""
    found = []
    for name, (marker, rows) in PAGES.items():
        path = tree.root / name
        if not path.is_file():
            continue
        text = path.read_text(encoding="utf-8")
        mark = margin(name)
        parts = re.split(rf"(?<=\n{mark}<!-- {marker} -->\n).*?(?={mark}<!-- /{marker} -->)", text, flags=re.S)
        if len(parts) != 2:
            raise CourseError(f"{name}: it needs the lines <!-- {marker} --> and <!-- /{marker} -->, once each.")
        found.append((path, text, f"{parts[0]}{indent(rows(tree), mark)}\n{parts[1]}"))
    return found


def write_generated(tree: Tree) -> list[Path]:
    """Write what follows from files into its pages, and return those that changed.

    Raises
    ------
    CourseError
        If a page has lost a marker, or a file has not the form that is wanted.
    """
    found: list[Path] = []
    while changed := [(path, new) for path, old, new in _pages(tree) if old != new]:  # rows of the map are counted, too
        for path, new in changed:
            path.write_text(new, encoding="utf-8", newline="\n")
        written = [path for path, _ in changed]
        found += written + _prose_into_notebooks(tree, written)
    return list(dict.fromkeys(found))


def _prose_into_notebooks(tree: Tree, written: list[Path]) -> list[Path]:
    """Give the stored notebooks of changed sources the new prose, where nothing else differs; return those changed."""
    found = []
    for source in tree.lessons():
        if source.path in written and source.notebook.exists():
            stored, wanted = nbs.read_notebook(source.notebook), nbs.read_source(source.path)
            if [cell.id for cell in stored.cells] == [cell.id for cell in wanted.cells]:
                for cell, new in zip(stored.cells, wanted.cells, strict=True):
                    cell.source = new.source
                found += [source.notebook] if nbs.write_notebook(source.notebook, stored) else []
    return found


def stale(tree: Tree) -> list[str]:
    """One line for each page that is not what its files give."""
    old = [path for path, stands, wanted in _pages(tree) if stands != wanted]
    return [f"{tree.relative(path)}: its rows are old; mend: python3 course.py build" for path in old]
