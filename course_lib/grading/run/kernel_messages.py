"""What a kernel sends may be anything: it is weighed before it is read, and only what is needed is kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from course_lib.grading.run.inside.course_probe import MIME

__all__ = ["Strike", "check_message", "is_answer", "needed", "weigh"]

NEEDED: dict[str, dict[str, type]] = {
    "status": {"execution_state": str},
    "display_data": {"data": dict},
    "error": {"ename": str, "evalue": str, "traceback": list},
}
"""What nbval and `ask` read of a message of each kind, unasked; a message without it is none."""
MOST_PARTS = 64
"""So many pieces a message has; the first of them tell who it is for, five are the message, others lie beside it."""
MOST_THINGS = 200_000
"""So many things may stand in the JSON of a message: a megabyte of braces would become a hundred of memory."""
MOST_LINES, MOST_LETTERS = 20, 2_000
"""What is kept of an error's traceback: so many lines, so many letters of each."""


class Strike(Exception):
    """A limit struck or the kernel is gone: a fixed `code` for the ledger, a sentence for people."""

    def __init__(self, code: str, sentence: str) -> None:
        super().__init__(sentence)
        self.code, self.sentence = code, sentence


def weigh(parts: Sequence[bytes]) -> None:
    """Raise for the pieces of a message that nobody needs to send: too many, or JSON that becomes far larger."""
    if len(parts) > MOST_PARTS:
        raise ValueError("too many parts")
    if sum(part.count(mark) for part in parts for mark in (b"{", b"[", b",")) > MOST_THINGS:
        raise ValueError("too many things")


def check_message(kind: Any, parent: Any, content: Any) -> None:
    """Raise for a message that lacks what those who get it read."""
    if not isinstance(kind, str) or not isinstance(parent, dict) or not isinstance(content, dict):
        raise TypeError("no message")
    for name, form in NEEDED.get(kind, {}).items():
        if not isinstance(content[name], form):
            raise TypeError(name)
    if kind == "error" and not all(isinstance(line, str) for line in content["traceback"]):
        raise TypeError("traceback")


def is_answer(message: dict[str, Any]) -> bool:
    """Whether it is an answer of the probe, or says so."""
    return message["msg_type"] == "display_data" and MIME in message["content"]["data"]


def needed(message: dict[str, Any]) -> dict[str, Any] | None:
    """Of a message by which cells and probes are told, what they read; None for others: what is shown only counts.

    nbval would search what a cell prints with regular expressions, which takes hours of a text that is made for it.
    """
    content = message["content"]
    if message["msg_type"] == "error":
        lines = [line[-MOST_LETTERS:] for line in content["traceback"][-MOST_LINES:]]
        told = {name: content[name][:MOST_LETTERS] for name in ("ename", "evalue")}
        return {**message, "content": {**told, "traceback": lines}}
    if is_answer(message):
        return {**message, "content": {"data": {MIME: content["data"][MIME]}, "metadata": {}}}
    idle = message["msg_type"] == "status" and content["execution_state"] == "idle"
    return message if idle else None
