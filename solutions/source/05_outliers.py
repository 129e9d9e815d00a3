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
# Six tasks, about 54 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check says what is off and by how much. Try again
# and it says what the mistake looks like, then where to read.
#
# Everything you need stands in [lesson 05](../notebooks/05_outliers.ipynb), but never as it stood there: a mistake has a price, a camera leaves holes, a second view comes, the room is
# deep. Points are `(N, 3)` arrays in metres, in the camera's frame: x right, y down, z forward. A mask `keep` is `(N,)`, True where a point
# stays. You may use NumPy and SciPy's trees; the filters you write yourself.
#
# In all pictures you see one desk in a deep room, as a small camera sees it whose focal length fx is 110 pixels. `desk` holds its points, `kinds` what they are:
# 1 surface, 2 rod or cable, 3 flying pixel, 4 reflection, 5 noise.

# %%
from course_lib.notebook import check, data, picture, report_table, show

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from course_lib.cloud import pointcloud

stored = data.of_lab("05")  # what the pictures are drawn from
desk, kinds = stored["desk"].astype(float), stored["kinds"]
names = ["surface", "thin structure", "flying pixels", "reflection", "noise"]


def front(axis, points, **style):
    """Draw points as the camera sees them."""
    axis.scatter(points[:, 0] / points[:, 2], -points[:, 1] / points[:, 2],
                 lw=0, **style)
    axis.set(aspect="equal", xlim=(-0.7, 0.7), ylim=(-0.52, 0.52))
    axis.set(xticks=[], yticks=[])


def side(axis, points, **style):
    """Draw points from the side: the camera at the left, z to the right."""
    axis.scatter(points[:, 2], -points[:, 1], lw=0, **style)
    axis.set(xlabel="z (m)")


def score(keep, kinds):
    """Precision, recall and F1 of a filter, as in the lesson."""
    wrong = kinds >= 3
    hits = np.sum(~keep & wrong)
    removed = np.sum(~keep)
    return (hits / max(removed, 1), hits / np.sum(wrong),
            2 * hits / (removed + np.sum(wrong)))


# %% tags=["expected", "hide-input"]
fig, axes = plt.subplots(
    1, 2, figsize=(9, 3.4), layout="constrained", width_ratios=(1, 1.3))
colour = {1: "surface", 2: "inlier", 3: "source", 4: "estimate", 5: "outlier"}
for draw, axis in zip((front, side), axes, strict=True):
    for kind, name in colour.items():
        draw(axis, desk[kinds == kind], s=4 if kind > 1 else 1,
             color=show.COLOURS[name], label=names[kind - 1])
axes[0].set(title="as the camera sees it")
axes[1].set(title="from the side", ylabel="up (m)")
axes[1].legend(markerscale=3, fontsize=8, loc="lower left")
count = ", ".join(f"{np.sum(kinds == kind):,} {name}"
                  for kind, name in enumerate(names, 1))
picture(fig, alt="A desk with two boxes, a rod and a cable; behind it a sign "
        "that hangs in the room, and a wall. From the side strays are seen in "
        "the air, flying pixels behind boxes, desk and sign, and a mirrored "
        f"patch a little below the desk. Points: {count}.")

# %% [markdown]
# ## Task 1 — where to cut (1 point)
#
# You have a labelled cloud to tune on: of each point its mean distance to its neighbours, and whether it is wrong. On this job a true point that is lost is as bad
# as `cost` wrong ones that stay. Count true and wrong points in the bins of a histogram, and return where the first bin begins that is worth removing:
# its wrong points outweigh its true ones.
#
# - `mean`: (N,) float, pixels
# - `wrong`: (N,) bool, True for outliers
# - `edges`: (B + 1,) float, pixels, ascending: bin i begins at `edges[i]`. One bin at least is worth removing.
# - `cost`: a whole number
# - returns: a number, pixels
#
# For example, with edges 0, 2, 4 and 6 px, true points at 1, 1 and 3 px and wrong ones at 3, 3 and 5 px, and a cost of 2, the answer is 4 px: the
# bin from 2 px has two wrong points, and one true one that weighs as much.
#
# <details><summary>Hint 1: idea</summary>Compare the two counts bin by bin, with the price of each. You want the first True of the answer.</details>
# <details><summary>Hint 2: call</summary><code>np.histogram(mean[wrong], edges)[0]</code> counts the wrong ones;
# <code>np.argmax(mask)</code> is the number of the first True.</details>

