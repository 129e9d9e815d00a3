"""One comparison of `course bench`: ours and the professional tools in turns, on the same stated number of threads.

What is quoted is the ratio of runs that follow each other, not seconds: ratios carry over to other machines.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

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
    against = {peer: tuple(statistics.quantiles(found, n=4, method="inclusive")) for peer, found in ratios.items()}
    return Ratio(case.name, case.note, threads, done, against, case.bounds[threads > 1])
