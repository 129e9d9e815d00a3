"""Honest but odd: none of these notebooks loses a point."""

from __future__ import annotations

from collections.abc import Callable

import nbformat
import pytest
from grading_helpers import exercise, graded, need_sandbox, submission

from course_lib.authoring import solutions
from course_lib.grading.release.released import released_lab

LAB = "02"
PLAIN = "def row_of(u, v, width, height, step):\n    return -(-width // step) * (v // step) + u // step\n"


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
    first(nb).source = "row_of = lambda u, v, width, height, step: -(-width // step) * (v // step) + u // step\n"


def a_partial(nb):
    first(nb).source = (
        "from functools import partial\n\n\ndef general(sign, u, v, width, height, step):\n"
        "    return v // step * -(-width // step) + sign * (u // step)\n\n\n"
        "row_of = partial(general, 1)\n"
    )


def a_callable_object(nb):
    first(nb).source = (
        "class Row:\n    def __call__(self, u, v, width, height, step):\n"
        "        return -(-width // step) * (v // step) + u // step\n\n\nrow_of = Row()\n"
    )


def decorated(nb):
    first(nb).source = "from functools import cache\n\n\n@cache\n" + PLAIN


def recursion(nb):
    first(nb).source = (
        "def row_of(u, v, width, height, step):\n"
        "    return u // step if v == 0 else -(-width // step) + row_of(u, v - step, width, height, step)\n"
    )


def a_failing_statement_above(nb):
    first(nb).source = "row_of(1, 2, 3, 4, 1)\nassert False, 'I will think about it later'\n" + PLAIN + "1 / 0\n"


def an_import_that_is_not_there(nb):
    first(nb).source = "import cv2\nimport open3d as o3d\nfrom scipy import spatial\n" + PLAIN


def type_hints_of_the_course(nb):
    first(nb).source = (
        "from __future__ import annotations\nfrom course_lib.camera.pinhole import PinholeCamera\n\n\n"
        "def row_of(u: int, v: int, width: int, height: int, step: int, camera: PinholeCamera = None) -> int:\n"
        '    """NBVAL_SKIP\n    # NBVAL_SKIP\n    """\n    # NBVAL_RAISES_EXCEPTION\n'
        "    return -(-width // step) * (v // step) + u // step\n"
    )


def other_names_for_arguments(nb):
    first(nb).source = (
        "def row_of(spalte, zeile, breite, höhe, schritt):\n"
        "    größe = zeile // schritt * -(-breite // schritt)\n    return größe + spalte // schritt\n"
    )


def new_syntax(nb):
    first(nb).source = (
        "def row_of(u, v, width, height, step):\n    match v:\n        case 0:\n            return u // step\n"
        "        case _ if (before := -(-width // step) * (v // step)) >= 0:\n            return before + u // step\n"
    )


def numpy_numbers(nb):
    first(nb).source = (
        "def row_of(u, v, width, height, step):\n"
        "    return np.int64(v // step) * np.int64(-(-width // step)) + np.float32(u // step)\n"
    )


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
    first(nb).source = (
        "WIDTHS = {}\n\n\ndef row_of(u, v, width, height, step):\n    WIDTHS[width] = v\n"
        "    return -(-width // step) * (v // step) + u // step\n"
    )


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
