"""Which part of a wrong answer of lab 05 is wrong, the one first that causes the others."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from course_lib.tasks.core import Case
from course_lib.tasks.labs.lab_05_outliers.deep_desk import FOCAL
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import quantity

Part = tuple[str, str] | None


def part_of_cut(case: Case, answer: Plain) -> Part:
    """Whether it is an edge at all, and what the bin holds that begins there."""
    mean, wrong, edges, cost = (case.given[name] for name in ("mean", "wrong", "edges", "cost"))
    value = float(answer)
    if not np.isfinite(value):
        return None
    at = int(np.abs(edges - value).argmin())
    if abs(edges[at] - value) > 1e-5:
        where = (
            "beyond all bins (the number of a bin, or another unit?)"
            if not edges[0] <= value <= edges[-1]
            else "no edge of a bin"
        )
        return "not an edge", f"{quantity(value, 'px')} is {where}: return one of `edges`, that where the bin begins."
    right = int(np.abs(edges - case.truth).argmin())
    inside = (mean >= edges[at]) & (mean < edges[min(at + 1, len(edges) - 1)])
    bad, good = int((inside & wrong).sum()), int((inside & ~wrong).sum())
    holds = f"the bin that begins there holds {bad} wrong points and {good} true ones, at {cost} each"
    if at < right:
        return "too early", f"That is {right - at} bins too early: {holds}."
    return "too late", f"That is {at - right} bins too late: {holds}, and in a bin before it wrong ones lead, too."


def part_of_radius(case: Case, answer: Plain) -> Part:
    """Which points are wrong: twins, those at the limit, those at exactly the radius."""
    got, truth = np.asarray(answer), np.asarray(case.truth)
    if got.shape != truth.shape or not np.isin(got, (0, 1)).all():
        return None
    off = got.astype(bool) != truth
    if off.all():
        return "all turned round", "True and False are exchanged everywhere."
    points, others, radius, least = (case.given[name] for name in ("points", "others", "radius", "least"))
    if not off.any() or not 0 < got.sum() < len(got):
        return None
    tree = cKDTree(others)
    count = tree.query_ball_point(points, radius * (1 + 1e-9), return_length=True)
    apart = tree.query(points)[0]
    limit = np.abs(count[off] - least).max()
    if (apart[off] == 0).all() and (apart[~off] > 0).any() and off.sum() > 1:
        return "only twins", "Only points are wrong at whose very place the other view has one, too: it is a neighbour."
    if limit <= 1:
        return "only at the limit", "Only points are wrong that have about `least` neighbours: it is at least, and all."
    return None


def _tied(z: np.ndarray) -> str:
    """How many pixels near by a reach of three of the wall's is; z (N,) in metres."""
    near, far = np.quantile(z, (0.01, 0.99))
    return (
        "The reflection stays, and many flying pixels do. No distance and no count finds a dense patch. If you use "
        "clusters, either your least size is below the patch, or your reach bridges the gap to the desk: at "
        f"{near:.1f} m a pixel is {1000 * near / FOCAL:.0f} mm, and 3 z / fx of the wall is {3 * far / near:.0f} of "
        "them."
    )


def part_of_clean(case: Case, answer: Plain) -> Part:
    """Which kind of thing is lost or left in, the first that must be mended."""
    keep, kinds = np.asarray(answer), case.hidden["kinds"]
    if keep.ndim == 1 and len(keep) < len(kinds) and keep.dtype.kind == "b":
        return "one value a cluster", (
            f"{len(keep):,} values came back for {len(kinds):,} points: if they belong to clusters, look each point's "
            "up by its label, sizes[label]."
        )
    if keep.shape != kinds.shape or not np.isin(keep, (0, 1)).all():
        return None
    surfaces, thin, flying, mirrored, noise = (
        float(np.mean(~keep[kinds == kind].astype(bool))) for kind in range(1, 6)
    )
    if surfaces > 0.9 and noise < 0.3:
        return "kept and removed exchanged", "Strays stay and surfaces go: the mask says what is kept, True stays."
    if surfaces > 0.3:
        return "true points removed", (
            f"{100 * surfaces:.0f} % of the surfaces are gone: mend that first. Is a length shorter than the spacing, "
            "near by or at the far wall, is a filter repeated, or what is kept turned round?"
        )
    if thin > 0.3:
        return "rod and cable removed", (
            "Rod and cable are gone: they have few neighbours and few points. Which filter counts, from how many on?"
        )
    if max(flying, mirrored, noise) < 0.1:
        return "hardly anything removed", (
            "Hardly anything was removed, of no kind. Is a length in pixels used on metres, or was depth lost on the "
            "way? In points · fx / z all have the same third coordinate, fx, so near and far lie on one plane."
        )
    if mirrored < 0.5 and flying < 0.5:
        return "the reflection and flying pixels stay", _tied(case.given["points"][:, 2])
    if mirrored < 0.5:
        return "the reflection stays", (
            "The reflection stays: it is as dense as a true surface, so no distance and no count finds it. It is an "
            "island: ask how many points hang together, and take a least size above that of the patch."
        )
    if flying < 0.5:
        return "flying pixels stay", (
            "Flying pixels stay: they hang together with the edge that they flew off if the reach is much larger than "
            "the spacing; a box or a distance does not find them."
        )
    if noise < 0.5:
        return "noise stays", "Strays stay: they are the smallest islands; is a size or a count asked that they lack?"
    if surfaces > 0.01 or thin > 0.05:
        what = "surfaces" if surfaces > thin else "rod and cable"
        return "true points removed", (
            f"The wrong ones are gone, but {100 * max(surfaces, thin):.0f} % of {what}, too: is a size too large, or "
            "does a second filter cut into borders?"
        )
    return None
