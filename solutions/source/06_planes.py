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
# Six tasks, about 60 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check says by how much you are
# off. Try again and it says what the mistake looks like, then where to read.
#
# Everything you need stands in [lesson 06](../notebooks/06_planes.ipynb). You may use NumPy; write the formulas yourself. Points are `(N, 3)` arrays in metres. A
# plane is four numbers in one array, `[n_x, n_y, n_z, d]`, and holds the points with n · x + d = 0. `[-n_x, -n_y, -n_z, -d]` is the
# same plane: return either.

# %%
from course_lib.notebook import check, data, picture, report_table, show

import matplotlib.pyplot as plt
import numpy as np

# %% [markdown]
# ## Task 1 — how often to try (1 point)
#
# RANSAC draws samples until one of them most likely held inliers only. How many? One line is missing.
#
# - `inlier_share`: the share of inliers among the points, between 0 and 1
# - `sample`: how many points a sample has; three for a plane
# - `confidence`: how likely it shall be that at least one sample holds inliers only, between 0 and 1
# - returns: the smallest whole number of samples
#
# For example, `tries_needed(0.6, 3, 0.99)` is 19.
#
# <details><summary>Hint 1: idea</summary>How likely is it that one sample is good? That it is bad? That all of them are bad?</details>
# <details><summary>Hint 2: formula</summary>All n are bad with probability (1 − w to the power of the sample) to the power n. Set this
# to 1 − confidence, take logarithms, solve for n, and round up with <code>np.ceil</code>.</details>

# %% tags=["expected", "hide-input"]
w = np.linspace(0.2, 0.95, 100)
fig, axis = plt.subplots(figsize=(6, 2.8), layout="constrained")
for size, colour in [(2, "target"), (3, "ours"), (4, "source")]:
    n = [next(n for n in range(1, 9999) if (1 - share**size) ** n <= 0.01) for share in w]
    axis.plot(w, n, color=show.COLOURS[colour], label=f"{size} points a sample")
axis.plot([0.6], [19], "o", color=show.COLOURS["outlier"])
axis.annotate("19", (0.6, 19), (0.4, 5), arrowprops={"arrowstyle": "-"})
axis.set(xlabel="share of inliers", ylabel="samples", yscale="log", title="Expected, for a confidence of 0.99")
axis.legend(fontsize=9)
picture(fig, alt=f"The number of samples on a logarithmic scale falls with the share of inliers: for four points a sample from {n[0]:,} "
                 "at a share of 0.2 to a few at 0.95. Fewer points need fewer samples; a dot marks 19 at 0.6 for three points.")


# %% tags=["task"]
def tries_needed(inlier_share, sample, confidence):
    """Samples until one holds inliers only, with this confidence."""
    # BEGIN SOLUTION
    # solve (1 - w^s)^n = 1 - p for n, and round up
    return int(np.ceil(np.log(1 - confidence) / np.log(1 - inlier_share**sample)))
    # END SOLUTION


# %% tags=["check"]
check("06-1", tries_needed)

# %% [markdown]
# ## Task 2 — fit a plane (3 points)
#
# Find the plane with the smallest sum of squared distances to all points, measured at right angles to it.
#
# - `points`: (N, 3) float, metres, N ≥ 3, not on one line
# - returns: (4,) float, `[n_x, n_y, n_z, d]`, n of length 1, either sign
#
# For example, points that all have z = 2 give `[0, 0, 1, -2]` or `[0, 0, -1, 2]`.
#
# <details><summary>Hint 1: idea</summary>The plane goes through the mean of the points. Its normal is the direction in which they
# spread least.</details>
# <details><summary>Hint 2: formula</summary>S = Σ (x − mean)(x − mean)ᵀ; n is its eigenvector of the smallest eigenvalue; d = −n · mean</details>
# <details><summary>Hint 3: call</summary><code>values, vectors = np.linalg.eigh(S)</code> sorts the eigenvalues from small to large, and the
# eigenvectors are columns; <code>np.append(n, d)</code></details>

# %% tags=["expected", "hide-input"]
rng = np.random.default_rng(6)
u, v, e = rng.uniform(-0.5, 0.5, 400), rng.uniform(-0.3, 0.3, 400), rng.normal(0, 0.02, 400)
x, z = u * np.cos(0.9) - e * np.sin(0.9), 2 + u * np.sin(0.9) + e * np.cos(0.9)
fig, axis = plt.subplots(figsize=(6, 3), layout="constrained")
axis.plot(x, z, ".", ms=3, color=show.COLOURS["reference"], label="points, from the side")
along = np.array([-0.6, 0.6])
axis.plot(along * np.cos(0.9), 2 + along * np.sin(0.9), color=show.COLOURS["ours"], lw=2, label="expected plane")
axis.annotate("", (-0.25 * np.sin(0.9), 2 + 0.25 * np.cos(0.9)), (0, 2), arrowprops={"arrowstyle": "->"})
axis.annotate("n", (-0.25 * np.sin(0.9), 2 + 0.27 * np.cos(0.9)))
axis.set(xlabel="x (m)", ylabel="z (m)", aspect="equal")
axis.legend(fontsize=9, loc="upper left", bbox_to_anchor=(1, 1))
picture(fig, alt=f"A band of points from the side, tilted by {np.degrees(0.9):.0f} degrees; the expected plane runs along its middle, "
                 "and the normal stands on it at a right angle.")


