"""How a kernel that runs submitted code is held: bubblewrap's flags, chosen by a probe that looks, not believes.

Inside there is: Python, the libraries of the system and the room, read-only; no network but a loopback of its own; its
own processes; a sized /tmp; a little memory for the kernel's sockets. Nothing of the grader, of other submissions, of
the home folder.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from course_lib.grading.run.inside.kernel_main import REFUSED

from .kernel_imports import Room
from .limits import Limits

__all__ = ["Held", "NoSandbox", "bwrap_command", "kernel_command", "probe_sandbox"]

BASE = (
    *("--die-with-parent", "--new-session", "--cap-drop", "ALL", "--clearenv"),
    *("--unshare-ipc", "--unshare-pid", "--unshare-net", "--unshare-uts"),
)
TRIALS = (
    ("--unshare-user", "--disable-userns", "--unshare-cgroup-try"),
    ("--unshare-user", "--unshare-cgroup-try"),
    ("--unshare-cgroup-try",),  # as root where user namespaces are forbidden
)
SOCKETS_BYTES = "1000000"
ROOT = Path(__file__).resolve().parents[3]
LIBRARIES = ("/lib", "/lib32", "/lib64", "/usr/lib", "/usr/lib32", "/usr/lib64")
WITNESSES = 20
"""So many files of a folder are looked for from inside."""
ENVIRONMENT = {
    "PATH": "/usr/bin:/bin",
    "LANG": "C.UTF-8",
    "USER": "student",
    "PYTHONDONTWRITEBYTECODE": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "IPYTHONDIR": "/tmp/ipython",
    "COURSE_QUIET": "1",
}

LOOK = """
import json, os, socket
def writable(path):
    try:
        with open(os.path.join(path, ".w"), "w"):
            return True
    except OSError:
        return False
seen = {
    "processes": [p for p in os.listdir("/proc") if p.isdigit()],
    "interfaces": [name for _, name in socket.if_nameindex()],
    "writable": [p for p in ("/", "/usr", "/dev", "/course", "/proc", "/home", "/root", "/etc", "/var") if writable(p)],
    "tmp": writable("/tmp"),
    "seen": [path for path in FILES if os.path.lexists(path)],
    "groups": [line for line in open("/proc/self/status") if line.startswith(("CapEff", "NoNewPrivs"))],
}
print(json.dumps(seen))
"""


class NoSandbox(Exception):
    """Submitted code cannot be held here; the message says why and what to do."""


@dataclass(frozen=True)
class Held:
    """How kernels are held: `flags` for bwrap, or none; `words` stand in every result."""

    kind: str
    flags: tuple[str, ...]
    words: str


def bwrap_command(held: Held, room: Room, limits: Limits, program: Sequence[str], shared: Sequence[Path]) -> list[str]:
    """The command that runs a program inside.

    Parameters
    ----------
    program : its words; paths as they are inside.
    shared : two paths inside: a folder from outside to read (the connection file), and a place for sockets, which is
        memory of the sandbox, so that nothing can be written to a disk outside.
    """
    folder = str(int(limits.folder_mb * 1e6))
    words = ["bwrap", *held.flags, *BASE]
    for place in _bound():
        words += ["--ro-bind", place, place]
    for place in LIBRARIES:
        if os.path.islink(place):
            words += ["--symlink", os.readlink(place), place]
    words += ["--ro-bind-try", "/etc/ld.so.cache", "/etc/ld.so.cache"]
    for place in _other_packages():
        words += ["--size", "4096", "--tmpfs", place, "--remount-ro", place]
    # /dev/zero could be mapped as memory that belongs to no process, see inside/kernel_main.py
    words += ["--proc", "/proc", "--dev", "/dev", "--dev-bind", "/dev/null", "/dev/zero"]
    words += ["--size", "1000000", "--tmpfs", "/dev/shm", "--remount-ro", "/dev"]
    words += ["--size", folder, "--tmpfs", "/tmp", "--ro-bind", str(room.folder), "/course"]
    for name, path in room.packages:
        words += ["--ro-bind", str(path), f"/course/site/{name}"]
    if shared:
        words += ["--ro-bind", str(shared[0]), str(shared[0]), "--size", SOCKETS_BYTES, "--tmpfs", str(shared[1])]
    words += ["--dir", "/tmp/home", "--remount-ro", "/", "--chdir", "/tmp/home", "--setenv", "HOME", "/tmp/home"]
    for name, value in ENVIRONMENT.items():
        words += ["--setenv", name, value]
    return [*words, "--", *program]


def open_command(room: Room, folder: Path) -> tuple[list[str], dict[str, str]]:
    """How a kernel runs without a sandbox: the folder of its room with links to the packages, and its environment."""
    for name, path in room.packages:
        place = room.folder / "site" / name
        if not place.is_symlink():
            place.rmdir() if place.is_dir() else place.unlink()
            place.symlink_to(path)
    home = {"HOME": str(folder), "TMPDIR": str(folder), "IPYTHONDIR": str(folder / "ipython")}
    return [interpreter(), "-I", "-S"], {**ENVIRONMENT, **home}


def kernel_command(
    held: Held, room: Room, limits: Limits, closed: Path, sockets: Path
) -> tuple[list[str], dict[str, str]]:
    """The command of a kernel, and its environment.

    Parameters
    ----------
    closed, sockets : folders: with the connection file c.json, only to be read inside; and for its sockets.
    """
    connection = str(closed / "c.json")
    if held.kind == "bwrap":
        words = [interpreter(), "-I", "-S", "/course/kernel_main.py", "/course/room.json", connection, held.kind]
        return bwrap_command(held, room, limits, words, (closed, sockets)), {"PATH": "/usr/bin:/bin"}
    words, environment = open_command(room, sockets)
    return [*words, f"{room.folder}/kernel_main.py", f"{room.folder}/room.json", connection, held.kind], environment


def interpreter() -> str:
    """The interpreter outside any virtual environment: it is the one that is seen inside."""
    return os.path.realpath(sys.executable)


def _bound() -> list[str]:
    """What of the system is seen inside: this Python with its library, and what they are linked against."""
    base = os.path.realpath(sys.base_prefix)
    own = [interpreter(), f"{base}/lib", f"{base}/{sys.platlibdir}"]
    return sorted({p for p in (*LIBRARIES, *own) if os.path.exists(p) and not os.path.islink(p)})


def _other_packages() -> list[str]:
    """Folders of packages that are nobody's business: of the base Python and of the system."""
    names = [f"python*/{name}" for name in ("site-packages", "dist-packages")]
    places = {path for root in _bound() for name in names for path in Path(root).glob(name)}
    return sorted(str(path) for path in places if path.is_dir() and not path.is_symlink())


