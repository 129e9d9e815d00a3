"""Registration: the rigid motion that brings one cloud onto another, by iterated closest points.

`T_target_source` maps source to target coordinates. One step pairs each source point with the nearest target
point and moves the source so that the pairs come together: exactly, for the distance from point to point; linearised,
for the distance from a point to the plane through its partner. Steps are repeated until nothing moves.

References
----------
Besl and McKay, A method for registration of 3-D shapes, PAMI 14(2), 1992; Chen and Medioni, Object modelling by
registration of multiple range images, Image and Vision Computing 10(3), 1992; Rusinkiewicz and Levoy, Efficient
variants of the ICP algorithm, 3DIM 2001.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.checks import finite_points
from course_lib.cloud.grid import order_in_space
from course_lib.geometry import rotations, transforms
from course_lib.registration.correspondences import Correspondences
from course_lib.registration.pair_sums import pair_sums, plane_sums
from course_lib.registration.robust import KERNELS, robust_weights

__all__ = ["IcpResult", "IcpStep", "fit_rigid", "fit_rigid_to_planes", "icp"]

RANK = 1e-9  # directions whose squared singular value is this share of the largest are not decided by the pairs


@dataclass(frozen=True)
class IcpStep:
    """One step: what was paired before it, and how far it moved."""

    radius: float  # pairs farther apart did not count, metres
    pairs: int
    rmse: float  # of the distances of the pairs, metres
    rotation: float  # of the step, radians
    translation: float  # of the step, metres


@dataclass(frozen=True, eq=False)
class IcpResult:
    """What came of a registration.

    Attributes
    ----------
    T_target_source : (4, 4) float64.
    fitness : share of *source* points that have a target point within the last radius. It says nothing of correctness.
    rmse : root mean square distance of these pairs, metres, point to point whatever was minimised.
    steps : one entry a step.
    converged : whether the last step moved less than asked; False if the steps ran out.
    """

    T_target_source: NDArray[np.float64]
    fitness: float
    rmse: float
    steps: tuple[IcpStep, ...]
    converged: bool


def fit_rigid(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> NDArray[np.float64]:
    """Return the rigid motion of least squared distances between pairs of points.

    Parameters
    ----------
    source, target : (N, 3) float, finite; row i of one belongs to row i of the other.
    weights : (N,) non-negative, or None for all alike.

    Returns
    -------
    (4, 4) T_target_source, a rotation and a translation; never a reflection.

    Raises
    ------
    ValueError
        If the shapes differ, or there are fewer than 3 pairs, or they lie on a line, about which the turn is not known.

    References
    ----------
    Arun, Huang and Blostein, Least-squares fitting of two 3-D point sets, PAMI 9(5), 1987; the guard against
    reflections: Umeyama, PAMI 13(4), 1991.

    Examples
    --------
    >>> T = fit_rigid([[1, 0, 0], [0, 1, 0], [0, 0, 0]], [[0, 1, 5], [-1, 0, 5], [0, 0, 5]])
    >>> (np.round(T, 9)[:3] + 0).tolist()
    [[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 5.0]]
    """
    p, q, w = _pairs(source, target, weights)
    if len(p) < 3:
        raise ValueError(f"source: a rigid motion needs 3 pairs of points, there are {len(p)}.")
    start_p, start_q = np.eye(4), np.eye(4)
    start_p[:3, 3], start_q[:3, 3] = -p[0], q[0]  # about one of the points, so that sums of products keep their digits
    T = _rigid_of(pair_sums(p - p[0], q - q[0], np.arange(len(p)), w))
    if T is None:
        raise ValueError("source: the points lie on a line (or are all equal), and any turn about it fits as well.")
    return transforms.compose(start_q, T, start_p)


def _rigid_of(sums: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The motion from p to q, from `pair_sums` about some point near them; None where the pairs leave a turn open."""
    total = sums[3, 3]
    mean_p, mean_q = sums[3, :3] / total, sums[:3, 3] / total
    U, s, Vt = np.linalg.svd(sums[:3, :3] - total * np.outer(mean_q, mean_p))
    if s[1] <= RANK * s[0] or s[0] == 0:
        return None
    guard = np.diag([1.0, 1.0, np.sign(np.linalg.det(U) * np.linalg.det(Vt))])
    T = np.eye(4)
    T[:3, :3] = U @ guard @ Vt
    T[:3, 3] = mean_q - T[:3, :3] @ mean_p
    return T


