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
from course_lib.notebook import data, files, picture, predict, report, report_table, show

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
show(bunny.cloud, views=["front", "side", "top"], color="height", title="A point cloud is a list of places (front: its profile; side: from behind)")

# %% [markdown]
# You see a small animal. The computer sees a list of places, without any idea which of them belong together. All
# later lessons start from such a list.
#
# ## Card
#
# | | |
# |---|---|
# | You will | read a PLY file and count its points; find a pixel in an organised cloud; find a point's bytes in a PointCloud2 message; name four sensors that make clouds, and their errors; move a cloud between frames and back, to a micrometre |
# | Minutes | 45 for the core, 60 for the lab |
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
assert len(cloud.points) == count(header, "vertex") == len(files.read_cloud(path))
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
# A depth camera gives one point a pixel, so its cloud can keep the shape of the image: $H \times W \times 3$. The lecture calls it
# ordered; most software says **organised cloud**. A pixel without data keeps its place and holds NaN, "not a number". Here is
# one from the simulated room. (Lesson 03 writes `deproject`, which makes it.)

# %%
room = data.load("living_room")
frame = room.frames[0]
organised = pinhole.deproject(frame.depth, frame.camera)
report_table([[str(organised.shape), 100 * float(np.isnan(organised[..., 2]).mean())]],
             columns=["shape of the organised cloud", "points that are NaN (%)"])
parts = {"x (m), to the right": 0, "y (m), down": 1, "z (m), forward": 2}
show.images({name: organised[..., i] for name, i in parts.items()}, unit="m", title="An organised cloud is three images",
            alt="x grows from left to right, y from top to bottom, z with distance")

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


assert row_of(u=0, v=1, width=640) == 640  # the first pixel of the second image row
listed = organised.reshape(-1, 3)
u, v, width = 200, 100, organised.shape[1]
assert np.array_equal(listed[row_of(u, v, width)], organised[v, u], equal_nan=True)

kept = listed[np.isfinite(listed).all(axis=1)]  # now it is unordered: row numbers have moved
beside = np.linalg.norm(organised[:, 1:] - organised[:, :-1], axis=2)
report("points in the list", len(kept))
report("median distance to the pixel on the right", 1000 * np.nanmedian(beside), "mm")
report("mean z, NaN left in", float(listed[:, 2].mean()), "m")
report("mean z, NaN left out", float(kept[:, 2].mean()), "m", digits=4)
report("mean z, zeros in place of NaN", float(np.nan_to_num(listed[:, 2]).mean()), "m", digits=4)

# %% [markdown]
# One NaN makes every sum, mean and minimum NaN ("not measured", says `report`). Better than the last line: a zero lies, unnoticed. Leaving NaN out costs the order for good. Keep the organised cloud as long as you can.
#
# ## 3 Points as bytes
#
# Robots send clouds as bytes. C++ programs that use PCL, the Point Cloud Library, keep each point as fields at fixed places. The
# lecture lists the common types. Ask them for their size:

# %%
report_table([[name, ", ".join(kind.names), kind.itemsize] for name, kind in pointcloud.POINT_TYPES.items()],
             columns=["point type", "fields", "bytes a point"])

# %% [markdown]
# Three floats of 4 bytes are 12 bytes, but PCL's PointXYZ takes 16. The processor likes to load 16 bytes at once, so PCL adds four
# that mean nothing: **padding**. PointXYZI takes 32: its intensity starts a new block of 16, and 12 bytes of that are padding. Colour is odder still: red, green and blue, a byte each, stored in the bits of one float.

# %%
three = np.zeros(3, pointcloud.POINT_TYPES["PointXYZ"])
three["x"], three["z"] = [1, 2, 3], [10, 20, 30]
assert len(three.tobytes()) == 48
print(np.frombuffer(three.tobytes(), np.float32))  # x y z and padding, three times

