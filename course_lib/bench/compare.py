"""`course bench`: ours against the professional tools, timed in turns, all on the same stated number of threads.

A case comes from a module `bench_NN.py` of this folder with `cases() -> list[Case]`. Each runs in a process of its own,
so that thread counts are set before anything is imported. What is quoted is the ratio of runs that follow each other,
not seconds: ratios carry over to other machines. Such a module may also have `scalings() -> list[Scaling]`: how time
grows with the number of points (`scaling`).
"""

from __future__ import annotations

import importlib
import json
import os
import pkgutil
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

from course_lib.authoring.tree import CourseError, Tree, nearest

from .scaling import Growth, Scaling, grow

ROUNDS = 25
LONGEST_S = 20.0  # of one case; at least FEWEST rounds all the same
FEWEST = 7


class Case(NamedTuple):
    """One comparison.

    Parameters
    ----------
    name : what is done, on what input: "deproject 1280x720, 8 % holes, organised float32".
    bounds : the largest ratio to the fastest peer that is accepted, on one thread and on two.
    ours : does the job; what it returns is thrown away.
    peers : the professional tools by name; each does the same job on the same input.
    note : how they are called, and what of it is the same.
    agree : raises AssertionError where ours does not give what they give.
    """

    name: str
    bounds: tuple[float, float]
    ours: Callable[[], object]
    peers: dict[str, Callable[[], object]]
    note: str
    agree: Callable[[], None]


@dataclass(frozen=True)
class Ratio:
    """What was measured: ours / theirs over runs that followed each other.

    Attributes
    ----------
    against : of each peer a quarter, the half and three quarters of the ratios lie below.
    """

    name: str
    note: str
    threads: int
    rounds: int
    against: dict[str, tuple[float, float, float]]
    bound: float

    @property
    def best(self) -> str:
        """The fastest peer."""
        return max(self.against, key=lambda peer: self.against[peer][1])

    @property
    def median(self) -> float:
        return self.against[self.best][1]

    @property
    def passed(self) -> bool:
        return self.median <= self.bound

    @property
    def line(self) -> str:
        verdict = "PASS" if self.passed else "FAIL"
        told = ", ".join(
            f"{mid:.2f} of {peer} ({low:.2f}–{high:.2f})" for peer, (low, mid, high) in self.against.items()
        )
        threads = "1 thread" if self.threads == 1 else f"{self.threads} threads"
        return f"{verdict}  {told}; bound {self.bound:g} of the best: {self.name}; {threads}, {self.rounds} rounds"


def compare(
    case: Case,
    threads: int,
    rounds: int = ROUNDS,
    longest: float = LONGEST_S,
    clock: Callable[[], float] = time.perf_counter,
) -> Ratio:
    """Time all sides of a case in turns, each beginning a round in its turn.

    Before that, they are shown to give the same, and run once without being timed.

    Raises
    ------
    AssertionError
        If they do not give the same.
    """
    sides = {"": case.ours, **case.peers}
    case.agree()
    for job in sides.values():
        job()
    ratios: dict[str, list[float]] = {peer: [] for peer in case.peers}
    begun, done = clock(), 0
    while done < rounds and (done < FEWEST or clock() - begun < longest):
        seconds = {}
        names = list(sides)
        for name in names[done % len(names) :] + names[: done % len(names)]:
            start = clock()
            sides[name]()
            seconds[name] = clock() - start
        for peer, found in ratios.items():
            found.append(seconds[""] / seconds[peer])
        done += 1
    against = {}
    for peer, found in ratios.items():
        low, median, high = statistics.quantiles(found, n=4, method="inclusive")
        against[peer] = (low, median, high)
    return Ratio(case.name, case.note, threads, done, against, case.bounds[threads > 1])


def case_modules() -> list[str]:
    """Every module that holds cases."""
    modules = (module.name for module in pkgutil.iter_modules([str(Path(__file__).parent)]))
    return sorted(f"{__package__}.{name}" for name in modules if re.fullmatch(r"bench_\d\d", name))


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
    scalings = scalings_of(module)
    cases: list[Case] = importlib.import_module(module).cases()
    if not name:
        return {"cases": [case.name for case in cases], "scalings": [one.name for one in scalings]}
    for one in scalings:
        if one.name == name:
            return asdict(grow(one, int(threads)))
    return asdict(compare(next(case for case in cases if case.name == name), int(threads)))


def bench_cases(tree: Tree, only: str, write: bool, say: Callable[[str], None]) -> int:
    """Run the cases whose name or module holds a word, print each, and write the table.

    Returns
    -------
    The exit code: 1 if a case is over its bound.
    """
    from .table import machine, table

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
