"""What the pictures of lab 05 are drawn from: a desk in a deep room, what tasks 1 to 3 expect, five spoiled cleanings."""

import numpy as np
from scipy.spatial import cKDTree

from course_lib.cloud import clusters
from course_lib.tasks.labs.lab_05_outliers.deep_desk import FLYING, FOCAL, deep_desk, in_pixels
from course_lib.tasks.labs.lab_05_outliers.mistakes import CAUSE_OF


def mean_distances(at: np.ndarray) -> np.ndarray:
    """Mean distance (N,) to eight others."""
    return cKDTree(at).query(at, 9)[0][:, 1:].mean(axis=1)


def unusual(at: np.ndarray, ratio: float) -> np.ndarray:
    """Whose mean distance lies so many standard deviations above the mean (N,)."""
    mean = mean_distances(at)
    return mean >= mean.mean() + ratio * mean.std(ddof=1)


def sizes(at: np.ndarray) -> np.ndarray:
    """Of each point the size of its island (N,), with a reach of four pixels."""
    label = clusters.euclidean_clusters(at, 4.0)
    return np.bincount(label)[label]


def repeated(at: np.ndarray, ratio: float, times: int) -> np.ndarray:
    """What so many passes of the statistical filter keep (N,)."""
    left = np.arange(len(at))
    for _ in range(times):
        left = left[~unusual(at[left], ratio)]
    return np.isin(np.arange(len(at)), left)


def second_view(points: np.ndarray, kinds: np.ndarray) -> np.ndarray:
    """The same things seen again, with their noise drawn anew, and what is wrong in another place."""
    rng = np.random.default_rng(55)
    true = points[kinds < FLYING]
    again = true * (1 + 0.0012 * true[:, 2:] * rng.normal(size=(len(true), 1)))
    elsewhere, other_kinds = deep_desk(np.random.default_rng(56))
    return np.concatenate([again[rng.random(len(again)) < 0.9], elsewhere[other_kinds >= FLYING] + (0.12, 0, 0.05)])


def arrays() -> dict[str, np.ndarray]:
    points, kinds = deep_desk(np.random.default_rng(5))
    points = points.astype(np.float32)
    at = in_pixels(points)
    z = points[:, 2].astype(float)
    mean = FOCAL * mean_distances(points.astype(float)) / z
    edges = np.geomspace(0.8, 80, 36)
    true, wrong = (np.histogram(mean[which], edges)[0] for which in (kinds < FLYING, kinds >= FLYING))
    cuts = np.array([edges[np.argmax(wrong > cost * true)] for cost in (1, 10)])
    near = z < 1.4
    count = cKDTree(second_view(points, kinds)).query_ball_point(points[near], 0.02, return_length=True)
    spoiled = {
        "std_ratio too large": ~unusual(at, 8.0),
        "radius too small": cKDTree(at).query_ball_point(at, 1.35, return_length=True) > 3,
        "least cluster size too large": sizes(at) >= 1500,
        "kept and removed exchanged": sizes(at) < 300,
        "repeated twelve times": repeated(at, 1.0, 12),
    }
    given = cKDTree(second_view(points, kinds)).query_ball_point(points[near], 0.02**0.5, return_length=True) - 1 < 3
    return {
        "desk": points,
        "kinds": kinds.astype(np.uint8),
        "mean_pixels": mean.astype(np.float32),
        "edges": edges,
        "true": true,
        "wrong": wrong,
        "cuts": cuts,
        "seen_again": np.isin(np.arange(len(points)), np.flatnonzero(near)[count >= 3]),
        "given": np.isin(np.arange(len(points)), np.flatnonzero(near)[given]),
        **{f"kept_{letter}": spoiled[cause] for letter, cause in CAUSE_OF.items()},
    }
