"""Every stored notebook passes every gate, is what its source gives, and every exercise waits for its learner."""

from __future__ import annotations

from pathlib import Path

import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell
from stored import QUICK, TREE, notebooks, sources
from untouched_exercise import stub_findings

from course_lib.authoring import notebooks as nbs
from course_lib.authoring.build import check_agreement, orphans
from course_lib.authoring.gates import findings
from course_lib.authoring.kernels import execute
from course_lib.authoring.needed_data import prepare_data
from course_lib.authoring.tree import Source

LABS = [source for source in sources() if source.exercise]


@pytest.mark.parametrize("path", notebooks(), ids=TREE.relative)
def test_it_passes_every_gate(path: Path) -> None:
    found = findings(path, TREE)
    assert not found, "\n".join(found)


@pytest.mark.parametrize("source", sources(), ids=lambda source: TREE.relative(source.path))
def test_it_is_what_its_source_gives(source: Source) -> None:
    found = check_agreement(source, TREE)
    assert not found, "\n".join(found)


@pytest.mark.skipif(QUICK, reason="looks at every notebook")
def test_no_notebook_is_without_a_source() -> None:
    assert orphans(TREE) == []


FRESH = """
import sys

for name in [name for name in sys.modules if name.partition(".")[0] == "course_lib"]:
    del sys.modules[name]
get_ipython().reset()
"""


@pytest.fixture(scope="module")
def untouched() -> dict[str, NotebookNode]:
    """Every exercise as it ran untouched: one after the other in one kernel, without a name or a module of the course
    that the one before has left. That each runs in a kernel of its own, too, its solution shows in the same cells.
    """
    exercises = {lab.name: nbs.read_notebook(lab.exercise) for lab in (LABS[:1] if QUICK else LABS)}
    together = NotebookNode(nbs.read_notebook(LABS[0].exercise), cells=[])
    for nb in exercises.values():
        prepare_data(nb)
        together.cells += [new_code_cell(FRESH), *nb.cells]
    execute(together, TREE.root, strict=True, go_on=True)
    return exercises


@pytest.mark.parametrize(
    "lab", [pytest.param(lab, marks=[pytest.mark.slow] * (lab != LABS[0]), id=lab.name) for lab in LABS]
)
def test_untouched_exercise_raises_each_tasks_own_error_and_no_other(
    lab: Source, untouched: dict[str, NotebookNode]
) -> None:
    found = stub_findings(untouched[lab.name])
    assert not found, "\n".join(found)


def test_there_is_something_to_prove() -> None:
    assert {source.kind for source in sources()} == {"lesson", "lab"} and LABS
