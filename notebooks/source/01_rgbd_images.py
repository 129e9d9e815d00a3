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
# # 01 RGB-D images
#
# **You will be able to open a depth image from five kinds of camera and say, in metres, what every pixel means, which
# pixels mean nothing, and how wrong a careless reading is.**

# %%
from course_lib.notebook import data, picture, predict, show
from course_lib.notebook import report, report_table

import cv2
import matplotlib.pyplot as plt
import numpy as np

from course_lib.camera import rgbd

room = data.load("living_room")
frame = room.frames[0]
show(frame, title="One RGB-D frame: what the camera saw, "
                  "and how far away it was")

# %% [markdown]
# Left: a photograph. Right: the same view again, but every pixel holds a distance. In the pink areas
# the camera measured nothing. Everything in this course starts from such a pair.
#
# ## Card
#
# | | |
# |---|---|
# | **You will** | read a depth image in metres; tell depth from range; find the pixels without a measurement; predict what 8 bits, a wrong scale or a careless resize do, in millimetres |
# | **Minutes** | 50 for the core (all before *Going further*), 45 for the lab; counted are reading, looking and the code, not pauses |
# | **Before** | lesson 00; NumPy arrays and slicing |
# | **Teaches** | what two texts say of depth images, and whether it holds: *the report*, on 3D reconstruction with a RealSense D455 (its sections 3 and 8), and *the lecture*, on point clouds for robots ("Depth map to point cloud") |
# | **Data** | `living_room` (simulated, with truth); real frames in five encodings: TUM, SUN, NYU, Redwood, RealSense |
#
# Two questions from lesson 00, before you read on:
#
# <details><summary>A registration reports fitness 1.000. Is it aligned?</summary>Not necessarily. Fitness counts matched
# points. It says nothing about how far off they are, or whether they are the right ones.</details>
#
# <details><summary>What does the course call "truth"?</summary>What the simulator knows because it made the scene. Another
# method's result is only a "reference".</details>

# %% [markdown]
# ## 1 Two images, one view
#
# An **RGB-D frame** is two images of one view. The colour image holds three numbers a pixel: red, green, blue, each from 0
# to 255. The **depth image** holds one number a pixel. Look at both as what they are: arrays.

# %%
color, depth = frame.color, frame.depth
report_table(
    [["colour", str(color.shape), str(color.dtype),
      color.min(), color.max()],
     ["depth", str(depth.shape), str(depth.dtype),
      float(depth.min()), float(depth.max())]],
    columns=["image", "shape", "type", "smallest", "largest"],
)

# %% [markdown]
# Read the shape aloud: 480 rows, then 640 columns. Row first. So the pixel in column `u` and row `v` is `depth[v, u]`.
# The smallest depth is 0. Nothing touches the lens: 0 is how the file says **no data**. The camera looked and could not
# tell. Some programs write NaN ("not a number") instead. Count these pixels before you do anything else. Four are enough to see how:

# %%
def measured(depth):
    """(H, W) bool: where the camera measured something."""
    return np.isfinite(depth) & (depth > 0)


four = np.array([[0.0, 1.5], [2.0, np.nan]])
assert measured(four).tolist() == [[False, True], [True, False]]

valid = measured(depth)
assert (valid == rgbd.valid_mask(depth)).all()  # the library counts the same
report("pixels without a measurement", 100 * (~valid).mean(), "%", digits=2)
report("mean depth, zeros taken for depths", depth.mean(), "m")
report("mean depth of the measured pixels", depth[valid].mean(), "m")

# %% [markdown]
# Two means, and only one of them is a distance. The zeros pull the first one towards the camera. This mistake is easily made, and no
# library warns you.
#
# This frame is simulated, so we can ask how good the measurement is. The simulator also kept the depth without noise.

