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
# Six tasks, about 50 minutes. Each starts from given inputs, so a task that you leave open blocks nothing. Write your code
# where it says `raise NotImplementedError`, run the cell, then run the check below it. The check tells you by how much you
# are off; after a second try also what it looks like, after a third where to read.
#
# Everything you need stands in [lesson 02](../notebooks/02_point_clouds.ipynb), but no task is solved by copying from it: each time something is different. You may use
# NumPy and `struct`, all of both; the course's own library does not count. Clouds are `(N, 3)` arrays of metres.

# %%
from course_lib.notebook import check, data, files, picture, report, show

import struct

import matplotlib.pyplot as plt
import numpy as np

from course_lib.cloud import pointcloud

# %% [markdown]
# ## Task 1 — Where is the pixel in the thinned list? (1 point)
#
# To save data, a camera sends only every `step`-th column and every `step`-th row of its image of `height` rows and `width` columns:
# 0, `step`, 2 · `step`, … The points that are left are written out as a list, row by row. In which row of that list is the point of pixel
# `(u, v)` of the whole image? `u` and `v` are multiples of `step`, and `width` need not be one. Two lines are missing.
#
# The picture shows an image of 5 rows and 8 columns with `step` 3. The numbers are rows of the list.

# %% tags=["expected", "hide-input"]
places = {(v, u): 3 * (v == 3) + u // 3 for v in (0, 3) for u in (0, 3, 6)}
fig, axis = plt.subplots(figsize=(5, 3.2), layout="constrained")
axis.grid(False)
axis.imshow([[0.4 * ((v, u) in places) for u in range(8)] for v in range(5)],
            cmap="Blues", vmin=0, vmax=1)
for (v, u), place in places.items():
    axis.text(u, v, place, ha="center", va="center", fontsize=13)
axis.set(xticks=range(8), yticks=range(5), xlabel="column u", ylabel="row v",
         title="width 8, height 5, step 3")
told = ", ".join(f"{place} in column {u} of row {v}"
                 for (v, u), place in places.items())
picture(fig, alt=f"A table of 5 rows and 8 columns. Six of its cells are "
                 f"numbered: {told}. The others are empty.")

# %% [markdown]
# <details><summary>Hint 1: idea</summary>How many rows of the list lie above the pixel? How many points has each of them?</details>
# <details><summary>Hint 2: formula</summary>Kept columns: 0, step, 2 · step, … below width. Count them for widths 6, 7, 8 and 9 with step 3.</details>


# %% tags=["task"]
def row_of(u, v, width, height, step):
    """Row of the pixel in the thinned list.

    u, v : int, column and row of the pixel in the whole image, from 0;
        multiples of step
    width, height : int, size of the whole image
    step : int, every how many columns and rows one is kept
    returns int
    """
    # BEGIN SOLUTION
    # how many columns are kept
    columns = len(range(0, width, step))
    # full rows of the list come first, then the points to the left
    return v // step * columns + u // step
    # END SOLUTION


# %% tags=["check"]
check("02-1", row_of)

# %% [markdown]
# ## Task 2 — Points out of bytes (3 points)
#
# Write the reader of a PointCloud2 message. You get its bytes and their description. Each point is `point_step` bytes
# long. Its x, y and z are 4-byte floats that begin `offsets[0]`, `offsets[1]` and `offsets[2]` bytes into the point: in any order, and with
# anything between them. Each image row is `row_step` bytes long, which may be more than its points need. `big_endian` tells the order of the
# bytes in a float.
#
# The picture shows a message of 2 rows and 3 columns, a square a byte. Only the coloured bytes count.

# %% tags=["expected", "hide-input"]
offsets, point_step, row_bytes = [8, 16, 0], 20, 68
kinds = np.zeros((2, row_bytes), int)  # 0 padding, 1 others, 2 3 4 x y z
for column in range(3):
    start = column * point_step
    kinds[:, start:start + point_step] = 1
    for axis_number, at in enumerate(offsets):
        kinds[:, start + at:start + at + 4] = 2 + axis_number
palette = np.array([[255, 255, 255], [205, 205, 205], [86, 180, 233],
                    [0, 158, 115], [230, 159, 0]], np.uint8)
fig, axis = plt.subplots(figsize=(11, 2.3), layout="constrained")
axis.grid(False)
axis.imshow(palette[kinds], aspect=2.6)
for edge in range(row_bytes + 1):
    thick = edge % point_step == 0 and edge <= 3 * point_step
    axis.axvline(edge - 0.5, color="black" if thick else "0.45",
                 lw=2.5 if thick else 0.5)
axis.axhline(0.5, color="black", lw=2.5)
for column in range(3):
    for letter, at in zip("xyz", offsets, strict=True):
        for v in range(2):
            axis.text(column * point_step + at + 1.5, v, letter,
                      ha="center", va="center", fontsize=12)
axis.text(63.5, 0, "row\npadding", ha="center", va="center", fontsize=8)
axis.set(yticks=[0, 1], ylabel="row", xlabel="byte of the row",
         xticks=range(0, row_bytes, 4),
         title=f"point_step {point_step}, row_step {row_bytes}, "
               f"offsets {offsets}")
picture(fig, alt=f"Two rows of {row_bytes} bytes. Each holds 3 points of "
                 f"{point_step} bytes. In each point z begins at byte "
                 f"{offsets[2]}, x at {offsets[0]} and y at {offsets[1]}, "
                 "four bytes each, with other bytes between them; the last "
                 f"{row_bytes - 3 * point_step} bytes of a row belong to no "
                 "point.")

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Give the bytes the shape of what they are: rows first, then points. Cut off what is
# padding. Only then read floats, one axis after the other.</details>
# <details><summary>Hint 2: formula</summary>(height, row_step) → keep width · point_step → (height · width, point_step) → 4 bytes
# from each offset</details>
# <details><summary>Hint 3: call</summary><code>np.ascontiguousarray(block).view("&lt;f4")</code> reads little-endian floats,
# <code>"&gt;f4"</code> big-endian ones; <code>np.hstack</code> puts columns side by side.</details>


# %% tags=["task"]
def read_points(data, height, width, point_step, row_step, offsets,
                big_endian):
    """Points of a PointCloud2 message.

    data : (height * row_step,) uint8, the bytes
    height, width : int, rows and columns of the organised cloud
    point_step, row_step : int, bytes
    offsets : (3,) int, bytes from a point's begin to its x, y and z
    big_endian : bool
    returns (height * width, 3) float, metres; what was not measured is
        NaN in the bytes and stays NaN
    """
    # BEGIN SOLUTION
    # rows of bytes; drop the padding at the end of each
    rows = data.reshape(height, row_step)[:, :width * point_step]
    # points of bytes
    rows = rows.reshape(height * width, point_step)
    # bytes to floats, in the right byte order, one axis after the other
    kind = ">f4" if big_endian else "<f4"
    columns = [np.ascontiguousarray(rows[:, at:at + 4]).view(kind)
               for at in offsets]
    return np.hstack(columns).astype(float)
    # END SOLUTION


# %% tags=["check"]
check("02-2", read_points)

# %% [markdown]
# And on a real cloud: PCL's organised Kinect frame, put into a message as ROS would send it. Your function reads it.

# %% tags=["real-data"]
# real data: pcl_tests
office, colors = files.read_organised(
    data.load("pcl_tests").files["office1.pcd"])
structured = np.zeros(office.shape[:2], pointcloud.POINT_TYPES["PointXYZRGB"])
for i, axis_name in enumerate("xyz"):
    structured[axis_name] = office[..., i]
message = pointcloud.to_message(structured, row_padding=64)
try:
    mine = read_points(
        np.frombuffer(message.data, np.uint8), message.height, message.width,
        message.point_step, message.row_step,
        np.array([field.offset for field in message.fields[:3]]),
        message.is_bigendian)
    same = np.isclose(mine, office.reshape(-1, 3), atol=1e-6, equal_nan=True)
    report("points of the real message", len(mine))
    report("of them as PCL wrote them", int(same.all(axis=1).sum()))
    measured = np.isfinite(mine).all(axis=1)
    display(show((mine[measured], colors.reshape(-1, 3)[measured]),
                 view="camera", frame="camera",
                 title="The office, read by you"))
except NotImplementedError as todo:
    print(todo)

# %% [markdown]
# ## Task 3 — Mend the way back (2 points)
#
# A robot carries cameras. `T_world_robot` says where the robot is, each `T_robot_camera` how that camera sits on it. You have points in the
# world; where does each camera see them? Somebody wrote that. It passes a test with one camera and a robot, of which neither turns. In the
# picture it goes wrong. Mend it. It has more than one mistake; `points` must come out of it as they went in.
#
# Left: the world from above. Right, in each camera's own frame, from above: grey is what is asked, orange is what the given code answers.

# %% tags=["expected", "hide-input"]
shown = data.of_lab("02")
fig, axes = plt.subplots(1, 3, figsize=(11, 3.9), layout="constrained")
axes[0].scatter(*shown["world"].T[:2], s=1, color="0.6")
for name, pose in zip(["robot", "camera 1", "camera 2"], shown["poses"],
                      strict=True):
    tip = pose[:2, 0 if name == "robot" else 2]  # where it looks, from above
    axes[0].annotate("", pose[:2, 3] + 0.45 * tip, pose[:2, 3],
                     arrowprops={"arrowstyle": "-|>", "lw": 2})
    at = pose[:2, 3] + (-0.2 if name == "robot" else 0.55) * tip
    axes[0].text(*at, name, ha="center", va="center")
axes[0].set(title="the world, from above", xlabel="x (m)", ylabel="y (m)",
            xlim=(-0.4, 2.4), ylim=(-0.1, 2.6), aspect="equal")
told = []
for k, axis in enumerate(axes[1:]):
    for cloud, colour in [(shown["asked"][k], "0.6"),
                          (shown["came"][k], show.COLOURS["outlier"])]:
        axis.scatter(cloud[:, 0], cloud[:, 2], s=1, color=colour)
    axis.plot(0, 0, "k^", ms=9)
    axis.set(title=f"as camera {k + 1} has it", xlabel="x (m), to its right",
             ylabel="z (m), ahead", aspect="equal", xlim=(-1.4, 2.4),
             ylim=(-2.8, 1.9))
    off = np.linalg.norm((shown["came"] - shown["asked"])[k], axis=1).mean()
    told.append(f"In the frame of camera {k + 1} it comes out {off:.1f} m "
                "from where it belongs.")
picture(fig, alt="An animal, a robot before it, and two cameras on the robot, "
                 "one looking ahead and one to its left. " + " ".join(told))

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Try it with one camera first, then with two. What is `points` when the loop comes to the second
# camera?</details>
# <details><summary>Hint 2: formula</summary>T_world_camera = T_world_robot · T_robot_camera; p_camera = Rᵀ (p_world − t). Points are rows: what
# does `@ R.T` do to a row, and what `@ R`?</details>
# <details><summary>Hint 3: call</summary><code>points - t</code> makes a new array, <code>points -= t</code> changes the one that was
# given.</details>


# %% tags=["task"]
def invert(T_world_robot, T_robot_cameras, points):
    """Points of the world as each camera of a robot has them.

    T_world_robot : (4, 4) float, a rotation and a shift in metres
    T_robot_cameras : (K, 4, 4) float, of K cameras
    points : (N, 3) float, metres, in the world's frame; not to be changed
    returns (K, N, 3) float, metres, in the frame of each camera
    """
    # BEGIN SOLUTION
    seen = []
    for T_robot_camera in T_robot_cameras:
        T = T_world_robot @ T_robot_camera
        seen.append((points - T[:3, 3]) @ T[:3, :3])
    return np.array(seen)
    # INSTEAD
    #| seen = []
    #| for T_robot_camera in T_robot_cameras:
    #|     T = T_robot_camera @ T_world_robot
    #|     points -= T[:3, 3]
    #|     points = points @ T[:3, :3].T
    #|     seen.append(points)
    #| return np.array(seen)
    # END SOLUTION


# %% tags=["check"]
check("02-3", invert)

# %% [markdown]
# ## Task 4 — Which mistake moved it? (2 points)
#
# A cloud should be moved by `R p + t`: first turned by 40° to the left, then shifted 0.25 m to the right. The first panel shows how, seen
# from above. In the panels A to E, grey is where it belongs, and one mistake moved the orange one. The cross is the origin. Which mistake
# was it? Each occurs once. (Mind the numbers on the axes: where the scale is large, grey is too small to see.)
#
# - `"inverse"`: moved by the inverse of the pose
# - `"millimetres"`: the file held millimetres, and was read as if they were metres
# - `"order"`: two poses in the wrong order; this one should come first, and after it a second one that turns by 30° and shifts 0.2 m upwards in
#   the picture (so in this panel grey is moved by both)
# - `"shift first"`: R (p + t)
# - `"stride"`: read with a step (stride) of 12 bytes from point to point, where there are 16

# %% tags=["expected", "hide-input"]
shown = data.of_lab("02")
fig, axes = plt.subplots(2, 3, figsize=(9, 6.6), layout="constrained")
for name, colour in [("start", "0.85"), ("turned", "black"), ("right", "0.6")]:
    label = {"start": "given", "right": "and shifted"}.get(name, name)
    axes[0, 0].scatter(*shown[name].T, s=1, color=colour, label=label)
axes[0, 0].legend(markerscale=6, fontsize=8, loc="upper left")
axes[0, 0].annotate("", shown["shift"], (0, 0),
                    arrowprops={"arrowstyle": "-|>", "lw": 2})
told = []
for letter, axis in zip("ABCDE", axes.flat[1:], strict=True):
    grey, moved = shown[f"right_{letter}"], shown[f"wrong_{letter}"]
    axis.scatter(*grey.T, s=1, color="0.6")
    axis.scatter(*moved.T, s=1, color=show.COLOURS["outlier"])
    # the turn and scale that bring grey nearest to the orange one
    a, b = [(p - p.mean(axis=0)) @ [1, 1j] for p in (grey, moved)]
    best = np.vdot(a, b) / np.vdot(a, a)
    rest = np.linalg.norm(b - best * a) / np.linalg.norm(b)
    x, y = moved.mean(axis=0)
    told.append(
        f"{letter}: its middle is at ({x:.2f}, {y:.2f}), that of grey at "
        f"({grey[:, 0].mean():.2f}, {grey[:, 1].mean():.2f}); " + (
            f"it is grey turned by {np.degrees(np.angle(best)):.0f} degrees "
            f"and {abs(best):,.0f} times as large." if rest < 0.1 else
            "no turn and no scale makes grey of it."))
for axis, letter in zip(axes.flat, ["how it should be", *"ABCDE"],
                        strict=True):
    axis.plot(0, 0, "k+", ms=12, mew=2)
    axis.set(title=letter, aspect="equal", xlabel="m")
    if np.abs(axis.dataLim.get_points()).max() < 10:
        axis.set(xlim=(-0.42, 0.52), ylim=(-0.38, 0.56))
picture(fig, alt="Six panels, seen from above. The first shows the cloud "
                 "given, turned by 40 degrees to the left, and shifted to "
                 "the right. " + " ".join(told))

# %% [markdown]
# <details><summary>Hint 1: idea</summary>Did it keep its shape? Its size? Its direction? Only then ask for its place.</details>
# <details><summary>Hint 2: formula</summary>Follow the middle of the cloud, p = 0: R p + t takes it to t, R (p + t) to R t, the inverse to −Rᵀ t.</details>
# <details><summary>Hint 3: call</summary>Return a dict: <code>{"A": "…", …}</code>. Each cause occurs once.</details>


# %% tags=["task"]
def causes():
    """A dict from the letters "A" to "E" to the names of their causes."""
    # BEGIN SOLUTION
    return {
        "A": "shift first",
        "B": "inverse",
        "C": "order",
        "D": "millimetres",
        "E": "stride",
    }
    # END SOLUTION


# %% tags=["check"]
check("02-4", causes)

# %% [markdown]
# ## Task 5 — Few points that stand for many (3 points, open-ended)
#
# A robot can afford `n` points of a cloud. Choose them so that no point of the cloud is far from a kept one: return the row numbers of `n`
# different points. You are scored by the loneliest point: its distance to the nearest kept one, in the **worst of seven** fresh shapes about
# half a metre long (the check shows three). Under 100 mm earns a third of the points, under 80 mm two thirds, under 65 mm all. Every 25th row
# of the list leaves some point more than 100 mm away.
#
# <details><summary>Hint 1: idea</summary>Start with any point. Which point needs help most?</details>
# <details><summary>Hint 2: formula</summary>Keep, for each point, its distance to the nearest kept one. Add the point with the largest; update;
# repeat.</details>
# <details><summary>Hint 3: call</summary><code>np.minimum(old, new)</code> takes the smaller of each pair; <code>np.linalg.norm(…, axis=1)</code>
# is a length for each row.</details>

# %% tags=["expected", "hide-input"]
shown = data.of_lab("02")
gaps = 1000 * shown["gaps"]
show((shown["shape"], gaps), view="front", frame="world",
     title="Blindly drawn: how far is each point from a kept one?",
     label="distance", unit="mm", limits=(0, 110), size=7,
     alt="A shape as long as half a metre, denser on one side. The loneliest "
         f"point is {gaps.max():.0f} mm from a kept one, on the sparse side. "
         "A good choice would leave no colour above 65 mm")


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
        new = np.linalg.norm(points - points[rows[-1]], axis=1)
        distances = np.minimum(distances, new)
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
        "A zero would be a point at the camera itself; it would enter every "
        "mean and every map, and nobody would notice. Leaving it out would "
        "shift all later points, so row v, column u would no longer be "
        "found. NaN keeps the place and spoils any sum loudly, until you "
        "leave it out on purpose."
    )
    # END SOLUTION


# %% tags=["check"]
check("02-6", explain)

# %% [markdown]
# ## Handing in
#
# Save the notebook and hand in this one file. Unfinished tasks cost only their own points.
