"""The part of `doctor` that needs no environment, and how verdicts are printed."""

import os
import shutil
import sys
from typing import List, Sequence

from . import places
from .disk import BYTES_NEEDED
from .environment import is_ready
from .messages import Stop, Verdict
from .package_index import index_in_force, not_answering, unreachable, without_secret
from .platform_check import check_machine
from .platform_facts import Facts
from .system_libraries import library_command, missing_libraries


def basic_verdicts(known: Facts) -> List[Verdict]:
    """The part of `doctor` that needs no environment. Asks nothing of the network."""
    verdicts = []
    text = "Python {} ({}, {} bits) on {} {}".format(
        ".".join(map(str, known.version)), known.implementation, known.bits, known.system, known.machine
    )
    if known.libc[0]:
        text += ", {} {}".format(known.libc[0], ".".join(map(str, known.libc[1])))
    try:
        check_machine(known, places.LOCK_FILE.read_text(encoding="utf-8"))
        verdicts.append(Verdict("Python", True, text))
    except Stop as stop:
        verdicts.append(Verdict("Python", False, f"{stop.sentence} ({text})", stop.mend))
    vital, drawing = missing_libraries(known)
    if known.system == "Linux":
        line = library_command(vital + drawing)
        told = "Open3D cannot load without " + ", ".join(vital) if vital else "what Open3D needs is there"
        verdicts.append(Verdict("Linux libraries", not vital, told, line if vital else ""))
        if drawing and not is_ready():  # else `doctor` tries to draw
            told = "no EGL driver: pictures of clouds and meshes are drawn by matplotlib"
            verdicts.append(Verdict("3D driver", None, told, line))
    free = shutil.disk_usage(str(places.ROOT)).free
    enough = free >= (BYTES_NEEDED if not is_ready() else BYTES_NEEDED // 10)
    told = f"{free / 1e9:.1f} GB free where the course lies"
    mend = "" if enough else f"make room: the installation needs {BYTES_NEEDED / 1e9:.1f} GB"
    verdicts.append(Verdict("disk", enough, told, mend))
    return verdicts


def doctor_before_set_up(known: Facts, as_csv: bool) -> int:
    """`doctor` where there is no environment yet: it reports and installs nothing."""
    index = index_in_force(os.environ)
    verdicts = basic_verdicts(known) + [Verdict("environment", False, "not set up", "python3 course.py start")]
    error = not_answering(index)
    stop = unreachable(index, error) if error else Stop("index", without_secret(index.url))
    verdicts.append(Verdict("package index", error is None, stop.sentence, stop.mend))
    print_verdicts(verdicts, as_csv)
    return 1


def print_verdicts(verdicts: Sequence[Verdict], as_csv: bool) -> None:
    """Print one line a verdict, with its mend; no user name and no path above the home folder."""

    def clean(text: str) -> str:
        text = text.replace(str(places.ROOT), "course")
        home = os.path.expanduser("~")
        return text.replace(home, "~") if len(home) > 1 else text

    words = {True: "ok", False: "FAIL", None: "note"}
    if as_csv:
        import csv

        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(["verdict", "name", "text", "mend"])
        writer.writerows([words[v.ok], v.name, clean(v.text), clean(v.mend)] for v in verdicts)
        return
    for v in verdicts:
        mend = f"  ->  {clean(v.mend)}" if v.mend else ""
        print(f"{words[v.ok]:<5} {v.name:<17}{clean(v.text)}{mend}")
