"""Attacks that a review of the grader found, each with a control: the same grader with that one defence taken out.

Some of them earn nothing by themselves: they turn a 0 into "the grader failed", hand a file in as somebody else, fill
the memory or the disk of the machine unseen, or stop the report of the whole class.
"""

from __future__ import annotations

import ast
import csv
import ctypes
import inspect
import io
import os
import re
import resource
import shutil
import struct
import subprocess
import sys
import textwrap
import zipfile
from pathlib import Path
from types import ModuleType
from typing import Any

import nbformat
import numpy as np
import pytest
from fakes import standing, task_record
from grading_helpers import ROOT, exercise, graded, job, need_sandbox, submission, task
from rich.console import Console

from course_lib import tasks
from course_lib.grading import safe_text
from course_lib.grading.intake import archives, untrusted_notebook
from course_lib.grading.intake.intake import IntakeLimits, read_class
from course_lib.grading.intake.roster import Person, Roster
from course_lib.grading.intake.untrusted_notebook import Unreadable, notebook_of
from course_lib.grading.ledger.attempts import standings
from course_lib.grading.ledger.ledger import Ledger
from course_lib.grading.release import cell_source, rebuild
from course_lib.grading.release.released import released_lab
from course_lib.grading.run import engine, kernel, kernel_imports, nbval_items, sandbox, worker
from course_lib.grading.run.limits import read_limits
from course_lib.grading.tell.class_report import class_report
from course_lib.grading.tell.explain import explain
from course_lib.grading.verbs.grade import Settings, grade_folder

pytestmark = pytest.mark.slow

TOOLS = ("os", "sys", "time", "socket", "mmap", "ctypes", "fcntl", "threading")
NAME = "00_start_here.ipynb"
RIGHT = "def metres(depth_mm):\n    return depth_mm / 1000\n"


def answer(code: str, before: str = "") -> bytes:
    """Lab 00: this code, then the right answer."""
    body = textwrap.indent(code.strip(), "    ")
    head = f"tools = [__import__(name) for name in {TOOLS}]\n{before}\n"
    return submission(
        "00", {1: f"{head}def metres(depth_mm):\n    {', '.join(TOOLS)} = tools\n{body}\n    return depth_mm / 1000\n"}
    )


def weaken(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str, *changes: tuple[str, str]) -> None:
    """Put a function in its own place with some of its source changed: a grader without that defence."""
    function = getattr(owner, name)
    source = textwrap.dedent(inspect.getsource(function))
    for old, new in changes:
        assert old in source, f"{name} no longer holds {old!r}"
        source = source.replace(old, new)
    space: dict[str, Any] = {}
    exec(
        compile(f"from __future__ import annotations\n{source}", f"<weak {name}>", "exec"), function.__globals__, space
    )
    monkeypatch.setattr(owner, name, space[name])


def without_filter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Kernels whose first program sets no filter of system calls."""
    shutil.copytree(kernel_imports.INSIDE, tmp_path / "inside")
    program = tmp_path / "inside" / "kernel_main.py"
    text = program.read_text(encoding="utf-8")
    assert text.count("        refuse_calls()\n") == 1
    program.write_text(text.replace("        refuse_calls()\n", "        pass\n"), encoding="utf-8")
    monkeypatch.setattr(kernel_imports, "INSIDE", tmp_path / "inside")


def numbers() -> dict[str, int]:
    """The refused system calls by name, here; skips where they are not known."""
    import platform

    from course_lib.grading.run.inside.kernel_main import REFUSED

    if platform.machine() not in REFUSED:
        pytest.skip("no numbers of system calls are known for this machine")
    return REFUSED[platform.machine()]


# Memory, disk and keys of the machine

UNSEEN = """
libc = ctypes.CDLL(None, use_errno=True)
libc.shmat.restype, libc.shmdt.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
size, page, refused, held = 24 * 2**20, 2**20, [], []


def in_files_of_memory():
    for _ in range(4):
        held.append(os.memfd_create('x'))
        os.write(held[-1], bytes(size))


def in_segments():
    for _ in range(4):
        name = libc.shmget(0, size, 0o1600)
        if name < 0:
            raise PermissionError(ctypes.get_errno(), 'shmget')
        place = libc.shmat(name, None, 0)
        ctypes.memset(place, 1, size)
        libc.shmdt(place)


