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
# # 02 Point clouds
#
# **You will be able to open any point cloud, say what every byte of it means, put two of them into one frame, and notice
# when somebody did it wrong.**

# %%
from course_lib.notebook import data, files, picture, predict
from course_lib.notebook import report, report_table, show

import struct
import tempfile
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d

from course_lib.camera import pinhole
from course_lib.cloud import pointcloud
from course_lib.geometry import transforms
from course_lib.surface import metrics

bunny = data.load("bunny_like")
show(bunny.cloud, views=["front", "side", "top"], color="height",
     title="A point cloud is a list of places")

# %% [markdown]
# You see a small animal. The computer sees a list of places, without any idea which of them belong together. All
# later lessons start from such a list.
#
# ## Card
#
# | | |
# |---|---|
# | You will | read a PLY file and count its points; find a pixel in an organised cloud; find a point's bytes in a PointCloud2 message; name four sensors that make clouds, and their errors; move a cloud between frames and back, to a micrometre |
# | Minutes | 58 for the core (all before *Going further*), 50 for the lab; counted are reading, looking and typing, not trying things out |
# | Before | lesson 01 (depth images, no data) |
# | Teaches | the report, sections 4 and 5; the lecture, "Point cloud" to "Point Cloud Data Structures" |
# | Data | `bunny_like`, `living_room` (simulated, with truth); the Stanford bunny and PCL's Kinect clouds (real) |
#
# <details><summary>Lesson 01: what does 0 mean in a depth image?</summary>No data. Not "very near", and not "the farthest
# point".</details>
#
# <details><summary>Lesson 01: depth or range, which one does a depth image hold?</summary>Depth: z, the length along
# the direction in which the camera looks.</details>

# %% [markdown]
# ## 1 A list of points
#
# A **point cloud** is an $N \times 3$ array: one row a point, its x, y and z in metres.

# %%
points = bunny.cloud.points
print(points[:3])
report("points", len(points))
report("length of the animal", 1000 * np.ptp(points[:, 0]), "mm")
report("memory", points.nbytes / 1e6, "MB")

# %% [markdown]
# In a file, the numbers need a description. The oldest one in wide use is the **PLY** file: a header in plain text that says
# what follows, then the numbers. Write the smallest one by hand. Then save the animal, and look at its header:

# %%
tiny = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


def count(header, element):
    """How many of an element a PLY header announces."""
    return int(header.split(f"element {element} ")[1].split()[0])


assert count(tiny, "vertex") == 3 and count(tiny, "face") == 1

path = files.write_mesh(Path(tempfile.mkdtemp()) / "animal.ply", bunny.mesh)
header = path.read_bytes().split(b"end_header")[0].decode("ascii")
print(header)

cloud = o3d.io.read_point_cloud(str(path))
assert len(cloud.points) == count(header, "vertex")
assert len(cloud.points) == len(files.read_cloud(path))
report("points read by Open3D", len(cloud.points))

# %% [markdown]
# Vertices are the points: here each has a place, a normal and a colour. Faces are triangles between vertices, about twice
# as many. They belong to a mesh (lesson 08). A file with faces is still a cloud for whoever reads only its vertices, as Open3D did
# here. The number of points read must equal the header's vertex count.
#
# A point may carry more than its place: a colour, a normal (the direction in which the surface faces), an intensity, a time.
# These are its **attributes**, each an array with one row a point. Rows belong together: sort one array alone, and the colours
# sit on the wrong points.
#
# ## 2 Ordered and unordered
#
# A depth camera gives one point a pixel, so its cloud can keep the shape of the image: $H \times W \times 3$. It is then
# ordered, an **organised cloud**. A pixel without data keeps its place and holds NaN, "not a number". Here is
# one from the simulated room. (Lesson 03 writes `deproject`, which makes it.)

# %%
room = data.load("living_room")
frame = room.frames[0]
organised = pinhole.deproject(frame.depth, frame.camera)
print(organised.shape)
missing = float(np.isnan(organised[..., 2]).mean())
report("points that are NaN", 100 * missing, "%")
parts = {"x, to the right": 0, "y, down": 1, "z, forward": 2}
show.images({name: organised[..., i] for name, i in parts.items()},
            unit="m", title="An organised cloud is three images",
            alt="x grows from left to right, y from top to bottom, z with "
                "distance")

# %% [markdown]
# What is the order good for? Neighbours come for free: the point right of pixel (u, v) is at (u + 1, v). In an unordered cloud,
# a plain list, you have to search for them. And there is a rule between the two. Written row by row, pixel (u, v) becomes row
#
# $$i = v \cdot W + u$$
#
# of the list: $v$ full rows of $W$ pixels come before its own row, and $u$ pixels stand before it there.


