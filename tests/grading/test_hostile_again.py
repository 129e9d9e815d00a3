"""Attacks that a second review of the grader found, each with a control: the same without the defence against it."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nbval.plugin
import numpy as np
import psutil
import pytest
from grading_helpers import graded, need_sandbox, submission, task
from test_hostile_found import RIGHT, seconds_of_processor, weaken, wire

from course_lib import tasks
from course_lib.grading.intake.intake import IntakeLimits
from course_lib.grading.intake.untrusted_notebook import Unreadable, notebook_of
from course_lib.grading.release import cell_source
from course_lib.grading.run import counting, grade_submission, kernel, pool, reading, sandbox, watchdog
from course_lib.grading.run.inside.course_probe import MIME
from course_lib.grading.run.limits import read_limits
from course_lib.grading.run.reading import read_apart
from course_lib.grading.run.sandbox import NoSandbox, probe_sandbox

pytestmark = pytest.mark.slow

# Inputs that can be known before they are asked


def drawn(number: str, seed: int) -> list[float]:
    """The first numbers that a task of lab 03 draws when it is graded."""
    seen: list[float] = []

    def cases(rng: np.random.Generator) -> list[tasks.Case]:
        seen.extend(rng.random(4))
        return [tasks.Case(dict.fromkeys(one.arguments, 0))]

    one = dataclasses.replace(tasks.get(number), cases=cases)
    grade_submission.fresh_cases(one, seed)
    return seen


def test_the_inputs_of_one_task_do_not_tell_those_of_another():
    assert drawn("03-2", 5) == drawn("03-2", 5) != drawn("03-5", 5)


GUESS = """
import numpy as np
def estimate_focal(pixels, depths, lengths, cx, cy):
    for number in range(350):
        rng = np.random.default_rng([number // 7, number % 7])
        f = float(rng.uniform(350, 900))
        if 319.5 + (rng.choice([-1.0, 1.0], 2) * rng.uniform((35, 25), (70, 50)))[0] == cx:
            return f
    raise ValueError("no seed fits")
"""


def test_a_seed_is_not_found_by_trying(monkeypatch):
    need_sandbox()
    one = task(graded("03", submission("03", {5: GUESS}), seed=2, task_seconds=20.0), 5)
    assert one["points"] == 0 and "no seed fits" in one["error"], one["error"]
    weaken(monkeypatch, grade_submission, "fresh_cases", ("fresh(task, own,", "fresh(task, seed,"))
    one = task(graded("03", submission("03", {5: GUESS}), seed=2, task_seconds=20.0), 5)
    assert one["points"] > 0, one["error"]  # the control


# What lies where the sandbox looks


def test_grades_below_a_folder_that_is_seen_inside_are_refused():
    need_sandbox()
    with pytest.raises(NoSandbox, match="/usr/lib/grades lies in /usr/lib, which submitted code can read"):
        probe_sandbox((Path("/usr/lib/grades"),))
    with pytest.raises(NoSandbox, match="which submitted code can read"):
        probe_sandbox((Path(os.__file__).parent / "course",))
    assert probe_sandbox((Path("/usr/src/grades"),)).kind == "bwrap"  # of /usr there are only the libraries


def test_the_probe_looks_for_the_files_of_this_course(monkeypatch):
    need_sandbox()
    held, bound = probe_sandbox(), sandbox._bound()
    assert sandbox._look(held, [sandbox.ROOT]) == ""
    monkeypatch.setattr(sandbox, "_bound", lambda: [*bound, str(sandbox.ROOT)])
    assert f"{sandbox.ROOT}/course.py" in sandbox._look(held, [sandbox.ROOT])


# What is read before anything is run


def test_a_magic_is_taken_out_where_a_statement_begins_and_only_there():
    cell = (
        """%%time
def f(a, b):
    %time g()
    x = !ls -l \\
  more
    return """
        + "'''\\n%kept\\n'''"
        + """ % (
  a
  % b)
f?
?f
np.sum??
y = '%d' % 3
z = %x
!it's (
w = "it's" if a != 3 else b  # don't (
%end"""
    )
    lines = cell_source.plain_python(cell).split("\n")
    assert len(lines) == cell.count("\n") + 1 and cell_source.parse("\n".join(lines))[0] is not None
    changed = [i for i, (new, old) in enumerate(zip(lines, cell.split("\n"), strict=True)) if new != old]
    assert [cell.split("\n")[i][:12].split("(")[0].strip() for i in changed] == [
        *("%%time", "%time g", "x = !ls", "more", "f?", "?f", "np.sum??", "z = %x", "!it's", "%end")
    ]


def why_not(read: Callable[[], Any]) -> str:
    """Why something is not read, within a second and 200 MB."""
    with pytest.raises(Unreadable) as caught:
        read_apart(read, 1.0, 200.0)
    return caught.value.code


def test_who_reads_has_limits_of_time_and_memory():
    assert read_apart(lambda: {"a": [1, "\ud83d"]}, 1.0, 200.0) == {"a": [1, "\ud83d"]}

    def for_ever() -> None:
        while True:
            pass

    assert why_not(for_ever) == "too much to read"
    assert why_not(lambda: bytearray(300_000_000)) == "too much to read"
    assert why_not(lambda: os.kill(os.getpid(), 9)) == "too much to read"
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):  # our own fault is no notebook's
        read_apart(lambda: 1 / 0, 1.0, 200.0)


def test_a_notebook_that_takes_too_long_to_read_waits_for_a_person(monkeypatch):
    slow = lambda nb, lab: time.sleep(100)  # noqa: E731
    monkeypatch.setattr(reading, "rebuild", slow)
    record = graded("00", submission("00"), read_seconds=0.5, sandbox="none")
    assert record["status"] == "unreadable" and "read_seconds = 0.5" in record["reason"]


def test_braces_of_a_file_do_not_fill_the_memory():
    data = b'{"cells": [' + b"{}," * 600_000 + b'{"cell_type": "code", "source": "x = 1"}]}'
    with pytest.raises(Unreadable) as caught:
        notebook_of(data, IntakeLimits(cells=10**6))
    assert caught.value.code == "too many things"
    quoted = data.replace(b"{}", b'"{"')  # in texts, braces are letters
    assert notebook_of(quoted, IntakeLimits(cells=10**6))


@pytest.mark.parametrize("count", [64, 65])
def test_records_have_at_most_64_fields(count):
    value = np.zeros(2, [(f"f{i}", "f4") for i in range(count)])
    inner = np.zeros(2, [("a", [(f"f{i}", "f4") for i in range(count - 1)])])
    if count == 64:
        assert tasks.from_wire(tasks.to_wire(value)).dtype == value.dtype
        assert tasks.plain(inner).dtype == inner.dtype
        return
    for one in (value, inner):
        with pytest.raises(ValueError, match="more than 64 fields"):
            tasks.plain(one)
    monkey = json.dumps({"names": [f"f{i}" for i in range(count)], "formats": ["f4"] * count})
    for dtype in (monkey, '"' + "f4," * 300 + 'f4"'):
        tree = f'{{"array":0,"dtype":{dtype},"shape":[0]}}'.encode()
        with pytest.raises(ValueError, match="more than 64 fields"):
            tasks.from_wire(wire(tree, b""))


# What comes from the kernel, and what it is asked through

BEHIND = """
import threading, time
def send_behind(text):
    time.sleep(0.5)
    session = get_ipython().kernel.session
    parts = [session.pack(session.msg_header("status")), b"{}", b"{}", text]
    whole = [b"status", b"<IDS|MSG>", session.sign(parts), *parts]
    get_ipython().kernel.iopub_thread.socket.send_multipart(whole)
"""
BRACES = (
    BEHIND
    + """
text = b'{"execution_state":"busy","x":[' + b"{}," * COUNT + b"{}]}"
threading.Thread(target=send_behind, args=(text,)).start()
time.sleep(2)
def metres(depth_mm):
    return depth_mm / 1000
"""
)


def grown(ask: Callable[[], Any]) -> tuple[Any, float]:
    """What is returned, and by how many megabytes this process grew meanwhile."""
    me = psutil.Process()
    seen, ended = [me.memory_info().rss], threading.Event()

    def look() -> None:
        while not ended.wait(0.005):
            seen.append(me.memory_info().rss)

    watching = threading.Thread(target=look)
    watching.start()
    try:
        return ask(), (max(seen) - seen[0]) / 1e6
    finally:
        ended.set()
        watching.join()


def braces(count: int, **limits: float) -> tuple[str, float]:
    """Why there is no answer to one who sends so many braces, and how much the grader grew by them."""
    data = submission("00", {1: BRACES.replace("COUNT", str(count))})
    record, more = grown(lambda: graded("00", data, **limits))
    assert record["status"] == "graded", record["reason"]
    return task(record, 1)["reason"], more


def test_a_message_is_limited_where_it_is_received(monkeypatch):
    need_sandbox()
    reason, more = braces(20_000_000)  # 60 MB
    assert reason == "output" and more < 100
    reason, more = braces(7_000_000)  # 21 MB, which may be sent
    assert reason == "garbled" and more < 150
    monkeypatch.setattr(kernel, "weigh", lambda parts: None)
    assert braces(7_000_000)[1] > 300  # the control: read, they are ten times as large


SHOWN = "import sys\nsys.stdout.write(('x' * 900_000 + '\\\\b' * 900_000))\n" + RIGHT


def test_what_is_printed_is_counted_and_not_read(monkeypatch):
    """nbval takes backspaces out of what a cell printed by a regular expression, over and over."""
    need_sandbox()
    seen: list[str] = []
    monkeypatch.setattr(nbval.plugin, "coalesce_streams", lambda outs: seen.extend(map(str, outs)) or outs)
    assert task(graded("00", submission("00", {1: SHOWN})), 1)["points"] == 1 and not seen
    needed = kernel.needed
    monkeypatch.setattr(kernel, "needed", lambda said: said if said["msg_type"] == "stream" else needed(said))
    assert task(graded("00", submission("00", {1: SHOWN})), 1)["points"] == 1
    assert max(map(len, seen)) > 1_000_000  # the control


FLOODS = {
    "answers that nobody asked for": ("publish({MIME: {'nonce': '0' * 32, 'answers': 'x' * 900_000}})", "oversized"),
    "replies that nobody asked for": ("k.session.send(k.iopub_socket, 'error', ERROR)", "output"),
}


@pytest.mark.parametrize("kind", sorted(FLOODS))
def test_a_flood_of_messages_ends(kind):
    need_sandbox()
    code, reason = FLOODS[kind]
    source = f"""
from IPython.display import publish_display_data as publish
k, MIME = get_ipython().kernel, {MIME!r}
ERROR = dict(ename="x", evalue="x", traceback=["x" * 2000] * 20)
for _ in range(20_000):
    {code}
{RIGHT}"""
    one, more = grown(lambda: task(graded("00", submission("00", {1: source}), answer_mb=2.0, cell_seconds=20.0), 1))
    assert (one["points"], one["reason"]) == (0.0, reason), one
    assert more < 200


def test_a_heading_that_takes_long_to_find_is_not_looked_for():
    heading = "'## Task 1 - x' + '(1 points,' * 100_000"
    ours = f"""
import nbformat
from course_lib.grading.release.rebuild import rebuild
from course_lib.grading.release.released import released_lab
rebuild(nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell({heading})]), released_lab("00"))
"""
    assert seconds_of_processor(ours, 15) == 0
    usual = f"from course_lib.authoring.notebooks import task_heading\ntask_heading({heading})"
    assert seconds_of_processor(usual, 15) != 0  # the control


LINKED = """
import glob, os, socket, time
def leave():
    for number in os.listdir("/proc/self/fd"):
        try:
            one = socket.socket(fileno=os.dup(int(number)))
        except OSError:
            continue
        try:
            if one.family == socket.AF_UNIX and str(one.getsockname()).endswith("z-1"):
                if not one.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN):
                    one.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        one.close()
