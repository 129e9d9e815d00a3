"""Building: the same source gives the same bytes; a failure leaves what is stored; --check finds every difference."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from course_lib.authoring import build as building
from course_lib.authoring import kernels
from course_lib.authoring import notebooks as nbs
from course_lib.authoring.gates import findings
from course_lib.authoring.tree import CourseError, Source, Tree

GOOD = Path(__file__).parent / "fixtures" / "tree"


def _build(source: Source, tree: Tree, missing: set[str] | None = None) -> list[Path]:
    return building.build(source, tree, prepare=lambda nb: missing or set())


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    """A copy of the tiny course, its notebooks built."""
    shutil.copytree(GOOD, tmp_path / "course")
    return Tree(tmp_path / "course")


def _bytes(tree: Tree) -> dict[str, bytes]:
    return {tree.relative(path): path.read_bytes() for path in sorted(tree.root.rglob("*.ipynb"))}


def _edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8", newline="\n")


@pytest.mark.slow
def test_two_builds_give_the_same_bytes_and_pass_the_check_and_every_gate(tree: Tree) -> None:
    """The lesson's picture carries an invisible noise that differs in every run, as another renderer's would."""
    stored = _bytes(tree)
    assert [_build(source, tree) for source in tree.sources()] == [[], []]
    assert _bytes(tree) == stored
    for path in tree.root.rglob("*.ipynb"):
        path.unlink()
    made = [tree.relative(path) for source in tree.sources() for path in _build(source, tree)]
    assert made == ["notebooks/01_tiny.ipynb", "solutions/01_tiny.ipynb", "exercises/01_tiny.ipynb"]
    assert [line for source in tree.sources() for line in building.check_agreement(source, tree)] == []
    assert [line for one in tree.sources() for path in one.notebooks for line in findings(path, tree)] == []
    assert all(content.endswith(b"}\n") and b"\r" not in content for content in _bytes(tree).values())
    changed = [name for name, content in _bytes(tree).items() if content != stored[name]]
    assert changed == ["notebooks/01_tiny.ipynb"]  # new noise: the test of the first build had something to keep


def test_an_edit_changes_its_own_cell_and_keeps_the_pictures_of_others(tree: Tree) -> None:
    lesson = tree.lessons()[0]
    before = nbs.read_notebook(lesson.notebook)
    _edit(lesson.path, "area of the disc", "area of this disc")
    assert _build(lesson, tree) == [lesson.notebook]
    after = nbs.read_notebook(lesson.notebook)
    changed = [n for n, (a, b) in enumerate(zip(before.cells, after.cells, strict=True)) if a != b]
    assert changed == [3]
    assert after.cells[3].outputs[0].text == "area of this disc: 707 px²\n"


def test_a_failing_cell_is_shown_and_leaves_what_is_stored(tree: Tree) -> None:
    lesson = tree.lessons()[0]
    _edit(lesson.path, "radius = 15\n", "radius = 15\nradius / 0\n")
    before = _bytes(tree)
    with pytest.raises(CourseError) as failure:
        _build(lesson, tree)
    line = lesson.path.read_text(encoding="utf-8").splitlines().index("radius / 0") + 1
    message = str(failure.value)
    assert message.startswith(f"notebooks/source/01_tiny.py:{line}: ZeroDivisionError: division by zero\n")
    assert "\n  > radius / 0\n" in message
    assert len(message.splitlines()) <= 10
    assert _bytes(tree) == before


@pytest.mark.slow
def test_a_wrong_solution_fails_its_lab(tree: Tree) -> None:
    lab = tree.labs()[0]
    _edit(lab.path, "    return x * x\n", "    return None\n")
    before = _bytes(tree)
    with pytest.raises(CourseError, match="AssertionError"):
        _build(lab, tree)
    assert _bytes(tree) == before


@pytest.mark.slow
def test_a_kernel_that_dies_or_hangs_is_told(tree: Tree) -> None:
    lesson = tree.lessons()[0]
    lesson.path.write_text("# %%\nimport os\nos._exit(3)\n", encoding="utf-8")
    with pytest.raises(CourseError, match="the kernel died in this cell"):
        _build(lesson, tree)
    nb = nbs.read_notebook(lesson.notebook)
    nb.cells = nb.cells[:2]
    nb.cells[1].source = "import time\ntime.sleep(60)"
    with pytest.raises(kernels.CellFailed, match="took longer than 1 s") as failure:
        kernels.execute(nb, tree.root, cell_seconds=1)
    assert failure.value.cell == 1


@pytest.mark.slow
def test_cells_of_missing_real_data_keep_what_is_stored(tree: Tree) -> None:
    lesson = tree.lessons()[0]
    said: list[str] = []
    stored = nbs.read_notebook(lesson.notebook)
    stored.cells[9].outputs[0].text = "as it was where the data are\n"
    nbs.write_notebook(lesson.notebook, stored)
    building.build(lesson, tree, said.append, prepare=lambda nb: {"stanford_bunny"})
    assert nbs.read_notebook(lesson.notebook).cells[9].outputs[0].text == "as it was where the data are\n"
    assert said == ["  1 real-data cells kept as stored: stanford_bunny not there"]
    lesson.notebook.unlink()
    with pytest.raises(CourseError, match="needs stanford_bunny: run `python3 course.py data get stanford_bunny`"):
        _build(lesson, tree, {"stanford_bunny"})


def _drop_last(path: Path) -> None:
    nb = nbs.read_notebook(path)
    nb.cells.pop()
    nbs.write_notebook(path, nb)


def _change_tag(path: Path) -> None:
    nb = nbs.read_notebook(path)
    nb.cells[1].metadata["tags"] = ["other"]
    nbs.write_notebook(path, nb)


def _change_id(path: Path) -> None:
    nb = nbs.read_notebook(path)
    nb.cells[1].id = "another"
    nbs.write_notebook(path, nb)


def _change_text(path: Path) -> None:
    nb = nbs.read_notebook(path)
    nb.cells[1].source += "\n"
    nbs.write_notebook(path, nb)


def _unrun(path: Path) -> None:
    nb = nbs.read_notebook(path)
    nb.cells[1].execution_count = 9
    nbs.write_notebook(path, nb)


def _reformat(path: Path) -> None:
    path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")


def _answer(path: Path) -> None:
    nb = nbs.read_notebook(path)
    nb.cells[3].outputs[0].text = "expected: 7\n"
    nbs.write_notebook(path, nb)


@pytest.mark.parametrize(
    ("kind", "spoil", "says"),
    [
        ("notebooks", Path.unlink, "there is no notebook 01_tiny.ipynb"),
        ("notebooks", _drop_last, "has 10 cells where its source has 11"),
        ("notebooks", _change_tag, "differs in metadata"),
        ("notebooks", _change_id, "differs in id"),
        ("notebooks", _change_text, "differs in source"),
        ("notebooks", _unrun, "was not executed from top to bottom"),
        ("notebooks", _reformat, "is not stored as build stores it"),
        ("exercises", Path.unlink, "there is no notebook 01_tiny.ipynb"),
        ("exercises", _change_text, "differs in source"),
        ("exercises", _answer, "has outputs that are not those of its solution"),
    ],
)
def test_check_finds_it_and_names_the_command(tree: Tree, kind: str, spoil: Callable[[Path], None], says: str) -> None:
    spoil(tree.root / kind / "01_tiny.ipynb")
    said: list[str] = []
    assert building.check_all([], None, tree, said.append) == 1
    assert len(said) == 2, said
    assert said[0].startswith(f"{kind}/01_tiny.ipynb: ")
    assert says in said[0]
    assert said[0].endswith("; mend: python3 course.py build 01_tiny")
    assert said[1] == "2 sources, 1 differences"


def test_check_finds_a_notebook_without_a_source(tree: Tree) -> None:
    shutil.copy(tree.lessons()[0].notebook, tree.lessons_folder / "09_left_over.ipynb")
    assert building.orphans(tree) == [
        "notebooks/09_left_over.ipynb: no source gives this notebook; mend: delete it, or write its source"
    ]


def test_exercise_has_stubs_plans_expected_outputs_and_the_solutions_ids(tree: Tree) -> None:
    lab = tree.labs()[0]
    solution, exercise = nbs.read_notebook(lab.notebook), nbs.read_notebook(lab.exercise)
    assert [cell.id for cell in exercise.cells] == [cell.id for cell in solution.cells]
    kept = [cell for cell in exercise.cells if cell.get("outputs")]
    assert [nbs.cell_tags(cell) for cell in kept] == [["expected"]]
    assert kept[0].outputs[0].text == "expected: 6\n"
    stubs = {cell.id: cell.source for cell in exercise.cells if "task" in nbs.cell_tags(cell)}
    assert list(stubs) == ["task-1", "task-2", "task-3", "task-4"]
    assert "# twice is x + x" in stubs["task-1"]
    assert "return x // 2" in stubs["task-2"]
    assert "# this comment is no plan" not in stubs["task-4"]
    assert 'NotImplementedError("Task 4: Square it")' in stubs["task-4"]
    assert all(cell.execution_count is None for cell in exercise.cells if cell.cell_type == "code")
