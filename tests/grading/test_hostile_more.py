"""More attacks, each with its control: forged reports, the ledger, cells retyped and moved, a class that is hit."""

from __future__ import annotations

import os
import subprocess
import sys

import nbformat
import pytest
from click.testing import CliRunner
from grading_helpers import graded, need_sandbox, submission, task
from jupyter_client import KernelManager
from naive import NO_OTHER_PLUGINS, PLAIN_NBVAL, green, run_nbval, run_nbval_on_each

from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.verbs import grade

pytestmark = pytest.mark.slow

NAME = "00_start_here.ipynb"
WRONG = "def metres(depth_mm):\n    return depth_mm * 0.0\n"
RIGHT = "def metres(depth_mm):\n    return depth_mm / 1000\n"
CASES = "".join(f'<testcase name="lab::Cell {i}"/>' for i in range(2))
REPORT = f'<testsuites><testsuite tests="2">{CASES}</testsuite></testsuites>'


@pytest.fixture(autouse=True)
def _sandbox() -> None:
    need_sandbox()


def nothing_gained(data: bytes, **limits: float) -> dict:
    record = graded("00", data, **limits)
    one = task(record, 1)
    assert record["status"] == "graded" and one["points"] == 0 and one["reason"], one
    return one


def test_a_forged_junit_report(tmp_path):
    """It writes the report that the usual grader reads, ends the pytest that would write another, and then itself."""
    attack = f"""
import os
import signal
with open("out.xml", "w") as file:
    file.write({REPORT!r})
os.kill(os.getppid(), signal.SIGKILL)
os.kill(os.getpid(), signal.SIGKILL)
"""
    for data in (submission("00", {1: WRONG + attack}), submission("00", {1: attack + WRONG})):
        nothing_gained(data)
    told = run_nbval(tmp_path, data)
    assert green(told)  # the control
    assert set(told) == {"lab::Cell 0", "lab::Cell 1"}  # what it read was forged


def test_a_kernel_that_ends_itself_is_noticed_at_once(monkeypatch):
    source = HOSTILE["dies"]
    assert nothing_gained(submission("00", {1: source}))["reason"] == "died"
    # the control: who does not look whether the kernel lives waits until the time is up
    monkeypatch.setattr(KernelManager, "is_alive", lambda self: True)
    assert nothing_gained(submission("00", {1: source}), task_seconds=1.0)["reason"] == "timeout"


def test_the_ledger_cannot_be_reached(tmp_path):
    path = tmp_path / "ledger.sqlite"
    with Ledger(path) as ledger:
        ledger.set_settings("points", "0")
    code = f"""
tools = [__import__("sqlite3")]


def metres(depth_mm):
    with tools[0].connect("file:{path}?mode=rw", uri=True) as ledger:
        ledger.execute("UPDATE settings SET value = '100' WHERE name = 'points'")
    return depth_mm / 1000
"""
    data = submission("00", {1: code})
    one = nothing_gained(data)
    assert one["reason"] in ("raised", "refused"), one
    with Ledger(path, write=False) as ledger:
        assert ledger.settings("points") == "0"
    assert task(graded("00", data, sandbox="none"), 1)["points"] == 1  # the control: without the sandbox it was written
    with Ledger(path, write=False) as ledger:
        assert ledger.settings("points") == "100"


def rewritten(change) -> bytes:
    nb = nbformat.reads(submission("00", {1: WRONG}).decode(), 4)
    change(nb)
    return nbformat.writes(nb).encode()


def place(nb, name: str) -> int:
    return next(i for i, cell in enumerate(nb.cells) if cell.id == name)


def retyped(nb):
    """The check becomes a text, so nothing fails."""
    nb.cells[place(nb, "check-1")].cell_type = "markdown"
    for key in ("outputs", "execution_count"):
        nb.cells[place(nb, "check-1")].pop(key, None)


def raw(nb):
    """The check becomes a raw cell, which nobody runs."""
    retyped(nb)
    nb.cells[place(nb, "check-1")].cell_type = "raw"


def doubled(nb):
    """A cell with the check's id that checks nothing; the real one is a text now."""
    retyped(nb)
    nb.cells[place(nb, "check-1")].id = "other"
    nb.cells.append(nbformat.v4.new_code_cell("True", id="check-1", metadata={"tags": ["check"]}))


def reordered(nb):
    """The import of `check` moves behind its use; before it stands another `check`."""
    first = next(i for i, cell in enumerate(nb.cells) if "import check" in cell.source)
    nb.cells.append(nb.cells.pop(first))
    nb.cells.insert(0, nbformat.v4.new_code_cell("import numpy as np\ncheck = lambda *given: None"))


def points_edited(nb):
    """The heading promises a hundred, the tags say that the cell is the given one, the check is gone."""
    for cell in nb.cells:
        cell.source = cell.source.replace("(1 point)", "(100 points)")
    nb.cells[place(nb, "task-1")].metadata["tags"] = ["task", "points:100", "grade"]
    nb.cells.pop(place(nb, "check-1"))


