"""Partners in registration: the nearest target point of each source point, kept up to date while the source moves.

References
----------
Greenspan and Godin, A nearest neighbor method for efficient ICP, 3DIM 2001.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from course_lib.neighbours import Neighbours

__all__ = ["Partners"]

RING = 12  # neighbours of a partner that are looked at before the tree is asked
CLOSE = 0.7  # of a ring's usual reach: from farther away it decides nothing
WORTH = 0.25  # share of the source that rings must serve before they are made
BLOCK = 4096  # points that are looked at together; what belongs to them stays in the cache


class Partners:
    """The nearest target point of each source point, asked for again only where it may have changed.

    Two shortcuts, both exact. If the second nearest target point lay at d2 and a point has moved by m since, all but
    its partner are at least d2 − m away: as long as the partner is nearer, it stays. Where it is not, the new one is
    mostly one of the old one's neighbours: their ring holds all target points within r of the old partner, so nothing
    outside is nearer than r − d to a point that lies d from it. Only where this does not decide, the tree is asked.

    Attributes
    ----------
    moved : (N, 3) where the source lies.
    points : (N, 3) its partners; of no meaning where there is none.
    to_planes : whether the target has normals.
    """

    def __init__(
        self, target: NDArray[np.float64], normals: NDArray[np.float64] | None, source: NDArray[np.float64]
    ) -> None:
        self.near = Neighbours(target, asked_often=True)
        self._source = source
        self.moved, self.points = source, np.zeros_like(source)
        self._columns = np.ascontiguousarray(self.near.sorted.T)  # one coordinate after the other: rings gather faster
        self.to_planes = normals is not None
        self._sorted_normals = None if normals is None else normals[self.near.order]
        self._seen = np.full_like(source, np.inf)  # where each point lay when its partner was found
        self._place = np.zeros(len(source), dtype=np.intp)  # its partner in near.sorted
        self._none = np.ones(len(source), dtype=bool)  # that have no partner within twice the radius
        self._others = np.full(len(source), -1.0)  # how far off all other target points were then, at least
        self._radius = 0.0
        some = self.near.sorted[:: max(1, len(self.near) // 500)]
        self._close = CLOSE * float(np.median(self.near.places(some, min(RING + 1, len(self.near)))[0][:, -1]))
        self._rings: tuple[NDArray[np.intp], NDArray[np.float64]] | None = None

    @property
    def normals(self) -> NDArray[np.float64] | None:
        """(N, 3) the normals of the partners, if there are any."""
        return None if self._sorted_normals is None else self._sorted_normals.take(self._place, axis=0)

    def find(self, T: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
        """Move the source by T, see to its partners, and return the distance (N,) to each; inf where there is none."""
        if radius > self._radius:
            self._others[:] = -1.0
            self._radius = radius
        self.moved = self._source @ T[:3, :3].T
        self.moved += T[:3, 3]
        distance = _lengths(self.moved - self.points)
        distance[self._none] = 0.0
        stale = np.flatnonzero(~(distance + _lengths(self.moved - self._seen) < self._others))
        if len(stale):
            off = distance[stale]
            close = (off < self._close) & ~self._none[stale]
            if len(self.near) > RING and (self._rings or np.count_nonzero(close) > WORTH * len(self._source)):
                close[close] = self._look(stale[close], off[close])
                self._ask(stale[~close])
            else:
                self._ask(stale)
            partners = self.near.sorted.take(self._place[stale], axis=0)
            self.points[stale] = partners
            distance[stale] = _lengths(self.moved.take(stale, axis=0) - partners)
        distance[self._none] = np.inf
        return distance

    def _look(self, which: NDArray[np.intp], off: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Find partners among the neighbours of the old ones, `off` away; return for which points that decides."""
        if self._rings is None:
            distance, place = self.near.places(self.near.sorted, RING + 1)
            self._rings = place, distance[:, -1].copy()
        parts = [slice(start, start + BLOCK) for start in range(0, len(which), BLOCK)]
        return np.concatenate([np.zeros(0, dtype=bool), *(self._look_at(which[part], off[part]) for part in parts)])

    def _look_at(self, which: NDArray[np.intp], off: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Do so for one block."""
        rings, reach = self._rings
        old = self._place[which]
        ring, moved = rings.take(old, axis=0), self.moved.take(which, axis=0)
        squared = np.zeros(ring.shape)
        for axis in range(3):
            along = self._columns[axis].take(ring)
            along -= moved[:, axis, None]
            along *= along
            squared += along
        row, column = np.arange(len(which)), squared.argmin(axis=1)
        nearest = np.sqrt(squared[row, column])
        squared[row, column] = np.inf
        beyond = np.minimum(reach[old] - off, np.sqrt(squared.min(axis=1)))
        decided = nearest <= beyond
        self._keep(which[decided], ring[row, column][decided], beyond[decided])
        return decided

    def _ask(self, which: NDArray[np.intp]) -> None:
        """Find partners by the tree."""
        beyond = 2 * self._radius
        distance, place = self.near.places(self.moved.take(which, axis=0), min(2, len(self.near)), beyond)
        none = place[:, 0] == len(self.near)
        others = np.minimum(distance[:, 1], beyond) if len(self.near) > 1 else np.full(len(which), beyond)
        # a point without a partner within 2 radius has none within 1 radius either while it moves by less than 1
        self._keep(which, np.where(none, 0, place[:, 0]), np.where(none, self._radius, others))
        self._none[which] = none

    def _keep(self, which: NDArray[np.intp], place: NDArray[np.intp], others: NDArray[np.float64]) -> None:
        self._seen[which], self._place[which], self._others[which] = self.moved[which], place, others


def _lengths(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
