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
from course_lib.notebook import data, picture, predict
from course_lib.notebook import report, report_table, show

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
     title="One RGB-D frame: from the camera's place, and from above",
     alt="A living room: a table with a rabbit, a globe, books and a box, "
         "posters on the wall behind. Left as a photograph; right from above "
         "at an angle, with white shadows behind everything near.")

# %% [markdown]
# Both pictures show the same points. The left one, labelled *sensor*, is drawn from where the camera stood and looks
# like a photograph; *iso* is from above at an angle. For the right one we walked around the scene, although the camera took one
# frame and never moved. White is what it could not see; the specks in the air are flying pixels
# (lesson 01). This lesson is about the step from a depth image to such a cloud.
#
# ## Card
#
# | | |
# |---|---|
# | You will | compute a focal length from a field of view; write deprojection and check it against Open3D; tell wrong settings apart by what they do to x, y and z, and price them in millimetres; find f again from one known length; find a recording whose depth does not fit its colour |
# | Minutes | 55 for the core, 50 for the lab |
# | Before | lesson 01 (depth, no data), lesson 02 (frames, `T_world_camera`) |
# | Teaches | of a paper on mapping terrain from a UAV's stereo camera, section III A (UAV); of a report on Open3D and a RealSense D455, section 8 (Report); of a lecture on point clouds for robots, "Depth map to point cloud" (Lecture) |
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
axis.fill([0, z_drawn, z_drawn], [0, 0, x_drawn], color="0.9")
axis.fill([0, 0.8, 0.8], [0, 0, 0.4], color="0.7")
axis.plot([0, 2.4], [0, 0], color="black", lw=1)
axis.plot([0, z_drawn], [0, x_drawn], color="black", lw=2)
axis.plot([0.8, 0.8], [-0.1, 0.62], color="black", lw=3)
axis.plot([z_drawn], [x_drawn], "o", color=show.COLOURS["target"], ms=10)
axis.plot([0], [0], "o", color="black", ms=8)
for end, low in [(0.8, -0.16), (z_drawn, -0.36)]:
    axis.annotate("", (0, low), (end, low),
                  arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
for place, text, side in [
    ((-0.03, 0.07), "hole", "center"),
    ((0.4, -0.28), f"f = {f_drawn} pixels", "center"),
    ((0.84, 0.13), f"u - cx =\n{shift:.0f} pixels", "left"),
    ((1.3, -0.48), f"z = {z_drawn:g} m", "center"),
    ((2.04, 0.45), f"x = {x_drawn:g} m", "left"),
    ((2.06, 1.0), "point", "left"),
    ((0.78, 0.66), "image", "center"),
    ((2.42, -0.1), "optical axis", "right"),
]:
    axis.text(*place, text, ha=side, fontsize=10)
axis.set(xlim=(-0.2, 2.5), ylim=(-0.52, 1.12), aspect="equal",
         title="Two triangles of the same shape")
axis.axis("off")
picture(fig, alt=f"A point {x_drawn:g} m right of the optical axis and "
                 f"{z_drawn:g} m deep. The line from it to the hole crosses "
                 f"the image {shift:.0f} pixels right of the middle, "
                 f"{f_drawn} pixels in front of the hole. The small triangle "
                 "up to the image and the large one up to the point have the "
                 "same shape.")

# %% [markdown]
# Two triangles share a corner at the hole, so they have the same shape: $(u - c_x) / f = x / z$. Solve for $u$, do the same for
# rows, and you can project a point, that is, compute its pixel:
#
# $$u = f\,\frac{x}{z} + c_x, \qquad v = f\,\frac{y}{z} + c_y$$
#
# The **focal length** $f$ is the distance from the hole to the image. Only the ratio of $u - c_x$ to $f$ matters, so both may be
# in pixels. The line straight ahead is the optical axis; it meets the image at the **principal point** $(c_x, c_y)$. 640 columns are
# numbered 0 to 639, so their middle is 319.5, not 320: $c_x = (W - 1)/2$ for $W$ columns. Rows may have an $f$ of their own, so we carry two: `fx` and `fy`.
#
# The code below takes one point, a list of points or an image of points: `(..., 3)` means that x, y and z come last, whatever
# stands before.

# %%
def project(points, fx, fy, cx, cy):
    """Pixels (..., 2), u before v, of points (..., 3) in the camera frame."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return np.stack([fx * x / z + cx, fy * y / z + cy], axis=-1)


# The drawing: 1 m right and 2 m deep. Half of f is 200: column 319.5 + 200.
drawn = np.array([1.0, 0.0, 2.0])
assert project(drawn, 400, 400, 319.5, 239.5).tolist() == [519.5, 239.5]

ray = np.array([[0.5, 0, 1], [1, 0, 2], [2, 0, 4]])  # 1, 2 and 4 times as far
assert (project(ray, 400, 400, 319.5, 239.5) == [519.5, 239.5]).all()

c = frame.camera  # the fx, fy, cx and cy of our frame
report("f of our frame's camera", c.fx, "pixels")
rng = np.random.default_rng(3)
some = rng.uniform([-1, -1, 1], [1, 1, 4], (1000, 3))
K = np.array([[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]])  # OpenCV's form
by_opencv, _ = cv2.projectPoints(some, np.zeros(3), np.zeros(3), K, None)
assert np.allclose(project(some, c.fx, c.fy, c.cx, c.cy), by_opencv[:, 0])

# %% [markdown]
# Look at the second assert. Three points, one pixel. A photograph keeps the direction and forgets the distance. The depth image
# is the missing number.
#
# ## 2 The focal length comes from the field of view
#
# Data sheets and simulators rarely give $f$. They give the **field of view**: the angle from one edge of the image to the
# other. Half the image and $f$ are the short sides of a right-angled triangle, with half the angle between $f$ and the longest
# side. The tangent of that angle is the side opposite to it over the side beside it, here half the image over $f$. So
# $f = \tfrac12 W / \tan(\tfrac12 \text{FOV})$. Why $W/2$ here and $(W - 1)/2$ for $c_x$? The angle spans $W$ pixels, from
# outer edge to outer edge; the *centres* of the first and the last pixel are only $W - 1$ apart. Four numbers, $f_x, f_y, c_x, c_y$, describe the camera at one
# resolution. They are its **intrinsics**. They belong to the whole image: a pixel of a window that was cut out of it looks where it
# looked before, so count its column and row in the whole image.

# %%
def focal_length(fov_degrees, pixels):
    """Focal length in pixels, from the whole angle that `pixels` span."""
    return 0.5 * pixels / np.tan(np.radians(fov_degrees) / 2)


assert np.isclose(focal_length(90, 640), 320)  # the tangent of 45 degrees is 1
by_library = pinhole.focal_length(np.radians(60), 640)
assert np.isclose(focal_length(60, 640), by_library)

wrong = {
    "half of both": lambda fov: focal_length(fov, 640),
    "the whole angle": lambda fov: 320 / np.tan(np.radians(fov)),
    "degrees for radians": lambda fov: 320 / np.tan(fov / 2),
    "tangent upside down": lambda fov: 320 * np.tan(np.radians(fov) / 2),
    "in proportion to 90": lambda fov: 320 * 90 / fov,
}
report_table([[name, *(float(formula(fov)) for fov in (90, 60, 45))]
              for name, formula in wrong.items()],
             columns=["formula", "f at 90 degrees", "at 60", "at 45"],
             smallest=0.01)

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
# Turn both equations around: $x = (u - c_x)\,z/f$ and $y = (v - c_y)\,z/f$. To **deproject** is to do this for every pixel of a
# depth image. Here it is, in five lines.

# %%
def deproject(depth, fx, fy, cx, cy):
    """Points (H, W, 3) of a depth image (H, W); NaN where it holds no data."""
    v, u = np.indices(depth.shape)  # row and column of every pixel
    z = np.where(depth > 0, depth, np.nan)
    x = (u - cx) * z / fx
    y = (v - cy) * z / fy
    return np.stack([x, y, z], axis=-1)


row_of_3 = np.array([[2.0, 2.0, 0.0]])  # left, middle, and a pixel without data
tiny = deproject(row_of_3, fx=2, fy=2, cx=1, cy=0)
assert tiny[0, :2].tolist() == [[-1, 0, 2], [0, 0, 2]]
assert np.isnan(tiny[0, 2]).all()

points = deproject(frame.depth, c.fx, c.fy, c.cx, c.cy)


def with_open3d(depth, camera):
    """Open3D's cloud of a depth image in metres, with nothing cut off."""
    intrinsics = o3d.camera.PinholeCameraIntrinsic(
        camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    return o3d.geometry.PointCloud.create_from_depth_image(
        o3d.geometry.Image(depth), intrinsics,
        depth_scale=1.0, depth_trunc=100.0)


by_open3d = with_open3d(frame.depth, c)
seen = frame.depth > 0
assert np.allclose(points[seen], by_open3d.points, atol=1e-5)
report("points, ours", int(seen.sum()))
report("points, Open3D", len(by_open3d.points))

# %% [markdown]
# Same points, in the same order. And colour costs nothing: the two images are registered, so the point of pixel `[v, u]` takes
# the colour of pixel `[v, u]`.
#
# Are the points *right*? In the simulated room we can ask. We take the cloud to the world with the true pose and measure
# the distance of each point to the true surface. A pose is a 4x4 matrix that says where the camera stands and how it is turned;
# `apply(T, p)` moves points (lesson 02).

# %%
def to_surface_mm(points):
    """Distances in mm from camera points to the room's true surface."""
    in_world = transforms.apply(frame.T_world_camera, points)  # the true pose
    return 1000 * metrics.distance_to_surface(in_world, room.mesh)


cloud = pointcloud.PointCloud(points[seen], frame.color[seen])
truth = room.truth["depth"][15]
exact = deproject(truth, c.fx, c.fy, c.cx, c.cy)[truth > 0]
report("median distance to the surface, exact depth",
       np.median(to_surface_mm(exact)), "mm", smallest=0.01)
report("median distance, depth as measured",
       np.median(to_surface_mm(cloud.points)), "mm", digits=2)
show(cloud, views=["front", "side", "back"],
     title="One frame from the front, the side and the back",
     alt="Without perspective the far bookshelf is taller than the table. "
         "From the side the floor slopes, as the camera looked down; from "
         "the back the room is mirrored.")

# %% [markdown]
# The formula adds no error of its own: what you see in the second number is the sensor's noise. From the back you look through the
# wall, and its posters read from right to left. A frame is a shell, one layer of points thick.
#
# ## 4 What goes wrong, in millimetres
#
# Now we spoil one setting at a time. The depth is exact, so every millimetre below is the mistake's own. One mistake needs a
# number first. Some devices and simulators store the **range**, the length of the ray to the point, in the place of z. The ray
# of a pixel whose z is 1 goes $(u - c_x)/f$ to the side and $(v - c_y)/f$ down, so its length is
# $\sqrt{1 + ((u - c_x)/f)^2 + ((v - c_y)/f)^2}$. A range is z times this length, and z = range / length. So there are two
# ways to confuse them: to read a range as z, or z as a range. The table prices the second: z was stored, and is divided
# by the length all the same.

# %%
v, u = np.indices(truth.shape)
ray_length = np.sqrt(1 + ((u - c.cx) / c.fx) ** 2 + ((v - c.cy) / c.fy) ** 2)
small = c.scaled(320, 240)  # the intrinsics of another resolution
spoiled = {
    "focal length of another camera (525)":
        deproject(truth, 525, 525, c.cx, c.cy),
    "z taken for range":
        deproject(truth / ray_length, c.fx, c.fy, c.cx, c.cy),
    "depth scale 5000 for 1000":
        deproject(truth / 5, c.fx, c.fy, c.cx, c.cy),
    "principal point of 320x240":
        deproject(truth, c.fx, c.fy, small.cx, small.cy),
}
right = deproject(truth, c.fx, c.fy, c.cx, c.cy)
near = np.abs(truth - 1.5) < 0.1  # the pixels about 1.5 m away
rows = []
for name, spoilt in spoiled.items():
    off = 1000 * (spoilt - right)[near]
    sideways, deep = np.hypot(off[:, 0], off[:, 1]), np.abs(off[:, 2])
    rows.append([name, float(sideways.mean()), float(deep.mean())])
report_table(rows, columns=["mistake", "sideways (mm)", "in depth (mm)"],
             title="Mean error of the points about 1.5 m away")

# %% [markdown]
# Look at the last column. Where it is zero, no depth reading will ever tell you. Seen from above, each mistake has a shape of its
# own; we draw the first three, for one row of pixels. *z taken for range* lays the stored z along the slanted ray, as if it were
# the ray's length: so each point ends too near, the more so the farther it is from the middle.

# %%
row = 60
fig, axes = plt.subplots(1, 3, figsize=(9, 4.2), sharey=True,
                         layout="constrained")
for axis, name in zip(axes, list(spoiled)[:3], strict=True):
    x, _, z = right[row].T
    axis.plot(x, z, ".", ms=5, color=show.COLOURS["reference"], label="right")
    x, _, z = spoiled[name][row].T
    axis.plot(x, z, ".", ms=2, color=show.COLOURS["outlier"], label="spoiled")
    axis.plot([0], [0], "^", color=show.COLOURS["truth"], ms=9, label="camera")
    axis.set(title=name.replace(" of another camera", ""), xlabel="x (m)",
             aspect="equal", ylim=(-0.3, 4.5))
axes[0].set_ylabel("z (m)")
axes[0].legend(loc="center left", fontsize=9)
for x, z, text in [(-1.7, 3.1, "back wall"), (-0.4, 4.2, "bookshelf"),
                   (1.6, 2.8, "lamp, wall")]:
    axes[0].text(x, z, text, fontsize=9)
nearer = np.nanmax((right - spoiled["z taken for range"])[row, :, 2])
picture(fig, alt="One image row from above, right and spoiled. A wrong focal "
                 "length pulls everything towards the axis and keeps the "
                 "back wall straight. z taken for range bends it into an arc "
                 f"and brings points up to {nearer:.2f} m nearer. A wrong "
                 "scale shrinks the room towards the camera.")

# %% [markdown]
# One more mistake keeps every z: **rows for columns**. Compute x from v and y from u, and x follows the rows of the image: the
# room lies on its side, and mirrored.
#
# The next mistake loses points instead of moving them. Open3D's `RGBDImage.create_from_color_and_depth` has a `depth_trunc` of
# 3 metres unless you say otherwise:

# %%
def by_default(color, depth):
    """What Open3D keeps of a depth image in metres unless told otherwise."""
    pair = o3d.geometry.RGBDImage.create_from_color_and_depth(
        o3d.geometry.Image(color), o3d.geometry.Image(depth), depth_scale=1.0)
    return np.asarray(pair.depth)


cut = by_default(frame.color, truth)
dropped = 1 - np.count_nonzero(cut) / np.count_nonzero(truth)
report("points dropped by default", 100 * dropped, "%")
report("deepest point of the frame", float(truth.max()), "m")
report("cut off its far end", 1000 * float(truth.max() - cut.max()), "mm")

# %% [markdown]
# No warning, no error: the bookshelf, the lamp and the lower part of the back wall are gone. (The camera looks down, so the wall's upper part
# has the smaller z.) Truncating is useful, because far depth is bad depth. But choose it yourself.
#
# The last mistake is small enough to stay unnoticed: somebody sets the principal point to half the width and half the height.
# Where the centres of pixels lie at whole numbers, that is half a pixel too much in each direction.

# %%
half_pixel_guess = predict(
    f"With f = {c.fx:.0f}, how far does half a pixel in u and v move a point "
    "at 1.5 m depth?", guess=None, unit="mm")

# %% tags=["hide-input", "prediction"]
# The answer: run this after your guess.
half_pixel_guess.answer(
    1000 * np.hypot(0.5, 0.5) * 1.5 / c.fx, digits=2,
    why="Turn the triangle around: at depth z, one pixel is z / f wide. "
        "Take half of it, in u and in v.")

# %% [markdown]
# This one becomes the lesson's row in the error budget:

# %% tags=["prediction"]
half = deproject(truth, c.fx, c.fy, c.cx + 0.5, c.cy + 0.5)
half_pixel_mm = 1000 * np.linalg.norm(half - right, axis=-1)[near].mean()
show.error_budget({"intrinsics": (0.5, half_pixel_mm)})

# %% [markdown]
# Noise goes up and down and can be averaged away. Half a pixel shifts every point to the same side, and no average removes it.

# %% [markdown]
# ## 5 The flip belongs to viewing
#
# Most 3D viewers have y up and look along −z. Give them camera points and the room stands on its head. So most
# tutorials multiply y and z by −1 before drawing. It is a half turn about x, nothing is mirrored, and the picture is
# good. The trouble starts when the flipped points are *kept*.

# %%
flip = np.array([1, -1, -1])
assert np.linalg.det(np.diag(flip)) == 1  # a rotation: letters stay readable

where_it_is = transforms.apply(frame.T_world_camera, exact)
where_kept = transforms.apply(frame.T_world_camera, exact * flip)
moved = np.linalg.norm(where_kept - where_it_is, axis=1)
report("how far a kept flip moves a point, median", np.median(moved), "m")
above = where_kept[:, 2] > room.mesh.vertices[:, 2].max()
report("flipped points above the ceiling", 100 * above.mean(), "%", digits=2)
flipped = pointcloud.PointCloud(cloud.points * flip, cloud.colors)
show.panels({"camera axes: seen from behind": cloud,
             "flipped for that viewer": flipped}, frame="object", view="front",
            alt="Left the room hangs upside down, seen from behind; right it "
                "stands, seen from the front.")

# %% [markdown]
# Nothing is mirrored on the left either: that viewer stands behind the wall and reads the posters from their backs. But the pose
# expects x right, y down, z forward, so flipped points land behind the camera, many of them above the ceiling. Keep the data in
# the camera's axes and turn the *viewer*. Our `show` does that: it knows which way the camera's y points, and you never flip.

# %% [markdown]
# ## Report against reality
#
# A paper on mapping terrain from a UAV's stereo camera (UAV) prints the formula of section 2 as its equation 1,
# `fx = 0.5 * width/tan(FOV/2)`. Its camera lives in the game engine Unity, whose field of view is measured from top to bottom
# unless you change it. We put such a camera, 60 degrees high, where ours stands. `exact_depth` gives the depth that it would see,
# and we lift it in three ways.

# %% tags=["hide-input"]
def exact_depth(camera):
    """Depth (H, W) in metres of the true surface, from our frame's place."""
    T = frame.T_world_camera
    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(room.mesh.vertices.astype(np.float32),
                         room.mesh.triangles.astype(np.uint32))
    ahead = pinhole.pixel_rays(camera) @ T[:3, :3].T  # where each pixel looks
    start = np.broadcast_to(T[:3, 3], ahead.shape)
    rays = np.concatenate([start, ahead], axis=-1).astype(np.float32)
    hits = caster.cast_rays(o3d.core.Tensor(rays))
    return hits["t_hit"].numpy()  # the rays have a z of 1: this is the depth


# %%
unity = pinhole.camera_from_fov(np.radians(60), 640, 480, axis="vertical")
z = exact_depth(unity)
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
report_table(rows, columns=["reading", "f (pixels)",
                            "points off by, median (mm)"])

# %% [markdown]
# Equation 1 holds for a horizontal angle. Everybody has taken a field of view the wrong way round once; the cloud still looks
# like a room. What the paper, a report on reconstruction with Open3D and a RealSense D455 (Report) and a lecture on point clouds
# for robots (Lecture) say besides:
#
# | The text says | What we found | Evidence |
# |---|---|---|
# | UAV eq. 3 and 4: cx = width / 2 | half a pixel too much where centres lie at whole numbers | section 4, and the last two rows above |
# | UAV eq. 5 to 8: projection and its inverse | they hold | sections 1 and 3 |
# | UAV eq. 9: z = z, for points "from a disparity image" | how z comes from a disparity (by how many pixels a thing moves from one camera's image to the other's) is left out | lesson 14 |
# | Report 8: the flip in `pcd.transform` | for viewing only | section 5 |
# | Lecture: depth "can be readily converted" | yes, with the intrinsics of that resolution and the depth scale | section 4 |
#
# Two claims of the Report are tried in what follows: that "the same code", with its fixed f, serves for your own images (Break
# it), and that a colour and a depth image "of the same size" make a cloud (On real data).
#
# The formulas hold. What goes wrong is what they are fed with: which angle, which centre, whose f, which unit.

# %% [markdown]
# ## Break it
#
# Much example code lifts every frame with Open3D's `PrimeSenseDefault`, whatever camera took it. Its f = 525 is the nominal one of
# one family of cameras (Kinect, Xtion). Let us do the same and look at the result as most people do: from the front.

# %%
lazy = deproject(frame.depth, 525, 525, 319.5, 239.5)
show.panels({"its own f": cloud,
             "f = 525": pointcloud.PointCloud(lazy[seen], cloud.colors)},
            view="camera",
            alt="Two pictures of the room from where the camera stood. They "
                "are the same.")

# %% [markdown]
# There is no difference to see. A wrong f multiplies x and y by one number and leaves z. But whoever draws the cloud with the same
# wrong f sees each point on its own pixel again: x / z · 525 is u − cx, whatever the 525 should have been. The error cancels in
# the picture, not in the cloud; and flat walls stay flat. So measure. Two stickers on the table lie 1.3 m apart by tape, and
# `project` says which pixels show them.

# %% tags=["hide-input"]
stickers = np.array([[-0.65, -0.22, 0.75], [0.65, -0.22, 0.75]])  # in the world
T_camera_world = transforms.invert(frame.T_world_camera)
in_camera = transforms.apply(T_camera_world, stickers)
pixels = project(in_camera, c.fx, c.fy, c.cx, c.cy)
(u1, v1), (u2, v2) = np.rint(pixels).astype(int)  # you would click on them
fig, axis = plt.subplots(figsize=(5, 3.75), layout="constrained")
axis.imshow(frame.color)
axis.plot([u1, u2], [v1, v2], "o-", color="white", mec="black", ms=9, lw=1)
axis.axis("off")
picture(fig, alt=f"The room with two dots on the table, at pixels ({u1}, "
                 f"{v1}) and ({u2}, {v2}), and a line between them.")

# %%
apart_guess = predict(
    "How far apart are they in the cloud that was lifted with 525 instead of "
    f"{c.fx:.0f}?", guess=None, unit="m")

# %% tags=["hide-input", "prediction"]
# The answer: run this after your guess.
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
again = deproject(truth, mended, mended, c.cx, c.cy)
off = np.linalg.norm(again - right, axis=-1)[near]
report("points about 1.5 m away are now off by", 1000 * off.mean(), "mm",
       digits=1)

# %% [markdown]
# A professional does not guess f. They read it from the device at the resolution in use, or calibrate (lesson 11). And they keep a
# box of known size in the scene: it costs nothing and finds this mistake in a minute. They measure it more than once and take the
# median of the answers: an end that falls beside the box has the depth of the wall behind it, and a few of those do not move a median.
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
    valid = real.depth > 0
    theirs = with_open3d(real.depth, k)
    assert np.allclose(lifted[valid], theirs.points, atol=1e-5)
    kept = by_default(real.color, real.depth) > 0
    rows.append([name, int(valid.sum()), f"{k.fx:.1f}, {k.fy:.1f}",
                 float(np.median(real.depth[valid])), float(real.depth.max()),
                 100 * (1 - kept.sum() / valid.sum())])
report_table(rows, columns=["dataset", "points", "fx, fy", "median z (m)",
                            "deepest (m)", "dropped (%)"])

# %% [markdown]
# Every point agrees with Open3D's, and two of the four recordings lose points by default. The intrinsics in the last row came with
# the recording. In the other three 525 is *assumed*, as in Open3D's manual. Are their clouds wrong, then? Open3D's agreement cannot
# tell: it was given the same f. If a Kinect or its kin took them, 525 is near: single ones differ by one or two per cent, and so
# does the width of the cloud. Only a known length in the scene could decide.
#
# Now a recording that looks innocent: `realsense_slam`, both images 640x480. Is its depth registered to its colour? Where depth
# jumps, colour usually changes, too. So we ask how strong the colour contrast is under the outlines of the depth image. We
# rank all pixels by contrast, from 0 to 1, and average the ranks under the outlines. By chance that is 0.5.
#
# `outlines` marks where depth jumps, magnified by a zoom; `agreement` is the mean rank of the colour contrast under those marks.
# We average it over the first frames of each recording, at most three.

# %% tags=["hide-input"]
def outlines(depth, zoom=1.0):
    """(H, W) bool: where depth jumps by 5 % or more, magnified."""
    around = np.ones((3, 3))
    filled = np.where(depth > 0, depth, 99).astype(np.float32)
    nearest, farthest = cv2.erode(filled, around), cv2.dilate(depth, around)
    jumps = (farthest - nearest > 0.05 * farthest) & (nearest < 99)
    h, w = depth.shape
    magnify = np.array([[zoom, 0, (1 - zoom) * (w - 1) / 2],
                        [0, zoom, (1 - zoom) * (h - 1) / 2]])
    return cv2.warpAffine(jumps.astype(np.uint8), magnify, (w, h),
                          flags=cv2.INTER_NEAREST) > 0


def agreement(color, depth, zoom=1.0):
    """Mean rank of the colour contrast under the outlines; 0.5 is chance."""
    grey = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY).astype(np.float32)
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.5)
    across, down = cv2.Sobel(smooth, -1, 1, 0), cv2.Sobel(smooth, -1, 0, 1)
    contrast = np.hypot(across, down)
    rank = contrast.ravel().argsort().argsort() / contrast.size
    return rank.reshape(contrast.shape)[outlines(depth, zoom)].mean()


