"""The wrong answers of lab 05, as learner code: what each looks like, and what to do about it."""

from __future__ import annotations

from itertools import combinations

from course_lib.tasks.core import Misconception


def _wrong_usual(expression: str) -> str:
    return f"def usual(mean, std_ratio):\n    return {expression}\n"


USUAL_MISTAKES = (
    Misconception(
        "variance for deviation",
        "a variance where the standard deviation belongs: its unit is a length squared, so take mean.std(ddof=1)",
        _wrong_usual("mean < mean.mean() + std_ratio * mean.var(ddof=1)"),
    ),
    Misconception(
        "n for n minus 1",
        "a standard deviation divided by n: these distances are a sample, divide by n - 1 (ddof=1)",
        _wrong_usual("mean < mean.mean() + std_ratio * mean.std()"),
    ),
    Misconception(
        "threshold without the mean",
        "a threshold of so many deviations above zero: it begins at the mean of all mean distances",
        _wrong_usual("mean < std_ratio * mean.std(ddof=1)"),
    ),
    Misconception(
        "kept and removed exchanged",
        "True for the points that should go: the mask says what is kept",
        _wrong_usual("mean >= mean.mean() + std_ratio * mean.std(ddof=1)"),
    ),
    Misconception(
        "both sides",
        "points removed because their neighbours are very close: nothing is wrong with those, cut on the far side only",
        _wrong_usual("np.abs(mean - mean.mean()) < std_ratio * mean.std(ddof=1)"),
    ),
    Misconception(
        "below the mean",
        "a threshold below the mean, which removes ordinary points: add the deviations, do not subtract them",
        _wrong_usual("mean < mean.mean() - std_ratio * mean.std(ddof=1)"),
    ),
    Misconception(
        "ratio as strength",
        "a division by std_ratio: it multiplies the deviation, so that a larger ratio removes less",
        _wrong_usual("mean < mean.mean() + mean.std(ddof=1) / (1.7 * std_ratio)"),
    ),
)


def _wrong_distances(last: str, first: str = "np.sort(d, axis=1)[:, 1:k + 1]") -> str:
    return ("def mean_distances(points, k):\n"
            "    d = np.sqrt(((points[:, None] - points[None]) ** 2).sum(axis=-1))\n"
            f"    near = {first}\n"
            f"    return {last}\n")  # fmt: skip


DISTANCE_MISTAKES = (
    Misconception(
        "the point itself counted",
        "a mean that holds the distance 0 of the point to itself: look at k other points",
        _wrong_distances("near.mean(axis=1)", "np.sort(d, axis=1)[:, :k]"),
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
    itself, squared, exchanged = (
        wrong if key in left else right for key, (wrong, right, _) in _GIVEN_MISTAKES.items()
    )
    return ("def keep_by_radius(points, radius, least):\n"
            "    difference = points[:, None] - points[None]\n"
            "    squared = (difference ** 2).sum(axis=-1)\n"
            f"    count = ({squared}{itself}\n"
            f"    return {exchanged}\n")  # fmt: skip


MEND_MISTAKES = tuple(
    Misconception(
        " and ".join(left) + " left in",
        "; and ".join(_GIVEN_MISTAKES[key][2] for key in left),
        _wrong_radius(left),
    )
    for count in (1, 2, 3)
    for left in combinations(_GIVEN_MISTAKES, count)
) + (
    Misconception(
        "more than, not at least",
        "points with exactly `least` neighbours removed: at least means that they stay",
        _wrong_radius(()).replace(">= least", "> least"),
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


def _swapped(a: str, b: str) -> str:
    """Learner code that takes two causes for each other and has the others right."""
    other = {a: b, b: a}
    answer = {letter: other.get(cause, cause) for letter, cause in CAUSE_OF.items()}
    return f"def causes():\n    return {answer!r}\n"


WHICH_MISTAKES = (
    Misconception(
        "cluster size for ratio",
        "cluster size and ratio taken for each other: a large ratio leaves strays in, a large cluster size takes whole "
        "true things away",
        _swapped(CAUSES[2], CAUSES[0]),
    ),
    Misconception(
        "radius for repeating",
        "the small radius and the repeating taken for each other: repeating eats what is sparse and keeps dense sheets "
        "whole, a small radius makes holes at random everywhere",
        _swapped(CAUSES[1], CAUSES[4]),
    ),
    Misconception(
        "exchanged for radius",
        "the exchanged mask and the small radius taken for each other: an exchanged mask keeps the strays and hardly "
        "any desk",
        _swapped(CAUSES[3], CAUSES[1]),
    ),
)


def _clean(body: str) -> str:
    return (
        "import numpy as np\nfrom scipy.spatial import cKDTree\nfrom scipy.sparse import coo_array\n"
        "from scipy.sparse.csgraph import connected_components\n"
        f"def clean(points):\n{body}"
    )


_STATISTICS = ("    d = cKDTree(points).query(points, 21)[0][:, 1:].mean(axis=1)\n"
               "    keep = d < d.mean() + 2.0 * d.std(ddof=1)\n")  # fmt: skip
_CLUSTERS = ("    pairs = cKDTree(points).query_pairs(0.014, output_type='ndarray')\n"
             "    ones = np.ones(len(pairs))\n"
             "    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))\n"
             "    label = connected_components(graph, directed=False)[1]\n"
             "    size = np.bincount(label)[label]\n")  # fmt: skip

CLEAN_MISTAKES = (
    Misconception(
        "the report's settings",
        "the statistical filter with 20 neighbours and a ratio of 2: it finds strays, never a dense reflection and "
        "hardly a flying pixel; use islands",
        _clean(_STATISTICS + "    return keep\n"),
    ),
    Misconception(
        "the largest island only",
        "everything but the largest cluster thrown away: true things stand apart, too, so use a least size",
        _clean(_CLUSTERS + "    return label == np.bincount(label).argmax()\n"),
    ),
    Misconception(
        "kept and removed exchanged",
        "True for the points that should go: the mask says what is kept",
        _clean(_CLUSTERS + "    return size < 250\n"),
    ),
    Misconception(
        "strays only",
        "clusters with a very small least size: single strays go, the mirrored patch is larger and stays",
        _clean(_CLUSTERS + "    return size >= 5\n"),
    ),
)