# %%
truth = room.truth["depth"][0]
both = valid & measured(truth)
error_mm = 1000 * (depth - truth)[both]
report("median error of one pixel", np.median(np.abs(error_mm)), "mm", digits=2)
far_off = np.abs(depth - truth) > 0.03 * truth
report("pixels wrong by more than 3 % of their depth",
       100 * far_off[both].mean(), "%", digits=2)

# %% [markdown]
# ## 2 Depth is z, not range
#
# "Distance" can mean two things. The **range** is the length of a string from the lens to the object. The depth is how
# far the object lies *in front of* the camera: the length along the direction the camera looks, called **z**. Depth
# cameras store z. A laser scanner measures range.
#
# For the pixel in the middle of the image, both are the same. Towards a corner the string runs at an angle and gets longer.
# How much longer follows from right-angled triangles. Let $(c_x, c_y)$ be the pixel that looks straight ahead, and $f$ the number of
# pixels to the side of it at which a pixel looks along 45° (lesson 03 explains both). At depth $z$, pixel $(u, v)$ looks
# $z\,(u-c_x)/f$ to the side and $z\,(v-c_y)/f$ down. The string joins the lens with the end of these three sides:
#
# $$\text{range} = z \sqrt{1 + \left(\tfrac{u-c_x}{f}\right)^2 + \left(\tfrac{v-c_y}{f}\right)^2}$$

# %%
def range_from_depth(depth, f, cx, cy):
    """Lengths of the strings, from depths z; same unit as depth."""
    v, u = np.indices(depth.shape)
    return depth * np.sqrt(1 + ((u - cx) / f) ** 2 + ((v - cy) / f) ** 2)


# A pixel f = 3 columns right of the centre looks along a 45 degree line:
# the string is sqrt(2) times z.
strings = range_from_depth(np.ones((1, 4)), f=3, cx=0, cy=0)
assert np.isclose(strings[0, 3], np.sqrt(2))

# %% [markdown]
# Now a prediction. A camera with $f = 525$ pixels and 640x480 pixels looks straight at a flat wall, two metres in front of it.
# Every pixel of its depth image says 2. How long is the string to the corner of the image?

# %%
corner_guess = predict(
    "How far away is the corner of the wall?", guess=None, unit="m")

# %% tags=["hide-input", "prediction"]
# The answer: run this after your guess.
wall = np.full((480, 640), 2.0)
string = range_from_depth(wall, f=525, cx=319.5, cy=239.5)
aside = np.degrees(np.arccos(2 / string[0, 0]))
corner_guess.answer(
    string[0, 0], digits=4,
    why=f"The corner pixel looks {aside:.0f} degrees away from the middle: "
        "the string runs at that angle.")
fig, axes = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
names = ["depth z of a flat wall", "range of the same wall"]
for axis, image, name in zip(axes, [wall, string], names, strict=True):
    drawn = axis.imshow(image, vmin=2.0, vmax=2.55, cmap="viridis")
    axis.set(title=name, xlabel="column u", ylabel="row v")
fig.colorbar(drawn, ax=axes, label="metres")
picture(fig, alt="Two maps of a flat wall two metres away. Depth is one even "
        f"colour. Range is a bowl: {string[240, 320]:.3f} m in the middle and "
        f"{string[0, 0]:.3f} m in the corners.")

# %% [markdown]
# The answer brings a picture: the wall is flat in z and a bowl in range. If somebody's flat wall looks like a bowl, they took one for
# the other. In our room:

# %%
camera = frame.camera
bowl = range_from_depth(truth, camera.fx, camera.cx, camera.cy)
seen = measured(truth)
longer_mm = 1000 * (bowl - truth)[seen]
report("range minus depth, median pixel", np.median(longer_mm), "mm")
report("range minus depth, worst pixel", longer_mm.max(), "mm")