def fit_rigid_to_planes(
    source: ArrayLike, target: ArrayLike, normals: ArrayLike, weights: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Return the rigid motion that brings points closer to the planes through their partners; one linearised step.

    Parameters
    ----------
    source, target : (N, 3) float, finite; row i of one belongs to row i of the other.
    normals : (N, 3) unit normals at the target points.
    weights : (N,) non-negative, or None.

    Returns
    -------
    (4, 4) T_target_source. Directions that no plane decides (sliding along one plane) stay as they are.

    Raises
    ------
    ValueError
        If the shapes differ or there are fewer than 6 pairs.

    References
    ----------
    Low, Linear least-squares optimization for point-to-plane ICP surface registration, UNC TR04-004, 2004.
    """
    p, q, w = _pairs(source, target, weights)
    n = checks.last_axis(normals, 3, "normals").astype(np.float64)
    if n.shape != q.shape:
        raise ValueError(f"normals: expected one a target point, shape {q.shape}, got {n.shape}.")
    if not (np.abs(np.linalg.norm(n, axis=1) - 1) < 1e-3).all():
        raise ValueError("normals: some are NaN or not of length 1; leave those pairs out.")
    if len(p) < 6:
        raise ValueError(f"source: a step to planes has 6 unknowns and needs 6 pairs, there are {len(p)}.")
    about = np.eye(4)  # about one of the points, as in `fit_rigid`
    about[:3, 3] = p[0]
    step = _to_planes_of(*plane_sums(p - p[0], q - p[0], n, np.arange(len(p)), w))
    return transforms.compose(about, step, transforms.invert(about))


def _to_planes_of(sums: NDArray[np.float64], middle: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """One step from p to the planes at q, from `plane_sums`."""
    # about the middle of the points and in their size, so that turns and shifts are numbers of one kind:
    # (p - c) x n = p x n - c x n
    change = np.eye(6)
    change[:3, 3:] = -rotations.hat(middle)
    change[:3] /= size
    values, vectors = np.linalg.eigh(change @ sums[:6, :6] @ change.T)
    kept = values > RANK * values[-1]
    step = vectors[:, kept] @ ((vectors[:, kept].T @ (change @ sums[:6, 6])) / values[kept])
    T = np.eye(4)
    T[:3, :3] = rotations.exp(np.concatenate([np.zeros(3), step[:3] / size]))[:3, :3]
    T[:3, 3] = middle + step[3:] - T[:3, :3] @ middle
    return T


def icp(
    source: ArrayLike,
    target: ArrayLike,
    radius: float | Sequence[float],
    normals: ArrayLike | None = None,
    initial: ArrayLike | None = None,
    steps: int = 50,
    tolerance: float = 1e-7,
    keep: float = 1.0,
    kernel: str = "none",
) -> IcpResult:
    """Register a source cloud to a target cloud.

    Parameters
    ----------
    source, target : (N, 3), (M, 3) float, metres, finite.
    radius : pairs farther apart do not count, metres. Several: each in turn, from coarse to fine, the last one last.
    normals : (M, 3) unit normals of the target: then distances are measured to planes, else to points. A target point
        whose normal is NaN or not of length 1 is not used.
    initial : (4, 4) T_target_source to begin with; None for the identity.
    steps : at most so many for each radius.
    tolerance : done when a step turns by less than this (radians) and shifts by less than this (metres); 0 for never.
    keep : share of the pairs that count, the nearest ones (trimming), in (0, 1].
    kernel : "none"; or weights for the distances, "huber" or "tukey", scaled by 1.4826 times their median.

    Returns
    -------
    IcpResult

    Raises
    ------
    ValueError
        If an argument is of another form; if no pairs, or too few, lie within the radius.

    Examples
    --------
    >>> grid = np.stack(np.meshgrid(range(5), range(5), [0, 1]), axis=-1).reshape(-1, 3) * 1.0
    >>> result = icp(grid + [0.1, 0, 0], grid, radius=0.5)
    >>> (np.round(result.T_target_source[:3, 3], 6) + 0).tolist(), result.fitness
    ([-0.1, 0.0, 0.0], 1.0)
    """
    p, n = finite_points(source, "source"), None
    q = finite_points(target, "target")
    if normals is not None:
        n = checks.last_axis(normals, 3, "normals").astype(np.float64)
        if n.shape != q.shape:
            raise ValueError(f"normals: expected one a target point, shape {q.shape}, got {n.shape}.")
        used = np.abs(np.linalg.norm(n, axis=1) - 1) < 1e-3  # NaN is not
        if not used.any():
            raise ValueError("normals: all of them are NaN or not of length 1; estimate them, or do without.")
        q, n = q[used], n[used]
    if not 0 < checks.number(keep, "keep") <= 1:
        raise ValueError(f"keep: expected a share of the pairs in (0, 1], got {keep!r}.")
    if kernel not in KERNELS:
        raise ValueError(f"kernel: {kernel!r} is unknown; {checks.nearest_name(kernel, KERNELS)}")
    steps = checks.whole(steps, "steps")
    T = np.eye(4) if initial is None else checks.check_rigid(initial, "initial")
    radii = [checks.number(each, "radius") for each in np.atleast_1d(np.asarray(radius, dtype=object))]
    if not radii or min(radii) <= 0:
        raise ValueError("radius: expected a positive distance in metres, or several.")
    middle = np.eye(4)  # all is done about the middle of the target, so that no digits are lost far from the origin
    middle[:3, 3] = q.mean(axis=0)
    T = transforms.compose(transforms.invert(middle), T, middle)
    partners = Correspondences(q - middle[:3, 3], n, p.take(order_in_space(p), axis=0) - middle[:3, 3])
    still, done = False, list[IcpStep]()
    for reach in radii:
        for _ in range(steps):
            step, entry = _step(partners, T, reach, keep, kernel)
            T = step @ T
            done.append(entry)
            still = max(entry.rotation, entry.translation) < tolerance
            if still:
                break
    distance = partners.find(T, radii[-1])
    inside = distance <= radii[-1]
    rmse = float(np.sqrt(np.mean(distance[inside] ** 2))) if inside.any() else float("nan")
    T = transforms.compose(middle, T, transforms.invert(middle))
    return IcpResult(T, float(inside.mean()), rmse, tuple(done), still)


def _step(
    partners: Correspondences, T: NDArray[np.float64], radius: float, keep: float, kernel: str
) -> tuple[NDArray[np.float64], IcpStep]:
    """Pair, reject, weigh, fit: one step from where the source lies now."""
    distance = partners.find(T, radius)
    weight = (distance <= radius).astype(np.float64)
    found = paired = np.flatnonzero(weight)
    if keep < 1 and len(found):
        found = found[np.argsort(distance[found], kind="stable")[: max(1, round(keep * len(found)))]]
        weight[:] = 0.0
        weight[found] = 1.0
    p, q, normals, place = partners.moved, partners.target, partners.normals, partners.place
    least = 3 if normals is None else 6
    if len(found) < least:
        raise ValueError(
            f"radius: {len(paired)} source points have a target point within {radius:g} m, {len(found)} of them "
            f"are kept, and a step needs {least}; begin nearer, or with a larger radius or keep."
        )
    distance = distance.take(found)
    if kernel != "none":
        off = distance
        if normals is not None:
            which = place.take(found)
            off = np.einsum("ni,ni->n", q.take(which, axis=0) - p.take(found, axis=0), normals.take(which, axis=0))
        weight[found] = robust_weights(np.abs(off), kernel)
    if normals is None:
        sums = pair_sums(p, q, place, weight)
        middle, step = sums[3, :3] / sums[3, 3], _rigid_of(sums)
        if step is None:
            raise ValueError("source: its paired points lie on a line, and any turn about it fits as well.")
    else:
        planes, middle, size = plane_sums(p, q, normals, place, weight)
        step = _to_planes_of(planes, middle, size)
    angle = float(np.arccos(np.clip((np.trace(step[:3, :3]) - 1) / 2, -1, 1)))
    shift = float(np.linalg.norm(step[:3, :3] @ middle + step[:3, 3] - middle))
    return step, IcpStep(radius, len(found), float(np.sqrt((distance * distance).mean())), angle, shift)


def _pairs(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None) -> tuple[NDArray[np.float64], ...]:
    p, q = finite_points(source, "source"), finite_points(target, "target")
    if p.shape != q.shape:
        raise ValueError(f"target: expected as many points as in the source, {len(p)}, got {len(q)}.")
    if weights is None:
        return p, q, np.ones(len(p))
    w = checks.vector(weights, len(p), "weights")
    if (w < 0).any() or w.sum() <= 0:
        raise ValueError("weights: expected numbers of at least 0, not all of them 0.")
    return p, q, w
