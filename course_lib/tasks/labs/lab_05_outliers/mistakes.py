"""The wrong answers of lab 05, as learner code: what each looks like, and what to do about it."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended, swapped


def _wrong_cut(expression: str) -> str:
    return (
        "def where_to_cut(mean, wrong, edges, cost):\n"
        "    bad = np.histogram(mean[wrong], edges)[0]\n"
        "    good = np.histogram(mean[~wrong], edges)[0]\n"
        f"    return {expression}\n"
    )


_RULE = "np.argmax(bad > cost * good)"

CUT_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "each true point counted once, as in the lesson: here one of them outweighs `cost` wrong ones",
        _wrong_cut("edges[np.argmax(bad > good)]"),
    ),
    Misconception(
        "cost on the other side",
        "the cost on the side of the wrong points: it is what a true point weighs, so multiply those",
        _wrong_cut("edges[np.argmax(cost * bad > good)]"),
        variants=(_wrong_cut("edges[np.argmax(bad > good / cost)]"),),
    ),
    Misconception(
        "cost added",
        "the cost added to the count of true points: each of them weighs that much, so multiply",
        _wrong_cut("edges[np.argmax(bad > good + cost)]"),
    ),
    Misconception(
        "upper edge",
        "the upper edge of the right bin: its wrong points would stay; cut where the bin begins",
        _wrong_cut(f"edges[{_RULE} + 1]"),
    ),
    Misconception(
        "middle of the bin",
        "the middle of the right bin: half of it would stay; cut where the bin begins",
        _wrong_cut(f"(edges[{_RULE}] + edges[{_RULE} + 1]) / 2"),
    ),
    Misconception(
        "number of the bin",
        "the number of a bin where its place is asked: look it up in edges",
        _wrong_cut(f"int({_RULE})"),
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
        "where they outweigh the true ones",
        _wrong_cut("edges[np.argmax(bad)]"),
        variants=(_wrong_cut("edges[np.argmax(bad - cost * good)]"),),
    ),
    Misconception(
        "after the last true point",
        "the end of the last bin in which true points outweigh: a few far ones of them are not worth all the wrong "
        "ones before",
        _wrong_cut("edges[np.flatnonzero(cost * good > bad)[-1] + 1]"),
    ),
    Misconception(
        "shares for counts",
        "shares compared where counts are asked: true points are many more, and each of them counts",
        _wrong_cut("edges[np.argmax(bad / bad.sum() > cost * good / good.sum())]"),
    ),
    Misconception(
        "a tie taken",
        "a bin taken in which both sides weigh the same: wrong points must outweigh the true ones",
        _wrong_cut("edges[np.argmax(bad >= cost * good)]"),
    ),
)
"""The cases are drawn so that each of these is told from each other."""
MORE_CUT_MISTAKES = (
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
        variants=(_wrong_cut("edges[np.argmax(cost * good > bad)]"),),
    ),
    Misconception(
        "the edge before",
        "the lower edge of the bin before the right one: one is subtracted too many",
        _wrong_cut(f"edges[{_RULE} - 1]"),
    ),
    Misconception(
        "last bin",
        "the last bin whose wrong points outweigh the true ones: the first is asked",
        _wrong_cut("edges[np.flatnonzero(bad > cost * good)[-1]]"),
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
    "itself": (".sum(axis=1) - 1", ".sum(axis=1)",
               "one neighbour too many asked for: who is taken off the count, and is he among those counted?"),
    "squared": ("squared <= radius)", "squared <= radius ** 2)",
                "two quantities of different units compared, square metres with metres"),
    "exchanged": ("count < least", "count >= least",
                  "True for the points that should go, with few neighbours"),
}  # fmt: skip


def _wrong_radius(left: tuple[str, ...]) -> str:
    """The given code with some of its three mistakes still in it."""
    itself, squared, exchanged = mended(_GIVEN_MISTAKES, left)
    return ("def keep_by_radius(points, others, radius, least):\n"
            "    difference = points[:, None] - others[None]\n"
            "    squared = (difference ** 2).sum(axis=-1)\n"
            f"    count = ({squared}{itself}\n"
            f"    return {exchanged}\n")  # fmt: skip


_RIGHT = _wrong_radius(())


def _in_a_tree(of: str, count: str) -> str:
    return ("from scipy.spatial import cKDTree\n"
            "def keep_by_radius(points, others, radius, least):\n"
            f"    count = cKDTree({of}).query_ball_point(points, radius, return_length=True){count}\n"
            "    return count >= least\n")  # fmt: skip


MEND_MISTAKES = left_in(_GIVEN_MISTAKES, _wrong_radius) + (
    Misconception(
        "the lesson's own code",
        "neighbours counted among the points themselves, as in the lesson: those of the other view are asked",
        _in_a_tree("points", " - 1"),
        variants=(_in_a_tree("points", ""),),
    ),
    Misconception(
        "closer than, not within",
        "points at exactly the radius left out: within means that they count, so use <=",
        _RIGHT.replace("squared <= radius", "squared < radius"),
    ),
)
"""The cases are drawn so that each of these is told from each other."""
MORE_MEND_MISTAKES = (
    Misconception(
        "both views counted",
        "neighbours of both views counted together: a reflection has many in its own; those of `others` are asked",
        _in_a_tree("np.concatenate([points, others])", ""),
        variants=(_in_a_tree("np.concatenate([points, others])", " - 1"),),
    ),
    Misconception(
        "twins left out",
        "points at the distance 0 left out: a point of the other view at the very same place is a neighbour",
        _RIGHT.replace("(squared <= radius ** 2)", "((squared <= radius ** 2) & (squared > 0))"),
    ),
    Misconception(
        "one too many counted",
        "one neighbour more counted than there is, or one fewer asked for: count those of the other view, nothing else",
        _RIGHT.replace(".sum(axis=1)", ".sum(axis=1) + 1"),
    ),
    Misconception(
        "closer than, and one too few",
        "two mistakes: points at exactly the radius left out (use <=), and one neighbour more asked for than `least` "
        "(take none off, and use >=)",
        _wrong_radius(("itself",)).replace("squared <= radius", "squared < radius"),
    ),
    Misconception(
        "two asked too many",
        "two neighbours fewer counted than there are: more than `least` for at least, and one taken off for the point "
        "itself, which is not among the others",
        _RIGHT.replace(".sum(axis=1)", ".sum(axis=1) - 2"),
    ),
    Misconception(
        "a cube for a ball",
        "differences along x, y and z compared one by one: that is a cube; a ball takes the sum of their squares",
        _RIGHT.replace("(squared <= radius ** 2)", "(abs(difference) <= radius).all(axis=-1)"),
    ),
    Misconception(
        "differences added up",
        "differences along x, y and z added up: a distance is the root of the sum of their squares",
        _RIGHT.replace("(squared <= radius ** 2)", "(abs(difference).sum(axis=-1) <= radius)"),
    ),
    Misconception(
        "some axes only",
        "differences along two axes, as from above, or along one: a distance needs all three",
        _RIGHT.replace("(difference ** 2)", "(difference[..., :2] ** 2)"),
    ),
    Misconception(
        "exactly",
        "True only for points with exactly `least` neighbours: those with more stay, too",
        _RIGHT.replace(">= least", "== least"),
    ),
    Misconception(
        "the nearest only",
        "True where any point of the other view is within the radius: at least `least` of them are asked",
        _RIGHT.replace(">= least", "> 0"),
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