place = [line.split()[-1] for line in open("/proc/net/unix") if line.split()[-1].endswith("z-1")][0]
os.unlink(place)
os.symlink(VICTIM, place)
leave()
time.sleep(2)
def metres(depth_mm):
    return depth_mm / 1000
"""


def test_a_link_in_the_place_of_a_socket_is_not_followed(monkeypatch):
    need_sandbox()
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX) as victim:
        victim.bind(f"{folder}/v")
        victim.listen()
        victim.settimeout(0.1)
        data = submission("00", {1: LINKED.replace("VICTIM", repr(f"{folder}/v"))})
        assert task(graded("00", data), 1)["points"] == 0
        with pytest.raises(TimeoutError):
            victim.accept()
        weaken(
            monkeypatch,
            kernel.Kernel,
            "_start",
            ("self.km.client(context=self.context)", "self.km.client()"),
            ('str(self._closed / "z")', 'f"/proc/{self.process.children(recursive=True)[-1].pid}/root{self._open}/z"'),
        )
        graded("00", data)
        victim.accept()[0].close()  # the control: the grader has come here


def test_a_kernel_that_takes_no_requests_does_not_hold_the_grader(monkeypatch):
    need_sandbox()
    data = submission("00", {1: LINKED.replace("VICTIM", repr("/tmp/none")).replace("sleep(2)", "sleep(0)")})
    began = time.monotonic()
    assert graded("00", data)["status"] == "graded" and time.monotonic() - began < 30


# What is counted

NAMED = """
import ctypes, threading, time
ctypes.CDLL(None).prctl(15, b"Threads:\\t1", 0, 0, 0)
threading.stack_size(65536)
for _ in range(150):
    threading.Thread(target=time.sleep, args=(1.5,), daemon=True).start()
