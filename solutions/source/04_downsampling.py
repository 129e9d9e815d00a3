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
# # Lab 04 Downsampling and normals
#
# Six tasks, about 47 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check says by how much you are
# off. Try again and it says what the mistake looks like, then where to read.
#
# Everything you need stands in [lesson 04](../notebooks/04_downsampling.ipynb). You may use NumPy. Clouds are `(N, 3)` arrays in metres.

# %%
from course_lib.notebook import check, data, picture, report, report_table, show

import matplotlib.pyplot as plt
import numpy as np

drawn = data.of_lab("04")  # what the pictures below are drawn from

# %% [markdown]
# ## Task 1 — the cube of a point (1 point)
#
# A voxel grid gives every point the number of the cube that it lies in, counted from the origin of the grid along x, y and z.
# One line is missing.
#
# - `points`: (N, 3) float, metres
# - `voxel`: the edge of a cube, metres
# - `origin`: (3,) float, metres; the lower corner of the cube numbered 0, 0, 0
# - returns: (N, 3) whole numbers; those on the other side of the origin are negative
#
# For example, with voxel 0.5 and origin 0, a point at x = 0.9 has number 1 and a point at x = −0.1 has number −1.
#
# <details><summary>Hint 1: idea</summary>How many whole voxels lie between the origin and the point? Which way must you round for
# a point just below the origin?</details>
# <details><summary>Hint 2: formula</summary>the floor of (point − origin) / voxel; <code>np.floor</code>, then
# <code>.astype(int)</code></details>

# %% tags=["expected", "hide-input"]
x = np.array([-0.9, -0.3, -0.1, 0.2, 0.4, 0.6, 0.9])
fig, axis = plt.subplots(figsize=(7, 1.8), layout="constrained")
axis.vlines(np.arange(-2, 3) / 2, -0.5, 0.6, color="0.75", lw=1.5)
axis.plot(x, 0 * x, "o", color=show.COLOURS["target"])
for start in (-2, -1, 0, 1):
    axis.text(start / 2 + 0.25, 0.35, f"number {start}".replace("-",
            "\N{MINUS SIGN}"), ha="center", fontsize=10)
axis.set(xlabel="x (m), voxel 0.5, origin 0", yticks=[], ylim=(-0.5, 0.6),
         title="Expected")
numbers = ", ".join(f"{one:g} has number {np.floor(one / 0.5):g}" for one in x)
picture(fig, alt=f"{len(x)} points on a line, cut every half metre: {numbers}.")


# %% tags=["task"]
def voxel_index(points, voxel, origin):
    """Numbers (N, 3) of the cubes that points (N, 3) lie in."""
    # BEGIN SOLUTION
    # whole voxels from the origin, rounded down on both of its sides
    return np.floor((points - origin) / voxel).astype(int)
    # END SOLUTION


# %% tags=["check"]
check("04-1", voxel_index)

# %% [markdown]
# ## Task 2 — a voxel grid (3 points)
#
# Keep one point a cube: the mean of the points in it. A stray point alone in its cube would count as much as a full cube, so leave out
# cubes that hold fewer than `least` points.
#
# - `points`: (N, 3) float, metres
# - `voxel`: the edge of a cube, metres
# - `origin`: (3,) float, metres; the lower corner of the cube numbered 0, 0, 0
# - `least`: a whole number; how many points a cube must hold to be kept
# - returns: (M, 3) float, metres; one point for each cube that holds at least `least` points, in any order
#
# <details><summary>Hint 1: idea</summary>First the number of each point's cube, as in task 1. Then points with the same three
# numbers belong together.</details>
# <details><summary>Hint 2: formula</summary>centroid = sum of the points of a cube / how many there are; keep it if there are
# <code>least</code> or more</details>
# <details><summary>Hint 3: call</summary><code>np.unique(index, axis=0, return_inverse=True, return_counts=True)</code> returns the cubes, for
# each point which of them it lies in (flatten it with <code>.ravel()</code>), and how many points each cube holds;
# <code>points[which == k].mean(axis=0)</code> is the centroid of cube k.</details>

