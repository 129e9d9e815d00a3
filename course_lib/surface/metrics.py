"""Numbers against truth: how far depth, points and surfaces are from what they should be, in metres."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.cloud.neighbours import Neighbours
from course_lib.surface.meshes import Mesh


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
    array = checks.numbers(values, "values").astype(np.float64)
    if array.size == 0:
        raise ValueError("values: there are none to measure.")
    if not np.isfinite(array).all():
        raise ValueError(f"values: {np.count_nonzero(~np.isfinite(array))} are NaN or infinite; drop them first.")
    return float(np.sqrt(np.mean(np.square(array))))


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
    points = checks.finite_points(points)
    # Single precision is finest near the origin, so both are moved there first.
    origin = mesh.vertices.astype(np.float64).mean(axis=0)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor((mesh.vertices - origin).astype(np.float32)),
        o3d.core.Tensor(mesh.triangles.astype(np.uint32)),
    )
    near = o3d.core.Tensor((points - origin).astype(np.float32))
    distance: NDArray[np.float32] = scene.compute_distance(near).numpy()
    return distance.astype(np.float64)


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
    a, b = checks.finite_points(a, "a"), checks.finite_points(b, "b")
    return Neighbours(b).nearest(a)[0][:, 0]
