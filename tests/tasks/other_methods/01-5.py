import numpy as np


def flying_pixels(depth):
    """Surfaces are grown from pixel to pixel; what belongs to a piece of fewer than eight pixels flies.

    Compared is 1 / depth, in which this noise has one spread everywhere: 0.006.
    """
    h, w = depth.shape
    inverse = np.pad(np.where(depth > 0, 1 / np.maximum(depth, 0.1), np.inf), 1, constant_values=np.inf)
    middle = inverse[1:-1, 1:-1]
    around = [(i, j) for i in range(3) for j in range(3)]
    with np.errstate(invalid="ignore"):  # hole beside hole
        joined = [np.abs(inverse[i : i + h, j : j + w] - middle) <= 0.018 for i, j in around]
    piece = np.arange(h * w).reshape(h, w)
    while True:
        padded = np.pad(piece, 1)
        grown = [np.where(join, padded[i : i + h, j : j + w], 0) for join, (i, j) in zip(joined, around, strict=True)]
        larger = np.maximum(piece, np.max(grown, axis=0))
        if (larger == piece).all():
            return (depth > 0) & (np.bincount(piece.ravel(), minlength=h * w)[piece] < 8)
        piece = larger
