"""The wrong answers to task 2 of lab 05, mean distances in pixels, as learner code."""

from __future__ import annotations

from course_lib.tasks.core import Misconception

_SCALED = "fx * near.mean(axis=1) / p[:, 2]"


def _wrong(
    last: str = _SCALED,
    near: str = "np.sort(d, axis=1)[:, 1:k + 1]",
    axes: str = ":",
    each: str = "np.sqrt((x ** 2).sum(axis=-1))",
    of: str = "points[measured]",
) -> str:
    """Learner code that minds what was not measured; `p` are the measured points."""
    return ("def mean_distances(points, k, fx):\n"
            "    measured = ~np.isnan(points[:, 2])\n"
            f"    p = {of}\n"
            f"    x = p[:, None, {axes}] - p[None, :, {axes}]\n"
            f"    d = {each}\n"
            f"    near = {near}\n"
            "    out = np.full(len(points), np.nan)\n"
            f"    out[measured] = {last}\n"
            "    return out\n")  # fmt: skip


def _mean(expression: str) -> str:
    """In the place of the mean of the distances."""
    return _wrong(_SCALED.replace("near.mean(axis=1)", expression))


def _by_tree(near: str, count: str) -> str:
    return ("from scipy.spatial import cKDTree\n"
            "def mean_distances(points, k, fx):\n"
            "    measured = ~np.isnan(points[:, 2])\n"
            "    p = points[measured]\n"
            f"    distance, index = cKDTree(p).query(p, {count})\n"
            "    out = np.full(len(points), np.nan)\n"
            f"    out[measured] = fx * {near} / p[:, 2]\n"
            "    return out\n")  # fmt: skip


_OWN = ("from scipy.spatial import cKDTree\n"
        "def mean_distances(points, k, fx):\n"
        "    distance, _ = cKDTree(points).query(points, k + 1)\n"
        "    return distance[:, 1:].mean(axis=1)\n")  # fmt: skip
_NEIGHBOURS = "np.argsort(d, axis=1, kind='stable')[:, 1:k + 1]"

