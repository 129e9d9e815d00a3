"""Attacks on the machine and on others. Each bomb ends by itself; each control lifts the one limit that stops it.

After each nothing is left, no process and no file; whoever is graded next by the same worker has their points.
"""

from __future__ import annotations

import os
import time

import psutil
import pytest
from grading_helpers import alive_after, graded, job, need_sandbox, submission, task
from how_thorough import some

from course_lib.authoring import solutions
from course_lib.grading.run import pool
from course_lib.grading.run.scratch_folders import private_folder

pytestmark = pytest.mark.slow

RIGHT = "return depth_mm / 1000"
MARK = "left-behind-by-a-submission"


def answer(code: str) -> bytes:
    """Lab 00 with this code at the beginning of the right answer; `tools` holds what the source check does not see."""
    head = "tools = [__import__(n) for n in ('os', 'sys', 'time', 'socket', 'signal', 'subprocess', 'threading')]\n"
    body = "\n".join(f"    {line}" for line in code.strip().splitlines())
    return submission(
        "00",
        {
            1: f"{head}def metres(depth_mm):\n    os, sys, time, socket, signal, subprocess, threading = "
            f"tools\n{body}\n    {RIGHT}\n"
        },
    )


@pytest.fixture(autouse=True)
def _sandbox():
    need_sandbox()
    yield
    mine = psutil.Process().children(recursive=True)
    assert not [process for process in mine if process.name() == "bwrap"]
    assert not _marked(), "a process is left"
    assert not list(private_folder().glob("**/s[0-9]/*")), "sockets or files of a kernel are left"


def _marked() -> list[psutil.Process]:
    return [p for p in psutil.process_iter(["cmdline"]) if p.info["cmdline"] and MARK in p.info["cmdline"]]


LOOP = """
end = vars(time).setdefault('end', time.monotonic() + 4)  # once, not in each case
while time.monotonic() < end:
    try:
        while time.monotonic() < end:
            pass
    except BaseException:
        pass
"""
PRINTS = """
for _ in range(60):
    os.write(1, b'x' * 100_000)
    tools[1].__stdout__.flush()
    get_ipython().kernel.iopub_socket and get_ipython().display_pub.publish({'text/plain': 'x' * 100_000})
"""
MEMORY = """
held = [bytearray(50_000_000) for _ in range(12)]
time.sleep(0.3)
"""
FORKS = """
children = []
for _ in range(40):
    child = os.fork()
    if child == 0:
        time.sleep(4)
        os._exit(0)
    children.append(child)
time.sleep(0.3)
"""
DISK = """
try:
    for i in range(6):
        with open(f'/tmp/big{i}', 'wb') as file:
            file.write(bytes(8_000_000))
    full = False
except OSError:
    full = True
finally:
    for i in range(6):
        if os.path.exists(f'/tmp/big{i}'):
            os.unlink(f'/tmp/big{i}')
if full:
    raise MemoryError('the disk is full')
"""
LIMITED = {
    "a loop that ignores interrupts": (LOOP, "timeout", {"task_seconds": 1.0}, {"task_seconds": 20.0}),
    "endless output": (PRINTS, "output", {"output_mb": 2.0}, {"output_mb": 40.0}),
    "memory": (MEMORY, "memory", {"memory_mb": 400.0}, {"memory_mb": 2000.0, "task_seconds": 20.0}),
    "forks": (
        FORKS,
        "processes",
        {"processes": 20},
        {"processes": 400, "threads": 800, "task_seconds": 20.0, "memory_mb": 9000.0},
    ),
    "disk": (DISK, "raised", {"folder_mb": 20.0}, {"folder_mb": 200.0}),
}


@pytest.mark.parametrize("kind", sorted(LIMITED))
def test_a_bomb_meets_its_limit(kind):
    code, reason, tight, _ = LIMITED[kind]
    record = graded("00", answer(code), **tight)
    one = task(record, 1)
    assert (record["status"], one["points"], one["reason"]) == ("graded", 0.0, reason), one["error"]
    if reason != "raised":
        name = next(iter(tight))
        assert f"{name} = {tight[name]:g}" in one["error"], one["error"]


@pytest.mark.parametrize("kind", some(sorted(LIMITED), 2))
def test_control_with_the_limit_lifted_it_goes_off(kind):
    code, _, _, lifted = LIMITED[kind]
    one = task(graded("00", answer(code), **lifted), 1)
    assert one["points"] == 1, one["error"]  # it did all of its harm, and then gave the right answer


