"""The frame of a lesson and of a lab: which parts, in which order, and how many of each."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from nbformat import NotebookNode

from . import notebooks as nbs
from .parts import END, Part, core_of, parts_of
from .predictions import ASKED, FOLDED

MOST_CODE_CELLS, MOST_SECTIONS, MOST_TERMS, MOST_KEY_POINTS = 25, 5, 3, 5
START_CODE_CELLS, START_TERMS = 8, 6  # lesson 00
FEWEST_TASKS, MOST_TASKS, FEWEST_HINTS = 4, 6, 2

CORE = ("Report against reality", "Break it", "On real data", "Key points", "Your own camera", END)
FULL = ("Card", "sections", *CORE, "Going further")
START = ("Card", "sections", "Key points", END)  # lesson 00

_FENCE = re.compile(r"```.*?```", re.S)
_CONCEPT = re.compile(r"<summary>(?:(?!</summary>).)*\b(?:answer|vote)\b", re.I | re.S)
_REPORT = re.compile(r"(?<!def )\breport(?:_table)?\(")
_HINT = re.compile(r"<summary>\s*Hint\s+(\d+)\s*:\s*(\w+)", re.I)


def _terms(prose: str) -> list[str]:
    """The terms that a text defines: what stands in bold and is no sentence, folded answers left aside."""
    text = re.sub(r"<details.*?</details>", "", _FENCE.sub("", prose), flags=re.S)
    found = [term.strip() for term in re.findall(r"\*\*([^*\n]+(?:\n[^*\n]+)?)\*\*", text)]
    return list(dict.fromkeys(term.lower() for term in found if len(term.split()) <= 5 and term[-1] not in ".?!:"))


def _title(parts: list[Part], wanted: str) -> Iterator[str]:
    if not re.fullmatch(rf"# {wanted}\s+\S.*", parts[0].heading if parts else ""):
        yield f"it must start with the heading `# {wanted} Title`"


def _order(parts: list[Part], wanted: Sequence[str]) -> Iterator[str]:
    """Which headings of a frame are missing or out of order, and, where it is the full one, unknown."""
    names = [part.heading for part in parts[1:]]
    sections = [part.number for part in parts if part.number is not None]
    present = ["sections" if part.number is not None else part.heading for part in parts[1:]]
    present = [name for n, name in enumerate(present) if n == 0 or name != "sections" or present[n - 1] != "sections"]
    yield from (f"the part `## {name}` is missing" for name in wanted if name not in present)
    if wanted == FULL:
        unknown = dict.fromkeys(name for name in present if name not in wanted)
        yield from (f"`## {name}` is no part of a lesson's frame" for name in unknown)
    known = [name for name in present if name in wanted]
    if known != sorted(known, key=wanted.index) or len(set(known)) != len(known):
        yield f"its parts are out of order: {', '.join(names)}"
    if sections != list(range(1, len(sections) + 1)):
        yield f"its sections are numbered {sections}"


def _start_content(core: list[Part]) -> Iterator[str]:
    """Lesson 00 has tighter limits."""
    cells = sum(len(part.code) for part in core)
    if cells > START_CODE_CELLS:
        yield f"{cells} code cells, more than {START_CODE_CELLS}"
    terms = list(dict.fromkeys(term for part in core if part.number is not None for term in _terms(part.prose)))
    if len(terms) > START_TERMS:
        yield f"{len(terms)} new words, more than {START_TERMS}: {', '.join(terms)}"


def _content(core: list[Part]) -> Iterator[str]:
    """What every full lesson asks of its reader, and its limits."""
    cells = [cell for part in core for cell in part.code]
    counted = [cell for cell in cells if not set(nbs.cell_tags(cell)) >= FOLDED]  # a question and its answer are one
    if len(counted) > MOST_CODE_CELLS:
        yield f"{len(counted)} code cells in the core, more than {MOST_CODE_CELLS}"
    numbered = [part for part in core if part.number is not None]
    if len(numbered) > MOST_SECTIONS:
        yield f"{len(numbered)} sections, more than {MOST_SECTIONS}"
    for part in numbered:
        terms = _terms(part.prose)
        if len(terms) > MOST_TERMS:
            which = ", ".join(terms)
            yield f"section {part.number} has {len(terms)} new terms, more than {MOST_TERMS}: {which}"
    if not any(ASKED.search(cell.source) for cell in cells):
        yield "no predict(...) prompt in the core"
    after_card = [part for part in core[1:] if part.heading != "Card"]
    if not any(_CONCEPT.search(part.prose) for part in after_card):
        yield "no concept question (choices, and a folded answer whose summary says Vote or Answer)"
    if not any(_REPORT.search(cell.source) for part in numbered for cell in part.code):
        yield "no report(...) number in its sections"


def lesson_frame(nb: NotebookNode, name: str) -> Iterator[str]:
    """What a lesson lacks or has too much of, one line each.

    Parameters
    ----------
    nb : the executed lesson.
    name : its name, for example 03_depth_to_points; 00 has its own, shorter frame.
    """
    parts = parts_of(nb)
    core = core_of(parts)
    yield from _title(parts, name[:2])
    if not parts[0].figures:
        yield "no picture between its title and its card"
    if name[:2] == "00":
        yield from _order(parts, START)
        yield from _start_content(core)
    else:
        yield from _order(parts, FULL)
        yield from _content(core)
    for part in core:
        before, *_ = re.split(r"words to know", part.prose, maxsplit=1, flags=re.I)
        points = len(re.findall(r"^(?:[-*+]|\d+[.)])\s", before, flags=re.M))
        if part.heading == "Key points" and points > MOST_KEY_POINTS:
            yield f"{points} key points, more than {MOST_KEY_POINTS}"


def _task_findings(part: Part, number: int, lab: str, exercise: bool) -> Iterator[str]:
    heading = nbs.task_heading(f"## {part.heading}")
    if heading is None:
        yield f"`## {part.heading}` must read `## Task N — title (P points)`"
        return
    if heading.number != number:
        yield f"task {heading.number} stands where task {number} belongs"
    task = [cell for cell in part.code if "task" in nbs.cell_tags(cell)]
    checks = [n for n, cell in enumerate(part.code) if "check" in nbs.cell_tags(cell)]
    if len(task) != 1:
        yield f"task {heading.number} has {len(task)} cells tagged task, not one"
    if len(checks) != 1:
        yield f"task {heading.number} has {len(checks)} cells tagged check, not one"
    elif f'check("{lab}-{heading.number}"' not in part.code[checks[0]].source:
        yield f'the check of task {heading.number} must call check("{lab}-{heading.number}", …)'
    elif task and part.code.index(task[0]) > checks[0]:
        yield f"the check of task {heading.number} stands before its cell"
    hints = [int(hint) for hint, _ in _HINT.findall(part.prose)]
    if len(hints) < FEWEST_HINTS:
        yield f"task {heading.number} has {len(hints)} hints, fewer than {FEWEST_HINTS}"
    if hints != list(range(1, len(hints) + 1)):
        yield f"the hints of task {heading.number} are numbered {hints}"
    for cell in task if exercise else ():
        if f'NotImplementedError("Task {heading.number}:' not in cell.source:
            yield f"the stub of task {heading.number} does not raise its NotImplementedError"
        if re.search(r"#\s*(?:BEGIN SOLUTION|END SOLUTION|INSTEAD)\b|#\|", cell.source):
            yield f"the stub of task {heading.number} still holds markers of its solution"


def lab_frame(nb: NotebookNode, name: str, exercise: bool) -> Iterator[str]:
    """What a lab's solution or exercise lacks or has too much of, one line each."""
    parts = parts_of(nb)
    lab = name[:2]
    yield from _title(parts, f"Lab {lab}")
    tasks = [part for part in parts if re.match(r"Task\b", part.heading)]
    if lab != "00" and not FEWEST_TASKS <= len(tasks) <= MOST_TASKS:
        yield f"{len(tasks)} tasks: a lab has {FEWEST_TASKS} to {MOST_TASKS}"
    for number, part in enumerate(tasks, start=1):
        yield from _task_findings(part, number, lab, exercise)
    elsewhere = [cell for part in parts if part not in tasks for cell in part.code]
    stray = [cell for cell in elsewhere if {"task", "check"} & set(nbs.cell_tags(cell))]
    if stray:
        yield f"{len(stray)} task or check cells stand under no task's heading"