orange = pointcloud.pack_rgb(np.array([[255, 128, 0]], np.uint8))
assert hex(orange.view(np.uint32)[0]) == "0xff8000"  # ff is red, 80 is green, 00 is blue
report("orange, if you read the float as a number", float(orange[0]), smallest=0)

# %% [markdown]
# ROS, the Robot Operating System, sends a **PointCloud2** message: the bytes, and a description of them. `point_step` says how many
# bytes lie between one point and the next, `row_step` between one image row and the next, and each field has its offset in
# the point. A commitment first: how much data is a cloud of 640x480 PointXYZRGB, 30 times a second?

# %%
rate_guess = predict("How many megabytes a second?", guess=None, unit="MB/s")

# %% tags=["hide-input", "prediction"]
colored = pointcloud.POINT_TYPES["PointXYZRGB"]
rate_guess.answer(
    640 * 480 * 30 * colored.itemsize / 1e6,
    why="Each point takes 32 bytes, and only 15 of them mean something. "
        "That is why robots downsample first (lesson 04).")

# %%
structured = np.zeros(organised.shape[:2], colored)
structured["x"], structured["y"], structured["z"] = np.moveaxis(organised, -1, 0)
structured["rgb"] = pointcloud.pack_rgb(frame.color)
message = pointcloud.to_message(structured, frame_id="camera")
report_table([[f.name, f.offset] for f in message.fields], columns=["field", "offset (bytes)"],
             title=f"point_step {message.point_step} bytes, row_step {message.row_step:,} bytes")


def point_at(message, u, v):
    """x, y, z of pixel (u, v), from the bytes of a little-endian message with x, y, z side by side."""
    start = v * message.row_step + u * message.point_step + message.fields[0].offset
    return struct.unpack_from("<3f", message.data, start)


assert np.array_equal(point_at(message, u, v), organised[v, u], equal_nan=True)

block = np.frombuffer(message.data, np.uint8).reshape(-1, message.point_step)[:, :12]  # a row a point; x begins at byte 0
assert np.array_equal(np.ascontiguousarray(block).view("<f4"), listed, equal_nan=True)
assert np.array_equal(pointcloud.message_to_xyz(message), listed, equal_nan=True)  # the library's reader

# %% [markdown]
# The same rule as before, counted in bytes. `<` says little-endian, the least significant byte first, as in almost every computer
# today, `>` big-endian; a message may be either. The last lines read all points at once: `ascontiguousarray` puts the bytes side by
# side, and `view` takes them for floats. Ignore any of these, and there is no error message: bytes are bytes (see "Report against reality").
#
# ## 4 Where clouds come from
#
# Three ways to measure a distance, four sensors of the lecture, one room.
#
# - A **laser scanner** (LiDAR) sends pulses and times their way back. Each gives a range, along a known direction. It turns, so it sees all
#   around: rings of points.
# - **Structured light**: a projector shines stripes, a camera sees where they land. Each pixel's ray and its stripe's ray meet in
#   the point.
# - **Stereo**: two photographs from two places. A pixel that is found in both gives two rays, and they meet in the point.
# - A depth camera, such as the D455, is stereo whose projector throws infrared dots, so that blank walls have something to match.
#
# The code of these four pictures may be skipped; lesson 14 explains it. `T_world_camera` says where the camera stands (section 5).

# %% tags=["hide-input"]
from course_lib.simulate import scenes, sensors

scene, camera, T_world_camera = scenes.living_room(7), frame.camera, room.poses[0]
step_right = transforms.from_rotation_translation(np.eye(3), [0.15, 0, 0])
upright = transforms.from_rotation_translation(np.eye(3), T_world_camera[:3, 3])  # same place, z up
rng = np.random.default_rng(2)

scan = sensors.laser_scan(scene, upright, np.radians(np.linspace(-30, 15, 24)), rng=rng)

projector = camera.scaled(1280, 960)
T_world_projector = transforms.compose(T_world_camera, step_right)
lit = sensors.structured_light(scene, camera, T_world_camera, projector, T_world_projector,
                               sensors.stripes(1280, 960, period=40), strength=4, room_light=0.08)

