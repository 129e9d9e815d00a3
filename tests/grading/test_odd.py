"""Honest but odd: none of these notebooks loses a point."""

from __future__ import annotations

from collections.abc import Callable

import nbformat
import pytest
from fakes import standing_of
from grading_helpers import ROOT, exercise, graded, need_sandbox, submission

from course_lib.authoring import solutions
from course_lib.authoring.build import exercise_from
from course_lib.grading.release.released import released_lab
from course_lib.grading.tell.feedback import feedback_page

LAB = "02"
HEAD = "def row_of(u, v, width, height, step):\n"
ROW = "v // step * -(-width // step) + u // step"
PLAIN = f"{HEAD}    return {ROW}\n"


def solved() -> nbformat.NotebookNode:
    return nbformat.reads(submission(LAB, solved=True).decode(), 4)


def first(nb: nbformat.NotebookNode) -> nbformat.NotebookNode:
    return next(cell for cell in nb.cells if cell.id == "task-1")


def code(source: str) -> nbformat.NotebookNode:
    return nbformat.v4.new_code_cell(source)


def at(nb: nbformat.NotebookNode, cell_id: str) -> int:
    return next(i for i, cell in enumerate(nb.cells) if cell.id == cell_id)


def helper_in_another_cell(nb):
    first(
        nb
    ).source = "def row_of(u, v, width, height, step):\n    return offset(v // step, -(-width // step)) + u // step\n"
    nb.cells.insert(
        at(nb, "task-1"), code("from operator import mul\n\n\ndef offset(v, width):\n    return mul(v, width)\n")
    )


def helper_at_the_end(nb):
    first(
        nb
    ).source = "def row_of(u, v, width, height, step):\n    return offset(v // step, -(-width // step)) + u // step\n"
    nb.cells.append(code("SCALE = 1\n\n\ndef offset(v, width):\n    return SCALE * v * width\n"))


def imports_added_to_the_first_cell(nb):
    cell = next(cell for cell in nb.cells if cell.cell_type == "code")
    cell.source += "\nimport operator\n"
    first(
        nb
    ).source = (
        "def row_of(u, v, width, height, step):\n    return operator.add(v // step * -(-width // step), u // step)\n"
    )


def answer_below_the_stub(nb):
    place = at(nb, "task-1")
    nb.cells.insert(place + 1, code(first(nb).source))
    first(nb).source = solutions.stub("02-1")


def answer_at_the_end(nb):
    nb.cells.append(nb.cells.pop(at(nb, "task-1")))


def cells_reversed(nb):
    nb.cells.reverse()


def a_second_try_left_above(nb):
    nb.cells.insert(at(nb, "task-1"), code("def row_of(u, v, width, height, step):\n    return u * height + v\n"))


def plots_and_prints_around(nb):
    first(nb).source = (
        "print('hello', frame)\nplt.figure()\n" + PLAIN + "plt.plot([1, 2])\nplt.show()\nprint(row_of(1, 2, 3, 4, 1))\n"
    )


def magics(nb):
    first(nb).source = "%%time\n" + PLAIN + "!ls\n%matplotlib inline\n"


def line_magics(nb):
    first(nb).source = "%matplotlib inline\n" + PLAIN + "row_of?\n!echo hello\n%timeit row_of(1, 2, 3, 4, 1)\n"


def a_lambda(nb):
    first(nb).source = "row_of = lambda u, v, width, height, step: v // step * -(-width // step) + u // step\n"


def a_partial(nb):
    first(nb).source = (
        "from functools import partial\n\n\ndef general(sign, u, v, width, height, step):\n"
        "    return v // step * -(-width // step) + sign * u // step\n\n\n"
        "row_of = partial(general, 1)\n"
    )


def a_callable_object(nb):
    call = f"    def __call__(self, u, v, width, height, step):\n        return {ROW}\n"
    first(nb).source = f"class Row:\n{call}\n\nrow_of = Row()\n"


def decorated(nb):
    first(nb).source = "from functools import cache\n\n\n@cache\n" + PLAIN


def recursion(nb):
    above = "-(-width // step) + row_of(u, v - step, width, height, step)"
    first(nb).source = f"{HEAD}    return u // step if v == 0 else {above}\n"


def a_failing_statement_above(nb):
    first(nb).source = "row_of(1, 2, 3, 4, 1)\nassert False, 'I will think about it later'\n" + PLAIN + "1 / 0\n"


def an_import_that_is_not_there(nb):
    first(nb).source = "import cv2\nimport open3d as o3d\nfrom scipy import spatial\n" + PLAIN


