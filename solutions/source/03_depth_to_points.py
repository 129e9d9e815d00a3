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
# # Lab 03 From depth to points
#
# Six tasks, about 50 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check says by how much you are
# off, and in which axis. Try again and it says what the mistake looks like, then where to read.
#
# Everything you need stands in [lesson 03](../notebooks/03_depth_to_points.ipynb). You may use NumPy; write the formulas yourself. Images are `(H, W)` arrays:
# `depth[v, u]` is row `v`, column `u`, and the centres of pixels lie at whole numbers. The camera's axes are x right, y down,
# z forward. Depth is z in metres, 0 where nothing was measured.

# %%
from course_lib.notebook import check, data, picture, report_table, show

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

room = data.load("living_room")
frame = replace(room.frames[15], depth=room.truth["depth"][15])  # without noise
drawn = data.of_lab("03")  # what the pictures of tasks 3 and 4 show

# %% [markdown]
# ## Task 1 — focal length from the field of view (1 point)
#
# A data sheet gives the field of view, you need the focal length. One line is missing.
#
# - `fov_degrees`: the whole angle that the image spans, in degrees
# - `pixels`: how many pixels span it
# - returns: the focal length in pixels
#
# For example, `focal_length(90, 640)` is 320.
#
# <details><summary>Hint 1: idea</summary>Half of the image and the focal length are the two short sides of a right-angled
# triangle. Which angle stands opposite the half image?</details>
# <details><summary>Hint 2: formula</summary>tan(half the angle) = half the pixels / f. Solve for f, and mind that
# <code>np.tan</code> takes radians.</details>

# %% tags=["expected", "hide-input"]
f = np.linspace(150, 1200, 200)
angles = 2 * np.degrees(np.arctan2(320, f))
fig, axis = plt.subplots(figsize=(6, 2.8), layout="constrained")
axis.plot(angles, f, color=show.COLOURS["target"])
axis.plot([90], [320], "o", color=show.COLOURS["outlier"])
axis.annotate("90 degrees: 320", (90, 320), (93, 400))
axis.set(xlabel="field of view (degrees)", ylabel="f (pixels)",
         title="Expected, for 640 pixels")
picture(fig, alt="The expected focal length of a 640 pixel wide image falls "
                 f"from {f[-1]:.0f} pixels at {angles[-1]:.0f} degrees "
                 f"through 320 at 90 degrees to {f[0]:.0f} at {angles[0]:.0f} "
                 "degrees.")


# %% tags=["task"]
def focal_length(fov_degrees, pixels):
    """Focal length in pixels from the whole field of view in degrees."""
    # BEGIN SOLUTION
    # half the pixels over the tangent of half the angle
    return 0.5 * pixels / np.tan(np.radians(fov_degrees) / 2)
    # END SOLUTION


# %% tags=["check"]
check("03-1", focal_length)

# %% [markdown]
# ## Task 2 — deproject a window of ranges (3 points)
#
# A time-of-flight camera measures the **range**: how long the ray to each point is, not its z. To save time it sends a window of
# its image only. Lift every pixel of the window to a point.
#
# - `ranges`: (H, W) float, metres along the ray, 0 where nothing came back
# - `fx`, `fy`, `cx`, `cy`: the intrinsics of the full image, in pixels; fx and fy may differ
# - `left`, `top`: the window's first pixel is column `left`, row `top` of the full image
# - returns: (H, W, 3) float, metres, camera frame; NaN in all three where nothing was measured
#
# For example, with fx = 4, fy = 5, cx = cy = 0, left = 3 and top = 0, a range of 2.5 in the first pixel is the point (1.5, 0, 2).
#
# <details><summary>Hint 1: idea</summary>At which column and row of the full image does each pixel lie? Give its ray a z of 1: how
# long is it then?</details>
# <details><summary>Hint 2: formula</summary>With a = (u + left − cx) / fx and b = (v + top − cy) / fy the ray (a, b, 1) has the length
# √(1 + a² + b²). A range is z times that.</details>
# <details><summary>Hint 3: call</summary><code>v, u = np.indices(ranges.shape)</code> gives the row and column of every pixel;
# <code>np.where(ranges &gt; 0, ranges, np.nan)</code>; <code>np.stack([…], axis=-1)</code></details>

