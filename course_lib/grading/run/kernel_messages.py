"""What a kernel sends may be anything: which messages are none, and the strike that ends a kernel."""

from __future__ import annotations

from typing import Any

NEEDED: dict[str, dict[str, type]] = {
    "status": {"execution_state": str},
    "stream": {"name": str, "text": str},
    "display_data": {"data": dict, "metadata": dict},
    "execute_result": {"data": dict, "metadata": dict, "execution_count": int},
    "error": {"ename": str, "evalue": str, "traceback": list},
}
"""What nbval and `ask` read of a message of each kind, unasked; a message without it is none."""


class Strike(Exception):
    """A limit struck or the kernel is gone: a fixed `code` for the ledger, a sentence for people."""

    def __init__(self, code: str, sentence: str) -> None:
        super().__init__(sentence)
        self.code, self.sentence = code, sentence


def check_message(kind: Any, parent: Any, content: Any) -> None:
    """Raise for a message that lacks what those who get it read."""
    if not isinstance(kind, str) or not isinstance(parent, dict) or not isinstance(content, dict):
        raise TypeError("no message")
    for name, form in NEEDED.get(kind, {}).items():
        if not isinstance(content[name], form):
            raise TypeError(name)
    if kind == "error" and not all(isinstance(line, str) for line in content["traceback"]):
        raise TypeError("traceback")