# %% [markdown]
# <details><summary><b>Vote.</b> A depth image of a flat wall, camera straight on, shows the same number everywhere. What is true?
# (a) All wall points are equally far from the lens. (b) All lie in one plane. (c) The camera is broken: corners must be
# larger. (d) The image is 8-bit.</summary>
#
# (b). Equal z means one plane in front of the camera. (a) would be a sphere: that is range. (c) takes depth for range. (d)
# has nothing to do with it.
# </details>

# %% [markdown]
# ## 3 From stored numbers to metres
#
# Files do not hold metres. They hold 16-bit whole numbers, from 0 to 65535, and an **encoding** that says what one step
# means. Here is the same frame as it lies on disk:

# %%
_, raw = room.raw(0)
report("stored number in the middle of the image", int(raw[240, 320]))
report("depth in the middle of the image", float(depth[240, 320]), "m")

# %% [markdown]
# Divide by the steps per metre. That is all an encoding is, for most cameras:

# %%
def to_metres(raw, steps_per_metre):
    """Depth in metres; 0 stays 0 and means no data."""
    return raw.astype(np.float32) / steps_per_metre


assert to_metres(np.array([5000], np.uint16), 5000)[0] == 1.0  # TUM's
assert np.array_equal(to_metres(raw, 1000), depth)

linear = [e for e in rgbd.ENCODINGS.values() if e.form != "disparity"]
report_table(
    [[e.name, e.units_per_metre, 1000 / e.units_per_metre,
      " and ".join(map(str, e.no_data))] for e in linear],
    columns=["encoding", "steps per metre", "one step in mm", "no data"])

# %% [markdown]
# So two things belong to an encoding: how many steps a metre has, and which numbers mean no data. For some that is not enough. SUN also
# rotates the bits of each number three places to the left: the three that fall out at the top come back at the bottom. NYU, not in the
# table, stores the raw numbers of the first Kinect, from which depth follows by a formula, 351.3 / (1092.5 − raw) metres.
# `rgbd.decode_depth(raw, encoding)` knows all five.
#
# Nothing in the file says which encoding it uses. What happens if you pick the wrong one?

# %%
taken_for = {"1000 a metre (right)": 1000, "5000 a metre (TUM)": 5000,
             "metres already": 1}
report_table([[name, float(np.median(to_metres(raw[raw > 0], steps)))]
              for name, steps in taken_for.items()],
             columns=["read as", "median depth in m"])

# %% [markdown]
# The room shrinks, or it becomes as large as a town. Every shape stays right: only the size is wrong, so a picture looks perfect.
# **Ask for the median depth and compare it with the room you know.** That one line finds most wrong scales.
#
# ## 4 8 bits are for looking
#
# A screen shows 256 grey levels, so depth images are often rescaled to 0…255 *to be looked at*. Such a picture is no
# longer a depth image. Let us make one and try to go back.

# %%
def rescale_for_display(depth, near, far):
    """Depth to grey levels, near = 0 and far = 255."""
    share = np.clip((depth - near) / (far - near), 0, 1)
    return np.uint8(share * 255 + 0.5)


three = np.array([0.0, 3.0, 6.0])
assert rescale_for_display(three, 0, 6).tolist() == [0, 128, 255]
grey = rescale_for_display(depth, 0, 6)
assert (grey == rgbd.rescale_for_display(depth, 0, 6)).all()

back = rescale_for_display(truth, 0, 6) / 255 * 6
lost_mm = 1000 * np.abs(back - truth)[seen]
report("one grey level", 6000 / 255, "mm")
step_mm = 1000 / room.encoding.units_per_metre
report("one 16-bit step of this camera", step_mm, "mm")
report("worst error after 8 bits and back", lost_mm.max(), "mm")

# %%
rows, u = np.arange(340, 375), 200  # a piece of the floor
fig, axis = plt.subplots(figsize=(8, 3.4), layout="constrained")
axis.plot(rows, truth[rows, u], color=show.COLOURS["truth"], lw=2,
          label="true depth")
axis.step(rows, back[rows, u], color=show.COLOURS["outlier"], where="mid",
          label="8 bits and back")
