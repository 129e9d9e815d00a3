"""Which Python can run the course, where one is, and how to come by one."""

import os
import subprocess
from pathlib import Path
from typing import Iterator, Mapping

from .messages import quoted, this_command
from .platform_facts import Facts
from .system_libraries import as_administrator, linux_family

PYTHONS = ((3, 11), (3, 14))  # requires-python in pyproject.toml


def usable_pythons(environment: Mapping[str, str]) -> Iterator[str]:
    """Every Python on PATH, or where installers put it, that the course can use; each is asked, newest first."""
    names = [f"python3.{minor}" for minor in range(PYTHONS[1][1], PYTHONS[0][1] - 1, -1)] + ["python3", "python"]
    on_path = environment.get("PATH", os.defpath).split(os.pathsep)
    elsewhere = sorted(map(str, Path.home().glob(".pyenv/versions/3.*/bin")), reverse=True)
    elsewhere += ["/opt/homebrew/bin", "/usr/local/bin", "/usr/bin"]
    ending = ".exe" if os.name == "nt" else ""
    candidates = [
        os.path.join(f, name + ending) for group in (on_path, elsewhere) for name in names for f in group if f
    ]
    if os.name == "nt":
        for minor in range(PYTHONS[1][1], PYTHONS[0][1] - 1, -1):
            where = f"Programs/Python/Python3{minor}/python.exe"
            candidates.append(os.path.join(environment.get("LOCALAPPDATA", ""), where))
    ask = "import sys, struct, platform as p; "
    ask += "print(*sys.version_info[:2], struct.calcsize('P'), p.python_implementation())"
    for candidate in dict.fromkeys(candidates):
        if not os.access(candidate, os.X_OK) or os.path.isdir(candidate):
            continue
        try:
            run = subprocess.run(
                [candidate, "-c", ask], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=20, check=True
            )
            words = run.stdout.decode("ascii", "replace").split()
        except (OSError, subprocess.SubprocessError):
            continue
        if len(words) == 4 and words[2:] == ["8", "CPython"]:
            if PYTHONS[0] <= (int(words[0]), int(words[1])) <= PYTHONS[1]:
                yield candidate


def python_to_use(known: Facts) -> str:
    """The command that repeats this one with a Python that fits, or that installs such a Python."""
    found = next(usable_pythons(os.environ), None)
    if found:
        return quoted([found] + this_command())
    if known.system == "Darwin":
        return "brew install python@3.12 && python3.12 " + quoted(this_command())
    if known.system == "Windows":
        return "winget install Python.Python.3.12"
    # Ubuntu 22.04, whose own Python is 3.10, has 3.11 beside it; the python3 of later Debians and Ubuntus fits.
    debian = "python3.11" if known.libc[1] == (2, 35) else "python3"
    others = {"fedora": "dnf install -y python3.12", "suse": "zypper install -y python312", "arch": "pacman -S python"}
    return as_administrator(others.get(linux_family(), f"apt-get install -y {debian}"))
