"""The judge of points in any order, apart from `judges`: it needs SciPy, which takes 0.4 s to import."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_bipartite_matching
from scipy.spatial import cKDTree

from course_lib.tasks.core import Verdict
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import measured, not_numbers, place_of, refuse, share, transposed, up

__all__ = ["judge_points_set"]


def judge_points_set(
    answer: Plain, truth: np.ndarray, tolerance: float, unit: str = "m", what: str = "the points"
) -> Verdict:
    """Points (N, D) in any order against the true ones: as many, and each within `tolerance` of its own partner."""
    truth = np.asarray(truth, float)
    form = f"points of shape (N, {truth.shape[1]})"
    problem = not_numbers(answer, what, form)
    if problem:
        return refuse(problem, tolerance, unit)
    values = np.asarray(answer, dtype=float)
    if values.ndim != 2 or values.shape[1] != truth.shape[1]:
        return refuse(
            f"{up(what)}: expected {form}, got {values.shape}{transposed(values.shape, truth.shape)}", tolerance, unit
        )
    if not np.isfinite(values).all():
        return refuse(
            f"{up(what)}: {share(~np.isfinite(values).all(axis=1))} NaN or infinite; drop those.", tolerance, unit
        )
    if len(values) != len(truth):
        return refuse(f"{up(what)}: expected {len(truth):,}, got {len(values):,}.", tolerance, unit)
    if len(values) == 0:
        return Verdict(True, 0.0, tolerance, unit, what, f"{up(what)}: none, as it should be.")
    mine, true = cKDTree(values), cKDTree(truth)
    forward, backward = true.query(values)[0], mine.query(truth)[0]
    if forward.max() > max(tolerance, backward.max()):
        place = place_of((int(forward.argmax()),), values.shape[:1])
        return measured(float(forward.max()), tolerance, unit, what, place)
    if backward.max() > tolerance:
        return measured(float(backward.max()), tolerance, unit, what, "a true point that has no partner among yours")
    partners = true.query_ball_point(values, tolerance)
    pairs = csr_matrix(
        (
            np.ones(sum(map(len, partners)), bool),
            np.concatenate(partners).astype(int),
            np.cumsum([0, *map(len, partners)]),
        ),
        shape=(len(values), len(truth)),
    )
    alone = int((maximum_bipartite_matching(pairs, perm_type="column") < 0).sum())
    if alone:
        return refuse(f"{up(what)}: {alone:,} too many in one place, missing in another.", tolerance, unit, what)
    return measured(float(forward.max()), tolerance, unit, what, "")
