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
# # Lab 02 Point clouds
#
# Six tasks, about 60 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check tells you by how much you
# are off; after a second try also what it looks like, after a third where to read.
#
# Everything you need stands in lesson 02. You may use NumPy. Clouds are `(N, 3)` arrays of metres.

# %%
from course_lib.notebook import check, data, picture, report, show

import numpy as np

bunny = data.load("bunny_like").cloud.points

# %% [markdown]
# ## Task 1 — Where is the pixel in the list? (1 point)
#
# An organised cloud of `height` rows and `width` columns is written out as a list, row by row. In which row of the list is the
# point of pixel `(u, v)`? One line is missing. Both `u` and `v` count from 0.
#
# <details><summary>Hint 1: idea</summary>How many complete image rows lie above row v? How many points has each?</details>
# <details><summary>Hint 2: formula</summary>rows above times points per row, plus the points to the left</details>


# %% tags=["task"]
def row_of(u, v, width, height):
    """Row of the pixel in the list.

    u, v : int, column and row of the pixel, from 0
    width, height : int, size of the image
    returns int
    """
    # BEGIN SOLUTION
    # v full rows of the image come first, then u points
    return v * width + u
    # END SOLUTION


# %% tags=["check"]
check("02-1", row_of)

# %% [markdown]
# ## Task 2 — Points out of bytes (3 points)
#
# Write the reader of a PointCloud2 message. You get its bytes and their description. Each point is `point_step` bytes
# long; its x, y, z are three 4-byte floats, one after the other, that begin `x_offset` bytes into the point. Each image row is
# `row_step` bytes long, which may be more than its points need. `big_endian` tells the order of the bytes in a float.
#
# <details><summary>Hint 1: idea</summary>Give the bytes the shape of what they are: rows first, then points. Cut off what is
# padding. Only then read floats.</details>
# <details><summary>Hint 2: formula</summary>(height, row_step) → keep width · point_step → (height · width, point_step) → 12 bytes
# from x_offset</details>
# <details><summary>Hint 3: call</summary><code>np.ascontiguousarray(block).view("&lt;f4")</code> reads little-endian floats,
# <code>"&gt;f4"</code> big-endian ones.</details>


# %% tags=["task"]
def read_points(data, height, width, point_step, row_step, x_offset, big_endian):
    """Points of a PointCloud2 message.

    data : (height * row_step,) uint8, the bytes
    height, width : int, rows and columns of the organised cloud
    point_step, row_step, x_offset : int, bytes
    big_endian : bool
    returns (height * width, 3) float, metres
    """
    # BEGIN SOLUTION
    # rows of bytes; drop the padding at the end of each
    rows = data.reshape(height, row_step)[:, : width * point_step]
    # points of bytes; keep the 12 that hold x, y, z
    xyz = rows.reshape(height * width, point_step)[:, x_offset : x_offset + 12]
    # bytes to floats, in the right byte order
    return np.ascontiguousarray(xyz).view(">f4" if big_endian else "<f4").astype(float)
    # END SOLUTION


# %% tags=["check"]
check("02-2", read_points)

# %% [markdown]
# And on a real cloud: PCL's organised Kinect frame, put into a message as ROS would send it.

# %% tags=["real-data"]
# real data: pcl_tests
from course_lib import pointcloud

# REAL MESSAGE

# %% [markdown]
# ## Task 3 — Mend the way back (2 points)
#
# Somebody wrote the inverse of a pose. It passes a test with a pose that only shifts. With one that also turns, the cloud
# comes back to the wrong place, as the picture shows. Mend it, without `np.linalg.inv`.

