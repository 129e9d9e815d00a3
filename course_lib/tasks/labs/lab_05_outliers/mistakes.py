"""The wrong answers of lab 05, as learner code: what each looks like, and what to do about it."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended, swapped


def _wrong_cut(expression: str) -> str:
    return (
        "def where_to_cut(mean, wrong, edges):\n"
        "    bad = np.histogram(mean[wrong], edges)[0]\n"
        "    good = np.histogram(mean[~wrong], edges)[0]\n"
        f"    return {expression}\n"
    )


CUT_MISTAKES = (
    Misconception(
        "upper edge",
        "the upper edge of the right bin: its wrong points would stay; cut where the bin begins",
        _wrong_cut("edges[np.argmax(bad > good) + 1]"),
    ),
    Misconception(
        "middle of the bin",
        "the middle of the right bin: half of it would stay; cut where the bin begins",
        _wrong_cut("(edges[np.argmax(bad > good)] + edges[np.argmax(bad > good) + 1]) / 2"),
    ),
    Misconception(
        "number of the bin",
        "the number of a bin where its place is asked: look it up in edges",
        _wrong_cut("int(np.argmax(bad > good))"),
    ),
    Misconception(
        "first wrong point",
        "the first bin that holds any wrong point: there it is still lost among true ones, and cutting costs more "
        "than it gains",
        _wrong_cut("edges[np.argmax(bad > 0)]"),
    ),
    Misconception(
        "most wrong points",
        "the bin with the most wrong points, the top of their hill: cutting pays from where they outnumber the true "
        "ones",
        _wrong_cut("edges[np.argmax(bad)]"),
    ),
    Misconception(
        "after the last true point",
        "the end of the last bin in which true points lead: a few far ones of them are not worth all the wrong ones "
        "before",
        _wrong_cut("edges[np.flatnonzero(good > bad)[-1] + 1]"),
    ),
    Misconception(
        "shares for counts",
        "shares compared where counts are asked: true points are many more, and each of them counts",
        _wrong_cut("edges[np.argmax(bad / bad.sum() > good / good.sum())]"),
    ),
    Misconception(
        "an empty bin",
        "a bin without any point taken: none is as many as none, but it is not more",
        _wrong_cut("edges[np.argmax(bad >= good)]"),
    ),
)


def _wrong_distances(last: str, first: str = "np.sort(d, axis=1)[:, 1:k + 1]") -> str:
    return ("def mean_distances(points, k):\n"
            "    d = np.sqrt(((points[:, None] - points[None]) ** 2).sum(axis=-1))\n"
            f"    near = {first}\n"
            f"    return {last}\n")  # fmt: skip


def _by_tree(last: str, count: str) -> str:
    return ("from scipy.spatial import cKDTree\n"
            "def mean_distances(points, k):\n"
            f"    distance = cKDTree(points).query(points, {count})[0]\n"
            f"    return {last}\n")  # fmt: skip


DISTANCE_MISTAKES = (
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
        alike=(),
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
        "one axis only",
        "differences along x only: a distance needs all three",
        _wrong_distances("near.mean(axis=1)").replace("(points[:, None] - points[None])",
                                                      "(points[:, None, :1] - points[None, :, :1])"),
    ),
)  # fmt: skip


_GIVEN_MISTAKES = {
    "itself": (".sum(axis=1)", ".sum(axis=1) - 1",
               "the point itself counted among its neighbours: take one off"),
    "squared": ("squared <= radius)", "squared <= radius ** 2)",
                "a squared distance compared with a radius: square the radius, too"),
    "exchanged": ("count < least", "count >= least",
                  "True for the points that should go: the mask says what is kept"),
}  # fmt: skip


def _wrong_radius(left: tuple[str, ...]) -> str:
    """The given code with some of its three mistakes still in it."""
    itself, squared, exchanged = mended(_GIVEN_MISTAKES, left)
    return ("def keep_by_radius(points, radius, least):\n"
            "    difference = points[:, None] - points[None]\n"
            "    squared = (difference ** 2).sum(axis=-1)\n"
            f"    count = ({squared}{itself}\n"
            f"    return {exchanged}\n")  # fmt: skip


MEND_MISTAKES = left_in(_GIVEN_MISTAKES, _wrong_radius) + (
    Misconception(
        "more than, not at least",
        "points with exactly `least` neighbours removed: at least means that they stay",
        _wrong_radius(()).replace(">= least", "> least"),
    ),
    Misconception(
        "closer than, not within",
        "points at exactly the radius left out: within means that they count, so use <=",
        _wrong_radius(()).replace("squared <= radius", "squared < radius"),
    ),
)


CAUSES = (
    "std_ratio too large",
    "radius too small",
    "least cluster size too large",
    "kept and removed exchanged",
    "repeated twelve times",
)
CAUSE_OF = {
    "A": "repeated twelve times",
    "B": "least cluster size too large",
    "C": "kept and removed exchanged",
    "D": "std_ratio too large",
    "E": "radius too small",
}


WHICH_MISTAKES = (
    Misconception(
        "cluster size for ratio",
        "cluster size and ratio taken for each other: a large ratio leaves strays in, a large cluster size takes whole "
        "true things away",
        swapped(CAUSE_OF, CAUSES[2], CAUSES[0]),
    ),
    Misconception(
        "radius for repeating",
        "the small radius and the repeating taken for each other: repeating eats inwards from borders and widens "
        "holes, a radius that is too small leaves points sprinkled everywhere",
        swapped(CAUSE_OF, CAUSES[1], CAUSES[4]),
    ),
    Misconception(
        "exchanged for radius",
        "the exchanged mask and the small radius taken for each other: an exchanged mask keeps the strays and hardly "
        "any desk",
        swapped(CAUSE_OF, CAUSES[3], CAUSES[1]),
    ),
)
