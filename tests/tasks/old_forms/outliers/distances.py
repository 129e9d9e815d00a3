"""The wrong answers to task 2 of lab 05, mean distances, as learner code."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_distances(
    last: str,
    first: str = "np.sort(d, axis=1)[:, 1:k + 1]",
    axes: str = ":",
    each: str = "np.sqrt((x ** 2).sum(axis=-1))",
) -> str:
    return ("def mean_distances(points, k):\n"
            f"    x = points[:, None, {axes}] - points[None, :, {axes}]\n"
            f"    d = {each}\n"
            f"    near = {first}\n"
            f"    return {last}\n")  # fmt: skip


def _by_tree(last: str, count: str, of: str = "points") -> str:
    return ("from scipy.spatial import cKDTree\n"
            "def mean_distances(points, k):\n"
            f"    distance, index = cKDTree({of}).query(points, {count})\n"
            f"    return {last}\n")  # fmt: skip


_COUNTED = {
    "itself": ("[:, :k]", "k + 1", "the point's own 0 is among the k: ask for k + 1 and leave the first out"),
    "one too few": ("[:, 1:]", "k", "only k - 1 neighbours are left: ask for k + 1"),
}
_TAKEN = {
    "sum": ("near.sum(axis=1)", "their sum is not divided by k"),
    "median": ("np.median(near, axis=1)", "their median is taken in the place of the mean"),
    "squares": ("(near ** 2).mean(axis=1)", "their squares are averaged in the place of the distances"),
}


def _two_at_once() -> tuple[Misconception, ...]:
    """The wrong neighbours, and something else than their mean."""
    return tuple(
        Misconception(
            f"{one} and {other}",
            f"two mistakes: {first}; and {second}",
            _by_tree(taken.replace("near", f"distance{columns}"), count),
        )
        for one, (columns, count, first) in _COUNTED.items()
        for other, (taken, second) in _TAKEN.items()
        if one == "itself" or other == "squares"  # a sum does not change with a 0 in it
    )


DISTANCE_MISTAKES = (
    *_two_at_once(),
    Misconception(
        "one too few and median",
        "two mistakes: only k - 1 neighbours are left, or the point's own 0 is one more; and their median is taken in "
        "the place of the mean",
        _by_tree("np.median(distance[:, 1:], axis=1)", "k"),
        variants=(_by_tree("np.median(distance, axis=1)", "k + 1"),),
    ),
    Misconception(
        "the point itself counted",
        "a mean that holds the distance 0 of the point to itself: ask for k + 1 and leave the first out (a tree "
        "that is asked for one point gives the point itself)",
        _wrong_distances("near.mean(axis=1)", "np.sort(d, axis=1)[:, :k]"),
        variants=(_by_tree("distance.mean(axis=1)", "k"),),
    ),
    Misconception(
        "one neighbour too few",
        "k - 1 neighbours, as the point itself took one of the k places (at k = 1 none is left: NaN or an error): "
        "ask for k + 1",
        _wrong_distances("near.mean(axis=1)", "np.sort(d, axis=1)[:, 1:k]"),
        variants=(_by_tree("distance[:, 1:].mean(axis=1)", "k"),),
    ),
    Misconception(
        "millimetres for metres",
        "distances times 1000: points and answer are both in metres",
        _wrong_distances("1000 * near.mean(axis=1)"),
    ),
    Misconception(
        "median for mean",
        "the median of the distances: it is their mean",
        _wrong_distances("np.median(near, axis=1)"),
    ),
    Misconception(
        "itself as one more",
        "k + 1 distances of which one is the point's own 0: leave that one out before you take the mean",
        _wrong_distances("near.mean(axis=1)", "np.sort(d, axis=1)[:, :k + 1]"),
    ),
    Misconception(
        "squared distances",
        "a mean of squared distances: take the root of each first",
        _wrong_distances("(near ** 2).mean(axis=1)"),
    ),
    Misconception(
        "root of the mean square",
        "the root of the mean of squares, which far neighbours pull up: take the root first and then the mean",
        _wrong_distances("np.sqrt((near ** 2).mean(axis=1))"),
    ),
    Misconception(
        "the k-th only",
        "the distance of the k-th neighbour alone: it is the mean over all k",
        _wrong_distances("near[:, -1]"),
    ),
    Misconception(
        "sum for mean",
        "a sum over the neighbours: divide by k, or the number depends on k",
        _wrong_distances("near.sum(axis=1)"),
    ),
    Misconception(
        "zeros left out",
        "every distance of 0 left out: a point that was measured twice has a true neighbour at 0; leave out the point "
        "itself only",
        _wrong_distances("near.mean(axis=1)", "np.sort(np.where(d > 0, d, np.inf), axis=1)[:, :k]"),
        variants=(_wrong_distances("np.nanmean(np.where(near > 0, near, np.nan), axis=1)",
                                   "np.sort(d, axis=1)[:, :k + 1]"),),
    ),
    Misconception(
        "some axes only",
        "differences along x alone, or along two axes, as from above: a distance needs all three",
        _wrong_distances("near.mean(axis=1)", axes=":1"),
        variants=(_wrong_distances("near.mean(axis=1)", axes=":2"),),
    ),
    Misconception(
        "another distance",
        "differences along x, y and z added up, or the largest of them: the root of the sum of squares is asked",
        _wrong_distances("near.mean(axis=1)", each="np.abs(x).sum(axis=-1)"),
        variants=(_wrong_distances("near.mean(axis=1)", each="np.abs(x).max(axis=-1)"),),
    ),
    Misconception(
        "all points, not the nearest",
        "a mean over all points of the cloud: sort each row and take the k nearest others",
        _wrong_distances("d.sum(axis=1) / (len(d) - 1)"),
        variants=(_wrong_distances("d.mean(axis=1)"),),
    ),
    Misconception(
        "not sorted",
        "the first k in the order of the list: sort each row of distances before you take k",
        _wrong_distances("near.mean(axis=1)", "d[:, 1:k + 1]"),
        variants=(
            _wrong_distances("near.mean(axis=1)", "d[:, :k]"),
            _wrong_distances("near.mean(axis=1)", "np.sort(d, axis=0)[:, 1:k + 1]"),
            _wrong_distances("np.array([np.delete(row, i)[:k].mean() for i, row in enumerate(d)])"),
        ),
    ),
    Misconception(
        "the farthest",
        "the k farthest points: sorted the wrong way round, or counted from the end",
        _wrong_distances("near.mean(axis=1)", "np.sort(d, axis=1)[:, -k:]"),
        variants=(_wrong_distances("near.mean(axis=1)", "np.sort(d, axis=1)[:, ::-1][:, 1:k + 1]"),),
    ),
    Misconception(
        "mean along the wrong axis",
        "a mean over the points, which gives one number for each of the k: take it over the k of each point, axis=1",
        _wrong_distances("near.mean(axis=0)"),
        variants=(_wrong_distances("near.mean(axis=0)", "np.sort(d, axis=1)[:, :k + 1]"),),
    ),
    Misconception(
        "row numbers for distances",
        "row numbers averaged: a tree returns distances first, row numbers second",
        _wrong_distances("near.mean(axis=1)", "np.argsort(d, axis=1)[:, 1:k + 1]"),
        variants=(_by_tree("index[:, 1:].mean(axis=1)", "k + 1"),),
    ),
    Misconception(
        "distance to the middle of the neighbours",
        "the distance to the mean of the neighbours, where some in front cancel some behind: it is the mean of the k "
        "distances",
        _by_tree("np.linalg.norm(points[index[:, 1:]].mean(axis=1) - points, axis=1)", "k + 1"),
        variants=(_by_tree("np.linalg.norm(points[index].mean(axis=1) - points, axis=1)", "k + 1"),),
    ),
    Misconception(
        "twins merged",
        "points in the same place made one: each is a neighbour of its own, and of the other at distance 0",
        _by_tree("distance[:, 1:].mean(axis=1)", "k + 1", "np.unique(points, axis=0)"),
    ),
    Misconception(
        "divided by another number",
        "the sum of the k distances divided by another number than k",
        _wrong_distances("near.sum(axis=1) / max(k - 1, 1)"),
        variants=(_wrong_distances("near.sum(axis=1) / len(points)"),),
    ),
    Misconception(
        "the nearest left out",
        "the nearest neighbour left out, too: only the point itself, the first of k + 1, is none",
        _wrong_distances("near.mean(axis=1)", "np.sort(d, axis=1)[:, 2:k + 2]"),
    ),
    Misconception(
        "norm for mean",
        "the root of the sum of the squares of the k distances: add up the distances and divide by k",
        _wrong_distances("np.linalg.norm(near, axis=1)"),
    ),
    Misconception(
        "distance to the middle of the cloud",
        "the distance to the mean of all points: it is the mean of the distances to the k nearest",
        _wrong_distances("np.linalg.norm(points - points.mean(axis=0), axis=1)"),
    ),
    Misconception(
        "spread for mean",
        "the standard deviation of the distances: it is their mean",
        _wrong_distances("near.std(axis=1)"),
        variants=(_wrong_distances("near.var(axis=1)"),),
    ),
)  # fmt: skip
