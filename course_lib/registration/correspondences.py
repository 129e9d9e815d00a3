"""Partners in registration: the nearest target point of each source point, kept up to date while the source moves.

References
----------
Greenspan and Godin, A nearest neighbor method for efficient ICP, 3DIM 2001.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from course_lib.cloud.neighbours import Neighbours

__all__ = ["Partners"]

FARTHER = 1.25  # times the radius: so far the tree looks, so that a point that has no partner need not ask every time


class Partners:
    """The nearest target point of each source point, asked for again only where it may have changed.

    If the second nearest target point lay at d2 and a point has moved by m since, all but its partner are at least
    d2 − m away: as long as the partner is nearer, it stays. This is exact; only where it does not decide, the tree is
    asked.

    Points are kept as columns, one coordinate after the other, so that NumPy runs along the points and not across
    three numbers. Products are no matrix products: the threads of a BLAS keep a processor busy for a while after each,
    and the tree needs all of them.

    Attributes
    ----------
    moved : (3, N) where the source lies.
    points : (3, N) its partners; of no meaning where there is none.
    to_planes : whether the target has normals.
    """

    def __init__(
        self, target: NDArray[np.float64], normals: NDArray[np.float64] | None, source: NDArray[np.float64]
    ) -> None:
        self.near = Neighbours(target, asked_often=True)
        self._columns = np.ascontiguousarray(self.near.sorted.T)
        self._source = np.ascontiguousarray(source.T)
        self.moved, self.points = self._source, np.zeros_like(self._source)
        self.to_planes = normals is not None
        self._sorted_normals = None if normals is None else np.ascontiguousarray(normals[self.near.order].T)
        self._seen = np.full_like(self._source, np.inf)  # where each point lay when its partner was found
        self._place = np.zeros(len(source), dtype=np.intp)  # its partner in near.sorted
        self._none = np.ones(len(source), dtype=bool)  # that have no partner within FARTHER radii
        self._others = np.full(len(source), -1.0)  # how far off all other target points were then, at least
        self._radius = 0.0

    @property
    def normals(self) -> NDArray[np.float64] | None:
        """(3, N) the normals of the partners, if there are any."""
        return None if self._sorted_normals is None else self._sorted_normals.take(self._place, axis=1)

    def find(self, T: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
        """Move the source by T, see to its partners, and return the distance (N,) to each; inf where there is none."""
        if radius > self._radius:
            self._others[:] = -1.0
            self._radius = radius
        self.moved = np.einsum("ij,jn->in", T[:3, :3], self._source)
        self.moved += T[:3, 3, None]
        distance = _distances(self.moved, self.points)
        distance[self._none] = 0.0
        stale = np.flatnonzero(~(distance + _distances(self.moved, self._seen) < self._others))
        if len(stale):
            self._ask(stale)
            partners = self._columns.take(self._place.take(stale), axis=1)
            distance[stale] = _distances(self.moved.take(stale, axis=1), partners)
            _put(self.points, stale, partners)
        distance[self._none] = np.inf
        return distance

    def _ask(self, which: NDArray[np.intp]) -> None:
        """Find partners by the tree."""
        beyond = FARTHER * self._radius
        asked = np.ascontiguousarray(self.moved.take(which, axis=1).T)
        distance, place = self.near.places(asked, min(2, len(self.near)), beyond)
        none = place[:, 0] == len(self.near)
        others = np.minimum(distance[:, 1], beyond) if len(self.near) > 1 else np.full(len(which), beyond)
        self._place[which] = np.where(none, 0, place[:, 0])
        others[none] = beyond - self._radius  # a way over which none can come within the radius
        self._others[which] = others
        self._none[which] = none
        _put(self._seen, which, asked.T)


def _put(columns: NDArray[np.float64], which: NDArray[np.intp], values: NDArray[np.float64]) -> None:
    for row, new in zip(columns, values, strict=True):
        row[which] = new


def _distances(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) from column to column."""
    total = np.zeros(p.shape[1])
    for one, other in zip(p, q, strict=True):
        along = one - other
        along *= along
        total += along
    return np.sqrt(total, out=total)
