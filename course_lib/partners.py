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

SAMPLE = 2000  # points that tell how far a step moved


class Partners:
    """The nearest target point of each source point, asked for again only where it may have changed.

    A query can also tell the distance d2 of the second nearest. While a point has moved by less than (d2 − d1) / 2
    since, no other target point can have come nearer than its partner; so late steps, which move little, ask for few.
    Early ones move nearly every point farther than that, and do not ask for the second.

    Attributes
    ----------
    moved : (N, 3) where the source lies.
    points, normals : (N, 3) its partners and their normals; of no meaning where there is none.
    """

    def __init__(
        self, target: NDArray[np.float64], normals: NDArray[np.float64] | None, source: NDArray[np.float64]
    ) -> None:
        self.near = Neighbours(target)
        self.moved = self._source = source
        self.points = np.zeros_like(source)
        self.normals = None if normals is None else np.zeros_like(source)
        self._sorted_normals = None if normals is None else normals[self.near.order]
        self._asked = np.full_like(source, np.inf)  # where each point lay when it was asked for
        self._none = np.zeros(len(source), dtype=bool)  # that have no partner within twice the radius
        self._slack = np.full(len(source), -1.0)  # how far it may move before it has to be asked for again
        self._usual_slack = np.inf
        self._radius = 0.0

    def find(self, T: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
        """Move the source by T, see to its partners, and return the distance (N,) to each; inf where there is none."""
        before, self.moved = self.moved, self._source @ T[:3, :3].T + T[:3, 3]
        if radius > self._radius:
            self._slack[:] = -1.0
            self._radius = radius
        stale = np.flatnonzero(~(_lengths(self.moved - self._asked) < self._slack))
        if len(stale):
            first = not np.isfinite(self._usual_slack)
            some = slice(None, None, max(1, len(self.moved) // SAMPLE))
            small = first or np.median(_lengths(self.moved[some] - before[some])) < self._usual_slack
            self._ask(stale if len(stale) < len(self.moved) else slice(None), 2 if small else 1)
            if first:
                self._usual_slack = float(np.median(self._slack))
        distance = _lengths(self.moved - self.points)
        distance[self._none] = np.inf
        return distance

    def _ask(self, which: NDArray[np.intp] | slice, k: int) -> None:
        asked, beyond = self.moved[which], 2 * self._radius
        distance, place = self.near.places(asked, min(k, len(self.near)), beyond)
        none = place[:, 0] == len(self.near)
        # a point without a partner within 2 radius has none within 1 radius either while it moves by less than 1
        slack = -1.0 if k == 1 else (np.minimum(distance[:, -1], beyond) - distance[:, 0]) / 2
        if len(self.near) == 1:
            slack = (beyond - distance[:, 0]) / 2
        self._slack[which] = np.where(none, self._radius, slack)
        self._asked[which], self._none[which] = asked, none
        found = np.where(none, 0, place[:, 0])
        self.points[which] = self.near.sorted[found]
        if self.normals is not None:
            self.normals[which] = self._sorted_normals[found]


def _lengths(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
