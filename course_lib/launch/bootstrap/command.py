"""The command line of course.py: set up what is missing, then hand on to the verb."""

import difflib
import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Dict, List

from . import places
from .disk import disk_full
from .environment import is_ready, set_up
from .lock import one_at_a_time
from .messages import EXIT, Stop, quoted, say, this_command
from .places import venv_python
from .platform_check import check_machine
from .platform_facts import facts
from .report import doctor_before_set_up
from .system_libraries import ensure_libraries, ensure_sandbox, missing_libraries
from .verbs import GRADING, VERBS, help_text


def child_environment() -> Dict[str, str]:
    """The environment of every verb: this .venv first, and nothing of other Pythons (ROS sets PYTHONPATH)."""
    drop = ("PYTHONPATH", "PYTHONHOME", "PYTHONSTARTUP")
    drop += ("PYTHONDONTWRITEBYTECODE",)  # each kernel would compile its thousand modules again
    environment = {key: value for key, value in os.environ.items() if key not in drop}
    environment["PATH"] = str(venv_python().parent) + os.pathsep + environment.get("PATH", os.defpath)
    environment["VIRTUAL_ENV"] = str(places.VENV)
    environment["PYTHONUTF8"] = "1"
    return environment


def forward(arguments: List[str]) -> int:
    """Run a verb in .venv. Exit code, signals and terminal are the verb's own."""
    words = [str(venv_python()), "-P", "-m", "course_lib.cli"] + arguments
    sys.stdout.flush()
    sys.stderr.flush()
    if os.name != "nt":
        os.execve(words[0], words, child_environment())
    child = subprocess.Popen(words, env=child_environment())
    while True:
        try:
            return child.wait()
        except KeyboardInterrupt:  # the child has had it too, and decides
            continue


def run(arguments: List[str]) -> int:
    """Do what the command line says and return the exit code.

    Raises
    ------
    Stop
        With one sentence, where the launcher cannot go on.
    """
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(help_text(), end="")
        return 0
    verb = arguments[0]
    if verb not in VERBS:
        near = difflib.get_close_matches(verb, list(VERBS), n=1, cutoff=0.5)
        meant = "did you mean this?" if near else "see the verbs with:"
        mend = ["python3", "course.py"] + (near + arguments[1:] if near else ["--help"])
        raise Stop("usage", f"There is no verb {verb!r}; {meant}", quoted(mend))
    known = facts()
    asks_help = any(word in ("-h", "--help") for word in arguments[1:])
    ready = is_ready()
    if asks_help and not ready:
        print(help_text(verb), end="")
        return 0
    if verb == "doctor" and not ready:
        return doctor_before_set_up(known, "--csv" in arguments)
    check_machine(known, places.LOCK_FILE.read_text(encoding="utf-8"))
    imports_open3d = verb not in ("doctor", "reset") and not asks_help
    if not ready or (imports_open3d and missing_libraries(known)[0]):
        with one_at_a_time() as handle:
            if imports_open3d:
                ensure_libraries(known)
            if not is_ready():
                set_up(known, handle)
    if verb in GRADING and not asks_help:
        ensure_sandbox(known)
    return forward(arguments)


def main(arguments: List[str]) -> int:
    """Run, and turn every Stop into its sentence, its mend and its exit code."""
    try:
        return run(arguments)
    except Stop as error:
        stop = error
    except KeyboardInterrupt:
        say("")
        mend = "python3 " + quoted(this_command())
        stop = Stop("interrupted", "interrupted; the same command goes on where it stopped:", mend)
    except OSError as error:
        place = Path(error.filename).parent if isinstance(error.filename, str) else places.ROOT
        if isinstance(error, FileNotFoundError) and error.filename == str(places.LOCK_FILE):
            missing = "uv.lock is missing from this copy of the course: get it again."
            stop = Stop("install", missing, "git checkout uv.lock")
        elif error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)):
            stop = disk_full(places.ROOT, shutil.disk_usage(str(places.ROOT)).free)
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            stop = Stop(
                "folder",
                f"The folder {place} cannot be written: copy the course to a place of your own.",
                quoted(["cp", "-r", str(places.ROOT), str(Path.home() / places.ROOT.name)]),
            )
        else:
            raise
    say("course: " + stop.sentence + ("\n    " + stop.mend if stop.mend else ""))
    return EXIT[stop.code]
