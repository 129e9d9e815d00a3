"""Surfaces for tests whose geometry can be computed by hand."""

from __future__ import annotations

import numpy as np

from course_lib.simulate import shapes
from course_lib.simulate.scenes import Surface


def grey(value: int = 128) -> np.ndarray:
    return np.full((4, 4, 3), value, np.uint8)


def upright_wall(y: float, half: float = 4.0, picture: np.ndarray | None = None, name: str = "wall") -> Surface:
    """A square wall in the plane y that faces -y, its middle at the origin's height."""
    patch = shapes.rectangle((-half, y, half), (2 * half, 0, 0), (0, 0, -2 * half), step=1.0)
    return Surface(name, patch, grey() if picture is None else picture)
