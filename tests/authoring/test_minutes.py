"""Minutes are counted as LESSON.md says, from what a reader sees."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from course_lib.authoring import notebooks as nbs
from course_lib.authoring.minutes import counted, lab_minutes, lesson_minutes, minutes_findings, solution_lines
from course_lib.authoring.syntax import logical_lines, tree_of
from course_lib.authoring.tree import Tree

GOOD = Path(__file__).parent / "fixtures" / "tree"
PICTURE, TABLE = {"image/png": "iVBORw0KGgo="}, {"text/html": "<table><tr><td>1</td></tr></table>"}


def _code(source: str, *tags: str, shows: tuple[dict, ...] = ()) -> NotebookNode:
    outputs = [new_output("display_data", data=data) for data in shows]
    return new_code_cell(source, metadata={"tags": list(tags)}, outputs=outputs)


def _lesson(*cells: NotebookNode | str) -> NotebookNode:
    return new_notebook(cells=[new_markdown_cell(cell) if isinstance(cell, str) else cell for cell in cells])


@pytest.mark.parametrize(
    ("cells", "minutes"),
    [
        (["word " * 130], 1.0),
        (["<details><summary>Answer</summary>" + "word " * 130 + "</details>"], 131 / 130),
        (["[word](../a/long/address/of/many/words.md)"], 1 / 130),
        (["![](a.png)"], 1.0),
        (["| a | b |\n|---|---|\n| c | d |"], 1 + 4 / 130),
        (["a | b\n:-- | --:\nc | d"], 1 + 4 / 130),
        (["a\n\n---\n\nb"], 2 / 130),
        ([_code("a = 1\n\n# why\nb = f(\n    a,\n    2,\n)\n")], 0.2),
        ([_code("%matplotlib inline\n!ls\na = 1")], 0.3),
        ([_code('def f():\n    """Two\n    lines."""\n    return 1')], 0.3),
        ([_code("a = 1\nb = 2", "hide-input", shows=(PICTURE, PICTURE, TABLE))], 3.0),
        ([_code("a = 1", shows=(PICTURE,))], 1.1),
        ([_code('guess = predict("How many?", guess=None)')], 1.1),
        ([_code("def predict(question): ...")], 0.1),
        (["## To the lab\n\nword", "## Going further\n\n" + "word " * 1000, _code("a = 1")], 4 / 130),
    ],
)
def test_a_lesson_takes_what_its_reader_reads(cells: list, minutes: float) -> None:
    assert lesson_minutes(_lesson(*cells)) == pytest.approx(minutes)


MEND = """
def f(x):
    # BEGIN SOLUTION
    # a plan
    y = g(
        x,
    )
    return y
    # INSTEAD
    #| return x
    # END SOLUTION
"""


def test_a_lab_takes_the_time_to_write_besides() -> None:
    assert solution_lines(MEND) == 2
    writing = 3 + 2 * 0.5
    stub = 0.1 * 3  # def, raise, and the line to mend
    assert lab_minutes(_lesson(_code(MEND, "task"))) == pytest.approx(writing + stub)
    checked = _code('check("01-1", f)', "check", shows=(TABLE,))  # its card is in the three minutes
    assert lab_minutes(_lesson("word", _code(MEND, "task"), checked)) == pytest.approx(1 / 130 + writing + stub + 0.1)


def test_lines_that_are_no_python_are_counted_as_they_stand() -> None:
    assert logical_lines("a = (1\n\n# no\nb") == [1, 4]
    assert tree_of("a = (1").body == []
    assert logical_lines("%%bash\nls\nls") == [1]


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    """A copy of the tiny course."""
    shutil.copytree(GOOD, tmp_path / "course")
    return Tree(tmp_path / "course")


def _found(tree: Tree) -> list[list[str]]:
    return [list(minutes_findings(source.notebook, source.kind == "lab", tree)) for source in tree.sources()]


def test_minutes_that_are_stated_are_held_against_the_count(tree: Tree) -> None:
    assert _found(tree) == [[], []]
    lesson, lab = (counted(source.notebook, tree) for source in tree.sources())
    facts = tree.root / "notebooks" / "source" / "01_tiny.toml"
    near = facts.read_text(encoding="utf-8")
    facts.write_text(near.replace("minutes = 5", f"minutes = {lesson + 6}", 1), encoding="utf-8")
    assert _found(tree) == [[f"{lesson} minutes for the core; notebooks/source/01_tiny.toml says {lesson + 6}"], []]
    facts.write_text(near.replace("lab_minutes = 20", f"lab_minutes = {lab + 5}"), encoding="utf-8")
    assert _found(tree) == [[], []]
    nb = nbs.read_notebook(tree.lessons()[0].notebook)
    for cell in nb.cells:
        cell.source = cell.source.replace("Minutes: 5.", f"| **Minutes** | 5 for the core, {lab - 6} for the lab |")
    nbs.write_notebook(tree.lessons()[0].notebook, nb)
    assert _found(tree) == [[], [f"{lab} minutes; the lesson's card says {lab - 6}"]]


@pytest.mark.parametrize(("name", "most"), [("00_tiny", 20), ("02_tiny", 60)])
def test_the_first_lesson_is_the_shortest(tree: Tree, name: str, most: int) -> None:
    path = tree.root / "notebooks" / f"{name}.ipynb"
    for extra, found in [(0, []), (1, [f"{most + 1} minutes for the core, more than {most}"])]:
        nbs.write_notebook(path, _lesson("word " * 130 * most + "word " * extra))
        assert list(minutes_findings(path, False, tree)) == found