axis.set(xlabel="row v", ylabel="depth in metres",
         title=f"Column {u} of the image: a floor becomes a staircase")
axis.legend()
picture(fig, alt="Depth down one column of the image. The true depth is a "
        "smooth line; after 8 bits it is a staircase of "
        f"{len(np.unique(back[rows, u]))} steps, each "
        f"{6000 / 255:.0f} mm high.")

# %% [markdown]
# The sensor's own noise at this distance is about as large. But noise averages out over many pixels, and a staircase does not: whole patches of floor lie at one wrong depth. Nothing can bring the lost digits back. Our library
# therefore refuses an 8-bit image where depth is asked for:

# %%
try:
    rgbd.decode_depth(grey, "realsense")
except ValueError as refusal:
    print(refusal)

# %% [markdown]
# ## 5 Holes, flying pixels, and where depth ends
#
# A stereo depth camera has two eyes. It looks for each spot of one image in the other. Where it finds none, it leaves a **hole**:
# beside edges, where only one eye can see, and in the mirror of a window. At edges it invents **flying pixels**, which hang between the near
# thing and the far one. And it grows less certain with distance. (Lesson 14 explains why.) With truth we can see each. We call a pixel flying if
# it is wrong by more than 3 % of its depth, far more than the noise.

# %%
wrong = both & far_off
holes = seen & ~valid
fig, axis = plt.subplots(figsize=(6.4, 4.4), layout="constrained")
axis.imshow(color)
for mask, name, colour, size in [(holes, "holes", "no data", 1),
                                 (wrong, "flying pixels", "outlier", 4)]:
    axis.scatter(*np.nonzero(mask)[::-1], s=size, color=show.COLOURS[colour],
                 label=f"{name}: {np.count_nonzero(mask):,}")
axis.legend(markerscale=6, loc="lower right")
axis.set(title="Where the depth image is not to be trusted",
         xlabel="column u", ylabel="row v")
picture(fig, alt=f"The colour image with {np.count_nonzero(wrong):,} flying "
        f"pixels and {np.count_nonzero(holes):,} holes drawn over it. They "
        "follow the outlines of the objects; the widest hole is a strip at "
        "the left edge.")

# %% [markdown]
# (Flying pixels are drawn larger than they are.) The strip at the left edge is what only one of the camera's two eyes can see. The same
# happens to the left of every near thing.
#
# On your own recording nobody tells you the truth. But neighbours tell: a good pixel has many at its own depth, a flying one hardly any.
# "At its own depth" means: no farther off than noise explains. How large is the noise away from the outlines, and how does it grow?

# %%
inside = both & ~wrong
lines = []
for start in np.arange(0.5, 3.5, 0.5):
    band = inside & (truth >= start) & (truth < start + 0.5)
    if band.sum() > 500:
        spread = 1000 * float((depth - truth)[band].std())
        lines.append([f"{start:.1f}-{start + 0.5:.1f} m", int(band.sum()),
                      spread, spread / (start + 0.25) ** 2])
report_table(lines, columns=["depth", "pixels", "spread of the error in mm",
                             "divided by depth squared"], digits=2)

# %% [markdown]
# From 1.5 m on, the last column stays the same: twice as far is four times as uncertain. A statement such as "accurate to 2 %" is
# therefore true at one distance only. And a limit for "farther off than noise explains" must grow with z², too. The rule: three times the
# spread. Noise goes beyond that in 3 of 1000 pixels; a wider limit lets more flying pixels pass as neighbours.
#
# Two rows of the course's error budget are ours: the step of the stored numbers, and the noise. Both are stated for a surface
# at 1.5 m, so that later lessons can be compared. (Rounding errs by anything up to half a step, evenly; the spread of that is step / √12.)

