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
# # 04 Downsampling, normals, features
#
# **You will be able to make a cloud many times smaller and say in millimetres what that cost, and to give every point that is
# left a normal with the right sign.**

# %%
from course_lib.notebook import data, picture, predict
from course_lib.notebook import report, report_table, show

import matplotlib.pyplot as plt
import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

from course_lib.cloud import downsample, normals, pointcloud
from course_lib.geometry import transforms
from course_lib.surface import metrics

animal = data.load("bunny_like")
points = animal.cloud.points.astype(float)
small = {"as scanned": points,
         **{f"voxel {1000 * v:g} mm": downsample.voxel_downsample(points, v)
            for v in (0.005, 0.02, 0.05)}}
small = {f"{name}: {len(p):,} points": p for name, p in small.items()}
show.panels(small, frame="world", view="front", color="height", columns=4,
            title="One animal, kept by fewer and fewer points",
            alt="A long-eared animal four times: as a dense cloud; thinned and "
            "still clear; a few hundred points; and a handful of dots that "
            "could be anything.")

# %% [markdown]
# The last one was made with a voxel of 50 mm, and the animal is 150 mm wide: so does a student's project report (*the report* from here on,
# whose claims this course tests). When is fewer still enough?
#
# ## Card
#
# | | |
# |---|---|
# | You will | write a voxel grid and fix its origin; read from a curve how large a voxel may be; compute normals and turn them to the camera; say what FPFH sees; judge the report's `preprocess_point_cloud` |
# | Minutes | 58 for the core (all before "Going further"), 47 for the lab |
# | Before | lesson 02 (frames, `T_world_camera`), lesson 03 (a cloud from a depth image) |
# | Teaches | downsampling, normals and features of a project report (section 6) and of a paper on mapping from a UAV (section IV) |
# | Data | `bunny_like` and `living_room` (simulated, with truth); the real Stanford bunny and a real desk |
#
# Two questions from earlier lessons:
#
# <details><summary>Lesson 02: how many bytes does a point with three float32 coordinates take, without padding?</summary>Twelve. With
# colour and PCL's padding it is 32.</details>
#
# <details><summary>Lesson 03: where is the camera in a cloud that was just lifted from a depth image?</summary>At (0, 0, 0): the
# points are in the camera's own frame. We use that in section 4.</details>

# %% [markdown]
# ## 1 One point a cube
#
# A **voxel** is a small cube of space, as a pixel is a small square of an image. A **voxel grid** cuts space into voxels, and
# downsampling keeps one point for each voxel that holds any. The usual one to keep is the **centroid**: the mean of the points in
# the voxel.
#
# `np.unique(index, axis=0, return_inverse=True, return_counts=True)` does the work: it returns the cubes that occur, for each point which of them it
# lies in, and how many points each holds. Of three points in the cubes 0, 2 and 0 it makes cubes 0 and 2, which 0, 1, 0, and counts 2, 1.
#
# Which cube does a point lie in? Count how many whole voxels lie between the origin of the grid and the point, and round *down*.

# %%
def voxel_grid(points, voxel, origin=0.0):
    """Centroids (M, 3) of the points in each cube, and their counts (M,)."""
    index = np.floor((points - origin) / voxel).astype(int)
    cubes, which, count = np.unique(index, axis=0, return_inverse=True,
                                    return_counts=True)
    total = np.zeros((len(cubes), 3))
    # total[which] += points would add only one point a cube
    np.add.at(total, which.ravel(), points)
    return total / count[:, None], count


# two points on one side of zero, one on the other
hand = np.array([[0.1, 0, 0], [0.3, 0, 0], [-0.1, 0, 0]])
assert np.allclose(voxel_grid(hand, 0.5)[0], [[-0.1, 0, 0], [0.2, 0, 0]])
# int() rounds towards zero: one double cube
assert len(np.unique((hand / 0.5).astype(int), axis=0)) == 1

voxel = 0.01
origin = points.min(axis=0) - voxel / 2  # where Open3D begins
kept, count = voxel_grid(points, voxel, origin)
cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
by_open3d = np.asarray(cloud.voxel_down_sample(voxel).points)
order = [np.lexsort(np.round(p, 9).T) for p in (kept, by_open3d)]
# the same points, in another order
assert np.allclose(kept[order[0]], by_open3d[order[1]])
report("points before", len(points))
report("points after, voxel 10 mm, Open3D's origin", len(kept))
report("points after, voxel 10 mm, origin zero",
       len(voxel_grid(points, voxel)[0]))

# %% [markdown]
# Look at the second assert. Counted in voxels, the three points lie at 0.2, 0.6 and −0.2. `int()` cuts off towards zero and makes 0 of
# all three: the cubes on both sides of the origin become one, twice as wide as the others. Rounding to the nearest is another
# grid, too: half a voxel beside.
#
# Look at the last two numbers. The grid is the same but for where it begins, and it keeps another number of points. From here on our
# grids begin at zero, and Open3D's half a voxel below the lowest point.

# %%
half_voxel_guess = predict(
    "Half the voxel, 5 mm for 10. How many times as many points does the "
    "animal keep?", guess=None, unit="times")

# %% tags=["hide-input", "prediction"]
# The answer: run this after your guess.
fine, coarse = (len(voxel_grid(points, size)[0]) for size in (0.005, 0.01))
half_voxel_guess.answer(
    fine / coarse, digits=2,
    why="Eight small cubes fill a large one. But the points lie on a "
        "surface, which passes through about four of the eight.")

# %% [markdown]
# Now the large voxel, 50 mm. Nothing says where its grid begins, so we let it begin anywhere within one voxel, many times.

