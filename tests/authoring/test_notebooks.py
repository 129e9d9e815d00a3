"""Reading sources, deriving ids, finding lessons by name."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from course_lib.authoring import notebooks as nbs
from course_lib.authoring.kernels import kernel_environment
from course_lib.authoring.tree import CourseError, Tree
from course_lib.notebook._cells import real_datasets
from course_lib.notebook._errors import CannotWrite, nearest

GOOD = Path(__file__).parent / "fixtures" / "tree"


def _source(tmp_path: Path, text: str) -> nbs.NotebookNode:
    path = tmp_path / "03_x.py"
    path.write_text(text, encoding="utf-8")
    return nbs.read_source(path)


def test_ids_depend_on_the_cell_alone(tmp_path: Path) -> None:
    one = _source(tmp_path, "# %% [markdown]\n# # Title\n# %%\na = 1\n# %%\nb = 2\n")
    two = _source(tmp_path, "# %% [markdown]\n# # Other title\n# %%\nnew = 0\n# %%\na = 1\n# %%\nb = 2\n")
    assert [cell.id for cell in one.cells][1:] == [cell.id for cell in two.cells][2:]
    assert one.cells[0].id != two.cells[0].id
    assert all(re.fullmatch(r"[a-z0-9-]{1,64}", cell.id) for cell in one.cells + two.cells)


def test_equal_cells_have_numbered_ids(tmp_path: Path) -> None:
    ids = [cell.id for cell in _source(tmp_path, "# %%\nx\n# %%\nx\n# %%\nx\n").cells]
    assert ids[1:] == [f"{ids[0]}-2", f"{ids[0]}-3"]


def test_answers_and_checks_keep_their_id_whatever_they_say(tmp_path: Path) -> None:
    lab = '# %% [markdown]\n# ## Task 2 — Name (1 point)\n# %% tags=["task"]\n{}\n# %% tags=["check"]\ncheck\n'
    ids = [[cell.id for cell in _source(tmp_path, lab.format(text)).cells][1:] for text in ("a = 1", "a = 2")]
    assert ids == [["task-2", "check-2"]] * 2


def test_header_and_foreign_metadata_stay_out(tmp_path: Path) -> None:
    header = "# ---\n# jupyter:\n#   kernelspec:\n#     name: other\n# ---\n"
    nb = _source(tmp_path, header + '# %% tags=["a"] editable=false\n1\n')
    assert nb.metadata.kernelspec.name == "python3"
    assert "version" not in nb.metadata.language_info
    assert nb.cells[0].metadata == {"tags": ["a"]}


def test_prediction_and_hidden_input_are_stored_collapsed(tmp_path: Path) -> None:
    nb = _source(tmp_path, '# %% tags=["prediction"]\n1\n# %% tags=["hide-input"]\n2\n')
    assert nb.cells[0].metadata == {"tags": ["prediction"], "jupyter": {"outputs_hidden": True}, "collapsed": True}
    assert nb.cells[1].metadata == {"tags": ["hide-input"], "jupyter": {"source_hidden": True}}


@pytest.mark.parametrize(
    ("heading", "points"),
    [
        ("## Task 3 — Turn it (4 points)", 4),
        ("## Task 3 — Turn it (1 point)", 1),
        ("## Task 3 — Turn it (2 points, open)", 2),
    ],
)
def test_task_headings(heading: str, points: int) -> None:
    assert nbs.task_heading(f"Before.\n\n{heading}\n\nAfter.") == nbs.TaskHeading(3, "Turn it", points)


@pytest.mark.parametrize("heading", ["## Task 3: (4 points)", "## Task 3 — Turn it", "# Task 3 — Turn it (4 points)"])
def test_what_is_no_task_heading(heading: str) -> None:
    assert nbs.task_heading(heading) is None


def test_datasets_are_found_in_first_lines_and_calls(tmp_path: Path) -> None:
    real = '# %%\n# real data: tum_pair, sun_pair\nx = data.load("tum_pair")\n'
    nb = _source(tmp_path, real + "# %%\ny = data.load('living_room')\n")
    assert real_datasets(nb.cells[0].source) == ("tum_pair", "sun_pair")
    assert real_datasets("x = 1\n# real data: tum_pair") == ()
    assert nbs.named_datasets(nb) == ["tum_pair", "sun_pair", "living_room"]


@pytest.mark.parametrize(("content", "says"), [(b"\xff\xfe", "is not UTF-8"), (b"", "holds no cells")])
def test_sources_that_cannot_be_read_get_one_sentence(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "03_x.py"
    path.write_bytes(content)
    with pytest.raises(CourseError, match=says):
        nbs.read_source(path)
    with pytest.raises(CourseError, match="there is no source 04_x.py"):
        nbs.read_source(tmp_path / "04_x.py")


def test_writing_fails_without_leaving_half_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "01.ipynb"
    nb = nbs.read_notebook(GOOD / "notebooks" / "01_tiny.ipynb")
    assert nbs.write_notebook(path, nb)
    assert not nbs.write_notebook(path, nb)
    before = path.read_bytes()
    nb.cells.pop()

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(CannotWrite, match="The disk is full"):
        nbs.write_notebook(path, nb)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["01.ipynb"]


@pytest.mark.parametrize(
    ("name", "notebooks"),
    [
        ("01", ["notebooks", "solutions"]),
        ("1", ["notebooks", "solutions"]),
        ("01_tiny", ["notebooks", "solutions"]),
        ("notebooks/source/01_tiny.py", ["notebooks"]),
        ("exercises/01_tiny.ipynb", ["solutions"]),
    ],
)
def test_sources_are_found_by_number_name_and_path(name: str, notebooks: list[str]) -> None:
    assert [source.notebook.parent.name for source in Tree(GOOD).find([name])] == notebooks


def test_unknown_name_suggests_the_nearest() -> None:
    with pytest.raises(CourseError, match="no lesson or lab called '01_tyni'. Did you mean 01_tiny?"):
        Tree(GOOD).find(["01_tyni"])
    assert nearest("zzz", ["build"]) == ""


def test_kernel_environment_is_fixed_and_private(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("COURSE_STRICT", "1")
    monkeypatch.setenv("PYTHONSTARTUP", "mine.py")
    environment = kernel_environment(GOOD, tmp_path)
    assert environment["PYTHONHASHSEED"] == "0"
    assert environment["COURSE_QUIET"] == "1"
    assert environment["IPYTHONDIR"] == str(tmp_path)
    assert environment["PYTHONPATH"].split(os.pathsep)[0] == str(GOOD)
    assert not {"COURSE_STRICT", "PYTHONSTARTUP"} & environment.keys()
    assert kernel_environment(GOOD, tmp_path, strict=True)["COURSE_STRICT"] == "1"
