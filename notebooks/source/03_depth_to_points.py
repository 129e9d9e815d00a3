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
# # 03 From depth to points
#
# **You will be able to turn a depth image into a coloured cloud in metres, with your own five lines, and to say in
# millimetres what each wrong setting costs.**

# %%
from course_lib.notebook import data, picture, predict, report, report_table, show

import cv2
import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d

from course_lib.camera import pinhole
from course_lib.cloud import pointcloud
from course_lib.geometry import transforms
from course_lib.surface import metrics

room = data.load("living_room")
frame = room.frames[15]
show(pointcloud.from_frame(frame), views=["camera", "iso"],
     title="One RGB-D frame: where the camera stood, and where it never stood",
     alt="A living room: a table with a rabbit, a globe, books and a box, posters on the wall behind. Left "
         "as a photograph; right from above at an angle, with white shadows behind everything near.")

# %% [markdown]
# Both pictures show the same points. The left one, labelled *sensor*, is drawn from where the camera stood and looks like a photograph; *iso* is
# from above at an angle. For the right one we walked around the scene,
# although the camera took one frame and never moved. White is what it could not see; the specks in the air are flying pixels
# (lesson 01). This lesson is about the step from a depth image to such a cloud.
#
# ## Card
#
# | | |
# |---|---|
# | You will | compute a focal length from a field of view; write deprojection and check it against Open3D; tell six wrong settings apart and price each in millimetres; find a recording whose depth does not fit its colour |
# | Minutes | 45 for the core, 60 for the lab |
# | Before | lesson 01 (depth, no data), lesson 02 (frames, `T_world_camera`) |
# | Teaches | the UAV document, section III A; the report, section 8; the lecture, "Depth map to point cloud" |
# | Data | `living_room` (simulated, with truth); real pairs of TUM, SUN and Redwood; two real RealSense recordings |
#
# Two questions from earlier lessons, before you read on:
#
# <details><summary>Lesson 01: a depth image says 2 m in its corner. Is that corner two metres from the lens?</summary>No, farther.
# Depth is z, the length along the direction the camera looks. The length of the string to the corner is the range.</details>
#
# <details><summary>Lesson 02: what does <code>T_world_camera</code> do to a point?</summary>It takes camera coordinates and gives
# world coordinates. The camera's own axes are x right, y down, z forward.</details>

# %% [markdown]
# ## 1 Every pixel looks along one ray
#
# Imagine a dark box with a tiny hole. Light from each thing outside falls through the hole in a straight line onto the back
# wall. That is a **pinhole camera**. To save ourselves an upside-down image, we draw the image in front of the hole. Seen
# from above:

# %% tags=["hide-input"]
f_drawn, x_drawn, z_drawn = 400, 1.0, 2.0
shift = f_drawn * x_drawn / z_drawn
fig, axis = plt.subplots(figsize=(7, 3.4), layout="constrained")
axis.fill([0, z_drawn, z_drawn], [0, 0, x_drawn], color=show.COLOURS["reference"], alpha=0.25)
axis.fill([0, 0.8, 0.8], [0, 0, 0.4], color=show.COLOURS["source"], alpha=0.45)
axis.plot([0, 2.4], [0, 0], color="black", lw=1)
axis.plot([0, z_drawn], [0, x_drawn], color=show.COLOURS["target"], lw=2)
axis.plot([0.8, 0.8], [-0.1, 0.62], color="black", lw=3)
axis.plot([z_drawn], [x_drawn], "o", color=show.COLOURS["outlier"], ms=10)
axis.plot([0], [0], "o", color="black", ms=8)
for end, low in [(0.8, -0.16), (z_drawn, -0.36)]:
    axis.annotate("", (0, low), (end, low), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
for place, text, side in [
    ((-0.03, 0.07), "hole", "center"), ((0.4, -0.28), f"f = {f_drawn} pixels", "center"),
    ((0.84, 0.13), f"u - cx =\n{shift:.0f} pixels", "left"), ((1.3, -0.48), f"z = {z_drawn:g} m", "center"),
    ((2.04, 0.45), f"x = {x_drawn:g} m", "left"), ((2.06, 1.0), "point", "left"),
    ((0.78, 0.66), "image", "center"), ((2.42, -0.1), "optical axis", "right"),
]:
    axis.text(*place, text, ha=side, fontsize=10)
axis.set(xlim=(-0.2, 2.5), ylim=(-0.52, 1.12), aspect="equal", title="Two triangles of the same shape")
axis.axis("off")
picture(fig, alt=f"A point {x_drawn:g} m right of the optical axis and {z_drawn:g} m deep. The line from it to "
                 f"the hole crosses the image {shift:.0f} pixels right of the middle, {f_drawn} pixels in front "
                 "of the hole. The small triangle up to the image and the large one up to the point have the "
                 "same shape.")

# %% [markdown]
# Two triangles share a corner at the hole, so they have the same shape: $(u - c_x) / f = x / z$. Solve for $u$ and you have
# equations 5 and 6 of the UAV document:
#
# $$u = f\,\frac{x}{z} + c_x, \qquad v = f\,\frac{y}{z} + c_y$$
#
# The **focal length** $f$ is the distance from the hole to the image. Only the ratio of $u - c_x$ to $f$ matters, so both may be
# in pixels. The **principal point** $(c_x, c_y)$ is the place in the image straight ahead. 640 columns are numbered 0 to 639, so the
# middle is 319.5, not 320: $c_x = (W - 1)/2$. Rows may have an $f$ of their own, so we carry two: `fx` and `fy`.

# %%
def project(points, fx, fy, cx, cy):
    """Pixels (..., 2), u before v, of points (..., 3) in the camera frame."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([fx * x / z + cx, fy * y / z + cy], axis=-1)


# The drawing: 1 m right and 2 m deep. Half of f is 200, so column 320 + 200.
assert project(np.array([1.0, 0.0, 2.0]), 400, 400, 320, 240).tolist() == [520, 240]

ray = np.array([[0.5, 0, 1], [1, 0, 2], [2, 0, 4]])  # one point, then twice as far, then four times
assert (project(ray, 400, 400, 320, 240) == [520, 240]).all()

c = frame.camera  # the fx, fy, cx and cy of our frame
points = np.random.default_rng(3).uniform([-1, -1, 1], [1, 1, 4], (1000, 3))
by_opencv, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), c.matrix, None)
assert np.allclose(project(points, c.fx, c.fy, c.cx, c.cy), by_opencv[:, 0])

# %% [markdown]
# Look at the second assert. Three points, one pixel. A photograph keeps the direction and forgets the distance. The depth image
# is the missing number.
#
# ## 2 The focal length comes from the field of view
#
# Data sheets and simulators rarely give $f$. They give the **field of view**: the angle from one edge of the image to the
# other. Half the image and half the angle make a right-angled triangle with $f$, so
# $f = \tfrac12 \text{width} / \tan(\tfrac12 \text{FOV})$. Four numbers, $f_x, f_y, c_x, c_y$, describe the camera at one
# resolution. They are its **intrinsics**.

# %%
def focal_length(fov_degrees, pixels):
    """Focal length in pixels, from the whole angle that `pixels` span."""
    return 0.5 * pixels / np.tan(np.radians(fov_degrees) / 2)


assert np.isclose(focal_length(90, 640), 320)  # the tangent of 45 degrees is 1
assert np.isclose(focal_length(60, 640), pinhole.focal_length(np.radians(60), 640))

wrong = {
    "half of both": lambda fov: focal_length(fov, 640),
    "the whole angle": lambda fov: 320 / np.tan(np.radians(fov)),
    "degrees for radians": lambda fov: 320 / np.tan(fov / 2),
    "tangent upside down": lambda fov: 320 * np.tan(np.radians(fov) / 2),
    "in proportion to 90": lambda fov: 320 * 90 / fov,
}
report_table([[name, *(float(formula(fov)) for fov in (90, 60, 45))] for name, formula in wrong.items()],
             columns=["formula", "f at 90 degrees", "at 60", "at 45"], smallest=0.01)

# %% [markdown]
# The first row is right. Read down the 90-degree column: the last two mistakes are right there, too, and only there. Test with two
# angles, one of them not 90. And ask *which way* the angle was measured. An image is wider than high, so 60 degrees across and 60
# degrees from top to bottom are different cameras.
#
# Vote: 640 pixels wide, 60 degrees horizontally. What is f? (a) 480, (b) 554, (c) 185, (d) −50.
#
# <details><summary>Answer</summary>
# (b). (a) took the angle in proportion: two thirds of 90 degrees, so one and a half times 320. (c) used the whole angle. (d) gave
# degrees to a tangent that expects radians; a negative focal length is at least easy to notice.
# </details>
#
# ## 3 From a pixel back to a point
#
# Turn equations 5 and 6 around and you have equations 7 and 8: $x = (u - c_x)\,z/f$ and $y = (v - c_y)\,z/f$. To
# **deproject** is to do this for every pixel of a depth image. Here it is, in five lines.

# %%
def deproject(depth, fx, fy, cx, cy):
    """Points (H, W, 3) of a depth image (H, W), in its unit; NaN where nothing was measured."""
    v, u = np.indices(depth.shape)  # row and column of every pixel
    z = np.where(depth > 0, depth, np.nan)
    x = (u - cx) * z / fx
    y = (v - cy) * z / fy
    return np.stack([x, y, z], axis=-1)


tiny = deproject(np.array([[2.0, 2.0, 0.0]]), fx=2, fy=2, cx=1, cy=0)  # one row: left, middle, no data
assert tiny[0, :2].tolist() == [[-1, 0, 2], [0, 0, 2]] and np.isnan(tiny[0, 2]).all()

points = deproject(frame.depth, c.fx, c.fy, c.cx, c.cy)

intrinsics = o3d.camera.PinholeCameraIntrinsic(c.width, c.height, c.fx, c.fy, c.cx, c.cy)
by_open3d = o3d.geometry.PointCloud.create_from_depth_image(  # in metres already; keep everything
    o3d.geometry.Image(frame.depth), intrinsics, depth_scale=1.0, depth_trunc=100.0)
seen = frame.depth > 0
assert np.allclose(points[seen], by_open3d.points, atol=1e-5)
report("points, ours", int(seen.sum()))
report("points, Open3D", len(by_open3d.points))

# %% [markdown]
# Same points, in the same order. And colour costs nothing: the two images are registered, so the point of pixel `[v, u]` takes
# the colour of pixel `[v, u]`.
#
# Equation 9 reads $z = z$. So the document never says where z comes from. A depth camera hands it to us. From two colour
# cameras, as on that UAV, it must be computed first: $z = fB/d$, with $B$ the distance between the cameras and $d$ the
# pixels by which a thing moves from one image to the other (lesson 14).
#
# Are the points *right*? In the simulated room we can ask. We take the cloud to the world with the true pose and measure
# the distance of each point to the true surface. A pose is a 4x4 matrix that says where the camera stands and how it is turned;
# `apply(T, p)` moves points (lesson 02).

# %%
def to_surface_mm(points, frame=frame):
    """Distances in mm from camera points to the room's true surface, under the true pose."""
    return 1000 * metrics.distance_to_surface(transforms.apply(frame.T_world_camera, points), room.mesh)


cloud = pointcloud.PointCloud(points[seen], frame.color[seen])
truth = room.truth["depth"][15]
exact = deproject(truth, c.fx, c.fy, c.cx, c.cy)[truth > 0]
report("median distance to the surface, exact depth", np.median(to_surface_mm(exact)), "mm", smallest=0.01)
report("median distance, depth as measured", np.median(to_surface_mm(cloud.points)), "mm", digits=2)
show(cloud, views=["front", "side", "back"], title="One frame from the front, the side and the back",
     alt="Without perspective the far bookshelf is taller than the table. From the side the floor slopes, "
         "as the camera looked down; from the back the room is mirrored.")

# %% [markdown]
# The formula adds no error of its own: what you see in the second number is the sensor's noise. From the back you look through the
# wall, and its posters read from right to left. A frame is a shell, one layer of points thick.
#
# ## 4 What goes wrong, in millimetres
#
# Now we spoil one setting at a time. The depth is exact, so every millimetre below is the mistake's own. First, commit
# yourself: somebody sets the principal point to half the width and half the height, as equations 3 and 4 say. With pixel
# centres at whole numbers that is half a pixel too much in each direction.

# %%
half_pixel_guess = predict(
    f"With f = {c.fx:.0f}, how far does half a pixel in u and v move a point "
    "at 1.5 m depth?", guess=None, unit="mm")

# %% tags=["hide-input", "prediction"]
half_pixel_guess.answer(
    1000 * np.hypot(0.5, 0.5) * 1.5 / c.fx, digits=2,
    why="Turn the triangle around: at depth z, one pixel is z / f wide. "
        "Take half of it, in u and in v.")

# %%
v, u = np.indices(truth.shape)
string = np.sqrt(1 + ((u - c.cx) / c.fx) ** 2 + ((v - c.cy) / c.fy) ** 2)  # range = depth * string
small = c.scaled(320, 240)  # the intrinsics of another resolution
fov = 2 * np.arctan(320 / c.fx)
whole = 320 / np.tan(fov)  # instead of fov / 2
spoiled = {
    "focal length of another camera (525)": deproject(truth, 525, 525, c.cx, c.cy),
    "z taken for range": deproject(truth / string, c.fx, c.fy, c.cx, c.cy),
    "depth scale 5000 for 1000": deproject(truth / 5, c.fx, c.fy, c.cx, c.cy),
    "whole for half field of view": deproject(truth, whole, whole, c.cx, c.cy),
    "principal point of 320x240": deproject(truth, c.fx, c.fy, small.cx, small.cy),
    "half a pixel": deproject(truth, c.fx, c.fy, c.cx + 0.5, c.cy + 0.5),
}
right = deproject(truth, c.fx, c.fy, c.cx, c.cy)
near = np.abs(truth - 1.5) < 0.1  # the pixels about 1.5 m away
rows = []
for name, spoilt in spoiled.items():
    off = 1000 * (spoilt - right)[near]
    rows.append([name, float(np.hypot(off[:, 0], off[:, 1]).mean()), float(np.abs(off[:, 2]).mean())])
report_table(rows, columns=["mistake", "sideways (mm)", "in depth (mm)"],
             title="Mean error of the points about 1.5 m away")

# %% [markdown]
# Look at the last column. Where it is zero, no depth reading will ever tell you. Seen from above, each mistake has a shape of its
# own; we draw the first three of the six. *z taken for range* lays the stored z along the slanted ray, as if it were the length of the string: so
# each point ends too near, the more so the farther it is from the middle. Here is one row of pixels: it crosses the back wall, and on the right the bookshelf.

# %%
row = 60
fig, axes = plt.subplots(1, 3, figsize=(9, 4.2), sharey=True, layout="constrained")
for axis, (name, spoilt) in zip(axes, list(spoiled.items())[:3], strict=True):
    for points_, what, size in [(right, "reference", 5), (spoilt, "outlier", 2)]:
        axis.plot(points_[row, :, 0], points_[row, :, 2], ".", ms=size, color=show.COLOURS[what],
                  label="right" if what == "reference" else "spoiled")
    axis.plot([0], [0], "^", color=show.COLOURS["truth"], ms=9, label="camera")
    axis.set(title=name.replace(" of another camera", ""), xlabel="x (m)", aspect="equal", ylim=(-0.3, 4.5))
axes[0].set_ylabel("z (m)")
axes[0].legend(loc="center left", fontsize=9)
nearer = np.nanmax(right[row, :, 2] - spoiled["z taken for range"][row, :, 2])
picture(fig, alt="One image row from above, right and spoiled. A wrong focal length pulls everything towards "
                 "the axis and keeps the back wall straight. z taken for range bends it into an arc and brings points "
                 f"up to {nearer:.2f} m nearer. A wrong scale shrinks the room towards the camera.")

# %% [markdown]
# The last mistake loses points instead of moving them. `RGBDImage.create_from_color_and_depth`, which the report's
# appendix calls, has a `depth_trunc` of 3 metres unless you say otherwise:

# %%
def by_default(color, depth):
    """The depth image that Open3D keeps of an RGB-D pair in metres, when only the scale is given."""
    pair = o3d.geometry.RGBDImage.create_from_color_and_depth(
        o3d.geometry.Image(color), o3d.geometry.Image(depth), depth_scale=1.0)
    return np.asarray(pair.depth)


cut = by_default(frame.color, truth)
report("points dropped by default", 100 * (1 - (cut > 0).sum() / (truth > 0).sum()), "%")
report("deepest point of the frame", float(truth.max()), "m")
report("cut off its far end", 1000 * float(truth.max() - cut.max()), "mm")

# %% [markdown]
# No warning, no error: the bookshelf, the lamp and the lower part of the back wall are gone. (The camera looks down, so the wall's upper part
# has the smaller z.) Truncating is useful, because far depth is bad depth. But choose it yourself.
#
# One of the mistakes is small enough to stay unnoticed. It becomes this lesson's row in the error budget:

# %%
half_pixel_mm = 1000 * np.linalg.norm(spoiled["half a pixel"] - right, axis=-1)[near].mean()
show.error_budget({"intrinsics": (0.5, half_pixel_mm)})

# %% [markdown]
# ## 5 The flip belongs to viewing
#
# Most 3D viewers have y up and look along −z. Give them camera points and the room stands on its head. So the report's code, and
# most tutorials, multiply y and z by −1 before drawing. It is a half turn about x, nothing is mirrored, and the picture is
# good. The trouble starts when the flipped points are *kept*.

# %%
flip = np.array([1, -1, -1])
assert np.linalg.det(np.diag(flip)) == 1  # a rotation: letters stay readable

moved = transforms.apply(frame.T_world_camera, exact * flip) - transforms.apply(frame.T_world_camera, exact)
report("how far a kept flip moves a point, median", np.median(np.linalg.norm(moved, axis=1)), "m")
flipped = pointcloud.PointCloud(cloud.points * flip, cloud.colors)
ceiling = room.mesh.vertices[:, 2].max()
above = transforms.apply(frame.T_world_camera, exact * flip)[:, 2] > ceiling
report("flipped points above the ceiling", 100 * above.mean(), "%", digits=2)
show.panels({"camera axes: seen from behind": cloud, "flipped for that viewer": flipped},
            frame="object", view="front",
            alt="Left the room hangs upside down, seen from behind; right it stands, seen from the front.")

# %% [markdown]
# Nothing is mirrored on the left either: a y-up viewer stands behind the wall, sees the room upside down, and reads its posters from
# their backs. The pose expects x right, y down, z
# forward. Flipped points land behind the camera, many of them above the ceiling. Keep the data in the
# camera's axes and turn the *viewer*. Our `show` does that: it knows which way the camera's y points, and you never flip.

# %% [markdown]
# ## Report against reality
#
# Equation 1 of the UAV document is the formula of section 2, printed as `fx = 0.5 * width/tan(FOV/2)`. Its camera lives in Unity, and Unity's field of view is
# measured from top to bottom unless you change it. We put such a camera, 60 degrees high, where ours stands, cast one ray a pixel
# at the true surface, and lift the exact depth in three ways.

# %%
unity = pinhole.camera_from_fov(np.radians(60), 640, 480, axis="vertical")
T = frame.T_world_camera
caster = o3d.t.geometry.RaycastingScene()
caster.add_triangles(room.mesh.vertices.astype(np.float32), room.mesh.triangles.astype(np.uint32))
ahead = pinhole.pixel_rays(unity) @ T[:3, :3].T  # where each pixel looks, in the world
rays = np.concatenate([np.broadcast_to(T[:3, 3], ahead.shape), ahead], axis=-1).astype(np.float32)
z = caster.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()  # rays of z = 1, so what comes back is the depth

is_right = deproject(z, unity.fx, unity.fy, unity.cx, unity.cy)
readings = {
    "equations 1-4 as printed": (focal_length(60, 640), 320, 240),
    "the angle taken as vertical": (focal_length(60, 480), 320, 240),
    "and pixel centres at whole numbers": (focal_length(60, 480), 319.5, 239.5),
}
rows = []
for name, (f, cx, cy) in readings.items():
    off = 1000 * np.linalg.norm(deproject(z, f, f, cx, cy) - is_right, axis=-1)
    rows.append([name, float(f), float(np.nanmedian(off))])
report_table(rows, columns=["reading", "f (pixels)", "points off by, median (mm)"])

# %% [markdown]
# Equation 1 holds for a horizontal angle. Everybody has taken a field of view the wrong way round once; the cloud still looks
# like a room. The other claims of this lesson:
#
# | The document says | What we found | Evidence |
# |---|---|---|
# | UAV eq. 1: f from width and FOV | holds if the FOV is horizontal; Unity's is vertical | experiment above |
# | UAV eq. 2: fy = fx | holds for square pixels; real cameras differ by parts of a pixel | `realsense_planes`, below |
# | UAV eq. 3 and 4: cx = width / 2 | half a pixel too much where centres lie at whole numbers | table in section 4 |
# | UAV eq. 5 to 8: projection and its inverse | they hold | sections 1 and 3 |
# | UAV eq. 9: z = z, for points "from a disparity image" | z is never computed; z = f B / d is missing | reading; section 3 |
# | Report 8: images "of the same size" make a cloud | they must show the same view | On real data, below |
# | Report 8: "the same code" for your own images | it says `PrimeSenseDefault`: wrong f for every other camera | Break it |
# | Report 8: the flip in `pcd.transform` | for viewing only | section 5 |
# | Report 8: `SampleSUNRGBDImage()` under "Read TUM dataset" | a slip in Open3D's own manual; the printed code reads the TUM files by path, so nothing breaks | reading |
# | Lecture: depth "can be readily converted" | yes, with the intrinsics of that resolution and the depth scale | section 4 |

# %% [markdown]
# ## Break it
#
# The report lifts every frame with `PrimeSenseDefault`, f = 525, also those of its D455. Let us do the same and look at the result
# as most people do: from the front.

# %%
lazy = deproject(frame.depth, 525, 525, 319.5, 239.5)
show.panels({"its own f": cloud, "f = 525": pointcloud.PointCloud(lazy[seen], cloud.colors)}, view="camera",
            alt="Two pictures of the room from where the camera stood. They are the same.")

# %% [markdown]
# There is no difference to see. A wrong f multiplies x and y by one number and leaves z. From the camera's place that is a magnified
# picture and nothing else, and flat walls stay flat. So measure. Two stickers on the table lie 1.3 m apart by tape, and
# `project` says which pixels show them.

# %% tags=["hide-input"]
stickers = np.array([[-0.65, -0.22, 0.75], [0.65, -0.22, 0.75]])  # in the world; you would click on them
seen_from_here = transforms.apply(transforms.invert(frame.T_world_camera), stickers)
(u1, v1), (u2, v2) = np.rint(project(seen_from_here, c.fx, c.fy, c.cx, c.cy)).astype(int)
fig, axis = plt.subplots(figsize=(5, 3.75), layout="constrained")
axis.imshow(frame.color)
axis.plot([u1, u2], [v1, v2], "o-", color="white", mec="black", ms=9, lw=1)
axis.axis("off")
picture(fig, alt=f"The room with two dots on the table, at pixels ({u1}, {v1}) and ({u2}, {v2}), and a line between them.")

# %%
apart_guess = predict(
    "How far apart are they in the cloud that was lifted with 525 instead of "
    f"{c.fx:.0f}?", guess=None, unit="m")

# %% tags=["hide-input", "prediction"]
tape = 1.3
measured = np.linalg.norm(lazy[v2, u2] - lazy[v1, u1])
apart_guess.answer(
    measured,
    why="Sideways, all shrinks by the ratio of the focal lengths, and the "
        "stickers lie side by side.")

# %% [markdown]
# One known length also mends it. Across the image, lengths go with 1/f, so the right f is the wrong one times measured over true. That
# is true only for things that lie across the image: what also slants in depth has a part in z, which no f changes.

# %%
mended = 525 * measured / tape
report("f, from one known length", mended, "pixels")
report("f, true", c.fx, "pixels")
off = np.linalg.norm(deproject(truth, mended, mended, c.cx, c.cy) - right, axis=-1)
report("points about 1.5 m away are now off by", 1000 * off[near].mean(), "mm", digits=1)

# %% [markdown]
# A professional does not guess f. They read it from the device at the resolution in use, or calibrate (lesson 11). And they keep a
# box of known size in the scene: it costs nothing and finds this mistake in a minute.
#
# ## On real data
#
# Three real pairs and a RealSense frame, each read with its own encoding. We lift them and let Open3D check every point. Then we
# let Open3D drop what its default drops.

# %% tags=["real-data"]
# real data: tum_pair, sun_pair, redwood_frames, realsense_planes
rows = []
for name in ["tum_pair", "sun_pair", "redwood_frames", "realsense_planes"]:
    real = data.load(name).frames[0]
    k = real.camera
    lifted = deproject(real.depth, k.fx, k.fy, k.cx, k.cy)
    intrinsic = o3d.camera.PinholeCameraIntrinsic(k.width, k.height, k.fx, k.fy, k.cx, k.cy)
    theirs = o3d.geometry.PointCloud.create_from_depth_image(
        o3d.geometry.Image(real.depth), intrinsic, depth_scale=1.0, depth_trunc=100.0)
    valid = real.depth > 0
    assert np.allclose(lifted[valid], theirs.points, atol=1e-5)
    kept = by_default(real.color, real.depth) > 0
    rows.append([name, int(valid.sum()), f"{k.fx:.1f}, {k.fy:.1f}", float(np.median(real.depth[valid])),
                 float(real.depth.max()), 100 * (1 - kept.sum() / valid.sum())])
report_table(rows, columns=["dataset", "points", "fx, fy", "median z (m)", "deepest (m)", "dropped (%)"])

# %% [markdown]
# The intrinsics in the last row came with the recording. The other three are *assumed*: nobody calibrated those cameras for us.
# Here is the TUM desk from three sides, as the report shows its own frame in figure 8. This time we truncate on purpose:

# %% tags=["real-data"]
# real data: tum_pair
desk = data.load("tum_pair").frames[0]
lifted = pointcloud.from_frame(desk)
show(lifted.select(lifted.points[:, 2] < 3.5), views=["front", "side", "back"],
     title="TUM: a desk from the front, the side and the back",
     alt="A desk with a globe and bottles, two chairs before it, a board behind it. From the side the floor "
         "slopes and its far part is cut into stripes.")

# %% [markdown]
# The camera looked down, so in its frame the floor slopes; nobody told us its pose. And from the side the far floor falls into
# stripes: this sensor measures in steps, and the steps grow with distance.
#
# Now a recording that looks innocent: `realsense_slam`, both images 640x480. Is its depth registered to its colour? Where depth
# jumps, colour usually changes, too. So we ask how strong the colour contrast is under the outlines of the depth image. We
# rank all pixels by contrast, from 0 to 1, and average the ranks under the outlines. By chance that is 0.5.
#
# `outlines` marks where depth jumps, magnified by a zoom; `agreement` is the mean rank of the colour contrast under those marks.

# %% tags=["hide-input"]
def outlines(depth, zoom=1.0):
    """(H, W) bool: where depth jumps by more than 5 %, magnified about the middle of the image."""
    near = cv2.erode(np.where(depth > 0, depth, 99).astype(np.float32), np.ones((3, 3)))
    far = cv2.dilate(depth, np.ones((3, 3)))
    jumps = ((far - near > 0.05 * far) & (near < 99)).astype(np.uint8)
    h, w = depth.shape
    magnify = np.array([[zoom, 0, (1 - zoom) * (w - 1) / 2], [0, zoom, (1 - zoom) * (h - 1) / 2]])
    return cv2.warpAffine(jumps, magnify, (w, h), flags=cv2.INTER_NEAREST) > 0


def agreement(color, depth, zoom=1.0):
    """Mean rank of the colour contrast under the outlines: 1 is the best pixel of the image, 0.5 is chance."""
    grey = cv2.GaussianBlur(cv2.cvtColor(color, cv2.COLOR_RGB2GRAY).astype(np.float32), (0, 0), 1.5)
    contrast = np.hypot(cv2.Sobel(grey, -1, 1, 0), cv2.Sobel(grey, -1, 0, 1))
    rank = contrast.ravel().argsort().argsort().reshape(contrast.shape) / contrast.size
    return rank[outlines(depth, zoom)].mean()


# %% tags=["real-data"]
# real data: tum_pair, sun_pair, redwood_frames, realsense_planes, realsense_slam
zooms = np.arange(8, 21) / 10
which = {"tum_pair": 0, "sun_pair": 0, "redwood_frames": 0, "realsense_planes": 1, "realsense_slam": 4}
rows = []
for name, i in which.items():
    real = data.load(name).frames[i]
    curve = [agreement(real.color, real.depth, zoom) for zoom in zooms]
    rows.append([name, float(curve[2]), float(zooms[np.argmax(curve)]), float(np.max(curve))])
report_table(rows, columns=["dataset", "agreement as stored", "best zoom of depth", "agreement there"],
             digits=2)

# %% [markdown]
# In the next picture, look only at the arch of the foot.

# %% tags=["real-data"]
# real data: tum_pair, sun_pair, redwood_frames, realsense_planes, realsense_slam
slam = data.load("realsense_slam").frames[4]
yellow = np.uint8([255, 220, 0])
overlays = {f"depth outlines, zoom {zoom:g}":
            np.where(outlines(slam.depth, zoom)[..., None], yellow, slam.color) for zoom in (1.0, 1.6)}
show.images(overlays, alt="A black stand on a floor, with the outlines of its depth image in yellow. At zoom 1 the "
                          "yellow arch of the foot is smaller than the foot and lies beside its edges; at zoom "
                          "1.6 it lies on them.")

# %% [markdown]
# Four recordings fit best as they are. This one fits no better than chance, and best when its depth is magnified.
# Magnified to fit = drawn too small = wider view = shorter f: its depth camera sees more than its colour camera. Same size, different views. Colour its cloud pixel by pixel
# and the floor wears the stand's black. A zoom is only a stopgap. To register it we need both intrinsics and the pose between
# the cameras, and the recording does not hold them. RealSense software has them: call `rs.align` *before* you save.
#
# ## Key points
#
# - A pixel is a direction; depth puts the point on it: x = (u − cx) z / f.
# - Intrinsics belong to one camera at one resolution. Ask: which angle, which axis, which centre?
# - A wrong f keeps the front view and all depths. Measure something of known length.
# - Scale, truncation, zeros and range fail silently. Print a count and a median.
# - Flip the viewer, not the data. Same size is not registered.
#
# Words to know: [pinhole camera](../docs/glossary.md#pinhole-camera), [focal length](../docs/glossary.md#focal-length),
# [principal point](../docs/glossary.md#principal-point), [field of view](../docs/glossary.md#field-of-view),
# [intrinsics](../docs/glossary.md#intrinsics), [deproject](../docs/glossary.md#deproject).
#
# ## Your own camera
#
# Change one line, in the first cell: `frame = data.from_folder("path/to/my_recording", camera="camera.json").frames[0]`. Everything
# up to the check against Open3D runs on your frame; what needs truth does not. With a D455, take fx, fy, cx and cy from the device, for the
# resolution that you record: `profile.as_video_stream_profile().get_intrinsics()`. In ROS, fx, fy, cx and cy are `K[0]`, `K[4]`, `K[2]` and
# `K[5]` of `CameraInfo`. A rough start without either: `camera="d455_depth_640x480"`, computed from the data sheet's angle as in section 2.
#
# ## To the lab
#
# Lab 03 has you write `deproject`, mend somebody's cloud, and find the focal length of a camera that came without a data sheet:
# `python3 course.py start 03`.
#
# ## Going further
#
# - Real lenses bend rays. `course_lib.camera.pinhole` deprojects with Brown's distortion model; lesson 11 measures it.
# - Where z comes from: with two cameras a baseline B apart, z = f B / d for a disparity of d pixels (lesson 14). That is the line that
#   the UAV document's equations leave out; OpenCV's `reprojectImageTo3D` does it.
# - Open3D mixes two conventions: `create_from_depth_image` puts pixel centres at whole numbers, `create_rays_pinhole` and
#   `VoxelBlockGrid` half a pixel beside. Give the latter two cx + 0.5 and cy + 0.5.
# - A wrong f is an affine map: planes stay planes and parallels stay parallel, but right angles that do not lie along the
#   image's axes change, and no rigid registration repairs it (lesson 07).
# - Hartley and Zisserman, *Multiple View Geometry in Computer Vision*, 2nd edition, chapter 6. Intel, *Projection in RealSense SDK
#   2.0*: the two cameras of a device, and `align`.
