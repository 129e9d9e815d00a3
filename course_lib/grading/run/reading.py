"""Reading what anybody wrote, in a process of its own, which gets no more than its share of time and memory."""

from __future__ import annotations

import json
import os
import resource
import select
import signal
import time
from collections.abc import Callable
from dataclasses import astuple
from typing import Any

import psutil

from course_lib.grading.intake.untrusted_notebook import IntakeLimits, Unreadable, notebook_of
from course_lib.grading.release.rebuild import Answer, Piece, Rebuilt, older_release, rebuild
from course_lib.grading.release.released import ReleasedLab
from course_lib.tasks.sources import forbidden_in_text

from .die_with_parent import die_with_parent
from .kernel_imports import SILENT
from .limits import Limits

__all__ = ["all_of", "read_apart", "read_submission"]

PATIENCE = 3
"""It may wait so many times as long as it may compute: others may compute meanwhile."""


def read_submission(data: bytes, lab: ReleasedLab, limits: Limits) -> tuple[str, Rebuilt, dict[str, str]]:
    """Why a notebook is of an older release, or ""; the rebuilt notebook; why which answers are not taken, by task.

    Raises
    ------
    Unreadable
        If nothing of it can be graded, or reading it takes more than its share.
    """

    def read() -> dict[str, Any]:
        nb = notebook_of(data, IntakeLimits())
        if older := older_release(nb, lab):
            return {"older": older}
        rebuilt = rebuild(nb, lab)
        given = "\n".join(lab.cells[name] for name in lab.given)
        found = [answer for answer in rebuilt.answers if answer.state == "found"]
        refused = {a.slot.task.id: forbidden_in_text(a.slot.task, a.source, given, SILENT) for a in found}
        return {"older": "", "rebuilt": _packed(rebuilt), "refused": refused}

    told = read_apart(read, limits.read_seconds, limits.read_mb)
    if told["older"]:
        return told["older"], Rebuilt([], [], []), {}
    return "", _unpacked(told["rebuilt"], lab), told["refused"]


def _packed(rebuilt: Rebuilt) -> dict[str, Any]:
    """It as plain data, for another process; `_unpacked` gives it back."""
    answers = [[a.state, a.source, a.trouble, [astuple(piece) for piece in a.pieces]] for a in rebuilt.answers]
    return {"given": [astuple(p) for p in rebuilt.given], "answers": answers, "notices": rebuilt.notices}


def _unpacked(told: dict[str, Any], lab: ReleasedLab) -> Rebuilt:
    answers = [
        Answer(slot, state, source, trouble, [Piece(*piece) for piece in pieces])
        for slot, (state, source, trouble, pieces) in zip(lab.slots, told["answers"], strict=True)
    ]
    return Rebuilt([Piece(*piece) for piece in told["given"]], answers, told["notices"])


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