# %% tags=["expected", "hide-input"]
flat, kept, held = drawn["above"], drawn["kept"], drawn["count"]
fig, axis = plt.subplots(figsize=(5.4, 4.2), layout="constrained")
for line in np.arange(-2, 3) / 2:
    axis.axhline(line, color="0.75", lw=1)
    axis.axvline(line, color="0.75", lw=1)
axis.plot(*flat.T, ".", color=show.COLOURS["reference"], label="given")
axis.plot(*kept.T, "o", color=show.COLOURS["target"], label="kept")
for (x, y), many in zip(drawn["corners"], held, strict=True):
    axis.text(x + 0.03, y + 0.03, str(many), fontsize=9, color="0.3")
axis.set(aspect="equal", xlabel="x (m)", ylabel="y (m)",
         title="Expected from above, least = 8")
axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1), fontsize=9)
picture(fig, alt=f"{len(flat)} points in a square of {len(held)} cubes seen "
        "from above, each cube with the number of its points, from "
        f"{held.min()} to {held.max()}. The {len(kept)} cubes with at "
        "least 8 keep one point each, not in the middle of the cube but "
        "at the mean of the points in it.")


# %% tags=["task"]
def voxel_centroids(points, voxel, origin, least):
    """Centroids (M, 3), in metres, of the cubes that hold enough points."""
    # BEGIN SOLUTION
    # the number of each point's cube
    index = np.floor((points - origin) / voxel)
    # which cubes occur, in which of them each point lies, how many each holds
    cubes, which, count = np.unique(index, axis=0, return_inverse=True,
                                    return_counts=True)
    which = which.ravel()
    # the mean of the points of each cube that holds enough of them
    return np.array([points[which == k].mean(axis=0)
                     for k in np.flatnonzero(count >= least)])
    # END SOLUTION


# %% tags=["check"]
check("04-2", voxel_centroids)

# %% [markdown]
# And on a real one: the Stanford bunny, with a voxel of 0.05 and with a tenth of it. Which one is still a bunny?

# %% tags=["real-data"]
# real data: stanford_bunny
bunny = data.load("stanford_bunny").cloud.points.astype(float)
try:
    grids = {f"voxel {voxel:g} m": voxel_centroids(bunny, voxel, np.zeros(3), 1)
             for voxel in (0.005, 0.05)}
    if all(np.ndim(grid) == 2 and len(grid) > 3 for grid in grids.values()):
        for name, grid in grids.items():
            report(f"points, {name}", len(grid))
        display(show.panels(grids, frame="object", view="front", size=4,
                            title="Your voxel grids of the bunny"))
except NotImplementedError as todo:
    print(todo)

# %% [markdown]
# ## Task 3 — mend a normal (3 points)
#
# Somebody wrote this to get the normal of a small piece of surface from the points around it. It runs, it returns a direction of length 1,
# and the picture shows what it says of a tilted board. There are three mistakes in it. Mend them all.
#
# - `neighbours`: (K, 3) float, metres; the points around one point of a surface
# - `viewpoint`: (3,) float, metres; where the sensor stood, in the same frame
# - returns: (3,) float, of length 1; the normal, on the side of the viewpoint
#
# <details><summary>Hint 1: idea</summary>Spread is counted from the middle of the points. What does the code count it from? And at
# which point must the arrow to the sensor begin?</details>
# <details><summary>Hint 2: formula</summary>the matrix is the sum of d dᵀ with d = p − mean; the normal n obeys
# n · (viewpoint − mean) &gt; 0</details>
# <details><summary>Hint 3: call</summary><code>np.linalg.eigh</code> returns eigenvalues in ascending order, and the eigenvectors as the
# <em>columns</em> of its matrix.</details>

# %% tags=["expected", "hide-input"]
board = drawn["board"]
arrows = {"expected": drawn["normal"], "given": drawn["given"]}
fig, axis = plt.subplots(figsize=(5.6, 4), layout="constrained")
axis.plot(board[:, 0], board[:, 2], ".", ms=3, color=show.COLOURS["reference"],
          label="board, from above")
