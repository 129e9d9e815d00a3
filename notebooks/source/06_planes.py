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
# # 06 Planes, and what stands out from them
#
# **You will be able to find the flat things in a cloud among everything else, take the floor away, and pick white text off a black
# box, each with a number that says how well.**

# %%
from course_lib.notebook import data, picture, predict, report, report_table, show

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

from course_lib.cloud import downsample, floors, normals, planes, pointcloud
from course_lib.geometry import transforms
from course_lib.surface import metrics

desk = data.load("lettered_box")
frame = desk.frames[0]
cloud = pointcloud.from_frame(frame, world=True)
flat = np.full((len(cloud), 3), 205, np.uint8)
for (_, index), colour in zip(planes.find_planes(cloud.points, 0.004, most=4),
                              [(0, 114, 178), (230, 159, 0), (0, 158, 115), (204, 121, 167)], strict=True):
    flat[index] = colour
show.panels({"as measured": cloud, "four planes": (cloud.points, flat)}, view=frame.T_world_camera,
            alt="A desk with a black box that says POINT CLOUD, a mug, a clay rabbit and two posters on a wall. Right, the "
                "desk is blue, the wall orange, the posters green, the box's front pink; mug, globe and rabbit stay grey.")

# %% [markdown]
# Nobody told the program where the desk is. It tried planes through three points, kept those that many points agree with, and coloured
# these points. Grey is what no plane claims; the specks on the wall are points more than 4 mm off. A plane has no end: the desk's meets the wall in
# a thin blue line, and the front's cuts the globe in a pink spot. Robots do this all day: the floor is where they drive, what stands on it is what they
# must not hit.
#
# ## Card
#
# | | |
# |---|---|
# | You will | fit a plane by its scatter matrix and say what its eigenvalues mean; derive how often RANSAC must try; find several planes; remove a floor; highlight text and edges, with precision and recall |
# | Minutes | 45 for the core (all but *Going further*), 60 for the lab |
# | Before | lesson 02 (frames), lesson 04 (normals by covariance) |
# | Teaches | the lecture, "Fitting a plane"; the report, section 17 |
# | Data | `lettered_box`, `living_room` (simulated, with truth); real RealSense frames; PCL's plane test |
#
# Two questions from earlier lessons, before you read on:
#
# <details><summary>Lesson 04: around one point, along which direction do its neighbours spread least?</summary>Across the surface. That
# direction is the normal.</details>
#
# <details><summary>Lesson 02: what does <code>points @ R.T</code> do to points in rows?</summary>It turns each of them by R.</details>

# %% [markdown]
# ## 1 The plane that fits best
#
# A plane is all points $x$ with $n \cdot x + d = 0$. If $n$ has length 1, $n \cdot x + d$ is the distance of $x$ from it, with a sign for the
# side. For an $n$ of any length, the distance is $(n \cdot x + d) / \|n\|$. At the origin that is $d / \|n\|$: so the sign of $d$ tells on which side of the
# plane the camera is, if the points are in its frame.
#
# Given points, which plane has the smallest sum of squared distances? It goes through their mean $\mu$. And $n$ is the
# direction in which they spread least. The **scatter matrix** $S = \sum (x - \mu)(x - \mu)^T$ holds their spread: $n^T S\, n$ is exactly
# that sum of squares. It is smallest for the **eigenvector** of the smallest eigenvalue.

# %%
def fit_plane(points):
    """Unit normal (3,) and offset of the plane through points (N, 3) with the least squared distances."""
    middle = points.mean(axis=0)
    scatter = (points - middle).T @ (points - middle)
    values, vectors = np.linalg.eigh(scatter)  # eigenvalues ascend; the eigenvectors are the COLUMNS
    normal = vectors[:, 0]
    return normal, -normal @ middle


corners = np.array([[0, 0, 2], [1, 0, 2], [0, 1, 2], [1, 1, 2.0]])  # a square, two metres ahead
normal, d = fit_plane(corners)
assert np.allclose(np.abs(normal), [0, 0, 1]) and np.isclose(abs(d), 2)

on_desk = cloud.points[desk.truth["labels"][0][frame.depth > 0] == desk.truth["label_names"].index("table")]
normal, d = fit_plane(on_desk)
library = planes.fit_plane(on_desk)
assert np.isclose(abs(normal @ library.normal), 1) and np.isclose(abs(d), abs(library.offset))
mean, covariance = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(on_desk)).compute_mean_and_covariance()
by_open3d = np.linalg.eigh(covariance)[1][:, 0]  # Open3D's covariance is the scatter matrix, divided by N
assert np.isclose(abs(normal @ by_open3d), 1) and np.isclose(normal @ mean, -d)
report("the desk's normal is off from the world's z axis by", np.degrees(np.arccos(abs(normal[2]))), "degrees", digits=2)

# %% [markdown]
# The lecture prints $J = \sum x x^T$: no mean. Before you see what that does, commit yourself.

# %%
board_guess = predict(
    "A square board stands upright two metres ahead. By how many degrees is "
    "its normal off, without the mean?", guess=None, unit="degrees")

