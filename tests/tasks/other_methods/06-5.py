"""The lesson's recipe in another frame: one level plane after the other is taken away; the lowest of all."""

import numpy as np


def fitted(points):
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    return np.append(normal, -normal @ middle)


def best_level(points, up, threshold, rng):
    """The level plane that most points agree with, and who agrees."""
    a = points[rng.integers(len(points), size=6000)]
    b = points[rng.integers(len(points), size=6000)]
    c = points[rng.integers(len(points), size=6000)]
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    ok = np.abs(normals @ up) > 0.97 * length
    best = np.zeros(len(points), bool)
    for corner, normal in zip(a[ok], normals[ok] / length[ok, None], strict=True):
        agree = np.abs(points @ normal - corner @ normal) <= threshold
        if agree.sum() > best.sum():
            best = agree
    for _ in range(6):
        plane = fitted(points[best])
        best = np.abs(points @ plane[:3] + plane[3]) <= threshold
    return plane, best


def find_plane(points, up, threshold):
    rng = np.random.default_rng(5)
    left, found = points, []
    while len(left) > 0.1 * len(points):
        plane, agree = best_level(left, up, threshold, rng)
        if agree.sum() < 0.09 * len(points):
            break
        found.append((np.mean(left[agree] @ up), tuple(plane)))
        left = left[~agree]
    return np.array(min(found)[1])
