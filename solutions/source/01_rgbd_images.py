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
# Six tasks, about 45 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check tells you by how much you
# are off; after a second try also what it looks like, after a third where to read.
#
# Everything you need stands in [lesson 01](../notebooks/01_rgbd_images.ipynb) or in the hints. Use NumPy and no other library: what `cv2` or `rgbd` would do is what
# the tasks are about. Depth images are `(H, W)` arrays of metres, 0 where nothing was measured; `depth[v, u]` is row `v`, column `u`.

# %%
from course_lib.notebook import check, data, picture, show

import matplotlib.pyplot as plt
import numpy as np

room = data.load("living_room")
depth = room.frames[0].depth
drawn = data.of_lab("01")  # what the pictures below are drawn from

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
wall, bowl = np.full((480, 640), 2.0), drawn["wall"]
names = ["given: depth of a flat wall", "expected: its range"]
for axis, image, name in zip(axes, [wall, bowl], names, strict=True):
    seen = axis.imshow(image, vmin=2.0, vmax=2.55,
                       extent=(-0.5, 639.5, 479.5, -0.5))
    axis.set(title=name, xlabel="column u", ylabel="row v")
fig.colorbar(seen, ax=axes, label="metres")
picture(fig, alt=f"Given: a flat wall at {wall[0, 0]:.1f} m. Expected: a bowl "
        f"from {bowl.min():.2f} m in the middle to {bowl.max():.2f} m in the "
        "corners.")


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
        print(f"{name}: median {np.median(metres[metres > 0]):.2f} m, "
              f"farthest {metres.max():.2f} m")
    except NotImplementedError as todo:
        print(f"{name}: {todo}")

# %% [markdown]
# ## Task 3 — Mend the small depth image (2 points)
#
# Somebody halves a depth image by averaging each block of 2x2 pixels. The picture shows what comes out at an outline: depths
# at which nothing is. Mend it. Each pixel of the result must be **one of the four** depths that it covers, within
# 1 mm, never a mixture, and 0 only where none of the four was measured. Which of the four is up to you. **No data is 0 or NaN here**: two
# programs had a hand in these images. The result holds no NaN. Height and width are even.

# %% tags=["expected", "hide-input"]
edge = np.where(np.add.outer(np.arange(40), np.arange(60)) < 55, 1.0, 3.0)
edge[11:16, 15:36] = 0
averaged = edge.reshape(20, 2, 30, 2).mean(axis=(1, 3))
ghosts = ~np.isin(averaged, [0, 1, 3])
show.images({"given": np.where(edge > 0, edge, np.nan),
             "wrong: averaged": np.where(averaged > 0, averaged, np.nan)},
            unit="m", limits=(0, 3), alt="A thing at 1 m before a wall at "
            "3 m, with a hole. Averaging has invented "
            f"{ghosts.sum()} pixels in between, along the outline and around "
            "the hole")

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Choosing is not mixing. The smallest of four is one of the four. So is the largest. But NaN
# wins over every number, and 0 is smaller than every depth.</details>
# <details><summary>Hint 2: formula</summary>Turn NaN into 0 first. Then take the largest of the four: it is 0 only if all
# are 0.</details>
# <details><summary>Hint 3: call</summary><code>np.nan_to_num</code>; <code>blocks.max(axis=(1, 3))</code></details>