# %%
rng = np.random.default_rng(4)
origins = rng.uniform(0, 0.05, (300, 3))
# the library's, which is faster
counts = [len(downsample.voxel_downsample(points, 0.05, start))
          for start in origins]
report("height of the animal", 1000 * float(np.ptp(points[:, 2])), "mm")
report("points kept with voxel 50 mm, fewest", min(counts))
report("points kept with voxel 50 mm, most", max(counts))
counts = [len(downsample.voxel_downsample(points, 0.005, start))
          for start in origins[:30]]
report("with voxel 5 mm, most divided by fewest", max(counts) / min(counts))

# %% [markdown]
# All of these are right answers. With large voxels the origin decides; with small ones it hardly matters. So our function takes the
# origin as an argument, and so does the library's. Open3D's depends on the lowest point: one stray point moves every cube.
#
# ## 2 What is kept, what is lost
#
# Two different things go wrong as the voxel grows. A part of the surface is left without a point near it: it is *lost*. And the
# centroid of a curved piece lies inside the body, where nothing was measured: it is *false*. As numbers:
#
# - lost: from each given point to the nearest kept one, the mean of these distances;
# - false: from each kept point to the true surface, the mean of these distances.

# %% tags=["hide-input"]
angle = np.radians(np.linspace(0, 130, 27))
# a round body in section, in mm
ring = 20 * np.column_stack([np.cos(angle), np.sin(angle)])
low, edge = np.array([-4, 4]), 24
held = ring[((ring > low) & (ring < low + edge)).all(axis=1)]
mean, far = held.mean(axis=0), held[1]
real = held[np.argmin(np.linalg.norm(held - low - edge / 2, axis=1))]
on = 20 * mean / np.linalg.norm(mean)
fig, axis = plt.subplots(figsize=(6.8, 3.8), layout="constrained")
axis.fill(
    *np.vstack([20 * np.column_stack([np.cos(a := np.linspace(0, 2.27, 99)),
                                      np.sin(a)]), [-13, 0]]).T,
    color=show.COLOURS["surface"], alpha=0.35, lw=0)
axis.add_patch(plt.Rectangle(low, edge, edge, fill=False, color="0.4", lw=1.5))
axis.plot(*ring.T, ".", color=show.COLOURS["reference"],
          label="measured, on the surface")
axis.plot(*mean, "o", ms=8, color=show.COLOURS["ours"], label="centroid")
axis.plot(*(low + edge / 2), "+", ms=11, mew=2, color="0.3",
          label="centre of the cube")
axis.plot(*real, "s", ms=7, color=show.COLOURS["target"],
          label="measured point nearest to it")
axis.plot(*np.transpose([mean, on]), color=show.COLOURS["ours"], lw=2.5)
axis.plot(*np.transpose([mean, far]), "--", color=show.COLOURS["outlier"],
          lw=1.8)
axis.annotate("false", on, (26, 16), "data", ha="left",
              arrowprops={"arrowstyle": "-", "color": "0.5"})
axis.annotate("lost, for this point", far, (26, 7), "data", ha="left",
              arrowprops={"arrowstyle": "-", "color": "0.5"})
axis.set(aspect="equal", xlim=(-14, 56), ylim=(0, 31), xlabel="x (mm)",
         ylabel="y (mm)")
axis.legend(loc="upper right", fontsize=8)
picture(fig, alt="A round body of 20 mm radius in section, and one cube of "
        f"{edge} mm. The centroid of the {len(held)} points in the cube "
        f"lies {np.linalg.norm(on - mean):.1f} mm inside the body, "
        "which is false; the point that lies nearest to the cube's "
        "centre lies on the surface. A point at the rim of the cube is "
        f"{np.linalg.norm(far - mean):.0f} mm from the centroid, which "
        "is lost.")

# %% [markdown]
# If the false part matters, keep the point **nearest to the centre** of each cube: a real point with its own colour.

# %%
def nearest_to_centre(points, voxel, origin=0.0):
    """The point (M, 3) of each cube that lies nearest to the cube's centre."""
    index = np.floor((points - origin) / voxel)
    off = np.linalg.norm(points - origin - (index + 0.5) * voxel, axis=1)
    # the nearest first; unique keeps the first of each cube
    order = np.argsort(off, kind="stable")
    return points[order][np.unique(index[order], axis=0, return_index=True)[1]]


voxels = np.array([1, 2, 3, 5, 10, 20, 30, 50]) / 1000
per_voxel = []
for v in voxels:
    centroids, real = voxel_grid(points, v)[0], nearest_to_centre(points, v)
    per_voxel.append([1000 * v, len(centroids), 12 * len(centroids) / 1000,
                 *(1000 * metrics.nearest_distances(points, p).mean()
                   for p in (centroids, real)),
                 1000 * metrics.distance_to_surface(centroids,
                                                    animal.mesh).mean()])
assert np.allclose(real, downsample.voxel_downsample(points, v,
                                                     representative="nearest"))
# measured points: nothing false
assert metrics.distance_to_surface(real, animal.mesh).max() < 1e-6
told = [row for row in per_voxel if row[0] in (2, 5, 10, 20, 50)]
report_table([[f"{row[0]:g}", *row[1:]] for row in told],
             columns=["voxel (mm)", "points", "kB", "lost: centroid (mm)",
                      "lost: nearest (mm)", "false: centroid (mm)"],
             title="Grids that begin at zero")

# %% tags=["hide-input"]
table = np.array(per_voxel)
fig, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
axes[0].loglog(table[:, 0], table[:, 1], "o-", color=show.COLOURS["target"],
               label="animal")
