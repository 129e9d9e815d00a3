"""Whether the course can be installed with this Python on this machine at all."""

import re
import sys

from . import places
from .interpreter import PYTHONS, python_to_use
from .messages import Stop, quoted
from .platform_facts import Facts


def check_machine(known: Facts, lock: str) -> None:
    """Refuse a machine or a Python on which nothing can be installed; what cannot be mended comes first.

    Raises
    ------
    Stop
        With one sentence and the command that mends it.
    """
    dotted = ".".join(str(n) for n in known.version)
    # the platform tags of every Open3D wheel, for example manylinux_2_35_x86_64
    tags = set(re.findall(r"/open3d(?:_cpu)?-[^/\"]+-cp\d+-([^-/\"]+)\.whl", lock))
    machine = {"AMD64": "amd64", "ARM64": "arm64"}.get(known.machine, known.machine)
    suffix = {"Linux": "_" + machine, "Darwin": "_" + machine, "Windows": "win_" + machine}.get(known.system, "?")
    kind = {"Linux": "manylinux", "Darwin": "macosx", "Windows": "win"}.get(known.system, "?")
    fitting = [tag for tag in tags if tag.startswith(kind) and tag.endswith(suffix)]
    arguments = ["course.py"] + sys.argv[1:]
    if known.system == "Darwin" and known.translated:
        raise Stop(
            "machine",
            "This is an Intel Python on an Apple-silicon Mac, and Open3D has no build for Intel Macs.",
            quoted(["arch", "-arm64", "python3"] + arguments),
        )
    if known.system == "Windows" and machine == "arm64" and not fitting:
        raise Stop(
            "machine",
            "Open3D has no build for ARM Pythons on Windows; the 64-bit Intel Python runs here too.",
            "winget install Python.Python.3.12 --architecture x64",
        )
    if not fitting and known.bits == 64:
        name = "Intel Macs" if known.system == "Darwin" else f"{known.system} on {known.machine}"
        raise Stop(
            "machine",
            f"Open3D has no build for {name}: run the course on Linux, Windows or an Apple-silicon Mac, "
            "for example on another machine that you reach with",
            "ssh -L 8888:127.0.0.1:8888 you@other-machine",
        )
    container = f"docker run --rm -it --network host -v {quoted([str(places.ROOT)])}:/course -w /course "
    container += f"python:3.12-bookworm python3 {quoted(arguments)}"
    floor = max((tuple(int(n) for n in re.findall(r"\d+", tag)[:2]) for tag in fitting), default=(2, 35))
    if known.libc[0] == "musl":
        raise Stop(
            "system", "This Linux uses musl, and Open3D is built for glibc: use a container of Debian.", container
        )
    if known.libc[0] == "glibc" and known.libc[1] < floor:
        raise Stop(
            "system",
            "This Linux has glibc {}, and Open3D needs {} or newer (Ubuntu 22.04, Debian 12): upgrade it, or use a "
            "container.".format(".".join(map(str, known.libc[1])), ".".join(map(str, floor))),
            container,
        )
    wanted = "the course needs CPython {}.{} to {}.{}, 64 bits".format(*PYTHONS[0], *PYTHONS[1])
    if known.bits != 64:
        raise Stop("python", f"This is a {known.bits}-bit Python; {wanted}.", python_to_use(known))
    if known.implementation != "CPython" or known.free_threaded:
        name = "a free-threaded Python" if known.free_threaded else known.implementation
        raise Stop("python", f"This is {name}; {wanted}.", python_to_use(known))
    if not PYTHONS[0] <= known.version[:2] <= PYTHONS[1]:
        raise Stop("python", f"This is Python {dotted}; {wanted}.", python_to_use(known))