middle = board.mean(axis=0)[[0, 2]]
for (name, arrow), what in zip(arrows.items(), ("target", "outlier"),
                               strict=True):
    axis.annotate("", middle + 0.4 * arrow[[0, 2]], middle,
                  arrowprops={"arrowstyle": "->",
                              "color": show.COLOURS[what], "lw": 2})
    axis.plot([], [], color=show.COLOURS[what], label=name)
axis.plot([0], [0], "^", color=show.COLOURS["truth"], ms=9, label="camera")
axis.set(aspect="equal", xlim=(-0.5, 0.9), ylim=(-0.1, 1.7), xlabel="x (m)",
         ylabel="z (m)")
axis.legend(loc="upper right", fontsize=8)
cosine = np.clip(arrows["expected"] @ arrows["given"], -1, 1)
picture(fig, alt="A tilted board before a camera, from above. The expected "
        "arrow stands at a right angle on it and points to the camera's "
        f"side; the given one is {np.degrees(np.arccos(cosine)):.0f} degrees "
        "off.")


# %% tags=["task"]
def normal_of(neighbours, viewpoint):
    """The unit normal (3,) of a surface, on the side of the viewpoint."""
    # BEGIN SOLUTION
    # what spreads, as which vector, on which side: three lines ask one each
    mean = neighbours.mean(axis=0)
    offsets = neighbours - mean
    values, vectors = np.linalg.eigh(offsets.T @ offsets)
    normal = vectors[:, 0]
    if normal @ (viewpoint - mean) < 0:
        normal = -normal
    return normal
    # INSTEAD
    #| values, vectors = np.linalg.eigh(neighbours.T @ neighbours)
    #| normal = vectors[0]  # eigh sorts: the smallest eigenvalue comes first
    #| if normal @ viewpoint < 0:
    #|     normal = -normal
    #| return normal
    # END SOLUTION


# %% tags=["check"]
check("04-3", normal_of)

# %% [markdown]
# ## Task 4 — which mistake made this (2 points)
#
# A floor and a table, seen from the side, went through a voxel grid of 0.2 m that begins at zero. Five times something went wrong. Give
# each letter its cause, each cause once:
#
# `"int() for floor()"`, `"centres of the cubes"`, `"twice the voxel"`, `"every k-th point"`, `"height left out"`
#
# <details><summary>Hint 1: idea</summary>Ask of each: does every cube hold one point, and does the point lie where something was
# measured? If not, where not: everywhere, or beside the origin only?</details>
# <details><summary>Hint 2: formula</summary>int() puts points that lie 0.9 voxels before zero and 0.9
# voxels behind it into one cube. Without height, all that stands in one
# column becomes one point. Centres lie on straight lines.</details>

# %% tags=["expected", "hide-input"]
scene = drawn["scene"]
clouds = {name: drawn[name] for name in ("right", "A", "B", "C", "D", "E")}
fig, axes = plt.subplots(2, 3, figsize=(9, 4.0), sharex=True, sharey=True,
                         layout="constrained")
lines = np.arange(-5, 6) / 5
for axis, (letter, cloud) in zip(axes.ravel(), clouds.items(), strict=True):
    axis.plot(*scene.T, ".", ms=3, color=show.COLOURS["reference"],
              label="measured")
    what = "target" if letter == "right" else "outlier"
    axis.plot(*cloud.T, "o", ms=6, color=show.COLOURS[what], label="kept")
    axis.set(title=letter, aspect="equal", xticks=lines, yticks=lines[3:8])
    axis.tick_params(labelsize=8, labelrotation=0)
    axis.grid(color="0.75", lw=0.8)
    axis.set_axisbelow(True)
    axis.set_xticklabels([f"{x:g}" if abs(x) in (0, 1) else "" for x in lines])
axes[0, 0].legend(loc="center right", fontsize=7)
for axis in axes[1]:
    axis.set_xlabel("x (m)")
for axis in axes[:, 0]:
    axis.set_ylabel("height (m)")
off = {letter: np.linalg.norm(scene[:, None] - cloud[None], axis=2).min(axis=0)
       for letter, cloud in clouds.items()}
