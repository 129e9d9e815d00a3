"""`course bench`: every case of every module, each in a process of its own, and the page of what came out.

A case comes from a module `bench_NN.py` of this folder with `cases() -> list[Case]`. In a process of its own, thread
counts are set before anything is imported. Such a module may also have `scalings() -> list[Scaling]`: how time grows
with the number of points (`scaling`).
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import pkgutil
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from course_lib.authoring.tree import CourseError, Tree, nearest

from .compare import Case, Ratio, compare
from .scaling import Growth, Scaling, grow
from .table import machine, table


def case_modules() -> list[str]:
    """Every module that holds cases."""
    modules = (module.name for module in pkgutil.iter_modules([str(Path(__file__).parent)]))
    return sorted(f"{__package__}.{name}" for name in modules if re.fullmatch(r"bench_\d\d", name))


def _pin(threads: int) -> None:
    """Hold this process to so many threads: by the processors it may use, and by each library's own setting."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:threads]))
    for module, setter in (("open3d.utility", "set_max_threads"), ("cv2", "setNumThreads")):
        with contextlib.suppress(ModuleNotFoundError):
            getattr(importlib.import_module(module), setter)(threads)


def _environment(threads: int) -> dict[str, str]:
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
    root = str(Path(__file__).resolve().parents[2])
    return {**os.environ, **dict.fromkeys(names, str(threads)), "COURSE_QUIET": "1", "PYTHONPATH": root}


def _in_own_process(*words: str, threads: int) -> dict:
    run = subprocess.run(
        [sys.executable, "-P", "-m", __name__, *words],
        env=_environment(threads),
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    if run.returncode:
        last = run.stderr.strip().splitlines()[-1] if run.stderr.strip() else f"exit code {run.returncode}"
        raise CourseError(f"the benchmark {' '.join(words)} failed: {last}")
    return json.loads(run.stdout.splitlines()[-1])


def _child(module: str, name: str = "", threads: str = "1") -> object:
    """What runs in a process of its own: the names of what a module measures, or one measurement."""
    _pin(int(threads))
    imported = importlib.import_module(module)
    cases: dict[str, Case] = {case.name: case for case in imported.cases()}
    scalings: dict[str, Scaling] = {one.name: one for one in getattr(imported, "scalings", list)()}
    if not name:
        return {"cases": list(cases), "scalings": list(scalings)}
    return asdict(compare(cases[name], int(threads)) if name in cases else grow(scalings[name], int(threads)))


def bench_cases(tree: Tree, only: str, write: bool, say: Callable[[str], None]) -> int:
    """Run the cases whose name or module holds a word, print each, and write the table.

    Returns
    -------
    The exit code: 1 if a case is over its bound.
    """
    known = [
        (module, kind, name)
        for module in case_modules()
        for kind, names in _in_own_process(module, threads=1).items()
        for name in names
    ]
    chosen = [(module, kind, name) for module, kind, name in known if only in name or only in module]
    if not chosen:
        words = sorted({name.partition(",")[0] for _, _, name in known})
        raise CourseError(f"no benchmark has {only!r} in its name.{nearest(only, words)} Known: {', '.join(words)}.")
    if write and only:
        raise CourseError("--write writes the whole table: leave --only out.")
    results: list[Ratio | Growth] = []
    for module, kind, name in chosen:
        for count in thread_counts() if kind == "cases" else thread_counts()[:1]:
            form = Ratio if kind == "cases" else Growth
            results.append(form(**_in_own_process(module, name, str(count), threads=count)))
            say(results[-1].line)
    if write:
        path = tree.docs_folder / "benchmarks.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(table(results, machine()), encoding="utf-8", newline="\n")
        say(f"written: {tree.relative(path)}")
    return 0 if all(result.passed for result in results) else 1


def thread_counts() -> list[int]:
    """One thread, and two where the machine has them."""
    return [1, 2] if (os.cpu_count() or 1) > 1 else [1]


if __name__ == "__main__":
    print(json.dumps(_child(*sys.argv[1:])))