def in_a_shared_mapping():
    shared = mmap.mmap(-1, 4 * size)
    held.append(shared)
    for start in range(0, 4 * size, page):
        shared[start:start + page] = b'x' * page
        shared.madvise(mmap.MADV_DONTNEED, start, page)


def in_zeros():
    with open('/dev/zero', 'r+b') as zeros:
        held.append(mmap.mmap(zeros.fileno(), page))


for way in (in_files_of_memory, in_segments, in_a_shared_mapping, in_zeros):
    try:
        way()
    except OSError:
        refused.append(way.__name__)
time.sleep(0.2)
[os.close(one) if isinstance(one, int) else one.close() for one in held]
if refused:
    raise MemoryError(f'{len(refused)} refused')
"""


def test_memory_that_belongs_to_no_process(tmp_path, monkeypatch):
    need_sandbox()
    numbers()
    one = task(graded("00", answer(UNSEEN), memory_mb=200.0, task_seconds=10.0), 1)
    assert (one["points"], one["reason"]) == (0.0, "raised") and "4 refused" in one["error"], one["error"]
    without_filter(tmp_path, monkeypatch)
    weaken(monkeypatch, sandbox, "bwrap_command", (', "--dev-bind", "/dev/null", "/dev/zero"', ""))
    one = task(graded("00", answer(UNSEEN), memory_mb=201.0, task_seconds=10.0), 1)
    assert one["points"] == 1, one["error"]  # the control: nearly 300 MB were held under a limit of 201, unseen


DISK = """
place = [line.split()[4] for line in open('/proc/self/mountinfo') if line.split()[4].endswith(('/s0', '/s1'))][0]
held, refused = [], 0
try:
    for _ in range(6):
        held.append(os.open(place, os.O_TMPFILE | os.O_RDWR))
        os.write(held[-1], bytes(6_000_000))
except OSError:
    refused += 1
for one in held:
    os.close(one)
try:
    os.mkdir(place + '/d')
    for i in range(6):
        with open(f'{place}/d/{i}', 'wb') as file:
            file.write(bytes(6_000_000))
except OSError:
    refused += 1
for name in os.listdir(place + '/d'):
    os.unlink(f'{place}/d/{name}')
os.rmdir(place + '/d')
if refused:
    raise MemoryError(f'{refused} refused')
"""


def test_a_disk_cannot_be_filled_from_where_the_sockets_are(monkeypatch):
    need_sandbox()
    one = task(graded("00", answer(DISK), folder_mb=20.0), 1)
    assert (one["points"], one["reason"]) == (0.0, "raised") and "2 refused" in one["error"], one["error"]
    weaken(
        monkeypatch,
        sandbox,
        "bwrap_command",
        ('"--size", SOCKETS_BYTES, "--tmpfs", str(shared[1])', '"--bind", str(shared[1]), str(shared[1])'),
    )
    one = task(graded("00", answer(DISK), folder_mb=21.0), 1)
    assert one["points"] == 1, one["error"]  # the control: twice 36 MB on the grader's disk under a limit of 21


def test_the_keyring_of_whoever_grades_is_not_read(tmp_path, monkeypatch):
    need_sandbox()
    call = numbers()
    libc = ctypes.CDLL(None, use_errno=True)
    session, read, search, revoke = -3, 11, 10, 3
    key = libc.syscall(call["add_key"], b"user", b"course-test", b"hunter2", 7, session)
    if key < 0:
        pytest.skip("this machine lets nobody keep a key")
    code = f"""
libc = ctypes.CDLL(None)
key = libc.syscall({call["keyctl"]}, {search}, {session}, b'user', b'course-test', 0)
found = ctypes.create_string_buffer(64)
libc.syscall({call["keyctl"]}, {read}, key, found, 64)
if found.value != b'hunter2':
    raise PermissionError('no key')
