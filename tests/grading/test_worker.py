"""A worker leaves nothing running: not after a job, not when the grader is killed, not what lost its parent before.

A sandbox that is being built is such a case: bubblewrap asks to die with its parent only when it is done.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from grading_helpers import ROOT, alive_after

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="it is Linux that ties processes to each other")

STRAYING = """
import os, subprocess, sys, time
from course_lib.grading.run import worker

def grade_one(job):
    \"\"\"Leave a process behind whose parent is gone, in a session of its own.\"\"\"
    between = os.fork()
    if between == 0:
        stray = subprocess.Popen(["sleep", "100"], start_new_session=True)
        with open(job["told"] + ".part", "w") as file:
            file.write(str(stray.pid))
        os.rename(job["told"] + ".part", job["told"])
        os._exit(0)
    os.waitpid(between, 0)
    end = time.monotonic() + 60
    while not job["seconds"] and not os.path.exists(job["told"] + ".seen") and time.monotonic() < end:
        time.sleep(0.01)
    time.sleep(job["seconds"])
    return {"status": "graded"}

worker.grade_one = grade_one
worker._warm = lambda job, limits: None
worker.main()
"""
GRADER = """
import subprocess, sys, time
worker = subprocess.Popen([sys.executable, "-c", sys.argv[1]], stdin=subprocess.PIPE)
worker.stdin.write(sys.argv[2].encode() + b"\\n")
worker.stdin.flush()
print(worker.pid, flush=True)
time.sleep(100)
"""


def _stray(told: Path) -> psutil.Process:
    """The process that was left behind, as soon as it is told."""
    end = time.monotonic() + 60
    while not told.exists():
        assert time.monotonic() < end, "the worker did not start"
        time.sleep(0.01)
    return psutil.Process(int(told.read_text(encoding="utf-8")))


def test_what_a_job_left_behind_ends_with_it(tmp_path):
    asked = json.dumps({"told": str(tmp_path / "told"), "seconds": 0})
    with subprocess.Popen(
        [sys.executable, "-c", STRAYING], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as worker:
        worker.stdin.write(asked + "\n")
        worker.stdin.flush()
        stray = _stray(tmp_path / "told")
        (tmp_path / "told.seen").touch()  # now the job may end
        assert json.loads(worker.stdout.readline())["status"] == "graded"
        assert not alive_after([stray])
        assert worker.poll() is None, "the worker ended, too"
        worker.stdin.close()
        assert worker.wait(20) == 0


def test_what_a_job_left_behind_ends_when_the_grader_is_killed(tmp_path):
    asked = json.dumps({"told": str(tmp_path / "told"), "seconds": 100})
    with subprocess.Popen(
        [sys.executable, "-c", GRADER, STRAYING, asked], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as grader:
        worker = psutil.Process(int(grader.stdout.readline()))
        stray = _stray(tmp_path / "told")
        family = [worker, *worker.children(recursive=True)]
        assert stray in family, "the worker did not adopt it"
        grader.kill()
        assert not alive_after(family)