CHANGES = [retyped, raw, doubled, reordered, points_edited]


@pytest.fixture(scope="module")
def naively(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, str]]:
    """What the usual grader makes of each changed notebook: one run, with a kernel for each."""
    return run_nbval_on_each(
        tmp_path_factory.mktemp("naive"), {change.__name__: rewritten(change) for change in CHANGES}
    )


@pytest.mark.parametrize("change", CHANGES, ids=lambda c: c.__name__)
def test_cells_changed_around_a_wrong_answer(change, naively):
    record = graded("00", rewritten(change))
    one = task(record, 1)
    assert (record["status"], one["points"], one["reason"], record["max"]) == ("graded", 0, "wrong", 1), one
    assert green(naively[change.__name__])  # the control: green where the notebook itself is run


def test_a_task_cell_that_is_a_text_now_earns_nothing_by_itself():
    def text(nb):
        cell = nb.cells[place(nb, "task-1")]
        cell.cell_type = "markdown"
        for key in ("outputs", "execution_count"):
            cell.pop(key, None)

    one = nothing_gained(rewritten(text))
    assert (one["status"], one["reason"]) == ("by hand", "text cell")  # it is not run: a person looks at it


def test_one_malformed_file_does_not_stop_the_class(tmp_path):
    folder = tmp_path / "class"
    good = submission("00", {1: RIGHT})
    for student, data in {"ann": good, "mallory": good[:900], "zoe": good}.items():
        (folder / student).mkdir(parents=True)
        (folder / student / NAME).write_bytes(data)
    done = CliRunner().invoke(grade.grade, [str(folder), "--out", str(tmp_path / "g"), "--workers", "1"])
    assert done.exit_code == 1, done.output
    with Ledger(tmp_path / "g" / "ledger.sqlite", write=False) as ledger:
        found = {entry.student: ledger.newest(entry) for entry in ledger.entries()}
    assert {student: record["points"] for student, record in found.items()} == {"ann": 1, "mallory": 0, "zoe": 1}
    assert found["mallory"]["status"] == "unreadable" and found["mallory"]["notices"][0]["code"] == "cut off"
    # the control: nbval over the same folder stops at that file and grades nobody
    words = [sys.executable, *PLAIN_NBVAL, str(folder)]
    environment = {**os.environ, **NO_OTHER_PLUGINS}
    run = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 2 and "passed" not in run.stdout


def test_zip_slip_is_one(tmp_path):
    import io
    import zipfile

    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("../outside.ipynb", "x")
    with zipfile.ZipFile(io.BytesIO(out.getvalue())) as archive:
        name = archive.namelist()[0]
        inner = tmp_path / "inner"
        inner.mkdir()
        (inner / name).write_bytes(archive.read(name))  # the control: who joins paths writes outside
    assert (tmp_path / "outside.ipynb").read_text() == "x"


HOSTILE = {
    "dies": "tools = [__import__('os')]\n\n\ndef metres(depth_mm):\n    tools[0]._exit(0)\n",
    "forges": WRONG + "check = lambda *given: None\nget_ipython().showtraceback = lambda *g, **n: None\n",
    "hangs": "def metres(depth_mm):\n    while True:\n        pass\n",
    "reads": "def metres(depth_mm):\n    return open('/etc/passwd').read()\n",
    "lies": "def metres(depth_mm):\n    return float('nan')\n",
}


def test_in_a_class_each_has_its_reason_in_the_ledger_and_nobody_else_is_hurt(tmp_path):
    folder = tmp_path / "class"
    answers = {f"{i}-{kind}": source for i, (kind, source) in enumerate(HOSTILE.items())}
    answers |= {f"{i}-honest": RIGHT for i in range(len(HOSTILE))}
    for student, source in answers.items():
        (folder / student).mkdir(parents=True)
        (folder / student / NAME).write_bytes(submission("00", {1: source + f"# {student}\n"}))
    limits = tmp_path / "limits.toml"
    limits.write_text("task_seconds = 2\ngrace_seconds = 0.5\n")
    words = [str(folder), "--out", str(tmp_path / "g"), "--workers", "1", "--limits", str(limits)]
    done = CliRunner().invoke(grade.grade, words)
    assert done.exit_code == 0, done.output
    with Ledger(tmp_path / "g" / "ledger.sqlite", write=False) as ledger:
        found = {entry.student: ledger.newest(entry)["tasks"][0] for entry in ledger.entries()}
    for student, one in found.items():
        if student.endswith("honest"):
            assert (one["points"], one["status"]) == (1, "passed"), student
        else:
            assert one["points"] == 0 and one["reason"] and one["error"], student
    reasons = {student.split("-")[1]: one["reason"] for student, one in found.items()}
    assert reasons["dies"] == "died" and reasons["hangs"] == "timeout" and reasons["forges"] == "wrong"
    written = sorted(path.name for path in folder.rglob("*") if path.is_file())
    assert written == [NAME] * len(answers)  # nobody wrote beside what was handed in
