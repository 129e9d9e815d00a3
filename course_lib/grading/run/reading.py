"""Reading what anybody wrote, in a process of its own, which gets no more than its share of time and memory."""

from __future__ import annotations

import json
import os
import resource
import select
import signal
import time
from collections.abc import Callable
from typing import Any

import psutil

from course_lib.grading.intake.untrusted_notebook import Unreadable
from course_lib.grading.run.die_with_parent import die_with_parent

__all__ = ["all_of", "read_apart"]

PATIENCE = 3
"""It may wait so many times as long as it may compute: others may compute meanwhile."""


def read_apart(read: Callable[[], Any], seconds: float, megabytes: float) -> Any:
    """What a function returns, which is plain data, called in a process that ends when it has used its share.

    Raises
    ------
    Unreadable
        As the function raises it, or if it used all of its share.
    """
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        _answer(read, writer, seconds, megabytes)
    os.close(writer)
    try:
        text = all_of(reader, time.monotonic() + PATIENCE * seconds)
    finally:
        os.close(reader)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    if not text:
        told = f"read_seconds = {seconds:g}, read_mb = {megabytes:g}"
        raise Unreadable("too much to read", f"reading the notebook takes more than is allowed ({told}).")
    told = json.loads(text)
    if "failed" in told:
        raise RuntimeError(f"reading the notebook: {told['failed']}")
    if "code" in told:
        raise Unreadable(told["code"], told["sentence"])
    return told["value"]


def _answer(read: Callable[[], Any], writer: int, seconds: float, megabytes: float) -> None:
    """Call the function under limits and write what came of it; never returns."""
    code = 1
    try:
        die_with_parent()
        most = psutil.Process().memory_info().vms + int(megabytes * 1e6)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CPU, (max(1, int(seconds)),) * 2)
        try:
            text = json.dumps({"value": read()})
        except Unreadable as error:
            text = json.dumps({"code": error.code, "sentence": error.sentence})
        except (MemoryError, RecursionError):
            text = ""
        except Exception as error:  # our own fault, not the notebook's: raised where it was asked for
            text = json.dumps({"failed": f"{type(error).__name__}: {error}"})
        with os.fdopen(writer, "wb") as out:
            out.write(text.encode())
        code = 0
    finally:
        os._exit(code)


def all_of(reader: int, deadline: float) -> bytes:
    """Everything that comes until the other end is closed; nothing if that takes too long."""
    parts = []
    while (left := deadline - time.monotonic()) > 0 and select.select([reader], [], [], left)[0]:
        part = os.read(reader, 1 << 20)
        if not part:
            return b"".join(parts)
        parts.append(part)
    return b""
