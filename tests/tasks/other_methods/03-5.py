import numpy as np


def estimate_focal(pixels, depths, lengths, cx, cy):
    """The value that most things agree on, and the mean of those that do."""
    ends = (pixels - [cx, cy]) * depths[..., None]
    across = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    beside = lengths**2 - (depths[:, 0] - depths[:, 1]) ** 2
    possible = beside > 0
    each = across[possible] / np.sqrt(beside[possible])
    agreeing = np.abs(each[:, None] / each - 1) < 0.015  # row: a thing, column: the value that is tried
    return each[agreeing[:, agreeing.sum(axis=0).argmax()]].mean()