"""
    try:
        one = task(graded("00", answer(code)), 1)
        assert one["reason"] == "raised" and "no key" in one["error"], one["error"]
        without_filter(tmp_path, monkeypatch)
        assert task(graded("00", answer(code), memory_mb=1999.0), 1)["points"] == 1  # the control
    finally:
        libc.syscall(call["keyctl"], revoke, key)


# Making the grader fail, which is never scored

GARBLED = """
shell = get_ipython().kernel
said = {'content': {'data': ['application/vnd.course-answer+json'], 'metadata': {}}, 'parent': shell.get_parent()}
shell.session.send(shell.iopub_socket, 'display_data', ident=b'display_data', **said)
raise ValueError('and no answer')
"""
FORGED = """
probe = __import__('course_probe')
tree = b'{"array":0,"dtype":"<f8","shape":[1e999]}'
size = __import__('struct').pack('<II', 3, len(tree))
probe.to_wire = lambda value: b'course-plain-1\\n' + size + b'[8]' + tree + bytes(8)
"""


def test_a_message_that_is_none(monkeypatch):
    need_sandbox()
    record = graded("00", answer(GARBLED))
    assert (record["status"], task(record, 1)["reason"]) == ("graded", "garbled"), record["reason"]
    monkeypatch.setattr(kernel, "check_message", lambda *message: None)
    assert graded("00", answer(GARBLED))["status"] == "infrastructure"  # the control: a 0 that is never scored


def test_an_answer_of_endless_shape(monkeypatch):
    need_sandbox()
    record = graded("00", answer(FORGED))
    assert (record["status"], task(record, 1)["reason"]) == ("graded", "forged"), record["reason"]
    weaken(monkeypatch, tasks, "from_wire", ("except Exception as error:", "except KeyError as error:"))
    weaken(monkeypatch, nbval_items, "_outcomes", ("except Exception:", "except ValueError:"))
    assert graded("00", answer(FORGED))["status"] == "infrastructure"  # the control


def test_an_empty_answer_of_absurd_shape(monkeypatch):
    cases = tasks.fresh(tasks.get("01-3"), 5)
    answers = [np.zeros((0, 2**62), bool)] * len(cases)
    outcomes = tasks.run_all(lambda *given: answers[0], cases)
    assert {outcome.kind for outcome in outcomes} == {"not plain"} and "(0, 4611686018427387904)" in outcomes[0].trouble
    assert tasks.judge_all(tasks.get("01-3"), cases, outcomes).points == 0
    with pytest.raises(ValueError, match="far larger"):
        tasks.from_wire(wire(b'{"array":0,"dtype":"|b1","shape":[0,4611686018427387904]}', b""))
    weaken(
        monkeypatch, sys.modules["course_lib.tasks.plain"]._Copier, "_array", ("max(value.shape) > MAX_BYTES", "False")
    )
    outcomes = tasks.run_all(lambda *given: answers[0], cases)
    with pytest.raises(ValueError, match="array is too big"):  # the control: the judge, which must not raise, does
        tasks.judge_all(tasks.get("01-3"), cases, outcomes)


def wire(tree: bytes, buffer: bytes) -> bytes:
    head = f"[{len(buffer)}]".encode()
    return b"course-plain-1\n" + struct.pack("<II", len(head), len(tree)) + head + tree + buffer


DTYPES = (
    *(
        '"O"',
        '"M8"',
        '"(1+f4"',
        '"(2,3)f4"',
        '"f8,"',
        '"i4,i4"',
        '"U4"',
        '""',
        '"f99999999999999999999"',
        "5",
        "null",
        "[]",
    ),
    *('{"of":"f4","shape":[1e999]}', '{"of":"f4","shape":[1000000000]}', '{"of":"f4"}', '"(1000000000,)f8"'),
    '{"names":["a","b"],"formats":["f4","f4"],"offsets":[0,0],"itemsize":8}',
    '{"names":["a"],"formats":["f4"],"offsets":[-4],"itemsize":8}',
    '{"names":["a"],"formats":["f4"],"offsets":[0],"itemsize":99999999999}',
    '{"names":["a","a"],"formats":["f4","f4"],"offsets":[0,4],"itemsize":8}',
)
SHAPES = (
    "[1]",
    "[8]",
    "[1e999]",
    "[-1]",
    "[0,99999999999]",
    "[99999999999999999999]",
    '["1"]',
    "[null]",
    "[]",
    "[[1]]",
)


@pytest.mark.parametrize("dtype", DTYPES)
def test_bytes_of_anybody_are_a_value_or_a_value_error(dtype):
    for shape in SHAPES:
        for buffer in (b"", bytes(8), bytes(64)):
            tree = f'{{"array":0,"dtype":{dtype},"shape":{shape}}}'.encode()
            try:
                value = tasks.from_wire(wire(tree, buffer))
            except ValueError as error:
                assert str(error)
            else:
                assert isinstance(value, (np.ndarray, bool, int, float)), tree


def added(source: str) -> nbformat.NotebookNode:
    """Lab 00 solved, with one more cell."""
    nb = nbformat.reads(submission("00", solved=True).decode(), 4)
    nb.cells.append(nbformat.v4.new_code_cell(source))
    return nb


def test_magics_without_end():
    def states(source: str) -> list[str]:
        return [one.state for one in rebuild.rebuild(added(source), released_lab("00")).answers]

    assert states("x = 1\n" + "!ls\n" * 501) == ["found"]
    cell = "'a = %x\\n' * 2842"
    ours = f"from course_lib.grading.release.cell_source import plain_python\nplain_python({cell})"
    assert seconds_of_processor(ours, 5) == 0
    usual = f"from IPython.core import inputtransformer2 as t\nt.TransformerManager().transform_cell({cell})"
    assert seconds_of_processor(usual, 5) != 0  # the control: IPython reads the cell anew for each of them


def test_a_sum_that_no_printer_of_code_survives():
    source = "%matplotlib inline\n" + "+".join(["1"] * 2500)
    assert [one.state for one in rebuild.rebuild(added(source), released_lab("00")).answers] == ["found"]
    with pytest.raises(RecursionError):  # the control
        ast.unparse(ast.parse(cell_source.plain_python(source)))


def test_time_for_the_whole_submission_is_one(monkeypatch):
    """Each kernel had all of it anew, so that a submission outlived the patience of its worker."""
    need_sandbox()
    sleeps = "".join("tools[2].sleep(1)\n" for _ in range(4))
    head = f"tools = [__import__(name) for name in {TOOLS}]\n{sleeps}"
    data = submission(
        "02",
        {
            1: head + "def row_of(u, v, width, height):\n    return v * width + u\n",
            2: head + "def read_points(*given):\n    pass\n",
        },
    )
    asked = job("02", data, total_seconds=1.5, start_seconds=1.5)
    monkeypatch.setattr(worker, "SLACK_SECONDS", 0.2)
    whole = job("02", data, total_seconds=1.5, start_seconds=20.0)
    record = worker.grade_apart(whole)
    assert record["status"] == "graded" and [one["reason"] for one in record["tasks"][:2]] == ["timeout"] * 2
    assert "total_seconds = 1.5" in task(record, 2)["error"]
    weaken(monkeypatch, nbval_items.Run, "end_kernel", ("self.left - self.kernel.age()", "self.left"))
    assert worker.grade_apart(asked)["status"] == "infrastructure"  # the control


# Work for the trusted side that grows without end


def test_empty_lines_are_not_multiplied(monkeypatch):
    source = "\n" * 20_000 + "".join(f"a{i} = {i}\n" for i in range(30)) + RIGHT
    written: list[int] = []

    def noted(nb: nbformat.NotebookNode, path: Path) -> None:
        written.append(sum(len(cell.source) for cell in nb.cells))
        raise OSError("seen enough")

    need_sandbox()
    monkeypatch.setattr(nbformat, "write", noted)
    graded("00", submission("00", {1: source}))
    monkeypatch.setattr(engine, "MOST_LINES", 10**9)
    graded("00", submission("00", {1: source}))
    assert written[0] < 200_000 < 1_000_000 < written[1]  # the control: 20 kB became more than a megabyte


@pytest.mark.parametrize("count", [200, 400])
def test_a_chain_of_helpers_takes_steps_as_it_is_long(count, monkeypatch):
    nb = added("x0 = 0\n" + "".join(f"x{i + 1} = x{i}\n" for i in range(count)))
    next(cell for cell in nb.cells if cell.id == "task-1").source = f"def metres(depth_mm):\n    return x{count}\n"
    steps: list[int] = []
    bound = cell_source.bound
    monkeypatch.setattr(rebuild, "bound", lambda statement: steps.append(1) or bound(statement))
    [one] = rebuild.rebuild(nb, released_lab("00")).answers
    assert one.source.count("\n") > count and len(one.pieces) <= rebuild.MOST_PIECES + 2
    assert len(steps) < 10 * count, "the statements are read again for each other one"


def seconds_of_processor(code: str, most: int) -> int:
    """The exit code of a Python that is ended after so many seconds of processor time."""
    limit = lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most))  # noqa: E731
    words = [sys.executable, "-c", code]
    return subprocess.run(words, cwd=ROOT, preexec_fn=limit, capture_output=True, check=False).returncode


def test_a_text_that_never_ends_is_read_once():
    begin = "text = '{\"' + (chr(92) + chr(34)) * 300_000\n"
    ours = "from course_lib.grading.intake.untrusted_notebook import _depth\n" + begin + "assert _depth(text) == 1"
    assert seconds_of_processor(ours, 20) == 0
    usual = "import re\n" + begin + r"""list(re.finditer(r'"(?:[^"\\]|\\.)*"|[\[{]|[\]}]', text, re.S))"""
    assert seconds_of_processor(usual, 1) != 0  # the control: begun anew at each of the quotes


@pytest.mark.parametrize(
    ("text", "depth"), [('{"a": "[[["}', 1), (r'["\"[", [[]]]', 3), (r'["\\", {"b": []}]', 3), ('["[[', 1)]
)
def test_depth_outside_of_texts(text, depth):
    assert untrusted_notebook._depth(text) == depth


def test_more_code_than_anybody_writes_is_refused():
    nb = exercise("00")
    nb.cells[-1:] = [nbformat.v4.new_code_cell("x = 1\n" * 1000)]
    data = nbformat.writes(nb).encode()
    with pytest.raises(Unreadable, match="4,000 is the most") as caught:
        notebook_of(data, IntakeLimits(code_letters=4000))
    assert caught.value.code == "too much code" and notebook_of(data, IntakeLimits())


def listing(count: int) -> bytes:
    """A zip of nothing but a list of as many files."""
    one = struct.pack("<IHHHHHHIIIHHHHHII", 0x02014B50, 20, 20, 0, 0, 0, 33, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0) + b"a"
    end = struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, count % 65536, count % 65536, len(one) * count, 0, 0)
    return one * count + end


def test_a_zip_that_lists_millions(monkeypatch):
    made: list[int] = []
    info = zipfile.ZipInfo

    class Counted(info):
        def __init__(self, *given: Any) -> None:
            made.append(1)
            super().__init__(*given)

    monkeypatch.setattr(zipfile, "ZipInfo", Counted)
    limits = IntakeLimits(archive_members=20)
    with pytest.raises(Unreadable, match="far more than 20 files"):
        list(archives.members(listing(2000), limits))
    assert not made
    monkeypatch.setattr(archives, "NAME_BYTES", 10**9)
    with pytest.raises(Unreadable, match="2000 files"):
        list(archives.members(listing(2000), limits))
    assert len(made) == 2000  # the control: all were read into memory before they were counted


# Harm to others

ROSTER = Roster((Person("1001", "Mal Ory"), Person("1002", "Bob Honest")))
AS_BOB = (
    "Mal Ory/Bob Honest_1002_assignsubmission_file_/lab.ipynb",
    "Mal Ory/bob_1002_5_00_start_here-9.ipynb",
    "Mal Ory_1001_assignsubmission_file_/Bob Honest_1002_assignsubmission_file_/lab.ipynb",
    "malory_1001_5_Bob Honest_1002_assignsubmission_file_lab.ipynb",
    "Bob_1002_assignsubmission_file__1001_assignsubmission_file_/lab.ipynb",
)


@pytest.mark.parametrize("name", AS_BOB)
def test_nobody_hands_in_as_somebody_else(name, tmp_path, monkeypatch):
    path = tmp_path / "class" / name
    path.parent.mkdir(parents=True)
    path.write_bytes(submission("00", solved=True))

    def who() -> str:
        [one], _ = read_class(path, lab="00", roster=ROSTER, limits=IntakeLimits(), store=tmp_path / "s")
        return one.student

    path = tmp_path / "class"
    assert who() in ("1001", "")
    from course_lib.grading.intake import authorship, intake

    def innermost(parts: tuple[str, ...]) -> authorship.Author:
        for part in (*parts[:-1][::-1], parts[-1]):
            if moodle := authorship._MOODLE.match(part):
                return authorship.Author("moodle", (moodle["id"],), ("",), False, 0)
        if canvas := authorship._CANVAS.match(parts[-1]):
            return authorship.Author("canvas", (canvas["id"],), ("",), False, 0)
        raise AssertionError(parts)

    monkeypatch.setattr(intake, "author", innermost)
    assert who() == "1002"  # the control: the part that is named by whoever handed in was believed


def test_a_refused_answer_does_not_take_the_helpers_of_the_next(monkeypatch):
    need_sandbox()
    nb = nbformat.reads(submission("02", solved=True).decode(), 4)
    cells = {slot.task.number: next(c for c in nb.cells if c.id == slot.cell) for slot in released_lab("02").slots}
    nb.cells.insert(2, nbformat.v4.new_code_cell("def half(x):\n    return x / 2\n"))
    cells[1].source = "def row_of(u, v, width, height):\n    import cv2\n    return v * width + u + half(0)\n"
    cells[3].source = cells[3].source.replace("    return ", "    half(2)\n    return ", 1)
    data = nbformat.writes(nb).encode()
    record = graded("02", data)
    assert (task(record, 1)["status"], task(record, 3)["points"]) == ("refused", 2.0), task(record, 3)["error"]
    weaken(monkeypatch, rebuild, "_fill", ("answer.pieces += pieces", "answer.pieces += [] if notices else pieces"))
    assert "name 'half' is not defined" in task(graded("02", data), 3)["error"]  # the control: brought once


def test_names_do_not_speak_to_the_terminal(tmp_path, monkeypatch):
    evil = "\x1b]0;graded\x07eve\nbob  lab 00  0 of 1"
    folder = tmp_path / "class" / evil
    folder.mkdir(parents=True)
    (folder / "00_start_here\x1b[2J.py").write_text("x")

    def shown(out: Path) -> str:
        told = io.StringIO()
        settings = Settings(tmp_path / "class", out, lab="00", seed=5, sandbox="none")
        grade_folder(settings, lambda jobs, on_record: None, Console(file=told, width=200))
        with Ledger(out / "ledger.sqlite", write=False) as ledger:
            [one] = standings(ledger, "00")
            lines = explain(ledger, one, tasks.get("00-1"))
            return told.getvalue() + "\n" + "\n".join(lines)

    assert "\x1b" not in shown(tmp_path / "a") and "needs a person" in shown(tmp_path / "b")
    assert not any(line.startswith("bob") for line in shown(tmp_path / "c").splitlines())
    for name in ("verbs.grade", "tell.explain"):
        module: ModuleType = sys.modules[f"course_lib.grading.{name}"]
        monkeypatch.setattr(module, "clean", lambda text, most=0: str(text))
    assert "\x1b" not in shown(tmp_path / "d")  # paths and ids are visible from the beginning
    monkeypatch.setattr(sys.modules["course_lib.grading.intake.intake"], "shown", str)
    assert "\x1b" in shown(tmp_path / "e")  # the control


@pytest.mark.parametrize("text", ["x;=1+1", "x; @SUM(A1)", 'x;"=cmd|x', "x;\u200b=1", "a;b;-1+1"])
def test_no_cell_runs_where_a_semicolon_begins_one(text, monkeypatch):
    def runs() -> bool:
        row = ",".join(["1", safe_text.safe_cell(text), "2"])
        cells = next(csv.reader([row], delimiter=";"))
        return any(cell.strip(" \u200b\"'\t")[:1] in tuple("=+-@") and "'" not in cell for cell in cells)

    assert not runs()
    monkeypatch.setattr(safe_text, "_HIDDEN", re.compile("(never)^"))
    assert runs()  # the control


def test_no_two_students_share_a_page():
    mine, theirs = "eve-.-.---.....--..-", "eve-.-.....-..-.--.-"  # found in a second by trying names
    assert safe_text.page_name(mine, "00") != safe_text.page_name(theirs, "00")
    short = [re.sub(r"(?<=eve-[0-9a-f]{8})[0-9a-f]+", "", safe_text.page_name(one, "00")) for one in (mine, theirs)]
    assert short[0] == short[1]  # the control: with eight digits of the hash, one page would be the other's


def test_a_source_without_end_does_not_stop_the_report():
    source = "-" * 19_000 + "1"
    with pytest.raises(MemoryError):
        ast.parse(source)  # the control: what Python's parser makes of it
    page = class_report([standing("ann", "Ann", [task_record(source=source)])])
    assert "Ann" in page or "None stand out" in page


# What was tried and did not succeed, with what it would have found outside


def test_nothing_of_the_grader_is_inherited(tmp_path, monkeypatch):
    need_sandbox()
    secret = tmp_path / "secret.txt"
    secret.write_text("s3cret-file")
    monkeypatch.setenv("COURSE_TEST_SECRET", "s3cret-word")
    handle = os.open(secret, os.O_RDONLY)
    os.set_inheritable(handle, True)
    code = """