# %%
def row_of(u, v, width):
    """Row of pixel (u, v) in the list made from an organised cloud."""
    return v * width + u


assert row_of(u=0, v=1, width=640) == 640  # the first of the second row
listed = organised.reshape(-1, 3)
u, v, width = 200, 100, organised.shape[1]
in_list = listed[row_of(u, v, width)]
assert np.array_equal(in_list, organised[v, u], equal_nan=True)

kept = listed[np.isfinite(listed).all(axis=1)]  # unordered: rows moved up
beside = np.linalg.norm(organised[:, 1:] - organised[:, :-1], axis=2)
report("points in the list", len(kept))
report("median distance to the pixel on the right",
       1000 * np.nanmedian(beside), "mm")
z = listed[:, 2]
report("mean z, NaN left in", z.mean(), "m")
report("mean z, NaN left out", kept[:, 2].mean(), "m", digits=4)
report("mean z, zeros for NaN", np.nan_to_num(z).mean(), "m", digits=4)

# %% [markdown]
# One NaN makes every sum, mean and minimum NaN ("not measured", says `report`). Better than the last line: a zero lies, unnoticed. Leaving NaN out costs the order for good. Keep the organised cloud as long as you can.
#
# ## 3 Points as bytes
#
# Robots send clouds as bytes. C++ programs that use PCL, the Point Cloud Library, keep each point as fields at fixed places. These are
# its common types. Ask them for their size:

# %%
types = pointcloud.POINT_TYPES
report_table([[name, ", ".join(kind.names), kind.itemsize]
              for name, kind in types.items()],
             columns=["point type", "fields", "bytes a point"])

# %% [markdown]
# No type is as long as its numbers. Three floats of 4 bytes are 12 bytes, but PCL's PointXYZ takes 16. The processor likes to load 16 bytes at once, so PCL adds four
# that mean nothing: **padding**. PointXYZI takes 32: its intensity starts a new block of 16, and 12 bytes of that are padding. Colour is odder still: red, green and blue, a byte each, stored in the bits of one float.

# %%
three = np.zeros(3, types["PointXYZ"])
three["x"], three["z"] = [1, 2, 3], [10, 20, 30]
assert len(three.tobytes()) == 48
print(np.frombuffer(three.tobytes(), np.float32))  # x y z padding, 3 times

orange = pointcloud.pack_rgb(np.array([[255, 128, 0]], np.uint8))
assert hex(orange.view(np.uint32)[0]) == "0xff8000"  # red, green, blue
report("orange, if you read the float as a number", float(orange[0]),
       smallest=0)

# %% [markdown]
# ROS, the Robot Operating System, sends a **PointCloud2** message: the bytes, and a description of them. `point_step` says how many
# bytes lie between one point and the next, `row_step` between one image row and the next, and each field has its offset in
# the point: fields may stand in any order, with anything between them. A commitment first: how much data is a cloud of 640x480 PointXYZRGB, 30 times a second?

# %%
rate_guess = predict("How many megabytes a second?", guess=None, unit="MB/s")

# %% tags=["hide-input", "prediction"]
# The answer: run this after your guess.
colored = types["PointXYZRGB"]
rate_guess.answer(
    640 * 480 * 30 * colored.itemsize / 1e6,
    why="Each point takes 32 bytes, and only 15 of them mean something. "
        "That is why robots downsample first (lesson 04).")

# %%
structured = np.zeros(organised.shape[:2], colored)
for i, axis in enumerate("xyz"):
    structured[axis] = organised[..., i]
structured["rgb"] = pointcloud.pack_rgb(frame.color)
message = pointcloud.to_message(structured, frame_id="camera")
report_table([[field.name, field.offset] for field in message.fields],
             columns=["field", "offset (bytes)"],
             title=f"point_step {message.point_step} bytes, "
                   f"row_step {message.row_step:,} bytes")


def point_at(message, u, v):
    """x, y, z of pixel (u, v); little-endian, y and z right behind x."""
    start = v * message.row_step + u * message.point_step
    start += message.fields[0].offset
    return struct.unpack_from("<3f", message.data, start)


in_bytes = point_at(message, u, v)
assert np.array_equal(in_bytes, organised[v, u], equal_nan=True)

rows = np.frombuffer(message.data, np.uint8).reshape(-1, message.point_step)
block = np.ascontiguousarray(rows[:, :12])  # of each point, x y z
by_library = pointcloud.message_to_xyz(message)
assert np.array_equal(block.view("<f4"), listed, equal_nan=True)
assert np.array_equal(by_library, listed, equal_nan=True)