# %% tags=["task"]
def fit_plane(points):
    """The plane (4,) of least squared distances to points (N, 3)."""
    # BEGIN SOLUTION
    # the plane goes through the mean
    middle = points.mean(axis=0)
    # the scatter about the mean
    scatter = (points - middle).T @ (points - middle)
    # the direction in which the points spread least
    values, vectors = np.linalg.eigh(scatter)
    normal = vectors[:, 0]
    # n · mean + d = 0
    return np.append(normal, -normal @ middle)
    # END SOLUTION


# %% tags=["check"]
check("06-2", fit_plane)

# %% [markdown]
# ## Task 3 — mend heights above a real floor (3 points)
#
# Somebody found the floor of real RealSense frames, and wrote this to say how high each point stands above it. The plane comes from another
# program: its normal has any length, and may point up or down. There are three mistakes in the code. Mend them all. (For the middle
# picture, the floor's plane was written with a normal of length 3 that points up: the same plane, other numbers.)
#
# - `points`: (N, 3) float, metres, camera frame; the camera is at the origin, above the floor, and may look any way
# - `plane`: (4,) float, the floor
# - returns: (N,) float, metres: heights above the floor, negative for what lies below it
#
# For example, with the plane `[0, 2, 0, -4]` the point `[1, 1.5, 3]` stands 0.5 m above the floor. (The camera's y points down.)
#
# <details><summary>Hint 1: idea</summary>Put the example through the code by hand. Then put the camera itself, (0, 0, 0), through it.</details>
# <details><summary>Hint 2: formula</summary>The signed distance of x is (n · x + d) / ‖n‖. At the camera it is d / ‖n‖, and there it must be
# positive.</details>
# <details><summary>Hint 3: call</summary><code>np.linalg.norm(normal)</code>, <code>np.sign(d)</code></details>

# %% tags=["expected", "hide-input", "real-data"]
# real data: realsense_planes
frame = data.load("realsense_planes").frames[2]
camera = frame.camera
rows, columns = np.indices(frame.depth.shape)
lifted = np.stack([(columns - camera.cx) / camera.fx * frame.depth, (rows - camera.cy) / camera.fy * frame.depth, frame.depth], axis=-1)
floor = np.array([-0.0491, 0.9897, 0.1348, -0.1616])  # found by RANSAC; its normal points down
expected = np.where(frame.depth > 0, -(lifted @ floor[:3] + floor[3]), np.nan)
given = np.where(frame.depth > 0, np.abs(3 * (lifted @ floor[:3]) - 3 * floor[3]), np.nan)
show.images({"frame": frame.color, "given": given, "expected": expected}, unit="m", limits=(-0.05, 1.0), columns=3,
            alt="A box on a floor. Given: even the floor has "
                "a height of most of a metre. Expected: the floor is at 0, and the box rises from it.")


# %% tags=["task"]
def heights_above_floor(points, plane):
    """Heights (N,) in metres of points (N, 3) above the floor; the camera, at the origin, is above it."""
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
rng = np.random.default_rng(60)
turn = np.radians(82)
to_view = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]])
board = np.column_stack([rng.uniform(-0.5, 0.5, 300), rng.uniform(-0.42, 0.42, 300), rng.normal(0, 0.04, 300)])
second = np.column_stack([rng.uniform(0.05, 0.5, 130), rng.uniform(-0.42, 0.42, 130), 0.22 + rng.normal(0, 0.04, 130)])
heap = np.column_stack([rng.uniform(-0.5, -0.2, 120), rng.uniform(-0.42, 0.42, 120), rng.uniform(-0.5, -0.15, 120)])
own, near, all_ = (np.vstack(parts) @ to_view.T + [0.9, 0, 1.4] for parts in ([board], [board, second], [board, second, heap]))


def smallest(points, which=0):
    middle = points.mean(axis=0)
    normal = np.linalg.eigh((points - middle).T @ (points - middle))[1][:, which]
    return np.append(normal, -normal @ middle)


