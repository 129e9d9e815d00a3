import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree


def clean(points):
    """The twelve nearest of each point in metres; a step is a link where it is short for its depth."""
    distance, index = cKDTree(points).query(points, 13)
    z = points[:, 2]
    linked = distance[:, 1:] < 4 * np.minimum(z[:, None], z[index[:, 1:]]) / 110
    i, nth = np.nonzero(linked)
    graph = coo_array((np.ones(len(i)), (i, index[i, nth + 1])), shape=(len(z), len(z)))
    label = connected_components(graph, directed=False)[1]
    return np.bincount(label)[label] >= 300