# %% tags=["expected", "hide-input"]
turn = np.radians(50)
pose = np.array([[np.cos(turn), 0, np.sin(turn), 0.15], [0, 1, 0, 0.05], [-np.sin(turn), 0, np.cos(turn), 0.1], [0, 0, 0, 1]])
moved = bunny @ pose[:3, :3].T + pose[:3, 3]
came_back = moved @ pose[:3, :3] - pose[:3, 3]
ghost = 1000 * np.linalg.norm(came_back - bunny, axis=1).mean()
show({"where it was": bunny, "where it came back to": came_back}, view="top", frame="world",
     alt=f"Two bunnies seen from above that should be one: {ghost:.0f} mm apart")

# %% [markdown]
# <details><summary>Hint 1: idea</summary>First the shift is undone, then the turn. What does the turn do to the undone shift?</details>
# <details><summary>Hint 2: formula</summary>p = Rᵀ (q − t) = Rᵀ q − Rᵀ t</details>
# <details><summary>Hint 3: call</summary><code>-R.T @ t</code></details>


# %% tags=["task"]
def invert(T):
    """The pose that undoes T.

    T : (4, 4) float, a rotation and a shift in metres
    returns (4, 4) float
    """
    # BEGIN SOLUTION
    back = np.eye(4)
    R, t = T[:3, :3], T[:3, 3]
    back[:3, :3] = R.T
    back[:3, 3] = -R.T @ t
    return back
    # INSTEAD
    #| back = np.eye(4)
    #| R, t = T[:3, :3], T[:3, 3]
    #| back[:3, :3] = R.T
    #| back[:3, 3] = -t
    #| return back
    # END SOLUTION


# %% tags=["check"]
check("02-3", invert)

# %% [markdown]
# ## Task 4 — Which mistake moved it? (2 points)
#
# A cloud should be moved by `R p + t`: turned by 40° to the left, then shifted to the right. The grey cloud shows where it belongs. Each of
# the five others was spoiled by one mistake:
#
# - `"shift first"`: R (p + t)
# - `"inverse"`: the inverse pose
# - `"order"`: first this pose, then a second one that turns by 30° and shifts upwards, instead of the other way round. (The
#   grey cloud of this panel is moved by both in the right order.)
# - `"millimetres"`: the cloud's points are still in millimetres, scaled by one thousand (drawn thirty times too large only, or it would not fit)
# - `"stride"`: read with 12 bytes a point, where there are 16

# %% tags=["expected", "hide-input"]
import matplotlib.pyplot as plt


def pose2(degrees, x, y):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])


def move(T, p):
    return p @ T[:2, :2].T + T[:2, 2]


