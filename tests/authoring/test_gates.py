"""Every gate finds its one spoiled notebook, and nothing in the good ones."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import nbformat
import pytest

from course_lib.authoring import gates, notebooks
from course_lib.authoring.outputs import same_output
from course_lib.authoring.tree import Tree

FIXTURES = Path(__file__).parent / "fixtures"
_spec = importlib.util.spec_from_file_location("make_fixtures", FIXTURES / "make.py")
make = importlib.util.module_from_spec(_spec)
sys.modules["make_fixtures"] = make
_spec.loader.exec_module(make)
SPOILED = [(kind, name) for kind, cases in make.KINDS.items() for name in cases]


@pytest.mark.parametrize("kind", ["notebooks", "solutions", "exercises"])
def test_good_notebook_passes_every_gate(kind: str) -> None:
    tree = Tree(FIXTURES / "tree")
    assert gates.findings(tree.root / kind / "01_tiny.ipynb", tree) == []


@pytest.mark.parametrize(("kind", "name"), SPOILED, ids=[f"{kind}-{name}" for kind, name in SPOILED])
def test_one_thing_is_found_and_nothing_else(kind: str, name: str) -> None:
    tree = Tree(FIXTURES / "spoiled")
    found = gates.findings(tree.root / kind / f"{name}.ipynb", tree)
    assert len(found) == 1, found
    assert found[0].startswith(f"{kind}/{name}.ipynb: ")
    assert make.KINDS[kind][name][1] in found[0]
    assert "\n" not in found[0]


@pytest.mark.parametrize(("kind", "name"), SPOILED, ids=[f"{kind}-{name}" for kind, name in SPOILED])
def test_stored_fixture_is_what_its_maker_makes(kind: str, name: str) -> None:
    stored = notebooks.read_notebook(FIXTURES / "spoiled" / kind / f"{name}.ipynb")
    made = make.spoiled(kind, name)
    assert [cell.source for cell in stored.cells] == [cell.source for cell in made.cells]
    assert [cell.metadata for cell in stored.cells] == [cell.metadata for cell in made.cells]
    assert [len(cell.get("outputs", [])) for cell in stored.cells] == [len(c.get("outputs", [])) for c in made.cells]
    for a, b in zip(stored.cells, made.cells, strict=True):
        broken = name == "01_broken_picture" and a.cell_type == "code"
        assert a.cell_type != "code" or broken or all(map(same_output, a.outputs, b.outputs))


def test_file_that_is_no_notebook_is_one_finding() -> None:
    tree = Tree(FIXTURES / "spoiled")
    found = gates.findings(tree.root / "notebooks" / "01_not_a_notebook.ipynb", tree)
    assert len(found) == 1
    assert "not a valid notebook" in found[0]


def test_notebook_over_its_size_is_found(tmp_path: Path) -> None:
    tree = Tree(tmp_path)
    path = tmp_path / "notebooks" / "01_tiny.ipynb"
    nb = notebooks.read_notebook(FIXTURES / "tree" / "notebooks" / "01_tiny.ipynb")
    nb.cells[make.AREA].outputs[0].text = "a number\n" * 200_000
    notebooks.write_notebook(path, nb)
    assert any(" MB, more than 1.2 MB" in line for line in gates.findings(path, tree))


def test_a_cell_may_say_why_it_keeps_a_time_or_a_number() -> None:
    tree = Tree(FIXTURES / "spoiled")
    folder = tree.root / "notebooks"
    timed = notebooks.read_notebook(folder / "01_stored_timing.ipynb")
    checked = gates.Checked(timed, folder / "01_stored_timing.ipynb", "lesson", tree)
    assert len(list(gates.noise(checked))) == 1
    timed.cells[make.AREA].source += "\n# allow timing: the exposure that the camera was set to"
    assert list(gates.noise(checked)) == []
    typed = notebooks.read_notebook(folder / "01_typed_number.ipynb")
    checked = gates.Checked(typed, folder / "01_typed_number.ipynb", "lesson", tree)
    assert len(list(gates.typed_numbers(checked))) == 1
    for cell in typed.cells:
        cell.source += "<!-- allow typed number: from the data sheet -->" if cell.cell_type == "markdown" else ""
    assert list(gates.typed_numbers(checked)) == []


@pytest.mark.parametrize(
    "harmless",
    [
        "| 12.4 mm | a table |",
        "`12.4 mm`",
        "$12.4$ mm",
        "> The report says 12.4 mm.",
        "1.5 m away, 640x480, 100 %, 0.05 m, 1000 mm, 360°",
        "up to 4.25 m²",
    ],
)
def test_numbers_that_are_no_results_may_stand_in_prose(harmless: str) -> None:
    tree = Tree(FIXTURES / "tree")
    path = tree.root / "notebooks" / "01_tiny.ipynb"
    nb = notebooks.read_notebook(path)
    nb.cells[-1].source += f"\n\n{harmless}"
    assert list(gates.typed_numbers(gates.Checked(nb, path, "lesson", tree))) == []


def test_every_gate_has_a_fixture_that_it_alone_finds() -> None:
    tree = Tree(FIXTURES / "spoiled")
    busy = set()
    for kind, name in SPOILED:
        path = tree.root / kind / f"{name}.ipynb"
        checked = gates.Checked(notebooks.read_notebook(path), path, gates.kind_of(path, tree), tree)
        busy |= {gate.__name__ for gate in gates.GATES if any(gate(checked))}
    assert busy == {gate.__name__ for gate in gates.GATES} - {"size"}


@pytest.mark.parametrize(
    ("draws", "found"), [("rng.random()", 1), ("own.random()  # not rng", 0), ("rng.random()\nrng = 3", 0)]
)
def test_cells_that_need_data_draw_from_no_generator_of_others(draws: str, found: int) -> None:
    """Where the data are not here, they do not run, and whatever is drawn later would be other numbers."""
    cell = nbformat.v4.new_code_cell(f"# real data: tum_pair\nx = {draws}")
    cell.metadata["tags"] = ["real-data"]
    tree = Tree(FIXTURES / "tree")
    nb = nbformat.v4.new_notebook(cells=[cell])
    lines = list(gates.real_data(gates.Checked(nb, tree.root / "notebooks" / "01_tiny.ipynb", "notebooks", tree)))
    assert len(lines) == found and all("it draws from rng" in line for line in lines)
