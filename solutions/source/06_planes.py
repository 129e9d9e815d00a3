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
# # Lab 06 Planes, and what stands out from them
#
# Six tasks, about 56 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check says by how much you are
# off. Try again and it says what the mistake looks like, then where to read.
#
# Everything you need stands in [lesson 06](../notebooks/06_planes.ipynb), but its code is nowhere the answer as it stands: each task says what is different. You may use NumPy; write the
# formulas yourself. Points are `(N, 3)` arrays in metres. A plane is four numbers in one array, `[n_x, n_y, n_z, d]`, and holds the points
# with n · x + d = 0. `[-n_x, -n_y, -n_z, -d]` is the same plane: return either.

# %%
from course_lib.notebook import check, data, picture, report_table, show

import matplotlib.pyplot as plt
import numpy as np

# %% tags=["hide-input"]
kept = data.of_lab("06")  # what the pictures below are drawn from

# %% [markdown]
# ## Task 1 — how often to try among several planes (1 point)
#
# A room has several planes, and a sample is good if all its points lie on *one* of them, whichever. How many samples until one most
# likely is good? One line is missing.
#
# - `shares`: (K,) float, the share of the points that lies on each plane, together below 1; a point lies on one plane or on none
# - `sample`: how many points a sample has; three for a plane
# - `confidence`: how likely it shall be that at least one sample is good, between 0 and 1
# - returns: the smallest whole number of samples
#
# For example, `tries_needed(np.array([0.6]), 3, 0.99)` is 19, and `tries_needed(np.array([0.4, 0.3]), 3, 0.99)` is 49.
#
# <details><summary>Hint 1: idea</summary>How likely are all points of a sample on the first plane? How likely on the first or on the
# second? Both cannot happen at once.</details>
# <details><summary>Hint 2: formula</summary>One sample is good with g, the sum over the planes of w to the power of the sample. All n are bad with
# probability (1 − g) to the power n. Set this to 1 − confidence, take logarithms, solve for n, and round up with
# <code>np.ceil</code>.</details>

# %% tags=["expected", "hide-input"]
together = 100 * kept["tries_share"]
fig, axis = plt.subplots(figsize=(6, 2.8), layout="constrained")
for needed, name, style in zip(
    kept["tries_needed"],
    ["on one plane", "half on each of two", "a third on each of three"],
    ["-", "--", ":"],
    strict=True,
):
    axis.plot(together, needed, style, color="black", label=name)
axis.plot([60], [19], "o", color=show.COLOURS["outlier"])
axis.annotate("19", (60, 19), (50, 6), arrowprops={"arrowstyle": "-"})
axis.set(
    xlabel="points on any plane (%)", ylabel="samples", yscale="log",
    title="Expected for three points a sample, 0.99",
)
axis.legend(fontsize=9)
last = [int(needed[-1]) for needed in kept["tries_needed"]]
picture(
    fig,
    alt="The number of samples on a logarithmic scale falls with the share of "
    "points that lie on any plane. The more planes they are divided among, the "
    f"more samples it takes: {last[0]}, {last[1]} and {last[2]} at 95 % for "
    "one, two and three planes. A dot marks 19 at 60 % for one.",
)


# %% tags=["task"]
def tries_needed(shares, sample, confidence):
    """Samples until one lies on one of the planes, with this confidence."""
    # BEGIN SOLUTION
    # add up the chances of the planes, solve (1 - g)^n = 1 - p, and round up
    good = np.sum(shares**sample)
    return int(np.ceil(np.log(1 - confidence) / np.log(1 - good)))
    # END SOLUTION


# %% tags=["check"]
check("06-1", tries_needed)

# %% [markdown]
# ## Task 2 — fit a plane to points of unequal noise (3 points)
#
# A depth camera's noise grows with distance, and shiny things are worse: every point comes with its own noise, sigma. In the lesson's fit every
# point has the same say. Find the plane with the smallest sum of (distance / sigma)², distances measured at right angles to it.
#
# - `points`: (N, 3) float, metres, N ≥ 3, not on one line
# - `sigma`: (N,) float, metres, above 0: the standard deviation of each point
# - returns: (4,) float, `[n_x, n_y, n_z, d]`, n of length 1, either sign
#
# For example, a wall read twice, at z = 2.0 with a sigma of 0.01 and at z = 2.1 with 0.02, gives `[0, 0, 1, -2.02]` or `[0, 0, -1, 2.02]`: the
# first reading weighs four times as much.
#
# <details><summary>Hint 1: idea</summary>Which weight has the square of a distance in that sum? A point of weight 4 counts as four points would:
# in the mean, and in the scatter.</details>
# <details><summary>Hint 2: formula</summary>w = 1 / sigma²; mean = Σ w x / Σ w; S = Σ w (x − mean)(x − mean)ᵀ; n is its eigenvector of the smallest
# eigenvalue; d = −n · mean</details>
# <details><summary>Hint 3: call</summary><code>w[:, None] * points</code> weighs rows; <code>values, vectors = np.linalg.eigh(S)</code> sorts the
# eigenvalues from small to large, and the eigenvectors are columns; <code>np.append(n, d)</code></details>

