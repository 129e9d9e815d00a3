"""`course bench`: ours against the professional tool, timed in turns, both on the same stated number of threads.

A case comes from a module `bench_NN.py` of this folder with `cases() -> list[Case]`. Each runs in a process of its
own, so that thread counts are set before anything is imported. What is quoted is the ratio of a pair of runs that
follow each other, not seconds: ratios carry over to other machines. Such a module may also have
`scalings() -> list[Scaling]`: how time grows with the number of points (`scaling`).
"""

from __future__ import annotations

import importlib
import importlib.metadata
import json
import os
import pkgutil
import platform
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

from course_lib.authoring.tree import CourseError, Tree, nearest

from .scaling import Growth, Scaling, grow

__all__ = ["Case", "Growth", "Ratio", "Scaling", "bench_cases", "compare", "grow", "table"]

ROUNDS = 25
LONGEST_S = 20.0  # of one case; at least FEWEST rounds all the same
FEWEST = 7
LIBRARIES = ("numpy", "scipy", "open3d", "open3d-cpu", "opencv-python-headless")


class Case(NamedTuple):
    """One comparison.

    Parameters
    ----------
    name : what is done, on what input: "deproject 1280x720, 8 % holes, organised float32".
    bound : the largest ratio ours / theirs that is accepted.
    ours, theirs : do the same job on the same input; what they return is thrown away.
    note : the professional tool and how it is called.
    agree : raises AssertionError where both sides do not give the same.
    """

    name: str
    bound: float
    ours: Callable[[], object]
    theirs: Callable[[], object]
    note: str
    agree: Callable[[], None]


@dataclass(frozen=True)
class Ratio:
    """What was measured: ours / theirs over pairs of runs that followed each other."""

    name: str
    note: str
    threads: int
    rounds: int
    low: float  # quarter of the pairs lie below
    median: float
    high: float  # quarter of the pairs lie above
    bound: float

    @property
    def passed(self) -> bool:
        return self.median <= self.bound

    @property
    def line(self) -> str:
        verdict = "PASS" if self.passed else "FAIL"
        return (
            f"{verdict}  {self.median:.2f} times ({self.low:.2f}–{self.high:.2f}), bound {self.bound:g}: "
            f"{self.name}; against {self.note}; {_threads(self.threads)}, {self.rounds} pairs"
        )


def _threads(count: int) -> str:
    return "1 thread" if count == 1 else f"{count} threads"


def compare(
    case: Case,
    threads: int,
    rounds: int = ROUNDS,
    longest: float = LONGEST_S,
    clock: Callable[[], float] = time.perf_counter,
) -> Ratio:
    """Time both sides of a case in turns, changing who goes first.

    Before that, both are shown to give the same, and run once without being timed.

    Raises
    ------
    AssertionError
        If they do not give the same.
    """

    def seconds(job: Callable[[], object]) -> float:
        start = clock()
        job()
        return clock() - start

    case.agree()
    case.ours()
    case.theirs()
    ratios: list[float] = []
    begun = clock()
    while len(ratios) < rounds and (len(ratios) < FEWEST or clock() - begun < longest):
        if len(ratios) % 2:
            theirs = seconds(case.theirs)
            ours = seconds(case.ours)
        else:
            ours = seconds(case.ours)
            theirs = seconds(case.theirs)
        ratios.append(ours / theirs)
    low, median, high = statistics.quantiles(ratios, n=4, method="inclusive")
    return Ratio(case.name, case.note, threads, len(ratios), low, median, high, case.bound)


def case_modules() -> list[str]:
    """Every module that holds cases."""
    folder = str(Path(__file__).parent)
    return sorted(
        f"{__package__}.{module.name}"
        for module in pkgutil.iter_modules([folder])
        if re.fullmatch(r"bench_\d\d", module.name)
    )


def scalings_of(module: str) -> list[Scaling]:
    """The scalings of a module, none where it has none."""
    imported = importlib.import_module(module)
    return imported.scalings() if hasattr(imported, "scalings") else []


def _pin(threads: int) -> None:
    """Hold this process to so many threads: by the processors it may use, and by each library's own setting."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:threads]))
    for module, setter in (("open3d.utility", "set_max_threads"), ("cv2", "setNumThreads")):
        try:
            getattr(importlib.import_module(module), setter)(threads)
        except ModuleNotFoundError:
            continue


def _environment(threads: int) -> dict[str, str]:
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
    root = str(Path(__file__).resolve().parents[2])
    return {**os.environ, **dict.fromkeys(names, str(threads)), "COURSE_QUIET": "1", "PYTHONPATH": root}


def _in_own_process(*words: str, threads: int) -> object:
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
    scalings = scalings_of(module)
    if not name:
        cases: list[Case] = importlib.import_module(module).cases()
        return {"cases": [case.name for case in cases], "scalings": [one.name for one in scalings]}
    for one in scalings:
        if one.name == name:
            return asdict(grow(one, int(threads)))
    return asdict(compare(next(c for c in importlib.import_module(module).cases() if c.name == name), int(threads)))


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
        words = sorted({module.rsplit("bench_", 1)[1] for module, _, _ in known})
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


def machine() -> str:
    """The class of this machine, without its name: cores, platform, Python, libraries."""
    versions = []
    for library in LIBRARIES:
        try:
            versions.append(f"{library} {importlib.metadata.version(library)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    python = ".".join(platform.python_version_tuple()[:2])
    cores = f"{os.cpu_count()} cores, {platform.machine()}, {platform.system()}"
    return f"{cores}, Python {python}, {', '.join(versions)}"


def table(results: Sequence[Ratio | Growth], on: str) -> str:
    """docs/benchmarks.md: ratios and exponents only, because seconds belong to one machine."""
    ratios = [result for result in results if isinstance(result, Ratio)]
    rows = [
        f"| {r.name} | {r.note} | {r.threads} | {r.median:.2f} | {r.low:.2f}–{r.high:.2f} | {r.bound:g} | "
        f"{'yes' if r.passed else '**no**'} |"
        for r in ratios
    ]
    growths = [
        f"| {g.name} | {g.exponent:.2f} | {g.bound:g} | {'yes' if g.passed else '**no**'} |"
        for g in results
        if isinstance(g, Growth)
    ]
    if growths:
        rows += [
            "",
            "## How time grows",
            "",
            "Time is fitted by a power of the number of points, at constant density, on one thread: 1 means that twice",
            "the points take twice the time, 2 four times. Sorting and building of trees are part of it.",
            "",
            "| task | exponent | bound | within |",
            "|---|---|---|---|",
            *growths,
        ]
    return "\n".join(
        [
            "# Benchmarks",
            "",
            "Generated by `python3 course.py bench --write`; edit nothing here. Time of the course's library divided",
            "by that of the professional tool on the same input: 0.5 is twice as fast. Both sides are held to the same",
            "number of threads and run in turns; the median of the pairs is quoted, with the middle half of them.",
            "",
            f"Machine: {on}.",
            "",
            "| task | against | threads | ratio | middle half | bound | within |",
            "|---|---|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


if __name__ == "__main__":
    print(json.dumps(_child(*sys.argv[1:])))
