# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 05 Outliers
#
# **You will be able to remove what is not there and keep what is thin, to read from a histogram where to cut, and to say with two
# numbers what a filter cost.**

# %%
from course_lib.notebook import (
    data, picture, predict, report, report_table, show)

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

from course_lib.cloud import clusters, outliers, pointcloud
from course_lib.geometry import transforms
from course_lib.surface import metrics

desks = data.load("desk_outliers")
cloud = desks.clouds["desk_0"]
points, kinds = cloud.points.astype(float), cloud.labels
names = desks.truth["kind_names"]
SURFACE, THIN, FLYING, REFLECTION, NOISE = range(1, 6)

# %% tags=["hide-input"]
def desk_views(parts, title, alt):
    """The desk as the camera sees it and from the side; name: which, role."""
    fig, axes = plt.subplots(1, 2, figsize=(9.6, 3.9), layout="constrained",
                             width_ratios=(1.75, 1))
    for name, (which, role) in parts.items():
        x, y, z = points[which].T
        style = {"lw": 0, "color": show.COLOURS[role],
                 "s": 0.8 if role == "surface" else 4}
        axes[0].scatter(x / z, -y / z, label=name, **style)
        axes[1].scatter(z, -y, **style)
    axes[0].set(aspect="equal", xticks=[], yticks=[],
                title="as the camera sees it")
    axes[1].set(aspect="equal", xlim=(0.4, 2.15), ylim=(-0.85, 0.85),
                title="from the side", xlabel="z (m)", ylabel="up (m)")
    fig.legend(*axes[0].get_legend_handles_labels(), ncols=3, markerscale=4,
               loc="outside lower center")
    fig.suptitle(title, fontweight="bold")
    counts = ", ".join(f"{name} {int(np.sum(which)):,}"
                       for name, (which, _) in parts.items())
    return picture(fig, alt=f"{alt} Points: {counts}.")


def by_open3d(points, nb_neighbors, std_ratio):
    """What Open3D's filter of section 2 keeps, as a mask (N,)."""
    seen = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    kept = seen.remove_statistical_outlier(nb_neighbors, std_ratio)[1]
    return np.isin(np.arange(len(points)), kept)


desk_views(
    {"there": (kinds == SURFACE, "surface"),
     "not there": (kinds >= FLYING, "outlier"),
     "there, and thin": (kinds == THIN, "inlier")},
    "A desk as a D455 measures it: grey is there, vermilion is not",
    "Left a grey desk with a lamp and a hanging cable, both thin and blue; "
    "vermilion specks everywhere, most along edges and in one patch on the "
    "left. Right from the side, the camera at the left and looking along z to "
    "the right: the specks are strewn through the air, and the patch hangs far "
    "below the desk, at the right.")

# %% [markdown]
# We know of every point here what it is. Blue is a lamp's rod and a cable, about a centimetre thick. They are real, and a filter that counts
# neighbours throws them away first. In the side view the camera stands at the left and looks to the right, along z.
#
# ## Card
#
# | | |
# |---|---|
# | You will | write three filters and prove each against Open3D; choose their settings from a histogram; measure precision and recall by kind of outlier; build a pipeline on some desks and report it on others |
# | Minutes | 58 for the core, 54 for the lab |
# | Before | lesson 01 (flying pixels), lesson 03 (depth to points); lesson 04's nearest neighbours help |
# | Teaches | outliers, as a student's report on 3D reconstruction treats them (its section 7 and a line of its appendix): see "Report against reality" |
# | Data | `desk_outliers` (simulated, each point labelled); `living_room`; a real TUM desk |
#
# Two questions from earlier lessons, before you read on:
#
# <details><summary>Lesson 01: what is a flying pixel?</summary>A depth at the edge of a thing that belongs neither to it nor to the background. It
# hangs in the air between them.</details>
#
# <details><summary>Lesson 03: two neighbouring pixels see a wall 1 m away. How far apart are their points if the wall is 2 m away?</summary>Twice
# as far: x = (u − cx) z / f. Far surfaces are thin on points. Remember it for section 3.</details>

# %% [markdown]
# ## 1 Two numbers for a filter
#
# An **outlier** is a point that lies on no surface. Our desk has three kinds: *flying pixels* at edges; *isolated noise*,
# pixels that the two imagers matched wrongly; and *reflections*: the tablet's glass mirrors the wall, and the camera reports
# the depth of the mirror image, below the desk.
#
# A filter removes points. Of all points removed, the share that were outliers is its **precision**. Of all outliers, the share
# removed is its **recall**. Removing one sure outlier has precision 1 and hardly any recall; removing everything has
# recall 1 and hardly any precision. Their harmonic mean, F1 = 2 · precision · recall / (precision + recall), is high only if both are.

# %%
def score(keep, kinds):
    """Precision, recall and F1 of a filter; `keep` is (N,) bool."""
    wrong = kinds >= FLYING
    removed = np.sum(~keep)
    hits = np.sum(~keep & wrong)
    return (hits / max(removed, 1), hits / np.sum(wrong),
            2 * hits / (removed + np.sum(wrong)))


