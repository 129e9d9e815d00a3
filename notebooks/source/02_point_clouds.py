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

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d

from course_lib import pointcloud, transforms

bunny = data.load("bunny_like")
show(bunny.cloud, views=["front", "side", "top"], color="height", title="A point cloud is a list of places")

# %% [markdown]
# You see a small animal. The computer sees a list of places, without any idea which of them belong together. Everything
# that later lessons do (clean, align, mesh) starts from such a list.
#
# ## Card
#
# | | |
# |---|---|
# | **You will** | read a PLY file and count its points; index an organised cloud; pack and unpack PCL points and a PointCloud2 message; move a cloud between frames and undo it, to 1 µm |
# | **Minutes** | 45 for the core, 60 for the lab |
# | **Before** | lesson 01 (depth images, no data) |
# | **Teaches** | the report, sections 4 and 5; the lecture, "Point cloud" to "Point cloud data structures" |
# | **Data** | `bunny_like`, `living_room` (simulated); the Stanford bunny and PCL's Kinect clouds (real) |
#
# <details><summary>From lesson 01: what does 0 mean in a depth image?</summary>No data. Not "very near", and not "the farthest
# point".</details>
#
# <details><summary>From lesson 01: depth or range, which one do depth cameras store?</summary>Depth: z, the length along
# the direction the camera looks.</details>

# %% [markdown]
# ## 1 A list of points
#
# A **point cloud** is an $N \times 3$ array: one row a point, its x, y and z in metres. That is all it must have.

# %%
points = bunny.cloud.points
report("points", len(points))
report("width", 1000 * np.ptp(points[:, 0]), "mm")
report("memory", points.nbytes / 1e6, "MB")

# %% [markdown]
# On disk it needs a description. The oldest one in wide use is the **PLY** file: a header in plain text that says what
# follows, then the numbers. Write the smallest one by hand, and look inside:

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

header = bunny.files["mesh"].read_bytes().split(b"end_header")[0].decode("ascii")
print(header)
report("vertices announced", count(header, "vertex"))
report("points read", len(files.read_cloud(bunny.files["mesh"]).points))

# %% [markdown]
# Vertices are the points. Faces are triangles between them, about twice as many: they belong to a mesh (lesson 08). The same
# file is a cloud for whoever reads only its vertices. Open3D reads it like this, and its count must agree with the header:

# %%
cloud = o3d.io.read_point_cloud(str(bunny.files["mesh"]))
assert len(cloud.points) == count(header, "vertex")
print(cloud)

# %% [markdown]
# A point may carry more than its place: a colour, a normal (the direction in which the surface faces), an intensity, a time.
# These are its **attributes**, each an array with one row a point. Rows belong together: sort one array alone and the colours
# sit on the wrong points.

# %% [markdown]
# ## 2 Ordered and unordered
#
# A depth camera gives one point a pixel, so its cloud can keep the shape of the image: $H \times W \times 3$. That is an
# **organised cloud**. A pixel without data keeps its place and holds NaN, "not a number". Here is one from the simulated room; lesson 03
# shows how it is made.

# %%
frame = data.load("living_room").frames[0]
from course_lib import cameras  # lesson 03 writes deproject from scratch

organised = cameras.deproject(frame.depth, frame.camera)
report("shape of the organised cloud", str(organised.shape))
report("points that are NaN", 100 * np.isnan(organised[..., 0]).mean(), "%", digits=2)

# %% [markdown]
# What is the order good for? Neighbours come for free: the point right of pixel (u, v) is at (u + 1, v). In a list you would have
# to search for it. And there is a rule between both. Reading the image row by row, pixel (u, v) becomes row number
#
# $$i = v \cdot W + u$$


# %%
def row_of(u, v, width):
    """Row of pixel (u, v) in the list made from an organised cloud."""
    return v * width + u