# %% tags=["hide-input", "prediction"]
def board(tilt, count=4000, noise=0.005, size=(1.0, 1.0), seed=6):
    """Points of a board two metres ahead, tilted about x by some degrees, and its true normal."""
    rng = np.random.default_rng(seed)
    R = transforms.rotation_x(np.radians(tilt))[:3, :3]
    flat = np.column_stack([rng.uniform(-0.5, 0.5, (count, 2)) * size, rng.normal(0, noise, count)])
    return flat @ R.T + [0, 0, 2], R[:, 2]


def degrees_between(a, b):
    """Angle between two directions, signs ignored."""
    return float(np.degrees(np.arccos(min(1.0, abs(a @ b)))))


ahead, true = board(0)
board_guess.answer(
    degrees_between(np.linalg.eigh(ahead.T @ ahead)[1][:, 0], true), digits=2,
    why="Seen from the origin, all points lie ahead: that is where the sum "
        "of squares is by far the largest. So the direction of the board's "
        "normal comes out as the largest, and the smallest is some direction "
        "in the board.")

# %%
rows = []
for tilt in (0, 20):
    points, true = board(tilt)
    centred = points - points.mean(axis=0)
    for name, matrix in [("Σ x xᵀ, as printed", points.T @ points), ("scatter, centred", centred.T @ centred)]:
        vectors = np.linalg.eigh(matrix)[1]
        rows.append([f"{name}; tilted {tilt}", *(degrees_between(vectors[:, i], true) for i in range(3))])
report_table(rows, columns=["matrix", "smallest (degrees off)", "middle", "largest"], digits=2, smallest=0.001)
S = centred.T @ centred
assert np.isclose(abs(np.linalg.eigh(np.trace(S) * np.eye(3) - S)[1][:, 2] @ np.linalg.eigh(S)[1][:, 0]), 1)  # inertia: the largest

# %% [markdown]
# *As printed*, the smallest eigenvector is useless. The largest points from the origin to the board; so on the tilted board it is off by the
# tilt, and the smallest, at a right angle to it, by what is missing to a right angle. Centred, the smallest is the normal to a few hundredths of a degree.
# The lecture calls its matrix *inertial*; but in mechanics the moment of inertia is $\mathrm{tr}(S)\,I - S$, and of that the normal is the *largest*
# eigenvector: the name of one matrix, the rule of another.
#
# ## 2 What the eigenvalues say, and what least squares in z says
#
# $n^T S\, n$ is a sum of squares. Divide by the number of points and take the root: that is the standard deviation along
# that direction, a length. "The radii of the ellipsoid are the eigenvalues" lacks the root. We test it on a board twice as long as
# wide.

# %%
points, _ = board(0, size=(1.0, 0.5))
values = np.linalg.eigvalsh((points - points.mean(axis=0)).T @ (points - points.mean(axis=0)))[::-1]
truth = [1000 / np.sqrt(12), 500 / np.sqrt(12), 5.0]  # of evenly spread points: length / √12; and the noise
radii = 1000 * np.sqrt(values / len(points))
report_table([[name, float(v), float(r), t] for name, v, r, t in zip(["along", "across", "out of it"], values, radii, truth, strict=True)],
             columns=["direction", "eigenvalue (m²)", "√(eigenvalue / N) (mm)", "true deviation (mm)"])
fig, axis = plt.subplots(figsize=(6.2, 3.4))
axis.plot(*points[::8, :2].T, ".", ms=2, color=show.COLOURS["surface"])
angle = np.linspace(0, 2 * np.pi, 200)
for a, b, what, colour in [(1, np.sqrt(values[1] / values[0]), "roots of eigenvalues", "ours"),
                           (1, values[1] / values[0], "eigenvalues", "outlier")]:
    axis.plot(0.5 * a * np.cos(angle), 0.5 * b * np.sin(angle), lw=2, color=show.COLOURS[colour], label=what)
axis.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", title="Two ellipses of the same length over a board 1.0 x 0.5 m")
axis.legend(loc="upper left", bbox_to_anchor=(1, 1), fontsize=9)
picture(fig, alt=f"A board twice as long as wide. The ellipse by roots is {radii[0] / radii[1]:.1f} times as long as wide and fills the "
                 f"board; the one by eigenvalues is {values[0] / values[1]:.1f} times as long as wide, too thin by half.")

# %% [markdown]
# The third root is the noise, for free: the sensor's error across the plane. It will choose our thresholds. And there is another method that many people write first:
# solve $z = ax + by + c$ by **least squares**. It measures errors along z, not across the plane. Is that the same?

# %%
def fit_in_z(points):
    """Unit normal of z = ax + by + c by least squares in z."""
    a, b, _ = np.linalg.lstsq(np.column_stack([points[:, :2], np.ones(len(points))]), points[:, 2], rcond=None)[0]
    return np.array([-a, -b, 1]) / np.sqrt(a * a + b * b + 1)


rows = []
for tilt in (0, 30, 60, 80, 89):
    points, true = board(tilt)
    points = points + np.random.default_rng(tilt).normal(0, 0.02, points.shape)  # 20 mm in every direction
    rows.append([tilt, degrees_between(planes.fit_plane(points).normal, true), degrees_between(fit_in_z(points), true)])
report_table(rows, columns=["tilt (degrees)", "scatter: off by (degrees)", "least squares in z: off by"], digits=2, smallest=0.1)

