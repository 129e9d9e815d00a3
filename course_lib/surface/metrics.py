"""Numbers against truth: how far depth, points and surfaces are from what they should be, in metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.cloud.neighbours import Neighbours
from course_lib.surface.meshes import Mesh


@dataclass(frozen=True)
class ErrorSummary:
    """Size of many errors, signs dropped: how many, and their median, RMS, 95th percentile and largest, in metres."""

    count: int
    median: float
    rms: float
    p95: float
    largest: float


def rms(values: ArrayLike) -> float:
    """Return the root of the mean square of all values; NaN is refused.

    Raises
    ------
    ValueError
        If there are none, or one is not finite.

    Examples
    --------
    >>> rms([3, 4, 0, 0])
    2.5
    """
    return float(np.sqrt(np.mean(np.square(_finite(values, "values")))))


def _finite(values: ArrayLike, what: str) -> NDArray[np.float64]:
    array = checks.numbers(values, what).astype(np.float64)
    if array.size == 0:
        raise ValueError(f"{what}: there are none to measure.")
    if not np.isfinite(array).all():
        raise ValueError(f"{what}: {np.count_nonzero(~np.isfinite(array))} are NaN or infinite; drop them first.")
    return array


def summarise(errors: ArrayLike) -> ErrorSummary:
    """Summarise errors in metres (any shape, signs dropped).

    Raises
    ------
    ValueError
        If there are none, or one is not finite.

    Examples
    --------
    >>> summarise([-0.001, 0.001, 0.001]).median
    0.001
    """
    size = np.abs(_finite(errors, "errors"))
    return ErrorSummary(
        count=size.size,
        median=float(np.median(size)),
        rms=rms(size),
        p95=float(np.percentile(size, 95)),
        largest=float(size.max()),
    )


def depth_error(depth: ArrayLike, truth: ArrayLike) -> ErrorSummary:
    """Compare a depth image with the true one where both have a value.

    Parameters
    ----------
    depth, truth : (H, W) float, metres; 0, NaN or infinite where there is none.

    Returns
    -------
    ErrorSummary of |depth − truth| along the optical axis; `count` is the number of pixels compared.

    Raises
    ------
    ValueError
        If one is no depth image in metres, the sizes differ, or no pixel has both.
    """
    depth, truth = checks.check_depth(depth, "depth"), checks.check_depth(truth, "truth")
    if depth.shape != truth.shape:
        raise ValueError(f"depth has shape {depth.shape} but truth {truth.shape}; resize one (rgbd.resize_depth).")
    both = (depth > 0) & (depth < np.inf) & (truth > 0) & (truth < np.inf)
    if not both.any():
        raise ValueError("depth and truth: no pixel was measured in both.")
    return summarise(depth[both].astype(np.float64) - truth[both])


def distance_to_surface(points: ArrayLike, mesh: Mesh) -> NDArray[np.float64]:
    """Return how far each point lies from the nearest point of a surface.

    Parameters
    ----------
    points : (N, 3), metres, finite, in the frame of the mesh.
    mesh : the surface.

    Returns
    -------
    (N,) float64, metres, never negative; computed by Open3D in single precision (about 1 µm in a room).

    Raises
    ------
    ValueError
        If points are not (N, 3) and finite, or mesh is no Mesh.

    Examples
    --------
    >>> floor = Mesh([[0, 0, 0], [9, 0, 0], [0, 9, 0]], [[0, 1, 2]])
    >>> distance_to_surface([[1, 1, 0.5], [1, 1, -2]], floor).tolist()
    [0.5, 2.0]
    """
    if not isinstance(mesh, Mesh):
        raise ValueError(f"mesh: expected a course_lib.surface.meshes.Mesh, got {type(mesh).__name__}.")
    points = _finite(checks.cloud_points(points), "points")
    # Single precision is finest near the origin, so both are moved there first.
    origin = mesh.vertices.astype(np.float64).mean(axis=0)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor((mesh.vertices - origin).astype(np.float32)),
        o3d.core.Tensor(mesh.triangles.astype(np.uint32)),
    )
    distance = scene.compute_distance(o3d.core.Tensor((points - origin).astype(np.float32)))
    return distance.numpy().astype(np.float64)


def nearest_distances(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return, for each point of `a`, the distance to the nearest point of `b`.

    Parameters
    ----------
    a : (N, 3), metres, finite.
    b : (M, 3), metres, finite, in the same frame.

    Returns
    -------
    (N,) float64, metres. Not symmetric: `nearest_distances(b, a)` answers another question.

    Raises
    ------
    ValueError
        If one is not (N, 3) and finite, or is empty.

    Examples
    --------
    >>> nearest_distances([[0, 0, 0], [5, 0, 0]], [[1, 0, 0]]).tolist()
    [1.0, 4.0]
    """
    a, b = _finite(checks.cloud_points(a, "a"), "a"), _finite(checks.cloud_points(b, "b"), "b")
    return Neighbours(b).nearest(a)[0][:, 0]