axes[0].loglog(table[3:, 0], table[4, 1] * (10 / table[3:, 0]) ** 2, "--",
               color="0.5", label="a quarter at twice the voxel")
axes[0].set(xlabel="voxel (mm)", ylabel="points kept")
axes[1].loglog(table[:, 0], table[:, 3], "o-", color=show.COLOURS["outlier"],
               label="lost: surface to kept point")
axes[1].loglog(table[2:, 0], table[2:, 5], "s-", color=show.COLOURS["ours"],
               label="false: centroid to surface")
axes[1].loglog(table[2:6, 0], table[4, 5] * (table[2:6, 0] / 10) ** 2, "--",
               color="0.5", label="four times at twice the voxel")
axes[1].loglog(table[:, 0], table[:, 0] / 3, ":", color="0.5",
               label="a third of the voxel")
axes[1].set(xlabel="voxel (mm)", ylabel="mean distance (mm)")
for axis in axes:
    axis.legend(fontsize=8)
    axis.set_xticks([1, 2, 5, 10, 20, 50], ["1", "2", "5", "10", "20", "50"])
    axis.minorticks_off()
picture(fig, alt="Against the voxel, from 1 to 50 mm: points kept fall from "
        f"{int(table[0, 1])} to {int(table[-1, 1])}, to a quarter at "
        "each doubling; what is lost stays near a third of the voxel, "
        f"up to {table[-1, 3]:.0f} mm; what is false grows to four "
        f"times at each doubling from 5 to 20 mm, {table[5, 5]:.1f} mm, "
        f"then more slowly, to {table[-1, 5]:.1f} mm.")

# %% [markdown]
# What is lost is about a third of the voxel. What is false grows with its *square* while a cube holds several points and is small against the
# body, here from 5 to about 20 mm: an arc of radius R rises above a chord of length s by about s²/8R, and a cube cuts chords of about its own
# size. In larger cubes lie whole pieces of the body, and no such formula holds. The points measured here lie exactly on the
# surface, so those nearest to the centre are not false at all (the last assert). Below the spacing of the points (about a millimetre) a
# smaller voxel saves no points: each is alone in its cube.
#
# A voxel grid is not the only way to have fewer points: *farthest-point sampling* always puts the next point into the widest gap, however dense
# the cloud is there ("Going further" compares them).
#
# So the **rule for the voxel** has two parts. Stay *below the thinnest thing to keep*, or its two sides become one; below 0.58 of it (1/√3: a cube is √3 times its edge
# across) if it may lie in any direction. And start from an error
# that you can bear: what is lost is about a third of the voxel, so three times that error is the most. A choice from start to end: about
# 2 mm of the animal may be lost, and its ears must stay. How thick is the body behind each point? We measure it by a ray.

# %%
# from each point straight into the body
rays = np.hstack([points, -animal.cloud.normals])
scene = o3d.t.geometry.RaycastingScene()
scene.add_triangles(o3d.core.Tensor(animal.mesh.vertices.astype(np.float32)),
                    o3d.core.Tensor(animal.mesh.triangles.astype(np.uint32)))
# begin below the surface, or the ray meets it at once
rays[:, :3] += 1e-5 * rays[:, 3:]
thickness = 1000 * scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))[
    "t_hit"].numpy()
thinnest, bearable = np.percentile(thickness, 1), 2.0
choice = np.floor(min(3 * bearable, thinnest / np.sqrt(3))) / 1000
report("a hundredth of the body is thinner than", thinnest, "mm", digits=1)
report("three times what may be lost", 3 * bearable, "mm", digits=1)
report("so the voxel", 1000 * choice, "mm", digits=1)
kept = voxel_grid(points, choice)[0]
report("points kept", len(kept))
report("lost", 1000 * metrics.nearest_distances(points, kept).mean(), "mm",
       digits=2)

# %% [markdown]
# Vote: a cloud of a *solid* block of points (a scan of fog, say), voxel halved. How many times as many cubes hold a point? (a) 2,
# (b) 4, (c) 8.
#
# <details><summary>Answer</summary>
# (c), as long as there are points enough. (b) is for surfaces, (a) for a wire. The exponent is the dimension of the thing.
# </details>
#
# This lesson's row of the error budget (the sum of what each lesson finds) is "voxel grid": a voxel of 10 mm in the living room. Its effect is
# the false part of centroids of exact points about 1.5 m away, and small beside the animal's in the table, because most of a room is flat:

# %%
room = data.load("living_room")
frame, c = room.frames[15], room.camera
truth = room.truth["depth"][15]
v, u = np.indices(truth.shape)
exact = np.stack([(u - c.cx) * truth / c.fx, (v - c.cy) * truth / c.fy, truth],
                 axis=-1)[truth > 0]
kept = downsample.voxel_downsample(exact, 0.01)
near = np.abs(kept[:, 2] - 1.5) < 0.1
false_mm = 1000 * metrics.distance_to_surface(
    transforms.apply(frame.T_world_camera, kept[near]), room.mesh).mean()
show.error_budget({"downsampling": (10, false_mm)})