# %% tags=["expected", "hide-input"]
rng = np.random.default_rng(6)
u, e = rng.uniform(-0.5, 0.5, 300), rng.normal(0, 1, 300)
shiny = u > 0.15
e = np.where(shiny, 0.09 * e + 0.05, 0.012 * e)
x, z = u * np.cos(0.6) - e * np.sin(0.6), 2 + u * np.sin(0.6) + e * np.cos(0.6)
fig, axis = plt.subplots(figsize=(6, 3), layout="constrained")
for part, name, colour in [
    (~shiny, "points of small sigma", "reference"),
    (shiny, "points of large sigma", "surface"),
]:
    axis.plot(x[part], z[part], ".", ms=3, color=show.COLOURS[colour],
              label=name)
ends = np.array([-0.6, 0.6])
axis.plot(
    ends * np.cos(0.6), 2 + ends * np.sin(0.6), color=show.COLOURS["ours"],
    lw=2, label="expected plane",
)
axis.set(xlabel="x (m)", ylabel="z (m)", aspect="equal")
axis.legend(fontsize=9, loc="upper left", bbox_to_anchor=(1, 1))
picture(
    fig,
    alt=f"A tilted board from the side: {(~shiny).sum()} points in a thin "
    f"band, and {shiny.sum()} at one end scattered widely, most of them above "
    "it. The expected plane runs along the middle of the thin band.",
)


# %% tags=["task"]
def fit_plane(points, sigma):
    """The plane (4,) of least squared distances in units of sigma."""
    # BEGIN SOLUTION
    # the weight of each point
    w = 1 / sigma[:, None] ** 2
    # the plane goes through the weighted mean
    middle = (w * points).sum(axis=0) / w.sum()
    # the weighted scatter about it
    scatter = (w * (points - middle)).T @ (points - middle)
    # the direction in which the points spread least
    normal = np.linalg.eigh(scatter)[1][:, 0]
    # n · mean + d = 0
    return np.append(normal, -normal @ middle)
    # END SOLUTION


# %% tags=["check"]
check("06-2", fit_plane)

# %% [markdown]
# ## Task 3 — mend heights above a real floor (3 points)
#
# Somebody found the floor of real RealSense frames, and wrote this to say how high each point stands above it. Unlike in the lesson, the points
# are in the camera's frame, and the plane comes from another program: its normal has any length, and may point up or down. There are three
# mistakes in the code. Mend them all. (For the middle picture, the floor's plane was written with a normal of length 3 that points up.)
#
# - `points`: (N, 3) float, metres, camera frame; the camera is at the origin, above the floor, and may look any way
# - `plane`: (4,) float, the floor
# - returns: (N,) float, metres: heights above the floor, negative for what lies below it
#
# For example, with the plane `[0, 2, 0, -4]` the point `[1, 1.5, 3]` stands 0.5 m above the floor, 0.5, and `[1, 2.5, 3]` lies 0.5 m below it, -0.5. (The camera's y points down.)
#
# <details><summary>Hint 1: idea</summary>Put the example through the code by hand. Then put the camera itself, (0, 0, 0), through it.</details>
# <details><summary>Hint 2: formula</summary>The signed distance of x is (n · x + d) / ‖n‖. At the camera it is d / ‖n‖, and there it must be
# positive.</details>
# <details><summary>Hint 3: call</summary><code>np.linalg.norm(normal)</code>, <code>np.sign(d)</code></details>

# %% tags=["expected", "hide-input"]
in_metres = {}
for name in ("given", "expected"):
    stored = kept[f"heights_{name}"]  # whole millimetres
    in_metres[name] = np.where(stored > -30_000, stored, np.nan) / 1000
show.images(
    {"frame": kept["heights_color"], **in_metres},
    unit="m", limits=(-0.05, 1.0), columns=3,
    alt="A box on a floor. Given: even the floor has a height of most of a "
    "metre. Expected: the floor is at 0, and the box rises from it.",
)


# %% tags=["task"]
def heights_above_floor(points, plane):
    """Heights (N,) in metres of points (N, 3) above the floor."""
    # BEGIN SOLUTION
    # three mistakes: try the example, then the camera at (0, 0, 0)
    normal, d = plane[:3], plane[3]
    height = (points @ normal + d) / np.linalg.norm(normal)
    return height * np.sign(d)
    # INSTEAD
    #| normal, d = plane[:3], plane[3]
    #| height = points @ normal - d
    #| return np.abs(height)
    # END SOLUTION


