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
# # Lab 05 Outliers
#
# Six tasks, about 60 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check says what is off and by how much. Try again
# and it says what the mistake looks like, then where to read.
#
# Everything you need stands in [lesson 05](../notebooks/05_outliers.ipynb). Points are `(N, 3)` arrays in metres. A point is **not** among its own neighbours. A mask `keep` is `(N,)`,
# True where a point stays. You may use NumPy and SciPy's trees; the filters you write yourself.

# %%
from course_lib.notebook import check, data, picture, report_table, show

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from course_lib.tasks.labs.lab_05_outliers.small_desk import small_desk

desk, kinds = small_desk(np.random.default_rng(5))
names = ["", "surface", "thin structure", "flying pixels", "reflection", "noise"]


def side(axis, points, color, label=""):
    """Draw points from the side: x to the right, z up."""
    axis.plot(points[:, 0], points[:, 2], ".", ms=1.5, color=color, label=label)
    axis.set(aspect="equal", xlim=(-0.15, 1.2), ylim=(-0.4, 0.55), xlabel="x (m)")


def score(keep, kinds):
    """Precision, recall and F1 of what a filter removed, as in the lesson; `keep` is (N,) bool."""
    wrong = kinds >= 3
    hits = np.sum(~keep & wrong)
    return hits / max(np.sum(~keep), 1), hits / np.sum(wrong), 2 * hits / (np.sum(~keep) + np.sum(wrong))


# %% [markdown]
# ## Task 1 — where to cut (1 point)
#
# You have a labelled cloud to tune on: of each point its mean distance to its neighbours, and whether it is wrong. Count true and wrong points in the bins of a
# histogram, and return where the first bin begins that holds more wrong points than true ones.
#
# - `mean`: (N,) float, metres
# - `wrong`: (N,) bool, True for outliers
# - `edges`: (B + 1,) float, metres, ascending: bin i begins at `edges[i]`. One bin at least holds more wrong points.
# - returns: a number, metres
#
# For example, with bins from 0, 2 and 4 m, true points at 1, 1 and 3 m and wrong ones at 3, 3 and 5 m, the answer is 2 m.
#
# <details><summary>Hint 1: idea</summary>Compare the two counts bin by bin. You want the first True of the answer.</details>
# <details><summary>Hint 2: call</summary><code>np.histogram(mean[wrong], edges)[0]</code> counts the wrong ones;
# <code>np.argmax(mask)</code> is the number of the first True.</details>

# %% tags=["expected", "hide-input"]
spread = cKDTree(desk).query(desk, 9)[0][:, 1:].mean(axis=1)
edges = np.geomspace(0.004, 0.4, 40)
sides = {kind: np.histogram(spread[which], edges)[0] for kind, which in (("surface", kinds < 3), ("outlier", kinds >= 3))}
cut = next(low for low, true, bad in zip(edges, *sides.values(), strict=False) if bad > true)
fig, axis = plt.subplots(figsize=(6.4, 2.6), layout="constrained")
axis.stairs(sides["surface"], 1000 * edges, fill=True, color=show.COLOURS["surface"], label="true")
axis.stairs(sides["outlier"], 1000 * edges, lw=2, color=show.COLOURS["outlier"], label="wrong")
axis.axvline(1000 * cut, color="black", ls="--", lw=1)
axis.set(xscale="log", yscale="log", xlabel="mean distance to 8 neighbours (mm)", ylabel="points", title="Expected, on a small desk")
axis.legend(loc="upper right")
picture(fig, alt=f"Histograms of the mean distance: a high grey hill of true points at the left, a flat vermilion one of wrong points from its foot to the right. "
                 f"A dashed line at {1000 * cut:.0f} mm, where the vermilion first rises over the grey.")


# %% tags=["task"]
def where_to_cut(mean, wrong, edges):
    """The lower edge, in metres, of the first bin with more wrong points than true ones."""
    # BEGIN SOLUTION
    # how many wrong and how many true points lie in each bin
    bad = np.histogram(mean[wrong], edges)[0]
    good = np.histogram(mean[~wrong], edges)[0]
    # the first bin where the wrong ones are more, and where it begins
    return edges[np.argmax(bad > good)]
    # END SOLUTION


