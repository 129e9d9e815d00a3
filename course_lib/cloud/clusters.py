"""Euclidean clusters: points that a walker reaches from each other in steps of at most a radius.

What DBSCAN gives when every point counts as a core point (min_points = 1;
Open3D's leaves out steps of exactly the radius), and PCL's EuclideanClusterExtraction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from course_lib import checks
from course_lib.checks import finite_points
from course_lib.cloud.grid import grid_of
from course_lib.cloud.neighbours import SMALL

__all__ = ["euclidean_clusters"]


def euclidean_clusters(points: ArrayLike, radius: float, least: int = 1) -> NDArray[np.intp]:
    """Number the clusters of a cloud.

    Parameters
    ----------
    points : (N, 3) float, finite.
    radius : two points this near, or nearer, belong together; in the unit of the points.
    least : smaller clusters count as none.

    Returns
    -------
    (N,) labels: 0 is the largest cluster, then by size (of equal ones that with the earlier point); -1 is none.

    Raises
    ------
    ValueError
        If an argument is of another form.

    References
    ----------
    Rusu, Semantic 3D object maps for everyday manipulation in human living environments, dissertation, TU München,
    2009; Ester, Kriegel, Sander and Xu, A density-based algorithm for discovering clusters, KDD 1996.

    Examples
    --------
    >>> euclidean_clusters([[0, 0, 0], [9, 0, 0], [0.5, 0, 0], [1, 0, 0]], radius=0.6).tolist()
    [0, 1, 0, 0]
    """
    reach, least = checks.positive(radius, "radius"), checks.whole(least, "least", of="points")
    array = finite_points(points)
    label = _in_pairs(array, reach) if len(array) < SMALL else _in_cubes(array, reach)
    return _by_size(label, least)


def _in_pairs(points: NDArray[np.float64], radius: float) -> NDArray[np.intp]:
    """Component of each point, from all pairs within the radius: for few points."""
    pairs = cKDTree(points).query_pairs(radius * (1 + 1e-9), output_type="ndarray")
    apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    ends = pairs[apart <= radius]
    graph = coo_array((np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=(len(points), len(points)))
    label: NDArray[np.int32] = connected_components(graph.tocsr(), directed=False)[1]
    return label.astype(np.intp)


def _in_cubes(points: NDArray[np.float64], radius: float) -> NDArray[np.intp]:
    """Component of each point: any two points of a cube are near enough, so cubes are joined, not points."""
    from course_lib.cloud.cluster_loops import join_cells

    try:
        grid = grid_of(points, radius / np.sqrt(3.0) * (1 - 1e-9))
    except ValueError as error:
        raise ValueError(
            f"radius: {radius:g} is too small for points that lie so far apart; is the unit right?"
        ) from error
    parent = np.arange(len(grid.cells) - 1)
    join_cells(*grid[1:], radius, parent)
    while (parent[parent] != parent).any():
        parent = parent[parent]
    label = np.empty(len(points), dtype=np.intp)
    label[grid.order] = np.repeat(parent, np.diff(grid.cells[:, 2]))
    return label


def _by_size(label: NDArray[np.intp], least: int) -> NDArray[np.intp]:
    """Renumber by size, the largest first; components that are too small become -1."""
    _, first, inverse, count = np.unique(label, return_index=True, return_inverse=True, return_counts=True)
    order = np.lexsort((first, -count))
    number = np.empty(len(order), dtype=np.intp)
    number[order] = np.arange(len(order))
    number[count < least] = -1
    return number[inverse]