# %% [markdown]
# The table says where each field begins: nothing lies between x, y and z here, and 4 bytes before the colour. `point_at` is the same rule as
# before, counted in bytes. `<` says little-endian, the least significant byte first, as in almost every computer
# today, `>` big-endian; a message may be either. The last lines read all points at once: `ascontiguousarray` puts the bytes side by
# side, and `view` takes them for floats. Ignore any of these, and there is no error message: bytes are bytes (see "Report against reality").
#
# ## 4 Where clouds come from
#
# Three ways to measure a distance, four sensors, one room.
#
# - A **laser scanner** (LiDAR) sends pulses and times their way back. Each gives a range, along a known direction. It turns, so it sees all
#   around: rings of points.
# - **Structured light**: a projector shines stripes, a camera sees where they land. Each pixel's ray and its stripe's ray meet in
#   the point.
# - **Stereo**: two photographs from two places. A pixel that is found in both gives two rays, and they meet in the point.
# - A depth camera, such as the D455, is stereo whose projector throws infrared dots, so that blank walls have something to match.
#
# The code of these four pictures is folded; lesson 14 explains it.

# %% tags=["hide-input"]
from course_lib.simulate import scenes, sensors

scene, camera = scenes.living_room(7), frame.camera
T_world_camera = room.poses[0]
rng = np.random.default_rng(2)

T_world_laser = T_world_camera.copy()
T_world_laser[:3, :3] = np.eye(3)  # where the camera stands, z up
scan = sensors.laser_scan(scene, T_world_laser,
                          np.radians(np.linspace(-30, 15, 24)), rng=rng)

projector = camera.scaled(1280, 960)
step_right = transforms.from_rotation_translation(np.eye(3), [0.15, 0, 0])
lit = sensors.structured_light(
    scene, camera, T_world_camera, projector, T_world_camera @ step_right,
    sensors.stripes(1280, 960, period=40), strength=4, room_light=0.08)

pair = sensors.stereo_pair(scene, camera, T_world_camera, baseline=0.095)
dotted = sensors.infrared_dots(scene, camera, T_world_camera, rng)

swept = transforms.apply(T_world_laser, scan.points)
overlaid = cv2.addWeighted(pair.left.color, 0.5, pair.right.color, 0.5, 0)
near_far = [pair.disparity[pair.disparity > 0].max(),
            pair.disparity[pair.disparity > 0].min()]
fig, axes = plt.subplots(2, 2, figsize=(11, 8.8), layout="constrained")
low = swept[:, 2] < 2.2
axes[0, 0].scatter(*swept[low, :2].T, s=2)
axes[0, 0].plot(*T_world_laser[:2, 3], "k+", ms=14, mew=3)
axes[0, 0].set(title="laser scanner, from above: rings", aspect="equal",
               xlabel="x (m)", ylabel="y (m)")
for axis, (title, image) in zip(axes.flat[1:], {
        "structured light: stripes bend": lit.image,
        "stereo: both photographs, overlaid": overlaid,
        "depth camera: infrared dots": dotted}.items(), strict=True):
    axis.imshow(image, cmap="gray")
    axis.set(title=title, xticks=[], yticks=[])
picture(fig, alt=f"Four sensors, one room. The laser's {len(scan.points):,} "
                 f"points lie in {scan.rings.max() + 1} rings all around it. "
                 "The stripes break at the edge of the table and bend over "
                 "the round things. The two photographs show everything "
                 f"twice, {near_far[1]:.0f} pixels apart far away and "
                 f"{near_far[0]:.0f} near by. The dots cover everything, "
                 "blank walls too.")

# %% [markdown]
# Stripes and stereo give a point where two rays meet. Finding it is called triangulation. Seen from above:

# %% tags=["hide-input"]
B, apart, deep = 0.5, 0.25, 2  # baseline, slopes' difference, depth (m)
fig, axis = plt.subplots(figsize=(7, 3.6), layout="constrained")
axis.grid(False)
for left, slope, high, colour in [(0, 0.5, deep + 0.28, "#0072B2"),
                                  (B, 0.25, deep + 0.08, "#E69F00")]:
    axis.plot([left, left + 1.15 * slope * deep], [0, 1.15 * deep],
              color=colour, lw=2)
    axis.plot([left, left], [0, high], ":", color="0.6")
    axis.plot(left, 0, "^", color=colour, ms=14)
    axis.annotate("", (left + slope * deep, high), (left, high),
                  arrowprops={"arrowstyle": "<|-|>", "color": colour})