# %% tags=["check"]
check("05-1", where_to_cut)

# %% [markdown]
# ## Task 2 — mean distance to the neighbours (3 points)
#
# The quantity that task 1 was given. The picture shows it on a small desk; one of the cases is a real cloud, the Stanford bunny.
#
# - `points`: (N, 3) float, metres
# - `k`: how many nearest *other* points, fewer than N
# - returns: (N,) float, metres: the mean of the distances to these k points
#
# Two points may lie in the same place; then each is the other's neighbour, at distance 0.
#
# <details><summary>Hint 1: idea</summary>Ask a tree for more than k. Which of the answers is no neighbour?</details>
# <details><summary>Hint 2: formula</summary>(d₁ + … + dₖ) / k, with the distances sorted and the point's own 0 left out.</details>
# <details><summary>Hint 3: call</summary><code>distance, index = cKDTree(points).query(points, k + 1)</code>: (N, k + 1), each row ascending.</details>

# %% tags=["expected", "hide-input"]
fig, axis = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
order = np.argsort(spread)
drawn = axis.scatter(desk[order, 0], desk[order, 2], c=1000 * spread[order], s=2, vmin=5, vmax=60)
axis.set(aspect="equal", xlabel="x (m)", ylabel="z (m)", title="Expected: mean distance to 8 neighbours, a desk from the side")
fig.colorbar(drawn, label="mm", shrink=0.8, extend="max")
picture(fig, alt=f"A desk from the side. On surfaces the mean distance is about {1000 * np.median(spread[kinds == 1]):.0f} mm, in the mirrored patch "
                 f"below it {1000 * np.median(spread[kinds == 4]):.0f} mm, of strays {1000 * np.median(spread[kinds == 5]):.0f} mm.")


# %% tags=["task"]
def mean_distances(points, k):
    """Mean distance (N,) in metres of each point to its k nearest other points."""
    # BEGIN SOLUTION
    # the k + 1 nearest of each point, itself among them
    distance, _ = cKDTree(points).query(points, k + 1)
    # leave the first out, which is the point itself (or a twin, at distance 0 as well), and take the mean
    return distance[:, 1:].mean(axis=1)
    # END SOLUTION


# %% tags=["check"]
check("05-2", mean_distances)

# %% [markdown]
# Your function on the whole of a thinned bunny, with a threshold of the mean plus two standard deviations. It has no outliers, and still the filter finds some.

# %% tags=["real-data"]
# real data: stanford_bunny
bunny = data.load("stanford_bunny").clouds["bun_zipper_res3"].points.astype(float)
try:
    real = mean_distances(bunny, 8)
    stays = real < real.mean() + 2 * real.std(ddof=1)
    display(show({"stays": (bunny[stays], "surface"), "goes": (bunny[~stays], "outlier")}, view="front", frame="object",
                 title="Your distances on the bunny: beyond two standard deviations in vermilion"))
except NotImplementedError as todo:
    print(todo)

# %% [markdown]
# ## Task 3 — mend a radius filter (3 points)
#
# Somebody wrote this filter and gave it to you. It should keep the points that have at least `least` *other* points within `radius`. The picture shows what it
# keeps of every fourth point of the desk. There are three mistakes in it. Mend them all.
#
# - `points`: (N, 3) float, metres
# - `radius`: metres; a point at exactly this distance counts
# - `least`: a whole number
# - returns: (N,) bool, True for points that stay
#
# <details><summary>Hint 1: idea</summary>Ask three questions: who is counted? Which two lengths are compared? What does True mean?</details>
# <details><summary>Hint 2: formula</summary>d² ≤ r² is the same as d ≤ r. It is not the same as d² ≤ r.</details>
# <details><summary>Hint 3: call</summary>Each point is within any radius of itself: <code>count = (…).sum(axis=1) - 1</code></details>

