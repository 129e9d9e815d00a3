"""Cells that begin with `# real data: ...`, in a real IPython shell."""

import os
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output
from nbformat.v4 import new_code_cell, new_notebook, new_output

from course_lib.notebook import _cells, _shipped

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def shell(monkeypatch, tmp_path):
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path))
    shell = InteractiveShell.instance()
    assert _cells.register()
    yield shell
    InteractiveShell.clear_instance()


def run(shell, source: str):
    with capture_output() as captured:
        result = shell.run_cell(source)
    return result, captured


def test_a_cell_without_its_data_is_skipped_and_says_the_command(shell):
    result, _ = run(shell, "# real data: tum_pair, sun_pair\nx = data.load('tum_pair')\nprint('ran')")
    assert result.success and isinstance(result.result, _cells.Skipped)
    assert repr(result.result) == (
        "skipped: this cell needs real data (tum_pair, sun_pair); "
        "get it with: python3 course.py data get tum_pair sun_pair"
    )
    assert "x" not in shell.user_ns
    assert "<code>python3 course.py data get tum_pair sun_pair</code>" in result.result._repr_html_()


SOURCE = "# real data: tum_pair\nshow(data.load('tum_pair').frames[0])"


@pytest.fixture
def shipped(monkeypatch, tmp_path):
    """A shipped notebook with a picture of real data, words below it, a number, and an error that belongs there."""
    monkeypatch.setattr(_shipped, "ROOT", tmp_path)
    outputs = [
        new_output("stream", text="frames: 2\n"),
        new_output(
            "display_data",
            {"image/png": "iVBORw0KGgo=", "text/plain": "2 images"},
            metadata={"image/png": {"width": 70}},
        ),
        new_output("display_data", {"text/html": "<details>2 images</details>"}),
        new_output("execute_result", {"text/plain": "42"}, execution_count=1),
        new_output("error", ename="ValueError", evalue="too far", traceback=["ValueError: too far"]),
    ]
    cells = [new_code_cell("# real data: tum_pair\n1"), new_code_cell(SOURCE, outputs=outputs, execution_count=2)]
    (tmp_path / "notebooks").mkdir()
    nbformat.write(new_notebook(cells=cells), tmp_path / "notebooks" / "01_rgbd_images.ipynb")


def test_a_cell_without_its_data_shows_what_the_shipped_notebook_has_stored(shell, shipped):
    with capture_output() as captured:
        result = shell.run_cell(f"{SOURCE}\n")
    assert result.success
    line, picture, words, number = captured.outputs
    assert line.data["text/plain"] == (
        "stored: what follows was made where the real data are (tum_pair); "
        "get it with: python3 course.py data get tum_pair"
    )
    assert picture.data == {"image/png": b"\x89PNG\r\n\x1a\n", "text/plain": "2 images"}
    assert picture.metadata == {"image/png": {"width": 70}}
    assert words.data == {"text/html": "<details>2 images</details>"} and number.data == {"text/plain": "42"}
    assert captured.stdout.removeprefix("Out[0]: ") == "frames: 2\nValueError: too far\n"


@pytest.mark.parametrize("edited", [SOURCE + "  # mine", "# real data: tum_pair\n1"])
def test_a_cell_that_was_edited_or_stores_nothing_says_so_alone(shell, shipped, edited):
    _, captured = run(shell, edited)
    assert [output.data["text/plain"] for output in captured.outputs] == [
        "skipped: this cell needs real data (tum_pair); get it with: python3 course.py data get tum_pair"
    ]


def test_only_missing_ones_are_named(shell, monkeypatch):
    missing = {"tum_pair": [], "sun_pair": ["file"]}
    monkeypatch.setattr("course_lib.notebook._real.missing", lambda entry: missing[entry.name])
    result, _ = run(shell, "# real data: tum_pair, sun_pair\n1")
    assert result.result.names == ["sun_pair"]


def test_a_cell_with_its_data_runs(shell, monkeypatch):
    monkeypatch.setattr("course_lib.notebook._real.missing", lambda entry: [])
    result, captured = run(shell, "# real data: tum_pair\nprint('ran')\n41 + 1")
    assert result.result == 42 and captured.stdout.startswith("ran")


OTHERS = ["41 + 1", "# realistic data: tum_pair\n41 + 1", "x = 41\n# real data: tum_pair\nx + 1"]


@pytest.mark.parametrize("source", OTHERS)
def test_other_cells_run(shell, source):
    assert run(shell, source)[0].result == 42


def test_synthetic_data_skip_nothing(shell):
    assert run(shell, "# real data: living_room\n41 + 1")[0].result == 42


def test_magics_go_with_the_cell(shell):
    result, _ = run(shell, "\n  # real data: tum_pair\n%%time\nprint('ran')")
    assert isinstance(result.result, _cells.Skipped)


def test_a_typo_in_the_first_line_is_one_sentence(shell):
    result, captured = run(shell, "# real data: tum_pear\n1")
    assert str(result.error_in_exec) == "There is no dataset 'tum_pear'. Did you mean tum_pair?"
    assert captured.stdout.strip().splitlines()[-1] == "Refusal: There is no dataset 'tum_pear'. Did you mean tum_pair?"
    assert "Traceback" not in captured.stdout


def test_registering_twice_counts_once(shell):
    _cells.register()
    names = [getattr(one, "__name__", "") for one in shell.input_transformers_cleanup]
    assert names.count("skip_cells") == 1


def test_outside_ipython_nothing_is_registered():
    code = "import IPython, course_lib.notebook; from course_lib.notebook._cells import register; print(register())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, cwd=ROOT)
    assert done.stdout == "False\n", done.stderr


def test_importing_the_package_in_ipython_registers(tmp_path):
    code = (
        "from IPython.core.interactiveshell import InteractiveShell\n"
        "shell = InteractiveShell.instance()\n"
        "shell.run_cell('from course_lib.notebook import data')\n"
        "shell.run_cell('# real data: pcl_tests\\nprint(1)')\n"
        "shell.run_cell('data.load(\"livingroom\")')\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "COURSE_DATA_MIRROR"}
    environment |= {"COURSE_CACHE": str(tmp_path), "IPYTHONDIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env=environment, cwd=ROOT
    )
    assert "skipped: this cell needs real data (pcl_tests)" in done.stdout, done.stderr
    assert "Traceback" not in done.stdout
    assert done.stdout.endswith(
        "line 1: data.load(\"livingroom\")\nRefusal: There is no dataset 'livingroom'. Did you mean living_room?\n"
    )
