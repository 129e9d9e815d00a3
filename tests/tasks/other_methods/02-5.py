import numpy as np


def few(points, n):
    """Discs around chosen points, as small as n of them allow."""
    square = (points**2).sum(axis=1)
    apart = np.sqrt(np.maximum(square[:, None] + square - 2 * points @ points.T, 0))

    def covered(radius):
        rows, bare = [], np.ones(len(points), bool)
        while bare.any():
            rows.append(int(np.argmax(bare)))  # the first point that no disc covers
            bare &= apart[rows[-1]] > radius
        return rows

    small, large = 0.0, 1.0
    for _ in range(16):
        middle = (small + large) / 2
        if len(covered(middle)) > n:
            small = middle
        else:
            large = middle
    rows = covered(large)
    rest = [row for row in range(len(points)) if row not in rows]
    return np.array(rows + rest[: n - len(rows)])