flat = bunny[::9, [0, 2]] - bunny[:, [0, 2]].mean(axis=0)  # from above
flat = np.column_stack([np.abs(flat).max() * 0 + flat[:, 0], flat[:, 1]]) + [0.1, 0]
first, second = pose2(40, 0.25, 0), pose2(30, 0, 0.2)
floats = np.column_stack([flat, np.zeros((len(flat), 2))]).astype(np.float32).ravel()
strided = floats[: len(floats) // 3 * 3].reshape(-1, 3)[:, :2]
spoiled = {
    "A": (move(first, flat), (flat + first[:2, 2]) @ first[:2, :2].T),
    "B": (move(first, flat), move(np.linalg.inv(first), flat)),
    "C": (move(second, move(first, flat)), move(first, move(second, flat))),
    "D": (move(first, flat), move(first, 30 * flat)),
    "E": (move(first, flat), move(first, strided)),
}
fig, axes = plt.subplots(1, 5, figsize=(13, 3), layout="constrained")
for axis, (letter, (belongs, wrong)) in zip(axes, spoiled.items(), strict=True):
    axis.scatter(*belongs.T, s=1, color="0.65")
    axis.scatter(*wrong.T, s=1, color=show.COLOURS["outlier"])
    axis.plot(0, 0, "k+", ms=10)
    axis.set(title=letter, aspect="equal", xlabel="m")
off = {k: np.linalg.norm(w.mean(axis=0) - b.mean(axis=0)) for k, (b, w) in spoiled.items()}
picture(fig, alt="Five panels, seen from above; grey where the cloud belongs, coloured where it went, a cross at the origin. " + " ".join(
    f"{k}: its middle is {v:.2f} m away." for k, v in off.items())
    + " A keeps the direction of grey. B is turned the other way. C keeps the direction of grey. D is huge. E is torn to pieces.")

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Did it keep its shape? Its size? Its direction? Only then ask for its place.</details>
# <details><summary>Hint 2: formula</summary>R (p + t) and R p + t differ by R t − t, whatever p is.</details>
# <details><summary>Hint 3: call</summary>Return a dict: <code>{"A": "…", …}</code>. Each cause occurs once.</details>


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "E" to the names of their causes."""
    # BEGIN SOLUTION
    return {"A": "shift first", "B": "inverse", "C": "order", "D": "millimetres", "E": "stride"}
    # END SOLUTION


# %% tags=["check"]
check("02-4", causes)

# %% [markdown]
# ## Task 5 — Few points that stand for many (3 points, open-ended)
#
# A robot can afford `n` points of a cloud. Choose them so that no point of the cloud is far from a kept one: return the row numbers of `n`
# different points. You are scored by the loneliest point: its distance to the nearest kept one, as the median over five shapes about
# half a metre long. Under 90 mm earns a third of the points, under 70 mm two thirds, under 55 mm all. Rows drawn blindly reach about 110 mm.
#
# <details><summary>Hint 1: idea</summary>Start with any point. Which point needs help most?</details>
# <details><summary>Hint 2: formula</summary>Keep, for each point, its distance to the nearest kept one. Add the point with the largest; update;
# repeat.</details>
# <details><summary>Hint 3: call</summary><code>np.minimum(distances, np.linalg.norm(points - points[new], axis=1))</code></details>

# %% tags=["expected", "hide-input"]
blind = np.random.default_rng(1).choice(len(bunny), 60, replace=False)
gaps = np.linalg.norm(bunny[::20, None] - bunny[blind], axis=2).min(axis=1)
show((bunny[::20], 1000 * gaps), view="front", title="Distance to the nearest of 60 points drawn blindly, mm",
     alt=f"The loneliest point is {1000 * gaps.max():.0f} mm from a kept one. A good choice would make all colours alike")


# %% tags=["task"]
def few(points, n):
    """Rows of n points that stand for all.

    points : (N, 3) float, metres
    n : int, how many to keep
    returns (n,) int, different row numbers
    """
    # BEGIN SOLUTION
    rows = [0]
    distances = np.linalg.norm(points - points[0], axis=1)
    while len(rows) < n:
        rows.append(int(np.argmax(distances)))
        distances = np.minimum(distances, np.linalg.norm(points - points[rows[-1]], axis=1))
    return np.array(rows)
    # END SOLUTION


# %% tags=["check"]
check("02-5", few)

# %% [markdown]
# ## Task 6 — Explain (2 points, marked by hand)
#
# In at most 60 words: why does an organised cloud hold NaN, and not 0 or nothing at all, where the camera measured nothing?
#
# <details><summary>Hint 1: idea</summary>Try each alternative: what would a mean over the cloud be, and where would pixel (u, v) be?</details>
# <details><summary>Hint 2: formula</summary>Section 2 has both numbers.</details>


# %% tags=["task"]
def explain():
    """Your explanation, at most 60 words."""
    # BEGIN SOLUTION
    return (
        "A zero would be a point at the camera itself; it would enter every mean and every map, and nobody would notice. "
        "Leaving it out would shift all later points, so row v, column u would no longer be found. NaN keeps the place and "
        "spoils any sum loudly, until you leave it out on purpose."
    )
    # END SOLUTION


# %% tags=["check"]
check("02-6", explain)

# %% [markdown]
# ## Handing in
#
# Save the notebook and hand in this one file. Unfinished tasks cost only their own points.