# Ten points, the last two wrong. Remove the last five: 2 of these 5 were
# wrong, and both wrong ones are found.
ten = np.array([SURFACE] * 8 + [NOISE] * 2)
assert score(np.arange(10) < 5, ten)[:2] == (2 / 5, 1)

# %% tags=["hide-input"]
columns = ["filter", "removed", "precision", "recall", "F1", "flying",
           "reflections", "noise", "surface kept", "thin kept"]


def line(name, keep, kinds=kinds):
    """A table's row: what was removed, which kinds, what is left; in %."""
    gone = [np.mean(~keep[kinds == kind])
            for kind in (FLYING, REFLECTION, NOISE)]
    left = [np.mean(keep[kinds == kind]) for kind in (SURFACE, THIN)]
    shares = [*score(keep, kinds), *gone, *left]
    return [name, int(np.sum(~keep)), *(100 * share for share in shares)]


report_table(
    [[names[kind], int(np.sum(kinds == kind)), 100 * np.mean(kinds == kind)]
     for kind in range(1, 6)],
    columns=["kind", "points", "share (%)"], title="desk_0")
report("accuracy of a filter that removes nothing",
       100 * np.mean(kinds < FLYING), "%")

# %% [markdown]
# So few points are wrong that doing nothing is nearly always right: accuracy is no number for this job. In the tables that follow all shares are in per
# cent. Watch two things: recall by kind, and how much of what is thin is kept.
#
# ## 2 How far are the neighbours?
#
# A point on a surface has neighbours close by; a stray has not. So take each point's mean distance to its k nearest
# *other* points, and call those unusual that lie far above the mean of all: more than `std_ratio` standard deviations. That
# is **statistical outlier removal**.

# %%
def mean_distances(points, k):
    """Mean distance (N,) of each point to its k nearest other points."""
    distance, _ = cKDTree(points).query(points, k + 1)
    return distance[:, 1:].mean(axis=1)  # the first is the point itself


def usual(mean, std_ratio):
    """Which points to keep (N,): not far above the mean of all."""
    # ddof=1 divides by N - 1, as Open3D does
    return mean < mean.mean() + std_ratio * mean.std(ddof=1)


# metres along a line; the first point's neighbours: 1 and 3 metres
five = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0], [9, 0, 0], [10, 0, 0.0]])
assert mean_distances(five, 2).tolist() == [2, 1.5, 2.5, 3.5, 4]
assert usual(mean_distances(five, 2), 1.0).tolist() == [1, 1, 1, 1, 0]

K = 8
mean = mean_distances(points, K)
assert by_open3d(five, 3, 1.0).tolist() == [1, 1, 1, 1, 0]
assert by_open3d(five, 2, 1.0).tolist() == [1, 1, 0, 1, 1]  # another goes
assert (by_open3d(points, K + 1, 1.0) == usual(mean, 1.0)).all()

# %% [markdown]
# Read the last three lines again. Open3D counts the point itself, at distance 0, as its own first neighbour. Its `nb_neighbors=3`
# is our k = 2. With the same number 2 it removes *another point*. On a large cloud that difference hides among thousands, on
# five points you see it. PCL, another library for point clouds, counts as we do.
#
# Why k = 8? A pixel has eight others around it. With k = 1, two strays that lie together vouch for each other: k must be larger than a
# speck. And with a large k, a rod or a corner has to count points that lie far along it or off it, and looks lonely.
#
# Vote: you raise `std_ratio` from 1 to 2. The filter removes (a) more, (b) fewer, (c) twice as many points, (d) the same, as the mean does not change.
#
# <details><summary>Answer</summary>
# (b). A larger ratio moves the threshold away from the mean, so fewer points lie beyond. Who says (a) thinks of it as a strength: it is a tolerance.
# </details>

# %%
share_guess = predict(
    "Many take Open3D's example: 20 neighbours and std_ratio 2.0. What share "
    "of this desk's outliers does that find?",
    guess=None, unit="%")

# %% tags=["hide-input", "prediction"]
# The answer: run this after your guess.
share_guess.answer(
    100 * score(by_open3d(points, 20, 2.0), kinds)[1], digits=2,
    why="A few far strays make the standard deviation large, and the "
        "threshold goes with it. The outliers hide each other.")

# %%
report_table([line(f"k {K}, ratio {ratio:g}", usual(mean, ratio))
              for ratio in (1, 0.5, 0.25)], columns=columns)

# %% [markdown]
# A lower ratio finds more noise, more flying pixels, and in the last row even reflections. Where should the threshold lie? Do not
# guess: draw the mean distances.

# %% tags=["hide-input"]
places = {ratio: 1000 * (mean.mean() + ratio * mean.std(ddof=1))
          for ratio in (0.25, 1, 2)}
bins = np.geomspace(2, 600, 60)  # mm
styles = {SURFACE: "surface", THIN: "inlier", FLYING: "source",
          REFLECTION: "estimate", NOISE: "outlier"}
true, wrong = (np.histogram(1000 * mean[which], bins)[0]
               for which in (kinds < FLYING, kinds >= FLYING))
cut = bins[np.argmax(wrong > true)]
fig, axes = plt.subplots(1, 2, figsize=(9.4, 3.7), sharey=True,
                         layout="constrained")
