"""What a scene is made of: surfaces with names and pictures, lights, and the ray caster over all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
import open3d as o3d

from course_lib.simulate.atlas import Atlas
from course_lib.simulate.lighting import Light, brightness, displayed, linear
from course_lib.simulate.shapes import Patch, Solid
from course_lib.surface.meshes import Mesh

NOTHING = "nothing"
_FINE, _COARSE = 0.02, 0.08  # metres between points at which light is computed


@dataclass(frozen=True)
class Surface:
    """A piece of an object.

    Parameters
    ----------
    name : the object that it belongs to, e.g. "table"; all surfaces of one name share a label.
    shape : in world coordinates; a Patch, or a Solid.
    paint : for a Patch a picture (h, w, 3) uint8 that covers it; for a Solid vertex colours (V, 3) uint8.
    glow : 0 for a lit surface; more for one that shines by itself: its paint times ``glow``, and without a shadow.
    detail : how much finer than usual its light is computed, e.g. where small things cast shadows on it.
    two_sided : True for something thin, such as a leaf, that is lit from whichever side gets more.
    """

    name: str
    shape: Patch | Solid
    paint: np.ndarray
    glow: float = 0.0
    detail: float = 1.0
    two_sided: bool = False

    def __post_init__(self) -> None:
        paint = np.asarray(self.paint)
        wanted = "(h, w, 3)" if isinstance(self.shape, Patch) else f"({len(self.shape.vertices)}, 3)"
        fits = paint.ndim == 3 if isinstance(self.shape, Patch) else paint.shape == self.shape.vertices.shape
        if paint.dtype != np.uint8 or paint.shape[-1] != 3 or not fits:
            was = f"{paint.dtype} {paint.shape}"
            raise ValueError(f"The paint of surface {self.name!r} must be uint8 {wanted}, not {was}.")

    def flat(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertices (V, 3), normals (V, 3), triangles (T, 3)."""
        if isinstance(self.shape, Solid):
            return self.shape.vertices, self.shape.normals, self.shape.triangles
        return self.shape.points.reshape(-1, 3), self.shape.normals.reshape(-1, 3), self.shape.triangles()