# %% tags=["check"]
check("06-3", heights_above_floor)

# %% [markdown]
# ## Task 4 — which mistake made this (2 points)
#
# A board stands before the camera, almost edge on; beside it a second, smaller one, and a heap of other things. The black line is where
# the plane of the first board is, from above. Six programs found the vermilion planes, each with one mistake. Give each letter its cause, each
# cause once:
#
# `"mean not subtracted"`, `"largest eigenvector"`, `"outliers in the fit"`, `"least squares in z"`, `"offset with the wrong sign"`, `"threshold too large"`
#
# Four of them fitted the board's own points only; the table says how many points each used.
#
# <details><summary>Hint 1: idea</summary>Ask of each: which points did it use? Does it pass through the middle of the board? Does it pass through
# the camera?</details>
# <details><summary>Hint 2: formula</summary>Without the mean, n · x = 0: that plane holds the origin. With the wrong sign of d, it is the right plane
# mirrored at the origin. Least squares in z leans from steep towards flat.</details>
# <details><summary>Hint 3: call</summary>Return <code>{"A": "…", "B": "…", …}</code> with the letters A to F.</details>

# %% tags=["expected", "hide-input"]
fig, axes = plt.subplots(
    2, 3, figsize=(8, 7), sharex=True, sharey=True, layout="constrained"
)
lines = kept["causes_found"]
for axis, letter, line in zip(axes.ravel(), "ABCDEF", lines, strict=True):
    for part, name, colour in [
        ("first", "first board", "reference"),
        ("second", "second board", "source"),
        ("heap", "heap", "surface"),
    ]:
        axis.plot(
            *kept[f"causes_{part}"].T, ".", ms=3, color=show.COLOURS[colour],
            label=name,
        )
    axis.plot(*kept["causes_true"].T, color="black", lw=1, label="true plane")
    axis.plot(*line.T, color=show.COLOURS["outlier"], lw=2, label="found plane")
    axis.plot([0], [0], "^", color="black", ms=8, ls="none", label="camera")
    axis.set(title=letter, aspect="equal", xlim=(-1.4, 1.6), ylim=(-1.2, 2.4))
handles = axes[0, 0].get_legend_handles_labels()
fig.legend(*handles, loc="outside lower center", ncols=6, fontsize=9)
for axis in axes[1]:
    axis.set_xlabel("x (m)")
for axis in axes[:, 0]:
    axis.set_ylabel("z (m)")
rows = [
    [letter, int(used), *map(float, numbers)]
    for letter, (used, *numbers) in zip(
        "ABCDEF", kept["causes_table"], strict=True
    )
]
picture(
    fig,
    alt="Six views from above: points of two boards and a heap, a colour for "
    "each, the camera as a triangle at the origin, the true plane in black, a "
    "found one in vermilion. "
    + " ".join(
        f"{letter}: turned by {turned:.0f} degrees, "
        f"{camera:.2f} m from the camera."
        for letter, _, turned, _, camera in rows
    ),
)

