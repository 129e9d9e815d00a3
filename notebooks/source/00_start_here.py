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
# # 00 Start here
#
# **In twenty minutes you go the whole way once: from a depth image to a 3D model, and to a number that says how wrong it is.**
#
# Run a cell with Shift+Enter. Nothing can break: this is your own copy, and `python3 course.py reset 00` makes another.

# %%
from course_lib.notebook import data, report, report_table, show

import numpy as np
import open3d as o3d

from course_lib.cloud import pointcloud
from course_lib.geometry import transforms
from course_lib.surface import meshes, metrics

room = data.load("living_room")
show(room.frames[0],
     title="Where we start: a photograph, and how far away all in it was")

# %% [markdown]
# This room does not exist. A program drew it, and added the mistakes that a real depth camera makes. So we know the **truth**: where
# every wall really is. That is how this course can tell you, to the millimetre, how wrong a result is.
#
# ## Card
#
# | | |
# |---|---|
# | **You will** | see each step of a reconstruction once; read its error in millimetres; know which lesson explains what |
# | **Minutes** | 20 for the lesson, 8 for the lab |
# | **Before** | nothing but a little Python |
# | **Teaches** | the report, sections 1 and 2 |
# | **Data** | `living_room` (simulated, with truth); one frame of a real RealSense camera |
#
# This course grew from three documents: *the report* (3D reconstruction with Open3D and a D455), *the UAV document* (meshing terrain from a
# drone's stereo camera) and *the lecture* (point clouds for robots). You need none of them: whatever a lesson tests, it quotes.
#
# **Open3D** is the library that does the professional work here: free, open source, and content with a laptop.
#
# ## 1 From an image to points
#
# Every pixel knows its direction and its distance. So every pixel can be put back into space. The result is a **point cloud**: a list of
# places. (Lessons 01 to 03.)

# %%
first = pointcloud.from_frame(room.frames[0])
second = pointcloud.from_frame(room.frames[8])
report("points", len(first))
show(first, view="iso", title="The same image, as points in space")

# %% [markdown]
# The camera saw the room from one side only. Behind the table is nothing, because nothing was seen there.
#
# ## 2 Cleaned
#
# First we keep one point in every 3 cm. Then the specks that hang in the air go: the camera invented them. A filter removes points that have too few neighbours near by. (Lessons 04 and 05.)

# %%
clouds = [
    o3d.geometry.PointCloud(o3d.utility.Vector3dVector(c.points.astype(float)))
    for c in (first, second)]
# One point in every 3 cm is kept, then what has near neighbours.
thinned = [cloud.voxel_down_sample(0.03) for cloud in clouds]
cleaned = [cloud.remove_statistical_outlier(nb_neighbors=20, std_ratio=1.0)[0]
           for cloud in thinned]

surface, poses = room.mesh, [room.poses[0], room.poses[8]]  # the truth
for name, cloud in [("before", thinned[0]), ("after", cleaned[0])]:
    in_the_room = transforms.apply(poses[0], np.asarray(cloud.points))
    off = metrics.distance_to_surface(in_the_room, surface)
    report(f"points {name}", len(cloud.points))
    report(f"worst point {name}, distance to the true surface",
           1000 * off.max(), "mm", digits=2)

# %% [markdown]
# ## 3 Aligned
#
# A second frame was taken a step further on. To use both, we must find out how the camera moved. A method called ICP (lesson
# 07) moves one cloud until it fits the other. Open3D then reports a **fitness**: the share of points that found a partner within
# some radius. Here are three states of the two clouds. Which one would you trust?

# %%
icp = o3d.pipelines.registration
for cloud in cleaned:
    cloud.estimate_normals()
    cloud.orient_normals_towards_camera_location()
moved = transforms.compose(transforms.invert(poses[0]), poses[1])  # the truth
states, rows = [np.eye(4)], []
for radius in (0.2, 0.05):
    result = icp.registration_icp(cleaned[1], cleaned[0], radius, states[-1],
                                  icp.TransformationEstimationPointToPlane())
    states.append(result.transformation)
names = ["not aligned, counted within 1 m", "ICP, within 20 cm",
         "then ICP, within 5 cm"]
for name, T, radius in zip(names, states, (1.0, 0.2, 0.05), strict=True):
    found = icp.evaluate_registration(cleaned[1], cleaned[0], radius, T)
    off_mm = 1000 * transforms.pose_error(T, moved).metres
    rows.append([name, f"{found.fitness:.3f}", off_mm])
report_table(rows, columns=["state", "fitness", "true error in mm"], digits=2)

# %% [markdown]
# The perfect score belongs to the clouds that nobody aligned: their camera is off by the length of a forearm. With a radius of one
# metre, every point has *some* partner. The best state has the lowest score. **This course asks every result for its error.**
#
# ## 4 Meshed and measured
#
# Last, the points become a surface of triangles, a **mesh** (lesson 08). And because we know the truth, we can measure it.

