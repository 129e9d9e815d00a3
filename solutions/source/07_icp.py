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
# # Lab 07 ICP
#
# Six tasks, about 60 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then the check below it. It says by how much you are
# off; try again and it says what the mistake looks like, then where to read.
#
# Everything you need stands in [lesson 07](../notebooks/07_icp.ipynb). Use NumPy, and in task 5 also SciPy's k-d tree: the course's own `icp` and `transforms`
# are closed. Points are rows, `(N, 3)`, in metres. `T_target_source` is 4x4 and maps source coordinates to target coordinates; a point
# moves by `points @ T[:3, :3].T + T[:3, 3]`. The cell below gives you `turn(axis, degrees)`: the 3x3 rotation by so many **degrees** about an axis
# of any length but 0.

# %%
from course_lib.notebook import check, data, picture, report, report_table, show

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial import cKDTree

from course_lib.tasks.labs.lab_07_icp.two_scans import two_scans

animal = data.load("bunny_like").cloud.points.astype(float)[::12]
example = two_scans(np.random.default_rng(70))


def turn(axis, degrees):
    """(3, 3) rotation about an axis through the origin."""
    length = np.linalg.norm(axis)
    if not 0 < length < np.inf:
        raise ValueError(
            f"turn: an axis of length {length}. In ICP: no pair was within the "
            "radius (is the first as large as the scans are apart?), or the "
            "cloud ran away (is it step @ T?)."
        )
    x, y, z = np.asarray(axis) / length
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.radians(degrees)
    return np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K


# %% [markdown]
# ## Task 1 — put the steps together (1 point)
#
# ICP moves the source a little, then a little more. Each step is a 4x4 matrix for the cloud *as it lies then*. What is the
# one matrix that does all of it? A loop and one line.
#
# - `steps`: (K, 4, 4) float, the first step first
# - returns: (4, 4), the whole motion
#
# For example, 1 m along x and then a quarter turn about z take the origin to (0, 1, 0).
#
# <details><summary>Hint 1: idea</summary>A matrix acts on what stands to its right. Which step touches the points first?</details>
# <details><summary>Hint 2: formula</summary>p₂ = S₂ (S₁ p), so the newest step stands leftmost.</details>

# %% tags=["expected", "hide-input"]
x, y = data.of_lab("07")["origin_ends"].tolist()
report_table([["x", x], ["y", y]],
             columns=["where the origin ends", "expected (m)"])


# %% tags=["task"]
def accumulate(steps):
    """(4, 4) motion of all steps together, the first one first."""
    # BEGIN SOLUTION
    T = np.eye(4)
    for step in steps:
        # the newest step acts on what the earlier ones have moved
        T = step @ T
    return T
    # END SOLUTION


# %% tags=["check"]
check("07-1", accumulate)

# %% [markdown]
# ## Task 2 — best rigid motion of weighted pairs (3 points)
#
# Marks were put up in a hall and found in two scans: row i of the source belongs to row i of the target. Two things are new. A mark that was
# seen well weighs more: make $\sum w_i \lVert R\,p_i + t - q_i \rVert^2$ smallest. And some marks were not found in one of the scans: there the row is NaN,
# and the pair does not count, whatever its weight.
#
# - `source`, `target`: (N, 3) float, metres; a row of NaN where a mark was not found
# - `weights`: (N,) float, 0 or more
# - returns: (4, 4) `T_target_source`: a rotation (never a reflection) and a translation
#
# <details><summary>Hint 1: idea</summary>First keep the rows that are whole in both: one NaN that reaches the SVD, and it does not converge. Then go through section 1 again: which of its sums get a weight?
# All of them.</details>
# <details><summary>Hint 2: formula</summary>mean = Σ w p / Σ w; the cross-covariance is Σ w p qᵀ of the centred points = U W Vᵀ;
# R = V diag(1, 1, det(V Uᵀ)) Uᵀ; t = mean of target − R · mean of source.</details>
# <details><summary>Hint 3: call</summary><code>np.isnan(...).any(axis=1)</code>; <code>w @ p / w.sum()</code>;
# <code>p * w[:, None]</code> weighs rows; <code>np.linalg.svd</code> returns Vᵀ, not V.</details>