seen = repr(dict(os.environ))
for process in filter(str.isdigit, os.listdir('/proc')):
    for what in ('environ', 'cmdline', 'mountinfo'):
        try:
            seen += open(f'/proc/{process}/{what}', errors='replace').read()
        except OSError:
            pass
    try:
        seen += ''.join(os.readlink(f'/proc/{process}/fd/{n}') for n in os.listdir(f'/proc/{process}/fd'))
    except OSError:
        pass
if any(word in seen for word in WORDS):
    raise ValueError('found')
"""
    try:
        words = ("s3cret-word", secret.name, "987654321", "PYTEST_CURRENT_TEST")
        one = task(graded("00", answer(code.replace("WORDS", repr(words))), seed=987654321), 1)
        assert one["points"] == 1, one["error"]
        found = task(graded("00", answer(code.replace("WORDS", repr(("/course",))))), 1)
        assert "found" in found["error"]  # the control: it does see what is there
    finally:
        os.close(handle)


def test_no_terminal_is_written_to():
    need_sandbox()
    code = """
try:
    fcntl.ioctl(os.open('/dev/tty', os.O_RDWR), 0x5412, b'x')
except OSError:
    raise PermissionError('no terminal') from None
"""
    one = task(graded("00", answer(code)), 1)
    assert one["reason"] == "raised" and "no terminal" in one["error"], one["error"]


def test_answers_kept_from_one_question_do_not_serve_another():
    """A thread that answers first, and again, under the nonce that it reads from the question."""
    need_sandbox()
    code = """