axis.text(0.4, deep + 0.32, "a z", color="#0072B2", fontsize=14)
axis.text(0.68, deep + 0.11, "b z", color="#E69F00", fontsize=14)
both_ways = {"arrowstyle": "<|-|>", "color": "black"}
axis.annotate("", (B, -0.25), (0, -0.25), arrowprops=both_ways)
axis.text(B / 2, -0.45, "B", fontsize=14, ha="center")
axis.annotate("", (1.35, deep), (1.35, 0), arrowprops=both_ways)
axis.text(1.4, deep / 2, "z", fontsize=14)
axis.plot(0.5 * deep, deep, "ko", ms=9)
axis.text(-0.08, 0, "camera", ha="right", va="center")
axis.text(B + 0.08, 0, "second camera, or projector", va="center")
axis.set(xlim=(-0.6, 1.9), ylim=(-0.5, 2.6), title="Two rays meet in a point")
axis.axis("off")
picture(fig, alt=f"Seen from above: a camera, and a second one {B} m to its "
                 f"right. A ray from each meets the other {deep} m ahead: "
                 f"{0.5 * deep:g} m to the right of the first, which is "
                 f"{B + 0.25 * deep - B:g} m to the right of the second.")

# %% [markdown]
# For each metre ahead, the first ray goes $a$ metres to the right, the second $b$. At depth $z$ the first is $a z$ to the right of its
# camera, the second $b z$ to the right of its own, which stands a baseline $B$ farther right. They meet where
# $a z = b z + B$, so $z = B / (a - b)$.


# %%
def meet(a, b, baseline):
    """Depth where rays of slopes a and b meet; 0 if nowhere."""
    z = baseline / np.where(a - b > 1e-3, a - b, np.nan)
    return np.nan_to_num(z).astype(np.float32)


assert meet(0.5, 0.25, baseline=0.5) == 2  # as drawn

# %% [markdown]
# Which $b$ belongs to an $a$? Structured light reads it from the stripes. Stereo searches: along the same image row of the
# second photograph, for what looks like the surroundings of the pixel. OpenCV's `StereoSGBM` does that, and gives for each pixel by how
# many pixels it has moved, its disparity $d$. A pixel is $1/f$ of slope wide, so $a - b = d / f$. (The folded cell prepares both.)

# %% tags=["hide-input"]
pixel = (np.arange(640) - camera.cx) / camera.fx
a = np.broadcast_to(pixel, (480, 640))  # slope of each pixel's ray
column = np.round(lit.projector_uv[..., 0])  # decoding gives no more
b_stripes = (column - projector.cx) / projector.fx
matcher = cv2.StereoSGBM.create(numDisparities=96, blockSize=5, P1=200,
                                P2=800, uniquenessRatio=10)
grey = [cv2.cvtColor(one.color, cv2.COLOR_RGB2GRAY)
        for one in (pair.left, pair.right)]
disparity = matcher.compute(*grey) / 16
disparity[disparity <= 0] = np.nan  # not found

# %%
depths = {
    "structured light": meet(a, b_stripes, baseline=0.15),
    "stereo": meet(a, a - disparity / camera.fx, pair.baseline),
    "depth camera": frame.depth,
}
clouds = {"laser scanner": (swept, scan.points)}
for name, depth in depths.items():
    near = np.where(depth < 10, depth, 0)
    local = pinhole.deproject_compact(near, camera)
    clouds[name] = transforms.apply(T_world_camera, local), local
results = []
for name, (placed, local) in clouds.items():
    errors = 1000 * metrics.distance_to_surface(placed, room.mesh)
    farthest = np.linalg.norm(local, axis=1).max()
    results.append([name, len(placed), farthest, np.median(errors),
                    np.quantile(errors, 0.95)])
report_table(results, columns=["sensor", "points", "farthest (m)",
                               "median error (mm)", "95 % below (mm)"],
             digits=2)

# %% [markdown]
# Read the columns against each other. The laser has few points, and few large errors, near or far. The others have a point for most pixels, and a
# long tail of bad ones at the edges.
#
# ## 5 Frames and transforms
#
# A point such as (0, 0.5, 2) means nothing until you say in whose **frame**. A frame is an origin and three directions. The camera's:
# x right, y down, z forward. The world's, here the room's: z up. Same point, different numbers. The third axis stands on the page: the
# camera's x comes out of it towards you (a dot, the tip of the arrow), the world's y goes into it (a cross, the arrow's tail).

