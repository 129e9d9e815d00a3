"""Which part of a wrong answer of lab 04 is wrong, the one first that causes the others."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from course_lib.tasks.core import Case
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import quantity

Part = tuple[str, str] | None
_SAME = 1e-4
"""Metres: points that are nearer are the same."""


def part_of_index(case: Case, answer: Plain) -> Part:
    """Numbers that are not whole, of a grid that begins elsewhere, or wrong by the rounding alone."""
    got, truth = np.asarray(answer, float), np.asarray(case.truth)
    if got.shape != truth.shape or not np.isfinite(got).all():
        return None
    off = got - truth
    if (np.abs(got - np.rint(got)) > 1e-9).any():
        if off.min() >= 0 and off.max() < 1:
            return "not rounded", "The numbers are right but for the digits behind the point: round down, np.floor."
        return "not whole", "The numbers are not whole: round down at the very end, after all else."
    spread = np.ptp(off, axis=0).max()
    if len(off) > 2 and (spread == 0 or (spread == 1 and np.abs(off).max() > 1)):
        by = ", ".join(f"{one:+g}" for one in np.median(off, axis=0))
        nearly = "" if spread == 0 else "nearly "
        return "another origin", (
            f"All rows are off by {nearly}the same ({by}): the grid begins elsewhere than at `origin`. Is that "
            "rounded, or not divided?"
        )
    if np.abs(off).max() == 1 and (truth[off != 0] >= 0).any():
        return "one cube beside", "No number is off by more than 1: the division is right, the rounding is not."
    return None


def part_of_grid(case: Case, answer: Plain) -> Part:
    """Whether cubes are left out or too many, whether points are measured ones, and where the grid is another."""
    got, truth, points = np.asarray(answer, float), np.asarray(case.truth), case.given["points"]
    if got.ndim != 2 or got.shape[1] != 3 or not len(got) or not np.isfinite(got).all():
        return None
    right = cKDTree(truth).query(got)[0] < _SAME
    found = cKDTree(got).query(truth)[0] < _SAME
    if right.all() and not found.all():
        return "cubes left out", f"All that came back is right; {np.sum(~found):,} of {len(truth):,} cubes are missing."
    if found.all():
        more = len(got) - len(truth)
        if right.all():
            return "cubes twice", f"All cubes are there, {more:,} more than once: return each once."
        return "cubes too many", (
            f"All {len(truth):,} are there, and {more:,} more that should not be: which cubes hold fewer than `least`?"
        )
    if (cKDTree(points).query(got)[0] < _SAME / 100).all():
        return "measured points", "Only points that were given came back: return the mean of those in each cube."
    if right.any():
        near = np.abs(got[~right] - case.given["origin"]).min(axis=1)
        if (near < case.given["voxel"]).all():
            return "wrong beside the origin", (
                f"{right.sum():,} of {len(got):,} are right; those beside the planes through the origin are not: "
                "how are numbers below 0 rounded?"
            )
        return (
            "some cubes",
            f"{right.sum():,} of {len(got):,} are right: which cubes share a number, or lie beside the origin?",
        )
    if cKDTree(truth).query(got)[0].max() < 0.05 * case.given["voxel"] and len(got) == len(truth):
        return "nearly the means", "Every point lies close to the mean of a cube, but not at it: is something rounded?"
    if len(got) == len(truth):
        return "another point of each", (
            "As many as there should be, but none is the mean of a cube: is another point of each returned, or is the "
            "grid another?"
        )
    return "another grid", (
        f"None of your {len(got):,} points is the mean of a cube ({len(truth):,} are asked): the cubes are others. "
        "Look at origin, rounding, and at how points are put together."
    )


def part_of_normal(case: Case, answer: Plain) -> Part:
    """The length, the side, a tilt, or a direction within the surface."""
    got, truth = np.asarray(answer, float), np.asarray(case.truth)
    if got.shape == (len(case.given["neighbours"]),):
        return "one number a neighbour", (
            "One number for each neighbour came back: with the offsets in rows, the matrix of their spread is d.T @ d, "
            "3 by 3."
        )
    if got.shape != (3,) or not np.isfinite(got).all() or not got.any():
        return None
    length = float(np.linalg.norm(got))
    angle = float(np.degrees(np.arccos(np.clip(got @ truth / length, -1, 1))))
    line = min(angle, 180 - angle)
    if abs(length - 1) > 1e-2:
        values = np.linalg.eigvalsh(np.cov(case.given["neighbours"], rowvar=False))
        if np.allclose(np.abs(got) / length, values / np.linalg.norm(values), atol=1e-3):
            return "eigenvalues for a vector", "These are the eigenvalues, the spreads: eigh returns vectors second."
        if angle < 0.2:
            return "not of length 1", "Only the length is wrong: divide the normal by its length."
        return "not of length 1", f"And its direction is {quantity(angle, 'deg')} off: mend that first."
    if line < 0.2:
        return "only the side", (
            "The line is right, the side is wrong: compare with the arrow from the points' mean to the viewpoint."
        )
    side = ", and points to the other side" if angle > 90 else ""
    if line < 5:
        return "tilted a little", (
            f"The normal is tilted by {quantity(line, 'deg')}, no more{side}: is the spread counted from another place "
            "than the mean of the points, or are only some of them used?"
        )
    if line > 85:
        return "in the surface", (
            "It lies in the surface: spread is least along the normal. eigh sorts eigenvalues ascending, svd "
            "descending, eig not at all."
        )
    return "slanted", (
        f"It is neither the normal nor in the surface, {quantity(line, 'deg')} off{side}: what are the points counted "
        "from, and does a vector stand in a row or in a column?"
    )