# %% tags=["expected", "hide-input"]
report_table(
    rows,
    columns=[
        "plane", "points used", "normal off by (degrees)",
        "distance from the board's middle (m)", "from the camera (m)",
    ],
    digits=2, smallest=0.01,
)


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "F" to the names of their causes."""
    # BEGIN SOLUTION
    return {
        "A": "outliers in the fit",
        "B": "offset with the wrong sign",
        "C": "least squares in z",
        "D": "mean not subtracted",
        "E": "threshold too large",
        "F": "largest eigenvector",
    }
    # END SOLUTION


# %% tags=["check"]
check("06-4", causes)

# %% [markdown]
# ## Task 5 — find the floor of a furnished room (4 points, open-ended)
#
# A robot's camera sees a furnished room. Walls, a table, a couch, a cupboard, in some rooms a shelf have more points than the floor each. The floor is
# the *lowest level* plane on which at least one point in ten lies. Still lower is what the shiny floor reflects: single points, and a
# stool's seat, small and level. Find the floor.
#
# - `points`: (N, 3) float, metres, camera frame: the camera may look any way
# - `up`: (3,) float, of length 1: where up is, by the camera's accelerometer; off by up to 5 degrees
# - `threshold`: 0.015 m, three times the noise
# - returns: (4,) float, `[n_x, n_y, n_z, d]`, n of length 1, either sign
#
# You are scored by the largest distance between your plane and the true floor over its rim: under 60 mm earns 1 point, under 25 mm 2, under
# 10 mm 3, under 5 mm all 4. What counts is the **worst of seven** fresh rooms; the check shows three. Seed your random numbers, so that the same
# cloud gives the same plane. Task 1 says how many samples: what the formula of section 3 asks for a tenth alone is several times as many, and only slow.
#
# <details><summary>Hint 1: idea</summary>Section 4 in another frame. How many planes there are, the room must tell: take them away one after the
# other, until the next has too few points. Of the level ones, the lowest.</details>
# <details><summary>Hint 2: formula</summary>A plane is level if |n · up| exceeds the cosine of some 12 degrees; heights are <code>points @ up</code>. At
# first six planes hold a tenth of the points each, and a sample on any will do: how many samples does task 1 give? Seven rooms with seven
# searches each shall all succeed: ask for 0.9999. A plane through three noisy points leans: fit to its inliers, collect them again, fit again.</details>
# <details><summary>Hint 3: call</summary><code>rng = np.random.default_rng(0)</code>; <code>corners = points[rng.integers(len(points), size=(tries, 3))]</code>
# draws all samples at once; <code>np.cross</code>, <code>np.linalg.norm</code>, <code>np.median</code>, <code>np.linalg.eigh</code></details>

# %% tags=["expected", "hide-input"]
fig, axis = plt.subplots(figsize=(7, 3.6), layout="constrained")
for part, name, colour in [
    ("others", "other points", "surface"),
    ("floor", "near the floor", "reference"),
]:
    axis.plot(*kept[f"room_{part}"].T, ".", ms=2, label=name,
              color=show.COLOURS[colour])
axis.plot([-1.3, 1.3], [0, 0], color=show.COLOURS["ours"], lw=1.5,
          label="expected plane")
axis.plot(*kept["room_square_to_up"].T, "--", color="black", lw=1,
          label="square to the given up")
axis.set(xlabel="along the floor (m)", ylabel="height (m)", aspect="equal",
         xlim=(-1.6, 1.6))
axis.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1, 1), markerscale=4)
few, many = len(kept["room_floor"]), len(kept["room_others"])
picture(
    fig,
    alt=f"A room from the side. {few} points lie along the floor, where the "
    f"expected plane is; {many:,} others above it, most of them on a table's "
    "top and on walls; below it a small level patch and single ones. A dashed "
    "line square to the given up leaves the floor at its ends.",
)


# %% tags=["task"]
def find_plane(points, up, threshold):
    """The floor (4,): the lowest level plane with points enough."""
    # BEGIN SOLUTION
    rng = np.random.default_rng(0)
    tries = 20_000  # one in 1,000 lies on the floor; some are sharp
    corners = points[rng.integers(len(points), size=(tries, 3))]
    a, b, c = corners.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)  # 0 where a point came twice
    ok = lengths > 0
    a, normals = a[ok], normals[ok] / lengths[ok, None]
    level = np.abs(normals @ up) > np.cos(np.radians(12))
    lowest, best = np.inf, None
    for corner, normal in zip(a[level], normals[level], strict=True):
        inliers = np.abs((points - corner) @ normal) <= threshold
        if inliers.sum() >= 0.06 * len(points):
            height = np.median(points[inliers] @ up)
            if height < lowest:
                lowest, best = height, inliers
    for _ in range(5):
        middle = points[best].mean(axis=0)
        off = points[best] - middle
        normal = np.linalg.eigh(off.T @ off)[1][:, 0]
        best = np.abs((points - middle) @ normal) <= threshold
    return np.append(normal, -normal @ middle)
    # END SOLUTION


# %% tags=["check"]
check("06-5", find_plane)

# %% [markdown]
# ## Task 6 — explain the better fit (2 points, marked by hand)
#
# A colleague looks for a wall on which posters hang. They double the threshold, from 4 to 8 mm, and RANSAC finds half as many inliers again. "So 8 mm is
# the better fit", they say. In at most 60 words: why may it be the worse one, and what would you look at to find out?
#
# <details><summary>Hint 1: idea</summary>Whose points are the new inliers?</details>
# <details><summary>Hint 2: formula</summary>How large is the RMS of the inliers of one surface, how large that of a band filled evenly by
# two? "Break it" in lesson 06 compares both with the noise.</details>


# %% tags=["task"]
def explain():
    """Your explanation, at most 60 words."""
    # BEGIN SOLUTION
    return (
        "A wider threshold also admits points of the posters, which lie a "
        "little in front of the wall. The plane then leans between both and "
        "gains inliers for it. Look at the distances of the inliers from the "
        "plane: their RMS is clearly more than the noise, and their histogram "
        "fills the whole band, with two humps."
    )
    # END SOLUTION


# %% tags=["check"]
check("06-6", explain)

# %% [markdown]
# ## Handing in
#
# Restart the kernel, run all cells, save, and hand in this one file. Unfinished tasks cost only their own points.
