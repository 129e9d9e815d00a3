"""Task 5 of lab 05: clean a desk in a deep room, where no one length fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from course_lib.cloud import clusters, outliers
from course_lib.tasks.core import Case, Misconception, Verdict
from course_lib.tasks.judges import judge_band, judge_labels
from course_lib.tasks.labs.lab_05_outliers.deep_desk import FLYING, SURFACE, THIN, deep_desk
from course_lib.tasks.plain import Plain

_CLEAN_BANDS = ((97.0, 1.0), (92.0, 0.75), (85.0, 0.5), (60.0, 0.25))  # F1, per cent


_THIN_LEAST = 0.95  # of the thin points must stay, or the lowest band is the most


def desk(rng: np.random.Generator) -> Case:
    points, kinds = deep_desk(rng)
    return Case({"points": points}, {"truth": kinds < FLYING, "kinds": kinds}, f"a desk of {len(points):,} points")


def judge_clean(case: Case, answer: Plain) -> Verdict:
    form = judge_labels(answer, case.truth, what="the mask")
    if not np.isfinite(form.error):
        return form
    keep, kinds = np.asarray(answer, bool), case.hidden["kinds"]
    wrong = kinds >= FLYING
    f1 = float(200 * np.sum(~keep & wrong) / (np.sum(~keep) + np.sum(wrong)))
    thin = float(np.mean(keep[kinds == THIN]))
    verdict = judge_band(f1, _CLEAN_BANDS, "%", better="larger", what="F1")
    told = f"{verdict.message} {_by_kind(keep, kinds)}"
    if thin < _THIN_LEAST:
        told += f" For more than the lowest band keep {100 * _THIN_LEAST:.0f} % of rod and cable."
        if verdict.score > 0.25:
            return replace(verdict, passed=False, axis="thin structure", message=told, score=0.25)
    return replace(verdict, message=told)


_KINDS = ("surfaces", "rod and cable", "flying pixels", "the reflection", "noise")


def _removed(keep: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """The share removed (5,) of each kind."""
    return np.array([np.mean(~keep[kinds == kind]) for kind in range(1, 6)])


def _by_kind(keep: np.ndarray, kinds: np.ndarray) -> str:
    removed = [f"{100 * share:.0f} % of {name}" for share, name in zip(_removed(keep, kinds), _KINDS, strict=True)]
    left = [f"{100 * (1 - share):.0f} % of {name}" for share, name in zip(_removed(keep, kinds), _KINDS, strict=True)]
    return f"Left in: {', '.join(left[2:])}. Wrongly removed: {', '.join(removed[:2])}."


_ALIKE = np.array([0.01, 0.12, 0.06, 0.2, 0.04])  # shares by kind: two masks that differ less made the same mistake


def clean_distance(case: Case, a: Plain, b: Plain) -> float:
    if any(np.shape(mask) != np.shape(case.truth) or np.asarray(mask).dtype.kind != "b" for mask in (a, b)):
        return np.inf
    shares = [_removed(np.asarray(mask), case.hidden["kinds"]) for mask in (a, b)]
    if any(np.all(a == only) != np.all(b == only) for only in (True, False)):
        return np.inf
    allowed = _ALIKE.copy()
    # of those that cut into surfaces, some cut deeper
    allowed[0] = max(allowed[0], 0.4 * max(shares[0][0], shares[1][0]))
    # whole islands of surface or borders and sprinkled points: not the same, though as many
    lost = [~np.asarray(mask) & (case.hidden["kinds"] == SURFACE) for mask in (a, b)]
    fewer = min(mask.sum() for mask in lost)
    if fewer > 0.03 * np.sum(case.hidden["kinds"] == SURFACE) and (lost[0] & lost[1]).sum() < 0.3 * fewer:
        return np.inf
    return float(np.max(np.abs(shares[0] - shares[1]) / allowed))


def guess_clean(rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """One of the lesson's filters, or its pipeline, with settings drawn at random."""
    which = int(rng.integers(4))
    k, ratio = int(rng.integers(2, 40)), float(rng.uniform(0.2, 3))
    radius, least = float(np.exp(rng.uniform(np.log(0.003), np.log(0.1)))), int(rng.integers(1, 30))
    size, medians = int(np.exp(rng.uniform(0, np.log(3000)))), float(rng.uniform(2, 8))

    def clean(points: np.ndarray) -> np.ndarray:
        if which == 0:
            return outliers.keep_by_statistics(points, k, ratio)
        if which == 1:
            return outliers.keep_by_radius(points, radius, least)
        keep = clusters.euclidean_clusters(points, radius, size) >= 0
        if which == 3:
            mean = outliers.mean_distances(points, 8)
            keep &= mean < medians * np.median(mean)
        return keep

    return clean


_IN_PIXELS = "np.column_stack([points[:, :2] / points[:, 2:], np.log(points[:, 2:])]) * 110"


def _clean(body: str, where: str = _IN_PIXELS) -> str:
    """Learner code; `at` are the points where they are compared, `size(at, reach)` the sizes of islands."""
    return (
        "import numpy as np\nfrom scipy.spatial import cKDTree\nfrom scipy.sparse import coo_array\n"
        "from scipy.sparse.csgraph import connected_components\n"
        "def size(at, reach):\n"
        "    pairs = cKDTree(at).query_pairs(reach, output_type='ndarray')\n"
        "    ones = np.ones(len(pairs))\n"
        "    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(at), len(at)))\n"
        "    label = connected_components(graph, directed=False)[1]\n"
        "    return np.bincount(label)[label]\n"
        "def distances(at, k):\n"
        "    return cKDTree(at).query(at, k + 1)[0][:, 1:].mean(axis=1)\n"
        "def clean(points):\n"
        f"    at = {where}\n"
        f"{body}"
    )