for kind, role in styles.items():
    filled = "stepfilled" if kind == SURFACE else "step"
    axes[0].hist(1000 * mean[kinds == kind], bins, histtype=filled, lw=1.8,
                 color=show.COLOURS[role], label=names[kind])
for ratio, place in places.items():
    axes[0].axvline(place, color="black", lw=1, ls=":")
    axes[0].text(place, 0.98, f" ratio\n {ratio:g}", va="top", fontsize=8,
                 transform=axes[0].get_xaxis_transform())
axes[0].legend(fontsize=7, loc="upper right")
axes[1].hist(1000 * mean, bins, histtype="step", color="black", lw=1.6)
axes[1].annotate("the slope bends\ninto a shelf",
                 (cut, (true + wrong)[np.argmax(wrong > true)]),
                 (40, 3000),
                 arrowprops={"arrowstyle": "->"}, fontsize=9)
for axis, title in zip(axes, ("With truth: where to cut?", "On your own data"),
                       strict=True):
    axis.axvline(cut, color="black", lw=1.2, ls="--")
    axis.set(xscale="log", yscale="log", title=title,
             xlabel=f"mean distance to {K} others (mm)")
axes[0].set_ylabel("points")
middles = {kind: 1000 * np.median(mean[kinds == kind]) for kind in styles}
picture(fig, alt="Left histograms of the mean distance, by kind. Medians: "
        + ", ".join(f"{names[k]} {v:.1f} mm" for k, v in middles.items())
        + ". Noise lies far right of the surface; flying pixels reach into "
        "it; reflections lie at its right foot, with a second, small hump "
        "inside the surface's hill. Dotted lines mark the thresholds: "
        + ", ".join(f"{v:.0f} mm for ratio {r:g}" for r, v in places.items())
        + f". Right the outline of all points without kinds: a steep slope "
        f"that bends into a shelf near {cut:.0f} mm, where in both a dashed "
        "line stands.")

# %% [markdown]
# Read it from the left. The surface's hill falls steeply and ends in a flat foot. Cut where a bin first holds more wrong points than true ones, at the dashed line: from there
# on, each bin that you remove is mostly a gain. On your own data nobody colours the bins. You see the outline on the right, and its steep slope bends into a shelf
# just before that place: cut where the shelf begins.

# %%
report("a bin holds more wrong points than true ones from",
       cut, "mm", digits=2)
report("three times the median of all mean distances",
       3000 * np.median(mean), "mm", digits=2)
report_table(
    [line("fixed at 15 mm", mean < 0.015),
     line("fixed at three medians", mean < 3 * np.median(mean))],
    columns=columns)

# %% [markdown]
# The two are close on noise and flying pixels; the reflections tell them apart, as many of those lie just between both. The lowest ratio above does as well as 15 mm, by luck: a threshold
# in millimetres or in medians stays (nearly) where it is, however wild the strays are. The mean moves with them, and the standard deviation much more.
#
# Two hills that do not meet can be cut apart; noise and surface nearly can. But a mirrored wall is a wall, nearly as dense as any other *at its depth*, and what cuts it
# off here is only that nothing real is so far away. Apply the fixed threshold to a room that has a far side:

# %%
room = data.load("living_room")
frame = room.frames[15]
c = pointcloud.from_frame(frame).points.astype(float)
world = transforms.apply(frame.T_world_camera, c)
off = metrics.distance_to_surface(world, room.mesh)
mean_room = outliers.mean_distances(c, K)
true_far = (c[:, 2] > 2.0) & (off < 0.03)
report("of the true points beyond 2 m it would remove",
       100 * np.mean(mean_room[true_far] > 0.015), "%", digits=2)

# %% [markdown]
# So that filter did not find reflections. It found what is far. No threshold on this axis parts a mirrored wall from a real one, and that is no matter of tuning.
#
# ## 3 How many neighbours?
#
# Turn the question around: how many other points lie within a radius? Keep who has enough. This is **radius outlier removal**. Its threshold
# does not depend on the other outliers, so they cannot hide each other.

# %%
def count_within(points, radius):
    """How many other points (N,) lie within `radius` of each point."""
    tree = cKDTree(points)
    counted = tree.query_ball_point(points, radius, return_length=True)
    return counted - 1  # without itself


assert count_within(five, 2.0).tolist() == [1, 2, 1, 1, 1]
radius = 0.02
count = count_within(points, radius)
seen = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
theirs = seen.remove_radius_outlier(nb_points=8, radius=radius)[1]
assert np.array_equal(np.flatnonzero(count >= 8), theirs)

# %% [markdown]
# Open3D counts the point itself here, too (9 for 8), but asks for *more than* `nb_points`: the two differences cancel.

# %%
growth_guess = predict(
    "With twice the radius, a point of a surface has about four times as many "
    "neighbours. And a point of the cable and rod?", guess=None, unit="times")

# %% tags=["hide-input", "prediction"]
# The answer: run this after your guess.
double = count_within(points, 2 * radius)
times_as_many = double / np.maximum(count, 1)
growth = {kind: np.median(times_as_many[kinds == kind])
          for kind in (SURFACE, THIN)}
