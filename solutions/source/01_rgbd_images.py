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
# # Lab 01 RGB-D images
#
# Six tasks, about 60 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check tells you by how much you
# are off; after a second try also what it looks like, after a third where to read.
#
# Everything you need stands in [lesson 01](../notebooks/01_rgbd_images.ipynb) or in the hints. You may use NumPy. Depth images are `(H, W)` arrays of metres, 0 where nothing
# was measured; `depth[v, u]` is row `v`, column `u`.

# %%
from course_lib.notebook import check, data, picture, show

import matplotlib.pyplot as plt
import numpy as np

from course_lib.camera import rgbd

frame = data.load("living_room").frames[0]
depth, camera = frame.depth, frame.camera

# %% [markdown]
# ## Task 1 — From depth to range (1 point)
#
# A laser scanner stands where the camera stands. It measures the length of the string, not z. Turn a depth image into a range
# image. One line is missing. A pixel without a measurement (0) stays 0.
#
# <details><summary>Hint 1: idea</summary>Every pixel has its own right-angled triangle. One side is z. The others are how far
# the pixel looks to the side and down, at that z.</details>
# <details><summary>Hint 2: formula</summary>range = z · √(1 + ((u − cx)/f)² + ((v − cy)/f)²)</details>

# %% tags=["expected", "hide-input"]
fig, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
wall, bowl = np.full((480, 640), 2.0), 2.0 * np.hypot(1, np.hypot(*((np.indices((480, 640)).T - [239.5, 319.5]) / 525).T))
for axis, image, name in zip(axes, [wall, bowl], ["given: depth of a flat wall", "expected: its range"], strict=True):
    drawn = axis.imshow(image, vmin=2.0, vmax=2.55)
    axis.set(title=name, xlabel="column u", ylabel="row v")
fig.colorbar(drawn, ax=axes, label="metres")
picture(fig, alt=f"Given: a flat wall at {wall[0, 0]:.1f} m. Expected: a bowl from {bowl.min():.2f} m to {bowl.max():.2f} m.")


# %% tags=["task"]
def range_from_depth(depth, f, cx, cy):
    """Range image from a depth image.

    depth : (H, W) float, metres, 0 where nothing was measured
    f, cx, cy : focal length and principal point, pixels
    returns (H, W) float, metres
    """
    # BEGIN SOLUTION
    # the row v and the column u of every pixel: np.indices
    v, u = np.indices(depth.shape)
    # multiply each depth by the length of its pixel's string at z = 1
    return depth * np.sqrt(1 + ((u - cx) / f) ** 2 + ((v - cy) / f) ** 2)
    # END SOLUTION


# %% tags=["check"]
check("01-1", range_from_depth)

# %% [markdown]
# ## Task 2 — Three cameras, one unit (2 points)
#
# Read raw 16-bit images of three encodings into metres: `"tum"` has 5000 steps a metre; `"realsense"` has 1000; `"sun"` has
# 1000 too, but first each 16-bit number must be rotated three bits to the *right* (the three lowest bits come back at
# the top). In all three, 0 is no data; in `"realsense"`, so is 65535. No data becomes 0.
#
# <details><summary>Hint 1: idea</summary>First repair the bits, then mark what is no data, then divide. In that order.</details>
# <details><summary>Hint 2: formula</summary>rotated = (raw ≫ 3) | (raw ≪ 13), kept to 16 bits</details>
# <details><summary>Hint 3: call</summary><code>raw &gt;&gt; 3</code> and <code>raw &lt;&lt; 13</code> of a
# <code>uint16</code> array stay <code>uint16</code>; <code>np.where(raw == 65535, 0, raw)</code></details>


# %% tags=["task"]
def to_metres(raw, encoding):
    """Depth in metres from a raw depth image.

    raw : (H, W) uint16
    encoding : "tum", "sun" or "realsense"
    returns (H, W) float, metres, 0 where nothing was measured
    """
    # BEGIN SOLUTION
    # SUN: rotate the bits three places to the right
    if encoding == "sun":
        raw = (raw >> 3) | (raw << 13)
    # RealSense: 65535 is no data, as 0 is
    if encoding == "realsense":
        raw = np.where(raw == 65535, 0, raw)
    # divide by the steps per metre
    return raw / {"tum": 5000, "sun": 1000, "realsense": 1000}[encoding]
    # END SOLUTION


# %% tags=["check"]
check("01-2", to_metres)

# %% [markdown]
# And on real frames. The medians should be about two and a half, almost three, and a little over one metre.