shell = get_ipython().kernel
source = shell.get_parent()['content']['code']
nonce = __import__('re').search(r'[0-9a-f]{32}', source)[0]
publish = __import__('IPython.display', fromlist=['x']).publish_display_data
early = {'kind': 'answer', 'answer': '', 'trouble': '', 'printed': '', 'warned': ''}
publish({'application/vnd.course-answer+json': {'nonce': nonce, 'answers': [early, early]}})
"""
    one = task(graded("00", answer(code)), 1)
    assert (one["points"], one["reason"]) == (0.0, "doubled"), one["error"]
    assert task(graded("00", answer(code.replace("publish({", "str({"))), 1)["points"] == 1  # the control: asked once


def test_an_array_that_changes_while_it_is_copied():
    need_sandbox()
    source = """
class Changing(np.ndarray):
    turn = [0]

    def tobytes(self, *given):
        return b'x' * 10_000_000

    @property
    def shape(self):
        self.turn[0] += 1
        return (4, 6) if self.turn[0] % 2 else (10**9,)

    @property
    def nbytes(self):
        return -(10**9)


def metres(depth_mm):
    return np.zeros((4, 6)).view(Changing)
"""
    record = graded("00", submission("00", {1: source}))
    assert (record["status"], record["points"]) == ("graded", 0.0), record["reason"]
    assert task(record, 1)["reason"] in ("wrong", "raised", "forged"), task(record, 1)
    assert read_limits().answer_mb < 64