growth_guess.answer(
    growth[THIN], digits=2,
    why="A disc grows with the square of its radius, a line with the radius "
        "itself. What surpasses 2 comes mostly from strays and surfaces "
        "around it.")

# %%
far = points[:, 2] > 1.2
report_table(
    [line(f"20 mm, at least {least}", count >= least)
     for least in (8, 16, 24, 32)], columns=columns)
report_table(
    [["surfaces nearer than 1.2 m", int(np.median(count[(kinds == 1) & ~far]))],
     ["surfaces farther", int(np.median(count[(kinds == 1) & far]))],
     ["rod and cable", int(np.median(count[kinds == THIN]))]],
    columns=["on", "median neighbours within 20 mm"])

# %% [markdown]
# Go down the rows. As the least number rises, the surface loses a few points in a hundred, and rod and cable most of theirs. So a thin thing dies
# first: a line has few neighbours by its nature, and a filter that asks for many takes it for noise. And a far wall is thin on points, too, as the second table says: pixels
# spread with z. One radius and one number for the whole cloud punish what is thin and what is far.
#
# ## 4 Islands
#
# Let a walker step from point to point, at most a reach at a time. All points that one walker can get to are a **Euclidean cluster**. A
# cable is a long chain: few neighbours each, but one large cluster, tied to the desk. A stray is an island of one. And a
# reflection is an island, too, however dense.

# %%
def grow_clusters(points, reach):
    """Number (N,) of each point's cluster: start anywhere, and go on."""
    tree, label = cKDTree(points), np.full(len(points), -1)
    number = 0
    for seed in range(len(points)):
        if label[seed] < 0:
            front = np.array([seed])
            while len(front):
                label[front] = number
                steps = tree.query_ball_point(points[front], reach)
                near = np.unique(np.concatenate(steps).astype(int))
                front = near[label[near] < 0]  # whom we had not met yet
            number += 1
    return label


# 0, 1 and 3 in steps of 2 at most; from 3 to 9 is too far
assert grow_clusters(five, 2.0).tolist() == [0, 0, 0, 1, 1]

# %% tags=["hide-input"]
part = points[points[:, 2] > 1.15]  # quick for the plain loop above
ours = clusters.euclidean_clusters(part, 0.025)  # the library's, compiled
part_cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(part))
# two numberings are alike if each number always meets the same other one:
# then there are as many different pairs as numbers
for same in (grow_clusters(part, 0.025),
             np.asarray(part_cloud.cluster_dbscan(0.025, min_points=1))):
    pairs = np.unique(np.stack([ours, same]), axis=1)
    assert pairs.shape[1] == len(np.unique(ours)) == len(np.unique(same))
report("clusters beyond 1.15 m, the same by our loop, by the library and by "
       "Open3D", len(np.unique(ours)))

# %% [markdown]
# In Open3D the walker is called `cluster_dbscan`; with `min_points=1` it is ours.
#
# How long is the reach? Longer than the spacing of true points, or surfaces fall to pieces; shorter than the gap to what must not be reached. Below, what is left of each
# kind in clusters of at least 500 points.

# %%
def island_sizes(points, reach):
    """Of each point (N,) the size of the cluster that it is in."""
    label = clusters.euclidean_clusters(points, reach)
    return np.bincount(label)[label]


spacing = cKDTree(points[kinds == SURFACE]).query(
    points[kinds == SURFACE], 2)[0][:, 1]
deepest = np.max(points[kinds == SURFACE, 2])
report("spacing on surfaces, median", 1000 * np.median(spacing), "mm", digits=2)
report("three pixels at the farthest depth",
       3000 * deepest / desks.camera.fx, "mm", digits=2)
reaches = {reach: island_sizes(points, reach)
           for reach in (0.006, 0.012, 0.025, 0.05, 0.1)}
report_table([line(f"reach {1000 * reach:g} mm, 500 points", size >= 500)
              for reach, size in reaches.items()], columns=columns)

# %% [markdown]
# The shortest reach loses surfaces, the longest, a hand's breadth, meets the reflection and the strays. In between there is room. Start
# with three pixels at your farthest depth, 3 z / fx (a pixel is z / fx wide), which outlasts noise and a pixel or two that are missing, if the cloud is about as deep as this desk. In a deep
# room that reach bridges every gap near by: section 5.
#
# The least size has two bounds, too: above the largest mirrored patch, below the smallest *real* piece, such as a part of the floor that something nearer cuts off.
# Below, each island of the desk has the colour of its size, and rod and cable their own. White strips were never measured.

# %% tags=["hide-input"]
size = reaches[0.025]
tied = (kinds == REFLECTION) & (size >= 500)
gap = cKDTree(points[kinds <= THIN]).query(points[kinds == REFLECTION])[0]
report("of the reflections stay, tied to the desk",
       100 * np.sum(tied) / np.sum(kinds == REFLECTION), "%", digits=2)
report("median distance from these to what is true",
       1000 * np.median(gap[tied[kinds == REFLECTION]]), "mm", digits=2)
report("and from the others",
       1000 * np.median(gap[~tied[kinds == REFLECTION]]), "mm", digits=2)