def test_200_mb_at_once():
    code = "get_ipython().display_pub.publish({'text/plain': 'x' * 200_000_000})"
    record = graded("00", answer(code), task_seconds=20.0)
    one = task(record, 1)
    assert one["points"] == 0 and one["reason"] in ("output", "timeout", "no answer", "memory"), one
    assert task(graded("00", answer(code.replace("200_000_000", "20"))), 1)["points"] == 1  # small, it is harmless


@pytest.mark.parametrize("sandbox", ["bwrap", "none"])
def test_it_kills_its_parent(sandbox):
    records = {}
    honest = job("00", submission("00", solved=True))
    attack = job("00", answer("os.kill(os.getppid(), signal.SIGKILL)\ntime.sleep(0.2)"), sandbox=sandbox)
    pool.grade_jobs([attack, honest], 1, records.__setitem__)
    assert records[1]["points"] == 1
    if sandbox == "bwrap":
        assert records[0]["status"] == "graded" and task(records[0], 1)["reason"] in (
            "",
            "died",
        )  # pid 1 inside is deaf
    else:
        assert records[0]["status"] == "infrastructure"  # the control: without the sandbox the grader was hit


def test_a_daemon_ends_with_its_kernel():
    code = f"""
if os.fork() == 0:
    os.setsid()
    if os.fork() == 0:
        os.execv(sys.executable, [sys.executable, '-c', 'import time; time.sleep(60)', {MARK!r}])
    os._exit(0)
"""
    assert task(graded("00", answer(code)), 1)["points"] == 1  # it does no harm inside, and the fixture looks outside
    graded("00", answer(code), sandbox="none")
    end = time.monotonic() + 5
    while not (left := _marked()) and time.monotonic() < end:  # a fork becomes the marked program a moment later
        time.sleep(0.05)
    assert left  # the control: without the sandbox it lives on
    for process in left:
        process.kill()
    assert not alive_after(left)


def test_files_of_others_cannot_be_read_or_written(tmp_path):
    secret = tmp_path / "another-submission.ipynb"
    secret.write_text("secret")
    for code in (f"open({str(secret)!r}).read()", f"open({str(tmp_path / 'left')!r}, 'w').write('x')"):
        one = task(graded("00", answer(code)), 1)
        assert one["reason"] == "raised" and "No such file" in one["error"], one["error"]
        assert task(graded("00", answer(code), sandbox="none"), 1)["points"] == 1  # the control
    assert (tmp_path / "left").exists()


def test_processes_of_others_cannot_be_seen():
    code = f"open('/proc/{os.getpid()}/environ').read()\nopen('/proc/{os.getpid()}/cmdline').read()"
    one = task(graded("00", answer(code)), 1)
    assert one["reason"] == "raised", one["error"]
    assert task(graded("00", answer(code), sandbox="none"), 1)["points"] == 1  # the control


def test_files_beside_a_notebook_do_not_run_in_the_grader(tmp_path):
    from course_lib.grading.intake.intake import IntakeLimits, read_class

    mark = tmp_path / "ran"
    evil = f"import pathlib\npathlib.Path({str(mark)!r}).touch()\n"
    folder = tmp_path / "class" / "mallory"
    folder.mkdir(parents=True)
    for name in ("conftest.py", "sitecustomize.py", "numpy.py", "nbformat.py", "course_lib.py"):
        (folder / name).write_text(evil)
    (folder / "pytest.ini").write_text("[pytest]\naddopts = -p conftest\n")
    data = submission("00", solved=True)
    (folder / "00_start_here.ipynb").write_bytes(data)
    found, _ = read_class(tmp_path / "class", lab=None, roster=None, limits=IntakeLimits(), store=tmp_path / "store")
    assert [(one.student, one.lab, one.code) for one in found] == [("mallory", "00", "")]
    records = {}
    pool.grade_jobs([job("00", data)], 1, records.__setitem__)
    assert records[0]["points"] == 1 and not mark.exists()  # the control is in test_hostile_outside: nbval runs them


def test_the_kernel_dies_twice():
    ends = "import os\nos._exit(0)\n"
    second, third = ends + "def read_points(*g): pass\n", ends + "def invert(T): pass\n"
    stays = solutions.reference("02-1")
    record = graded("02", submission("02", {1: stays, 2: second, 3: third}))
    reasons = [task(record, number)["reason"] for number in (1, 2, 3, 4)]
    assert reasons == ["", "died", "died", "not started"]
    codes = [notice["code"] for notice in record["notices"]]
    assert codes.count("restarted") == 1
    last = graded("02", submission("02", {2: second, 3: third}, solved=True))
    reasons = [task(last, number)["reason"] for number in (1, 2, 3, 4, 5)]
    assert reasons == ["", "died", "died", "died twice", "died twice"]
