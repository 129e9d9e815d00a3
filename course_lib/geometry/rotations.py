"""The ways to write a rigid motion besides an exact 4x4 matrix: twists (exp and log), quaternions, rounded matrices.

A twist is (v, w): the translation part first, in metres, then the rotation part, in radians. Quaternions are in the
order x, y, z, w. Everything here can be had from `course_lib.geometry.transforms` too.

References
----------
Barfoot, State Estimation for Robotics, 2nd ed., chapter 8. Blanco, A tutorial on SE(3) transformation
parameterizations and on-manifold optimization, arXiv:2103.15980. Shepperd, Quaternion from rotation matrix, Journal of
Guidance and Control 1(3), 1978.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks

# Below this angle (radians) the coefficients of exp and log are taken from their power series, which are exact there.
SMALL_ANGLE = 0.3


def hat(w: ArrayLike) -> NDArray[np.float64]:
    """Return the (3, 3) skew matrix with hat(w) p = w × p, of w (3,).

    Raises
    ------
    ValueError
        If w is not three finite numbers.

    Examples
    --------
    >>> (hat([1, 2, 3]) @ [4, 5, 6]).tolist() == np.cross([1, 2, 3], [4, 5, 6]).tolist()
    True
    """
    x, y, z = checks.vector(w, 3, "w")
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def vee(W: ArrayLike) -> NDArray[np.float64]:
    """Return the (3,) vector of a (3, 3) skew matrix: the inverse of `hat`.

    Raises
    ------
    ValueError
        If W is not a finite skew-symmetric 3x3 matrix.
    """
    W = checks.numbers(W, "W").astype(np.float64)
    if W.shape != (3, 3) or not np.isfinite(W).all():
        raise ValueError(f"W: expected a finite 3x3 matrix, got shape {W.shape}.")
    if np.abs(W + W.T).max() > 1e-9 * max(1.0, np.abs(W).max()):
        raise ValueError("W: the matrix is not skew-symmetric (W^T must be -W).")
    return np.array([W[2, 1], W[0, 2], W[1, 0]])


def exp(twist: ArrayLike) -> NDArray[np.float64]:
    """Turn a twist into a rigid transform: turn about w by |w| radians while moving along v.

    Parameters
    ----------
    twist : (6,) = (v, w): v in metres, w in radians.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If the twist is not six finite numbers.

    References
    ----------
    Barfoot, State Estimation for Robotics, 2nd ed., eq. 8.33–8.36.

    Examples
    --------
    >>> exp([1, 2, 3, 0, 0, 0])[:3, 3].tolist()
    [1.0, 2.0, 3.0]
    """
    twist = checks.vector(twist, 6, "twist")
    v, w = twist[:3], twist[3:]
    angle = float(np.linalg.norm(w))
    W = hat(w)
    a = np.sinc(angle / np.pi)  # sin θ / θ
    b = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2  # (1 − cos θ) / θ², without the cancellation
    q = angle * angle
    if angle < SMALL_ANGLE:
        c = 1 / 6 - q / 120 + q**2 / 5040 - q**3 / 362880 + q**4 / 39916800
    else:
        c = (1 - a) / q
    T = np.eye(4)
    T[:3, :3] += a * W + b * (W @ W)
    T[:3, 3] = v + b * (W @ v) + c * (W @ (W @ v))
    return T


def log(T: ArrayLike) -> NDArray[np.float64]:
    """Turn a rigid transform into its twist: the inverse of `exp` for turns below π, where it is unique.

    Parameters
    ----------
    T : (4, 4) rigid.

    Returns
    -------
    (6,) float64 = (v, w): v in metres, w in radians with |w| ≤ π. At exactly π both signs of w are right; one is given.

    Raises
    ------
    ValueError
        If T is not rigid.

    Notes
    -----
    The rotation goes through its quaternion, whose half angle is read with atan2: exact near 0, where the arc cosine of
    the trace loses half the digits, and near π, where R − Rᵀ vanishes.

    Examples
    --------
    >>> log(exp([0, 0, 0, 0.25, 0, 0])).round(9).tolist()
    [0.0, 0.0, 0.0, 0.25, 0.0, 0.0]
    """
    T = checks.check_rigid(T)
    w = rotation_vector(T[:3, :3])
    angle = float(np.linalg.norm(w))
    W = hat(w)
    q = angle * angle
    if angle < SMALL_ANGLE:
        d = 1 / 12 + q / 720 + q**2 / 30240 + q**3 / 1209600 + q**4 / 47900160
    else:
        d = (1 - 0.5 * angle * np.cos(0.5 * angle) / np.sin(0.5 * angle)) / q
    t = T[:3, 3]
    v = t - 0.5 * (W @ t) + d * (W @ (W @ t))
    return np.concatenate([v, w])


def rotation_vector(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3,) axis times angle (radians, at most π) of a (3, 3) rotation, which is not checked again here."""
    x, y, z, w = _quaternion_xyzw(R)
    sine = float(np.sqrt(x * x + y * y + z * z))  # of half the angle; w is its cosine, never negative
    scale = 2.0 * np.arctan2(sine, w) / sine if sine > 1e-8 else 2.0
    return scale * np.array([x, y, z])