truth = np.append(to_view[:, 2], -to_view[:, 2] @ [0.9, 0, 1.4])
slope = np.linalg.lstsq(np.column_stack([own[:, :2], np.ones(len(own))]), own[:, 2], rcond=None)[0]
makers = [
    (np.append(np.linalg.eigh(own.T @ own)[1][:, 0], 0), len(own)),
    (smallest(own, 2), len(own)),
    (smallest(all_), len(all_)),
    (np.array([-slope[0], -slope[1], 1, -slope[2]]) / np.sqrt(slope[0] ** 2 + slope[1] ** 2 + 1), len(own)),
    (smallest(own) * [1, 1, 1, -1], len(own)),
    (smallest(near), len(near)),
]
order = np.random.default_rng(591).permutation(6)
found = {letter: makers[i] for letter, i in zip("ABCDEF", order, strict=True)}
fig, axes = plt.subplots(2, 3, figsize=(8, 7), sharex=True, sharey=True, layout="constrained")
for axis, (letter, (plane, _)) in zip(axes.ravel(), found.items(), strict=True):
    for name, (start, end), colour in [("first board", (0, len(own)), "reference"), ("second board", (len(own), len(near)), "ours"),
                                       ("heap", (len(near), len(all_)), "surface")]:
        axis.plot(all_[start:end, 0], all_[start:end, 2], ".", ms=3, color=show.COLOURS[colour], label=name)
    for which, style in [(truth, {"color": "black", "lw": 1, "label": "true plane"}),
                         (plane, {"color": show.COLOURS["outlier"], "lw": 2, "label": "found plane"})]:
        base = -which[3] * which[:3][[0, 2]] / (which[0] ** 2 + which[2] ** 2)
        way = np.array([-which[2], which[0]]) / np.hypot(which[0], which[2])
        axis.plot(*(base[:, None] + np.outer(way, [-4, 4])), **style)
    axis.plot([0], [0], "^", color="black", ms=8, ls="none", label="camera")
    axis.set(title=letter, aspect="equal", xlim=(-1.4, 1.6), ylim=(-1.2, 2.4))
fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize=9)
for axis in axes[1]:
    axis.set_xlabel("x (m)")
for axis in axes[:, 0]:
    axis.set_ylabel("z (m)")
picture(fig, alt="Six views from above: points of two boards and a heap, a colour for each, the camera as a triangle at the origin, the "
                 "true plane in black, a found one in vermilion. " + " ".join(
    f"{letter}: turned by {np.degrees(np.arccos(min(1, abs(plane[:3] @ truth[:3])))):.0f} degrees, {abs(plane[3]):.2f} m from the camera."
    for letter, (plane, _) in found.items()))

# %% tags=["expected", "hide-input"]
middle = own.mean(axis=0)
report_table([[letter, used, float(np.degrees(np.arccos(min(1, abs(plane[:3] @ truth[:3]))))), float(abs(plane[:3] @ middle + plane[3])),
               float(abs(plane[3]))] for letter, (plane, used) in found.items()],
             columns=["plane", "points used", "normal off by (degrees)", "distance from the board's middle (m)", "from the camera (m)"],
             digits=2, smallest=0.01)


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
# ## Task 5 — find a plane that few points belong to (4 points, open-ended)
#
# Two points in ten lie on one plane, about a metre and a half wide, with 5 mm of noise. The others belong to a shelf in front of it and to things in
# between. Find the plane.
#
# - `points`: (N, 3) float, metres
# - `threshold`: 0.015 m, three times the noise
# - returns: (4,) float, `[n_x, n_y, n_z, d]`, n of length 1, either sign
#
# You are scored by the largest distance between your plane and the true one over the rim of the true patch, as the median over
# five clouds: under 50 mm earns 1 point, under 15 mm 2, under 5 mm 3, under 2 mm all 4. Seed your random numbers, so that the same cloud gives the same plane.
#
# <details><summary>Hint 1: idea</summary>Find out who belongs by a vote; then let all of these decide where the plane is.</details>
# <details><summary>Hint 2: formula</summary>With 0.2 for w, how many tries does task 1 give? A plane through three noisy points leans: fit to its inliers,
# collect the inliers again, fit again.</details>
# <details><summary>Hint 3: call</summary><code>rng = np.random.default_rng(0)</code>, <code>rng.choice(len(points), 3, replace=False)</code>,
# <code>np.cross</code>, <code>np.linalg.norm</code>, <code>np.linalg.eigh</code></details>


# %% tags=["task"]
def find_plane(points, threshold):
    """The plane (4,) that most points agree with."""
    # BEGIN SOLUTION
    rng = np.random.default_rng(0)
    a, b, c = points[[rng.choice(len(points), 3, replace=False) for _ in range(800)]].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    best = np.zeros(len(points), bool)
    for normal, offset in zip(normals, np.sum(normals * a, axis=1), strict=True):
        inliers = np.abs(points @ normal - offset) <= threshold
        if inliers.sum() > best.sum():
            best = inliers
    for _ in range(4):
        middle = points[best].mean(axis=0)
        normal = np.linalg.eigh((points[best] - middle).T @ (points[best] - middle))[1][:, 0]
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
# <details><summary>Hint 2: formula</summary>"Break it" in lesson 06 has both halves of the answer.</details>


# %% tags=["task"]
def explain():
    """Your explanation, at most 60 words."""
    # BEGIN SOLUTION
    return (
        "A wider threshold also admits points of the posters, which lie a little in front of the wall. The plane then "
        "leans between both and gains inliers for it. Look at the distances of the inliers from the plane: their RMS is "
        "clearly more than the noise, and their histogram fills the whole band, with two humps."
    )
    # END SOLUTION


# %% tags=["check"]
check("06-6", explain)

# %% [markdown]
# ## Handing in
#
# Restart the kernel, run all cells, save, and hand in this one file. Unfinished tasks cost only their own points.