# %% tags=["real-data"]
# real data: tum_pair,sun_pair,redwood_frames,realsense_planes,realsense_slam
zooms = np.arange(8, 21) / 10
rows = []
for name in ["tum_pair", "sun_pair", "redwood_frames", "realsense_planes",
             "realsense_slam"]:
    few = data.load(name).frames[:3]
    curve = [np.mean([agreement(one.color, one.depth, zoom) for one in few])
             for zoom in zooms]
    best = int(np.argmax(curve))
    rows.append([name, float(curve[2]), float(zooms[best]), float(curve[best])])
report_table(rows, columns=["dataset", "agreement as stored",
                            "best zoom of depth", "agreement there"], digits=2)

# %% [markdown]
# Four recordings fit best as they are. The last, as stored, is near chance, and no zoom brings it to where the others are. That is
# an alarm, not yet a proof. So look: this frame has the foot of a stand in view. Follow its arch only.

# %% tags=["real-data"]
# real data: tum_pair,sun_pair,redwood_frames,realsense_planes,realsense_slam
slam = data.load("realsense_slam").frames[4]
yellow = np.uint8([255, 220, 0])
overlays = {}
for zoom in (1.0, 1.6):
    marked = np.where(outlines(slam.depth, zoom)[..., None], yellow, slam.color)
    overlays[f"depth outlines, zoom {zoom:g}"] = marked
