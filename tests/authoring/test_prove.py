"""The proof itself: what nbval lets through and what it stops, with the words that `course test` gives to pytest."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import nbformat
import pytest
from untouched_exercise import stub_findings

from course_lib.authoring import notebooks as nbs
from course_lib.authoring.kernels import kernel_environment
from course_lib.authoring.needed_data import make_side_by_side
from course_lib.authoring.prove import (
    COPIES,
    Skipped,
    copy_notebooks,
    pytest_words,
)
from course_lib.authoring.tree import Tree
from course_lib.notebook._errors import Refusal

GOOD = Path(__file__).parent / "fixtures" / "tree"
PICTURE, AREA, ERROR, REAL = 1, 3, 7, 9  # cells of the good lesson


def _no_data(names: tuple[str, ...]) -> set[str]:
    return set(names)


def _lesson(folder: Path, name: str) -> nbs.NotebookNode:
    nb = nbs.read_notebook(GOOD / "notebooks" / "01_tiny.ipynb")
    nbs.write_notebook(folder / f"{name}.ipynb", nb)
    return nb


@pytest.fixture(scope="module")
def proved(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """Run one proof over a few lessons and tell the outcome of each cell: {notebook: ["passed", "failed", …]}."""
    course, folder = tmp_path_factory.mktemp("course"), tmp_path_factory.mktemp("proof")
    tree = Tree(course)
    wrong_number = _lesson(tree.lessons_folder, "01_wrong_number")
    other_real = _lesson(tree.lessons_folder, "02_other_real_number")
    wrong_number.cells[AREA].outputs[0].text = "area of the disc: 708 px²\n"
    wrong_number.cells[ERROR].metadata.tags = []
    wrong_number.cells[REAL].outputs[0].text = "rows of the photograph: 481\n"
    blank = nbs.read_notebook(GOOD.parent / "spoiled" / "notebooks" / "01_blank_render.ipynb")
    wrong_number.cells[PICTURE].outputs[0].data["image/png"] = blank.cells[PICTURE].outputs[0].data["image/png"]
    other_real.cells[REAL].outputs[0].text = "rows of the photograph: 481\n"
    nbs.write_notebook(tree.lessons_folder / "01_wrong_number.ipynb", wrong_number)
    nbs.write_notebook(tree.lessons_folder / "02_other_real_number.ipynb", other_real)
    (tree.lessons_folder / "03_not_a_notebook.ipynb").write_text("{", encoding="utf-8")
    stored = sorted(tree.lessons_folder.glob("*.ipynb"))
    copy_notebooks(stored[:1], tree, folder / COPIES, lambda names: set())  # the data of the first are there
    skipped = copy_notebooks(stored[1:], tree, folder / COPIES, _no_data)
    assert skipped == Skipped(1, 1, ("stanford_bunny",))
    (folder / "ipython").mkdir()
    run = subprocess.run(
        [*pytest_words(tree, folder, depth="all", workers=1, more=["-rA"])],
        env=kernel_environment(Path(__file__).parents[2], folder / "ipython"),
        cwd=course,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    outcomes = re.findall(r"^(PASSED|FAILED) notebooks/(\d\d_\w+)\.ipynb::Cell (\d)", run.stdout, re.M)
    assert len(outcomes) == 12, run.stdout + run.stderr
    told: dict[str, dict[int, str]] = {}
    for outcome, name, cell in outcomes:
        told.setdefault(name, {})[int(cell)] = outcome.lower()
    told["closing"] = {0: run.stdout.strip().splitlines()[-1], 1: str(run.returncode)}
    return {name: [cells[n] for n in sorted(cells)] for name, cells in told.items()}


@pytest.mark.slow
def test_stored_numbers_that_do_not_come_again_are_found(proved: dict[str, list[str]]) -> None:
    """Its first cell passes: pictures are not compared."""
    assert proved["01_wrong_number"] == ["passed", "failed", "passed", "passed", "failed", "failed"]


@pytest.mark.slow
def test_real_data_cells_without_their_data_are_not_compared(proved: dict[str, list[str]]) -> None:
    assert proved["02_other_real_number"] == ["passed"] * 6


@pytest.mark.slow
def test_run_ends_with_pytests_closing_line_and_its_exit_code(proved: dict[str, list[str]]) -> None:
    line, code = proved["closing"]
    assert re.match(r"3 failed, 9 passed in ", line)
    assert code == "1"


def test_copies_leave_the_stored_notebooks_alone(tmp_path: Path) -> None:
    tree = Tree(GOOD)
    lesson, lab = tree.lessons()[0].notebook, tree.labs()[0].notebook
    before = lesson.read_bytes(), lab.read_bytes()
    assert copy_notebooks([lesson, lab], tree, tmp_path, _no_data) == Skipped(1, 1, ("stanford_bunny",))
    assert (lesson.read_bytes(), lab.read_bytes()) == before
    copy = nbs.read_notebook(tmp_path / "notebooks" / "01_tiny.ipynb")
    assert nbs.cell_tags(copy.cells[REAL]) == ["real-data", "nbval-ignore-output"]
    assert (tmp_path / "solutions" / "01_tiny.ipynb").read_bytes() == before[1]


def test_the_check_of_a_task_whose_data_are_not_here_is_not_compared() -> None:
    """It is judged on its made cases, and its card says so."""
    cells = [nbformat.v4.new_code_cell(f'check("{task}", f)') for task in ("07-3", "05-1", "99-1")]
    assert [nbs.real_data_of(cell) for cell in cells] == [("stanford_bunny",), (), ()]


def test_what_was_skipped_is_counted_and_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)
    assert Skipped(12, 4, ("tum_pair",)).line == (
        "12 real-data cells in 4 notebooks skipped: COURSE_DATA_MIRROR is not set"
    )
    monkeypatch.setenv("COURSE_DATA_MIRROR", "stick")
    assert Skipped(1, 1, ("sun_pair", "tum_pair")).line == (
        "1 real-data cell in 1 notebook skipped: stick and the cache lack sun_pair, tum_pair"
    )
    assert Skipped(0, 0, ()).line == ""


@pytest.mark.slow
def test_data_are_made_in_other_processes_and_what_is_wrong_is_said_in_this_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path))
    with pytest.raises(Refusal, match="desk_pair"):
        make_side_by_side(["desk_pear", "desk_pair", "stanford_bunny"], workers=2)
    made = [path for path in tmp_path.iterdir() if path.is_dir()]
    assert [path.name.split("-")[0] for path in made] == ["desk_pair"], "the others are real, or unknown"
    stamp = made[0].stat().st_mtime_ns
    make_side_by_side(["desk_pair"], workers=2)
    assert made[0].stat().st_mtime_ns == stamp, "made twice"


def test_quick_leaves_out_later_labs_and_slow_tests(tmp_path: Path) -> None:
    tests = tmp_path / "tests" / "tasks"
    tests.mkdir(parents=True)
    for lab in ("00", "01", "02", "03"):
        (tests / f"test_lab_{lab}.py").touch()
    sources = tmp_path / "solutions" / "source"
    sources.mkdir(parents=True)
    for name in ("00_z", "01_a", "02_b", "03_c"):
        (sources / f"{name}.py").touch()
    (tests / "test_lab_03_more.py").touch()
    words = pytest_words(Tree(tmp_path), tmp_path, depth="quick", workers=2, more=["-x"])
    ignored = [Path(word.removeprefix("--ignore=")).name for word in words if word.startswith("--ignore=")]
    assert sorted(ignored) == ["test_lab_02.py", "test_lab_03.py", "test_lab_03_more.py"]
    marks = [words[i + 1] for i, word in enumerate(words) if word == "-m"]
    assert marks == ["pytest", "not slow and not thorough"]
    assert words[words.index("-k") + 1] == "not [02- and not [02] and not [03- and not [03]"
    assert "-x" in words
    for depth, mark in (("all", ["pytest", "not thorough"]), ("thorough", ["pytest"])):
        full = pytest_words(Tree(tmp_path), tmp_path, depth=depth, workers=2, more=[])
        assert not any(word.startswith("--ignore=") for word in full) and "-k" not in full
        assert [full[i + 1] for i, word in enumerate(full) if word == "-m"] == mark


def _error(name: str, value: str) -> list:
    return [nbs.nbformat.v4.new_output("error", ename=name, evalue=value, traceback=[])]


@pytest.fixture
def run_exercise() -> nbs.NotebookNode:
    """The tiny lab's exercise as if it had run untouched under COURSE_STRICT=1."""
    nb = nbs.read_notebook(GOOD / "exercises" / "01_tiny.ipynb")
    for number, place in enumerate((5, 8, 11, 14), start=1):
        nb.cells[place].outputs = _error("NotImplementedError", f"Task {number}: …")
    return nb


