"""Task 5 of lab 05: clean a desk that has every kind of outlier."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from course_lib.cloud import clusters, outliers
from course_lib.tasks.core import Case, Misconception, Verdict
from course_lib.tasks.judges import judge_band, judge_labels
from course_lib.tasks.plain import Plain
from old_forms.outliers.small_desk import FLYING, SURFACE, THIN, small_desk

_CLEAN_BANDS = ((97.0, 1.0), (90.0, 0.75), (80.0, 0.5), (60.0, 0.25))  # F1, per cent


_THIN_LEAST = 0.95  # of the thin points must stay, or the lowest band is the most


def desk(rng: np.random.Generator) -> Case:
    points, kinds = small_desk(rng)
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


_ALIKE = np.array([0.02, 0.12, 0.15, 0.2, 0.07])  # shares by kind: two masks that differ less made the same mistake


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
    """One of the lesson's three filters with settings drawn at random."""
    which = int(rng.integers(3))
    k, ratio = int(rng.integers(2, 40)), float(rng.uniform(0.2, 3))
    radius, least = float(np.exp(rng.uniform(np.log(0.003), np.log(0.1)))), int(rng.integers(1, 30))
    size = int(np.exp(rng.uniform(0, np.log(3000))))

    def clean(points: np.ndarray) -> np.ndarray:
        if which == 0:
            return outliers.keep_by_statistics(points, k, ratio)
        if which == 1:
            return outliers.keep_by_radius(points, radius, least)
        return clusters.euclidean_clusters(points, radius, size) >= 0

    return clean


def _clean(body: str) -> str:
    return (
        "import numpy as np\nfrom scipy.spatial import cKDTree\nfrom scipy.sparse import coo_array\n"
        "from scipy.sparse.csgraph import connected_components\n"
        f"def clean(points):\n{body}"
    )


_CLUSTERS = ("    pairs = cKDTree(points).query_pairs(0.0135, output_type='ndarray')\n"
             "    ones = np.ones(len(pairs))\n"
             "    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))\n"
             "    label = connected_components(graph, directed=False)[1]\n"
             "    size = np.bincount(label)[label]\n")  # fmt: skip


def _statistics(k: int, ratio: float) -> str:
    return _clean(f"    d = cKDTree(points).query(points, {k + 1})[0][:, 1:].mean(axis=1)\n"
                  f"    return d < d.mean() + {ratio} * d.std(ddof=1)\n")  # fmt: skip


def _radius(radius: float, least: int) -> str:
    return _clean(f"    return cKDTree(points).query_ball_point(points, {radius}, return_length=True) > {least}\n")


def _statistics_after(ratio: float) -> str:
    return _clean(_CLUSTERS + "    keep = size >= 250\n"
                  "    d = cKDTree(points[keep]).query(points[keep], 9)[0][:, 1:].mean(axis=1)\n"
                  f"    keep[keep] = d < d.mean() + {ratio} * d.std(ddof=1)\n"
                  "    return keep\n")  # fmt: skip


CLEAN_MISTAKES = (
    Misconception(
        "the report's settings",
        "a statistical filter with a ratio as large as 2: it finds strays, never a dense reflection and hardly a "
        "flying pixel; use islands",
        _statistics(20, 2.0),
        variants=(_statistics(8, 2.0),),
    ),
    Misconception(
        "distances or counts alone",
        "a filter of distances or of counts alone: it finds noise and some flying pixels, but the reflection is as "
        "dense as a true surface; use islands",
        _statistics(8, 0.25),
        variants=(_radius(0.015, 4),),
    ),
    Misconception(
        "a count that asks for many",
        "a radius filter that asks for many neighbours: rod and cable have few by their nature, and go first; use "
        "islands",
        _radius(0.02, 8),
        variants=(_radius(0.04, 16),),
    ),
    Misconception(
        "true islands thrown away",
        "islands of true points thrown away, too, the tray for one: use a least size between the mirrored patch and "
        "the smallest true thing",
        _clean(_CLUSTERS + "    return size >= 500\n"),
        variants=(_clean(_CLUSTERS + "    return label == np.bincount(label).argmax()\n"),),
    ),
    Misconception(
        "least size too small",
        "clusters with a least size that is too small: strays go, but the mirrored patch is larger and stays",
        _clean(_CLUSTERS + "    return size >= 100\n"),
        variants=(_clean(_CLUSTERS.replace("0.0135", "0.014") + "    return size >= 5\n"),),
    ),
    Misconception(
        "statistics after the strays",
        "statistics taken after the strays were gone: the threshold shrank with them and cuts into what is true; "
        "take a multiple of the median, or measure the whole cloud",
        _statistics_after(0.5),
        variants=(_statistics_after(1.0),),
    ),
    Misconception(
        "kept and removed exchanged",
        "True for the points that should go, or cluster 0 taken for noise, which is the largest thing: the mask says "
        "what is kept",
        _clean(_CLUSTERS + "    return size < 250\n"),
    ),
    Misconception(
        "everything kept",
        "a mask that keeps every point: nothing was removed",
        _clean("    return np.ones(len(points), bool)\n"),
    ),
    Misconception(
        "everything removed",
        "a mask that keeps no point: is a length in millimetres, or one below the spacing, among your settings?",
        _clean("    return np.zeros(len(points), bool)\n"),
    ),
)