@lru_cache(maxsize=8)
def probe_sandbox(own: tuple[Path, ...] = ()) -> Held:
    """Find flags with which bubblewrap holds here, and look from inside whether it does.

    Parameters
    ----------
    own : folders of which nothing may be seen inside, beside this course and the folder for what is temporary.

    Raises
    ------
    NoSandbox
        With the reason and what to do.
    """
    if sys.platform != "linux":
        raise NoSandbox(
            "submitted notebooks run in bubblewrap, which exists on Linux only: grade in a Linux virtual machine, on "
            "Windows in WSL2 (Ubuntu 22.04 or newer)."
        )
    if shutil.which("bwrap") is None:
        raise NoSandbox("bubblewrap is not installed: sudo apt-get install bubblewrap (dnf, zypper, pacman: likewise).")
    version = subprocess.run(["bwrap", "--version"], capture_output=True, text=True, check=False).stdout.split()[-1:]
    own = (ROOT, *own)
    for folder in (*own, Path(tempfile.gettempdir())):
        if place := next((place for place in _bound() if folder.resolve().is_relative_to(place)), None):
            raise NoSandbox(f"{folder} lies in {place}, which submitted code can read: move it, for instance to /srv.")
    reasons: list[str] = []
    for flags in TRIALS:
        if "--unshare-user" not in flags and os.geteuid() != 0:
            continue
        calls = f"system calls {'filtered' if platform.machine() in REFUSED else 'not filtered'}"
        words = f"bwrap {' '.join(version)}: {' '.join((*flags, *BASE))}; {calls}"
        reason = _look(Held("bwrap", flags, words), own)
        if not reason:
            return Held("bwrap", flags, words)
        reasons.append(reason)
    hint = "the kernel may forbid user namespaces"
    if Path("/proc/sys/kernel/apparmor_restrict_unprivileged_userns").exists():
        hint += " (Ubuntu 23.10 and newer: sudo sysctl kernel.apparmor_restrict_unprivileged_userns=0)"
    raise NoSandbox(f"bubblewrap does not hold on this machine, {hint}. It said: {reasons[0]}")


def _witnesses(folder: Path) -> list[str]:
    """A few files of a folder, the uppermost first."""
    found: list[str] = []
    for where, folders, files in os.walk(folder.resolve()):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found += [os.path.join(where, name) for name in sorted(files)]
        if len(found) >= WITNESSES:
            break
    return found[:WITNESSES]


def _look(held: Held, own: Sequence[Path]) -> str:
    """Start a Python inside and let it look around, also for files of some folders; why it is not held, or ""."""
    from .limits import read_limits

    with tempfile.TemporaryDirectory(prefix="course-probe-") as name:
        folder = Path(name)
        (folder / "site").mkdir()
        secret = folder / "secret"
        secret.touch()
        files = [str(secret), *(file for folder in own for file in _witnesses(folder))]
        text = LOOK.replace("FILES", repr(files))
        room = folder / "room"
        room.mkdir()
        program = [interpreter(), "-I", "-S", "-c", text]
        try:
            command = bwrap_command(held, Room(room, ()), read_limits(), program, ())
            done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False, env={})
        except (OSError, subprocess.TimeoutExpired) as error:
            return str(error)
        if done.returncode != 0:
            return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        seen = json.loads(done.stdout)
    if seen["seen"] or seen["writable"] or not seen["tmp"]:
        return f"inside, files outside could be seen or written: {', '.join(seen['seen'] + seen['writable'])}"
    if set(seen["interfaces"]) - {"lo"} or len(seen["processes"]) > 3:
        return f"inside, there are {seen['interfaces']} and {len(seen['processes'])} processes"
    if any(line.split()[1].strip("0") for line in seen["groups"] if line.startswith("CapEff")):
        return "inside, capabilities are left"
    return ""


def machine() -> str:
    """The environment that a record names: Python, NumPy, the system; not the machine's name."""
    import numpy

    return f"{platform.system()} {platform.machine()}, Python {platform.python_version()}, NumPy {numpy.__version__}"