def test_an_untouched_exercise_with_each_tasks_own_error_passes(run_exercise: nbs.NotebookNode) -> None:
    assert stub_findings(run_exercise) == []


@pytest.mark.parametrize(
    ("cell", "outputs", "says"),
    [
        (5, [], "the check of the stub 01-1 raises nothing"),
        (5, _error("NotImplementedError", "Task 2: …"), "the check of 01-1 raises NotImplementedError: Task 2: …"),
        (8, _error("NameError", "name 'np' is not defined"), "the check of 01-2 raises NameError"),
        (3, _error("KeyError", "'camera'"), "raises KeyError: 'camera'"),
    ],
)
def test_any_other_outcome_of_an_exercise_is_found(
    run_exercise: nbs.NotebookNode, cell: int, outputs: list, says: str
) -> None:
    run_exercise.cells[cell].outputs = outputs
    found = stub_findings(run_exercise)
    assert len(found) == 1
    assert says in found[0]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="SIGINT cannot be sent to a group of processes on Windows")
def test_ctrl_c_ends_the_making_at_once_and_takes_nothing_half_made_for_whole(tmp_path: Path) -> None:
    script, cache = tmp_path / "make.py", tmp_path / "cache"
    script.write_text(
        "import signal\n"
        "from course_lib.authoring.needed_data import make_side_by_side\n"
        "if __name__ == '__main__':\n"
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "    make_side_by_side(['bunny_like', 'desk_pair'], 2)\n",
        encoding="utf-8",
    )
    environment = {**kernel_environment(Path(__file__).parents[2], tmp_path), "COURSE_CACHE": str(cache)}
    process = subprocess.Popen(
        [sys.executable, str(script)], env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    while not list(cache.glob(".*.part")) and process.poll() is None:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    began = time.monotonic()
    _, said = process.communicate(timeout=60)
    assert process.returncode != 0 and time.monotonic() - began < 5
    assert said.count("Traceback") == 1 and said.endswith("KeyboardInterrupt\n"), said
    assert not any(path.is_dir() and not path.name.startswith(".") for path in cache.iterdir())