# %% tags=["expected", "hide-input"]
shifted = animal @ turn([1, 2, 3], 40).T + [0.12, 0.02, 0]
show((animal, "source"), (shifted, "target"), view="iso",
     title="Expected: the source ends on the target",
     alt="Two copies of an animal, one turned and beside the other.")


# %% tags=["task"]
def best_rigid(source, target, weights):
    """(4, 4) T_target_source of least weighted squared distances."""
    # BEGIN SOLUTION
    # the pairs that were found in both scans
    found = ~np.isnan(source + target).any(axis=1)
    p, q, w = source[found], target[found], weights[found]
    # centre both clouds
    mean_p, mean_q = w @ p / w.sum(), w @ q / w.sum()
    p, q = p - mean_p, q - mean_q
    # the cross-covariance and its SVD
    U, _, Vt = np.linalg.svd((p * w[:, None]).T @ q)
    # the rotation, with the guard against reflections
    guard = np.diag([1, 1, np.sign(np.linalg.det(Vt.T @ U.T))])
    T = np.eye(4)
    T[:3, :3] = Vt.T @ guard @ U.T
    # the translation
    T[:3, 3] = mean_q - T[:3, :3] @ mean_p
    return T
    # END SOLUTION


# %% tags=["check"]
check("07-2", best_rigid)

# %% [markdown]
# ## Task 3 — mend a step of ICP (3 points)
#
# One step of ICP. Run again and again it walks away from the target and reports a perfect fitness.
# There are three mistakes in it. Mend them all; not all that looks unlike the lesson is a mistake. The check tries bumpy ground with strays above it, and two raw scans of the Stanford bunny.
#
# - `source`, `target`: (N, 3), (M, 3) float, metres
# - `T`: (4, 4) `T_target_source` so far
# - `radius`: pairs farther apart than this do not count, metres
# - returns: `{"T": (4, 4) after this step; "fitness": the share of the source points that found a partner within the radius}`
#
# <details><summary>Hint 1: idea</summary>Where does the source lie when you look for partners? Which of two motions comes first? And what is
# the fitness a share of?</details>
# <details><summary>Hint 2: formula</summary>Distances from <code>moved</code>; step · T; kept pairs / source points.</details>
# <details><summary>Hint 3: call</summary>Run it twice in a row and print what changes: <code>moved</code>, the distances, T.
# A share is <code>keep.sum() / …</code></details>

# %% tags=["expected", "hide-input"]
residual = data.of_lab("07")["residual"]
fig, axis = plt.subplots(figsize=(6, 2.8), layout="constrained")
axis.plot(residual, "o-", color=show.COLOURS["target"])
axis.set(xlabel="step", ylabel="RMSE of the pairs (mm)",
         title="Expected, where the source is a copy of the target")
picture(fig, alt=f"A curve that falls from {residual[0]:.1f} mm at the first "
                 f"step to {residual[-1]:.1f} mm at the last.")


# %% tags=["task"]
def icp_step(source, target, T, radius):
    """One step of point-to-point ICP: the new T and the fitness before it."""
    # BEGIN SOLUTION
    # three mistakes are in here
    moved = source @ T[:3, :3].T + T[:3, 3]
    distances = np.linalg.norm(moved[:, None] - target[None], axis=2)
    near, distance = distances.argmin(axis=1), distances.min(axis=1)
    keep = distance <= radius
    p, q = moved[keep], target[near[keep]]
    U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
    guard = np.diag([1, 1, np.linalg.det(Vt.T @ U.T)])
    step = np.eye(4)
    step[:3, :3] = (U @ guard @ Vt).T
    step[:3, 3] = q.mean(axis=0) - step[:3, :3] @ p.mean(axis=0)
    fitness = keep.sum() / len(source)
    return {"T": step @ T, "fitness": float(fitness)}
    # INSTEAD
    #| moved = source @ T[:3, :3].T + T[:3, 3]
    #| distances = np.linalg.norm(source[:, None] - target[None], axis=2)
    #| near, distance = distances.argmin(axis=1), distances.min(axis=1)
    #| keep = distance <= radius
    #| p, q = moved[keep], target[near[keep]]
    #| U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))
    #| guard = np.diag([1, 1, np.linalg.det(Vt.T @ U.T)])
    #| step = np.eye(4)
    #| step[:3, :3] = (U @ guard @ Vt).T
    #| step[:3, 3] = q.mean(axis=0) - step[:3, :3] @ p.mean(axis=0)
    #| fitness = near[keep].size / max(keep.sum(), 1)
    #| return {"T": T @ step, "fitness": float(fitness)}
    # END SOLUTION