desk_views(
    {"500 points and more": ((size >= 500) & (kinds != THIN), "surface"),
     "rod and cable, in the largest": ((size >= 500) & (kinds == THIN),
                                       "inlier"),
     "10 to 499": ((size < 500) & (size >= 10), "estimate"),
     "fewer than 10": (size < 10, "outlier")},
    "Islands of the desk by their size",
    "Left the tablet's patch is an island of middle size, strays and short "
    "pieces at edges are small; desk and wall are one large grey one, and rod "
    "and cable, in blue, belong to it. White strips beside box and cable were "
    "never measured. Right the patch hangs below the desk, connected to "
    "nothing.")

# %% [markdown]
# The mirrored wall is an island: as soon as the least size passes that of its largest patch, it goes, and the chain of the cable stays. What stays, at 25 mm as at 50, is the mirror image of the
# box beside the tablet. An image lies as far behind the glass as the thing stands before it: the wall's far below the desk, the box's so close that the walker steps over. In the histogram these
# points are the small hump inside the surface's hill. The reach of 12 mm parts them here, and takes true points with it; on other desks they touch. To be rid of them one must know where glass is.
#
# ## 5 A pipeline, tuned and reported
#
# Clusters find islands and keep chains. What they leave are flying pixels: they hang on the edge that they fly from. A threshold on the mean distance
# finds some of these. So use both, and keep a point only if both keep it. Let the threshold be a multiple of the median: that carries over to a cloud of
# another spacing, and strays hardly move it.
#
# There are three settings now: reach, least size, medians. Choose them on desks 0, 1 and 2, and report on desks 3, 4 and 5, which the
# choice has never seen. A number reported where it was tuned is advertising; such **held-out data** keeps you honest.

# %%
def pipeline(desk, reach, least, medians):
    """Which points to keep (N,): in a large island, and not lonely."""
    return (desk[reach] >= least) & (desk["medians"] < medians)


# %% tags=["hide-input"]
def prepare(cloud):
    """What no setting changes: kinds, mean distances, cluster sizes."""
    at = cloud.points.astype(float)
    found = {"kinds": cloud.labels, "mean": outliers.mean_distances(at, K)}
    found["medians"] = found["mean"] / np.median(found["mean"])
    found["count"] = count_within(at, 0.02)
    return found | {r: island_sizes(at, r) for r in (0.02, 0.025)}


def together(keeps, setting, chosen):
    """Kept or not, and kinds, of some desks; and the least share of thin."""
    kept = [keeps(ready[name], *setting) for name in chosen]
    true_kinds = [ready[name]["kinds"] for name in chosen]
    thin = min(np.mean(keep[kind == THIN])
               for keep, kind in zip(kept, true_kinds, strict=True))
    return np.concatenate(kept), np.concatenate(true_kinds), thin


# `tries` below: a function of a prepared desk d and its settings; settings
def tuned(keeps, settings):
    """The best F1 of those that keep 98 % of what is thin on each desk."""
    tried = {setting: together(keeps, setting, tuning) for setting in settings}
    return max(tried, key=lambda s: (tried[s][2] >= 0.98,
                                     score(*tried[s][:2])[2]))


ready = {name: prepare(each) for name, each in desks.clouds.items()}
tuning, reporting = list(ready)[:3], list(ready)[3:]
tries = {  # name: what it keeps, and the settings to try
    "statistical, ratio {:g}": (
        lambda d, ratio: usual(d["mean"], ratio),
        [(r,) for r in (2, 1, 0.5, 0.35, 0.25, 0.2, 0.15)]),
    "fixed at {:g} medians": (
        lambda d, most: d["medians"] < most,
        [(m,) for m in (2, 2.5, 3, 3.5, 4, 5)]),
    "radius 0.02 m, at least {}": (
        lambda d, least: d["count"] >= least,
        [(n,) for n in (1, 2, 4, 6, 8, 12)]),
    "clusters, reach {:g} m, least {}": (
        lambda d, reach, least: d[reach] >= least,
        [(r, n) for r in (0.02, 0.025) for n in (10, 100, 500, 2000)]),
    "clusters {:g} m, {}, and {:g} medians": (
        pipeline, [(r, n, m) for r in (0.02, 0.025) for n in (100, 500)
                   for m in (2.5, 3, 3.5, 4, 5)]),
}
best = {name: tuned(*one) for name, one in tries.items()}
setting = best["clusters {:g} m, {}, and {:g} medians"]
report_table(
    [line(name.format(*best[name]),
          *together(keeps, best[name], reporting)[:2])
     for name, (keeps, _) in tries.items()],
    columns=columns, title="Tuned on desks 0 to 2, reported on desks 3 to 5")

# %% [markdown]
# Each row is a filter with its best settings on the desks for tuning (hidden code tries a handful of each). Distances and counts take reflections only together with true points that lie loosely, many of them far, so their precision
# falls. Clusters cannot let go of what touches an edge, so flying pixels stay. Both together gain less F1 over clusters than you may have hoped; what they gain is flying
# pixels, and next to nothing of cable and rod is lost. One reflection in eight stays: the mirrored boxes again. Now each desk by itself, and another order of the same filters:

# %% tags=["hide-input"]
rows = []
for name in reporting:
    desk = ready[name]
    keep, true_kinds = pipeline(desk, *setting), desk["kinds"]
    cut_off = (desk[setting[0]] < setting[1]) & (true_kinds <= THIN)
    rows.append([name, 100 * score(keep, true_kinds)[2], np.sum(cut_off),
                 100 * score(keep | cut_off, true_kinds)[2]])
report_table(rows, columns=["desk", "F1 (%)", "true points in small islands",
                            "F1 if these had stayed (%)"])

in_large = ready["desk_3"][setting[0]] >= setting[1]  # clusters first
after = mean_distances(desks.clouds["desk_3"].points[in_large], K)
rules = {"ratio 0.5": lambda mean: mean.mean() + 0.5 * mean.std(ddof=1),
         "3.5 medians": lambda mean: 3.5 * np.median(mean)}
rows = []
for name, threshold in rules.items():
    keep = in_large.copy()
    keep[in_large] = after < threshold(after)  # on what the clusters left
    rows.append([name, 1000 * threshold(ready["desk_3"]["mean"]),
                 1000 * threshold(after),
                 100 * score(keep, ready["desk_3"]["kinds"])[2]])
report_table(rows, columns=["threshold on desk_3", "of all points (mm)",
                            "after clusters (mm)", "F1 then (%)"], digits=2)

# %% [markdown]
# One desk does worse than the others: a true piece of the table's side, seen alone in the corner of the image, is smaller than the
# least size. Had it stayed, the desk would be like the others. And the second table is a warning. The ratio takes its standard deviation from the strays. When clusters have removed those, it is
# tiny, and the threshold moves into the surface. With a ratio, order matters; a threshold in medians hardly moves.
#
# What is it worth in millimetres? Back in `living_room`, around 1.5 m. An *outlier* is here a point more than four standard deviations of the noise off its surface; RMS is the root of the mean square.

# %% tags=["hide-input"]
# one standard deviation at 1.5 m: px of disparity, m of baseline (lesson 01)
noise = 1.5**2 * 0.0853 / (frame.camera.fx * 0.095)
large = island_sizes(c, setting[0]) >= setting[1]
room_kept = large & (mean_room < setting[2] * np.median(mean_room))
desk_mm = setting[2] * np.median(mean)  # the same threshold, of the desk
near = np.abs(c[:, 2] - 1.5) < 0.1
chosen = {"all points": near, "after the pipeline": near & room_kept,
          "without any outlier": near & (off < 4 * noise)}
share = {name: 100 * np.mean(off[which] >= 4 * noise)
         for name, which in chosen.items()}
rms = {name: 1000 * np.sqrt(np.mean(off[which] ** 2))
       for name, which in chosen.items()}
report_table([[name, share[name], rms[name]] for name in chosen],
             columns=["points about 1.5 m away", "outliers (%)",
                      "RMS distance to the surface (mm)"])
depths = {"1.4 to 1.6 m": (1.4, 1.6), "2 to 3 m": (2, 3), "3 to 4 m": (3, 4),
          "4 to 6 m": (4, 6)}
real_points = {name: (c[:, 2] > low) & (c[:, 2] < high) & (off < 0.03)
               for name, (low, high) in depths.items()}
report_table(
    [[name, 100 * np.mean(~room_kept[which]),
      100 * np.mean(~(large & (mean_room < desk_mm))[which])]
     for name, which in real_points.items()],
    columns=["depth", "true points lost (%)",
             f"with the desk's {1000 * desk_mm:.0f} mm instead"], digits=2)
show.error_budget({"outliers": (
    share["all points"],
    np.sqrt(rms["all points"] ** 2 - rms["without any outlier"] ** 2))})

# %% [markdown]
# The first table: two points in a hundred outweigh the noise of all others; the pipeline finds nearly all of them. The budget's row is what it costs to leave them all in.
#
# The second is the price, in true points. Millimetres that were read from a desk take most of a room's far end. Medians come from the room itself and spare
# most of it. Neighbours lie farther apart in proportion to z: a pixel is z / fx wide. So in a deep scene no one length
# fits: let reach and threshold grow with z, or cut the cloud where they stop fitting.
#
# Or measure in pixels: a step of d metres at depth z is d · fx / z pixels. `mean * fx / z < 3` is one threshold for near and far; a walker may step `3 * z / fx` at his own depth.
#
# ## Report against reality
#
# The report, a student's text on 3D reconstruction with Open3D and a D455, says that outliers are found by "mean and standard deviation analysis, where points falling outside certain thresholds are flagged". Of
# what? Everybody's first try is the coordinates: flag a point if its x, y or z lies more than two standard deviations from the mean. Try it on
# `bunny_like`, where every point is true, and on the desk.

# %%
def by_coordinates(points, ratio):
    """The first try: keep what is near the mean in x, y and z (N,)."""
    away = np.abs(points - points.mean(axis=0))
    return (away < ratio * points.std(axis=0, ddof=1)).all(axis=1)


