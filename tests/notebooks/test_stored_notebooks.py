"""Every stored notebook passes every gate, is what its source gives, and every exercise waits for its learner."""

from __future__ import annotations

from pathlib import Path

import pytest
from stored import QUICK, TREE, notebooks, sources
from untouched_exercise import stub_findings

from course_lib import tasks
from course_lib.authoring import notebooks as nbs
from course_lib.authoring.build import check_agreement, orphans
from course_lib.authoring.gates import findings
from course_lib.authoring.kernels import execute
from course_lib.authoring.needed_data import missing_data, prepare_data
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


@pytest.mark.parametrize(
    "lab", [pytest.param(lab, marks=[pytest.mark.slow] * (lab != LABS[0]), id=lab.name) for lab in LABS]
)
def test_untouched_exercise_raises_each_tasks_own_error_and_no_other(lab: Source) -> None:
    nb = nbs.read_notebook(lab.exercise)
    prepare_data(nb)
    execute(nb, TREE.root, strict=True, go_on=True)
    found = stub_findings(nb, skipped=lambda task: bool(missing_data(tasks.get(task).data)))
    assert not found, "\n".join(found)


def test_there_is_something_to_prove() -> None:
    assert {source.kind for source in sources()} == {"lesson", "lab"} and LABS