# %% tags=["check"]
check("07-3", icp_step)

# %% [markdown]
# And on two raw scans of the Stanford bunny, thinned. We undo most of the turn between them, as a person would by hand, and your step does the rest.
# (A step on the wrong side still comes closer here: this pair forgives it, the check does not.)

# %% tags=["real-data", "hide-input"]
# real data: stanford_bunny
bunny = data.load("stanford_bunny")
poses = bunny.reference["scan_poses"]
T_reference = np.linalg.inv(poses["bun000"]) @ poses["bun045"]
scan_0, scan_45 = (bunny.clouds[name].points.astype(float)[::50]
                   for name in ("bun000", "bun045"))
middle = np.append(scan_45.mean(axis=0), 1)


def middle_off(T):
    """How far T leaves the middle of scan 45 from the reference, mm."""
    return 1000 * np.linalg.norm((T - T_reference) @ middle)


try:
    T = T_reference.copy()
    T[:3, 3] += [0.002, 0.001, 0]
    report("the middle of scan 45 off by, before", middle_off(T), "mm", 2)
    for _ in range(30):
        T = icp_step(scan_45, scan_0, T, 0.004)["T"]
    report("and after 30 of your steps", middle_off(T), "mm", 2)
except NotImplementedError as todo:
    print(todo)

# %% [markdown]
# ## Task 4 — which mistake made this (2 points)
#
# A flat tile, turned by 30 degrees and shifted, was registered five times with known pairs; each time with one mistake. The table says
# where it ended. Give each letter its cause, each cause once:
#
# `"rotation transposed"`, `"translation without R"`, `"no reflection guard"`, `"the inverse"`, `"stopped after one step"`
#
# (*Stopped after one step* paired by closest points instead of the known pairs, and took one step only.)
#
# <details><summary>Hint 1: idea</summary>Ask of each: is the determinant right? Is the angle right? Does the middle of the tile end in its
# place?</details>
# <details><summary>Hint 2: formula</summary>A transposed rotation turns by −30 instead of 30 degrees: 60 too far. If t is computed from it, the
# middle still lands well. The inverse undoes the turn *and* shifts the wrong way.</details>

