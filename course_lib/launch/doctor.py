"""`doctor`: what works on this machine, a verdict a line, and the mend for what does not.

What is known before there is an environment (Python, machine, Linux libraries, disk) is asked of `bootstrap`.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator

import click

from course_lib.authoring.tree import Tree, course_tree
from course_lib.notebook._errors import Refusal

from . import server
from .bootstrap.environment import is_ready
from .bootstrap.messages import Verdict
from .bootstrap.platform_facts import facts
from .bootstrap.report import basic_verdicts, print_verdicts
from .bootstrap.system_libraries import library_command, missing_libraries
from .installed import differences, locked_versions
from .start import PORT

IMPORT_SECONDS = 120
_OPEN3D = "import course_lib, open3d as o, numpy as n; c = o.geometry.PointCloud(o.utility.Vector3dVector(n.eye(3))); "
_OPEN3D += "print(o.__version__, len(c.points))"


@click.command("doctor")
@click.option("--csv", "as_csv", is_flag=True, help="As comma-separated values.")
def command(as_csv: bool) -> None:
    """Say what works on this machine, a verdict a line, with the mend for each failure.

    The text names no user and can be pasted into a question. The exit code is 1 where something failed.
    """
    tree = course_tree()
    found = list(verdicts(tree))
    print_verdicts(found, as_csv)
    sys.exit(1 if any(one.ok is False for one in found) else 0)


def verdicts(tree: Tree) -> Iterator[Verdict]:
    """Every verdict, in the order in which things depend on each other."""
    yield from basic_verdicts(facts())
    parts: list[Callable[[Tree], Iterator[Verdict]]] = [_environment, _open3d, _loops, _rendering, _datasets, _port]
    for part in parts:
        yield from part(tree)


def _environment(tree: Tree) -> Iterator[Verdict]:
    wanted = locked_versions((tree.root / "uv.lock").read_text(encoding="utf-8"))
    wrong = differences(wanted)
    ours = "" if is_ready() else " (not set up by course.py)"
    if not wrong:
        yield Verdict("wheels", True, f"{len(wanted)} packages, exactly uv.lock{ours}")
        return
    more = f", and {len(wrong) - 4} more" if len(wrong) > 4 else ""
    mend = "delete the folder .venv, then: python3 course.py start"
    yield Verdict("wheels", False, "; ".join(wrong[:4]) + more, mend)


def _run(tree: Tree, code: str) -> tuple[int, str]:
    """Run Python code in a process of its own, since what it tries may end the process."""
    environment = {**os.environ, "PYTHONPATH": str(tree.root)}
    try:
        run = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=IMPORT_SECONDS
        )
    except subprocess.TimeoutExpired:
        return -1, f"no answer in {IMPORT_SECONDS} s"
    lines = (run.stdout if not run.returncode else run.stderr).strip().splitlines()
    return run.returncode, lines[-1] if lines else f"it ended with code {run.returncode} and said nothing"


def _open3d(tree: Tree) -> Iterator[Verdict]:
    code, said = _run(tree, _OPEN3D)
    if code:
        mend = "mend what failed above, then: python3 course.py doctor"
        yield Verdict("Open3D", False, f"cannot be imported: {said}", mend)
    else:
        yield Verdict("Open3D", True, f"{said.split()[0]} holds a cloud of {said.split()[1]} points")


def _loops(tree: Tree) -> Iterator[Verdict]:
    code, said = _run(
        tree, "from course_lib import compiled; import numba; print(numba.__version__, compiled.folder())"
    )
    if code:
        mend = "mend the wheels first; until then they run as plain Python, slowly"
        yield Verdict("loops", False, f"numba cannot be imported: {said}", mend)
    elif said.endswith("None"):
        mend = "name a folder that can be written with COURSE_COMPILED"
        yield Verdict("loops", None, f"numba {said.split()[0]} compiles them again in every session: no folder", mend)
    else:
        yield Verdict("loops", True, f"numba {said.split()[0]} compiles them once on this machine, and keeps them")


def _rendering(tree: Tree) -> Iterator[Verdict]:
    # In a process of its own too: where wheels are damaged, the probe itself cannot be imported.
    code, said = _run(tree, "from course_lib.notebook._probe import rendering; print(': '.join(rendering()))")
    if code:
        yield Verdict("rendering", False, said, "mend the wheels first")
        return
    renderer, _, why = said.partition(": ")
    if renderer == "pyvista":
        yield Verdict("rendering", True, f"PyVista draws ({why})")
        return
    vital, drawing = missing_libraries(facts())
    line = library_command(vital + drawing)
    yield Verdict("rendering", None, f"matplotlib draws clouds and meshes ({why})", line)


def _datasets(tree: Tree) -> Iterator[Verdict]:
    try:
        from .data_verbs import states

        found = states(prove=True)
    except ImportError as error:
        yield Verdict("datasets", False, f"cannot be looked at: {error}", "mend the wheels first")
        return
    except Refusal as refusal:
        text, _, mend = str(refusal).partition(": ")
        yield Verdict("datasets", False, text, mend.rstrip("."))
        return
    for state in found:
        name, kind = state.entry.name, state.entry.kind
        if state.words == "not here":
            yield Verdict(name, None, "real, not fetched: its cells show what is stored", state.entry.command())
        elif state.damage and kind == "real":
            yield Verdict(name, False, state.damage.split(": run ")[0], state.entry.command())
        elif state.damage:
            yield Verdict(name, None, state.damage.rstrip("."))
        else:
            proved = f"{state.n_files} files with the right sha256" if state.n_files else state.words
            yield Verdict(name, True, f"{kind}, {proved}")


def _port(tree: Tree) -> Iterator[Verdict]:
    there = server.running(tree)
    if there:
        yield Verdict("port", True, f"JupyterLab of this folder runs on 127.0.0.1:{there.port}")
        return
    for port in range(PORT, PORT + 50):
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        taken = "" if port == PORT else f" ({PORT} is taken)"
        yield Verdict("port", True, f"127.0.0.1:{port} is free for JupyterLab{taken}")
        return
    mend = "python3 course.py start --port 9900"
    yield Verdict("port", False, f"no port from {PORT} to {PORT + 49} is free on 127.0.0.1", mend)
