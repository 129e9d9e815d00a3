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
# Everything you need stands in [lesson 02](../notebooks/02_point_clouds.ipynb). You may use NumPy and `struct`. Clouds are `(N, 3)` arrays of metres.

# %%
from course_lib.notebook import check, data, files, picture, report, show

import struct

import matplotlib.pyplot as plt
import numpy as np

from course_lib.cloud import pointcloud

bunny = data.load("bunny_like").cloud.points.astype(float)

# %% [markdown]
# ## Task 1 — Where is the pixel in the list? (1 point)
#
# An organised cloud of `height` rows and `width` columns is written out as a list, row by row. In which row of the list is the
# point of pixel `(u, v)`? One line is missing. Both `u` and `v` count from 0.
#
# The picture shows an image of 3 rows and 5 columns. Each cell holds its row in the list.

# %% tags=["expected", "hide-input"]
rows_of_cells = np.arange(15).reshape(3, 5)
fig, axis = plt.subplots(figsize=(5, 2.6), layout="constrained")
axis.grid(False)
axis.imshow(rows_of_cells, cmap="Blues", vmin=-4, vmax=24)
for (v, u), row in np.ndenumerate(rows_of_cells):
    axis.text(u, v, row, ha="center", va="center", fontsize=13)
axis.set(xticks=range(5), yticks=range(3), xlabel="column u", ylabel="row v", title="width 5, height 3")
picture(fig, alt=f"A table of 3 rows and 5 columns, numbered along the rows from 0 to {rows_of_cells[-1, -1]}: the second row begins with "
                 f"{rows_of_cells[1, 0]}; u = 2, v = 1 holds {rows_of_cells[1, 2]}.")

# %% [markdown]
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
# The picture shows a message of 2 rows and 3 columns, a square a byte. Only the coloured bytes count.

# %% tags=["expected", "hide-input"]
x_at, step, columns, row_bytes = 4, 20, 3, 68
kinds = np.zeros((2, row_bytes), int)  # 0 padding of the row, 1 other bytes of a point, 2 3 4 x y z
for column in range(columns):
    kinds[:, column * step : (column + 1) * step] = 1
    for part in range(3):
        start = column * step + x_at + 4 * part
        kinds[:, start : start + 4] = 2 + part
palette = np.array([[255, 255, 255], [205, 205, 205], [86, 180, 233], [0, 158, 115], [230, 159, 0]], np.uint8)
fig, axis = plt.subplots(figsize=(11, 2.1), layout="constrained")
axis.grid(False)
axis.imshow(palette[kinds], aspect=2.6)
for edge in range(row_bytes + 1):
    axis.axvline(edge - 0.5, color="0.45" if edge % step else "black", lw=0.5 if edge % step or edge > columns * step else 2.5)
axis.axhline(0.5, color="black", lw=2.5)
for column in range(columns):
    for part, letter in enumerate("xyz"):
        for v in range(2):
            axis.text(column * step + x_at + 4 * part + 1.5, v, letter, ha="center", va="center", fontsize=12)
axis.text(columns * step + (row_bytes - columns * step) / 2 - 0.5, 0, "row\npadding", ha="center", va="center", fontsize=8)
axis.set(yticks=[0, 1], ylabel="row", xlabel="byte of the row", xticks=range(0, row_bytes, 4),
         title=f"point_step {step}, row_step {row_bytes}, x_offset {x_at}")
picture(fig, alt=f"Two rows of {row_bytes} bytes. Each holds {columns} points of {step} bytes; in each point, bytes {x_at} to {x_at + 11} are "
                 f"x, y and z, four bytes each; the last {row_bytes - columns * step} bytes of a row belong to no point.")

# %% [markdown]
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
    returns (height * width, 3) float, metres; what was not measured is NaN in the bytes and stays NaN
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
# And on a real cloud: PCL's organised Kinect frame, put into a message as ROS would send it. Your function reads it.

# %% tags=["real-data"]
# real data: pcl_tests
office, colors = files.read_organised(data.load("pcl_tests").files["office1.pcd"])
structured = np.zeros(office.shape[:2], pointcloud.POINT_TYPES["PointXYZRGB"])
structured["x"], structured["y"], structured["z"] = np.moveaxis(office, -1, 0)
structured["rgb"] = pointcloud.pack_rgb(colors)
message = pointcloud.to_message(structured, row_padding=64)
try:
    mine = read_points(np.frombuffer(message.data, np.uint8), message.height, message.width, message.point_step,
                       message.row_step, message.fields[0].offset, message.is_bigendian)
    same = np.isclose(mine, office.reshape(-1, 3), atol=1e-6, equal_nan=True).all(axis=1)
    report("points of the real message", len(mine))
    report("of them as PCL wrote them", int(same.sum()))
    measured = np.isfinite(mine).all(axis=1)
    display(show((mine[measured], colors.reshape(-1, 3)[measured]), view="camera", frame="camera", title="The office, read by you"))
except NotImplementedError as todo:
    print(todo)

# %% [markdown]
# ## Task 3 — Mend the way back (2 points)
#
# Somebody wrote the inverse of a pose. It passes a test with a pose that only shifts. With one that also turns, the cloud
# comes back to the wrong place, as the picture shows. Mend it, without `np.linalg.inv`.

