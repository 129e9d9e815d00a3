"""The benchmark against nbgrader: what it compares is the same, and a bound that does not hold fails it."""

from __future__ import annotations

import pytest
from grading_helpers import graded, need_sandbox

from course_lib import tasks
from course_lib.bench import bench_grading
from course_lib.grading.release.released import released_lab


@pytest.mark.slow
def test_submissions_are_honest_and_different():
    need_sandbox()
    found = bench_grading.honest(3)
    assert len(set(found)) == 3
    record = graded(bench_grading.LAB, found[2], seed=bench_grading.SEED)
    by_hand = sum(task.points for task in tasks.lab(bench_grading.LAB) if task.kind == "explain")
    assert record["points"] == released_lab(bench_grading.LAB).points - by_hand


def test_nbgrader_gets_the_same_cells_and_one_test_a_task():
    [data] = bench_grading.honest(1)
    ours = [source for _, source in bench_grading._cells(data)]
    nb = bench_grading._nbgrader_notebook(data)
    theirs = [cell.source for cell in nb.cells if "nbgrader" not in cell.metadata]
    tests = [cell for cell in nb.cells if "nbgrader" in cell.metadata]
    assert theirs == ours and [cell.metadata.nbgrader.points for cell in tests] == [
        task.points for task in tasks.lab(bench_grading.LAB)
    ]
    assert all(f"fresh(_task, {bench_grading.SEED})" in cell.source for cell in tests)


@pytest.mark.parametrize(
    ("one", "two", "own", "code"),
    [(60.0, 30.0, 0.1, 0), (140.0, 30.0, 1.0, 1), (60.0, 80.0, 0.1, 1), (105.0, 30.0, 0.0, 1)],
)
def test_bounds(one, two, own, code, capsys):
    sums = {"nbgrader": 100.0, "one worker": one, "two workers": two}
    assert bench_grading._table(sums, 48, own) == code
    assert ("FAIL" in capsys.readouterr().out) == bool(code)
