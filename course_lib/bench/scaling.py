"""How the time of an algorithm grows with the number of points, at constant density."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

EXPONENT = 1.25  # of what sorts and searches: n log n over two powers of ten, and caches that no longer hold it
SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000)
ROUNDS = 3  # of each size, the sizes in turns; the fastest run counts, as only it was not disturbed
SHORTEST_S = 0.05  # a job is repeated until it took at least this long, so that small sizes are not all clock and start


class Scaling(NamedTuple):
    """One algorithm over growing inputs.

    Parameters
    ----------
    name : what is done: "voxel grid".
    bound : the largest exponent that is accepted.
    make : a number of points to a job on an input of that size, at the density of every other size.
    sizes : at least five numbers of points, spread over two powers of ten.
    """

    name: str
    bound: float
    make: Callable[[int], Callable[[], object]]
    sizes: tuple[int, ...] = SIZES


def over(
    points: Callable[..., np.ndarray], job: Callable[[np.ndarray], object], **given: float
) -> Callable[[int], Callable[[], object]]:
    """What `Scaling.make` wants: a job over points that are drawn by `points(n, seed, **given)`."""
    return lambda n: functools.partial(job, points(n, 9, **given))


@dataclass(frozen=True)
class Growth:
    """What was measured: the exponent of time over number of points."""

    name: str
    threads: int
    sizes: Sequence[int]
    exponent: float
    bound: float

    @property
    def passed(self) -> bool:
        return self.exponent <= self.bound

    @property
    def line(self) -> str:
        verdict = "PASS" if self.passed else "FAIL"
        return (
            f"{verdict}  time grows with the power {self.exponent:.2f} of the points, bound {self.bound:g}: "
            f"{self.name}; {len(self.sizes)} sizes from {min(self.sizes):,} to {max(self.sizes):,}"
        )


def fit_exponent(sizes: Sequence[int], seconds: Sequence[float]) -> float:
    """Return the slope of the line through the logarithms of both, by least squares.

    Examples
    --------
    >>> round(fit_exponent([10, 100, 1000], [2, 200, 20000]), 6)
    2.0
    """
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def grow(
    scaling: Scaling, threads: int, rounds: int = ROUNDS, clock: Callable[[], float] = time.perf_counter
) -> Growth:
    """Time a job at each size, the sizes in turns, and fit the exponent to the fastest runs.

    Raises
    ------
    ValueError
        If there are fewer than five sizes.
    """
    if len(scaling.sizes) < 5:
        raise ValueError(f"{scaling.name}: an exponent needs at least 5 sizes, got {len(scaling.sizes)}.")
    jobs = [scaling.make(size) for size in scaling.sizes]
    best = [np.inf] * len(jobs)
    for _ in range(rounds):
        for i, job in enumerate(jobs):
            count, start = 0, clock()
            while count == 0 or clock() - start < SHORTEST_S:
                job()
                count += 1
            best[i] = min(best[i], (clock() - start) / count)
    return Growth(scaling.name, threads, scaling.sizes, fit_exponent(scaling.sizes, best), scaling.bound)