# %% tags=["expected", "hide-input"]
turn = np.radians(50)
pose = np.array([[np.cos(turn), -np.sin(turn), 0, 0.15], [np.sin(turn), np.cos(turn), 0, 0.05], [0, 0, 1, 0.02], [0, 0, 0, 1]])
moved = bunny @ pose[:3, :3].T + pose[:3, 3]
came_back = moved @ pose[:3, :3] - pose[:3, 3]
ghost = 1000 * np.linalg.norm(came_back - bunny, axis=1).mean()
show.panels({"the pose, and the way back as given": [(bunny, "where it was"), (moved, "moved by the pose"), (came_back, "where it came back to")],
             "the way back mended": [(bunny, "where it was"), (moved, "moved by the pose"), (bunny, "where it came back to")]},
            view="top", frame="world",
            alt=f"Left, the animal that should return to its place lands {ghost:.0f} mm beside it. Right, mended, it covers its old place")

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
# A cloud should be moved by `R p + t`: first turned by 40° to the left, then shifted 0.25 m to the right. The first panel shows how, seen
# from above. In the panels A to E, grey is where it belongs, and one mistake moved the coloured one. The cross is the origin. Which mistake
# was it? Each occurs once. (Mind the numbers on the axes: where the scale is large, grey is too small to see.)
#
# - `"inverse"`: moved by the inverse of the pose
# - `"millimetres"`: the file held millimetres, and was read as if they were metres
# - `"order"`: two poses in the wrong order; this one should come first, and after it a second one that turns by 30° and shifts 0.2 m upwards in
#   the picture (so in this panel grey is moved by both)
# - `"shift first"`: R (p + t)
# - `"stride"`: read with a step (stride) of 12 bytes from point to point, where there are 16

# %% tags=["expected", "hide-input"]
def pose_2d(degrees, x, y):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])


def move(T, p):
    return p @ T[:2, :2].T + T[:2, 2]


centred = 2 * (bunny[::9] - bunny.mean(axis=0))  # a larger one, to see its direction
flat = centred[:, :2]  # from above
first, second = pose_2d(40, 0.25, 0), pose_2d(30, 0, 0.2)
with_padding = np.column_stack([centred, np.zeros(len(centred))]).astype(np.float32)
strided = with_padding.ravel()[: 3 * len(centred)].reshape(-1, 3)[:, :2]
belongs = move(first, flat)
makers = [
    lambda: (belongs, move(first, 1000 * flat), "has the direction of grey"),
    lambda: (belongs, move(first, strided), "is torn into pieces and streaks"),
    lambda: (belongs, move(np.linalg.inv(first), flat), "is turned the other way"),
    lambda: (belongs, (flat + first[:2, 2]) @ first[:2, :2].T, "has the direction of grey"),
    lambda: (move(second, belongs), move(first, move(second, flat)), "has the direction of grey, which is turned by 70 degrees here"),
]
order = np.random.default_rng(1003).permutation(5)
spoiled = {letter: makers[i]() for letter, i in zip("ABCDE", order, strict=True)}
fig, axes = plt.subplots(2, 3, figsize=(9, 6.6), layout="constrained")
for axis, letter in zip(axes.flat, ["right", *spoiled], strict=True):
    if letter == "right":
        turned = flat @ first[:2, :2].T
        for cloud, colour, name in [(flat, "0.85", "given"), (turned, show.COLOURS["source"], "turned"), (belongs, "0.55", "and shifted")]:
            axis.scatter(*cloud.T, s=1, color=colour, label=name)
        axis.legend(markerscale=6, fontsize=8, loc="upper left")
        axis.annotate("", first[:2, 2], (0, 0), arrowprops={"arrowstyle": "-|>", "lw": 2})
    else:
        grey, wrong, _ = spoiled[letter]
        axis.scatter(*grey.T, s=1, color="0.65")
        axis.scatter(*wrong.T, s=1, color=show.COLOURS["outlier"])
    axis.plot(0, 0, "k+", ms=12, mew=2)
    axis.set(title="how it should be" if letter == "right" else letter, aspect="equal", xlabel="m")
    if letter == "right" or np.ptp(wrong) < 10:
        axis.set(xlim=(-0.42, 0.52), ylim=(-0.38, 0.56))
away = {letter: np.linalg.norm(wrong.mean(axis=0) - grey.mean(axis=0)) for letter, (grey, wrong, _) in spoiled.items()}
wide = {letter: np.ptp(wrong[:, 0]) / np.ptp(grey[:, 0]) for letter, (grey, wrong, _) in spoiled.items()}
picture(fig, alt="Six panels, seen from above. The first shows the cloud given, turned by 40 degrees to the left, and shifted to the right. In the others "
        "grey is where it belongs. " + " ".join(f"{letter}: the coloured one's middle is {away[letter]:.2f} m from that of grey, and it is "
        f"{wide[letter]:,.1f} times as wide; it {words}." for letter, (_, _, words) in spoiled.items()))

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Did it keep its shape? Its size? Its direction? Only then ask for its place.</details>
# <details><summary>Hint 2: formula</summary>Follow the middle of the cloud, p = 0: R p + t takes it to t, R (p + t) to R t, the inverse to −Rᵀ t.</details>
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
wave = np.random.default_rng(2).normal(size=(3, 4)) * 2.5
ball = np.random.default_rng(3).normal(size=(9000, 3))
ball /= np.linalg.norm(ball, axis=1, keepdims=True)
dense = np.random.default_rng(4).random(9000) < np.where(ball[:, 0] > 0.3, 0.5, 0.1)
shape = (0.1 * (1 + 0.075 * np.sin(ball @ wave).sum(axis=1))[:, None] * ball * [2.5, 1, 1])[dense][:1500]
blind = np.random.default_rng(1).choice(len(shape), 60, replace=False)
gaps = 1000 * np.linalg.norm(shape[:, None] - shape[blind], axis=2).min(axis=1)
show((shape, gaps), view="front", frame="world", title="Blindly drawn: how far is each point from a kept one?", label="distance", unit="mm", limits=(0, 110), size=7,
     alt=f"A shape as long as half a metre, denser on one side. The loneliest point is {gaps.max():.0f} mm from a kept one, on the sparse side. A good "
         "choice would leave no colour above 55 mm")

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
