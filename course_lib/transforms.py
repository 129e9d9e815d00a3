"""Rigid transforms in 3D, the group SE(3), as 4x4 matrices.

`T_a_b` maps coordinates of frame b to coordinates of frame a: p_a = T_a_b p_b, so T_a_c = T_a_b T_b_c reads like
dominoes. Cameras look along +z with x right and y down; the world has z up. Angles are radians unless the name says
degrees; lengths are metres. A twist is (v, w): the translation part first, then the rotation part.

References
----------
Barfoot, State Estimation for Robotics, 2nd ed., chapter 8. Blanco, A tutorial on SE(3) transformation parameterizations
and on-manifold optimization, arXiv:2103.15980. Eade, Lie groups for 2D and 3D transformations, 2017.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks

FloatArray = NDArray[np.floating]

# How far a matrix may be from rigid: single precision and files with six decimals pass, anything scaled or sheared fails.
RIGID_TOLERANCE = 1e-4
# Below this angle (radians) the coefficients of exp and log are taken from their power series, which are exact there.
SMALL_ANGLE = 0.3


@dataclass(frozen=True)
class PoseError:
    """How far a pose is from the true one: the angle in degrees and the distance of the origins in metres."""

    degrees: float
    metres: float


def check_rigid(T: ArrayLike, name: str = "T") -> NDArray[np.float64]:
    """Return `T` as float64 if it is a rigid transform, else raise.

    Parameters
    ----------
    T : (4, 4) rotation and translation in metres, last row 0 0 0 1.
    name : what the sentence calls it.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If the shape, the last row, the lengths and angles, or the handedness is not that of a rigid transform.

    Examples
    --------
    >>> check_rigid(np.diag([2.0, 2.0, 2.0, 1.0]))
    Traceback (most recent call last):
    ValueError: T: the upper left 3x3 is not a rotation (R^T R differs from I by 3); it scales or shears.
    """
    matrix = checks.numbers(T, name).astype(np.float64)
    if matrix.shape != (4, 4):
        raise ValueError(f"{name}: expected a 4x4 matrix, got shape {matrix.shape}.")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name}: the matrix holds NaN or infinity; a rigid transform is finite.")
    if not np.allclose(matrix[3], [0, 0, 0, 1], rtol=0, atol=RIGID_TOLERANCE):
        transposed = " (it looks transposed: translation belongs in the last column)" if matrix[3, :3].any() else ""
        raise ValueError(f"{name}: the last row must be 0 0 0 1, got {matrix[3].tolist()}{transposed}.")
    _check_rotation(matrix[:3, :3], name)
    return matrix


def _check_rotation(R: NDArray[np.float64], name: str) -> None:
    error = float(np.abs(R.T @ R - np.eye(3)).max())
    if error > RIGID_TOLERANCE:
        raise ValueError(
            f"{name}: the upper left 3x3 is not a rotation (R^T R differs from I by {error:.3g}); it scales or shears."
        )
    if np.linalg.det(R) < 0:
        raise ValueError(f"{name}: the upper left 3x3 is a reflection (determinant -1), not a rotation; flip one axis.")


def from_rotation_translation(R: ArrayLike, t: ArrayLike) -> NDArray[np.float64]:
    """Build the 4x4 matrix of p ↦ R p + t.

    Parameters
    ----------
    R : (3, 3) rotation.
    t : (3,) translation, metres.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If R is not a rotation or t not three finite numbers.

    Examples
    --------
    >>> from_rotation_translation(np.eye(3), [1, 2, 3])[:3, 3].tolist()
    [1.0, 2.0, 3.0]
    """
    rotation = checks.numbers(R, "R").astype(np.float64)
    if rotation.shape != (3, 3):
        raise ValueError(f"R: expected a 3x3 rotation, got shape {rotation.shape}.")
    if not np.isfinite(rotation).all():
        raise ValueError("R: the rotation holds NaN or infinity.")
    _check_rotation(rotation, "R")
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = checks.vector(t, 3, "t")
    return T


def compose(*Ts: ArrayLike) -> NDArray[np.float64]:
    """Chain transforms: `compose(T_a_b, T_b_c)` is T_a_c.

    Parameters
    ----------
    *Ts : (4, 4) each, at least one; the rightmost is applied first.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If there is none, or one is not rigid.

    Examples
    --------
    >>> T = compose(rotation_z(np.pi / 2), from_rotation_translation(np.eye(3), [1, 0, 0]))
    >>> apply(T, [0.0, 0.0, 0.0]).round(9).tolist()
    [0.0, 1.0, 0.0]
    """
    if not Ts:
        raise ValueError("compose needs at least one transform.")
    product = check_rigid(Ts[0], "transform 1")
    for index, T in enumerate(Ts[1:], start=2):
        product = product @ check_rigid(T, f"transform {index}")
    return product


def invert(T: ArrayLike) -> NDArray[np.float64]:
    """Invert a rigid transform: `invert(T_a_b)` is T_b_a, with rotation Rᵀ and translation −Rᵀ t (not −t).

    Parameters
    ----------
    T : (4, 4) rigid.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If T is not rigid.
    """
    T = check_rigid(T)
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse


def apply(T: ArrayLike, points: ArrayLike) -> FloatArray:
    """Move points: `apply(T_a_b, points_b)` gives the same points in frame a.

    Parameters
    ----------
    T : (4, 4) rigid.
    points : (..., 3), metres; a row with a NaN stays NaN.

    Returns
    -------
    (..., 3), metres; float32 in gives float32 out, everything else float64.

    Raises
    ------
    ValueError
        If T is not rigid or the last axis is not 3 long.

    Examples
    --------
    >>> apply(rotation_z(np.pi / 2), [[1, 0, 0], [0, 2, 0]]).round(9).tolist()
    [[0.0, 1.0, 0.0], [-2.0, 0.0, 0.0]]
    """
    T = check_rigid(T)
    points = checks.last_axis(points, 3, "points")
    T = T.astype(points.dtype)
    return points @ T[:3, :3].T + T[:3, 3]


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
    >>> log(rotation_x(0.25)).round(9).tolist()
    [0.0, 0.0, 0.0, 0.25, 0.0, 0.0]
    """
    T = check_rigid(T)
    w = _rotation_vector(T[:3, :3])
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