# %%
at_1500 = inside & (np.abs(truth - 1.5) < 0.1)
noise_mm = 1000 * float((depth - truth)[at_1500].std())
show.error_budget({"depth_step": (step_mm, step_mm / np.sqrt(12)),
                   "depth_noise": (noise_mm, noise_mm)})

# %% [markdown]
# So 16 bits are enough: beside the noise, their step does not count. 8 bits are not.
#
# ## Report against reality
#
# The report, a text on reconstruction with a D455, says in section 3.2: "Darker Pixels: These represent points that are farther away". In
# section 8 it says that clouds can be formed from colour and depth "of the same size". Both sound plausible. Try the first one: where
# is the stored number small, near or far?

# %%
order = np.argsort(truth[both])
nearest, farthest = raw[both][order[:1000]], raw[both][order[-1000:]]
report_table([["1000 nearest pixels", float(np.median(nearest))],
              ["1000 farthest pixels", float(np.median(farthest))],
              ["pixels without data", float(np.median(raw[~valid]))]],
             columns=["where", "stored number"])
bright = rgbd.rescale_for_display(depth, 0, 5)
show.images({"near = black (the numbers)": bright,
             "near = white (the report)": 255 - bright},
            alt="The same depth image drawn twice")

# %% [markdown]
# In the file, far is *large*. Drawn as it is, far is bright. "Darker is farther" is the choice of a drawing program that
# turned the greys round. And 0 is not "the maximum depth", as the report has it: it is no data. Look at the right picture: there, no data
# is whiter than the nearest thing.
#
# Now the second claim. We give the simulated room a colour camera that sits 59 mm beside the depth camera, as in a D455. Both
# images are 640x480. Are they the same view? Two images are **registered** when each pixel shows the same point in both.
# (The same word as for the clouds of lesson 00, another thing.) By how many columns does a point move from one to the other? 59 mm at depth
# $z$ span $f \cdot 0.059 / z$ columns. (`transforms` belongs to lesson 02; here, look at the picture.)

# %%
from course_lib.geometry import transforms
from course_lib.simulate import camera as sim_camera, scenes

scene = scenes.living_room(7)  # the seed of our dataset
step = transforms.from_rotation_translation(np.eye(3), [0.059, 0, 0])
beside = transforms.compose(frame.T_world_camera, step)
other = sim_camera.render(scene, camera, beside)
assert other.color.shape == color.shape

shift = camera.fx * 0.059 / truth[both]  # this camera's f is below 525
report("the pixels differ by this many columns, median",
       np.median(shift), "px")
report("for the nearest thing in view", shift.max(), "px")

# %% tags=["hide-input"]
fig, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
views = {"the depth camera's view": color, "the colour camera's": other.color}
for axis, (name, view) in zip(axes, views.items(), strict=True):
    axis.imshow(view)
    axis.axvline(456, color="white", lw=1.5)
    axis.set(title=name, xlim=(360, 560), ylim=(340, 190),
             xlabel="column u", ylabel="row v")
moved = camera.fx * 0.059 / truth[275, 425]
picture(fig, alt="A globe on the table, cut from two colour images of one "
        "size, with a line at the same column in both. In the depth camera's "
        "view it touches the globe; in the colour camera's the globe lies "
        f"{moved:.0f} columns farther left.")

# %% [markdown]
# The white line stands at the same column. Same size is not same view. A point takes the colour of its neighbour, by more the nearer it
# is. Registration needs the pose between the cameras; RealSense software calls it "align". Lesson 03 finds a real recording where somebody forgot it.
#
# | The text says | What we found | Evidence |
# |---|---|---|
# | report 3.2: darker is farther | a choice of the drawing program; files store far as large | experiment above |
# | report 3.2: 0 is the farthest point | 0 is no data | section 1 |
# | report 3.2: depth is an 8-bit image | 8 bits are for looking; files hold 16 | section 4 |
# | report 8: images "of the same size" suffice | they must be registered | experiment above |
# | lecture: depth is "the distance from the camera" | z, not range | section 2 |
# | lecture: rescaled to [0, 255] "to display" | right, and only for that | section 4 |
#
# Only the last one can be followed as it stands.