# %% tags=["expected", "hide-input"]
fig, axis = plt.subplots(figsize=(6.4, 2.8), layout="constrained")
axis.stairs(stored["true"], stored["edges"], fill=True,
            color=show.COLOURS["surface"], label="true")
axis.stairs(stored["wrong"], stored["edges"], lw=2,
            color=show.COLOURS["outlier"], label="wrong")
for cost, place in zip((1, 10), stored["cuts"], strict=True):
    axis.axvline(place, color="black", ls="--", lw=1)
    axis.text(place, 0.9 if cost == 1 else 0.6,
              f" cost {cost}: {place:.1f} px", fontsize=9,
              transform=axis.get_xaxis_transform())
axis.set(xscale="log", yscale="log", ylabel="points",
         xlabel="mean distance to 8 neighbours (pixels)",
         title="Expected on this desk, with two costs")
axis.legend(loc="upper right")
picture(fig, alt="Histograms of the mean distance: a high grey hill of true "
        "points at the left, a flat vermilion one of wrong points from its "
        "foot to the right. Dashed lines where it pays to cut: at "
        f"{stored['cuts'][0]:.1f} px if a true point costs as much as a wrong "
        f"one, at {stored['cuts'][1]:.1f} px if it costs ten times as much.")


# %% tags=["task"]
def where_to_cut(mean, wrong, edges, cost):
    """Where, in pixels, the first bin begins that is worth removing."""
    # BEGIN SOLUTION
    # how many wrong and how many true points lie in each bin
    bad = np.histogram(mean[wrong], edges)[0]
    good = np.histogram(mean[~wrong], edges)[0]
    # the first bin where the wrong ones outweigh, and where it begins
    return edges[np.argmax(bad > cost * good)]
    # END SOLUTION


# %% tags=["check"]
check("05-1", where_to_cut)

# %% [markdown]
# ## Task 2 — mean distance in pixels (3 points)
#
# In a deep scene no one length fits: at depth z a pixel is z / fx wide, and so far apart are neighbours on a surface that faces the camera. So measure the mean distance
# to the nearest others in pixels *at the depth of the point*. And a camera's cloud has holes: a row of NaN is a pixel that measured nothing. It is nobody's neighbour.
#
# - `points`: (N, 3) float, metres; rows of NaN where nothing was measured
# - `k`: how many nearest *other* points, fewer than there are measured ones
# - `fx`: the focal length, pixels
# - returns: (N,) float, pixels; NaN where nothing was measured
#
# For example, with fx = 500 px and k = 2, a point 2 m deep whose two nearest others are 1 cm and 3 cm away has 5 px. Two points may lie in the same place; then
# each is the other's neighbour, at distance 0.
#
# <details><summary>Hint 1: idea</summary>Which rows may go into the tree? And what is one pixel, in metres, at the depth of a point?</details>
# <details><summary>Hint 2: formula</summary>(d₁ + … + dₖ) / k · fx / z, with the distances sorted and the point's own 0 left out.</details>
# <details><summary>Hint 3: call</summary><code>measured = ~np.isnan(points[:, 2])</code>, <code>out = np.full(len(points), np.nan)</code>,
# <code>out[measured] = …</code></details>

# %% tags=["expected", "hide-input"]
fig, axis = plt.subplots(figsize=(6.6, 4), layout="constrained")
drawn = axis.scatter(desk[:, 0] / desk[:, 2], -desk[:, 1] / desk[:, 2], s=5,
                     c=stored["mean_pixels"], vmin=1, vmax=8, marker="s", lw=0)
axis.set(aspect="equal", xticks=[], yticks=[],
         title="Expected: mean distance to 8 neighbours, in pixels")
fig.colorbar(drawn, label="pixels", shrink=0.8, extend="max")
middle = [np.median(stored["mean_pixels"][kinds == kind])
          for kind in range(1, 6)]
picture(fig, alt="The desk as the camera sees it. Desk and far wall are dark "
        "alike; edges and specks are bright. Medians in pixels: " + ", ".join(
            f"{n} {m:.1f}" for n, m in zip(names, middle, strict=True)) + ".")


# %% tags=["task"]
def mean_distances(points, k, fx):
    """Mean distance (N,) to the k nearest others, in pixels at the depth."""
    # BEGIN SOLUTION
    # what was measured
    measured = ~np.isnan(points[:, 2])
    there = points[measured]
    # the k + 1 nearest of each, itself (or a twin) the first; leave it out
    distance, _ = cKDTree(there).query(there, k + 1)
    metres = distance[:, 1:].mean(axis=1)
    # how many pixels that is; NaN where nothing was measured
    out = np.full(len(points), np.nan)
    out[measured] = metres * fx / there[:, 2]
    return out
    # END SOLUTION