# %% tags=["expected", "hide-input"]
window = np.zeros_like(frame.depth)
window[60:360, 200:560] = frame.depth[60:360, 200:560]
show.panels({"the full image, as points": frame,
             "expected of a window of it": replace(frame, depth=window)},
            view="iso",
            alt="Left the room as a cloud, from above at an angle. Right "
                "what a window of the image shows of it, at the same place: "
                "the bookshelf, and parts of the back wall and of the table.")


# %% tags=["task"]
def deproject(ranges, fx, fy, cx, cy, left, top):
    """Points (H, W, 3) in metres of a window of ranges (H, W); NaN where 0."""
    # BEGIN SOLUTION
    # columns and rows are counted in the full image
    v, u = np.indices(ranges.shape)
    a = (u + left - cx) / fx
    b = (v + top - cy) / fy
    # no data must not become a point
    r = np.where(ranges > 0, ranges, np.nan)
    # from the length of the ray to its z; x and y follow
    z = r / np.sqrt(1 + a**2 + b**2)
    return np.stack([a * z, b * z, z], axis=-1)
    # END SOLUTION


# %% tags=["check"]
check("03-2", deproject)

# %% [markdown]
# ## Task 3 — mend a cloud from a stored frame (3 points)
#
# Somebody wrote this for their own camera and gave it to you. On your recording it returns what the picture shows: on its
# head, with a piece missing, and what is left is 1.5 times too large in all three directions. There are three mistakes in it. Mend them all.
#
# - `raw`: (H, W) uint16 as stored; 0 where nothing was measured
# - `color`: (H, W, 3) uint8, RGB, registered to depth
# - `units_per_metre`: how many stored steps make a metre
# - `camera_matrix`: (3, 3) with fx, fy on its diagonal and cx, cy in its last column
# - returns: `{"points": (N, 3) float, metres, camera frame; "colors": (N, 3) uint8}`, one entry for each measured pixel, row by row
#
# <details><summary>Hint 1: idea</summary>Which numbers in the code belong to another camera? And for whom are the minus signs?</details>
# <details><summary>Hint 2: formula</summary>depth = raw / units_per_metre; every measured pixel counts; the axes stay x, y, z.</details>
# <details><summary>Hint 3: call</summary><code>keep = depth &gt; 0</code></details>

# %% tags=["expected", "hide-input"]
show.panels({"given": (drawn["given_points"] / 1000, drawn["given_colors"]),
             "expected": frame},
            frame="camera", view="iso",
            alt="Given: part of a table and a rug on their heads, without "
                "the walls, too large. Expected: the room.")


# %% tags=["task"]
def cloud_from_raw(raw, color, units_per_metre, camera_matrix):
    """Points (N, 3) in metres and colours (N, 3) of the measured pixels."""
    # BEGIN SOLUTION
    depth = raw / units_per_metre
    keep = depth > 0
    v, u = np.nonzero(keep)
    z = depth[v, u]
    x = (u - camera_matrix[0, 2]) * z / camera_matrix[0, 0]
    y = (v - camera_matrix[1, 2]) * z / camera_matrix[1, 1]
    points = np.stack([x, y, z], axis=1)
    return {"points": points, "colors": color[keep]}
    # INSTEAD
    #| depth = raw / 1000
    #| keep = (depth > 0) & (depth < 3)
    #| v, u = np.nonzero(keep)
    #| z = depth[v, u]
    #| x = (u - camera_matrix[0, 2]) * z / camera_matrix[0, 0]
    #| y = (v - camera_matrix[1, 2]) * z / camera_matrix[1, 1]
    #| points = np.stack([x, -y, -z], axis=1)
    #| return {"points": points, "colors": color[keep]}
    # END SOLUTION


