"""Lab 05 as it was before its tasks left the lesson's situation."""

from __future__ import annotations

from old_forms.outliers.cases import TASKS

_CUT = '''\
def where_to_cut(mean, wrong, edges):
    """The lower edge, in metres, of the first bin with more wrong points than true ones."""
    bad = np.histogram(mean[wrong], edges)[0]
    good = np.histogram(mean[~wrong], edges)[0]
    return edges[np.argmax(bad > good)]
'''
_DISTANCES = '''\
def mean_distances(points, k):
    """Mean distance (N,) in metres of each point to its k nearest other points."""
    distance, _ = cKDTree(points).query(points, k + 1)
    return distance[:, 1:].mean(axis=1)
'''
_RADIUS = '''\
def keep_by_radius(points, radius, least):
    """Which points to keep (N,): those with at least `least` other points within `radius` metres."""
    difference = points[:, None] - points[None]
    squared = (difference**2).sum(axis=-1)
    count = (squared <= radius**2).sum(axis=1) - 1
    return count >= least
'''
_CLEAN = '''\
def clean(points):
    """Which points to keep (N,)."""
    pairs = cKDTree(points).query_pairs(0.0135, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    label = connected_components(graph, directed=False)[1]
    return np.bincount(label)[label] >= 250
'''

FORMS = tuple(zip(TASKS, (_CUT, _DISTANCES, _RADIUS, _CLEAN), strict=True))