# %% [markdown]
# ## Break it
#
# You want a smaller depth image, so you call `cv2.resize` as for any photograph. By default it mixes neighbours. Here is
# a tiny depth image first: a thing at 1 m before a wall at 3 m.

# %%
edge = np.array([[1, 1, 3, 3]], np.float32)
print(cv2.resize(edge, (3, 1), interpolation=cv2.INTER_LINEAR))

# %% [markdown]
# There is something at 2 m now. Nothing is there. On the whole frame:

# %%
def invented(small, full):
    """Mask of pixels that are 3 % or more off all four that they cover."""
    h, w = small.shape
    blocks = full.reshape(h, 2, w, 2).swapaxes(1, 2).reshape(h, w, 4)
    off = np.abs(blocks - small[..., None]).min(axis=-1)
    return measured(small) & (off > 0.03 * small)


half = depth.shape[1] // 2, depth.shape[0] // 2  # width, then height
mixed = cv2.resize(depth, half, interpolation=cv2.INTER_LINEAR)
picked = rgbd.resize_depth(depth, *half)
ghosts, none = invented(mixed, depth), invented(picked, depth)
report("invented depths, cv2.resize as it comes", int(ghosts.sum()), "pixels")
report("invented depths, one of the pixels picked", int(none.sum()), "pixels")

# %% tags=["hide-input"]
fig, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
colours = plt.get_cmap("viridis").with_extremes(bad=show.COLOURS["no data"])
made = {f"mixed: {ghosts.sum():,} pixels invented": mixed,
        f"picked: {none.sum():,} pixels invented": picked}
for axis, (name, image) in zip(axes, made.items(), strict=True):
    painted = axis.imshow(np.where(image > 0, image, np.nan), cmap=colours,
                          vmin=depth[valid].min(), vmax=depth[valid].max())
    axis.set(title=name, xlabel="column u", ylabel="row v")
axes[0].scatter(*np.nonzero(ghosts)[::-1], s=3, color=show.COLOURS["outlier"])
fig.colorbar(painted, ax=axes, label="metres")
picture(fig, alt=f"The resized depth image twice. Mixed, {ghosts.sum():,} "
        "pixels marked along the outlines lie where nothing is. Picked, "
        f"{none.sum():,} do.")

# %% [markdown]
# (Pale pink: no data. Invented pixels are drawn larger than they are.) The number that exposes it: depths that none of the source pixels
# had. What a professional does: pick, never mix (`cv2.INTER_NEAREST`, or our `rgbd.resize_depth`), or average only pixels of one surface. No data makes it worse: mixing 0 with 2 m
# invents a point in mid-air, and NaN swallows what it is mixed with.

# %% [markdown]
# ## On real data
#
# Five encodings, one table. Every row is read with its own encoding.

# %% tags=["real-data"]
# real data: tum_pair, sun_pair, nyu_pair, redwood_frames, realsense_slam
real = {name: data.load(name) for name in [
    "tum_pair", "sun_pair", "nyu_pair", "redwood_frames", "realsense_slam"]}
found = []
for name, dataset in real.items():
    stored, metres = dataset.raw(0)[1], dataset.frames[0].depth
    ok = measured(metres)
    found.append([name, dataset.encoding.name,
                  float(np.median(stored[stored > 0])),
                  float(np.median(metres[ok])), float(metres[ok].max()),
                  100 * float((~ok).mean())])
report_table(found, columns=["dataset", "encoding", "median as stored",
                             "median in m", "farthest in m", "no data in %"])

