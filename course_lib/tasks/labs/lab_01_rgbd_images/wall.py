"""A wall with things before it, as a small depth image."""

from __future__ import annotations

import numpy as np

MILLIMETRE = 1e-3


def wall_with_things(rng: np.random.Generator, height: int, width: int, holes: float = 0.05) -> np.ndarray:
    """(height, width) float64 metres, 0 = no data: a slanted wall behind boxes and discs."""
    v, u = np.indices((height, width))
    depth = rng.uniform(2.2, 3.6) + rng.uniform(-0.4, 0.4) * u / width + rng.uniform(-0.4, 0.4) * v / height
    for _ in range(int(rng.integers(3, 6))):
        z = rng.uniform(0.7, 1.9)
        cv, cu, size = rng.uniform(0, height), rng.uniform(0, width), rng.uniform(0.1, 0.25) * height
        box = rng.random() < 0.5
        inside = np.maximum(abs(v - cv), abs(u - cu)) < size if box else np.hypot(v - cv, u - cu) < size
        depth = np.where(inside & (z < depth), z, depth)
    depth[rng.random(depth.shape) < holes] = 0
    return depth
