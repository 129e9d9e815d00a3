"""Rigid transforms in 3D, the group SE(3), as 4x4 matrices.

`T_a_b` maps coordinates of frame b to coordinates of frame a: p_a = T_a_b p_b, so T_a_c = T_a_b T_b_c reads like
dominoes. Cameras look along +z with x right and y down; the world has z up. Angles are radians unless the name says
degrees; lengths are metres. Twists (exp, log, hat, vee) and quaternions live in `geometry.rotations`, and are
here too.

References
----------
Barfoot, State Estimation for Robotics, 2nd ed., chapters 7 and 8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from course_lib import checks
from course_lib.checks import FloatArray, check_rigid
from course_lib.geometry.rotations import (
    exp,
    from_quaternion_xyzw,
    hat,
    log,
    nearest_rigid,
    rotation_vector,
    to_quaternion_xyzw,
    vee,
)

__all__ = [
    "PoseError", "apply", "check_rigid", "compose", "exp", "from_quaternion_xyzw", "from_rotation_translation", "hat",
    "invert", "log", "look_at", "nearest_rigid", "pose_error", "random", "rotation_x", "rotation_y", "rotation_z",
    "to_quaternion_xyzw", "vee",
]  # fmt: skip


@dataclass(frozen=True)
class PoseError:
    """How far a pose is from the true one: the angle in degrees and the distance of the origins in metres."""

    degrees: float
    metres: float


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
    checks.check_rotation(rotation, "R")
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
    moved: FloatArray = points @ T[:3, :3].T + T[:3, 3]
    return moved


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
    turn = rotation_vector(estimated[:3, :3].T @ true[:3, :3])
    return PoseError(
        degrees=float(np.degrees(np.linalg.norm(turn))),
        metres=float(np.linalg.norm(estimated[:3, 3] - true[:3, 3])),
    )