clay = data.load("bunny_like").cloud.points.astype(float)
flagged = ~by_coordinates(clay, 2)
display(show(
    {"not flagged": (clay[~flagged], "surface"),
     "flagged": (clay[flagged], "outlier")}, view="front", frame="world",
    title="Flagged by the coordinates' standard deviation",
    alt="A clay animal in grey. The tips of its ears and its tail are "
        "vermilion: the ends of the thing, not its errors."))
report_table([line("coordinates, 2 std", by_coordinates(points, 2)),
              line("mean distances, 0.5 std", usual(mean, 0.5))],
             columns=columns)
report("size of the cloud in depth, with outliers", np.ptp(points[:, 2]), "m")
report("and without", np.ptp(points[kinds <= THIN, 2]), "m")

# %% [markdown]
# It flags the ends of things. The mean and the standard deviation must be those of a *local* quantity. What else the report says of outliers:
#
# | The report says | What we found | Evidence |
# |---|---|---|
# | they "deviate from the overall pattern" | strays do; reflections make a pattern of their own: a wall | sections 2 and 4 |
# | they are "sparse" | fewer than inliers, yes; but a reflection is as dense as a wall | section 4 |
# | they "distort statistical measures" | yes: a few stretch the cloud several times over, and raise the very threshold that should find them | above; section 2 |
# | "local density or neighborhood" helps | for noise; it kills thin and far things with it | section 3 |
# | "spatial filtering or clustering" mitigate | clustering is what finds reflections; alone it leaves flying pixels | sections 4 and 5 |
# | inliers are the "majority" and "consistent" | the thin things are inliers, and neither | section 3 |
# | its appendix sets `nb_neighbors=20, std_ratio=2.0` | 19 other points; finds a part of the noise and hardly anything else | section 2 |
#
# ## Break it
#
# "One pass left some. Let us repeat it until nothing is removed any more." Take the clay animal: 36 thousand points, every one true.

# %%
rest, removed = clay, []
for _ in range(12):
    stay = outliers.keep_by_statistics(rest, k=20, std_ratio=2.0)
    removed.append(int(np.sum(~stay)))
    rest = rest[stay]

first = mean_distances(clay, 20)
again, once = first, []  # no distance is measured a second time
while len(once) < 12 or once[-1]:
    stay = usual(again, 2.0)
    once.append(int(np.sum(~stay)))
    again = again[stay]

report("points that were wrong", 0)
report("removed after twelve passes", 100 * (1 - len(rest) / len(clay)), "%",
       digits=2)
report("removed by a fixed threshold of three medians",
       int(np.sum(first >= 3 * np.median(first))))

# %% tags=["hide-input"]
fig, axis = plt.subplots(figsize=(6.8, 3), layout="constrained")
axis.bar(np.arange(1, 13) - 0.2, removed, width=0.4,
         color=show.COLOURS["outlier"],
         label="distances measured anew in each pass")
axis.bar(np.arange(1, len(once) + 1) + 0.2, once, width=0.4, color="white",
         edgecolor=show.COLOURS["outlier"], label="distances measured once")
axis.set(xlabel="pass", ylabel="true points removed", xlim=(0.4, 12.6),
         xticks=range(1, 13), title="The first twelve passes, and no end")
axis.legend(fontsize=8)
picture(fig, alt="Bars of the points removed in each pass over a clean cloud. "
        f"Measured anew, twelve passes: {', '.join(map(str, removed))}; after "
        "the first they hardly become fewer. With distances measured once: "
        f"{', '.join(map(str, once))}; they die out.")

# %% [markdown]
# Two things happen here. The threshold is made of the cloud itself: with the tail gone, the standard deviation shrinks, the threshold moves in, and the next pass
# cuts a new tail. Alone, that dies out: the hollow bars. But each pass also measures anew. Whoever lost a neighbour now has farther to go to the next one,
# so the points around a removed point are next, and holes and borders grow. That is what keeps the filled bars up. Precision is zero from the first pass on.
#
# A professional fixes the threshold once, in metres or in multiples of the spacing, with a median that outliers do not move, and runs one pass.
#
# ## On real data
#
# Nobody labelled this desk of a Kinect. So look, and know your sensor: it measures depth in steps.

# %% tags=["real-data"]
# real data: tum_pair
tum = data.load("tum_pair").frames[0]
real = pointcloud.from_frame(tum).points.astype(float)
real = real[real[:, 2] < 3.5]
stored = np.unique(tum.depth[(tum.depth > 2.9) & (tum.depth < 3.1)])
lengths = {"three pixels": 3 * 3.0 / tum.camera.fx,
           "two steps": 2 * np.median(np.diff(stored))}  # about 3 m away
mean_real = outliers.mean_distances(real, K)
masks, rows = {}, []
for name, length in lengths.items():  # both for reach and for threshold
    island = island_sizes(real, length) < 500
    lonely = mean_real > length
    masks[name] = ~island & ~lonely
    rows.append([name, 1000 * length, 100 * np.mean(island),
                 100 * np.mean(lonely), 100 * np.mean(~masks[name])])
report_table(rows, columns=["reach and threshold", "mm", "small clusters (%)",
                            "too lonely (%)", "removed (%)"], digits=2)