def _islands(reach: float, least: int, where: str = _IN_PIXELS) -> str:
    return _clean(f"    return size(at, {reach}) >= {least}\n", where)


def _statistics(k: int, ratio: float) -> str:
    return _clean(f"    d = distances(at, {k})\n    return d < d.mean() + {ratio} * d.std(ddof=1)\n", "points")


def _medians(k: int, most: float, where: str) -> str:
    return _clean(f"    d = distances(at, {k})\n    return d < {most} * np.median(d)\n", where)


def _pipeline(reach: float, least: int, medians: float) -> str:
    keep = f"(size(at, {reach}) >= {least}) & (d < {medians} * np.median(d))"
    return _clean(f"    d = distances(at, 8)\n    return {keep}\n", "points")


def _radius(radius: float, least: int) -> str:
    return _clean(f"    return cKDTree(at).query_ball_point(at, {radius}, return_length=True) > {least}\n", "points")


def _statistics_after(ratio: float) -> str:
    return _clean("    keep = size(at, 4) >= 300\n"
                  "    d = distances(at[keep], 8)\n"
                  f"    keep[keep] = d < d.mean() + {ratio} * d.std(ddof=1)\n"
                  "    return keep\n")  # fmt: skip


CLEAN_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "one length in metres for all depths, as on the lesson's desk: what is near hangs together, and the far wall, "
        "whose points are farther apart than that, falls to pieces; here reach and threshold must grow with z",
        _pipeline(0.025, 500, 3.5),
        variants=(_islands(0.025, 500, "points"),),
    ),
    Misconception(
        "a loose threshold",
        "a threshold on distances in metres that is loose enough for the far wall: near by it lets everything pass, "
        "the reflection and most flying pixels; measure in pixels at each depth, and use islands",
        _statistics(20, 2.0),
        variants=(_statistics(8, 2.0), _medians(8, 3, "points")),
    ),
    Misconception(
        "a threshold that fits near by",
        "a distance or a count within a length that fits near by: at the far wall neighbours are farther apart, and it "
        "goes; measure in pixels at each depth, and use islands",
        _clean("    return distances(at, 8) < 0.015\n", "points"),
        variants=(_radius(0.02, 8), _radius(0.04, 16)),
    ),
    Misconception(
        "a tight ratio",
        "a statistical filter with a small ratio: its threshold fits the middle of the room, so it takes a good part "
        "of the far wall and leaves the reflection; measure in pixels at each depth, and use islands",
        _statistics(8, 0.25),
    ),
    Misconception(
        "distances in pixels alone",
        "distances in pixels, and nothing else: strays and most flying pixels go, but the reflection is as dense as a "
        "true surface; it is an island, so ask how many points hang together",
        _clean("    return distances(at, 8) < 3.5\n"),
        variants=(_medians(8, 2.4, _IN_PIXELS),),
    ),
    Misconception(
        "true islands thrown away",
        "islands of true points thrown away, too, the sign for one: use a least size between the mirrored patch and "
        "the smallest true thing",
        _islands(4, 1500),
        variants=(_islands(4, 1000),),
    ),
    Misconception(
        "least size too small",
        "a filter that takes strays and leaves the mirrored patch: distances and counts cannot see it, and clusters "
        "only with a least size above 250",
        _islands(4, 100),
        variants=(_islands(4, 10),),
    ),
    Misconception(
        "reach too large",
        "a reach longer than the gaps: flying pixels and the reflection are reached from what is true, and stay; it "
        "must be longer than the spacing and shorter than the gap",
        _islands(9, 300),
        variants=(_islands(7, 300),),
    ),
    Misconception(
        "reach too small",
        "a reach so short that true surfaces fall to pieces: noise and a slanted view set points more than a pixel "
        "apart; take a few pixels",
        _islands(1.5, 300),
    ),
    Misconception(
        "statistics after the strays",
        "statistics taken after the strays were gone: the threshold shrank with them and cuts into what is true; "
        "stop after the islands, or measure the whole cloud",
        _statistics_after(0.5),
        variants=(_statistics_after(1.0),),
    ),
    Misconception(
        "kept and removed exchanged",
        "True for the points that should go, or cluster 0 taken for noise, which is the largest thing: the mask says "
        "what is kept",
        _clean("    return size(at, 4) < 300\n"),
    ),
    Misconception(
        "everything kept",
        "a mask that keeps every point: nothing was removed. Is a reach in pixels used on metres, or was depth lost on "
        "the way? In points · fx / z all have the same third coordinate, fx, so near and far lie on one plane",
        _clean("    return np.ones(len(points), bool)\n"),
        variants=(_islands(4, 300, "points / points[:, 2:] * 110"),),
    ),
    Misconception(
        "everything removed",
        "a mask that keeps no point: is a length in millimetres, or a reach shorter than a pixel, among your settings?",
        _clean("    return np.zeros(len(points), bool)\n"),
        variants=(_islands(0.9, 300),),
    ),
)
