"""What the pictures of lab 04 are drawn from: a grid seen from above, a tilted board, and five spoiled clouds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

SPOILED = "BCDEA"
"""The letters of int(), centres, twice the voxel, every k-th point and the height left out, in this order."""
VOXEL = 0.2


def arrays() -> dict[str, np.ndarray]:
    """The arrays by name; lengths in metres."""
    return {**_from_above(), **_board(), **_spoiled()}


def _from_above() -> dict[str, np.ndarray]:
    flat = np.random.default_rng(2).uniform(-1, 1, (150, 2))
    cubes, which, count = np.unique(np.floor(flat / 0.5), axis=0, return_inverse=True, return_counts=True)
    means = np.array([flat[which.ravel() == k].mean(axis=0) for k in np.flatnonzero(count >= 8)])
    return {"above": flat, "corners": cubes / 2, "count": count, "kept": means}


def _board() -> dict[str, np.ndarray]:
    board = np.random.default_rng(8).uniform(-1, 1, (300, 3)) * [0.3, 0.4, 0.004]
    tilt = np.radians(25)
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    board = board @ turn.T + [0.3, 0, 1.2]
    return {"board": board, "normal": -turn[:, 2], "given": np.linalg.eigh(board.T @ board)[1][0]}


def _scene() -> np.ndarray:
    """(490, 2) points of a floor, a table and its leg from the side: x and height, metres."""
    rng = np.random.default_rng(3)
    floor = np.stack([rng.uniform(-1, 1, 260), np.full(260, -0.28)], axis=1)
    table = np.stack([rng.uniform(-0.55, 0.55, 140), np.full(140, 0.33)], axis=1)
    leg = np.stack([np.full(90, 0.13), rng.uniform(-0.28, 0.33, 90)], axis=1)
    return np.concatenate([floor, table, leg]) + 0.012 * rng.standard_normal((490, 2))


def _spoiled() -> dict[str, np.ndarray]:
    scene = _scene()

    def grid(index: np.ndarray, centres: bool = False) -> np.ndarray:
        cubes, which = np.unique(index, axis=0, return_inverse=True)
        means = np.array([scene[which.ravel() == k].mean(axis=0) for k in range(len(cubes))])
        return (cubes + 0.5) * VOXEL if centres else means

    right = grid(np.floor(scene / VOXEL))
    makers: tuple[Callable[[], np.ndarray], ...] = (
        lambda: grid((scene / VOXEL).astype(int)),
        lambda: grid(np.floor(scene / VOXEL), centres=True),
        lambda: grid(np.floor(scene / (2 * VOXEL))),
        lambda: scene[np.random.default_rng(1).permutation(len(scene))[: len(right)]],
        lambda: grid(np.floor(scene[:, :1] / VOXEL)),
    )
    clouds = {letter: make() for letter, make in zip(SPOILED, makers, strict=True)}
    return {"scene": scene, "right": right, **{letter: clouds[letter] for letter in sorted(clouds)}}
