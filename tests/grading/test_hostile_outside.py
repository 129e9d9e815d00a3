"""Attacks on the grader from its own machine, and for defences that stand alone a control: one removed, harm done."""

from __future__ import annotations

import base64
import dataclasses
import json
import os
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import nbformat
import numpy as np
import pytest
from grading_helpers import ROOT, graded, need_sandbox, submission, task
from naive import NO_OTHER_PLUGINS, PLAIN_NBVAL, run_nbval
from test_hostile_answers import PATCH, WRONG, forging
from test_hostile_limits import answer

from course_lib import tasks
from course_lib.authoring import solutions
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.run import grade_submission, nbval_items, watchdog
from course_lib.grading.tell import export, pages
from course_lib.tasks.labs.lab_00_start_here import tasks as lab_00

pytestmark = pytest.mark.slow

NAME = "00_start_here.ipynb"
RIGHT = "def metres(depth_mm):\n    return depth_mm / 1000\n"


@pytest.fixture(autouse=True)
def _sandbox() -> None:
    need_sandbox()


class OpenGrader:
    """A grader that listens on this machine and believes who speaks, as an open Dask scheduler does."""

    def __init__(self, family: int, address) -> None:
        self.points = 0
        self.server = socket.socket(family)
        self.server.bind(address)
        self.server.listen()
        self.server.settimeout(0.2)
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self._serve)

    def _serve(self) -> None:
        while not self.ended.is_set():
            try:
                connection, _ = self.server.accept()
            except TimeoutError:
                continue
            with connection:
                self.points += int(connection.recv(100).decode().removeprefix("points "))

    def believed(self, points: int) -> bool:
        """Whether it has given so many, or does so within ten seconds."""
        end = time.monotonic() + 10
        while self.points < points and time.monotonic() < end:
            time.sleep(0.01)
        return self.points >= points

    def __enter__(self) -> OpenGrader:
        self.thread.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self.ended.set()
        self.thread.join(5)
        self.server.close()


LOOPBACK = {
    "over loopback": (socket.AF_INET, ("127.0.0.1", 0)),
    "over a socket without a file": (socket.AF_UNIX, f"\0open-grader-of-a-test-{os.getpid()}"),
}


@pytest.mark.parametrize("way", sorted(LOOPBACK))
def test_a_grader_on_this_machine_is_not_reached(way):
    with OpenGrader(*LOOPBACK[way]) as open_grader:
        address = open_grader.server.getsockname()
        family = "AF_INET" if way == "over loopback" else "AF_UNIX"
        code = f"place = socket.socket(socket.{family})\nplace.settimeout(2)\nplace.connect({address!r})\n"
        code += "place.sendall(b'points 100')\nplace.close()"
        record = task(graded("00", answer(code)), 1)
        assert (record["points"], record["reason"], open_grader.points) == (0.0, "raised", 0), record["error"]
        assert "refused" in record["error"] or "unreachable" in record["error"], record["error"]
        assert task(graded("00", answer(code), sandbox="none"), 1)["points"] == 1
        assert open_grader.believed(100)  # the control: without the sandbox it gave itself points


def test_a_kernelspec_that_runs_a_program(tmp_path, monkeypatch):
    """A kernel of this name is installed on the grader (or came along in JUPYTER_PATH), and is no kernel at all."""
    mark = tmp_path / "ran"
    place = tmp_path / "jupyter" / "kernels" / "evil"
    place.mkdir(parents=True)
    program = [sys.executable, "-I", "-S", "-c", f"open({str(mark)!r}, 'w')", "{connection_file}"]
    (place / "kernel.json").write_text(json.dumps({"argv": program, "display_name": "e", "language": "python"}))
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path / "jupyter"))
    nb = nbformat.reads(submission("00", {1: RIGHT}).decode(), 4)
    nb.metadata["kernelspec"] = {"name": "evil", "display_name": "e", "language": "python"}
    data = nbformat.writes(nb).encode()
    assert graded("00", data)["points"] == 1 and not mark.exists()
    run_nbval(tmp_path, data, "--nbval-kernel-startup-timeout", "1")  # for its first sign, and none comes
    assert mark.exists()  # the control: plain nbval starts what the notebook names