def type_hints_of_the_course(nb):
    first(nb).source = (
        "from __future__ import annotations\nfrom course_lib.camera.pinhole import PinholeCamera\n\n\n"
        "def row_of(u: int, v: int, width: int, height: int, step: int, camera: PinholeCamera = None) -> int:\n"
        '    """NBVAL_SKIP\n    # NBVAL_SKIP\n    """\n    # NBVAL_RAISES_EXCEPTION\n'
        f"    return {ROW}\n"
    )


def other_names_for_arguments(nb):
    first(nb).source = (
        "def row_of(spalte, zeile, breite, höhe, schritt):\n"
        "    größe = zeile // schritt * -(-breite // schritt)\n    return größe + spalte // schritt\n"
    )


def new_syntax(nb):
    first(nb).source = (
        "def row_of(u, v, width, height, step):\n    match v:\n        case 0:\n            return u // step\n"
        "        case _ if (before := v // step * -(-width // step)) >= 0:\n            return before + u // step\n"
    )


def numpy_numbers(nb):
    first(nb).source = f"{HEAD}    return np.int64(v // step) * np.int64(-(-width // step)) + np.float32(u // step)\n"


def warnings_and_noise(nb):
    first(nb).source = (
        "import sys\nimport warnings\nwarnings.warn('careful')\nprint('x' * 5000, file=sys.stderr)\n"
        + PLAIN
        + "for i in range(200):\n    print(i)\n"
    )


def main_block(nb):
    first(nb).source = PLAIN + "\n\nif __name__ == '__main__':\n    print(row_of(1, 2, 3, 4, 1))\n"


def a_broken_cell_elsewhere(nb):
    nb.cells.insert(1, code("def half_done(:\n    return"))
    nb.cells.append(code("}{"))


def checks_deleted(nb):
    nb.cells = [cell for cell in nb.cells if "check" not in cell.metadata.get("tags", [])]


def everything_else_deleted(nb):
    nb.cells = [cell for cell in nb.cells if cell.id.startswith("task-")]


def another_kernel_name(nb):
    nb.metadata = {"kernelspec": {"name": "conda-env-vision-py", "display_name": "vision", "language": "python"}}


def cells_twice(nb):
    nb.cells += [nbformat.from_dict(cell) for cell in nb.cells]


def a_deep_global(nb):
    first(nb).source = f"WIDTHS = {{}}\n\n\n{HEAD}    WIDTHS[width] = v\n    return {ROW}\n"


ODD: list[Callable] = [
    helper_in_another_cell,
    helper_at_the_end,
    imports_added_to_the_first_cell,
    answer_below_the_stub,
    answer_at_the_end,
    cells_reversed,
    a_second_try_left_above,
    plots_and_prints_around,
    magics,
    line_magics,
    a_lambda,
    a_partial,
    a_callable_object,
    decorated,
    recursion,
    a_failing_statement_above,
    an_import_that_is_not_there,
    type_hints_of_the_course,
    other_names_for_arguments,
    new_syntax,
    numpy_numbers,
    warnings_and_noise,
    main_block,
    a_broken_cell_elsewhere,
    checks_deleted,
    everything_else_deleted,
    another_kernel_name,
    cells_twice,
    a_deep_global,
]


@pytest.fixture(autouse=True)
def _sandbox() -> None:
    need_sandbox()


def full(data: bytes) -> None:
    record = graded(LAB, data)
    assert record["status"] == "graded", record["reason"]
    for one in record["tasks"]:
        wanted = 0.0 if one["kind"] == "explain" else one["max"]
        assert one["points"] == wanted, f"{one['id']}: {one['reason']}: {one['error']}"


@pytest.mark.slow
@pytest.mark.parametrize("change", ODD, ids=lambda change: change.__name__)
def test_loses_no_point(change):
    nb = solved()
    change(nb)
    full(nbformat.writes(nb).encode())


def as_text(nb, source):
    place = at(nb, "task-1")
    cell = nbformat.v4.new_markdown_cell(source or first(nb).source)
    cell.id = first(nb).id
    nb.cells[place] = cell


def beside_the_stub(nb, source):
    nb.cells.insert(
        at(nb, "task-1") + 1, nbformat.v4.new_markdown_cell(f"```python\n{source or first(nb).source}\n```")
    )
    first(nb).source = solutions.stub("02-1")


@pytest.mark.slow
@pytest.mark.parametrize("change", [as_text, beside_the_stub])
@pytest.mark.parametrize("source", ["", solutions.stub("02-1")], ids=["answer", "stub"])
def test_an_answer_in_a_text_cell_waits_for_a_person(change, source):
    nb = solved()
    change(nb, source)
    record = graded(LAB, nbformat.writes(nb).encode())
    [answer] = [one for one in record["tasks"] if one["number"] == 1]
    if source:  # as released it is no answer, wherever it stands
        assert answer["status"] in ("missing", "not started")
    else:
        assert (answer["status"], answer["reason"], answer["points"]) == ("by hand", "text cell", 0.0)
        assert "def row_of" in answer["text"] and "a text cell and is not run" in answer["error"]
        assert "text cell" in [notice["code"] for notice in record["notices"]]
    assert all(
        one["points"] == one["max"] for one in record["tasks"] if one["number"] != 1 and one["kind"] != "explain"
    )


