"""Correspondences in registration: the nearest target point of each source point, kept while the source moves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from course_lib.cloud.neighbours import Neighbours, Trace
from course_lib.registration.pair_sums import moved

__all__ = ["Correspondences"]


class Correspondences:
    """The nearest target point of each source point; the one of the step before says how far to look for it.

    Attributes
    ----------
    moved : (N, 3) where the source lies; found soonest where near points are near each other in the list.
    target, normals : (M, 3) the target in an order of its own, and its normals, or None.
    place : (N,) which target point belongs to each source point; of no meaning where there is none.
    """

    def __init__(
        self, target: NDArray[np.float64], normals: NDArray[np.float64] | None, source: NDArray[np.float64]
    ) -> None:
        self._near, self._trace, self._source = Neighbours(target), Trace.of(len(source)), source
        self.target = self._near.sorted
        self.normals = None if normals is None else normals.take(self._near.order, axis=0)
        self.moved, self.place = source, self._trace.place

    def find(self, T: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
        """Move the source by T, find what belongs to it, and return the distances (N,); inf where there is nothing."""
        self.moved = moved(T, self._source)
        return self._near.follow(self.moved, radius, self._trace)
