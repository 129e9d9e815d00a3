"""No radius at all: every pair is weighed by its distance, against twice the median of all distances."""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation


def register(source, target, normals, start):
    T, tree = start.copy(), cKDTree(target)
    spacing = np.median(tree.query(target, 2)[0][:, 1])
    for _ in range(60):
        p = source @ T[:3, :3].T + T[:3, 3]
        distance, index = tree.query(p)
        q, n = target[index], normals[index]
        # Tukey's weights; the median shrinks as the source comes home
        reach = max(2 * np.median(distance), 2 * spacing)
        root = np.maximum(1 - (distance / reach) ** 2, 0)
        A = np.c_[np.cross(p, n), n] * root[:, None]
        b = np.sum(n * (q - p), axis=1) * root
        x = np.linalg.solve(A.T @ A, A.T @ b)
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = Rotation.from_rotvec(x[:3]).as_matrix(), x[3:]
        T = step @ T
    return T