picture(fig, alt="A floor with a table on one leg, from the side, with the "
        "grid, six times. " + " ".join(
            f"{letter}: {len(cloud)} points kept, "
            f"{int(np.sum(off[letter] > 0.03))} of them more than 3 cm from "
            "anything measured, "
            f"{int(np.sum(np.abs(cloud).min(axis=1) < 0.2))} beside an axis."
            for letter, cloud in clouds.items()))

# %% tags=["expected", "hide-input"]
report_table([[letter, len(cloud), int(np.sum(off[letter] > 0.03)),
               len(np.unique(np.round(cloud[:, 1], 6))),
               int(np.sum(off[letter] < 1e-9))]
              for letter, cloud in clouds.items()],
             columns=["cloud", "points kept",
                      "more than 3 cm from anything measured",
                      "different heights", "kept points that were measured"])


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "E" to the names of their causes."""
    # BEGIN SOLUTION
    return {
        "A": "height left out",
        "B": "int() for floor()",
        "C": "centres of the cubes",
        "D": "twice the voxel",
        "E": "every k-th point",
    }
    # END SOLUTION


# %% tags=["check"]
check("04-4", causes)

# %% [markdown]
# ## Task 5 — thin out without holes (4 points, open-ended)
#
# A camera saw a floor, a wall and a ball. Near things got many points, far things few. Keep exactly `count` of them so that no
# part of the scene is left without one.
#
# - `points`: (N, 3) float, metres, camera frame, row by row as the camera saw them
# - `count`: how many to keep; here 150 of 4000
# - returns: (count,) whole numbers, all different: the indices of the points to keep
#
# The **widest gap** is the largest distance from any point of the cloud to the nearest kept one. You are scored by the *worst* of seven
# scenes that nobody has seen; the check shows the worst of three. Under 430 mm earns 1 point, under 256 mm 2, under 248 mm 3, under
# 240 mm all 4. A voxel grid alone, its voxel chosen to fit `count`, does not get below 256 in all seven.
#
# <details><summary>Hint 1: idea</summary>A voxel grid keeps as many points of far things as of near ones, but where its gaps lie is luck.
# What if the next point is always put where the widest gap is?</details>
# <details><summary>Hint 2: formula</summary>Keep for each point its distance to the nearest chosen one. The next to choose is the point where
# this is largest. How does the distance change when a point is chosen?</details>
# <details><summary>Hint 3: call</summary><code>np.argmax</code> finds the point; <code>np.minimum</code> of the old distances and
# <code>np.linalg.norm(points - points[i], axis=1)</code></details>


# %% tags=["task"]
def thin_out(points, count):
    """Indices (count,) of points that leave no wide gap."""
    # BEGIN SOLUTION
    chosen = [0]
    gap = np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen[-1]],
                                             axis=1))
    return np.array(chosen)
    # END SOLUTION


# %% tags=["check"]
check("04-5", thin_out)

# %% [markdown]
# ## Task 6 — explain the smooth cloud (2 points, marked by hand)
#
# A colleague scans parts of 15 cm and downsamples every scan with a voxel of 0.05, "because it removes the noise". In at most 60
# words: what does the mean over a cube do to flat parts, what to edges, and from what should the voxel follow? Write them as a text in
# quotes after `return`. All that stands between blanks counts as a word, symbols too.
#
# <details><summary>Hint 1: idea</summary>Think of a cube that holds a piece of a flat wall, and of one that holds a corner.</details>
# <details><summary>Hint 2: formula</summary>"Report against reality" in lesson 04 has what happens to noise and to edges in two columns of its
# first table. The rule for the voxel is in section 2.</details>


# %% tags=["task"]
def explain():
    """Your explanation, a text of at most 60 words."""
    # BEGIN SOLUTION
    return ("On flat parts the mean averages noise, but only where one "
            "cube holds all of it. At an edge it mixes both sides and "
            "cuts the edge off, by a good part of the voxel: shape is "
            "lost, not noise. The voxel must stay below the thinnest "
            "detail to keep, and lose no more than I can bear.")
    # END SOLUTION


# %% tags=["check"]
check("04-6", explain)

# %% [markdown]
# ## Handing in
#
# Restart the kernel, run all cells, save, and hand in this one file. Unfinished tasks cost only their own points.