# %% [markdown]
# ## 3 Which way a surface faces
#
# The **normal** of a surface is the direction at a right angle to it. A point alone has none; its neighbours tell. They
# spread along the surface and hardly across it. So: in which direction do they spread least?
#
# Take a point's $k$ nearest neighbours, and of each its offset $d$ from *their mean*. Along a direction $n$ of length 1 the offset is
# $d \cdot n$, and its mean square is what we make smallest. It is $n^\top C n$ with the 3×3 matrix $C = \frac1k \sum d\,d^\top$, the
# **covariance** of the neighbours. With the offsets as the rows of an array, that sum is one product: `offsets.T @ offsets / k`.
#
# The **eigenvectors** of $C$ are three directions at right angles, and each eigenvalue is the mean square along its own; its root, in metres, is the *spread*. No direction
# has less spread than the eigenvector of the smallest eigenvalue, so that one is the normal. `np.linalg.eigh` sorts the eigenvalues
# ascending and puts the eigenvectors into the *columns* of its matrix: the normal is column 0.

# %%
def normal_of(neighbours):
    """Unit normal (3,) of a small surface, and its three spreads (3,)."""
    offsets = neighbours - neighbours.mean(axis=0)
    values, vectors = np.linalg.eigh(offsets.T @ offsets / len(neighbours))
    # column 0: eigh sorts ascending
    return vectors[:, 0], np.sqrt(np.maximum(values, 0))


# flat, at height 5
sheet = np.array([[x, y, 5] for x in (0, 1, 2) for y in (0, 2, 4)], float)
normal, spread = normal_of(sheet)
assert np.allclose(np.abs(normal), [0, 0, 1]) and np.isclose(spread[0], 0)

# the point itself is one of the 30
nearest = cKDTree(points).query(points, k=30)[1]
# every 20th point
ours = np.array([normal_of(points[i])[0] for i in nearest[::20]])
cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
fast = normals.estimate_normals(points, k=30)
for other in (np.asarray(cloud.normals), fast):
    # the same, up to the sign
    assert np.abs((ours * other[::20]).sum(axis=1)).min() > 1 - 1e-6


def degrees_off(found, true):
    """Angles between lines: the sign of a normal does not count."""
    return np.degrees(np.arccos(np.clip(np.abs((found * true).sum(axis=1)), 0,
                                        1)))


true = animal.cloud.normals.astype(float)
report("median error of the normals, exact points",
       np.median(degrees_off(fast, true)), "degrees", digits=2)

# %% tags=["hide-input"]
# on the flank, more than 30 to see its form
around = cKDTree(points).query(points[np.argmin(points[:, 1])], k=200)[1]
d = 1000 * (points[around] - points[around].mean(axis=0))
along = np.linalg.eigh(d.T @ d / len(d))[1]
spreads = [float(np.sqrt(np.mean((d @ along[:, i]) ** 2))) for i in range(3)]
fig, axes = plt.subplots(1, 2, figsize=(8, 4), sharex=True, sharey=True,
                         layout="constrained")
for axis, (i, j), title in zip(axes, ((2, 1), (2, 0)),
                               ("looking along the normal",
                                "looking along the surface"), strict=True):
    axis.plot(d @ along[:, i], d @ along[:, j], ".",
              color=show.COLOURS["reference"])
    for which, (x, y) in ((i, (1, 0)), (j, (0, 1))):
        name, what = ("column 0, the normal", "outlier") if which == 0 else (
            f"column {which}", "target")
        axis.annotate("", (spreads[which] * x, spreads[which] * y), (0, 0),
                      arrowprops={"arrowstyle": "->",
                                  "color": show.COLOURS[what], "lw": 2.5})
        axis.plot([], [], color=show.COLOURS[what],
                  label=f"{name}: spread {spreads[which]:.1f} mm")
    axis.set(aspect="equal", title=title, xlabel="along column 2 (mm)")
    axis.set_ylabel(f"along {'column 1' if j else 'the normal'} (mm)")
    axis.legend(fontsize=8, loc="upper right")
axes[0].set(xlim=(-11, 11), ylim=(-9, 13))
fig.suptitle(f"{len(d)} neighbours of a point on the flank")
picture(fig, alt=f"{len(d)} points on the flank from two sides, with arrows "
        "along their three directions. Looked at along the normal they "
        f"fill a patch, with spreads of {spreads[2]:.1f} and "
        f"{spreads[1]:.1f} mm; looked at along the surface they lie in "
        f"a shallow bow: across it they spread by {spreads[0]:.1f} mm.")

# %% [markdown]
# Three slips leave code that runs and returns unit vectors. We put the animal a metre before a camera and try them. (A direction drawn at
# random would be 60 degrees off in the median.) Then we add noise, and ask how many neighbours are best.

# %%
moved = points[nearest[::20]] + [0.2, 0.1, 1.0]
offsets = moved - moved.mean(axis=1, keepdims=True)
vectors = np.linalg.eigh(np.swapaxes(offsets, 1, 2) @ offsets)[1]
uncentred = np.linalg.eigh(np.swapaxes(moved, 1, 2) @ moved)[1]
wrong = {"right": vectors[:, :, 0], "a row for a column": vectors[:, 0, :],
         "the largest eigenvalue": vectors[:, :, 2],
         "not centred": uncentred[:, :, 0]}
report_table([[name, float(np.median(degrees_off(w, true[::20])))] for name,
              w in wrong.items()], columns=["slip", "median error (degrees)"],
             digits=2)

ks = [5, 10, 20, 30, 50, 100, 200]
curves = {}
for noise in (0.0, 0.0003, 0.001):
    noisy = points + noise * np.random.default_rng(1).standard_normal(
        points.shape)
    sorted_by_distance = noisy[cKDTree(noisy).query(noisy[::40], k=max(ks))[1]]
    curves[noise] = [
        float(
            np.median(
                degrees_off(
                    np.array([normal_of(p[:k])[0] for p in sorted_by_distance]),
                    true[::40]))) for k in ks]