def _quaternion_xyzw(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shepperd's method: the largest of the four components is found first and never divided by."""
    trace = np.trace(R)
    largest = int(np.argmax([R[0, 0], R[1, 1], R[2, 2], trace]))
    if largest == 3:
        q = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 1 + trace])
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q = np.empty(4)
        q[i] = 1 + 2 * R[i, i] - trace
        q[j] = R[j, i] + R[i, j]
        q[k] = R[k, i] + R[i, k]
        q[3] = R[k, j] - R[j, k]
    q /= np.linalg.norm(q)
    return -q if q[3] < 0 else q


def from_quaternion_xyzw(q: ArrayLike, t: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
    """Build a transform from a unit quaternion in the order x, y, z, w (as ROS, TUM files and SciPy write it).

    Parameters
    ----------
    q : (4,) x, y, z, w; normalised here, so that files with four decimals are welcome.
    t : (3,) translation, metres.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If q is not four finite numbers, or its length is not 1 within 1 %.

    Examples
    --------
    >>> bool(np.allclose(from_quaternion_xyzw([0, 0, 0, 1]), np.eye(4)))
    True
    """
    q = checks.vector(q, 4, "q")
    length = float(np.linalg.norm(q))
    if abs(length - 1) > 0.01:
        raise ValueError(f"q: a rotation needs a quaternion of length 1, got {length:.4g}; its columns are x, y, z, w.")
    x, y, z, w = q / length
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = checks.vector(t, 3, "t")
    return T


def to_quaternion_xyzw(T: ArrayLike) -> NDArray[np.float64]:
    """Return the rotation of `T` as a unit quaternion x, y, z, w with w ≥ 0 (q and −q are the same rotation).

    Parameters
    ----------
    T : (4, 4) rigid; the translation is T[:3, 3].

    Returns
    -------
    (4,) float64.

    Raises
    ------
    ValueError
        If T is not rigid.

    Examples
    --------
    >>> to_quaternion_xyzw(np.diag([1.0, -1.0, -1.0, 1.0])).round(9).tolist()
    [1.0, 0.0, 0.0, 0.0]
    """
    return _quaternion_xyzw(checks.check_rigid(T)[:3, :3])


def nearest_rigid(T: ArrayLike) -> NDArray[np.float64]:
    """Return the rigid transform nearest to one that lost digits when it was written to a file.

    Parameters
    ----------
    T : (4, 4), metres; its rotation may miss a true one by 1e-3 in each entry.

    Returns
    -------
    (4, 4) float64: the nearest rotation in the sense of least squares, the translation unchanged.

    Raises
    ------
    ValueError
        If more is wrong than rounding explains.

    References
    ----------
    Golub and Van Loan, Matrix Computations, 4th ed., sec. 6.4.1: the orthogonal Procrustes problem.

    Examples
    --------
    >>> nearest_rigid(np.diag([0.9999, 0.9999, 0.9999, 1.0])).tolist() == np.eye(4).tolist()
    True
    """
    matrix = checks.numbers(T, "T").astype(np.float64)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        return checks.check_rigid(matrix)  # which says what is wrong
    U, _, Vt = np.linalg.svd(matrix[:3, :3])
    rigid = matrix.copy()
    rigid[:3, :3] = U @ Vt
    missed = float(np.abs(rigid - matrix).max())
    if missed > checks.ROUNDED:
        raise ValueError(
            f"T: no rotation is near its upper left 3x3 (the nearest misses by {missed:.3g}), it scales or shears."
        )
    return checks.check_rigid(rigid)