# %% tags=["expected", "hide-input"]
some = desk[::4]
squared = ((some[:, None] - some[None]) ** 2).sum(axis=-1)
masks = {"given": (squared <= 0.04).sum(axis=1) < 6, "expected": (squared <= 0.04**2).sum(axis=1) - 1 >= 6}
fig, axes = plt.subplots(1, 2, figsize=(9, 4), sharey=True, layout="constrained")
for axis, (name, mask) in zip(axes, masks.items(), strict=True):
    side(axis, some[mask], show.COLOURS["inlier"])
    axis.set(title=f"{name}: {mask.sum():,} of {len(some):,} points stay")
axes[0].set_ylabel("z (m)")
rest = {kind: 100 * masks["expected"][kinds[::4] == kind].mean() for kind in (2, 4)}
picture(fig, alt=f"With radius 0.04 m and least 6 the given code keeps {masks['given'].sum()} strays and no desk; expected are {masks['expected'].sum()} "
                 f"points: the desk without its strays, but with {rest[4]:.0f} % of the reflection and only {rest[2]:.0f} % of rod and cable.")


# %% tags=["task"]
def keep_by_radius(points, radius, least):
    """Which points to keep (N,): those with at least `least` other points within `radius` metres."""
    # BEGIN SOLUTION
    # the first two lines are right; one mistake is in how the third compares, one in whom it counts, one in the last
    difference = points[:, None] - points[None]
    squared = (difference**2).sum(axis=-1)
    count = (squared <= radius**2).sum(axis=1) - 1
    return count >= least
    # INSTEAD
    #| difference = points[:, None] - points[None]
    #| squared = (difference**2).sum(axis=-1)
    #| count = (squared <= radius).sum(axis=1)
    #| return count < least  # True: an outlier
    # END SOLUTION


# %% tags=["check"]
check("05-3", keep_by_radius)

# %% [markdown]
# ## Task 4 — which setting made this (2 points)
#
# Five people cleaned the desk of task 2, and each made one mistake. The pictures show what they *kept*, from the side. The flat piece at the right is a tray: it
# is real. Give each letter its cause, each cause once:
#
# `"std_ratio too large"`, `"radius too small"`, `"least cluster size too large"`, `"kept and removed exchanged"`, `"repeated twelve times"`
#
# <details><summary>Hint 1: idea</summary>Ask of each: are strays left? Is a whole true thing missing? Are there
# holes in the wall, widening, and borders eaten away, or points sprinkled everywhere?</details>
# <details><summary>Hint 2: call</summary>Return <code>{"A": "…", "B": "…", …}</code> with the letters A to E.</details>

# %% tags=["expected", "hide-input"]
def statistical(points, ratio):
    distance = cKDTree(points).query(points, 9)[0][:, 1:].mean(axis=1)
    return distance < distance.mean() + ratio * distance.std(ddof=1)


def sizes(points, reach):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    label = np.asarray(cloud.cluster_dbscan(reach, min_points=1))
    return np.bincount(label)[label]


def repeated(points, ratio, times):
    left = np.arange(len(points))
    for _ in range(times):
        left = left[statistical(points[left], ratio)]
    return np.isin(np.arange(len(points)), left)


makers = [
    lambda: statistical(desk, 6.0),
    lambda: cKDTree(desk).query_ball_point(desk, 0.0092, return_length=True) - 1 >= 3,
    lambda: sizes(desk, 0.014) >= 2000,
    lambda: sizes(desk, 0.014) < 250,
    lambda: repeated(desk, 1.0, 12),
]
order = np.random.default_rng(505).permutation(5)
kept = {letter: makers[i]() for letter, i in zip("ABCDE", order, strict=True)}
fig, axes = plt.subplots(2, 3, figsize=(9.5, 5.2), sharex=True, sharey=True, layout="constrained")
for axis, (name, mask) in zip(axes.ravel(), {"all points": np.ones(len(desk), bool), **kept}.items(), strict=True):
    side(axis, desk[mask], show.COLOURS["reference" if name == "all points" else "inlier"])
    axis.set(title=name)
    axis.label_outer()
