"""What a kernel that grades can import: the packages that its tasks allow, and nothing that holds an answer.

A room is a folder that is mounted read-only at `/course`: the kernel's first program, the probe, and a `course_lib` of
plain data and of the modules that a task of this room may call, with every function that is an answer cut out. All else
that a lab imports to show things is there by name only (see inside/kernel_main.py). Packages are mounted one by one.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import Requirement

from course_lib import compiled
from course_lib.grading.module_graph import closure, imported_names
from course_lib.tasks.core import HARMLESS, Task

from .limits import Limits

__all__ = ["Room", "build_room", "rooms_of"]

ROOT = Path(__file__).resolve().parents[3]
INSIDE = Path(__file__).with_name("inside")
SILENT = ("course_lib.notebook", "matplotlib", "pyvista", "plotly", "ipywidgets", "mpl_toolkits")
"""What labs import to show things: there by name, does nothing."""
KERNEL = ("ipykernel", "numpy")
UNUSED = ("debugpy", "jedi", "parso", "matplotlib-inline")  # a kernel that nobody types into starts without them
COMPILED = Path(compiled.__file__)
MESSAGES = ("course_lib/tasks/plain.py", "course_lib/tasks/core.py", "course_lib/tasks/running.py")


@dataclass(frozen=True)
class Room:
    """One folder for the kernels of some tasks.

    Parameters
    ----------
    folder : holds kernel_main.py, room.json, lib/ and site/ (empty places, one a package).
    packages : what is mounted over each place in site/.
    """

    folder: Path
    packages: tuple[tuple[str, Path], ...]


def rooms_of(tasks: Iterable[Task]) -> list[tuple[Task, ...]]:
    """Tasks that may share a kernel: those that allow the same third-party packages and parts of the course.

    Of what only some of them hide, nothing is there for any of them; so two tasks of which one allows what the other
    hides never share one.
    """
    groups: dict[tuple[str, ...], list[Task]] = {}
    for task in tasks:
        allowed = sorted(_beyond_python(task))
        groups.setdefault(tuple(allowed), []).append(task)
    return [tuple(group) for group in groups.values()]


def _beyond_python(task: Task) -> set[str]:
    """The packages and modules that a task allows, without Python's own and NumPy."""
    names = {name if name.startswith("course_lib") else name.split(".")[0] for name in task.may_call}
    return {name for name in names if name not in sys.stdlib_module_names and name not in HARMLESS and name != "numpy"}


def build_room(folder: Path, tasks: Iterable[Task], limits: Limits) -> Room:
    """Write the room of some tasks into an empty folder.

    Raises
    ------
    CourseError
        If a package that a task allows is not installed.
    """
    tasks = tuple(tasks)
    allowed = set().union(*(_beyond_python(task) for task in tasks))
    hides = {name for task in tasks for name in task.hides}
    lib, site = folder / "lib", folder / "site"
    lib.mkdir(parents=True)
    site.mkdir()
    for name in ("kernel_main.py", "course_probe.py"):
        shutil.copyfile(INSIDE / name, (folder if name == "kernel_main.py" else lib) / name)
    own = sorted(name for name in allowed if name.startswith("course_lib"))
    modules = _write_course(lib / "course_lib", own, hides)
    if COMPILED in modules:
        _compile(folder)
    packages = _mounts({*KERNEL, *(_distribution(name) for name in (allowed - {*own}) | _other_imports(modules))})
    for name, path in packages:
        if path.is_dir():
            (site / name).mkdir()
        else:
            (site / name).parent.mkdir(exist_ok=True)
            (site / name).touch()
    settings = {
        "silent": [name for name in SILENT if name not in allowed],
        "speaking": ["course_lib"],
        "taken": sorted(name for name in hides if not name.startswith("course_lib")),
        "rlimits": rlimits(limits),
    }
    (folder / "room.json").write_text(json.dumps(settings), encoding="utf-8")
    return Room(folder, packages)


