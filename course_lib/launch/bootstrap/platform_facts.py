"""What is known of the running Python and of its machine."""

import os
import platform
import re
import struct
import subprocess
import sys
import sysconfig
from typing import NamedTuple, Tuple


class Facts(NamedTuple):
    """What is known of the running Python and its machine; tests make their own."""

    version: Tuple[int, ...]
    bits: int
    system: str  # Linux, Darwin, Windows
    machine: str  # x86_64, aarch64, arm64, AMD64
    libc: Tuple[str, Tuple[int, ...]] = ("", ())  # ("glibc", (2, 36)), ("musl", ()), or nothing elsewhere
    implementation: str = "CPython"
    free_threaded: bool = False
    translated: bool = False  # an Intel Python on an Apple-silicon Mac


def facts() -> Facts:
    """Look at the running Python."""
    system, libc, translated = platform.system(), ("", ()), False  # type: Any
    if system == "Linux":
        try:
            name, _, number = (os.confstr("CS_GNU_LIBC_VERSION") or "").partition(" ")
        except (ValueError, OSError):
            name, number = "", ""
        libc = ("glibc", tuple(int(n) for n in re.findall(r"\d+", number))) if name == "glibc" else ("musl", ())
    elif system == "Darwin":
        asked = subprocess.run(
            ["sysctl", "-n", "sysctl.proc_translated"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        translated = asked.stdout.strip() == b"1"
    return Facts(
        tuple(sys.version_info[:3]),
        struct.calcsize("P") * 8,
        system,
        platform.machine(),
        libc,
        platform.python_implementation(),
        bool(sysconfig.get_config_var("Py_GIL_DISABLED")),
        translated,
    )