DISTANCE_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "the lesson's distances in metres: here they are asked in pixels at the depth of the point, times fx / z; and "
        "a tree takes no NaN, so leave out what was not measured before you build it",
        _OWN,
        variants=(_wrong("near.mean(axis=1)"),),
    ),
    Misconception(
        "depth left out",
        "distances times fx that were not divided by the depth z of the point: a pixel is z / fx wide",
        _wrong("fx * near.mean(axis=1)"),
    ),
    Misconception(
        "focal length left out",
        "distances divided by z that were not multiplied by fx: a pixel is z / fx wide",
        _wrong("near.mean(axis=1) / p[:, 2]"),
    ),
    Misconception(
        "z and fx exchanged",
        "distances multiplied by the width of a pixel, z / fx, where they are to be divided by it",
        _wrong("near.mean(axis=1) * p[:, 2] / fx"),
    ),
    Misconception(
        "range for depth",
        "the distance to the camera in the place of the depth: depth is z alone",
        _wrong("fx * near.mean(axis=1) / np.linalg.norm(p, axis=1)"),
    ),
    Misconception(
        "one depth for all",
        "one depth for all points, such as their mean or median: each point's own z is asked",
        _wrong("fx * near.mean(axis=1) / p[:, 2].mean()"),
        variants=(_wrong("fx * near.mean(axis=1) / np.median(p[:, 2])"),),
    ),
    Misconception(
        "the neighbours' depth",
        "distances divided by the depths of the neighbours: a pixel is as wide as it is at the point itself",
        _wrong(f"fx * near.mean(axis=1) / p[{_NEIGHBOURS}, 2].mean(axis=1)"),
        variants=(_wrong(f"fx * (near / p[{_NEIGHBOURS}, 2]).mean(axis=1)"),),
    ),
    Misconception(
        "distances in the image",
        "distances between pixels of the image, x / z and y / z: a flying pixel has near neighbours there; take the "
        "distance in space first",
        _wrong("fx * near.mean(axis=1)", of="points[measured] / points[measured, 2:]"),
    ),
    Misconception(
        "the point itself counted",
        "a mean that holds the distance 0 of the point to itself: ask for k + 1 and leave the first out (a tree "
        "that is asked for one point gives the point itself)",
        _wrong(near="np.sort(d, axis=1)[:, :k]"),
        variants=(_by_tree("distance.mean(axis=1)", "k"),),
    ),
    Misconception(
        "one neighbour too few",
        "k - 1 neighbours, as the point itself took one of the k places (at k = 1 none is left: NaN or an error): "
        "ask for k + 1",
        _wrong(near="np.sort(d, axis=1)[:, 1:k]"),
        variants=(_by_tree("distance[:, 1:].mean(axis=1)", "k"),),
    ),
    Misconception(
        "itself as one more",
        "k + 1 distances of which one is the point's own 0: leave that one out before you take the mean",
        _wrong(near="np.sort(d, axis=1)[:, :k + 1]"),
    ),
    Misconception(
        "itself counted and metres",
        "two mistakes: the point's own 0 is among the k (ask for k + 1 and leave the first out), and the distances are "
        "in metres, not in pixels",
        _wrong("near.mean(axis=1)", "np.sort(d, axis=1)[:, :k]"),
    ),
    Misconception(
        "median for mean",
        "the median of the distances: it is their mean",
        _mean("np.median(near, axis=1)"),
    ),
    Misconception(
        "squared distances",
        "a mean of squared distances: take the root of each first",
        _mean("(near ** 2).mean(axis=1)"),
    ),
    Misconception(
        "root of the mean square",
        "the root of the mean of squares, which far neighbours pull up: take the root first and then the mean",
        _mean("np.sqrt((near ** 2).mean(axis=1))"),
    ),
    Misconception(
        "the k-th only",
        "the distance of the k-th neighbour alone: it is the mean over all k",
        _mean("near[:, -1]"),
    ),
    Misconception(
        "sum for mean",
        "a sum over the neighbours: divide by k, or the number depends on k",
        _mean("near.sum(axis=1)"),
    ),
    Misconception(
        "zeros left out",
        "every distance of 0 left out: a point that was measured twice has a true neighbour at 0; leave out the point "
        "itself only",
        _wrong(near="np.sort(np.where(d > 0, d, np.inf), axis=1)[:, :k]"),
        variants=(_mean("np.nanmean(np.where(near > 0, near, np.nan), axis=1)"),),
    ),
    Misconception(
        "some axes only",
        "differences along x alone, or along two axes, as from above: a distance needs all three",
        _wrong(axes=":1"),
        variants=(_wrong(axes=":2"),),
    ),
    Misconception(
        "another distance",
        "differences along x, y and z added up, or the largest of them: the root of the sum of squares is asked",
        _wrong(each="np.abs(x).sum(axis=-1)"),
        variants=(_wrong(each="np.abs(x).max(axis=-1)"),),
    ),
    Misconception(
        "all points, not the nearest",
        "a mean over all points of the cloud: sort each row and take the k nearest others",
        _mean("d.sum(axis=1) / (len(d) - 1)"),
        variants=(_mean("d.mean(axis=1)"),),
    ),
    Misconception(
        "not sorted",
        "the first k in the order of the list: sort each row of distances before you take k",
        _wrong(near="d[:, 1:k + 1]"),
        variants=(_wrong(near="d[:, :k]"), _wrong(near="np.sort(d, axis=0)[:, 1:k + 1]")),
    ),
    Misconception(
        "the farthest",
        "the k farthest points: sorted the wrong way round, or counted from the end",
        _wrong(near="np.sort(d, axis=1)[:, -k:]"),
    ),
    Misconception(
        "row numbers for distances",
        "row numbers averaged: a tree returns distances first, row numbers second",
        _by_tree("index[:, 1:].mean(axis=1)", "k + 1"),
    ),
    Misconception(
        "distance to the middle of the neighbours",
        "the distance to the mean of the neighbours, where some in front cancel some behind: it is the mean of the k "
        "distances",
        _by_tree("np.linalg.norm(p[index[:, 1:]].mean(axis=1) - p, axis=1)", "k + 1"),
    ),
    Misconception(
        "the nearest left out",
        "the nearest neighbour left out, too: only the point itself, the first of k + 1, is none",
        _wrong(near="np.sort(d, axis=1)[:, 2:k + 2]"),
    ),
)