assert row_of(u=0, v=1, width=640) == 640  # the first pixel of the second image row
listed = organised.reshape(-1, 3)
assert np.array_equal(listed[row_of(320, 240, 640)], organised[240, 320])

kept = listed[np.isfinite(listed).all(axis=1)]  # now it is unordered: row numbers have moved
report("points in the list", len(kept))
report("mean z with the NaN left in", float(listed[:, 2].mean()), "m")
report("mean z without", float(kept[:, 2].mean()), "m")

# %% [markdown]
# One NaN makes every mean, minimum and distance NaN. That is rude, and better than a zero: a zero lies and you do not notice.
# Dropping NaN costs the order for good. Keep the organised cloud as long as you can.

# %% [markdown]
# ## 3 Points as bytes
#
# Robots send clouds as bytes. C++ programs that use PCL keep a point in a **structure**: fields at fixed places. The lecture
# lists the common ones. Ask them for their sizes:

# %%
report_table([[name, ", ".join(dtype.names), dtype.itemsize] for name, dtype in pointcloud.POINT_TYPES.items()],
             columns=["point type", "fields", "bytes a point"])

# %% [markdown]
# Three floats are 12 bytes, but PCL's PointXYZ takes 16. The processor loads 16 bytes at once, so PCL adds four bytes that mean nothing:
# **padding**. Colour is odder still: three bytes packed into the bits of a float.

# %%
xyz = np.zeros(3, pointcloud.POINT_TYPES["PointXYZ"])
xyz["x"], xyz["y"], xyz["z"] = [1, 2, 3], 0, [10, 20, 30]
raw = xyz.tobytes()
assert len(raw) == 48
assert np.frombuffer(raw, np.float32)[4] == 2  # x of the second point: 16 bytes later, four floats on

packed = pointcloud.pack_rgb(np.array([[255, 128, 0]], np.uint8))
report("orange, packed into a float", float(packed[0]) * 1e38, "e-38", digits=4)
assert pointcloud.unpack_rgb(packed).tolist() == [[255, 128, 0]]

# %% [markdown]
# ROS, the robot operating system, sends a **PointCloud2** message: the bytes, and a description of them. `point_step` says how
# many bytes to go from one point to the next, `row_step` from one row to the next. Before you look: how much data is a cloud of 640x480 PointXYZRGB,
# 30 times a second?

# %% tags=["prediction"]
guess = None  # megabytes a second, for example 50

kinect = pointcloud.POINT_TYPES["PointXYZRGB"]
predict("How many megabytes a second?", guess, 640 * 480 * kinect.itemsize * 30 / 1e6, "MB/s",
        why="32 bytes a point, of which 16 mean something: that is why robots downsample first (lesson 04).")

# %%
structured = np.zeros(organised.shape[:2], kinect)
for axis, name in enumerate("xyz"):
    structured[name] = organised[..., axis]
structured["rgb"] = pointcloud.pack_rgb(frame.color)
message = pointcloud.to_message(structured)
report_table([[f.name, f.offset, f.datatype] for f in message.fields], columns=["field", "offset", "type"])
report("point_step", message.point_step, "bytes")
report("row_step", message.row_step, "bytes")
again = pointcloud.from_message(message)
assert np.array_equal(again["x"], structured["x"], equal_nan=True)

# %% [markdown]
# What if you ignore `point_step` and read three floats after three floats?

# %%
right = pointcloud.message_to_xyz(message).reshape(-1, 3)
careless = np.frombuffer(message.data, np.float32)[: 3 * len(right)].reshape(-1, 3)
ok = np.isfinite(right).all(axis=1) & np.isfinite(careless).all(axis=1) & (np.abs(careless) < 1e3).all(axis=1)
report("points in the wrong place by more than 1 mm",
       100 * (np.linalg.norm(careless[ok] - right[ok], axis=1) > 1e-3).mean(), "%")
report("median error", 1000 * np.median(np.linalg.norm(careless[ok] - right[ok], axis=1)), "mm")