show.panels(
    {name: [{"kept": (real[keep], "surface"),
             "removed": (real[~keep], "outlier")}]
     for name, keep in masks.items()}, view="side", frame="camera",
    title="A real desk from the side, with two reaches",
    alt="A desk, its chairs, floor and wall from the side, twice, cut into "
        "stripes of equal depth. With three pixels the far half of floor and "
        "wall is vermilion; with two steps three islands of a few hundred "
        "points are.")

# %% [markdown]
# With a reach that is chosen by pixels alone, the walker cannot step from stripe to
# stripe, and the filter takes much of a true floor and wall. The spacing is the larger of a pixel and a step. So we cut at 3.5 m, where steps grow longer still, and take two steps at 3 m for the reach. Near by
# that is far too long, and flying pixels stay: the price of one length for all depths. Nobody can tell you the recall here. So look at what was removed, always, and from the side.
#
# ## Key points
#
# - Precision and recall, by kind of outlier, on data that was not used for tuning. And count what is thin.
# - Distances find strays. A dense reflection they find only if it is also farther away than everything real. It is an island, and clusters find it.
# - A reach is longer than the spacing and shorter than the gap. A chain of points is a cluster all the same, while a count takes a line for noise.
# - A larger std_ratio removes less. Open3D counts the point itself; we and PCL do not.
# - One pass, one fixed threshold, read from a histogram. In metres for a desk, in medians for another cloud, in pixels (d · fx / z) for a deep room. Repeating eats what is true.
#
# Words to know: [outlier](../docs/glossary.md#outlier), [precision of a filter](../docs/glossary.md#precision-of-a-filter), [recall](../docs/glossary.md#recall),
# [statistical outlier removal](../docs/glossary.md#statistical-outlier-removal), [radius outlier removal](../docs/glossary.md#radius-outlier-removal),
# [Euclidean cluster](../docs/glossary.md#euclidean-cluster), [held-out data](../docs/glossary.md#held-out-data).
#
# ## Your own camera
#
# Change one line: `points = pointcloud.from_frame(data.from_folder("path/to/my_recording", camera="camera.json").frames[0]).points.astype(float)`. Then
# draw the histogram of `mean_distances(points, 8)` without kinds, and look for the bend from slope to shelf. Start with a reach of three pixels at your farthest depth (in a deep room: at each depth),
# `3 * z / fx`, or two steps of depth if they are larger, and a least size below your smallest real thing. (Work in this notebook, not in your copy of the
# lab: there `euclidean_clusters` is switched off, as task 5 asks for your own.)
#
# ## To the lab
#
# Lab 05 has you cut where a lost point has its price, measure distances in pixels, mend somebody's filter by a second view, tell five spoiled desks apart, and clean a desk in
# a room so deep that no one length fits: [open lab 05](../exercises/05_outliers.ipynb).
#
# ## Going further
#
# - **Filter the image, not the cloud.** In a depth image the neighbours are known without any search. `course_lib.camera.depth_filters` keeps a pixel if some of those around it
#   have nearly its disparity, or if it belongs to a large enough patch; a threshold in disparity is right at every depth, as the noise is constant there. It is cheap, finds specks and
#   flying pixels, and reflections not at all. Watch the thin things: in an image, a hole cuts a cable in two.

# %%
from course_lib.camera import depth_filters

table = []
for name, desk in zip(reporting, desks.frames[3:], strict=True):
    # two pixels of disparity, in 1/m
    step = 2.0 / (desk.camera.fx * desks.meta["baseline_metres"])
    supported = depth_filters.keep_supported(desk.depth, step, least=2)
    patches = depth_filters.keep_large_patches(
        np.where(supported, desk.depth, 0), step, least=10)
    good = (supported & patches)[desk.depth > 0]
    both = good & (ready[name][setting[0]] >= setting[1])
    table += [line(f"{name}, image", good, ready[name]["kinds"]),
              line(f"{name}, image and clusters", both, ready[name]["kinds"])]
report_table(table, columns=columns)

# %% [markdown]
# Alone, the image filter finds noise and half of the flying pixels, and no reflection. With clusters it comes near the pipeline of section 5, on one desk at the
# price of some cable. Take it where a search for neighbours is too slow; else the pipeline is better.
#
# - RealSense's own chain is such a filter and more: decimation, threshold, disparity transform, spatial, temporal, hole filling. Hole filling
#   *invents* points; leave it off before measuring.
# - The library's filters keep Open3D's points, faster: [benchmarks](../docs/benchmarks.md). What makes them fast is order: points sorted along a curve that fills space, so
#   that each search finds its data in the cache.
# - Reflections need knowledge that one cloud does not hold: a second view (the glass now shows another part of what it mirrors), polarisation, or a person who says "that is glass".
# - A finished model has no outliers, and a statistical filter finds some all the same: of the Stanford bunny Open3D's example takes more than a thousand true points.
# - Rusu and others, *Towards 3D point cloud based object maps for household environments*, 2008: statistical removal. Ester and others, *A density-based
#   algorithm for discovering clusters*, 1996: DBSCAN. PCL's manual counts neighbours as we do; Open3D's does not say.