pair = sensors.stereo_pair(scene, camera, T_world_camera, baseline=0.095)

dotted = sensors.infrared_dots(scene, camera, T_world_camera, rng)

# %% tags=["hide-input"]
swept = transforms.apply(upright, scan.points)
low = swept[:, 2] < 2.2
laser = show((swept[low], scan.ranges[low]), view="iso", frame="world", label="range", unit="m", alt="Rings of points around the room")
both = cv2.addWeighted(pair.left.color, 0.5, pair.right.color, 0.5, 0)
nearest, farthest = pair.disparity[pair.disparity > 0].max(), pair.disparity[pair.disparity > 0].min()
show.images({"laser scanner: rings": laser, "structured light: stripes bend": lit.image,
             "stereo: both photographs, overlaid": both, "depth camera: infrared dots": dotted}, columns=2,
            alt=f"Four sensors, one room. The laser's {len(scan.points):,} points lie in {scan.rings.max() + 1} rings. The stripes break at "
                "the edge of the table and bend over the round things. The two photographs show everything twice, "
                f"{farthest:.0f} pixels apart far away and {nearest:.0f} near by. The dots cover everything, blank walls too")

# %% [markdown]
# Stripes and stereo give a point where two rays meet. The sideways slope of the one ray is $a$, of the other $b$; the second starts
# a baseline $B$ farther right. They meet at the depth where $a z = b z + B$, so $z = B / (a - b)$.


# %%
def meet(a, b, baseline):
    """Depth at which rays of sideways slopes a and b meet, b's from a baseline farther right; 0 if nowhere."""
    z = baseline / np.where(a - b > 1e-3, a - b, np.nan)
    return np.nan_to_num(z).astype(np.float32)


assert meet(0.5, 0.25, baseline=0.5) == 2  # two metres ahead: both at x = 1

a = np.broadcast_to((np.arange(640) - camera.cx) / camera.fx, (480, 640))
stripe = np.round(lit.projector_uv[..., 0])  # to a whole column: decoding stripes gives no more (lesson 14)
matcher = cv2.StereoSGBM.create(numDisparities=96, blockSize=5, P1=200, P2=800, uniquenessRatio=10)
grey = [cv2.cvtColor(one.color, cv2.COLOR_RGB2GRAY) for one in (pair.left, pair.right)]
disparity = matcher.compute(*grey) / 16  # how many pixels each pixel has moved; below 0 where it was not found
depths = {
    "structured light": meet(a, (stripe - projector.cx) / projector.fx, 0.15),
    "stereo": meet(a, a - np.where(disparity > 0, disparity, np.nan) / camera.fx, pair.baseline),
    "depth camera": frame.depth,
}
clouds = {"laser scanner": (swept, scan.points)}
for name, depth in depths.items():
    seen = pinhole.deproject_compact(np.where(depth < 10, depth, 0), camera)
    clouds[name] = transforms.apply(T_world_camera, seen), seen
rows = []
for name, (world, seen) in clouds.items():
    errors = 1000 * metrics.distance_to_surface(world, room.mesh)
    farthest = np.linalg.norm(seen, axis=1).max()
    rows.append([name, len(world), float(farthest), float(np.median(errors)), float(np.quantile(errors, 0.95))])
report_table(rows, columns=["sensor", "points", "farthest (m)", "median error (mm)", "95 % below (mm)"], digits=2)

# %% [markdown]
# Read the columns against each other. The laser has few points, and few large errors, near or far. The others have a point for most pixels, and a
# long tail of bad ones at the edges.
#
# ## 5 Frames and transforms
#
# A point such as (0, 0.5, 2) means nothing until you say in whose **frame**. A frame is an origin and three directions. The camera's:
# x right, y down, z forward. The world's, here the room's: z up. Same point, different numbers:

# %% tags=["hide-input"]
ahead, down, height = 2, 0.5, 1.5  # metres
x, z = ahead, height - down
fig, axis = plt.subplots(figsize=(7, 3.6), layout="constrained")
axis.grid(False)
axis.plot([-0.3, 2.7], [-0.03, -0.03], color="0.7", lw=1)
axis.plot([0, x, x], [height, height, z], ":", color=show.COLOURS["target"])
axis.plot([0, x, x], [0, 0, z], ":", color=show.COLOURS["source"])
for origin, arrows, colour in [((0, 0), {"x": (0.5, 0), "z": (0, 0.5)}, "source"), ((0, height), {"z": (0.5, 0), "y": (0, -0.5)}, "target")]:
    for name, (dx, dy) in arrows.items():
        axis.annotate("", (origin[0] + dx, origin[1] + dy), origin, arrowprops={"arrowstyle": "-|>", "lw": 2.5, "color": show.COLOURS[colour]})
        axis.text(origin[0] + dx + (0.08 if dy else 0), origin[1] + dy + (0.07 if dx else 0), name, color=show.COLOURS[colour], fontsize=13,
                  weight="bold", ha="center", va="center" if dy else "bottom")
axis.plot([x], [z], "o", color=show.COLOURS["outlier"], ms=10)
for place, text, colour in [((0.05, height + 0.07), "camera", "target"), ((0.05, 0.06), "world", "source"),
                            ((1.15, height + 0.06), f"{ahead} forward", "target"), ((x + 0.05, height - 0.25), f"{down} down", "target"),
                            ((1.15, 0.06), f"{x} along", "source"), ((x + 0.05, 0.45), f"{z:g} up", "source"),
                            ((-0.33, 0.72), f"{height} m", "source")]:
    axis.text(*place, text, color=show.COLOURS[colour], fontsize=10)
axis.text(x + 0.09, z - 0.06, f"camera: (0, {down}, {ahead})\nworld: ({x}, 0, {z:g})", fontsize=10)
axis.set(xlim=(-0.35, 3.0), ylim=(-0.12, 1.75), aspect="equal", title="One point, two frames, seen from the side")
axis.axis("off")
picture(fig, alt=f"Seen from the side: the world's origin on the floor, x to the right and z up; the camera {height} m above it, z to the right and y "
                 f"down. A point {ahead} m ahead of the camera and {down} m below its axis is (0, {down}, {ahead}) for the camera and ({x}, 0, {z:g}) for "
                 "the world.")

# %% [markdown]
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
    return points @ T[:3, :3].T + T[:3, 3]  # points are rows, so R comes from the right, transposed


# The camera of the drawing. Columns: its x, y and z as the world sees them, and where it stands.
T_drawn = np.array([[0, 0, 1, 0],
                    [-1, 0, 0, 0],
                    [0, -1, 0, 1.5],
                    [0, 0, 0, 1]])
assert apply(T_drawn, np.array([[0, 0.5, 2], [0.3, 0.5, 2]])).tolist() == [[2, 0, 1], [2, -0.3, 1]]  # its right is the world's -y

T = room.poses[0]
by_open3d = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(kept)).transform(T)
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
assert np.allclose(invert(T), transforms.invert(T)) and np.allclose(invert(T), np.linalg.inv(T))

# %% [markdown]
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
plan = {i: (world[i][:, 2] > 0.1) & (world[i][:, 2] < 1.9) for i in world}
as_if_still = apply(room.poses[0], seen[20])
first = world[0][plan[0]], "image 0"
show.panels({"as if the camera had not moved": [first, (as_if_still[plan[20]], "image 20")],
             "each by its own pose": [first, (world[20][plan[20]], "image 20")]}, view="top", frame="world")

# %% [markdown]
# This is why robots like clouds. With every cloud in one frame, a map is a list of points (navigation), an obstacle is a point above
# the floor and below the robot's head (avoiding it, planning a path), and a thing on the table is a group of points with a place and a size
# (finding, recognising, grasping it). How near is the first obstacle, and is it really there?