def _rotation_vector(R: NDArray[np.float64]) -> NDArray[np.float64]:
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


def rotation_x(angle: float) -> NDArray[np.float64]:
    """Return the (4, 4) turn by `angle` radians about x, right-handed."""
    return _axis_rotation(0, angle)


def rotation_y(angle: float) -> NDArray[np.float64]:
    """Return the (4, 4) turn by `angle` radians about y, right-handed."""
    return _axis_rotation(1, angle)


def rotation_z(angle: float) -> NDArray[np.float64]:
    """Return the (4, 4) turn by `angle` radians about z, right-handed: x goes towards y."""
    return _axis_rotation(2, angle)


def _axis_rotation(axis: int, angle: float) -> NDArray[np.float64]:
    angle = checks.number(angle, "angle")
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T = np.eye(4)
    T[i, i] = T[j, j] = np.cos(angle)
    T[j, i] = np.sin(angle)
    T[i, j] = -T[j, i]
    return T


def random(rng: np.random.Generator, max_degrees: float = 180.0, max_metres: float = 1.0) -> NDArray[np.float64]:
    """Draw a rigid transform: any axis, an angle up to `max_degrees`, a translation up to `max_metres` long.

    Parameters
    ----------
    rng : the generator to draw from.
    max_degrees : from 0 to 180; the angle is uniform up to it (so it is not uniform over all rotations).
    max_metres : 0 or more; the translation is uniform in the ball of this radius.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    ValueError
        If rng is not a generator or a limit is out of range.
    """
    if not isinstance(rng, np.random.Generator):
        raise ValueError(f"rng: expected numpy.random.default_rng(seed), got {type(rng).__name__}.")
    if not 0 <= checks.number(max_degrees, "max_degrees") <= 180:
        raise ValueError(f"max_degrees: {max_degrees} is not between 0 and 180.")
    if checks.number(max_metres, "max_metres") < 0:
        raise ValueError(f"max_metres: {max_metres} is negative; give a length.")
    axis, direction = rng.normal(size=(2, 3))
    w = axis / np.linalg.norm(axis) * np.radians(max_degrees) * rng.random()
    T = exp(np.concatenate([np.zeros(3), w]))
    T[:3, 3] = direction / np.linalg.norm(direction) * max_metres * np.cbrt(rng.random())
    return T


def look_at(eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> NDArray[np.float64]:
    """Place a camera at `eye` that looks at `target`, upright.

    Parameters
    ----------
    eye, target : (3,) world coordinates, metres.
    up : (3,) the world direction that appears upwards in the image; z by default.

    Returns
    -------
    (4, 4) float64, T_world_camera: the camera's x (right), y (down), z (forward) axes are its first three columns.

    Raises
    ------
    ValueError
        If eye and target coincide, or the view is along `up`, so that no direction is upright.

    Examples
    --------
    >>> T_world_camera = look_at(eye=[-2, 0, 1], target=[0, 0, 1])
    >>> apply(T_world_camera, [0, 0, 2]).round(9).tolist()
    [0.0, 0.0, 1.0]
    """
    eye, target, up = (checks.vector(v, 3, n) for v, n in ((eye, "eye"), (target, "target"), (up, "up")))
    forward = target - eye
    distance = np.linalg.norm(forward)
    if distance < 1e-12:
        raise ValueError("look_at: eye and target are the same point; move one of them.")
    forward /= distance
    right = np.cross(forward, up)
    length = np.linalg.norm(right)
    if length <= 1e-9 * np.linalg.norm(up) or length == 0:
        raise ValueError("look_at: the view direction is parallel to up; give another up, e.g. up=(0, 1, 0).")
    right /= length
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = right, np.cross(forward, right), forward, eye
    return T


def pose_error(T_estimated: ArrayLike, T_true: ArrayLike) -> PoseError:
    """Measure how far an estimated pose is from the true one.

    Parameters
    ----------
    T_estimated, T_true : (4, 4) rigid, between the same two frames.

    Returns
    -------
    PoseError with the angle of R_estimatedᵀ R_true in degrees and |t_estimated − t_true| in metres. Both are symmetric
    in the two poses.

    Raises
    ------
    ValueError
        If one is not rigid.

    Examples
    --------
    >>> error = pose_error(rotation_z(np.radians(3)), np.eye(4))
    >>> round(error.degrees, 9), error.metres
    (3.0, 0.0)
    """
    estimated, true = check_rigid(T_estimated, "T_estimated"), check_rigid(T_true, "T_true")
    turn = _rotation_vector(estimated[:3, :3].T @ true[:3, :3])
    return PoseError(
        degrees=float(np.degrees(np.linalg.norm(turn))),
        metres=float(np.linalg.norm(estimated[:3, 3] - true[:3, 3])),
    )


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
        raise ValueError(f"q: a rotation needs a quaternion of length 1, got {length:.4g}; check the columns (x, y, z, w).")
    x, y, z, w = q / length
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return from_rotation_translation(R, t)


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
    >>> to_quaternion_xyzw(rotation_x(np.pi)).round(9).tolist()
    [1.0, 0.0, 0.0, 0.0]
    """
    return _quaternion_xyzw(check_rigid(T)[:3, :3])