# %% tags=["real-data"]
# real data: tum_pair, sun_pair, realsense_slam
for name in ["tum_pair", "sun_pair", "realsense_slam"]:
    dataset = data.load(name)
    try:
        metres = to_metres(dataset.raw(0)[1], dataset.encoding.name)
        print(f"{name}: median {np.median(metres[metres > 0]):.2f} m, farthest {metres.max():.2f} m")
    except NotImplementedError as todo:
        print(f"{name}: {todo}")

# %% [markdown]
# ## Task 3 — Mend the small depth image (2 points)
#
# Somebody halves a depth image by averaging each block of 2x2 pixels. The picture shows what comes out at an outline: depths
# at which nothing is. Mend it. Each pixel of the result must be **one of the four** depths that it covers, within
# 1 mm, never a mixture, and 0 only where all four are 0. Which of the four is up to you. Height and width are even.

# %% tags=["expected", "hide-input"]
edge = np.where(np.add.outer(np.arange(40), np.arange(60)) < 55, 1.0, 3.0)
edge[11:16, 15:36] = 0
averaged = edge.reshape(20, 2, 30, 2).mean(axis=(1, 3))
ghosts = ~np.isin(averaged, [0, 1, 3])
show.images({"given": np.where(edge > 0, edge, np.nan), "wrong: averaged": np.where(averaged > 0, averaged, np.nan)},
            unit="m", alt=f"A thing at 1 m before a wall at 3 m, with a hole. Averaging has invented {ghosts.sum()} pixels "
                          "in between, along the outline and around the hole")

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Choosing is not mixing. The smallest of four is one of the four. So is the largest.</details>
# <details><summary>Hint 2: formula</summary>Take the largest of the four: it is 0 only if all are 0. Or the smallest, if
# zeros count as infinitely far.</details>
# <details><summary>Hint 3: call</summary><code>blocks.max(axis=(1, 3))</code></details>