# %% tags=["check"]
check("05-2", mean_distances)

# %% [markdown]
# Your function on a real image, of a Kinect, with one threshold in pixels.

# %% tags=["real-data"]
# real data: tum_pair
frame = data.load("tum_pair").frames[0]
real = pointcloud.from_frame(frame).points.astype(float)
try:
    pixels = mean_distances(real, 8, frame.camera.fx)
    few = pixels < 3
    display(show({"stays": (real[few], "surface"),
                  "goes": (real[~few], "outlier")}, view="camera",
                 title="Your distances on a real desk: beyond 3 pixels"))
except NotImplementedError as todo:
    print(todo)

# %% [markdown]
# Little goes, mostly at edges: as a *threshold* three pixels are enough here; as a *reach*, in the lesson, they were not, as this camera measures far depths in steps that are longer.
#
# ## Task 3 — mend a filter by a second view (3 points)
#
# The camera moved and looked again. What is there is seen again; flying pixels and strays are elsewhere now, and the glass shows another part of what it mirrors. `others` are the points of the second
# view, brought into the frame of the first. So keep a point of the first view if the *other view* has at least `least` points within `radius` of it.
# Somebody wrote that filter and gave it to you. There are three mistakes in it. Mend them all.
#
# - `points`: (N, 3) float, metres, of the first view: the mask is for these
# - `others`: (M, 3) float, metres, of the second view, in the same frame
# - `radius`: metres; a point at exactly this distance counts, and one at the very place, too
# - `least`: a whole number
# - returns: (N,) bool, True for points that stay
#
# <details><summary>Hint 1: idea</summary>Ask three questions: who is counted? Which two lengths are compared? What does True mean?</details>
# <details><summary>Hint 2: formula</summary>d² ≤ r² is the same as d ≤ r. It is not the same as d² ≤ r.</details>
# <details><summary>Hint 3: call</summary>Is a point of the first view among those of the second? What does that say about the number that is taken off
# <code>(…).sum(axis=1)</code>?</details>

# %% tags=["expected", "hide-input"]
near = desk[:, 2] < 1.4
masks = {"given": stored["given"], "expected": stored["seen_again"]}
fig, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True,
                         layout="constrained")
for axis, (name, mask) in zip(axes, masks.items(), strict=True):
    for which, role in ((~mask, "outlier"), (mask, "surface")):
        side(axis, desk[near & which], s=3, color=show.COLOURS[role],
             label="stays" if role == "surface" else "goes")
    axis.set(title=f"{name}: {mask.sum():,} of {near.sum():,} points stay",
             xlim=(0.35, 1.45), ylim=(-0.65, 0.5))
axes[0].set_ylabel("up (m)")
axes[1].legend(markerscale=3, loc="upper left")
stay = [100 * masks["expected"][near & (kinds == kind)].mean()
        for kind in range(1, 6)]
picture(fig, alt="The near part of the desk from the side. The given code "
        f"keeps {masks['given'].sum()} strays and no desk. Expected, with "
        "radius 0.02 m and least 3, in per cent: " + ", ".join(
            f"{n} {s:.0f}" for n, s in zip(names, stay, strict=True)) + ".")


# %% tags=["task"]
def keep_by_radius(points, others, radius, least):
    """Which points to keep (N,): those that the other view confirms."""
    # BEGIN SOLUTION
    difference = points[:, None] - others[None]
    squared = (difference**2).sum(axis=-1)
    count = (squared <= radius**2).sum(axis=1)
    return count >= least
    # INSTEAD
    #| difference = points[:, None] - others[None]
    #| squared = (difference**2).sum(axis=-1)
    #| count = (squared <= radius).sum(axis=1) - 1
    #| return count < least
    # END SOLUTION


# %% tags=["check"]
check("05-3", keep_by_radius)

# %% [markdown]
# ## Task 4 — which setting made this (2 points)
#
# Five people cleaned the desk, each with one of the lesson's filters in pixels, and each made one mistake. The pictures show what they *kept*, as the camera sees it and from the
# side. The sign that hangs in the room at 2 m is real. Give each letter its cause, each cause once:
#
# `"std_ratio too large"`, `"radius too small"`, `"least cluster size too large"`, `"kept and removed exchanged"`, `"repeated twelve times"`
#
# <details><summary>Hint 1: idea</summary>Ask of each: are strays left? Is one whole thing missing and all else untouched? A surface seen at a slant has wider spacing: it is the first
# that a short radius or repeating takes. Are there holes that widen and borders eaten away, or are points missing everywhere?</details>
# <details><summary>Hint 2: call</summary>Return <code>{"A": "…", "B": "…", …}</code> with the letters A to E.</details>