# %% tags=["check"]
check("03-3", cloud_from_raw)

# %% [markdown]
# And on a real frame, as it lies on disk. The globe, the desk and both chairs should stand upright, about two and a half metres away.

# %% tags=["real-data"]
# real data: tum_pair
tum = data.load("tum_pair")
real_color, real_raw = tum.raw(0)
try:
    cloud = cloud_from_raw(real_raw, real_color, 5000, tum.camera.matrix)
    desk = cloud["points"][:, 2] < 3.5  # drawn alone, or it would be small
    if desk.sum() > 1000:
        display(show((cloud["points"][desk], cloud["colors"][desk]),
                     views=["front", "side"], frame="camera",
                     title="Your cloud of the TUM desk"))
    else:
        print(f"{len(cloud['points'])} points are left of "
              f"{np.count_nonzero(real_raw):,} measured pixels.")
except NotImplementedError as todo:
    print(todo)

# %% [markdown]
# ## Task 4 — which mistake made this (2 points)
#
# Six clouds of one exact depth image, each spoiled by one mistake. The picture shows one row of pixels from above, the
# table what a tape measure says about the whole cloud. Give each letter its cause, each cause once:
#
# `"another camera's focal length"`, `"another camera's depth scale"`, `"z taken for range"`, `"rows for columns"`, `"cut off at 3 m"`,
# `"flip left in"`
#
# <details><summary>Hint 1: idea</summary>Ask of each: are points missing? Is z still right? Are straight walls still straight?</details>
# <details><summary>Hint 2: formula</summary>A wrong f multiplies x and y by one number and leaves z. A wrong scale multiplies all
# three. z taken for range shortens each
# ray by a factor of its own. A flip changes signs, never sizes.</details>
# <details><summary>Hint 3: call</summary>Return <code>{"A": "…", "B": "…", …}</code> with the letters A to F.</details>

# %% tags=["expected", "hide-input"]
right, *spoiled = drawn["rows"]
fig, axes = plt.subplots(2, 3, figsize=(7.5, 6.4), sharex=True, sharey=True,
                         layout="constrained")
for axis, letter, points in zip(axes.ravel(), "ABCDEF", spoiled, strict=True):
    axis.plot(right[:, 0], right[:, 2], ".", ms=5, label="right",
              color=show.COLOURS["reference"])
    axis.plot(points[:, 0], points[:, 2], ".", ms=2, label="spoiled",
              color=show.COLOURS["outlier"])
    axis.plot([0], [0], "^", color=show.COLOURS["truth"], ms=8, label="camera")
    axis.set(title=letter, aspect="equal", xticks=range(-4, 6, 2))
for axis in axes[1]:
    axis.set_xlabel("x (m)")
for axis in axes[:, 0]:
    axis.set_ylabel("z (m)")
axes[0, 0].legend(loc="lower left", fontsize=9)
picture(fig, alt="One row of six spoiled clouds from above, over the right "
                 "one. "
        + " ".join(
    f"{letter}: from x = {np.nanmin(x):.2f} to {np.nanmax(x):.2f} m, "
    f"z from {np.nanmin(z):.2f} to {np.nanmax(z):.2f} m."
    for letter, (x, _, z) in zip("ABCDEF", np.moveaxis(spoiled, -1, 1),
                                 strict=True)))