time.sleep(1)
def metres(depth_mm):
    return depth_mm / 1000
"""


def test_a_name_like_a_line_of_a_report_hides_no_threads(monkeypatch):
    need_sandbox()
    one = task(graded("00", submission("00", {1: NAMED}), threads=100), 1)
    assert one["reason"] == "processes" and "threads = 100" in one["error"], one
    weaken(monkeypatch, watchdog, "used_by", ('_entries(one, "task")', "one.num_threads()"))
    assert task(graded("00", submission("00", {1: NAMED}), threads=100), 1)["points"] == 1  # the control


LARGER = """
import socket
for way in (lambda: socket.socket(socket.AF_INET), lambda: socket.socketpair()[0].setsockopt(1, 7, 4_000_000)):
    try:
        way()
    except OSError:
        pass
    else:
        raise ValueError("it was allowed")
"""
FULL = (
    LARGER
    + """
import os, time
for _ in range(2):
    if os.fork() == 0:
        held = []
        try:
            while True:
                held.append(socket.socketpair())
                held[-1][0].setblocking(False)
                held[-1][0].send(bytes(200_000))
        except OSError:
            time.sleep(3)
            os._exit(0)
time.sleep(1)
def metres(depth_mm):
    return depth_mm / 1000
"""
)


def test_what_sockets_hold_is_counted(monkeypatch):
    need_sandbox()
    limits = {"memory_mb": 260.0, "cell_seconds": 9.0}
    one = task(graded("00", submission("00", {1: FULL}), **limits), 1)
    assert one["reason"] == "memory", one
    monkeypatch.setattr(counting, "BUFFER", 0)
    assert task(graded("00", submission("00", {1: FULL}), **limits), 1)["points"] == 1  # the control


def test_half_a_character_in_what_it_prints_costs_nothing(monkeypatch):
    need_sandbox()
    code = r"""