# %% tags=["expected", "hide-input"]
kept = {letter: stored[f"kept_{letter}"] for letter in "ABCDE"}
fig, axes = plt.subplots(3, 4, figsize=(9.5, 6.2), layout="constrained")
shown = {"all points": np.ones(len(desk), bool), **kept}
for pair, (name, mask) in zip(axes.reshape(6, 2), shown.items(), strict=True):
    role = "reference" if name == "all points" else "inlier"
    front(pair[0], desk[mask], s=1, color=show.COLOURS[role])
    side(pair[1], desk[mask], s=1, color=show.COLOURS[role])
    pair[0].set_title(name)
    pair[1].set(xlim=(0.3, 5), ylim=(-1.1, 1.6))
picture(fig, alt="The desk with all its points, and what five mistakes keep of "
        "it, each as the camera sees it and from the side. " + " ".join(
            f"{letter}: {mask.sum():,} of {len(desk):,} points."
            for letter, mask in kept.items()))

# %% tags=["expected", "hide-input"]
report_table(
    [[letter, int(mask.sum()), *(100 * float(mask[kinds == kind].mean())
                                 for kind in range(1, 6))]
     for letter, mask in kept.items()],
    columns=["desk", "points kept", *(f"{name} kept (%)" for name in names)],
    digits=2)


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
# ## Task 5 — clean a desk in a deep room (4 points, open-ended)
#
# Here is a whole cloud of about 16,000 points, such as `desk`: fx is 110 px, the desk begins at 0.6 m, the wall is 3 to 6 m away. Surfaces, a rod, a cable, a sign;
# flying pixels, one mirrored patch, strays and specks of four. Nobody tells you which is which. Clean it. (Flying pixels keep five pixels and more from what is true, though less from each other; on the lesson's desk they touch it.)
#
# - `points`: (N, 3) float, metres
# - returns: (N,) bool, True for points that stay
#
# You are scored by F1 of what you remove: from 60 % on 1 point, from 85 % on 2, from 92 % on 3, from 97 % on all 4. Whoever loses more than 5 % of rod and cable gets no more
# than 1. **The worst of 7 fresh scenes counts; the check shows 3.** To tune, use `desk` and `kinds`: `score(clean(desk), kinds)`. The smallest true thing has more than
# 350 points, the mirrored patch fewer than 250.
#
# <details><summary>Hint 1: idea</summary>Which of the three filters takes a dense patch for what it is, an island? And how long may a step be near by, and at the
# wall?</details>
# <details><summary>Hint 2: formula</summary>A step of d metres at depth z is d · fx / z pixels. In the coordinates fx · x / z, fx · y / z and fx · ln z each distance is
# (nearly) one in pixels at its depth. Choose the reach longer than the spacing and shorter than the gap.</details>
# <details><summary>Hint 3: call</summary><code>pairs = cKDTree(at).query_pairs(reach, output_type="ndarray")</code>, a sparse matrix
# <code>coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(N, N))</code>, <code>connected_components(matrix, directed=False)[1]</code>,
# <code>np.bincount(label)[label]</code>. Mind the unit of the reach: four <i>metres</i> would ask for all pairs of points, 130 million.</details>


# %% tags=["task"]
def clean(points):
    """Which points to keep (N,)."""
    # BEGIN SOLUTION
    x, y, z = points.T
    at = 110 * np.column_stack([x / z, y / z, np.log(z)])
    pairs = cKDTree(at).query_pairs(4, output_type="ndarray")
    link = np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])
    graph = coo_array(link, shape=(len(at), len(at)))
    label = connected_components(graph, directed=False)[1]
    return np.bincount(label)[label] >= 300
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
        "The threshold comes from the cloud itself: with the tail cut, the "
        "deviation shrinks and the threshold moves in. And each pass measures "
        "anew: whoever lost a neighbour has farther to go to the next, so "
        "holes and borders grow. Instead fix one threshold in metres, or "
        "multiples of the median, and run once."
    )
    # END SOLUTION


# %% tags=["check"]
check("05-6", explain)

# %% [markdown]
# ## Handing in
#
# Restart the kernel, run all cells, save, and hand in this one file. Unfinished tasks cost only their own points.