@pytest.mark.slow
def test_an_explanation_in_a_text_cell_waits_for_a_person():
    nb = nbformat.reads(submission("03").decode(), 4)
    words = "A wrong f stretches what lies beside the axis. Measure a table."
    nb.cells.insert(at(nb, "task-6"), nbformat.v4.new_markdown_cell(words))
    record = graded("03", nbformat.writes(nb).encode())
    assert [(one["number"], one["text"]) for one in record["tasks"] if one["reason"] == "text cell"] == [(6, words)]
    untouched = graded("03", submission("03"))
    assert [one["status"] for one in untouched["tasks"]] == ["not started"] * 6


READS = 'import numpy as np\nK = np.load("my_notes.npy")\n\n\ndef metres(depth_mm):\n    return depth_mm / K\n'
ASKS = 'n = int(input("units? "))\n\n\ndef metres(depth_mm):\n    return depth_mm / n\n'
INSIDE = 'def metres(depth_mm):\n    return depth_mm / float(open("my_notes.txt").read())\n'
WITHOUT = 'open("my_notes.txt")\n'
CAUSES = {
    "reads": (READS, 'line 2, `K = np.load("my_notes.npy")`, raised FileNotFoundError', "No file of your own"),
    "asks": (ASKS, 'line 1, `n = int(input("units? "))`, raised StdinNotImplementedError', "Nobody is there to answer"),
    "inside": (INSIDE, "Line 2 of your cell, `return depth_mm / float(open", "No file of your own"),
    "no function": (WITHOUT + "metres = open('x')\n", 'line 1, `open("my_notes.txt")`, raised', "No file of your own"),
}


@pytest.mark.slow
@pytest.mark.parametrize(("source", "line", "why"), CAUSES.values(), ids=CAUSES)
def test_the_line_that_wants_an_own_file_or_an_answer_is_named(source, line, why):
    record = graded("00", submission("00", {1: source}))
    [one] = record["tasks"]
    assert one["status"] == "raised" and line in one["error"] and why in one["error"], one["error"]
    assert "\x1b" not in one["error"] and ".." not in one["error"].replace("...", "")
    page = feedback_page(standing_of(record))
    assert "No file of your own" in page or "Nobody is there" in page  # told, though inputs are not
    assert "It was given" not in page


@pytest.mark.slow
def test_a_line_that_failed_and_cost_nothing_is_not_told():
    [one] = graded("00", submission("00", {1: WITHOUT + "def metres(depth_mm):\n    return depth_mm / 1000\n"}))[
        "tasks"
    ]
    assert (one["points"], "my_notes" in one["error"]) == (1.0, False)


def test_every_exercise_says_beforehand_what_is_not_there_when_it_is_graded():
    for path in sorted((ROOT / "solutions").glob("*.ipynb")):
        given = exercise_from(nbformat.read(path, as_version=4))
        place = next(i for i, cell in enumerate(given.cells) if "task" in cell.metadata.get("tags", []))
        said = "\n".join(cell.source for cell in given.cells[:place])
        assert "No file of your own is there" in said and "answers `input()`" in said


def test_there_are_at_least_fifteen():
    assert len(ODD) >= 15


@pytest.mark.slow
@pytest.mark.parametrize("form", ["no ids", "CRLF", "BOM", "UTF-16", "nbformat 3"])
def test_other_files_of_the_same_notebook(form):
    nb = solved()
    nb.nbformat_minor = 4 if form == "no ids" else nb.nbformat_minor
    for cell in nb.cells:
        if form == "no ids":
            del cell["id"]
        if form == "CRLF":
            cell.source = cell.source.replace("\n", "\r\n")
    if form == "nbformat 3":
        cells = [
            {"cell_type": "code", "input": cell.source, "language": "python", "outputs": [], "metadata": {}}
            for cell in nb.cells
            if cell.cell_type == "code"
        ]
        nb = {"nbformat": 3, "nbformat_minor": 0, "metadata": {}, "worksheets": [{"cells": cells}]}
    import json

    text = json.dumps(nb)
    data = {"BOM": b"\xef\xbb\xbf" + text.encode(), "UTF-16": text.encode("utf-16")}.get(form, text.encode())
    full(data)


def test_the_exercise_has_the_cells_that_these_tests_name():
    assert [slot.cell for slot in released_lab(LAB).slots][0] == "task-1"
    assert any(cell.id == "check-1" for cell in exercise(LAB).cells)
