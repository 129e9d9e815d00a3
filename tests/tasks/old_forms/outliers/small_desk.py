"""A small desk for lab 05, as points with kinds: quick to draw, and with every kind of outlier of desk_outliers."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

SURFACE, THIN, FLYING, REFLECTION, NOISE = range(1, 6)


def small_desk(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) in metres, shuffled, and their kinds (N,).

    A desk top, a wall behind it, two boxes and a separate tray, 9 mm between points; a rod and a cable, 5 mm between
    points; flying pixels in the air beside edges; a mirrored patch below the desk; single strays and specks of four.
    Noise of 1 mm everywhere.
    """
    step = 0.009

    def sheet(corner, a, b):
        corner, a, b = (np.asarray(v, float) for v in (corner, a, b))
        n, m = (int(np.linalg.norm(v) / step) + 1 for v in (a, b))
        s, t = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, m))
        return corner + s.reshape(-1, 1) * a + t.reshape(-1, 1) * b

    def box(x, y, w, d, h):
        return [
            sheet((x, y, h), (w, 0, 0), (0, d, 0)),
            sheet((x, y, 0), (w, 0, 0), (0, 0, h)),
            sheet((x, y, 0), (0, d, 0), (0, 0, h)),
        ]

    def chain(start, end, sag=0.0):
        start, end = np.asarray(start, float), np.asarray(end, float)
        n = int(np.linalg.norm(end - start) / 0.005) + 1
        s = np.linspace(0, 1, n)[:, None]
        return start + s * (end - start) - sag * 4 * s * (1 - s) * (0, 0, 1.0)

    w, d = rng.uniform(0.75, 0.85), rng.uniform(0.42, 0.5)
    x1, x2 = rng.uniform(0.08, 0.15), rng.uniform(0.5, 0.58)
    h1, h2 = rng.uniform(0.08, 0.14, 2)
    surfaces = [
        sheet((0, 0, 0), (w, 0, 0), (0, d, 0)),
        sheet((0, d, 0), (w, 0, 0), (0, 0, 0.35)),
        *box(x1, 0.22, 0.16, 0.1, h1),
        *box(x2, 0.20, 0.14, 0.12, h2),
        sheet((w + 0.08, 0.05, 0.02), (0.16, 0, 0), (0, 0.2, 0)),
    ]
    rod = chain((0.38, 0.3, 0.0), (0.38, 0.3, 0.32))
    cable = chain((0.02, 0.1, 0.3), (0.3, 0.08, 0.002), sag=0.05)
    thin = np.concatenate([rod, cable])
    edge = np.concatenate([chain((x1, 0.22, h1), (x1 + 0.16, 0.22, h1)), chain((x2, 0.2, h2), (x2 + 0.14, 0.2, h2))])
    count = 150
    # away from the edge, along the line of sight, into the air behind it
    flying = edge[rng.integers(len(edge), size=count)] + rng.uniform(0.022, 0.16, count)[:, None] * (0, 0.8, 0.6)
    corner = (rng.uniform(0.1, 0.5), rng.uniform(0.05, 0.2), -rng.uniform(0.2, 0.3))
    mirrored = sheet(corner, (rng.uniform(0.10, 0.13), 0, 0), (0, 0.09, -0.05))
    low, high = (-0.1, -0.1, -0.35), (w + 0.3, d + 0.1, 0.5)
    strays = rng.uniform(low, high, (90, 3))
    specks = np.repeat(rng.uniform(low, high, (20, 3)), 4, axis=0) + rng.normal(0, 0.003, (80, 3))
    wrong = np.concatenate([strays, specks])
    surface = np.concatenate(surfaces)
    true = np.concatenate([surface, thin])
    # a stray that happens to lie on something is a point of it
    wrong = wrong[cKDTree(true).query(wrong)[0] >= 0.025]
    parts = [surface, thin, flying, mirrored, wrong]
    points = np.concatenate(parts) + rng.normal(0, 0.001, (sum(map(len, parts)), 3))
    kinds = np.repeat([SURFACE, THIN, FLYING, REFLECTION, NOISE], list(map(len, parts)))
    order = rng.permutation(len(points))
    return points[order], kinds[order]
