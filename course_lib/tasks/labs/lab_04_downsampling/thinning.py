"""Task 5 of lab 04: thin a cloud so that the widest gap is small."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from course_lib.tasks.core import Case, Misconception, Verdict
from course_lib.tasks.judges import judge_band, refuse
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import array_problem, quantity

COUNT = 150


_GAP_BANDS = ((0.240, 1.0), (0.248, 0.75), (0.256, 0.5), (0.430, 0.25))
"""Metres: the widest gap. The farthest points come to 0.21 to 0.23, a voxel grid alone to 0.225 to 0.33."""


def view(rng: np.random.Generator, count: int = 4000) -> Case:
    """A cloud as a camera sees it, row by row: a floor, a back wall and a ball, dense where they are near."""
    u, v = rng.uniform(-0.6, 0.6, count), np.sort(rng.uniform(-0.2, 0.5, count))
    rays = np.stack([u, v, np.ones(count)], axis=1)
    with np.errstate(divide="ignore"):
        depth = np.minimum(np.where(v > 0, 0.9 / v, np.inf), rng.uniform(3.4, 3.6))
    ball, radius = np.array([rng.uniform(-0.4, 0.4), 0.6, rng.uniform(1.9, 2.2)]), 0.3
    b, c = rays @ ball, ball @ ball - radius**2
    a = np.einsum("ij,ij->i", rays, rays)
    inside = b * b - a * c
    hit = inside > 0
    depth[hit] = np.minimum(depth[hit], (b[hit] - np.sqrt(inside[hit])) / a[hit])
    return Case({"points": rays * depth[:, None], "count": COUNT}, {}, "a floor, a wall and a ball, seen by a camera")


def judge_thin(case: Case, answer: Plain) -> Verdict:
    points, count = case.given["points"], case.given["count"]
    tolerance = _GAP_BANDS[0][0]
    problem = array_problem(answer, np.zeros(count), "the list of indices", "int", None)
    if problem:
        return refuse(problem, tolerance, "m")
    chosen = np.asarray(answer)
    if chosen.min() < 0 or chosen.max() >= len(points):
        return refuse(f"The indices must lie between 0 and {len(points) - 1}.", tolerance, "m")
    if len(np.unique(chosen)) < count:
        return refuse(f"Only {len(np.unique(chosen))} of the {count} indices are different.", tolerance, "m")
    gap = float(cKDTree(points[chosen]).query(points)[0].max())
    return judge_band(gap, _GAP_BANDS, "m", what="the widest gap")


def part_of_thin(case: Case, answer: Plain) -> tuple[str, str] | None:
    """What the kept points have in common: too few different ones, a part without any, or crowds."""
    got, points, count = np.asarray(answer), case.given["points"], case.given["count"]
    if got.dtype.kind == "b" and got.shape == (len(points),):
        return "a mask for row numbers", "A mask came back where indices are asked: np.flatnonzero(mask) gives them."
    if got.ndim == 2 and got.shape[1] == 3:
        return "points for row numbers", "Points came back where indices are asked: return which rows you chose."
    if got.dtype.kind not in "iu" or got.shape != (count,) or got.min() < 0 or got.max() >= len(points):
        return None
    different = len(np.unique(got))
    if 2 * different < count:
        return "the same chosen again", (
            f"Only {different} are different, the others were chosen again. Keep for each point the distance to the "
            "nearest of all chosen: the smaller of the old one and that to the new point."
        )
    if different < count:
        return "drawn twice", "Some were drawn more than once: draw without putting back, or leave out what was chosen."
    kept = cKDTree(points[got])
    to_kept = kept.query(points)[0]
    gap = float(to_kept.max())
    near, spacing = (float(one) for one in np.quantile(kept.query(points[got], 2)[0][:, 1], (0.25, 0.5)))
    x, y, z = points[to_kept.argmax()]
    place = f"the widest gap is at x = {x:.1f}, y = {y:.1f}, z = {z:.1f} m"
    alone = float(np.mean(to_kept > _GAP_BANDS[-1][0]))
    if alone > 0.1:
        return "a part left out", (
            f"A whole part has none: {100 * alone:.0f} % of the points lie more than "
            f"{quantity(_GAP_BANDS[-1][0], 'm')} from any kept one; {place}."
        )
    if 4 * near < gap:
        return "crowded", (
            f"A quarter of the kept points have another within {quantity(near, 'm')}: too many where the cloud "
            f"is dense, too few elsewhere; {place}. Choose by the distance to those already chosen."
        )
    return "a part left thin", (
        f"Most kept points lie about {quantity(spacing, 'm')} apart, but {place}: is a coordinate left out of the "
        "distance, is a voxel too large, or is the rest filled up without asking where?"
    )


def guess_thin(rng: np.random.Generator):
    """A function that draws its points from a random stretch of the list."""
    seed, share = int(rng.integers(2**31)), float(rng.uniform(0.3, 1.0))

    def thin_out(points, count):
        most = max(count, int(share * len(points)))
        return np.random.default_rng(seed).choice(most, count, replace=False)

    return thin_out


def _wrong_thin(expression: str) -> str:
    return f"def thin_out(points, count):\n    return {expression}\n"


_LESSONS_GRID = """def thin_out(points, count):
    def nearest_to_centre(voxel):
        index = np.floor(points / voxel)
        order = np.argsort(np.linalg.norm(points - (index + 0.5) * voxel, axis=1), kind="stable")
        return order[np.unique(index[order], axis=0, return_index=True)[1]]

    low, high = 0.05, 2.0
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if len(nearest_to_centre(middle)) > count else (low, middle)
    kept = nearest_to_centre(high)
    rest = np.setdiff1d(np.arange(len(points)), kept)
    return np.concatenate([kept, rest[: count - len(kept)]])
"""

THIN_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "a voxel grid, its voxel chosen to fit the count: where its gaps lie is luck, and one scene of seven tears a "
        "hole; put each point where the widest gap is",
        _LESSONS_GRID,
    ),
    Misconception(
        "the first ones",
        "the first points of the list: they all come from one part of the scene",
        _wrong_thin("np.arange(count)"),
    ),
    Misconception(
        "every k-th point",
        "every k-th point of the list: where the camera saw many points you keep many, and far away hardly any",
        _wrong_thin("np.arange(count) * (len(points) // count)"),
        variants=(_wrong_thin("np.linspace(0, len(points) - 1, count).astype(int)"),),
    ),
    Misconception(
        "at random",
        "points drawn at random: dense parts stay dense, and holes open where there were few",
        _wrong_thin("np.random.default_rng(0).choice(len(points), count, replace=False)"),
        variants=(_wrong_thin("np.random.default_rng(0).permutation(len(points))[:count]"),),
    ),
    Misconception(
        "the farthest from the middle",
        "the points farthest from the middle of the cloud: they lie on its rim; ask how far it is to the chosen points",
        _wrong_thin("np.argsort(-np.linalg.norm(points - points.mean(axis=0), axis=1))[:count]"),
    ),
)