# %%
def first_obstacle(points, standing=room.poses[0][:2, 3]):
    """Metres along the floor to the nearest point that is between 0.1 and 1.2 m above it."""
    in_the_way = points[(points[:, 2] > 0.1) & (points[:, 2] < 1.2)]
    return np.linalg.norm(in_the_way[:, :2] - standing, axis=1).min()


assert first_obstacle(np.array([[3, 4, 0.5], [1, 0, 0.0]]), standing=np.zeros(2)) == 5  # one is the floor
truth = apply(room.poses[0], pinhole.deproject_compact(room.truth["depth"][0], camera))
report("nearest obstacle, by the cloud", first_obstacle(world[0]), "m")
report("nearest obstacle, by the true surface", first_obstacle(truth), "m")

# %% [markdown]
# Good enough to stop in time. One flying pixel before it would have stopped the robot for nothing (lesson 05).
#
# Last, the error budget. Transforms are computed with 16 digits, but files and messages keep 32-bit floats, about 7. We send a cloud to
# the world, store it, read it, and bring it back:

# %%
stored = pointcloud.PointCloud(world[20].astype(np.float32))
path = files.write_cloud(path.with_name("world.ply"), stored)
back = apply(invert(room.poses[20]), files.read_cloud(path).points.astype(float))
moved = 1000 * np.linalg.norm(back - seen[20], axis=1)
near = np.abs(seen[20][:, 2] - 1.5) < 0.1
show.error_budget({"frames": (metrics.rms(moved), metrics.rms(moved[near]))})
report("step of a 32-bit float at a map's 5,000 km north", float(np.spacing(np.float32(5e6))), "m")

# %% [markdown]
# Far less than the noise of any sensor. But maps of land count metres from the equator, and there a
# 32-bit float moves in big steps. Keep the big part apart, as a shift of the frame, and store what is left.
#
# ## Report against reality
#
# The report, section 5, reads `BunnyMesh.ply` and prints "Point Cloud with 35,947 points". The lecture
# lists "PointXYZ - float x, y, z". Take both at their word.

# %%
print(cloud)
whole = o3d.io.read_triangle_mesh(str(path.with_name("animal.ply")))
report("triangles that Open3D has dropped", len(whole.triangles))
sixteen = np.zeros(len(points), pointcloud.POINT_TYPES["PointXYZ"])
sixteen["x"], sixteen["y"], sixteen["z"] = points.T
twelve = np.frombuffer(sixteen.tobytes(), np.float32)[: 3 * len(points)].reshape(-1, 3)
off = 1000 * np.linalg.norm(twelve - points, axis=1)
report("median error, read with 12 bytes a point", np.median(off), "mm")
show.panels({"16 bytes a point": points, "12 bytes a point": twelve}, view="front", frame="world")

# %% [markdown]
# Each fourth number is padding, taken for a coordinate, and x, y, z change places from point to point. (The cross: points with two
# coordinates near 0.)
#
# | The document says | What we found | Evidence |
# |---|---|---|
# | report 5: the file holds a cloud of 35,947 points | it holds a mesh with as many vertices; its triangles, about twice as many, are dropped silently | count above; the real file below |
# | lecture: PointXYZ is float x, y, z | and 4 bytes of padding, in PCL's memory, and in messages made from it | picture above |
# | lecture: PointXYZRGB has a float rgb | the float is a box for three bytes; as a number it means nothing | section 3 |
# | lecture: a laser gives a "dense point cloud" | dense along its rings, empty between them | section 4 |
# | lecture: stereo works at "arbitrary ranges" | its error grows with the square of the distance, and there is a nearest distance | lesson 01, section 5; lesson 14 |
# | report 4: points lie in "3D space" | in the frame of their sensor, until a pose says otherwise | section 5 |
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
assert np.allclose(careless_invert(straight), invert(straight))  # the quick test passes