# %% tags=["hide-input"]
fig, axis = plt.subplots(figsize=(6.5, 3.4), layout="constrained")
for (noise, curve), what, mark in zip(curves.items(),
                                      ("ours", "target", "outlier"), "os^",
                                      strict=True):
    axis.loglog(ks, curve, mark + "-", color=show.COLOURS[what],
                label=f"noise {1000 * noise:g} mm")
axis.set(xlabel="neighbours k", ylabel="median error (degrees)", xticks=ks,
         xticklabels=ks)
axis.minorticks_off()
axis.legend(fontsize=9)
best = {noise: ks[int(np.argmin(curve))] for noise, curve in curves.items()}
picture(fig,
        alt="Median error of the normals against the number of neighbours. " +
        " ".join(f"With {1000 * noise:g} mm of noise it is smallest, "
                 f"{min(curve):.1f} degrees, at k = {best[noise]}." for noise,
                 curve in curves.items()))

# %% [markdown]
# More neighbours average more noise and see more curvature. The best k grows with the noise, and there is no best k for all
# clouds. A *radius* says the same in metres and does not change when you downsample; most people give both.
#
# How flat is the neighbourhood? The smallest eigenvalue, λ₀, over the sum of the three is 0 on a plane and grows along edges. PCL calls
# it curvature; lesson 06 finds edges with it.
#
# ## 4 Its sign
#
# A line has two directions, and an eigenvector may come as either. But the camera saw this surface. So its normal makes
# an angle of less than 90° with the arrow from the point to the camera.

# %%
def towards(found, points, viewpoint):
    """Normals (N, 3), turned to the side of the viewpoint (3,)."""
    away = (found * (viewpoint - points)).sum(axis=1) < 0
    return np.where(away[:, None], -found, found)


assert towards(np.array([[0, 0, 1.0]]), np.array([[0, 0, 2.0]]),
               np.zeros(3)).tolist() == [[0, 0, -1]]

scan = pointcloud.from_frame(frame).points  # camera frame
scan = downsample.voxel_downsample(scan[scan[:, 2] < 2.2], 0.01)
raw = normals.estimate_normals(scan, k=30)
# the camera is the origin of its own frame
turned = towards(raw, scan, np.zeros(3))
assert np.allclose(turned, normals.estimate_normals(scan, k=30,
                                                    viewpoint=np.zeros(3)))
seen = (turned * scan).sum(axis=1) <= 0
facing = (raw * scan).sum(axis=1) <= 0
report("normals that face the camera, as computed", 100 * facing.mean(), "%",
       digits=2)
report("after turning", 100 * seen.mean(), "%")

T = frame.T_world_camera
world, world_normals = transforms.apply(T, scan), turned @ T[:3, :3].T
# the same code on world points: the origin is on the floor
lazy = towards(world_normals, world, np.zeros(3))
report("turned the wrong way with (0, 0, 0) in world coordinates",
       100 * ((lazy * world_normals).sum(1) < 0).mean(), "%", digits=2)

# %% tags=["hide-input"]
on_table = (world[:, 1] > -0.3) & (world[:, 2] > 0.6)
fig, axes = plt.subplots(1, 2, figsize=(9, 3.0), sharex=True, sharey=True,
                         layout="constrained")
for axis, (name, found) in zip(axes, {"as computed": raw,
                                      "turned": turned}.items(), strict=True):
    towards_us = (found * scan).sum(axis=1) <= 0
    for which, what, label in ((towards_us, "target", "faces the camera"),
                               (~towards_us, "outlier", "faces away")):
        x, y, z = scan[which & on_table].T
        axis.plot(x / z, y / z, ".", ms=1.5, color=show.COLOURS[what],
                  label=label)
    axis.set(aspect="equal",
             title=f"{name}: {100 * towards_us.mean():.3g} % face the camera")
    axis.set_axis_off()
axes[0].invert_yaxis()
fig.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center",
           ncols=2, fontsize=9, markerscale=6)
picture(fig, alt="A table with things on it as the camera sees it, each point "
        f"in one of two colours. As computed, {100 * facing.mean():.2g} "
        "% of the normals face the camera, in patches that end in the "
        f"middle of things; after turning, {100 * seen.mean():.3g} %.")

# %% [markdown]
# Our solver happens to make the largest component of a normal positive. In a camera frame down and ahead are positive, so the table's normal, mostly
# vertical, pointed down, away from us; another solver has other habits. Never rely on one.
#
# The viewpoint belongs to a frame. Merge several scans first and orient then, and no single viewpoint is right: orient each scan in its
# own frame, then move points *and* normals. (Normals turn with R; they do not move with t.)
#
# ## 5 What a point's surroundings look like: FPFH
#
# To find the same place in two scans, coordinates do not help: the scans lie differently. **FPFH** (fast point feature histogram)
# describes a point by *angles*. Draw the line between it and a neighbour, beginning at the one whose normal lies nearer to the line, and ask:
#
# - *bend*: by which angle does the neighbour's normal lean forwards (+) or back (−) along the line, −180° to 180°?
# - *twist*: how far does it lean to one side of the line or the other (as a cosine, −1 to 1)?
# - *rise*: how far does the line rise above (+) or fall below (−) the surface at the point (the cosine between line and normal)?
#
# Each is counted in eleven bins over all neighbours,
# and the neighbours' own histograms are added, near ones with more weight: 33 numbers. Open3D's bins of each angle add up to 200, so
# half of them is a percentage. We look at three points whose surroundings you know.