show.images(overlays, alt="A black stand on a floor, with the outlines of "
                          "its depth image in yellow. At zoom 1 the yellow "
                          "arch of the foot is smaller than the foot and "
                          "lies beside its edges; at zoom 1.6 it lies on "
                          "them.")

# %% [markdown]
# In the depth image the foot is smaller than in the colour image. So its depth camera has the shorter f: it sees a wider view in as
# many pixels. Same size, different views. Colour its cloud pixel by pixel and the floor wears the stand's black. The zoom is
# only a stopgap, because the two cameras also stand at different places. To register the images we need both intrinsics and the pose
# between the cameras, and the recording does not hold them. RealSense software has them: call `rs.align` *before* you save.
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
# Lab 03 has you deproject a window of ranges, mend somebody's cloud, and find the focal length of a camera that came without a data
# sheet: [open lab 03](../exercises/03_depth_to_points.ipynb).
#
# ## Going further
#
# - Real lenses bend rays. `course_lib.camera.pinhole` deprojects with Brown's distortion model; lesson 11 measures it.
# - Where z comes from: with two cameras a baseline B apart, z = f B / d for a disparity of d pixels (lesson 14). OpenCV's
#   `reprojectImageTo3D` does it.
# - Open3D mixes two conventions: `create_from_depth_image` puts pixel centres at whole numbers, `create_rays_pinhole` and
#   `VoxelBlockGrid` half a pixel beside. Give the latter two cx + 0.5 and cy + 0.5.
# - A wrong f is an affine map: planes stay planes and parallels stay parallel, but right angles that do not lie along the
#   image's axes change, and no rigid registration repairs it (lesson 07).
# - Hartley and Zisserman, *Multiple View Geometry in Computer Vision*, 2nd edition, chapter 6. Intel, *Projection in RealSense SDK
#   2.0*: the two cameras of a device, and `align`.