right = apply(invert(room.poses[0]) @ room.poses[20], seen[20])  # camera 20 to world to camera 0
wrong = apply(careless_invert(room.poses[0]) @ room.poses[20], seen[20])
report("every point is off by", np.linalg.norm(wrong - right, axis=1).mean(), "m")
for name, moved in [("right", right), ("wrong", wrong)]:
    distance = np.median(metrics.nearest_distances(moved[::20], seen[0]))
    report(f"median distance to image 0, {name}", 1000 * distance, "mm")
there, ghost = [apply(room.poses[0], moved)[plan[20]] for moved in (right, wrong)]
show.panels({"undone with -R^T t": [first, (there, "image 20")], "undone with -t": [first, (ghost, "image 20")]},
            view="top", frame="world")

# %% [markdown]
# A room with two of everything. The number that exposes it is the distance between clouds that should overlap. What a
# professional does: name every matrix `T_to_from`, so that neighbours cancel (`T_0_world @ T_world_20`), and test with a pose that turns *and*
# shifts.
#
# ## On real data
#
# The file behind the report's figure 2. It was scanned with a laser stripe in the 1990s, from ten directions:

# %% tags=["real-data"]
# real data: stanford_bunny
real = data.load("stanford_bunny")
header = real.files["bun_zipper.ply"].read_bytes().split(b"end_header")[0].decode("ascii")
report("points of the Stanford bunny", len(o3d.io.read_point_cloud(str(real.files["bun_zipper.ply"])).points))
report("faces in the same file", count(header, "face"))
show(real.cloud, views=["front", "side", "top"], color="height", frame="object", title="The Stanford bunny")

# %% [markdown]
# Its makers published the raw scans, each in its scanner's frame, and the pose of each. The poses are
# a reference, not truth: they were found by aligning these very scans (lesson 07).

# %% tags=["real-data"]
# real data: stanford_bunny
scans, T_scan = real.clouds, real.reference["scan_poses"]
first = apply(T_scan["bun000"], scans["bun000"].points)
second = apply(T_scan["bun045"], scans["bun045"].points)
raw = scans["bun045"].points
for name, moved in [("as scanned", raw), ("moved by its pose", second)]:
    distance = np.median(metrics.nearest_distances(moved, first))
    report(f"median distance to scan 0, {name}", 1000 * distance, "mm")
for name, undo in [("right", invert), ("careless", careless_invert)]:  # the way back: scan 0 into the frame of scan 45
    distance = np.median(metrics.nearest_distances(apply(undo(T_scan["bun045"]), first), raw))
    report(f"median distance to scan 45, {name} inverse", 1000 * distance, "mm")
show.panels({"as scanned": [(scans["bun000"].points, "scan 0°"), (raw, "scan 45°")],
             "each moved by its pose": [(first, "scan 0°"), (second, "scan 45°")]}, view="top", frame="object")

# %% [markdown]
# Last, an organised cloud from a Kinect, as PCL keeps it for its own tests. Order, NaN and packed colour are all there:

# %% tags=["real-data"]
# real data: pcl_tests
xyz, rgb = files.read_organised(data.load("pcl_tests").files["office1.pcd"])
z = xyz[..., 2]
hole = np.isnan(z)
rows, columns = np.flatnonzero(~hole.all(axis=1)), np.flatnonzero(~hole.all(axis=0))
inside = hole[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]  # without the blank border of the image
report_table([[str(xyz.shape), 100 * float(hole.mean()), 100 * float(inside.mean()), float(np.nanmedian(z)), colored.itemsize * z.size / 1e6]],
             columns=["shape", "NaN (%)", "NaN inside the border (%)", "median z (m)", "as PointXYZRGB (MB)"])
show.images({"the colours, in the cloud's order": rgb, "z (m)": z}, unit="m",
            alt="An office, its organised cloud read as images")

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
# In lab 02 you write the reader of a PointCloud2 message, mend somebody's inverse, and tell five spoiled clouds apart:
# `python3 course.py start 02`.
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