# %%
def describe(points, voxel):
    """Points (M, 3), normals (M, 3) and features (M, 33) of a cloud.

    A voxel grid, normals within 2 voxels, FPFH (M, 33) within 5 voxels.
    """
    down = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(
            points)).voxel_down_sample(voxel)
    down.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(radius=2 * voxel,
            max_nn=30))
    down.orient_normals_towards_camera_location(np.zeros(3))
    features = o3d.pipelines.registration.compute_fpfh_feature(down,
        o3d.geometry.KDTreeSearchParamHybrid(radius=5 * voxel, max_nn=100))
    return np.asarray(down.points), np.asarray(down.normals), features.data.T


# the table and what stands on it, exact depth
close = exact[(exact[:, 2] < 1.8) & (np.abs(exact[:, 0]) < 0.8)]
places, _, fpfh = describe(close, 0.015)
here = transforms.apply(T, places)
spots = {"on the table": [0.25, 0.2, 0.75], "on the globe": [0.42, 0.0, 0.88],
         "at the table's edge": [0.2, -0.24, 0.75]}
at = {name: int(np.argmin(np.linalg.norm(here - spot, axis=1))) for name,
      spot in spots.items()}
turn = transforms.from_rotation_translation(
    o3d.geometry.get_rotation_matrix_from_xyz([0.3, -0.2, 0.5]), [0, 0, 0])
again = describe(transforms.apply(turn, close), 0.015)
partner = cKDTree(again[0]).query(transforms.apply(turn,
                                                   places[list(at.values())]))[
    1]


def changed(a, b):
    """How much of a histogram lies in other bins (%), from 0 to 100."""
    return 100 * np.abs(a - b).sum() / (a.sum() + b.sum())


report("the scene is turned by",
       np.degrees(np.arccos((np.trace(turn[:3, :3]) - 1) / 2)), "degrees", 2)
for (name, i), j in zip(at.items(), partner, strict=True):
    report(f"{name}, changed by that", changed(fpfh[i], again[2][j]), "%", 2,
           smallest=0.1)
report("between table and globe", changed(fpfh[at["on the table"]],
                                          fpfh[at["on the globe"]]), "%", 2)

# %% tags=["hide-input"]
fig, axes = plt.subplot_mosaic([["where", name] for name in at],
                               figsize=(9, 4.8), width_ratios=[2, 3],
                               layout="constrained")
from_above = here[(here[:, 2] > 0.5) & (here[:, 1] > -0.3)]
axes["where"].plot(from_above[:, 0], from_above[:, 1], ".", ms=1.5,
                   color="0.75")
axes["where"].set(aspect="equal", xlabel="x (m)", ylabel="y (m)",
                  title="the table from above")
for (name, i), what, mark in zip(at.items(), ("target", "ours", "outlier"),
                                 "os^", strict=True):
    axes["where"].plot(*here[i, :2], mark, ms=9, color=show.COLOURS[what])
    axis = axes[name]
    axis.bar(np.arange(33), fpfh[i] / 2, color=show.COLOURS[what])
    for edge in (10.5, 21.5):
        axis.axvline(edge, color="0.6", lw=1)
    axis.set_title(name, fontsize=10)
    axis.set(ylabel="%", ylim=(0, 100), xticks=[1, 5, 9, 12, 16, 20, 23, 27,
                                                31], xticklabels=[])
axis.set_xticklabels(["\N{MINUS SIGN}", "0\nbend", "+", "\N{MINUS SIGN}",
                      "0\ntwist", "+", "\N{MINUS SIGN}", "0\nrise", "+"])
full = {name: [int((fpfh[i][11 * n:11 * n + 11] > 10).sum()) for n in range(3)]
        for name, i in at.items()}
picture(fig, alt="A table from above with three marked points, and their "
        "histograms of bend, twist and rise, eleven bins each. " +
        " ".join(f"{name.capitalize()}: {a}, {b} and {d} bins hold more than 5 "
                 "%." for name, (a, b, d) in full.items()))

# %% [markdown]
# On a plane all normals agree, and each angle has one bin, at 0. On the globe every neighbour's normal leans forwards, so the bend lies
# above 0; every line falls below the surface, so the rise lies below 0; and nothing leans to a side. At an edge two families of
# normals meet, and more bins fill.
#
# Turn the scene, and the angles stay, so the histograms of table and globe stay nearly the same: that is what they are for. The one at the
# edge changes more, because the cubes do not turn with the scene and other points are kept; it still changes less than table and globe
# differ. But every place in the middle of the table has the *same* histogram. A feature tells corners from planes, not one piece of
# plane from the next.
#
# ## Report against reality
#
# The report is a student's text on 3D reconstruction with Open3D. `describe` above is its function `preprocess_point_cloud`, with one line
# added (its normals have no sign). Its section 6.2 promises "noise reduction". Here is a flat sheet with noise of 2 mm, and an exact right-angled edge, through voxel grids whose
# origins are drawn at random. At the edge we ask how far inside the corner the worst centroid lies.

# %%
rng = np.random.default_rng(6)
sigma, n = 0.002, 15_000
sheet = np.column_stack([rng.uniform(0, 0.2, (n, 2)),
                         sigma * rng.standard_normal(n)])
side = rng.uniform(0, 0.2, (n, 2))
# z = 0 and x = 0
corner = np.concatenate([np.column_stack([side, np.zeros(n)]),
                         np.column_stack([np.zeros(n), side])])
