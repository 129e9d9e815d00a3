"""What the launcher says: one sentence, the command that mends it, and an exit code."""

import os
import shlex
import subprocess
import sys
from typing import List, NamedTuple, Optional, Sequence

EXITS = {
    "usage": (2, "a verb that does not exist"),
    "python": (10, "another Python is needed"),
    "machine": (11, "no Open3D for this kind of machine"),
    "system": (12, "this Linux's C library is too old"),
    "disk": (13, "the disk is full"),
    "index": (14, "the package index cannot be reached"),
    "content": (15, "the index lacks a file, or serves another one"),
    "install": (16, "the installation failed for another reason"),
    "libraries": (17, "Linux libraries are missing that Open3D needs"),
    "folder": (18, "a folder cannot be written"),
    "interrupted": (130, "interrupted: the same command goes on"),
}
EXIT = {key: code for key, (code, _) in EXITS.items()}


class Stop(Exception):
    """The launcher cannot go on: one sentence, the command that mends it, and the key of its exit code."""

    def __init__(self, code: str, sentence: str, mend: str = "") -> None:
        super().__init__(sentence)
        self.code, self.sentence, self.mend = code, sentence, mend


class Verdict(NamedTuple):
    """One line of `doctor`: ok is True, False, or None for a remark that is no failure."""

    name: str
    ok: Optional[bool]
    text: str
    mend: str = ""


def say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def quoted(words: Sequence[str]) -> str:
    """A command line that a person can paste into this system's shell."""
    return subprocess.list2cmdline(list(words)) if os.name == "nt" else " ".join(shlex.quote(str(w)) for w in words)


def this_command() -> List[str]:
    return [sys.argv[0] or "course.py"] + sys.argv[1:]


def with_variable(name: str, value: str) -> str:
    if os.name == "nt":
        return f'$env:{name} = "{value}"; py {quoted(this_command())}'
    return f"{name}={value} python3 {quoted(this_command())}"