# %% tags=["task"]
def half_size(depth):
    """A depth image of half the height and width.

    depth : (H, W) float, metres, 0 where nothing was measured; H and W even
    returns (H/2, W/2) float, metres: one of the four depths that each pixel covers
    """
    # BEGIN SOLUTION
    h, w = depth.shape
    blocks = depth.reshape(h // 2, 2, w // 2, 2)
    return blocks.max(axis=(1, 3))
    # INSTEAD
    #| h, w = depth.shape
    #| blocks = depth.reshape(h // 2, 2, w // 2, 2)
    #| return blocks.mean(axis=(1, 3))
    # END SOLUTION


# %% tags=["check"]
check("01-3", half_size)

# %% [markdown]
# ## Task 4 — Which mistake made this? (2 points)
#
# The picture shows one depth image read rightly, and five times spoiled. Each was spoiled by one mistake of this list:
#
# - `"range"`: range taken for depth
# - `"tum"`: a millimetre image read with the TUM scale
# - `"8 bits"`: rescaled to 0…255 and back
# - `"mixed"`: resized to half and back, mixing depths
# - `"flipped"`: darker taken for farther: near and far turned round
#
# Look at the shape of each error image, its sign and its size.

# %% tags=["expected", "hide-input"]
v, u = np.indices(depth.shape)
stretch = np.sqrt(1 + ((u - camera.cx) / camera.fx) ** 2 + ((v - camera.cy) / camera.fy) ** 2)
h, w = depth.shape
mix = depth.reshape(h // 2, 2, w // 2, 2).mean(axis=(1, 3)).repeat(2, 0).repeat(2, 1)
spoiled = {
    "A": np.round(depth / 6 * 255) / 255 * 6,
    "B": np.where(depth > 0, depth.max() + depth[depth > 0].min() - depth, 0),
    "C": depth * stretch,
    "D": mix,
    "E": depth / 5,
}
fig, axes = plt.subplots(2, 3, figsize=(10, 5.6), layout="constrained")
axes[0, 0].imshow(np.where(depth > 0, depth, np.nan), cmap="viridis")
axes[0, 0].set_title("the right depth image", fontsize=10)
for axis, (letter, image) in zip(axes.ravel()[1:], spoiled.items(), strict=True):
    error = np.where((depth > 0) & (image > 0), image - depth, np.nan)
    limit = np.nanpercentile(np.abs(error), 98)
    drawn = axis.imshow(error, cmap="coolwarm", vmin=-limit, vmax=limit)
    axis.set_title(f"{letter}: wrong minus right, ±{limit:.2g} m", fontsize=10)
    fig.colorbar(drawn, ax=axis, shrink=0.7)
for axis in axes.ravel():
    axis.set(xticks=[], yticks=[])
medians = {letter: np.nanmedian((image - depth)[depth > 0]) for letter, image in spoiled.items()}
picture(fig, alt="The right depth image and five error images. " + " ".join(
    f"{letter}: median error {1000 * value:+.0f} mm." for letter, value in medians.items())
    + " A shows stripes of both signs; B is positive for near things and negative for far ones; C grows towards the corners; "
    "D is zero but for thin lines along outlines; E is negative everywhere, more so for far things.")

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Ask of each: where is the error zero? Where is it large? Has it one sign?</details>
# <details><summary>Hint 2: formula</summary>Range differs by a factor that depends on the pixel only; a scale by one factor; 8 bits
# by at most half a grey level.</details>
# <details><summary>Hint 3: call</summary>Return a dict: <code>{"A": "range", "B": …}</code>. Each cause occurs once.</details>


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "E" to the names of their causes."""
    # BEGIN SOLUTION
    return {"A": "8 bits", "B": "flipped", "C": "range", "D": "mixed", "E": "tum"}
    # END SOLUTION


# %% tags=["check"]
check("01-4", causes)

# %% [markdown]
# ## Task 5 — Catch the flying pixels (3 points, open-ended)
#
# Write a function that marks flying pixels: measured pixels that hang between a near and a far surface. You get the depth
# image of a noisy depth camera, and you are scored by F1 against the truth: the harmonic mean of *precision* (how many of the
# marked are flying) and *recall* (how many of the flying are marked). A perfect mask has F1 = 1. The score is the median over
# five scenes: `1 - F1` under 0.40 earns half a point, under 0.25 one, under 0.15 all three.
#
# The things stand between 0.6 m and 6 m. As in section 5, the noise grows with the square of the depth; here its spread is 6 mm
# times z², with z in metres (the small images are noisier than the room). Call a pixel flying if it is wrong by far more than that.
#
# <details><summary>Hint 1: idea</summary>A surface continues: most neighbours of a good pixel have nearly its depth. A flying pixel has hardly any
# such neighbour.</details>
# <details><summary>Hint 2: formula</summary>Count, among the 8 neighbours, those whose depth
# differs by no more than three times the noise. One or none: flying. The 24 neighbours of a 5x5 window tell a little better: four or
# fewer.</details>
# <details><summary>Hint 3: call</summary><code>np.pad(depth, 1)</code> and shifted slices; 0 is no neighbour.</details>


# %% tags=["expected", "hide-input"]
truth = data.load("living_room").truth["depth"][0]
flying = (depth > 0) & (truth > 0) & (np.abs(depth - truth) > 0.03 * truth)
rows, columns = slice(150, 330), slice(230, 470)
fig, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
axes[0].imshow(np.where(depth > 0, depth, np.nan)[rows, columns])
axes[0].set_title("given (a part of it)")
axes[1].imshow(flying[rows, columns], cmap="gray_r")
axes[1].set_title("expected: flying pixels black")
picture(fig, alt=f"Part of a depth image, and the flying pixels in it: {int(flying[rows, columns].sum())} thin black specks along the "
                 "outlines of things.")


# %% tags=["task"]
def flying_pixels(depth):
    """Mark the flying pixels of a depth image.

    depth : (H, W) float, metres, 0 where nothing was measured
    returns (H, W) bool
    """
    # BEGIN SOLUTION
    h, w = depth.shape
    padded = np.pad(depth, 2)
    support = np.zeros((h, w), int)
    for dv in range(5):
        for du in range(5):
            neighbour = padded[dv : dv + h, du : du + w]
            support += (neighbour > 0) & (np.abs(neighbour - depth) < 0.02 * depth**2)
    return (depth > 0) & (support - 1 <= 4)  # the pixel supports itself: take it off
    # END SOLUTION


# %% tags=["check"]
check("01-5", flying_pixels)

# %% [markdown]
# ## Task 6 — Explain (2 points, marked by hand)
#
# A friend saves depth images as JPEG, "because they are smaller". In at most 60 words: name two things that this destroys, and
# say what each does to the 3D points.
#
# <details><summary>Hint 1: idea</summary>How many bits has a JPEG pixel? And what does JPEG do to neighbours?</details>
# <details><summary>Hint 2: formula</summary>Sections 4 and "Break it" have a number for each.</details>


# %% tags=["task"]
def explain():
    """Your explanation, at most 60 words."""
    # BEGIN SOLUTION
    return (
        "JPEG keeps 8 bits: over six metres, depth comes in steps of 24 mm, so surfaces become staircases. JPEG also mixes "
        "neighbouring pixels: at outlines, and beside no-data zeros, it invents depths in between, so points hang in mid-air "
        "where nothing is. Neither can be undone. PNG keeps 16 bits without loss."
    )
    # END SOLUTION


# %% tags=["check"]
check("01-6", explain)

# %% [markdown]
# ## Handing in
#
# Save the notebook and hand in this one file. Unfinished tasks cost only their own points.