for axis in axes[:, 0]:
    axis.set_ylabel("z (m)")
picture(fig, alt="The desk from the side with all its points, and what five mistakes keep of it. " + " ".join(
    f"{letter}: {mask.sum()} of {len(desk)} points." for letter, mask in kept.items()))

# %% tags=["expected", "hide-input"]
report_table([[letter, int(mask.sum()), *(100 * float(mask[kinds == kind].mean()) for kind in range(1, 6))] for letter, mask in kept.items()],
             columns=["desk", "points kept", *(f"{name} kept (%)" for name in names[1:])], digits=2)


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "E" to the names of their causes."""
    # BEGIN SOLUTION
    return {
        "A": "repeated twelve times",
        "B": "least cluster size too large",
        "C": "kept and removed exchanged",
        "D": "std_ratio too large",
        "E": "radius too small",
    }
    # END SOLUTION


# %% tags=["check"]
check("05-4", causes)

# %% [markdown]
# ## Task 5 — clean a desk (4 points, open-ended)
#
# Here is a whole cloud of about 10,000 points: surfaces 9 mm between points, a rod and a cable 5 mm between points, flying pixels behind edges, one mirrored
# patch, strays. Nobody tells you which is which. Clean it. (On this desk flying pixels keep more than a spacing from the edge that they flew off; on the lesson's they touch it.)
#
# - `points`: (N, 3) float, metres
# - returns: (N,) bool, True for points that stay
#
# You are scored by F1 of what you remove, as the median over five desks: from 60 % on 1 point, from 80 % on 2, from 90 % on 3, from 97 % on all 4. Whoever loses
# more than 5 % of rod and cable gets no more than 1. The desk above (`desk`, `kinds`) is one of this kind, with its truth, to tune on: `score(clean(desk), kinds)`. The smallest true thing has more than 300
# points, the mirrored patch fewer than 200.
#
# <details><summary>Hint 1: idea</summary>Which of the three filters takes a dense patch for what it is, an island? And how far apart are flying pixels from what
# they flew off?</details>
# <details><summary>Hint 2: formula</summary>A reach a little larger than the spacing, and a least size between the two numbers above.</details>
# <details><summary>Hint 3: call</summary><code>pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")</code>, a sparse matrix
# <code>coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(N, N))</code>, <code>connected_components(matrix, directed=False)[1]</code>,
# <code>np.bincount(label)[label]</code></details>


# %% tags=["task"]
def clean(points):
    """Which points to keep (N,)."""
    # BEGIN SOLUTION
    pairs = cKDTree(points).query_pairs(0.0135, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    label = connected_components(graph, directed=False)[1]
    return np.bincount(label)[label] >= 250
    # END SOLUTION


# %% tags=["check"]
check("05-5", clean)

# %% [markdown]
# ## Task 6 — explain why repeating never ends (2 points, marked by hand)
#
# A colleague runs the statistical filter again and again "until it removes nothing", and an hour later half the model is gone. In at most 60
# words: why does it always find something, and what would you do instead?
#
# <details><summary>Hint 1: idea</summary>Where does the threshold come from? And what happens to the neighbours of a point that was removed?</details>
# <details><summary>Hint 2: formula</summary>"Break it" in lesson 05 has both causes, and the remedy. One cause and the remedy are enough.</details>


# %% tags=["task"]
def explain():
    """Your explanation, at most 60 words."""
    # BEGIN SOLUTION
    return (
        "The threshold comes from the cloud itself: with the tail cut, the deviation shrinks and the threshold moves in. And each "
        "pass measures anew: whoever lost a neighbour has farther to go to the next, so holes and borders grow. Instead fix one "
        "threshold in metres, or multiples of the median, and run once."
    )
    # END SOLUTION


# %% tags=["check"]
check("05-6", explain)

# %% [markdown]
# ## Handing in
#
# Restart the kernel, run all cells, save, and hand in this one file. Unfinished tasks cost only their own points.