print("\ud83d")
def metres(depth_mm):
    print("\ud83d")
    __import__("warnings").warn("\ud83d")
    return depth_mm / 1000
"""
    assert task(graded("00", submission("00", {1: code})), 1)["points"] == 1
    raised = code.replace("return", 'raise ValueError("\\ud83d") #')
    assert "\\ud83d" in task(graded("00", submission("00", {1: raised})), 1)["error"]
    assert tasks.run(lambda: print("\ud83d"), tasks.Case({})).printed == "\\ud83d\n"


# Time that somebody else takes


BUSY = """
tools = [__import__("time")]
def metres(depth_mm):
    end = tools[0].process_time() + 0.6
    while tools[0].process_time() < end:
        pass
    return depth_mm / 1000
"""
SHARE = 4
"""So many processes beside it take the processor."""


def test_time_is_that_of_the_processor(monkeypatch):
    """A slow and right answer beside others who compute: by the clock it takes several times as long."""
    need_sandbox()
    monkeypatch.setattr(counting, "PATIENCE", 100)
    loop = "import time\nend = time.monotonic() + 60\nwhile time.monotonic() < end: pass"
    cores = len(os.sched_getaffinity(0))
    beside = [subprocess.Popen([sys.executable, "-c", loop], start_new_session=True) for _ in range(SHARE * cores)]
    cases = len(grade_submission.fresh_cases(tasks.get("00-1"), 5))
    limits = {"task_seconds": 0.6 * cases * 1.5, "start_seconds": 60.0, "cell_seconds": 20.0}
    try:
        one = task(graded("00", submission("00", {1: BUSY}), **limits), 1)
        assert one["points"] == 1, one
        monkeypatch.setattr(kernel, "spent", lambda since, now: now.clock - since.clock)
        one = task(graded("00", submission("00", {1: BUSY}), **limits), 1)
        assert one["reason"] == "timeout", one  # the control
    finally:
        for process in beside:
            process.kill()
            process.wait()


def test_waiting_is_not_for_ever():
    need_sandbox()
    source = "tools = [__import__('time')]\ndef metres(depth_mm):\n    tools[0].sleep(100)\n"
    began = time.monotonic()
    one = task(graded("00", submission("00", {1: source}), task_seconds=1.0), 1)
    assert one["reason"] == "timeout" and time.monotonic() - began < 20, one


def test_who_runs_out_of_time_beside_others_is_graded_once_more_alone():
    calls: list[int] = []

    def beside(jobs: list[dict], on_record: Callable[[int, Any], None]) -> None:
        calls.append(len(jobs))
        for place, one in enumerate(jobs):
            late = one["late"] > 0 if len(jobs) > 1 else one["late"] > 1
            on_record(place, {"of": one["of"], "tasks": [{"reason": "timeout" if late else ""}]})

    told: dict[int, Any] = {}
    pool.repeat_late(beside, [{"of": i, "late": i % 3} for i in range(4)], told.__setitem__)
    assert calls == [4, 1, 1] and {i: told[i]["of"] for i in range(4)} == dict(enumerate(range(4)))
    assert [told[i]["tasks"][0]["reason"] for i in range(4)] == ["", "", "timeout", ""]


# Where Linux counts by itself


def test_a_control_group_is_told_its_limits_and_tells_what_is_used(tmp_path):
    """Of the files that Linux would make there: this machine may have none that counts."""
    for name in ("memory.max", "pids.max", "memory.oom.group"):
        (tmp_path / name).touch()
    told = {"memory.events": "low 0\noom_kill 0\n", "cpu.stat": "usage_usec 2500000\nuser_usec 1\n"}
    for name, text in {**told, "pids.current": "7\n", "memory.current": "123456\n", "cgroup.procs": ""}.items():
        (tmp_path / name).write_text(text)
    group = counting.Group(tmp_path, read_limits())
    assert (tmp_path / "memory.max").read_text() == "2000000000" and (tmp_path / "pids.max").read_text() == "200"
    assert group.used() == counting.Used(memory=123456, threads=7, processor=2.5) and not group.killed()
    (tmp_path / "memory.events").write_text("oom_kill 1\n")
    assert group.killed()
    done = subprocess.run(group.entered(["/bin/echo", "a b"]), capture_output=True, text=True, check=True)
    assert done.stdout == "a b\n" and (tmp_path / "cgroup.procs").read_text() == "0\n"


@pytest.mark.parametrize(("known", "used"), [("cpu memory pids", True), ("hugetlb", False), ("", False)])
def test_a_control_group_is_used_only_where_it_counts(tmp_path, monkeypatch, known, used):
    (tmp_path / "cgroup.procs").touch()
    made: list[Path] = []
    mkdir = Path.mkdir

    def as_linux_does(path: Path, *given: Any, **named: Any) -> None:
        mkdir(path, *given, **named)
        made.append(path)
        (path / "cgroup.controllers").write_text(known)

    monkeypatch.setattr(Path, "mkdir", as_linux_does)
    monkeypatch.setattr(Path, "rmdir", shutil.rmtree)
    assert counting._counts(tmp_path) is used
    assert len(made) == 1 and not made[0].exists()