# %% tags=["hide-input"]
ahead, down, height = 2, 0.5, 1.5  # metres
along, up = ahead, height - down
red, green, blue = "#D55E00", "#009E73", "#0072B2"  # x, y, z, as in `show`
fig, axis = plt.subplots(figsize=(8, 4.2), layout="constrained")
axis.grid(False)
axis.plot([-0.3, 2.7], [-0.13, -0.13], color="0.7", lw=1)  # the floor
axis.plot([0, along, along], [height, height, up], ":", color="0.4")
axis.plot([0, along, along], [0, 0, up], ":", color="0.4")
for y, arrows in [(0, {"x": (0.5, 0, red), "z": (0, 0.5, blue)}),
                  (height, {"z": (0.5, 0, blue), "y": (0, -0.5, green)})]:
    for name, (dx, dy, colour) in arrows.items():
        axis.annotate("", (dx, y + dy), (0, y),
                      arrowprops={"arrowstyle": "-|>", "lw": 2.5,
                                  "color": colour})
        axis.text(dx + (0.08 if dy else 0), y + dy + (0.05 if dx else 0),
                  name, color=colour, fontsize=13, weight="bold",
                  ha="center", va="bottom" if dx else "center")
for y, colour, mark, words in [
        (height, red, ".", "x, towards you"), (0, green, "x", "y, away")]:
    axis.plot(0, y, "o", ms=17, mfc="white", mec=colour, mew=2.5)
    axis.plot(0, y, mark, ms=8, color=colour, mew=2.5)
    axis.text(-0.1, y, words, color=colour, ha="right", va="center",
              fontsize=12, weight="bold")
axis.plot([along], [up], "ko", ms=10)
for place, words in [
        ((0, height + 0.17), "camera"), ((0, -0.3), "world"),
        ((1.15, height + 0.06), f"{ahead} forward"),
        ((along + 0.05, height - 0.25), f"{down} down"),
        ((1.15, 0.06), f"{along} along"),
        ((along + 0.05, 0.45), f"{up:g} up"), ((-0.5, 0.75), f"{height} m")]:
    axis.text(*place, words, fontsize=11)
axis.text(along + 0.1, up - 0.07,
          f"camera: (0, {down}, {ahead})\nworld: ({along}, 0, {up:g})",
          fontsize=11)
axis.set(xlim=(-0.8, 3.1), ylim=(-0.35, 1.85), aspect="equal",
         title="One point, two frames, seen from the side")
axis.axis("off")
picture(fig, alt=f"Seen from the side: the world's origin on the floor, x to "
                 f"the right, z up, y away from you; the camera {height} m "
                 "above it, z to the right, y down, x towards you. A point "
                 f"{ahead} m ahead of the camera and {down} m below its axis "
                 f"is (0, {down}, {ahead}) for the camera and "
                 f"({along}, 0, {up:g}) for the world.")

# %% [markdown]
# Both frames are right-handed: thumb, first and middle finger of your right hand, spread at right angles, can be x, y and z of either.
# All frames of this course are. In a left-handed one everything is a mirror image.
#
# To go from camera to world, turn, then shift: $p_{world} = R\,p_{camera} + t$. The shift $t$ is where the camera stands. The turn $R$ is a
# **rotation matrix**: its three columns are the camera's x, y and z directions, as the world sees them. For the camera above they are
# $(0,-1,0)$, $(0,0,-1)$ and $(1,0,0)$. Take so much of each as the point says:
#
# $$0\begin{bmatrix}0\\-1\\0\end{bmatrix} + 0.5\begin{bmatrix}0\\0\\-1\end{bmatrix} + 2\begin{bmatrix}1\\0\\0\end{bmatrix}
# = \begin{bmatrix}2\\0\\-0.5\end{bmatrix}$$
#
# That sum is $R\,p$. Plus $t = (0, 0, 1.5)$, it gives $(2, 0, 1)$, as drawn.
#
# The camera's **pose** is one 4x4 matrix: $R$ and $t$ side by side, and a last row 0 0 0 1 that makes such matrices multiply: `A @ B` does B
# first, then A. We call it `T_world_camera`: it takes camera coordinates and gives world coordinates. Read such names from right to left.


# %%
def apply(T, points):
    """Points (N, 3) moved by the pose T (4, 4)."""
    # points are rows, so R comes from the right, transposed
    return points @ T[:3, :3].T + T[:3, 3]


# the camera of the drawing: its x, y, z as the world sees them; its place
T_drawn = np.array([[0, 0, 1, 0],
                    [-1, 0, 0, 0],
                    [0, -1, 0, 1.5],
                    [0, 0, 0, 1]])
drawn = np.array([[0, 0.5, 2], [0.3, 0.5, 2]])  # the second: to its right
assert apply(T_drawn, drawn).tolist() == [[2, 0, 1], [2, -0.3, 1]]

T = room.poses[0]
by_open3d = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(kept))
by_open3d = by_open3d.transform(T)
assert np.allclose(apply(T, kept), by_open3d.points, atol=1e-6)

