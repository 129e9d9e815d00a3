"""`doctor`: what works on this machine, a verdict a line, and the mend for what does not.

What the launcher knows already (Python, machine, Linux libraries, disk) is asked of the launcher, course.py.
"""

from __future__ import annotations

import importlib.util
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from types import ModuleType

import click

from . import server
from .installed import differences, locked_versions
from .start import PORT
from .tree import Tree, course_tree

__all__ = ["command", "load_launcher", "verdicts"]

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
    launcher = load_launcher(tree)
    found = list(verdicts(tree, launcher))
    launcher.print_verdicts(found, as_csv)
    sys.exit(1 if any(one.ok is False for one in found) else 0)


def load_launcher(tree: Tree) -> ModuleType:
    """Import course.py, which lies beside the library and is no part of it."""
    spec = importlib.util.spec_from_file_location("course_launcher", tree.root / "course.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def verdicts(tree: Tree, launcher: ModuleType) -> Iterator[tuple]:
    """Every verdict, as the launcher's `Verdict`s, in the order in which things depend on each other."""
    known = launcher.facts()
    yield from launcher.basic_verdicts(known)
    parts: list[Callable[[Tree, ModuleType], Iterator[tuple]]] = [_environment, _open3d, _rendering, _datasets, _port]
    for part in parts:
        yield from part(tree, launcher)


def _environment(tree: Tree, launcher: ModuleType) -> Iterator[tuple]:
    wanted = locked_versions((tree.root / "uv.lock").read_text(encoding="utf-8"))
    wrong = differences(wanted)
    ours = "" if launcher.is_ready() else " (not set up by course.py)"
    if not wrong:
        yield launcher.Verdict("wheels", True, f"{len(wanted)} packages, exactly uv.lock{ours}")
        return
    more = f", and {len(wrong) - 4} more" if len(wrong) > 4 else ""
    mend = "delete the folder .venv, then: python3 course.py start"
    yield launcher.Verdict("wheels", False, "; ".join(wrong[:4]) + more, mend)


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


def _open3d(tree: Tree, launcher: ModuleType) -> Iterator[tuple]:
    code, said = _run(tree, _OPEN3D)
    if code:
        mend = "mend what failed above, then: python3 course.py doctor"
        yield launcher.Verdict("Open3D", False, f"cannot be imported: {said}", mend)
    else:
        yield launcher.Verdict("Open3D", True, f"{said.split()[0]} holds a cloud of {said.split()[1]} points")


def _rendering(tree: Tree, launcher: ModuleType) -> Iterator[tuple]:
    # In a process of its own too: where wheels are damaged, the probe itself cannot be imported.
    code, said = _run(tree, "from course_lib.notebook._probe import rendering; print(': '.join(rendering()))")
    if code:
        yield launcher.Verdict("rendering", False, said, "mend the wheels first")
        return
    renderer, _, why = said.partition(": ")
    if renderer == "pyvista":
        yield launcher.Verdict("rendering", True, f"PyVista draws ({why})")
        return
    vital, drawing = launcher.missing_libraries(launcher.facts())
    line = launcher.library_command([*vital, *drawing], launcher.linux_family())
    yield launcher.Verdict("rendering", None, f"matplotlib draws clouds and meshes ({why})", line)


def _datasets(tree: Tree, launcher: ModuleType) -> Iterator[tuple]:
    try:
        from course_lib.notebook import _cache, _catalog, _places, _real
        from course_lib.notebook._errors import DataDamaged, DataMissing, Refusal
    except ImportError as error:
        yield launcher.Verdict("datasets", False, f"cannot be looked at: {error}", "mend the wheels first")
        return
    try:
        entries, roots = _catalog.catalogue(), _places.cache_roots()
        _places.mirror()
    except Refusal as refusal:
        text, _, mend = str(refusal).partition(": ")
        yield launcher.Verdict("datasets", False, text, mend.rstrip("."))
        return
    for name, entry in entries.items():
        try:
            if entry.kind == "real":
                count = len(_real.locate(entry))
                yield launcher.Verdict(name, True, f"real, {count} files with the right sha256")
                continue
            made = [root / _cache.key(entry, entry.seed) for root in roots]
            there = next((folder for folder in made if folder.is_dir()), None)
            if there is None:
                yield launcher.Verdict(name, True, "synthetic, made on first use")
            else:
                manifest = _cache.proved(there, _cache.fingerprint(entry, entry.seed))
                yield launcher.Verdict(name, True, f"synthetic, {len(manifest['files'])} files with the right sha256")
        except DataMissing:
            yield launcher.Verdict(name, None, "real, not fetched: its cells are skipped", entry.command())
        except DataDamaged as damage:
            text = str(damage).split(": run ")[0]
            if entry.kind == "real":
                yield launcher.Verdict(name, False, text, entry.command())
            else:
                yield launcher.Verdict(name, None, f"{text}; it is made again on its next use")


def _port(tree: Tree, launcher: ModuleType) -> Iterator[tuple]:
    there = server.running(tree)
    if there:
        yield launcher.Verdict("port", True, f"JupyterLab of this folder runs on 127.0.0.1:{there.port}")
        return
    for port in range(PORT, PORT + 50):
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        taken = "" if port == PORT else f" ({PORT} is taken)"
        yield launcher.Verdict("port", True, f"127.0.0.1:{port} is free for JupyterLab{taken}")
        return
    mend = "python3 course.py start --port 9900"
    yield launcher.Verdict("port", False, f"no port from {PORT} to {PORT + 49} is free on 127.0.0.1", mend)
