"""Paths of a camera through a scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from course_lib.geometry.transforms import exp, look_at


def handheld(
    n: int,
    rng: np.random.Generator,
    *,
    start: Sequence[float],
    target: Sequence[float],
    length: float,
    sweep: float = 1.0,
    sway: float = 0.03,
    tremor_degrees: float = 0.3,
) -> list[np.ndarray]:
    """A hand-held camera walked around a target, looking at it, never quite still.

    Parameters
    ----------
    n : number of poses, at least 2.
    rng : decides sway and tremor.
    start : (3,) world, metres, where the arc around the target begins.
    target : (3,) world, metres, what it looks at.
    length : metres of the whole path, measured from pose to pose.
    sweep : radians of the arc about the vertical through the target, positive against the clock.
    sway : metres by which the path leaves the arc, smoothly.
    tremor_degrees : size of the small turns of the hand.

    Returns
    -------
    list of n (4, 4) float64, T_world_camera.

    Raises
    ------
    ValueError
        If there are fewer than two poses, or the length is not positive.
    """
    if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 2:
        raise ValueError(f"A path needs at least 2 poses, not {n!r}.")
    if not length > 0:
        raise ValueError(f"The length of a path must be positive metres, not {length}.")
    start, target = np.asarray(start, float), np.asarray(target, float)
    s = np.linspace(0, 1, n)
    angle = sweep * s
    arm = start - target
    cos, sin = np.cos(angle), np.sin(angle)
    arc = np.stack([cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1], np.full(n, arm[2])], 1) + target
    path = arc + sway * _wander(rng, s)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    path = path[0] + (path - path[0]) * (length / steps)
    aim = target + 0.5 * sway * _wander(rng, s)
    shake = np.radians(tremor_degrees) * _wander(rng, s, slow=2.0, fast=5.0)
    roll = np.radians(0.8) * _wander(rng, s)[:, 0]
    poses = []
    for eye, spot, turn, tilt in zip(path, aim, shake, roll, strict=True):
        turn = turn + (0, 0, tilt)
        poses.append(look_at(eye, spot) @ exp(np.concatenate([np.zeros(3), turn])))
    return poses


def path_length(poses: Sequence[np.ndarray]) -> float:
    """Metres from the first to the last pose, from pose to pose."""
    at = np.array([T[:3, 3] for T in poses])
    return float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())


def _wander(rng: np.random.Generator, s: np.ndarray, slow: float = 0.5, fast: float = 3.0) -> np.ndarray:
    """Smooth random (n, 3) of about unit size: a few sines between ``slow`` and ``fast`` periods over the path."""
    out = np.zeros((len(s), 3))
    for _ in range(4):
        rate, phase = rng.uniform(slow, fast, 3), rng.uniform(0, 2 * np.pi, 3)
        out += np.sin(2 * np.pi * s[:, None] * rate + phase) / 2
    return out