# %%
both = cleaned[0] + o3d.geometry.PointCloud(cleaned[1]).transform(states[-1])
poisson, density = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
    both, depth=7, n_threads=1)
unsupported = np.asarray(density) < np.quantile(density, 0.15)
poisson.remove_vertices_by_mask(unsupported)  # surface far from any point

vertices = transforms.apply(poses[0], np.asarray(poisson.vertices))
error_mm = 1000 * metrics.distance_to_surface(vertices, surface)
report("median distance of the mesh to the true surface", np.median(error_mm),
       "mm", digits=2)
mesh = meshes.Mesh(vertices, np.asarray(poisson.triangles))
show((mesh, np.minimum(error_mm, 50)), label="error (50 = 50 or more)",
     unit="mm", frame="world", view="iso", cull=True, about=True,
     title="How wrong the surface is, and where",
     alt="The table and the walls come out well, edges do not")

# %% [markdown]
# ## 5 The same on a real camera
#
# The first step runs on a real frame, too: this one is from a RealSense camera. (If it is not on your machine yet, you see the stored picture, and a line above it says how to get the data.)

# %% tags=["real-data"]
# real data: realsense_planes
real = data.load("realsense_planes").frames[-1]
show(pointcloud.from_frame(real), views=["camera", "side"],
     title="A box seen by a RealSense, and the same points from the side")

# %% [markdown]
# From the side, the far wall is wavy; a real wall is flat. How wrong is it? Nobody knows: nobody measured this room. So each lesson works
# on simulated data first, where errors can be measured, and on real data after that.
#
# ## The map
#
# Every lesson has a lab. Those without minutes are still to come.
#
# <!-- map -->
# | Lesson | Lab | Minutes, lesson + lab | You will be able to |
# |---|---|---|---|
# | [00 Start here](00_start_here.ipynb) | [lab](../exercises/00_start_here.ipynb) | 18 + 8 | see the whole trip, and rehearse handing in |
# | [01 RGB-D images](01_rgbd_images.ipynb) | [lab](../exercises/01_rgbd_images.ipynb) | 49 + 45 | read any depth image in metres, and tell what it cannot know |
# | [02 Point clouds](02_point_clouds.ipynb) | [lab](../exercises/02_point_clouds.ipynb) | 58 + 48 | read, pack, move and place clouds, up to PointCloud2 messages |
# | [03 From depth to points](03_depth_to_points.ipynb) | [lab](../exercises/03_depth_to_points.ipynb) | 55 + 50 | lift a depth image into space, and find what goes wrong on the way |
# | [04 Downsampling, normals, features](04_downsampling.ipynb) | [lab](../exercises/04_downsampling.ipynb) | 58 + 47 | make a cloud a hundred times smaller and price it in millimetres; normals with the right sign |
# | [05 Outliers](05_outliers.ipynb) | [lab](../exercises/05_outliers.ipynb) | 55 + 54 | clean a cloud, and say by kind of outlier what each filter finds and what it costs |
# | [06 Planes](06_planes.ipynb) | [lab](../exercises/06_planes.ipynb) | 58 + 56 | find planes, take the floor away, and pick text out of a cloud, with precision and recall |
# | [07 ICP](07_icp.ipynb) | [lab](../exercises/07_icp.ipynb) | 60 + 59 | lay one cloud on another, and tell a good fit from a number that looks like one |
# | 08 Meshes | | | turn points into surfaces |
# | 09 Alpha shapes | | | find the outline of a cloud |
# | 10 RGB-D odometry | | | follow a camera, and say how far it has drifted |
# | 11 D455 calibration | | | calibrate your own camera |
# | 12 Stitching | | | build one model from many images |
# | 13 Many views | | | fuse many views into one surface |
# | 14 Sensing depth | | | know how depth is measured, and where that fails |
# | 15 Terrain from a UAV | | | make terrain from a drone's stereo camera |
# | 16 LiDAR odometry | | | follow a laser scanner outdoors |
# | 17 Robots | | | put a reconstruction to use on a robot |
# <!-- /map -->
#
# Three routes. **An evening**: this lesson and [01](01_rgbd_images.ipynb). **A lab day**: 00, [01](01_rgbd_images.ipynb) and
# [03](03_depth_to_points.ipynb), each with its lab. **A semester**: a lesson and its lab a week, in order.
#
# ## The error budget
#
# Errors add up on the way from pixel to surface. Each lesson that can measure one adds its row. Now the table waits:

# %%
show.error_budget()

# %% [markdown]
# ## Key points
#
# - A depth image becomes points, points become a surface, and each step has an error.
# - A tool that reports success has not measured its error.
# - Where there is truth, ask for millimetres. Where there is none, say so.
#
# ## To the lab
#
# Lab 00 is one line long. It rehearses how a lab works and how you hand it in: [open lab 00](../exercises/00_start_here.ipynb).