# %% tags=["real-data", "hide-input"]
# real data: tum_pair, sun_pair, nyu_pair, redwood_frames, realsense_slam
fig, axes = plt.subplots(2, 5, figsize=(12, 3.7), layout="constrained")
for (above, below), name in zip(axes.T, real, strict=True):
    photo, far_away = real[name].frames[0].color, real[name].frames[0].depth
    above.imshow(photo)
    above.set_title(name)
    scale = below.imshow(np.where(measured(far_away), far_away, np.nan),
                         cmap=colours, vmin=0.5, vmax=6)
for axis in axes.ravel():
    axis.set(xticks=[], yticks=[])
fig.colorbar(scale, ax=axes, label="metres", extend="both", shrink=0.8)
picture(fig, alt=f"{len(real)} real cameras: an office desk, a corridor, a "
        "cellar, a chair at a window, a dark stand. Colour above, depth in "
        "metres on one scale below; pale pink where nothing was measured.")

# %% [markdown]
# Read the TUM row as millimetres and its desk stands in the next building. Read the SUN row without rotating its bits and
# its corridor becomes eight times as long. Both pictures look fine. And one RealSense recording holds 65535:

# %% tags=["real-data"]
# real data: tum_pair, sun_pair, realsense_slam
tum, sun, slam = (data.load(name).raw(0)[1]
                  for name in ["tum_pair", "sun_pair", "realsense_slam"])
report("TUM median, read as millimetres",
       float(np.median(tum[tum > 0]) / 1000), "m")
report("SUN median, bits not rotated",
       float(np.median(sun[sun > 0]) / 1000), "m")
report("RealSense pixels of 65535", int((slam == 65535).sum()))
report("their depth, if you believe them", 65535 / 1000, "m")

# %% [markdown]
# 65535 is the largest 16-bit number: an overflow, not 65 metres. Our loader treats it as no data. The table still says that the
# farthest pixel of `realsense_slam`, taken in a room, lies as far as a church tower is high. A stereo camera that matches almost the same
# column in both images gets such depths. Cut off what the data sheet does not promise. Real frames differ from the
# simulated one in another way, too: we have no truth for them. We can say that the numbers are plausible. We cannot say how wrong they are.

# %% [markdown]
# ## Key points
#
# - A depth image holds z in steps of its encoding; 0, or NaN, means no data. Count it first.
# - Depth is z. Range is the length of the string. They differ most in the corners.
# - A wrong scale looks perfect in a picture. The median depth in metres finds it.
# - 8 bits are for looking. Pick depths when you resize; never mix them.
# - Same size does not mean registered.
#
# Words to know: [depth image](../docs/glossary.md#depth-image), [no data](../docs/glossary.md#no-data),
# [range](../docs/glossary.md#range), [encoding](../docs/glossary.md#encoding),
# [flying pixel](../docs/glossary.md#flying-pixel), [registered](../docs/glossary.md#registered).
#
# ## Your own camera
#
# Change one line: `room = data.from_folder("path/to/my_recording", encoding="realsense")`. Save depth as 16-bit PNG, aligned to colour;
# or name a RealSense's `.bag` or `.db3`, as it is.
# Sections 1, 3 and "Break it" then speak of your camera; what needs `truth` does not run, because nobody knows the truth of your room.
#
# ## To the lab
#
# [Lab 01](../exercises/01_rgbd_images.ipynb) gives you raw frames and asks for metres. Open it with `python3 course.py start 01`. The core
# ends here.
#
# ## Going further
#
# - Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012: the TUM data and its 5000 per metre.
# - Song, Lichtenberg and Xiao, "SUN RGB-D", CVPR 2015; Silberman et al., "Indoor segmentation and support inference from
#   RGBD images", ECCV 2012 (NYU); Choi, Zhou and Koltun, "Robust reconstruction of indoor scenes", CVPR 2015 (Redwood).
# - Open3D's reader of each format: `o3d.geometry.RGBDImage.create_from_tum_format` and its siblings. Their default drops everything
#   beyond 3 or 4 m (lesson 03).
# - librealsense, "align" and "depth units": a D455 can be set to steps other than 1 mm; read `depth_scale` from the device.
