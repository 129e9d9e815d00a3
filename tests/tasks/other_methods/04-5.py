import numpy as np


def thin_out(points, count):
    """A voxel grid for half of the points, the others one by one into the widest gap."""

    def one_a_cube(voxel):
        index = np.floor(points / voxel)
        off = np.linalg.norm(points - (index + 0.5) * voxel, axis=1)
        order = np.argsort(off, kind="stable")
        return order[np.unique(index[order], axis=0, return_index=True)[1]]

    low, high = 0.05, 3.0
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if len(one_a_cube(middle)) > count // 2 else (low, middle)
    chosen = list(one_a_cube(high))
    gap = np.min([np.linalg.norm(points - points[i], axis=1) for i in chosen], axis=0)
    while len(chosen) < count:
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)