def rlimits(limits: Limits) -> dict[str, int]:
    """The limits that a process takes upon itself, by their names in Python's `resource`."""
    return {
        "RLIMIT_CPU": int(limits.total_seconds * 2),
        "RLIMIT_FSIZE": int(limits.file_mb * 1e6),
        "RLIMIT_NOFILE": int(limits.open_files),
        "RLIMIT_NPROC": int(limits.threads),  # Linux counts threads; root is exempt, so the watchdog counts, too
        "RLIMIT_DATA": int(limits.memory_mb * 1e6 * 2),  # address space that numpy's threads reserve counts, too
        "RLIMIT_CORE": 0,
    }


def _write_course(folder: Path, modules: list[str], hides: set[str]) -> list[Path]:
    """A course_lib of plain data, the probe's means, and the modules that are allowed, without their answers.

    Returns
    -------
    The files of the course that such a module is, or needs.
    """
    (folder / "tasks").mkdir(parents=True)
    (folder / "__init__.py").write_text("", encoding="utf-8")
    (folder / "tasks" / "__init__.py").write_text("", encoding="utf-8")
    for name in MESSAGES:
        shutil.copyfile(ROOT / name, folder.parent / name)
    if not modules:
        return []
    from course_lib.grading.release.hiding import hidden_sources

    changed = hidden_sources(sorted(name for name in hides if name.startswith("course_lib")), ROOT)
    needed = closure([ROOT.joinpath(*name.split(".")).with_suffix(".py") for name in modules], ROOT)
    for path in needed:
        place = folder.parent / path.relative_to(ROOT)
        if not place.exists():
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(changed.get(path, path.read_text(encoding="utf-8")), encoding="utf-8")
    return needed


def _other_imports(modules: Iterable[Path]) -> set[str]:
    """The packages that modules of the course import, without Python's own and NumPy."""
    names: set[str] = set()
    for path in modules:
        package = path.relative_to(ROOT).parts[:-1]
        names |= {name.split(".")[0] for name in imported_names(path.read_text(encoding="utf-8"), package, below="")}
    return names - set(sys.stdlib_module_names) - {"", "course_lib", "numpy"}


def _compile(folder: Path) -> None:
    """Compile the loops of a room's course into the room: what is kept for the user is copied, the rest is made."""
    kept = folder / "compiled"
    kept.mkdir()
    if (there := compiled.folder()) is not None:
        for file in there.glob("*.nb?"):
            with contextlib.suppress(FileNotFoundError):  # replaced just now
                shutil.copyfile(file, kept / file.name)
    environment = {**os.environ, "COURSE_COMPILED": str(kept), "PYTHONPATH": str(folder / "lib")}
    subprocess.run([sys.executable, "-P", "-m", compiled.__name__], env=environment, check=True, capture_output=True)


def _distribution(package: str) -> str:
    """The distribution that brings a package: opencv-python-headless for cv2."""
    from course_lib.authoring.tree import CourseError

    found = importlib.metadata.packages_distributions().get(package)
    if not found:
        raise CourseError(f"a task allows the package {package}, which is not installed here.")
    return found[0]


def _mounts(distributions: set[str]) -> tuple[tuple[str, Path], ...]:
    """Every top-level file and folder of distributions and of what they need, by its name in site-packages."""
    places: dict[str, Path] = {}
    seen: set[str] = set()
    waiting = sorted(distributions)
    while waiting:
        name = waiting.pop()
        key = re.sub(r"[-_.]+", "-", name).lower()
        if key in seen or key in UNUSED:
            continue
        seen.add(key)
        distribution = importlib.metadata.distribution(name)
        for file in distribution.files or ():
            top = file.parts[0]
            if top not in ("..", "__pycache__") and not top.endswith((".pth", ".dist-info")):
                places[top] = Path(str(distribution.locate_file(top)))
        for text in distribution.requires or ():
            need = Requirement(text)
            if need.marker is None or need.marker.evaluate({"extra": ""}):
                waiting.append(need.name)
    for path in [path for path in places.values() if path.suffix == ".py"]:  # else each kernel would compile it anew
        compiled_file = Path(importlib.util.cache_from_source(str(path)))
        places[f"{compiled_file.parent.name}/{compiled_file.name}"] = compiled_file
    return tuple(sorted((name, path) for name, path in places.items() if path.exists()))