EVIL = "import pathlib\npathlib.Path({marks!r}, {name!r}).touch()\n"
BESIDE = {
    "conftest.py": "pytest_plugins = ['plugged']\n" + EVIL,
    "plugged.py": EVIL,
    "pytest.ini": "[pytest]\naddopts = -p added\n",
    "added.py": EVIL,
    "sitecustomize.py": EVIL,
    "numpy.py": EVIL,
    "nbformat.py": EVIL,
}


def test_files_beside_notebooks_run_nowhere_even_if_grading_starts_there(tmp_path):
    """The instructor stands in the folder of the download and says `course.py grade .`."""
    folder, marks = tmp_path / "class", tmp_path / "marks"
    folder.mkdir()
    marks.mkdir()
    for name, text in BESIDE.items():
        (folder / name).write_text(text.format(marks=str(marks), name=name))
    (folder / f"ann_{NAME}").write_bytes(submission("00", {1: RIGHT}))
    command = [sys.executable, "-P", "-m", "course_lib.cli", "grade", ".", "--workers", "1"]

    def there(words: list[str], path: str) -> str:
        environment = {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", **NO_OTHER_PLUGINS}
        done = subprocess.run(
            words, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
        )
        return done.stdout + done.stderr

    said = there([*command, "--seed", "3", "--out", str(tmp_path / "grades")], str(ROOT))
    with Ledger(tmp_path / "grades" / "ledger.sqlite", write=False) as ledger:
        points = [ledger.newest(entry)["points"] for entry in ledger.entries() if entry.named == "ann"]
    assert points == [1.0] and list(marks.iterdir()) == [], said
    # the control: plain nbval there, with the folder on the path, as a Makefile may have it for the kernel
    words = [*PLAIN_NBVAL, f"ann_{NAME}"]
    there([sys.executable, *words], f"{ROOT}:{folder}")
    (folder / "nbformat.py").unlink(missing_ok=True)  # which has ended that run
    there([sys.executable, *words], f"{ROOT}:{folder}")
    (folder / "numpy.py").unlink()
    there([sys.executable, *words], f"{ROOT}:{folder}")
    assert {path.name for path in marks.iterdir()} == set(BESIDE) - {"pytest.ini"}


def test_files_among_the_sockets_are_written_where_nobody_counts_them(monkeypatch):
    code = """
mounts = [line.split()[4] for line in open('/proc/self/mountinfo')]
place = [mount for mount in mounts if mount.endswith(('/s0', '/s1'))][0]
for i in range(30):
    open(os.path.join(place, f'f{i}'), 'w').close()
time.sleep(max(0, vars(time).setdefault('end', time.monotonic() + 1) - time.monotonic()))  # once, not in each case
"""
    one = task(graded("00", answer(code)), 1)
    assert (one["points"], one["reason"]) == (0.0, "files"), one["error"]
    monkeypatch.setattr(watchdog, "SOCKETS", 1000)
    assert task(graded("00", answer(code)), 1)["points"] == 1  # the control


def test_30_mb_at_once_are_taken_in_where_nothing_limits_them():
    code = "get_ipython().display_pub.publish({'text/plain': 'x' * 30_000_000})"
    record = task(graded("00", answer(code), task_seconds=30.0), 1)
    assert record["points"] == 0 and record["reason"] in ("output", "timeout", "no answer", "memory")
    lifted = {"task_seconds": 60.0, "output_mb": 400.0, "message_mb": 400.0, "runner_mb": 4000.0, "memory_mb": 4000.0}
    assert task(graded("00", answer(code), **lifted), 1)["points"] == 1  # the control


def test_a_stale_answer_corrects_nothing(monkeypatch):
    """It answers wrongly, looks at the inputs at leisure, and sends what is right when the next task is asked."""
    code = """_sent.append(data[MIME])
send(data)
if len(_sent) == 2:
    right = [outcome(right_row(*given)) for given in _asked]
    send({MIME: {'nonce': _sent[0]['nonce'], 'answers': right}})"""
    source = PATCH.replace("FORGE", code.replace("\n", "\n    ")) + (
        f"_sent, _asked = [], []\n{solutions.reference('02-1')}\nright_row = row_of\n\n\n"
        "def row_of(*given):\n    _asked.append(given)\n    return -1\n"
    )
    data = submission("02", {1: source}, solved=True)
    one_task = task(graded("02", data), 1)
    assert (one_task["points"], one_task["reason"]) == (0.0, "doubled")

    def last_counts(self, content):  # the control: a grader that takes the last answer of a task, whenever it came
        lab_task = self.nonces[content["nonce"]]
        self.came[content["nonce"]] = 1
        outcomes = nbval_items._outcomes(content["answers"], len(self.cases[lab_task]))
        if lab_task in self.outcomes:
            self.outcomes[lab_task] = outcomes
        return outcomes

    def first_of_its_own(self, nonce, answers):
        self.parent.run.outcomes[self.task] = answers[0]

    monkeypatch.setattr(nbval_items.Run, "note_answer", last_counts)
    monkeypatch.setattr(nbval_items.Probe, "keep", first_of_its_own)
    assert task(graded("02", data), 1)["points"] > 0


def test_an_answer_made_beforehand(monkeypatch):
    """What the public cases give is known to everybody: it publishes that, whatever it is asked."""
    lab_task = tasks.get("00-1")
    wires = [base64.b64encode(tasks.to_wire(case.truth)).decode() for case in lab_task.public()]
    made = [{"kind": "answer", "answer": wire, "trouble": "", "printed": "", "warned": ""} for wire in wires]
    data = forging(f"send({{MIME: {{'nonce': 'f' * 32, 'answers': {made!r}}}}})")
    one_task = task(graded("00", data), 1)
    assert (one_task["points"], one_task["reason"]) == (0.0, "no answer")

    def any_nonce(self, content):  # the control: a grader without nonces that asks what the checks ask
        [nonce] = self.nonces
        self.came[nonce] += 1
        return nbval_items._outcomes(content["answers"], len(self.cases[self.nonces[nonce]]))

    monkeypatch.setattr(nbval_items.Run, "note_answer", any_nonce)
    assert task(graded("00", data), 1)["points"] == 0  # fresh inputs alone hold it, too
    monkeypatch.setattr(grade_submission, "fresh_cases", lambda task, seed: task.public())
    assert task(graded("00", data), 1)["points"] == 1


@pytest.mark.parametrize("value", ["np.nan", "depth_mm * np.nan"])
def test_an_answer_that_is_not_a_number(value, monkeypatch):
    data = submission("00", {1: f"def metres(depth_mm):\n    return {value}\n"})
    assert task(graded("00", data), 1)["points"] == 0

    def careless(case, answer):  # the control: it asks whether the error is too large
        return tasks.Verdict(not np.any(np.abs(np.asarray(answer) - case.truth) > 1e-5))

    monkeypatch.setattr(lab_00, "TASKS", (dataclasses.replace(lab_00.TASKS[0], judge=careless, version=2),))
    assert task(graded("00", data), 1)["points"] == 1
    if value == "np.nan":  # once: it is careless with NaN only
        assert task(graded("00", submission("00", {1: WRONG})), 1)["points"] == 0


SCRIPT = "<script>alert(1)</script>"


def test_a_script_in_an_error_is_a_script_where_nothing_escapes_it(monkeypatch):
    from fakes import standing_of

    from course_lib.grading.tell.feedback import feedback_page

    source = f"def metres(depth_mm):\n    raise ValueError({SCRIPT!r})\n"
    record = graded("00", submission("00", {1: source}))
    assert SCRIPT in task(record, 1)["error"]
    assert SCRIPT not in feedback_page(standing_of(record))
    monkeypatch.setattr(pages._environment(), "autoescape", False)
    pages._environment().cache.clear()
    try:
        assert SCRIPT in feedback_page(standing_of(record))  # the control
    finally:
        monkeypatch.undo()
        pages._environment().cache.clear()


def test_a_formula_in_a_name_is_one_where_nothing_quotes_it(monkeypatch):
    from fakes import standing

    rows = [standing(name="=HYPERLINK(1)")]
    assert "\r\n=" not in export.export_text(rows, "csv") and ",=" not in export.export_text(rows, "csv")
    monkeypatch.setattr(export, "safe_cell", str)
    assert ",=HYPERLINK" in export.export_text(rows, "csv")  # the control


FILES = {
    "folder_mb": (
        "for i in range(3):\n    with open(f'/tmp/{i}', 'wb') as file:\n        file.write(bytes(9_000_000))",
        {"folder_mb": 20.0},
        {"folder_mb": 60.0},
    ),
    "file_mb": (
        "with open('/tmp/one', 'wb') as file:\n    file.write(bytes(9_000_000))",
        {"file_mb": 5.0},
        {"file_mb": 50.0},
    ),
    "open_files": (
        "held = [open('/dev/null') for _ in range(300)]\nfor file in held:\n    file.close()",
        {"open_files": 200},
        {"open_files": 900},
    ),
}


@pytest.mark.parametrize("name", sorted(FILES))
def test_limits_on_files_are_named(name):
    code, tight, lifted = FILES[name]
    record = task(graded("00", answer(code), **tight), 1)
    assert (record["points"], record["status"]) == (0.0, "raised")
    assert f"{name} = {tight[name]:g}" in record["error"], record["error"]
    assert task(graded("00", answer(code), **lifted), 1)["points"] == 1, "the control"


def test_limits_on_time_are_named():
    slow = "import time\ntime.sleep(30)\n" + RIGHT
    record = task(graded("00", submission("00", {1: slow}), cell_seconds=1.0), 1)
    assert record["reason"] == "timeout" and "cell_seconds = 1" in record["error"]
    record = task(graded("00", submission("00", {1: slow}), cell_seconds=30.0, total_seconds=2.0), 1)
    assert record["reason"] == "timeout" and "total_seconds = 2" in record["error"]


def test_another_submission_that_is_graded_now_is_not_seen(tmp_path):
    """What lies in the grader's private folders of this moment, by the name of any of them."""
    from course_lib.grading.run.scratch_folders import private_folder

    place = Path(private_folder()) / f"another-{os.getpid()}.ipynb"
    place.write_bytes(submission("00", {1: RIGHT}))
    try:
        code = f"text = open({str(place)!r}).read()\nassert 'depth_mm / 1000' in text"
        record = task(graded("00", answer(code)), 1)
        assert record["reason"] == "raised" and "No such file" in record["error"]
        assert task(graded("00", answer(code), sandbox="none"), 1)["points"] == 1  # the control
    finally:
        place.unlink()


def test_plain_nbval_with_strict_checks_is_enough_for_a_notebook_that_is_trusted(tmp_path):
    """`COURSE_STRICT=1 pytest --nbval-lax exercises/NN.ipynb`, as the instructor's page says it."""
    words = [sys.executable, *PLAIN_NBVAL, f"exercises/{NAME}"]
    environment = {**os.environ, "COURSE_STRICT": "1", **NO_OTHER_PLUGINS}
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 1 and "NotImplementedError" in done.stdout, done.stdout[-2000:]
    nb = nbformat.reads(submission("04", solved=True).decode(), 4)
    for number, cell in enumerate(cell for cell in nb.cells if cell.cell_type == "code"):
        cell.execution_count = number + 1  # as JupyterLab saves a notebook that was run
    solved = run_nbval(tmp_path, nbformat.writes(nb).encode())
    assert solved and set(solved.values()) == {"passed"}, solved