rows = []
for voxel in (0.002, 0.005, 0.01, 0.02, 0.04):
    starts = rng.uniform(0, voxel, (100, 3))
    flat = [1000 * np.std(downsample.voxel_downsample(sheet, voxel, start)[:,
                2]) for start in starts]
    edges = [downsample.voxel_downsample(corner, voxel, start)
             for start in starts]
    # to the nearer of the two faces
    cut = [1000 * np.minimum(edge[:, 0], edge[:, 2]).max() for edge in edges]
    rows.append([f"{1000 * voxel:g}", *(float(f(flat)) for f in (min, np.median,
                    max)),
                 f"{100 * np.mean(np.array(flat) < 500 * sigma):.0f} of 100",
                 float(np.mean(cut))])
report_table(rows, columns=["voxel (mm)", "noise left, luckiest origin (mm)",
                            "median origin (mm)", "unluckiest (mm)",
                            "noise at least halved",
                            "edge rounded off by, mean (mm)"], digits=2,
             title="2 mm of noise on the sheet, none at the edge; 100 origins")

# %% [markdown]
# "Noise reduction" is three things. With small voxels the sheet falls into layers, and a stray point alone in its cube counts as much as a
# full cube: the noise *stays or grows*. With voxels of ten or twenty times the noise it *averages by luck*: well where no face of the grid
# cuts through the sheet, and the fourth column counts for how many origins; beforehand you cannot know. And *edges are rounded off* by every
# voxel, where there was no noise at all, and most by those that average well. So a voxel grid is no noise filter, and noise is no reason to
# choose a voxel: the rule of section 2 is. Now the function as a whole:

# %%
rows = []
for voxel in (0.05, 0.005):
    # a metre away from (0, 0, 0), to which it turns normals
    where, found, _ = describe(points - [0, 1.0, 0], voxel)
    _, owner = cKDTree(points - [0, 1.0, 0]).query(where)
    around = cKDTree(where)
    within = [np.mean([len(x) for x in around.query_ball_point(where,
                    f * voxel)]) for f in (2, 5)]
    rows.append([f"{1000 * voxel:g}", len(where), float(within[0]),
                 float(np.median(degrees_off(found, true[owner]))),
                 100 * float(within[1]) / len(where)])
report_table(rows, columns=["voxel (mm)", "points",
                            "points within the normal's radius",
                            "normals off by, median (degrees)",
                            "cloud within the feature's radius (%)"], digits=2,
             title="preprocess_point_cloud on the animal (Open3D's origin)")

# %% [markdown]
# With the report's own 0.05 a normal is taken from points all over the animal, and every feature sees all of it: none describes a place.
# With a tenth of that, normals are good to a few degrees and features are local.
#
# | The document says | What we found | Evidence |
# |---|---|---|
# | Report 6.1: centroid, or the point closest to the centre | both are good; a centroid of a curved piece lies inside the body | section 2 |
# | Report figure 3: voxel 0.05 | on a thing of 0.15 m some tens of points are left; how many, the origin decides | section 1, On real data |
# | Report 6.1: a smaller voxel retains more | yes, about four times the points for half the voxel, down to the spacing | section 2 |
# | Report 6.2: less computation and memory | holds: points and bytes fall together | table in section 2 |
# | Report 6.2: "noise reduction" | no filter: it averages flat parts only if one cube holds the noise, which the origin decides; small voxels make it grow; edges are rounded off | first table above |
# | Report 6.3: `preprocess_point_cloud` | radii in multiples of the voxel are good practice; 0.05 makes "local" features of the whole cloud; normals lack a sign | second table above, section 4 |
# | Report 6.3: normals give "orientation and curvature" | orientation up to the sign; curvature is another number (λ₀/Σλ) | sections 3 and 4 |
# | A paper on mapping from a UAV, IV: "leaf" 0.2 (PCL's name for the voxel), "preserving essential features" | what is thinner than the voxel keeps its points and loses its thickness, or melts into what stands beside it: 0.2 m keeps walls, not the form of branches and wires | Break it |
# | UAV IV: downsampling first, then outliers | an outlier gets a vote in a centroid, or a cube of its own that counts as much as a full one; leave out cubes with few points | section 1; task 2 of the lab |

# %% [markdown]
# ## Break it
#
# A board, 8 mm thick, scanned from both sides, exactly. A voxel of 20 mm looks harmless: the board is half a metre wide.

# %%
thick, voxel = 0.008, 0.02
board = np.column_stack([rng.uniform(0, 0.5, (40_000, 2)),
                         thick * rng.integers(0, 2, 40_000)])
merged = []
for start in np.arange(20) / 20 * voxel:
    kept = downsample.voxel_downsample(board, voxel, [0, 0, start])
    # every centroid is inside the wood
    merged.append(np.abs(kept[:, 2] - thick / 2).max() < thick / 4)
report("origins for which both sides become one", 100 * np.mean(merged), "%",
       digits=2)
report("how far inside the board its points then lie", 1000 * thick / 2, "mm")

# each side was seen from its own side: its normal has a sign
facing_up = np.where(board[:, 2] > 0, 1, -1)
kept = np.concatenate([downsample.voxel_downsample(board[facing_up == s], voxel)
                       for s in (1, -1)])
off_its_side = np.minimum(np.abs(kept[:, 2]), np.abs(kept[:, 2] - thick))
report("with one grid a side, the worst point is off its side by",
       1000 * float(off_its_side.max()), "mm")

# %% [markdown]
# Whether the board survives is luck: for a board along the grid, its thickness over the voxel is the chance that a face of the grid falls between its
# sides. Normals with a sign (section 4) tell the sides apart: give each side its own grid, as the last three lines do. Otherwise the voxel
# must stay below the thinnest thing you want to keep, or below 0.58 of it where that is not parallel to the grid.
#
# ## On real data
#
# The bunny itself, with a voxel of 50 mm and its cubes counted in five ways. Then a real desk: what does a voxel grid do to near and
# far?