# %% tags=["expected", "hide-input"]
ends = data.of_lab("07")["ends"].tolist()
names = ["right", *"ABCDE"]
report_table([[name, int(sign), angle if sign > 0 else "no rotation", *off]
              for name, (sign, angle, *off) in zip(names, ends, strict=True)],
             columns=["registration", "determinant",
                      "angle from the true one (degrees)",
                      "its middle off by (mm)", "RMSE of the true pairs (mm)"],
             smallest=0.01)


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "E" to the names of their causes."""
    # BEGIN SOLUTION
    return {
        "A": "no reflection guard",
        "B": "the inverse",
        "C": "rotation transposed",
        "D": "stopped after one step",
        "E": "translation without R",
    }
    # END SOLUTION


# %% tags=["check"]
check("07-4", causes)

# %% [markdown]
# ## Task 5 — register two scans (4 points, open-ended)
#
# Two scans of one bumpy ground share about two thirds. Some grounds are a flower bed, others a field, 4.5 m by 6 m up to 30 m by 40 m, always with 1,200 points.
# So the spacing differs, too (the median distance to the nearest neighbour); the noise is a fifth of it. The source has 300 points
# more on leaves, up to a quarter of the target's length above the ground. `start` is 15 to 22 degrees and up to half that length off.
# Where does the source belong? The lesson's radii fit one room; compute yours. `example` is one such pair; `example.T_target_source` is its truth.
#
# - `source`: (N, 3) float, metres, in the source's own coordinates
# - `target`: (M, 3) float, metres
# - `normals`: (M, 3) float, unit normals of the target
# - `start`: (4, 4), a `T_target_source` to begin with
# - returns: (4, 4) `T_target_source`
#
# You are scored by how far the points of the source's ground end from their true places, in the mean, counted in spacings: under 2 earns 1 point, under 1.2
# 2, under 0.9 3, under 0.6 all 4. The worst of seven fresh pairs counts; the check shows three.
#
# <details><summary>Hint 1: idea</summary>At first true partners are far away, later only wrong ones are: leaves, and the third that only one scan saw. What
# should the radius do, and which of this scene's lengths does it follow?</details>
# <details><summary>Hint 2: formula</summary>To planes: rows (p × n, n), right-hand side n · (q − p), solved for a small turn w and a shift. Each step goes
# onto T from the left.</details>
# <details><summary>Hint 3: call</summary><code>cKDTree(target).query(moved)</code>, <code>np.ptp(target, axis=0)</code>, <code>np.cross</code>, <code>np.linalg.lstsq</code>, and
# <code>turn(w, np.degrees(np.linalg.norm(w)))</code> for the rotation vector w in radians (the identity, if w is zero).</details>

# %% tags=["expected", "hide-input"]
placed = {"put down by start": example.start,
          "expected": example.T_target_source}
show.panels({name: [(example.source @ T[:3, :3].T + T[:3, 3], "source"),
                    (example.target, "target")] for name, T in placed.items()},
            view="iso",
            alt="Two bumpy sheets from the side, one with leaves above it. By "
                "the start they lie one above the other, tilted; expected, "
                "they are one longer sheet, covered twice in the middle.")


# %% tags=["task"]
def register(source, target, normals, start):
    """(4, 4) T_target_source of two scans that overlap in part."""
    # BEGIN SOLUTION
    T, tree = start.copy(), cKDTree(target)
    spacing = np.median(tree.query(target, 2)[0][:, 1])
    for radius in np.geomspace(
        np.ptp(target, axis=0).max() / 2, 2 * spacing, 5
    ):
        for _ in range(10):
            moved = T[:3, 3] + source @ T[:3, :3].T
            distance, index = tree.query(moved)
            keep = distance <= radius
            p, q, n = moved[keep], target[index[keep]], normals[index[keep]]
            A, b = np.hstack([np.cross(p, n), n]), np.sum(n * (q - p), axis=1)
            x = np.linalg.lstsq(A, b, rcond=None)[0]
            step, angle = np.eye(4), np.linalg.norm(x[:3])
            if angle > 0:
                step[:3, :3] = turn(x[:3], np.degrees(angle))
            step[:3, 3] = x[3:]
            T = step @ T
    return T
    # END SOLUTION


# %% tags=["check"]
check("07-5", register)

# %% [markdown]
# ## Task 6 — explain a fitness of one (2 points, marked by hand)
#
# A colleague registers two scans with a radius of 1 m and reports: "All 50,000 points found a partner, fitness 1.000, so the
# pose is right." In at most 60 words: why does that not follow, and what would you check instead?
#
# <details><summary>Hint 1: idea</summary>At a pose that is wrong by 20 cm, how many points have some neighbour within 1 m?</details>
# <details><summary>Hint 2: formula</summary>Section 4 of lesson 07 has both halves of the answer.</details>


# %% tags=["task"]
def explain():
    """Your explanation, at most 60 words."""
    # BEGIN SOLUTION
    return (
        "Within 1 m nearly every point has some neighbour, at the true pose "
        "and at many wrong ones, so the count says nothing. Check the pose by "
        "something the registration did not use: points marked by hand, a "
        "start from another side that must end in the same pose, or the "
        "fitness with a radius of a few spacings."
    )
    # END SOLUTION


# %% tags=["check"]
check("07-6", explain)

# %% [markdown]
# ## Handing in
#
# Restart the kernel, run all cells, save, and hand in this one file. Unfinished tasks cost only their own points.