# %% [markdown]
# Face on, they agree. On a steep plane, noise in x and y counts as noise in z, and the fit leans towards flat. A plane that is seen edge
# on has no $z(x, y)$ at all. Use least squares in z where the errors lie along z and x, y are known well: terrain, or depth in the frame of the
# camera that measured it. Not where all directions err alike, and not after you turned the cloud.
#
# ## 3 Many points agree, the others do not matter
#
# Now let four points in ten be somewhere else. Squares weigh the farthest most, so the best fit to all of them is a fit to
# nothing. **RANSAC** (random sample consensus) turns it around: take three points at random, the fewest that make a plane; count
# how many others agree with it within a threshold; keep the best. Those that agree are the **inliers**.

# %%
def plane_through(corners):
    """Unit normal and offset of the plane through three points (3, 3)."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal = normal / np.linalg.norm(normal)  # without this, "distances" grow with the triangle
    return normal, -normal @ corners[0]


def ransac(points, threshold, tries, rng):
    """Mask (N,) of the points within a threshold of the best of so many planes through three of them."""
    best = np.zeros(len(points), bool)
    for _ in range(tries):
        normal, d = plane_through(points[rng.choice(len(points), 3, replace=False)])
        inliers = np.abs(points @ normal + d) <= threshold
        if inliers.sum() > best.sum():
            best = inliers
    return best


five = np.vstack([corners, [[0.3, 0.2, 7]]])  # the square, and one point far behind it
assert ransac(five, 0.01, 50, np.random.default_rng(0)).tolist() == [True, True, True, True, False]

# %% [markdown]
# How many tries? Let $w$ be the share of inliers. One random point is good with probability $w$, three with $w^3$. So $n$
# samples are *all* bad with probability $(1 - w^3)^n$. Ask that this is at most $1 - p$ and solve:
# $n = \log(1 - p) / \log(1 - w^3)$, rounded up.
#
# Vote: $w = 0.6$ and $p = 0.99$. How many samples? (a) 6, (b) 19, (c) 70, (d) 5.
#
# <details><summary>Answer</summary>
# (b). (a) took w for w³, as if one good point were enough. (c) took the share of outliers, 0.4, for w. (d) took the mean:
# it takes 1 / w³ samples on average until the first good one, but who stops there fails three times in ten.
# </details>

# %%
def tries_needed(w, p=0.99):
    """Samples of three until one holds inliers only, with probability p."""
    return int(np.ceil(np.log(1 - p) / np.log(1 - w**3)))


assert tries_needed(0.6) == 19 == planes.iterations_needed(0.6, 3, 0.99)

rng = np.random.default_rng(6)
good = rng.random((20_000, 70, 3)) < 0.6  # 20,000 runs of 70 samples of three: is each point an inlier?
lucky = np.cumsum(good.all(axis=2), axis=1) > 0  # has one of the samples so far been all inliers?
fig, axis = plt.subplots(figsize=(6.2, 3))
n = np.arange(1, 71)
axis.plot(n, 100 * (1 - (1 - 0.6**3) ** n), color=show.COLOURS["truth"], label="the formula")
axis.plot(n[::3], 100 * lucky.mean(axis=0)[::3], "o", ms=4, color=show.COLOURS["ours"], label="20,000 runs")
for tries, side in [(5, "right"), (6, "left"), (19, "left"), (70, "left")]:
    axis.axvline(tries, color=show.COLOURS["outlier"], lw=1, ls=":")
    axis.annotate(f" {tries} ", (tries, 40), color=show.COLOURS["outlier"], ha=side)
axis.set(xlabel="samples", ylabel="runs with a good one (%)", title="60 % inliers, three points a sample", xlim=(0, 76), ylim=(0, 104))
axis.legend(loc="lower center", fontsize=9)
picture(fig, alt=f"The share of runs that have met a sample of inliers only: {100 * lucky[:, 4].mean():.0f} % after 5 samples, "
                 f"{100 * lucky[:, 5].mean():.0f} % after 6, "
                 f"{100 * lucky[:, 18].mean():.1f} % after 19, practically all after 70; dots lie on the formula's curve.")

# %%
def settle(points, inliers, threshold):
    """Fit to the inliers, collect the inliers of that fit; three times."""
    for _ in range(3):
        normal, d = fit_plane(points[inliers])
        inliers = np.abs(points @ normal + d) <= threshold
    return normal, d, inliers


points, true = board(35, count=6000)
points = np.vstack([points, rng.uniform([-1, -1, 1], [1, 0.2, 2], (4000, 3))])  # things before its upper half
inliers = ransac(points, 0.015, tries_needed(0.6), np.random.default_rng(1))
raw = fit_plane(points[inliers])[0]
settled, _, agreed = settle(points, inliers, 0.015)
o3d.utility.set_max_threads(1)  # RANSAC repeats on one thread
o3d.utility.random.seed(6)
theirs, by_open3d = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).segment_plane(0.015, 3, 200)
plane, ours = planes.find_plane(points, 0.015)
everything = fit_plane(points)[0]
report_table([["fit to all points", len(points), degrees_between(everything, true)],
              ["19 samples, fit to the inliers", int(inliers.sum()), degrees_between(raw, true)],
              ["the same, settled", int(agreed.sum()), degrees_between(settled, true)],
              ["Open3D segment_plane", len(by_open3d), degrees_between(np.asarray(theirs[:3]), true)],
              ["the library's find_plane", int(ours.sum()), degrees_between(plane.normal, true)]],
             columns=["method", "inliers", "normal off by (degrees)"], digits=2, smallest=0.1)
assert degrees_between(settled, np.asarray(theirs[:3])) < 0.1

# %% [markdown]
# The formula counts samples without outliers; it knows nothing of noise. A plane through three good points has the noise of three points, leans a
# little and misses many inliers. So fit to those it has, collect again, fit again: `settle`. RANSAC decides *who* belongs, least squares *where* the
# plane is. (There are more inliers than points of the board: some things lie within 15 mm of its plane by chance.)
#
# The threshold is yours to choose. Measure the noise first: fit a plane to a patch that surely is one surface; section 2's third root is it. Three
# times that keeps nearly every inlier, and is the most to use. Where another surface runs alongside, it may be too much: *Break it* shows it.
#
# ## 4 Several planes, and a room without its floor
#
# Take the inliers away and search again. Here is the room of lesson 03, every tenth point of it, lifted to the world.

# %%
room = data.load("living_room")
view = room.frames[15]
lifted = pointcloud.from_frame(view, world=True)
label = room.truth["labels"][15][view.depth > 0]
names = np.array(room.truth["label_names"])
some = lifted.points[::10]

left, found, rng = np.arange(len(some)), [], np.random.default_rng(6)
for _ in range(3):
    normal, d, inliers = settle(some[left], ransac(some[left], 0.015, tries_needed(0.2), rng), 0.015)
    found.append(((normal, d), left[inliers]))
    left = left[~inliers]

# %% tags=["hide-input"]
rows, paint, some_names = [], np.full((len(some), 3), 205, np.uint8), names[label[::10]]
upright = {"rug": [0, 0, 1], "table": [0, 0, 1], "wall": [0, 1, 0]}
library = planes.find_planes(some, 0.015, most=3)
for ((normal, d), index), (its, _), colour in zip(found, library, [(0, 114, 178), (230, 159, 0), (0, 158, 115)], strict=True):
    seen = some_names[index]
    most = max(set(seen), key=list(seen).count)
    off = np.abs(some @ normal + d)
    its_own = (some_names == most) & (off < 0.1)  # not the other walls
    rows.append([most, len(index), 1482.6 * float(np.median(off[its_own])), 100 * float(np.isin(np.flatnonzero(its_own), index).mean()), 100 * float(np.isin(seen, {"rug": ["rug", "floor"], "wall": ["wall", "poster"]}.get(most, [most])).mean()),
                 degrees_between(normal, np.array(upright[most])), degrees_between(its.normal, np.array(upright[most]))])
    paint[index] = colour
report_table(rows, columns=["mostly", "points", "noise here (mm)", "of the surface, found (%)", "of the found, on it (%)", "normal off by (degrees)", "the library's"], digits=2)
show((some, paint), view="iso", frame="world", title="Three planes, one after the other",
     alt="A room from above at an angle: the floor with its rug, the back wall and the table top in three colours, everything else grey. "
         "Grey specks are mixed into the wall's colour, about as many as coloured ones.")

# %% [markdown]
# Floor and rug became one plane, and so did the wall and its posters: the threshold is 15 mm, and the rug is 12 mm thick. Whether that is a mistake depends on you. For
# driving it is right. And half of the wall stays grey. That is no bug: noise grows with distance, and what is three times the noise of the near
# rug is less than the noise of the far wall. One threshold does not fit all distances.
#
# Which of the level planes is the floor? Not always the largest, though it is here: close to a table, that is the table. The *lowest*. A normal may point
# either way, so measure heights on the side that is up. Then keep what is higher than 30 mm.

# %%
level = [(plane, index) for plane, index in found if abs(plane[0][2]) > np.cos(np.radians(15))]
(normal, d), _ = min(level, key=lambda one: np.median(some[one[1], 2]))
height = (lifted.points @ normal + d) * np.sign(normal[2])
floor = height <= 0.03

is_floor = np.isin(names[label], ["floor", "rug"])
report("of what we removed, floor or rug", 100 * (floor & is_floor).sum() / floor.sum(), "%")
report("of floor and rug, removed", 100 * (floor & is_floor).sum() / is_floor.sum(), "%")
by_library = floors.remove_floor(some, 0.015, clearance=0.03)
report("the library decides alike for", 100 * (by_library == ~floor[::10]).mean(), "%")
show.panels({"with its floor": lifted, "without": lifted.select(~floor)}, view="iso", frame="world",
            alt="The room with its floor, then without: table, chairs and shelves now stand apart from each other.")

# %% [markdown]
# The first number is called **precision**: of what you picked, how much is right. The second is **recall**: of what is right, how much you
# picked. One alone says nothing: remove everything, and the recall is perfect.
#
# The table top is this lesson's row in the error budget. Thousands of points average the noise out. What remains is a tilt: within the threshold there
# are also books, a mug's foot and a strip of wall, and they pull. How far is the fitted plane from the true top, over the table?

# %% tags=["hide-input"]
(normal, d), index = next(one for one in found if (names[label[::10][one[1]]] == "table").mean() > 0.5)
true_top = room.truth["table_centre"][2] - 0.005  # the wood; things are put down 5 mm above it
over = some[index[names[label[::10]][index] == "table"]]
off = (over[:, :2] @ normal[:2] + true_top * normal[2] + d) / abs(normal[2])
show.error_budget({"plane": (degrees_between(normal, np.array([0, 0, 1])), 1000 * metrics.rms(off))})

# %% [markdown]
# The effect is the RMS distance between the fitted and the true plane, over the part of the top that is seen. It is less than tilt times
# distance: the tilt turns the plane about the middle of its points, not about the camera.
#
# ## 5 Text and edges stand out
#
# Figure 18 of the report highlights white text on a black box. What can tell us where the text is? Its colour: it is bright. And its
# geometry: it lies on a flat side of a black thing that stands on the desk. Geometry alone cannot: print has no
# height. We take both. First the two largest planes, desk and wall, are removed, like a floor, with what hangs flat on
# the wall. Of what is left, the black points give the sides of the box. Then bright points count only on these sides, next to
# black ones.

# %%
def highlight(frame, bright=100, black=60):
    """Mask of the measured pixels that are bright print on a black, flat thing."""
    cloud = pointcloud.from_frame(frame, world=True)
    points, colors = cloud.points, cloud.colors
    rest = np.ones(len(points), bool)
    for plane, _ in planes.find_planes(points, 0.004, most=2):  # desk and wall
        level = abs(plane.normal[2]) > 0.9
        rest &= np.abs(plane.distances(points)) > (0.01 if level else 0.04)  # the posters' frames stand out 24 mm
    dark = np.flatnonzero(rest & (colors.max(axis=1) < black))
    found = np.zeros(len(points), bool)
    for side, index in planes.find_planes(points[dark], 0.004, most=3, least=1000):
        on_it = np.flatnonzero(rest & (np.abs(side.distances(points)) < 0.004) & (colors.min(axis=1) > bright))
        near = cKDTree(points[dark[index]]).query(points[on_it], distance_upper_bound=0.01)[0] < np.inf
        found[on_it[near]] = True
    return found


def score(picked, true):
    """Precision and recall in %."""
    return 100 * (picked & true).sum() / picked.sum(), 100 * (picked & true).sum() / true.sum()


rows, picks = [], {}
for i, one in enumerate(desk.frames):
    measured = one.depth > 0
    picks[i] = highlight(one)
    for name, picked in [("bright points", one.color[measured].min(axis=1) > 100), ("bright, on a flat black side", picks[i])]:
        wrong = desk.truth["labels"][i][measured][picked & ~desk.truth["ink"][i][measured]] == desk.truth["label_names"].index("keyboard")
        rows.append([f"view {i + 1}{' (tuned on)' if i == 0 else ''}", name, *map(float, score(picked, desk.truth["ink"][i][measured])),
                     100 * float(wrong.mean())])
report_table(rows, columns=["view", "what is picked", "precision (%)", "recall (%)", "of the wrong, on the keyboard (%)"], digits=2, smallest=0.1)

highlighted = {}
for name, picked in [("bright points", cloud.colors.min(axis=1) > 100), ("bright, on a flat black side", picks[0])]:
    highlighted[name] = np.full_like(frame.color, 25)
    highlighted[name][frame.depth > 0] = np.where(picked[:, None], 255, 25)
show.images(highlighted, title="What was picked, in white on black",
            alt="Left nearly everything is white: wall, desk, mug, rabbit. Right, on black: POINT CLOUD in its frame, whose bottom line is "
                "missing, and most of the text on the top of the box. Nothing else is white.")

# %% [markdown]
# Colour finds nearly all of the text, and the mug, the wall, the posters. Geometry throws these out. We set the two brightness limits by looking at the
# first view; the other two are the honest score. In the second, the keyboard joins in: most of the wrong points are on it. It, too, has white text on flat black: no mistake,
# only not our box. The bottom line of the frame went with the desk, of which we took away 10 mm to either side.
#
# Geometry has its own highlights. Around a point on a plane the smallest eigenvalue is only noise; around an edge it is not. The
# **surface variation** $\lambda_0 / (\lambda_0 + \lambda_1 + \lambda_2)$ is a number for that: 0 on a plane, and at most one third, where all
# three are equal. It is what people often call *curvature* of a cloud.

# %%
def variation(points, k):
    """λ0 / (λ0 + λ1 + λ2) of the k nearest neighbours of each point."""
    near = points[cKDTree(points).query(points, k)[1]]  # (N, k, 3)
    centred = near - near.mean(axis=1, keepdims=True)
    values = np.linalg.eigvalsh(np.swapaxes(centred, 1, 2) @ centred)
    return values[:, 0] / values.sum(axis=1)


third = desk.frames[2]
here = pointcloud.from_frame(third, world=True)
its_names = np.array(desk.truth["label_names"])[desk.truth["labels"][2][third.depth > 0]]
box = downsample.voxel_downsample(here.points[its_names == "box"], 0.003)
bend = variation(box, 60)
assert np.allclose(bend, normals.fit_surfels(box, k=60).variation, atol=1e-6)

# %% [markdown]
# Sixty neighbours, 3 mm apart, reach 3 mm · √(60 / π), about 13 mm: an edge that is nearer bends the neighbourhood. We know where the twelve
# edges of the box are. How many of the points with a variation above 0.03, far more than a typical point has, lie within 8 mm of one?

# %% tags=["hide-input"]
corners = desk.truth["box_corners"]
lengths = np.linalg.norm(corners[:, None] - corners, axis=-1)
pairs = [(a, b) for a in range(8) for b in range(a) if np.min(np.abs(lengths[a, b] - [0.22, 0.15, 0.17])) < 1e-3]  # the 12 edges
to_edge = np.full(len(box), np.inf)
for a, b in pairs:
    along = corners[b] - corners[a]
    t = np.clip((box - corners[a]) @ along / (along @ along), 0, 1)
    to_edge = np.minimum(to_edge, np.linalg.norm(box - corners[a] - t[:, None] * along, axis=1))
precision, recall = score(bend > 0.03, to_edge < 0.008)
report("surface variation of the typical point", np.median(bend), digits=2)
report("of the marked points, near an edge (precision)", precision, "%", digits=2)
report("of the points near an edge, marked (recall)", recall, "%", digits=2)
show((box, bend), view=third.T_world_camera, label="surface variation", limits=(0, 0.1), zoom=0.8,
     title="Edges light up where both sides are seen",
     alt="The box, thinned to 3 mm. The three edges between its front, left side and top are yellow; its outline and its flat sides are dark.")

# %% [markdown]
# What is marked is an edge. But half of what is near an edge stays dark: the outline of the box. There the camera sees only one side, and half a
# neighbourhood of a plane is still a plane. An outline is found in the *image*, where the depth jumps (lesson 03).

# %% [markdown]
# ## Report against reality
#
# Section 17 says of figure 18 that text, box and background are white, black and black, so that "the name is prominently highlighted". Is the background
# needed? We blacken everything in the first view but the box, and let brightness alone decide. And we ask geometry alone: how often does a
# printed point have a larger surface variation than an unprinted one of the same box? If variation knew nothing of print, half the time.

# %%
measured = frame.depth > 0
ink = desk.truth["ink"][0][measured]
on_box = desk.truth["labels"][0][measured] == desk.truth["label_names"].index("box")
bright = cloud.colors.min(axis=1) > 100
front = cloud.points[on_box]
bend_all = normals.fit_surfels(front, k=60).variation
rng = np.random.default_rng(17)
draw = [rng.choice(bend_all[printed], 20_000) for printed in (ink[on_box], ~ink[on_box])]
report_table([["brightness, black background (figure 18)", *map(float, score(bright & on_box, ink))],
              ["brightness, as on a real desk", *map(float, score(bright, ink))]],
             columns=["what decides", "precision (%)", "recall (%)"], digits=2)
report("print has the larger surface variation", 100 * float((draw[0] > draw[1]).mean()), "%", digits=2)

# %% [markdown]
# Before a black background, brightness is all one needs, and what stands out was in the photograph already. On a desk, it takes the geometry of the whole
# box. The other claims of this lesson:
#
# | The document says | What we found | Evidence |
# |---|---|---|
# | Lecture: $J = \sum x x^T$, "the inertial matrix"; its smallest eigenvalue gives the normal | so it is for the scatter matrix, centred; uncentred it is off by up to a right angle, and for inertia it is the largest | section 1 |
# | Lecture: the radii "are the eigenvalues" | they go with the square roots | table and picture in section 2 |
# | Lecture: P "denotes the coordinate of each point" | the formula has x, and there is no P in it; a slip of the pen | reading |
# | Lecture: one fit for all points | holds where all points belong to the plane; else RANSAC first | table in section 3 |
# | Report 17: highlighting "can be crucial" for recognition and inspection | with a score: see what it finds and what it adds | section 5 |
# | Report 17: "distinctive shapes and structures" can be highlighted | edges seen from both sides, yes; outlines not by variation | section 5 |
# | Report 17: the text is "prominently highlighted" | by its colour, thanks to the black background; the cloud adds nothing to it there | experiment above |

# %% [markdown]
# ## Break it
#
# More inliers are better, is that not what RANSAC says? Take the wall of the first view and its two posters: their pictures hang 12 mm in front
# of it, their frames stand out 24 mm. Measure the noise on a patch of bare wall, then raise the threshold. We know the wall: it stands at
# y = 0.55 m. Try ten seeds at each threshold. Is the plane with most inliers the right one?

# %%
upright = cloud.select(np.abs(cloud.points[:, 1] - 0.55) < 0.1)
x, _, z = upright.points.T
patch = upright.points[(x > -0.95) & (x < -0.75) & (z > 0.8) & (z < 1.1)]  # beside the posters hangs nothing
noise = 1000 * metrics.rms(planes.fit_plane(patch).distances(patch))  # section 2's third root
report("noise of the wall", noise, "mm", digits=2)
rows, tried = [], {}
for threshold in (3, 4, 5, 8, 20):
    found = [planes.find_plane(upright.points, threshold / 1000, seed=seed) for seed in range(10)]
    off = [degrees_between(plane.normal, np.array([0, 1, 0])) for plane, _ in found]
    spread = [1000 * metrics.rms(plane.distances(upright.points[inliers])) / noise for plane, inliers in found]
    most, tight = np.argmax([inliers.sum() for _, inliers in found]), np.argmin(spread)
    for rule, chosen in [("most inliers", most), ("smallest RMS", tight)]:
        plane, inliers = found[chosen]
        before = -1000 * np.sign(plane.normal[1]) * plane.distances(upright.points)  # positive in front of the plane
        tried[threshold, rule] = plane, before, inliers
    rows.append([float(threshold), threshold / noise, f"{min(off):.2f} to {max(off):.2f}", off[most], spread[most], off[tight], spread[tight]])
report_table(rows, columns=["threshold (mm)", "/ noise", "ten seeds: off by (degrees)", "most inliers: off by", "its RMS / noise",
                            "smallest RMS: off by", "its RMS / noise"], digits=2)

# %% tags=["hide-input"]
kind = np.array(desk.truth["label_names"])[desk.truth["labels"][0][frame.depth > 0]][np.abs(cloud.points[:, 1] - 0.55) < 0.1]
fig, axes = plt.subplots(1, 4, figsize=(11, 3.4), width_ratios=[1.25, 1, 1, 1], layout="constrained")
for name, colour in [("wall", "reference"), ("poster", "source")]:
    some_of = np.flatnonzero(kind == name)[::60]
    axes[0].plot(1000 * (0.55 - upright.points[some_of, 1]), z[some_of], ".", ms=2, color=show.COLOURS[colour], label=name)
across = np.median(x[kind == "poster"])
for (threshold, rule), style in [((4, "smallest RMS"), "-"), ((4, "most inliers"), "--"), ((20, "most inliers"), ":")]:
    (a, b, c), d = tried[threshold, rule][0].normal, tried[threshold, rule][0].offset
    heights = np.array([z.min(), z.max()])
    axes[0].plot(1000 * (0.55 + (a * across + c * heights + d) / b), heights, style, color="black", lw=1.5, label=f"{threshold:g} mm, {rule}")
axes[0].set(xlim=(-12, 32), xlabel="in front of the wall (mm)", ylabel="z (m)", title="from the side, stretched")
axes[0].legend(fontsize=7, markerscale=4, loc="lower right")
shown = [(4, "smallest RMS"), (4, "most inliers"), (20, "most inliers")]
for axis, (threshold, rule) in zip(axes[1:], shown, strict=True):
    _, before, inliers = tried[threshold, rule]
    axis.hist(before, bins=np.arange(-24, 34, 0.5), histtype="stepfilled", color=show.COLOURS["surface"], label="all points")
    axis.hist(before[inliers], bins=np.arange(-24, 34, 0.5), histtype="stepfilled", color=show.COLOURS["inlier"], label="inliers")
    axis.set(title=f"{threshold:g} mm, {rule}", xlabel="in front of the plane (mm)", yticks=[], ylim=(0, 10_500))
for at, name, high in [(0, "wall", 9300), (12, "pictures", 6500), (24, "frames", 1500)]:
    axes[1].annotate(name, (at, high), ha="center", fontsize=8)
axes[1].set_ylabel("points")
axes[3].legend(fontsize=7, loc="upper left")
picture(fig, alt=f"Left, wall and posters from the side: at {rows[1][0]:g} mm the plane of the smallest RMS lies in the wall, that with most inliers "
                 "leans between the wall and the pictures, and that of 20 mm lies in the pictures. Right, three "
                 "histograms of distances. In the first the inliers are one narrow hump, the wall; pictures and frames stand apart. In the second "
                 "the humps have run into each other and the inliers fill their band; in the third all humps are inliers.")

# %% [markdown]
# At 4 mm, a third of the gap, some seeds find the wall and others a plane that leans between the wall and the pictures in front of it, and
# the leaning one has *more* inliers: a band that cuts across two surfaces side by side holds more points than one that lies in either. No share of the
# gap is safe from that; at 5 mm all ten lean. At 20 mm a plane lies on the pictures, with the wall behind it and the frames in front. One number exposes these: the RMS of the
# inliers is larger than the noise. (It can say so only if the threshold is above √3 times the noise, because a band that is filled evenly has the RMS
# threshold / √3.) The histogram shows the rest: a filled band, or several humps.
#
# A professional takes *at most* three times the noise. Where another surface runs alongside they go lower, try several seeds, and keep the
# plane whose inliers have the smallest RMS. Then they look at the histogram, and where things are nearly coplanar they also ask that normals agree.
#
# ## On real data
#
# PCL tests its plane fit on a real cloud, `sac_plane_test`, with a threshold of 30 mm. The test says what the ratios n / d should be, to within 0.1: a
# *reference*. One of its assertions is commented out, that for n_z / d after the refit, because it failed on some systems, "not sure why yet". PCL does not
# say why, and its seed is fixed, so we cannot tell. What we can try: does *our* fit depend on the seed? We take twenty, and count those whose n_z / d is
# off by more than the test allows.

# %% tags=["real-data"]
# real data: pcl_tests
scan = data.load("pcl_tests").clouds["sac_plane_test"].points.astype(float)
rows = [["PCL's test, reference", "", -0.8964, -0.5868, -1.208, -1.208, ""]]
for threshold in (0.03, 0.02, 0.01):
    tried = [planes.find_plane(scan, threshold, seed=seed) for seed in range(20)]
    ratios = np.array([plane.normal / plane.offset for plane, _ in tried])
    rows.append([f"ours, threshold {1000 * threshold:g} mm", int(np.median([inliers.sum() for _, inliers in tried])),
                 *map(float, np.median(ratios[:, :2], axis=0)), float(ratios[:, 2].min()), float(ratios[:, 2].max()),
                 int(np.sum(np.abs(ratios[:, 2] + 1.208) > 0.1))])
report_table(rows, columns=["fit", "inliers", "n_x / d", "n_y / d", "n_z / d, lowest", "highest", "seeds off, of 20"])

# %% [markdown]
# It looks like the failure that you have just seen. At 30 mm the inliers include points of something beside the plane, how many depends on the seed, and
# least squares follows them: a few seeds miss by more than the test allows. At 10 mm all seeds agree, with each other and with the reference. And now a RealSense camera, on a floor, before a box with a label, on which the print is dark and its ground white. So we turn the rule round: dark points next to
# white ones, on a flat side. The camera knows no world frame. It was not rolled and looked down a little, so *up* is −y to within 30 degrees.

# %% tags=["real-data"]
# real data: realsense_planes
real = data.load("realsense_planes").frames[10]
lifted = pointcloud.from_frame(real)
floor = floors.find_floor(lifted.points, 0.01, up=(0, -1, 0), most_degrees=30)
height = floors.heights_above(lifted.points, floor, up=(0, -1, 0))
standing = np.flatnonzero(height > 0.02)
side, index = planes.find_plane(lifted.points[standing], 0.01)
index = standing[index]
paper = index[lifted.colors[index].min(axis=1) > 120]
dark = index[lifted.colors[index].max(axis=1) < 70]
digits = dark[cKDTree(lifted.points[paper]).query(lifted.points[dark], distance_upper_bound=0.01)[0] < np.inf]

paint = (lifted.colors // 2 + 100).astype(np.uint8)
paint[height <= 0.02] = (0, 114, 178)
paint[index] = (240, 228, 190)
paint[digits] = (213, 94, 0)
report("the camera's height above the floor", float(abs(floor.offset)), "m")
report("the camera looked down by", float(np.degrees(np.arcsin(abs(floor.normal[2])))), "degrees", digits=2)
report("angle between floor and box", degrees_between(floor.normal, side.normal), "degrees")
report("RMS distance of the floor's points from it", 1000 * metrics.rms(floor.distances(lifted.points[height <= 0.01])), "mm", digits=2)
show.panels({"as measured": lifted, "floor, flat side, dark next to white": (lifted.points, paint)}, view="camera",
            alt="A room with a box; its label bears five digits in circles. Right, the floor is blue, the box's front pale. Vermilion are the five "
                "digits, and also the black tape along both edges of the label, hand holes above it, and part of a logo.")

# %% [markdown]
# The rule finds all five digits, and more of other things: black tape, hand holes, a logo, where they meet something white. By eye, the precision is below
# one half. On the lettered box the rule fitted because we knew the box.
#
# There is no truth here, so we ask for what we know of boxes: that they stand upright. The angle between floor and box is a measurement of
# everything together. The residuals of a real floor are not the simulated ones: besides noise they hold slow waves of several millimetres, which
# no averaging removes, and which lesson 11 measures.
#
# ## Key points
#
# - Centre, then scatter matrix, then the eigenvector of the *smallest* eigenvalue. Radii go with the root.
# - Least squares in z measures errors along z: only for data whose errors lie there.
# - RANSAC decides who belongs, least squares where the plane is. Tries: log(1 − p) / log(1 − w³).
# - A threshold of at most three times the noise. Beside a parallel surface go lower, try several seeds, and keep the plane of the smallest RMS.
# - Colour says what, geometry says where. Report precision and recall, tuned on other data.
#
# Words to know: [scatter matrix](../docs/glossary.md#scatter-matrix), [eigenvector](../docs/glossary.md#eigenvector),
# [RANSAC](../docs/glossary.md#ransac), [inlier](../docs/glossary.md#inlier), [precision and recall](../docs/glossary.md#recall),
# [surface variation](../docs/glossary.md#surface-variation).
#
# ## Your own camera
#
# Change one line, in the last cell: `real = data.from_folder("path/to/my_recording", camera="camera.json").frames[0]`. Hold the camera level, or
# say where up is: a D455 has an accelerometer, and its reading at rest *is* up. Put a box on your floor and read the angle.
#
# ## To the lab
#
# Lab 06 has you derive, fit, mend and find: `python3 course.py start 06`.
#
# ## Going further
#
# - What it costs against Open3D: [benchmarks](../docs/benchmarks.md). Most of the saving is not to count every hypothesis on every point:
#   the library compares them on a sample and looks at the best few on all points.
# - Better votes: MSAC weighs inliers by their distance; LO-RANSAC refines within the loop; PROSAC draws likely points first. OpenCV's USAC has them.
# - Planes from an organised image without RANSAC: region growing on normals (PCL's organised multi-plane segmentation), in time of one pass.
# - Edges of a chosen size: compare the *normals* at two radii, as PCL's *difference of normals* does.
# - The smallest eigenvalue has noise in it: fits to few points are biased for normals near edges (lesson 04).
# - Pearson, *On lines and planes of closest fit to systems of points in space*, 1901. Fischler and Bolles, *Random sample consensus*, 1981.
#   Chum, Matas and Kittler, *Locally optimized RANSAC*, 2003. Pauly, Gross and Kobbelt, *Efficient simplification of point-sampled surfaces*,
#   2002 (surface variation).