@dataclass(frozen=True, eq=False)
class Scene:
    """A world of surfaces, lit.

    Parameters
    ----------
    surfaces : at least one.
    lights, ambient : see `course_lib.simulate.lighting`; without lights, everything is shown evenly in its own colours.
    views : named camera poses T_world_camera that are worth seeing.
    unmeasurable : names of objects that a stereo depth camera cannot measure (shining, mirroring).
    """

    surfaces: Sequence[Surface]
    lights: Sequence[Light] = ()
    ambient: tuple[float, float, float] = (0.3, 0.3, 0.3)
    views: Mapping[str, np.ndarray] = field(default_factory=dict)
    unmeasurable: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.surfaces:
            raise ValueError("A scene needs at least one surface; give a list of Surface objects.")
        if len(self.label_names) > 255:
            raise ValueError("A scene can name at most 254 objects; give several surfaces the same name.")

    @cached_property
    def label_names(self) -> tuple[str, ...]:
        """Names by label; label 0 is "nothing"."""
        return (NOTHING, *dict.fromkeys(surface.name for surface in self.surfaces))

    def label(self, name: str) -> int:
        """The label of an object by its name."""
        if name not in self.label_names:
            raise ValueError(f"There is no object {name!r} in this scene; there are {', '.join(self.label_names[1:])}.")
        return self.label_names.index(name)

    @cached_property
    def _pieces(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        return [surface.flat() for surface in self.surfaces]

    @cached_property
    def _starts(self) -> np.ndarray:
        return np.cumsum([0] + [len(vertices) for vertices, _, _ in self._pieces])

    @cached_property
    def triangle_surface(self) -> np.ndarray:
        """(T,) int32: the surface that each triangle belongs to."""
        counts = [len(triangles) for _, _, triangles in self._pieces]
        return np.repeat(np.arange(len(counts), dtype=np.int32), counts)

    @cached_property
    def triangles(self) -> np.ndarray:
        """(T, 3) int32 indices of vertices."""
        starts = self._starts[:-1]
        return np.concatenate([p[2] + start for p, start in zip(self._pieces, starts, strict=True)]).astype(np.int32)

    @cached_property
    def caster(self) -> o3d.t.geometry.RaycastingScene:
        """Open3D's ray caster over all triangles, numbered as in ``triangles``."""
        return _caster(np.concatenate([p[0] for p in self._pieces]), self.triangles)

    @cached_property
    def surface_label(self) -> np.ndarray:
        """(S,) uint8: the label of each surface."""
        return np.array([self.label_names.index(surface.name) for surface in self.surfaces], np.uint8)

    @cached_property
    def picture_map(self) -> np.ndarray:
        """(T, 6) float32: where each triangle lies in its surface's picture, 0 to 1: the place (2) of its first corner,
        then the ways (2 each) from there to its second and third."""
        grids = []
        for surface, (vertices, _, _) in zip(self.surfaces, self._pieces, strict=True):
            uv = np.zeros((len(vertices), 2), np.float32)
            if isinstance(surface.shape, Patch):
                rows, columns = surface.shape.points.shape[:2]
                v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
                uv = np.stack([u, v], -1).reshape(-1, 2).astype(np.float32)
            grids.append(uv)
        a, b, c = (np.concatenate(grids)[self.triangles[:, k]] for k in range(3))
        return np.concatenate([a, b - a, c - a], 1)

    @cached_property
    def is_solid(self) -> np.ndarray:
        """(S,) bool: which surfaces are solids, coloured at their vertices."""
        return np.array([isinstance(surface.shape, Solid) for surface in self.surfaces])

    @cached_property
    def texel(self) -> np.ndarray:
        """(S,) float32: the edge of a picture element on each surface, metres; 0 where colours belong to vertices."""
        out = np.zeros(len(self.surfaces), np.float32)
        for number, surface in enumerate(self.surfaces):
            if isinstance(surface.shape, Patch):
                p = surface.shape.points
                across, down = np.diff(p, axis=1)[:-1], np.diff(p, axis=0)[:, :-1]
                area = np.linalg.norm(np.cross(across, down), axis=-1).sum()
                out[number] = np.sqrt(area / (surface.paint.shape[0] * surface.paint.shape[1]))
        return out

    @cached_property
    def _lit(self) -> list[np.ndarray]:
        """The paint of each surface as it looks in this light (uint8)."""
        if not self.lights:
            return [np.asarray(surface.paint) for surface in self.surfaces]
        dark = [n for n, surface in enumerate(self.surfaces) if not surface.glow]
        keep = np.isin(self.triangle_surface, dark)
        shadows = _caster(np.concatenate([p[0] for p in self._pieces]), self.triangles[keep])
        samples = [_light_points(surface) for surface in self.surfaces]
        flat = [(p.reshape(-1, 3), n.reshape(-1, 3)) for p, n in samples]
        points, normals = (np.concatenate([pair[k] for pair in flat]) for k in (0, 1))
        light = brightness(shadows, points, normals, self.lights, self.ambient)
        thin = np.repeat([s.two_sided for s in self.surfaces], [len(p) for p, _ in flat])
        if thin.any():
            behind = brightness(shadows, points[thin], -normals[thin], self.lights, self.ambient)
            light[thin] = np.maximum(light[thin], 0.8 * behind)
        parts = np.split(light, np.cumsum([len(p) for p, _ in flat])[:-1])
        return [
            _painted(surface, part.reshape(p.shape))
            for surface, part, (p, _) in zip(self.surfaces, parts, samples, strict=True)
        ]

    @cached_property
    def atlas(self) -> Atlas:
        """The lit pictures of all patches (one grey dot stands for each solid)."""
        dot = np.full((1, 1, 3), 128, np.uint8)
        return Atlas([lit if lit.ndim == 3 else dot for lit in self._lit])

    @cached_property
    def vertex_colors(self) -> np.ndarray:
        """(V, 3) uint8: lit colours of solids' vertices; on patches the average of the picture around the vertex."""
        out = []
        for surface, lit in zip(self.surfaces, self._lit, strict=True):
            if isinstance(surface.shape, Patch):
                rows, columns = surface.shape.points.shape[:2]
                lit = cv2.resize(lit, (columns, rows), interpolation=cv2.INTER_AREA).reshape(-1, 3)
            out.append(lit)
        return np.concatenate(out)

    def mesh(self, *names: str) -> Mesh:
        """The true surface as one mesh, in world coordinates, with colours and normals; of the named objects or of all.

        Raises
        ------
        ValueError
            If there is no object of such a name.
        """
        return self.labelled_mesh(*names)[0]

    def labelled_mesh(self, *names: str) -> tuple[Mesh, np.ndarray]:
        """As `mesh`, with the label of each vertex, (V,) uint8."""
        wanted = [self.label(name) for name in names]
        triangles = self.triangles
        if names:
            triangles = triangles[np.isin(self.surface_label[self.triangle_surface], wanted)]
        used, triangles = np.unique(triangles, return_inverse=True)
        vertices, normals = (np.concatenate([p[k] for p in self._pieces])[used] for k in (0, 1))
        labels = np.repeat(self.surface_label, [len(piece[0]) for piece in self._pieces])[used]
        return Mesh(vertices, triangles.reshape(-1, 3).astype(np.int32), self.vertex_colors[used], normals), labels


def _caster(vertices: np.ndarray, triangles: np.ndarray) -> o3d.t.geometry.RaycastingScene:
    caster = o3d.t.geometry.RaycastingScene()
    caster.add_triangles(
        o3d.core.Tensor(np.ascontiguousarray(vertices, np.float32)),
        o3d.core.Tensor(np.ascontiguousarray(triangles, np.uint32)),
    )
    return caster


def _light_points(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Where to compute the light of a surface: (rows, columns, 3) points and normals, or (V, 3) of a solid."""
    if isinstance(surface.shape, Solid):
        return surface.shape.vertices, surface.shape.normals
    p, n = surface.shape.points, surface.shape.normals
    sides = [np.linalg.norm(np.diff(p, axis=axis), axis=-1).sum(axis=axis).max() for axis in (0, 1)]
    step = np.clip(max(np.sqrt(sides[0] * sides[1]) / 14, max(sides) / 30) / surface.detail, _FINE, _COARSE)
    rows, columns = (int(np.clip(np.ceil(side / step), 2, 160)) for side in sides)
    at = [(np.arange(count) + 0.5) / count * (size - 1) for count, size in ((rows, p.shape[0]), (columns, p.shape[1]))]
    i, j = (np.minimum(a.astype(int), size - 2) for a, size in zip(at, p.shape[:2], strict=True))
    a, b = (at[0] - i)[:, None, None], (at[1] - j)[None, :, None]

    def between(grid: np.ndarray) -> np.ndarray:
        upper = (1 - b) * grid[i][:, j] + b * grid[i][:, j + 1]
        lower = (1 - b) * grid[i + 1][:, j] + b * grid[i + 1][:, j + 1]
        return (1 - a) * upper + a * lower

    normals = between(n)
    return between(p), normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)


def _painted(surface: Surface, light: np.ndarray) -> np.ndarray:
    paint = linear(surface.paint)
    if surface.glow:
        return displayed(paint * np.float32(surface.glow))
    if isinstance(surface.shape, Patch):
        light = cv2.resize(light, (paint.shape[1], paint.shape[0]), interpolation=cv2.INTER_LINEAR)
    return displayed(paint * light)