# %% tags=["expected", "hide-input"]
report_table([[name, *map(float, measures[:4]), int(measures[4])]
              for name, measures in zip(["right", *"ABCDEF"], drawn["measures"],
                                        strict=True)],
             columns=["cloud", "width (m)", "height (m)", "depth (m)",
                      "median z (m)", "points"])


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "F" to the names of their causes."""
    # BEGIN SOLUTION
    return {
        "A": "rows for columns",
        "B": "z taken for range",
        "C": "cut off at 3 m",
        "D": "another camera's depth scale",
        "E": "flip left in",
        "F": "another camera's focal length",
    }
    # END SOLUTION


# %% tags=["check"]
check("03-4", causes)

# %% [markdown]
# ## Task 5 — find the focal length yourself (4 points, open-ended)
#
# You found a depth camera without a data sheet. You laid fifty things of known length before it, and marked the two end
# pixels of each. The camera measured the depths of the ends, with noise. For about three things in ten, one end has the
# depth of the background instead of its own. What is the focal length?
#
# - `pixels`: (N, 2, 2) float; thing, end, (u, v)
# - `depths`: (N, 2) float, metres, of the two ends
# - `lengths`: (N,) float, metres, by tape measure
# - `cx`, `cy`: the principal point, pixels; this camera's lies well beside the middle of its image
# - returns: f in pixels, the same for columns and rows
#
# The rule of Break it holds for lengths that lie across the image; these also slant in depth. And one thing alone may be nonsense.
#
# You are scored by 1000 mm × the relative error of your f, which is how far off a point 1 m beside the axis lands: under
# 40 mm earns 1 point, under 20 mm 2, under 14 mm 3, under 10 mm all 4. What counts is the **worst** of seven fresh cameras; the
# check below shows three.
#
# <details><summary>Hint 1: idea</summary>Each thing alone gives you one estimate of f. Some of the fifty are nonsense. What do you
# do with fifty estimates of which some are nonsense?</details>
# <details><summary>Hint 2: formula</summary>With X = (u − cx) · z and Y = (v − cy) · z at both ends:
# length² = (ΔX² + ΔY²) / f² + Δz². Solve for f.</details>
# <details><summary>Hint 3: call</summary><code>np.hypot</code>, <code>np.nanmedian</code>; where length² − Δz² is not positive, the
# depths of that thing cannot be right.</details>


# %% tags=["task"]
def estimate_focal(pixels, depths, lengths, cx, cy):
    """Focal length in pixels from things of known length."""
    # BEGIN SOLUTION
    X, Y = (pixels[..., 0] - cx) * depths, (pixels[..., 1] - cy) * depths
    beside = lengths**2 - (depths[:, 0] - depths[:, 1]) ** 2
    beside = np.sqrt(np.where(beside > 0, beside, np.nan))
    estimates = np.hypot(X[:, 0] - X[:, 1], Y[:, 0] - Y[:, 1]) / beside
    return np.nanmedian(estimates)
    # END SOLUTION


# %% tags=["check"]
check("03-5", estimate_focal)

# %% [markdown]
# ## Task 6 — explain the front view (2 points, marked by hand)
#
# A colleague lifts frames with the right f but divides the stored depth by 5000 where 1000 belongs, looks at the cloud from the
# camera's place and says: "Looks right." In at most 60 words: why can this view not show the mistake, and which lengths do
# you measure to tell a wrong depth scale from a wrong f?
#
# <details><summary>Hint 1: idea</summary>What does a wrong scale do to x, to y and to z? At which pixel does each point then lie, and
# what would a wrong f have left alone?</details>
# <details><summary>Hint 2: where to read</summary>"Break it" in lesson 03 argues so for f. The table of section 4 says what differs
# for the scale.</details>


# %% tags=["task"]
def explain():
    """Your explanation, at most 60 words."""
    # BEGIN SOLUTION
    return (
        "A wrong scale divides x, y and z by the same number. So each point "
        "stays on its ray and falls on its own pixel. Measure one known length "
        "across the image and one in depth, such as the distance to a wall: a "
        "wrong scale spoils both alike, a wrong f only the one across."
    )
    # END SOLUTION


# %% tags=["check"]
check("03-6", explain)

# %% [markdown]
# ## Handing in
#
# Restart the kernel, run all cells, save, and hand in this one file. Unfinished tasks cost only their own points.