# %% [markdown]
# ## 4 Where clouds come from
#
# Four kinds of sensor, one room. A laser scanner turns and times its pulses: it measures range, sparse and far. Structured light
# projects stripes and sees how they bend. Stereo compares two photographs. A depth camera, such as the D455, is stereo with a
# projector of dots. (Lesson 14 builds them.)

# %%
# SENSORS: filled in when simulate.sensors exists

# %% [markdown]
# ## 5 Frames and transforms
#
# A point such as (0, 0, 2) means nothing until you say in whose **frame**: two metres in front of the camera, or two metres above the
# floor? A frame is an origin and three directions. The camera's: x right, y down, z forward. The room's: z up.
#
# To go from one to the other, turn, then shift: $p_{world} = R\,p_{camera} + t$. $R$ is a rotation: its three columns
# are the camera's x, y and z directions, as the room sees them. $t$ is where the camera stands. Both together make the **pose**, a 4x4
# matrix. We call it `T_world_camera`: it takes camera coordinates and gives world coordinates. Read it from right to left.

# %%
def apply(T, points):
    """Points (N, 3) moved by the pose T (4, 4)."""
    return points @ T[:3, :3].T + T[:3, 3]


# A camera that stands 1.5 m above the floor and looks along the world's x axis.
T_world_camera = np.array([[0, 0, 1, 0],   # its z (forward) is the world's x
                           [-1, 0, 0, 0],  # its x (right) is minus the world's y
                           [0, -1, 0, 1.5],  # its y (down) is minus the world's z
                           [0, 0, 0, 1.0]])
assert apply(T_world_camera, np.array([[0, 0, 2.0]])).tolist() == [[2, 0, 1.5]]  # two metres ahead, at the camera's height
assert np.allclose(apply(T_world_camera, kept), transforms.apply(T_world_camera, kept), atol=1e-6)

# %% [markdown]
# The way back is the inverse. A rotation is undone by its transpose. But the shift was made *after* the turn, in
# the world's directions, so it must be turned back too:
#
# $$T^{-1} = \begin{bmatrix} R^T & -R^T t \\ 0 & 1 \end{bmatrix}$$

