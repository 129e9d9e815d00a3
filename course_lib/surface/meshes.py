"""Triangle meshes: vertices and the triples of them that make triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from course_lib import checks


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh, checked when it is made.

    Parameters
    ----------
    vertices : (V, 3) float, metres, finite.
    triangles : (T, 3) int32 indices of vertices; counter-clockwise seen from outside.
    colors : (V, 3) uint8 RGB of the vertices, or None.
    normals : (V, 3) float directions of the vertices, or None.

    Raises
    ------
    ValueError
        If shapes or types are wrong, a coordinate is not finite, or an index names no vertex.

    Examples
    --------
    >>> Mesh(np.eye(3), [[0, 1, 2]]).triangles.dtype
    dtype('int32')
    """

    vertices: NDArray[np.floating]
    triangles: NDArray[np.int32]
    colors: NDArray[np.uint8] | None = None
    normals: NDArray[np.floating] | None = None

    def __post_init__(self) -> None:
        vertices = checks.cloud_points(self.vertices, "vertices")
        if not np.isfinite(vertices).all():
            raise ValueError("vertices: some are NaN or infinite; a mesh needs finite vertices.")
        triangles = checks.numbers(self.triangles, "triangles")
        if triangles.dtype.kind not in "iu":
            raise ValueError(f"triangles: expected integer indices, got {triangles.dtype}.")
        if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
            raise ValueError(f"triangles: expected shape (T, 3) with at least one row, got {triangles.shape}.")
        lowest, highest = int(triangles.min()), int(triangles.max())
        if lowest < 0 or highest >= len(vertices):
            wrong = lowest if lowest < 0 else highest
            raise ValueError(
                f"triangles: index {wrong} names no vertex; the {len(vertices)} vertices are 0 to {len(vertices) - 1}."
            )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles.astype(np.int32, copy=False))
        if self.colors is not None:
            object.__setattr__(self, "colors", checks.colors_uint8(self.colors, vertices.shape))
        if self.normals is not None:
            normals = checks.last_axis(self.normals, 3, "normals")
            if normals.shape != vertices.shape:
                raise ValueError(f"normals: expected one a vertex, shape {vertices.shape}, got {normals.shape}.")
            object.__setattr__(self, "normals", normals)

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles)"
