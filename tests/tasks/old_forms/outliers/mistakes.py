"""The wrong answers of tasks 1 and 3 of lab 05 as they were, as learner code."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended


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
        "the bin with the most wrong points, or with their largest lead, the top of their hill: cutting pays from "
        "where they outnumber the true ones",
        _wrong_cut("edges[np.argmax(bad)]"),
        variants=(_wrong_cut("edges[np.argmax(bad - good)]"),),
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
        "a bin taken in which wrong points are as many as true ones, such as none and none: they must be more",
        _wrong_cut("edges[np.argmax(bad >= good)]"),
    ),
)
"""The cases are drawn so that each of these is told from each other."""
MORE_CUT_MISTAKES = (
    Misconception(
        "first wrong point, and upper edge",
        "two mistakes: the first bin that holds any wrong point, where true ones are still more; and its upper edge",
        _wrong_cut("edges[np.argmax(bad > 0) + 1]"),
    ),
    Misconception(
        "most wrong points, and upper edge",
        "two mistakes: the bin with the most wrong points, where the first that has more is asked; and its upper edge",
        _wrong_cut("edges[np.argmax(bad) + 1]"),
    ),
    Misconception(
        "most true points",
        "the bin with the most true points, or the one behind it, the top of their hill: wrong ones lead farther out",
        _wrong_cut("edges[np.argmax(good)]"),
        variants=(_wrong_cut("edges[np.argmax(good) + 1]"),),
    ),
    Misconception(
        "the first edge",
        "the edge where the first bins begin: a comparison turned round is True there at once, and one that is never "
        "True (sums from the left; all points in the place of the true ones) gives 0 in argmax",
        _wrong_cut("edges[0]"),
        variants=(_wrong_cut("edges[np.argmax(good > bad)]"), _wrong_cut("edges[np.argmax(good >= bad)]")),
    ),
    Misconception(
        "the edge before",
        "the lower edge of the bin before the right one: one is subtracted too many",
        _wrong_cut("edges[np.argmax(bad > good) - 1]"),
    ),
    Misconception(
        "last bin",
        "the last bin with more wrong points than true ones: the first is asked",
        _wrong_cut("edges[np.flatnonzero(bad > good)[-1]]"),
    ),
    Misconception(
        "a distance for an edge",
        "a distance of some points in the place of an edge: count them bin by bin",
        _wrong_cut("mean[wrong].min()"),
        variants=tuple(
            _wrong_cut(one)
            for one in (
                "mean[~wrong].max()",
                "mean[wrong].mean()",
                "np.median(mean[wrong])",
                "mean[~wrong].mean()",
                "mean.mean()",
                "(mean[wrong].mean() + mean[~wrong].mean()) / 2",
            )
        ),
    ),
    Misconception(
        "another threshold",
        "another threshold than a bin's: mean plus some standard deviations, or so many per cent of the points",
        _wrong_cut("mean.mean() + 2 * mean.std()"),
        variants=tuple(
            _wrong_cut(one)
            for one in (
                "mean.mean() + mean.std()",
                "mean.mean() + 3 * mean.std()",
                "mean.mean() + 2 * mean.std(ddof=1)",
                "np.quantile(mean, 1 - wrong.mean())",
                "np.percentile(mean, 95)",
            )
        ),
    ),
)


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
        "points with exactly `least` neighbours removed: at least means that they stay (>=), and the point itself is "
        "taken off once",
        _wrong_radius(()).replace(">= least", "> least"),
    ),
    Misconception(
        "closer than, not within",
        "points at exactly the radius left out: within means that they count, so use <=",
        _wrong_radius(()).replace("squared <= radius", "squared < radius"),
    ),
)
"""The cases are drawn so that each of these is told from each other."""
MORE_MEND_MISTAKES = (
    Misconception(
        "twins left out",
        "points at the distance 0 left out: a second point at the same place is a neighbour; take the point itself off",
        _wrong_radius(()).replace(
            "(squared <= radius ** 2).sum(axis=1) - 1", "((squared <= radius ** 2) & (squared > 0)).sum(axis=1)"
        ),
    ),
    Misconception(
        "itself counted twice",
        "two neighbours too many for each point: it is counted itself, and one is added or `least` is one less: take "
        "one off the count, nothing else",
        _wrong_radius(()).replace("- 1", "+ 1"),
    ),
    Misconception(
        "each pair counted for one of two",
        "each pair of points counted for one of the two only: if j is a neighbour of i, then i is one of j",
        _wrong_radius(()).replace(
            "(squared <= radius ** 2).sum(axis=1) - 1", "np.triu(squared <= radius ** 2, 1).sum(axis=1)"
        ),
        variants=(
            _wrong_radius(()).replace(
                "(squared <= radius ** 2).sum(axis=1) - 1", "np.triu(squared <= radius ** 2, 1).sum(axis=0)"
            ),
        ),
    ),
    Misconception(
        "closer than, and more than",
        "two mistakes: points at exactly the radius left out, and points with exactly `least` neighbours; both count",
        _wrong_radius(()).replace("squared <= radius", "squared < radius").replace(">= least", "> least"),
    ),
    Misconception(
        "closer than, and itself counted",
        "two mistakes: points at exactly the radius left out (use <=), and the point itself counted (take one off)",
        _wrong_radius(("itself",)).replace("squared <= radius", "squared < radius"),
    ),
    Misconception(
        "two asked too many",
        "two neighbours fewer counted than there are: more than `least` for at least, or one more taken "
        "off than the point itself, or both",
        _wrong_radius(()).replace("- 1", "- 3"),
    ),
    Misconception(
        "a cube for a ball",
        "differences along x, y and z compared one by one: that is a cube; a ball takes the sum of their squares",
        _wrong_radius(()).replace("(squared <= radius ** 2)", "(abs(difference) <= radius).all(axis=-1)"),
    ),
    Misconception(
        "differences added up",
        "differences along x, y and z added up: a distance is the root of the sum of their squares",
        _wrong_radius(()).replace("(squared <= radius ** 2)", "(abs(difference).sum(axis=-1) <= radius)"),
    ),
    Misconception(
        "some axes only",
        "differences along two axes, as from above, or along one: a distance needs all three",
        _wrong_radius(()).replace("(difference ** 2)", "(difference[..., :2] ** 2)"),
    ),
    Misconception(
        "at most, not at least",
        "True for points with at most `least` neighbours: those are to go",
        _wrong_radius(()).replace(">= least", "<= least"),
    ),
    Misconception(
        "exactly",
        "True only for points with exactly `least` neighbours: those with more stay, too",
        _wrong_radius(()).replace(">= least", "== least"),
    ),
)