# %%
def invert(T):
    """The pose that undoes T."""
    back = np.eye(4)
    back[:3, :3] = T[:3, :3].T
    back[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return back


assert np.allclose(invert(T_world_camera) @ T_world_camera, np.eye(4))
assert np.allclose(invert(T_world_camera), transforms.invert(T_world_camera))

# %% [markdown]
# <details><summary><b>Vote.</b> A pose turns by 90° and shifts by 1 m. Which order does <code>R p + t</code> have?
# (a) first shift, then turn. (b) first turn, then shift. (c) it makes no difference. (d) it depends on p.</summary>
#
# (b). Shifting first would be R(p + t): the shift would be turned, too. (c) holds only without a turn, or without a shift.
# </details>
#
# Now two frames of the room, each lifted into space where its own camera stood. In one frame, the world's, they must meet.

# %%
room = data.load("living_room")
clouds = [pointcloud.from_frame(room.frames[i]) for i in (0, 20)]
poses = [room.poses[i] for i in (0, 20)]
together = [apply(T, c.points) for T, c in zip(poses, clouds, strict=True)]
show({"frame 0": together[0], "frame 20": together[1]}, view="top", title="Two frames in the world's frame")

# %%
from course_lib import metrics

there_and_back = apply(invert(poses[1]), together[1])
report("there and back again, worst point", 1e6 * np.abs(there_and_back - clouds[1].points).max(), "µm", digits=1)
truth = room.truth["depth"][20]
surface = metrics.distance_to_surface(together[1], room.mesh)
report("frame 20 in the world, median distance to the true surface", 1000 * np.median(surface), "mm")

# %% [markdown]
# What a robot does with it: it keeps obstacles in one map while it moves (navigation), asks how far the nearest point of a thing is
# (avoiding, grasping), and compares shapes (recognition). All three need points of many frames in one frame. A wrong pose is
# a wrong map, however good the sensor.
#
# ## Report against reality
#
# The report, section 5, reads `BunnyMesh.ply` and prints "Point Cloud with 35,947 points". That is right, and it hides something. The lecture gives
# "PointXYZ - float x, y, z". Decide both: what does a reader see who takes *everything* in the file for points, or 12 bytes for a point?

# %%
report("vertices of our file", count(header, "vertex"))
report("faces of our file", count(header, "face"))
report("PointXYZ, sum of its fields", 3 * np.dtype(np.float32).itemsize, "bytes")
report("PointXYZ, what PCL keeps", pointcloud.POINT_TYPES["PointXYZ"].itemsize, "bytes")

# %% [markdown]
# | The document says | What we found | Evidence |
# |---|---|---|
# | report 5: the PLY file holds a cloud of 35,947 points | it holds a mesh: as many vertices, and about twice as many faces, dropped silently | count above; the real file below |
# | lecture: PointXYZ is float x, y, z | in memory and in most messages there are 4 bytes of padding | section 3 |
# | lecture: PointXYZRGB has a "float rgb" | the float is a box for three bytes; as a number it means nothing | section 3 |
# | lecture: stereo works at "arbitrary ranges" | its error grows with the square of the distance, and there is a nearest distance | lesson 01, section 5; lesson 14 |
# | report 4: a cloud is in "3D space" | in the frame of its sensor, until a pose says otherwise | section 5 |

# %% [markdown]
# ## Break it
#
# The favourite mistake with poses: undoing them by $-t$ instead of $-R^T t$. It is right for a camera that does not turn, so
# it survives every quick test.

# %%
def careless_invert(T):
    back = np.eye(4)
    back[:3, :3] = T[:3, :3].T
    back[:3, 3] = -T[:3, 3]
    return back


straight = transforms.from_rotation_translation(np.eye(3), [0.4, 0, 0])
assert np.allclose(careless_invert(straight), invert(straight))  # the quick test passes

T_0_20 = invert(poses[0]) @ poses[1]  # camera 20 to camera 0
right = apply(T_0_20, clouds[1].points)
wrong = apply(careless_invert(poses[0]) @ poses[1], clouds[1].points)
report("every point is off by", 1000 * np.linalg.norm(wrong - right, axis=1).mean(), "mm")
report("median distance to frame 0, right", 1000 * np.median(metrics.nearest_distances(right[::20], clouds[0].points)), "mm")
report("median distance to frame 0, wrong", 1000 * np.median(metrics.nearest_distances(wrong[::20], clouds[0].points)), "mm")

# %%
show({"frame 0": clouds[0].points, "frame 20, wrong inverse": wrong}, view="top", title="A room with two of everything")

# %% [markdown]
# Two tables, two walls: a ghost. The number that exposes it is the distance between clouds that should overlap. What a
# professional does: name every matrix `T_to_from`, so that neighbours cancel (`T_0_world @ T_world_20`), and
# test with a pose that turns *and* shifts.

# %% [markdown]
# ## On real data

# %% tags=["real-data"]
# real data: stanford_bunny
real = data.load("stanford_bunny")
path = real.files["bun_zipper.ply"]
header = path.read_bytes().split(b"end_header")[0].decode("ascii")
report("points of the Stanford bunny", len(o3d.io.read_point_cloud(str(path)).points))
report("faces in the same file", count(header, "face"))
show(real.cloud, views=["front", "side", "top"], color="height", frame="world", title="The Stanford bunny")

# %% [markdown]
# The bunny was scanned with a laser in 1994, from ten directions, and zipped into one mesh. Next, a cloud that a Kinect camera gave to PCL. It is
# organised, with NaN where nothing was measured:

# %% tags=["real-data"]
# real data: pcl_tests
kinect_scene = data.load("pcl_tests")
print(kinect_scene)