# %% tags=["real-data"]
# real data: stanford_bunny
bunny = data.load("stanford_bunny").cloud.points.astype(float)
indices = {"floor, origin at zero": np.floor(bunny / 0.05),
           "floor, origin at the lowest corner": np.floor(
        (bunny - bunny.min(axis=0)) / 0.05), "rounded": np.rint(bunny / 0.05),
           "int()": (bunny / 0.05).astype(int)}
rows = [[name, len(np.unique(index, axis=0))] for name,
        index in indices.items()]
theirs = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(
        bunny)).voxel_down_sample(0.05)
rows.append(["Open3D", len(theirs.points)])
report_table(rows, columns=["a voxel of 50 mm on the bunny", "points kept"])
report("10 to 5 mm: times as many points", len(voxel_grid(bunny, 0.005)[0]) /
       len(voxel_grid(bunny, 0.01)[0]), "", 2)

# %% [markdown]
# All rows but `int()` are right, each of its own grid. Open3D agrees with the first by chance: its grid begins elsewhere, half a voxel
# below the lowest point.

# %% tags=["real-data"]
# real data: tum_pair
desk = pointcloud.from_frame(data.load("tum_pair").frames[0]).points
thin = downsample.voxel_downsample(desk, 0.02)
rows = []
for low, high in ((0.5, 1.5), (1.5, 2.5), (2.5, 3.5)):
    part = [int(((p[:, 2] > low) & (p[:, 2] < high)).sum())
            for p in (desk, thin)]
    rows.append([f"{low:g} to {high:g}", *part, part[0] / part[1]])
report_table(rows, columns=["depth (m)", "points", "kept, voxel 20 mm",
                            "points a cube"], digits=2)

# %% [markdown]
# A camera spends its points on what is near: there a cube holds several times as many. One point a cube makes the density even, which is what
# later steps (outliers, planes, ICP) like best.
#
# ## Key points
#
# - Round down, and fix the origin. A voxel grid without an origin is not reproducible.
# - On a surface, half the voxel is four times the points. What is lost is a third of the voxel; what is false grows with its square, while
#   cubes are small.
# - The rule: below the thinnest thing to keep (0.58 of it in any direction), and at most three times the error you can bear. A voxel grid is no noise filter.
# - Normal: centre, covariance, the *column* of the *smallest* eigenvalue. Its sign needs a viewpoint in the same frame.
# - FPFH is the angles around a point: the same after any motion, and the same all over a plane.
#
# Words to know: [voxel](../docs/glossary.md#voxel), [voxel grid](../docs/glossary.md#voxel-grid),
# [centroid](../docs/glossary.md#centroid), [normal](../docs/glossary.md#normal), [covariance](../docs/glossary.md#covariance),
# [eigenvector](../docs/glossary.md#eigenvector), [FPFH](../docs/glossary.md#fpfh).
#
# ## Your own camera
#
# Change one line: `scan = pointcloud.from_frame(data.from_folder("path/to/my_recording", camera="camera.json").frames[0]).points`.
# Take the voxel by the rule, and not from your noise: on a desk with pens of 8 mm, of which 2 mm may be lost, that is 4 mm; in a corridor
# with doors 40 mm thick, of which 15 mm may be lost, just below 40 if they run along the grid, else 23.
#
# In the folder of a released lab, what you write there yourself is locked in the library: `voxel_downsample`, `estimate_normals`,
# `sample_farthest`. Run this lesson in the course's own folder.
#
# ## To the lab
#
# Lab 04 has you write the voxel grid, mend somebody's normals and thin a cloud without tearing holes: [open lab 04](../exercises/04_downsampling.ipynb).
#
# ## Going further
#
# Other ways to have fewer points, all on the animal, all with about as many points as the 10 mm grid keeps:

# %%
count = len(downsample.voxel_downsample(points, 0.01))
ways = {"voxel grid, nearest": nearest_to_centre(points, 0.01),
        "random": points[downsample.sample_random(points, count, seed=1)],
        "every k-th": points[downsample.sample_uniform(points,
                                                       len(points) // count)],
        "farthest point": points[downsample.sample_farthest(points, count)],}
report_table(
    [[name, len(p), *(1000 * float(f(metrics.nearest_distances(points, p)))
                      for f in (np.mean, np.max))] for name, p in ways.items()],
    columns=["way", "points", "lost, mean (mm)", "widest gap (mm)"], digits=2)

# %% [markdown]
# Random and every k-th cost next to nothing. Random keeps the density as it was. Every k-th counts along the list, not in space: it is as good
# or bad as the order of the list. Farthest-point sampling always puts the next point into the widest gap; it covers best, costs time in
# proportion to points times samples, and takes outliers first.
#
# - What the library's voxel grid and normals cost beside Open3D's, and how both grow: [benchmarks](../docs/benchmarks.md).
# - Signs without a camera: neighbours' normals should agree, so pass the sign along a tree of neighbours. Hoppe et al., *Surface
#   reconstruction from unorganized points*, SIGGRAPH 1992; `orient_normals_consistent_tangent_plane` in Open3D.
# - Pauly, Gross and Kobbelt, *Efficient simplification of point-sampled surfaces*, IEEE Visualization 2002: surface variation
#   λ₀/Σλ, and simplification that keeps more points where it bends.
# - Rusu, Blodow and Beetz, *Fast point feature histograms (FPFH) for 3D registration*, ICRA 2009.
# - Eldar et al., *The farthest point strategy for progressive image sampling*, IEEE Transactions on Image Processing 1997.