# %% [markdown]
# The way back is the inverse. A rotation is undone by its transpose: its columns have length 1 and stand at right angles, so $R^T R$ is the
# identity. But the shift was made *after* the turn, in the world's
# directions, so it must be turned back, too:
#
# $$T^{-1} = \begin{bmatrix} R^T & -R^T t \\ 0 & 1 \end{bmatrix}$$


# %%
def invert(T):
    """The pose that undoes T."""
    back = np.eye(4)
    back[:3, :3] = T[:3, :3].T
    back[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return back


assert np.allclose(invert(T_drawn) @ T_drawn, np.eye(4))
assert np.allclose(invert(T), transforms.invert(T))
assert np.allclose(invert(T), np.linalg.inv(T))

# %% [markdown]
# `points - t` makes a new array. `points -= t` changes the one that you were given, for everybody who still holds it; and a slice such as
# `T[:3, :3]` is no copy, either. So the lines above start from a fresh `np.eye(4)`.
#
# Poses chain. If a camera sits on a robot, `T_world_robot @ T_robot_camera` is `T_world_camera`: where two names meet, the frames must be equal.
#
# Vote: a pose turns by 90° and shifts by 1 m. What does $R\,p + t$ do to a point? (a) It shifts first, then turns. (b) It turns first,
# then shifts. (c) The order makes no difference. (d) It depends on p.
#
# <details><summary>Answer</summary>
# (b). Shifting first would be R(p + t): then the shift is turned, too. (c) holds only without a turn, or without a shift. (d) mixes up
# what moves with how: the same recipe for every point.
# </details>
#
# Now two RGB-D images (also called frames) of the hand-held camera. In the world they must meet. The picture is a floor plan: we draw what lies between 0.1 and 1.9 m
# above the floor.

# %%
seen = {i: pointcloud.from_frame(room.frames[i]).points for i in (0, 20)}
world = {i: apply(room.poses[i], seen[i]) for i in seen}
as_if_still = apply(room.poses[0], seen[20])


def plan(points, like=None):
    """The points between 0.1 and 1.9 m above the floor, there or in `like`."""
    heights = (points if like is None else like)[:, 2]
    return points[(heights > 0.1) & (heights < 1.9)]


image_0 = plan(world[0]), "image 0"
show.panels({
    "as if the camera had not moved":
        [image_0, (plan(as_if_still, like=world[20]), "image 20")],
    "each by its own pose": [image_0, (plan(world[20]), "image 20")],
}, view="top", frame="world")

# %% [markdown]
# This is why robots like clouds. With every cloud in one frame, a map is a list of points (navigation), an obstacle is a point above
# the floor and below the robot's head (avoiding it, planning a path), and a thing on the table is a group of points with a place and a size
# (finding, recognising, grasping it). How near is the first obstacle, and is it really there?

# %%
def first_obstacle(points, standing):
    """Metres along the floor to the first point 0.1 to 1.2 m above it."""
    risen = points[(points[:, 2] > 0.1) & (points[:, 2] < 1.2)]
    return np.linalg.norm(risen[:, :2] - standing, axis=1).min()


on_floor_too = np.array([[3, 4, 0.5], [1, 0, 0.0]])
assert first_obstacle(on_floor_too, standing=np.zeros(2)) == 5
in_truth = pinhole.deproject_compact(room.truth["depth"][0], camera)
in_truth, here = apply(room.poses[0], in_truth), room.poses[0][:2, 3]
report("first obstacle, by the cloud", first_obstacle(world[0], here), "m")
report("first obstacle, in truth", first_obstacle(in_truth, here), "m")

# %% [markdown]
# Good enough to stop in time. One flying pixel before it would have stopped the robot for nothing (lesson 05).
#
# Last, the error budget. Transforms are computed with 16 digits, but files and messages keep 32-bit floats, about 7. We send a cloud to
# the world, store it, read it, and bring it back:

# %%
stored = pointcloud.PointCloud(world[20].astype(np.float32))
saved = files.write_cloud(path.with_name("world.ply"), stored)
read = files.read_cloud(saved).points.astype(float)
returned = apply(invert(room.poses[20]), read)
rounding = 1000 * np.linalg.norm(returned - seen[20], axis=1)
at_1_5 = np.abs(seen[20][:, 2] - 1.5) < 0.1
show.error_budget({"frames": (metrics.rms(rounding),
                              metrics.rms(rounding[at_1_5]))})
report("step of a 32-bit float at a map's 5,000 km north",
       float(np.spacing(np.float32(5e6))), "m")

# %% [markdown]
# Far less than the noise of any sensor. But maps of land count metres from the equator, and there a
# 32-bit float moves in big steps. Keep the big part apart, as a shift of the frame, and store what is left.
#
# ## Report against reality
#
# This course goes with two texts that you need not have: a report on 3D reconstruction with Open3D and a depth camera, and a lecture
# on point clouds for robots. The report reads the file of a rabbit, `BunnyMesh.ply`, and prints "Point Cloud with 35,947 points". The lecture
# lists "PointXYZ - float x, y, z". Take both at their word, on our animal.

# %%
print(cloud)
whole = o3d.io.read_triangle_mesh(str(path))
report("triangles that Open3D has dropped", len(whole.triangles))
sixteen = np.zeros(len(points), types["PointXYZ"])
for i, axis in enumerate("xyz"):
    sixteen[axis] = points[:, i]
numbers = np.frombuffer(sixteen.tobytes(), np.float32)
twelve = numbers[:3 * len(points)].reshape(-1, 3)
off = 1000 * np.linalg.norm(twelve - points, axis=1)
report("median error, read with 12 bytes a point", np.median(off), "mm")
show.panels({"16 bytes a point": points, "12 bytes a point": twelve},
            view="front", frame="world")

# %% [markdown]
# Each fourth number is padding, taken for a coordinate, and x, y, z change places from point to point. (The cross: points with two
# coordinates near 0.)
#
# | The document says | What we found | Evidence |
# |---|---|---|
# | report, section 5: the file holds a cloud of 35,947 points | it holds a mesh with as many vertices; its triangles, about twice as many, are dropped silently | count above; the real file below |
# | lecture: PointXYZ is float x, y, z | and 4 bytes of padding, in PCL's memory, and in messages made from it | picture above |
# | lecture: PointXYZRGB has a float rgb | the float is a box for three bytes; as a number it means nothing | section 3 |
# | lecture: a laser gives a "dense point cloud" | dense along its rings, empty between them | section 4 |
# | lecture: stereo works at "arbitrary ranges" | its error grows with the square of the distance, and there is a nearest distance | lesson 01, section 5; lesson 14 |
# | report, section 4: points lie in "3D space" | in the frame of their sensor, until a pose says otherwise | section 5 |
#
# ## Break it
#
# The favourite mistake with poses: undoing them with $-t$ instead of $-R^T t$. It is right for a camera that does not turn, so it
# survives every quick test.


# %%
def careless_invert(T):
    back = np.eye(4)
    back[:3, :3] = T[:3, :3].T
    back[:3, 3] = -T[:3, 3]
    return back


straight = transforms.from_rotation_translation(np.eye(3), [0.4, 0, 0])
assert np.allclose(careless_invert(straight), invert(straight))  # it passes

# camera 20 to world to camera 0
right = apply(invert(room.poses[0]) @ room.poses[20], seen[20])
wrong = apply(careless_invert(room.poses[0]) @ room.poses[20], seen[20])
report("every point is off by",
       np.linalg.norm(wrong - right, axis=1).mean(), "m")
for name, moved in [("right", right), ("wrong", wrong)]:
    distance = np.median(metrics.nearest_distances(moved[::20], seen[0]))
    report(f"median distance to image 0, {name}", 1000 * distance, "mm")
there, ghost = [plan(apply(room.poses[0], moved), like=world[20])
                for moved in (right, wrong)]
show.panels({"undone with −Rᵀ t": [image_0, (there, "image 20")],
             "undone with −t": [image_0, (ghost, "image 20")]},
            view="top", frame="world")

# %% [markdown]
# A room with two of everything. The number that exposes it is the distance between clouds that should overlap. What a
# professional does: name every matrix `T_to_from`, so that neighbours cancel (`T_0_world @ T_world_20`), and test with a pose that turns *and*
# shifts.
#
# ## On real data
#
# The best known cloud of all. It was scanned with a laser stripe in the 1990s, from ten directions:

# %% tags=["real-data"]
# real data: stanford_bunny
real = data.load("stanford_bunny")
zipper = real.files["bun_zipper.ply"]
text = zipper.read_bytes().split(b"end_header")[0].decode("ascii")
read_by_open3d = o3d.io.read_point_cloud(str(zipper))
report("points of the Stanford bunny", len(read_by_open3d.points))
report("faces in the same file", count(text, "face"))
show(real.cloud, views=["front", "side", "top"], color="height",
     frame="object", title="The Stanford bunny")

# %% [markdown]
# Its makers published the raw scans, each in its scanner's frame, and the pose of each. The poses are
# a reference, not truth: they were found by aligning these very scans (lesson 07).

# %% tags=["real-data"]
# real data: stanford_bunny
scans, T_scan = real.clouds, real.reference["scan_poses"]
scan_0 = apply(T_scan["bun000"], scans["bun000"].points)
raw = scans["bun045"].points
posed = apply(T_scan["bun045"], raw)
for name, cloud_45 in [("as scanned", raw), ("moved by its pose", posed)]:
    distance = np.median(metrics.nearest_distances(cloud_45, scan_0))
    report(f"median distance to scan 0, {name}", 1000 * distance, "mm")
# the way back: scan 0 into the frame of scan 45
for name, undo in [("right", invert), ("careless", careless_invert)]:
    came = apply(undo(T_scan["bun045"]), scan_0)
    distance = np.median(metrics.nearest_distances(came, raw))
    report(f"median distance to scan 45, {name} inverse",
           1000 * distance, "mm")
show.panels({
    "as scanned": [(scans["bun000"].points, "scan 0°"), (raw, "scan 45°")],
    "each moved by its pose": [(scan_0, "scan 0°"), (posed, "scan 45°")],
}, view="top", frame="object")

# %% [markdown]
# Last, an organised cloud from a Kinect, as PCL keeps it for its own tests. Order, NaN and packed colour are all there:

# %% tags=["real-data"]
# real data: pcl_tests
xyz, rgb = files.read_organised(data.load("pcl_tests").files["office1.pcd"])
hole = np.isnan(xyz[..., 2])
filled_rows = np.flatnonzero(~hole.all(axis=1))
filled_columns = np.flatnonzero(~hole.all(axis=0))
inside = hole[filled_rows[0]:filled_rows[-1] + 1,
              filled_columns[0]:filled_columns[-1] + 1]
report_table([[str(xyz.shape), 100 * hole.mean(), 100 * inside.mean(),
               np.nanmedian(xyz[..., 2])]],
             columns=["shape", "NaN (%)", "NaN inside the blank border (%)",
                      "median z (m)"])
show.images({"the colours, in the cloud's order": rgb, "z": xyz[..., 2]},
            unit="m", alt="An office, its organised cloud read as images")

# %% [markdown]
# What differs from simulation: most of what is missing is the blank border of the image. Inside it, a little less is missing than in the
# simulated room. And nobody knows where the camera stood, so the cloud stays in its frame.
#
# ## Key points
#
# - A cloud is an $N \times 3$ array of metres, and attributes with one row a point.
# - An organised cloud keeps its pixels: row $v \cdot W + u$, NaN where nothing was measured.
# - Bytes mean nothing without offset, step and byte order. Believe the description, never the size of three floats.
# - Coordinates mean nothing without a frame. $R\,p + t$ goes there, $R^T(q - t)$ comes back.
# - A wrong step between points and a wrong inverse give no error. Print a count and a distance, and look.
#
# Words to know: [point cloud](../docs/glossary.md#point-cloud), [PLY](../docs/glossary.md#ply),
# [attribute](../docs/glossary.md#attribute), [organised cloud](../docs/glossary.md#organised-cloud), [NaN](../docs/glossary.md#nan),
# [padding](../docs/glossary.md#padding), [PointCloud2](../docs/glossary.md#pointcloud2), [LiDAR](../docs/glossary.md#lidar),
# [structured light](../docs/glossary.md#structured-light), [stereo](../docs/glossary.md#stereo), [frame](../docs/glossary.md#frame),
# [rotation matrix](../docs/glossary.md#rotation-matrix), [pose](../docs/glossary.md#pose).
#
# ## Your own camera
#
# Change one line in section 2: `frame = data.from_folder("path/to/my_recording").frames[0]`, and run sections 2 and 3, whatever its size. A cloud
# that you have saved already, from the RealSense viewer for example, opens with `files.read_cloud("my_cloud.ply")`: look at
# the count and the size (largest minus smallest x, y, z) before anything else. Is it metres? Is y down?
#
# ## To the lab
#
# In [lab 02](../exercises/02_point_clouds.ipynb) you write the reader of a PointCloud2 message whose fields stand anywhere, mend the way from
# the world into each camera of a robot, and tell five spoiled clouds apart: `python3 course.py start 02`.
#
# ## Going further
#
# - PCL's own file, PCD, is a PointCloud2 message with a text header; `files.read_organised` keeps its rows and columns.
# - Other types have other padding: `PointXYZRGBNormal` takes 48 bytes. Drivers often send their own, such as x, y, z, intensity, ring, time in 22
#   bytes. Read the fields; assume nothing.
# - Rotations in three numbers and four: `transforms.exp` and `log`, `from_quaternion_xyzw`. Quaternions come in two orders, and `bun.conf` even turns
#   them the other way round.
# - Rusu and Cousins, *3D is here: Point Cloud Library (PCL)*, ICRA 2011. ROS, `sensor_msgs/PointCloud2`. Turk and Levoy, *Zippered polygon meshes
#   from range images*, SIGGRAPH 1994: the bunny.
