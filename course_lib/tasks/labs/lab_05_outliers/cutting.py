"""Task 1 of lab 05: where to cut a histogram if a true point that is lost has its price."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case
from course_lib.tasks.labs.lab_05_outliers.mistakes import CUT_MISTAKES
from course_lib.tasks.labs.lab_05_outliers.telling import telling

CUT_TOLERANCE = 1e-5  # pixels; bins are wider by far


def _where_to_cut(mean: np.ndarray, wrong: np.ndarray, edges: np.ndarray, cost: int) -> float:
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        inside = (low <= mean) & (mean < high)
        if np.sum(inside & wrong) > cost * np.sum(inside & ~wrong):
            return float(low)
    raise ValueError("in no bin the wrong points outweigh the true ones")


def _cut_case(mean: np.ndarray, wrong: np.ndarray, edges: np.ndarray, cost: int, name: str) -> Case:
    given = {"mean": mean, "wrong": wrong, "edges": edges, "cost": cost}
    return Case(given, {"truth": _where_to_cut(mean, wrong, edges, cost)}, name)


def _counts(rng: np.random.Generator, cost: int) -> np.ndarray:
    """True and wrong points (2, B) of the bins of a histogram in which each rule but the right one cuts elsewhere."""
    hill = [(int(n), int(rng.integers(1, 6))) for n in 400 * np.exp(-(((np.arange(6) - 2.2) / 1.8) ** 2)) + 9]
    hill[0] = hill[0][0], 0
    few, tie, last = (int(n) for n in rng.integers((12, 6, 3), (20, 10, 7)))
    foot = [
        (3 * few, 2 * few),
        (few, few + 2),  # more wrong ones than true ones, and not enough of them
        (few, 2 * few),
        (few, 3),
        (tie, cost * tie),
        (few, few - 2),
        (last, cost * last + 1),
        (last, last + 1),
        (2, 4 * cost + int(rng.integers(60, 90))),
        (0, 0),
        (1, cost),
        (0, int(rng.integers(5, 9))),
        *((int(rng.integers(2, 4)), 0) for _ in range(int(rng.integers(1, 3)))),
    ]
    return np.array(hill + foot).T


def cut_cases(rng: np.random.Generator) -> list[Case]:
    head = _cut_case(np.array([1, 1, 3, 3, 3, 5.0]), np.arange(6) > 2, np.array([0, 2, 4, 6.0]), 2,
                     "six points in three bins")  # fmt: skip

    def draw() -> Case:
        cost = int(rng.integers(3, 9))
        counts = _counts(rng, cost)
        edges = np.geomspace(rng.uniform(0.8, 1.0), rng.uniform(50, 60), counts.shape[1] + 1)
        low, high = np.repeat(np.tile(edges[:-1], 2), counts.ravel()), np.repeat(np.tile(edges[1:], 2), counts.ravel())
        mean = low + (high - low) * rng.uniform(0.02, 0.98, len(low))
        order = rng.permutation(len(mean))
        return _cut_case(mean[order], (np.arange(len(mean)) >= counts[0].sum())[order], edges, cost,
                         f"{len(mean):,} mean distances")  # fmt: skip

    return telling(draw, CUT_MISTAKES, "where_to_cut", 3, (head,))