# %% tags=["task"]
def half_size(depth):
    """A depth image of half the height and width.

    depth : (H, W) float, metres, 0 or NaN where nothing was measured; H and
        W are even
    returns (H/2, W/2) float, metres: one of the four depths that each pixel
        covers, 0 where none of them was measured
    """
    # BEGIN SOLUTION
    h, w = depth.shape
    blocks = np.nan_to_num(depth).reshape(h // 2, 2, w // 2, 2)
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
# The picture shows one depth image without noise, and the errors of five spoiled ones. Each was spoiled by one mistake of this list:
#
# - `"range"`: range taken for depth
# - `"tum"`: a millimetre image read with the TUM scale
# - `"8 bits"`: rescaled to 0…255 and back
# - `"mixed"`: resized to half and back, mixing depths
# - `"flipped"`: darker taken for farther: near and far turned round
#
# Look at the shape of each error image, its sign and its size. (Pale pink: no data.)

# %% tags=["expected", "hide-input"]
errors = {letter: drawn[letter].astype(float) for letter in "ABCDE"}
fig, axes = plt.subplots(2, 3, figsize=(10, 4.6), layout="constrained")
pink = show.COLOURS["no data"]
colours = plt.get_cmap("viridis").with_extremes(bad=pink)
signed = plt.get_cmap("coolwarm").with_extremes(bad=pink)
axes[0, 0].imshow(np.where(depth > 0, depth, np.nan), cmap=colours)
axes[0, 0].set_title("the right depth image", fontsize=10)
for axis, (letter, error) in zip(axes.ravel()[1:], errors.items(), strict=True):
    limit = np.nanpercentile(np.abs(error), 98)
    seen = axis.imshow(error, cmap=signed, vmin=-limit, vmax=limit)
    axis.set_title(f"{letter}: wrong minus right, ±{limit:.2g} m", fontsize=10)
    fig.colorbar(seen, ax=axis, shrink=0.7)
for axis in axes.ravel():
    axis.set(xticks=[], yticks=[])
words = []
for letter, error in errors.items():
    off = np.abs(error)
    words.append(
        f"{letter}: half of the errors are below "
        f"{1000 * np.nanmedian(off):.0f} mm, the largest is "
        f"{1000 * np.nanmax(off):.0f} mm; {np.nanmean(error > 0.002):.0%} of "
        f"the pixels come out too far and {np.nanmean(error < -0.002):.0%} too "
        f"near; about {1000 * np.nanmean(off[100:140, 130:190]):.0f} mm in the "
        f"middle, {1000 * np.nanmean(off[:40, -60:]):.0f} mm at the upper "
        "right.")
picture(fig, alt="The right depth image and five error images. "
        + " ".join(words))

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Ask of each: where is the error zero? Where is it large? Has it one sign?</details>
# <details><summary>Hint 2: formula</summary>Range differs by a factor that depends on the pixel only; a scale by one factor; 8 bits
# by at most half a grey level.</details>
# <details><summary>Hint 3: call</summary>Return a dict: <code>{"A": "…", "B": "…", …}</code>. Each cause occurs once.</details>


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "E" to the names of their causes."""
    # BEGIN SOLUTION
    return {"A": "mixed", "B": "tum", "C": "8 bits", "D": "flipped",
            "E": "range"}
    # END SOLUTION


# %% tags=["check"]
check("01-4", causes)

# %% [markdown]
# ## Task 5 — Catch the flying pixels (3 points, open-ended)
#
# Write a function that marks flying pixels: measured pixels that hang between a near and a far surface. You get the depth
# image of a noisy depth camera, and no truth. You are scored by F1 against the truth: the harmonic mean of *precision* (how many of the
# marked are flying) and *recall* (how many of the flying are marked). A perfect mask has F1 = 1.
#
# Your grade is what the **worst of 7** fresh scenes earns (the check shows 3): `1 - F1` under 0.40 half a point, under 0.25 one, under
# 0.16 all three. So a method that fails in every third scene fails.
#
# The things stand between 0.6 m and 6 m. As in section 5, the noise grows with the square of the depth; here its spread is 6 mm
# times z², with z in metres (the small images are noisier than the room). A flying pixel hangs at least six times the noise away from both
# surfaces. Now and then two of them hang side by side at one depth.
#
# <details><summary>Hint 1: idea</summary>A surface continues: most neighbours of a good pixel have nearly its depth. A flying pixel has hardly any
# such neighbour.</details>
# <details><summary>Hint 2: formula</summary>Count, among the 8 neighbours, those whose depth
# differs by no more than three times the noise. One or none: flying. The 24 neighbours of a 5x5 window tell a little better: four or
# fewer.</details>
# <details><summary>Hint 3: call</summary><code>np.pad(depth, 1)</code> and shifted slices; 0 is no neighbour.</details>


# %% tags=["expected", "hide-input"]
truth = room.truth["depth"][0]
flying = (depth > 0) & (truth > 0) & (np.abs(depth - truth) > 0.03 * truth)
rows, columns = slice(150, 330), slice(230, 470)
fig, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
part = np.where(depth > 0, depth, np.nan)[rows, columns]
seen = axes[0].imshow(part, cmap=plt.get_cmap("viridis").with_extremes(
    bad=show.COLOURS["no data"]))
fig.colorbar(seen, ax=axes[0], label="metres", shrink=0.8)
axes[0].set_title("given (a part of the room)")
axes[1].imshow(flying[rows, columns], cmap="gray_r")
axes[1].set_title("expected: flying pixels black")
picture(fig, alt="Part of a depth image, and the flying pixels in it: "
        f"{int(flying[rows, columns].sum())} thin black specks along the "
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
            other = padded[dv : dv + h, du : du + w]
            near = np.abs(other - depth) < 0.02 * depth**2
            support += (other > 0) & near
    # the pixel supports itself: take it off
    return (depth > 0) & (support - 1 <= 4)
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
        "JPEG keeps 8 bits: over six metres, depth comes in steps of 24 mm, "
        "so surfaces become staircases. JPEG also mixes neighbouring pixels: "
        "at outlines, and beside no-data zeros, it invents depths in between, "
        "so points hang in mid-air where nothing is. Neither can be undone. "
        "PNG keeps 16 bits without loss."
    )
    # END SOLUTION


# %% tags=["check"]
check("01-6", explain)

# %% [markdown]
# ## Handing in
#
# Save the notebook and hand in this one file. Unfinished tasks cost only their own points.
