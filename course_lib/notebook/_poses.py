"""Trajectories and intrinsics from the text files that recordings come with."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from course_lib.camera.pinhole import PinholeCamera
from course_lib.geometry.transforms import check_rigid, from_quaternion_xyzw, invert
from course_lib.notebook._errors import Refusal, shown

RIGID_AFTER_TEXT = 1e-3
"""How far from rigid a pose may be after being written with few digits; it is then made exactly rigid."""


def _rows(path: Path, columns: int, what: str) -> np.ndarray:
    """Read lines of exactly so many numbers; # begins a comment."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise Refusal(f"{shown(path)} is not a text file: {what} was expected.") from error
    rows = []
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            rows.append([float(word) for word in words])
        except ValueError as error:
            raise Refusal(f"Line {number} of {shown(path)} is not made of numbers: {what} was expected.") from error
        if len(words) != columns:
            raise Refusal(f"Line {number} of {shown(path)} has {len(words)} numbers: {what} was expected.")
    if not rows:
        raise Refusal(f"{shown(path)} holds no numbers: {what} was expected.")
    return np.array(rows)


def read_tum(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read a TUM trajectory: lines of time tx ty tz qx qy qz qw.

    Returns
    -------
    times : (N,) seconds.
    poses : (N, 4, 4) T_world_camera, metres.

    Raises
    ------
    Refusal
        If a line does not hold eight numbers.
    """
    rows = _rows(path, 8, "time tx ty tz qx qy qz qw on every line")
    return rows[:, 0], np.stack([from_quaternion_xyzw(_unit(row[4:], path), row[1:4]) for row in rows])


def read_quaternions(path: Path) -> np.ndarray:
    """Read lines of tx ty tz qx qy qz qw as (N, 4, 4) T_world_camera, metres.

    Raises
    ------
    Refusal
        If a line does not hold seven numbers.
    """
    rows = _rows(path, 7, "tx ty tz qx qy qz qw on every line")
    return np.stack([from_quaternion_xyzw(_unit(row[3:], path), row[:3]) for row in rows])


def read_log(path: Path) -> np.ndarray:
    """Read an Open3D or Redwood .log: for each frame a line of three numbers, then four lines of T_world_camera.

    Returns
    -------
    (N, 4, 4), metres.

    Raises
    ------
    Refusal
        If it is cut short, or a matrix is not rigid.
    """
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    if not lines or len(lines) % 5 or any(len(line) != (4 if i % 5 else 3) for i, line in enumerate(lines)):
        raise Refusal(f"{shown(path)} is cut short or no .log: five lines a frame were expected.")
    try:
        matrices = np.array([[float(word) for word in line] for i, line in enumerate(lines) if i % 5])
    except ValueError as error:
        raise Refusal(f"{shown(path)} holds a word where a number was expected: write it again.") from error
    return np.stack([_nearest_rigid(T, path) for T in matrices.reshape(-1, 4, 4)])


def read_matrix(path: Path) -> np.ndarray:
    """Read one rigid 4x4 matrix of four lines of four numbers; what its digits round off is put right.

    Raises
    ------
    Refusal
        If it is not such a matrix.
    """
    rows = _rows(path, 4, "a 4x4 matrix")
    if rows.shape != (4, 4):
        raise Refusal(f"{shown(path)} has {len(rows)} lines of numbers, a 4x4 matrix has four.")
    return _nearest_rigid(rows, path)


def read_bun_conf(path: Path) -> dict[str, np.ndarray]:
    """Read the poses of Stanford's scans: lines of bmesh NAME tx ty tz qi qj qk qr.

    The quaternions rotate the other way round than the usual reading: the matrix is transposed here, which puts scan
    45 on scan 0 to a third of a millimetre (tests/notebook/test_data_real.py); read as written, it misses by 29 mm.

    Returns
    -------
    dict
        Scan's name without ending → (4, 4) T_bunny_scan, metres.
    """
    poses = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["bmesh"]:
            numbers = [float(word) for word in words[2:]]
            back = from_quaternion_xyzw(_unit(np.array(numbers[3:]), path))
            T = invert(back)
            T[:3, 3] = numbers[:3]
            poses[Path(words[1]).stem] = T
    return poses


def _unit(q: np.ndarray, path: Path) -> np.ndarray:
    length = np.linalg.norm(q)
    if not 0.99 < length < 1.01:
        raise Refusal(f"{shown(path)} holds a quaternion of length {length:.3g}, not 1: are its columns in order?")
    return q / length


def _nearest_rigid(T: np.ndarray, path: Path) -> np.ndarray:
    U, _, Vt = np.linalg.svd(T[:3, :3])
    R = U @ Vt
    if np.abs(R - T[:3, :3]).max() > RIGID_AFTER_TEXT or np.linalg.det(R) < 0 or (T[3] != [0, 0, 0, 1]).any():
        raise Refusal(f"{shown(path)} holds a matrix that is no rotation and translation: check how it was written.")
    T = T.copy()
    T[:3, :3] = R
    return check_rigid(T)


def read_camera(path: Path) -> PinholeCamera:
    """Read intrinsics from JSON: Open3D's form (intrinsic_matrix of nine numbers, column after column), or plain names
    (width, height, fx, fy, cx, cy; a RealSense writes ppx, ppy).

    Raises
    ------
    Refusal
        If it is neither.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        K = found.get("intrinsic_matrix")
        fx, fy, cx, cy = (
            (K[0], K[4], K[6], K[7])
            if K is not None
            else (found["fx"], found["fy"], found.get("cx", found.get("ppx")), found.get("cy", found.get("ppy")))
        )
        return PinholeCamera(int(found["width"]), int(found["height"]), fx, fy, cx, cy, source=f"read from {path.name}")
    except (ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
        raise Refusal(
            f"{shown(path)} holds no intrinsics that the course reads: give JSON with width, height, fx, fy, cx, cy."
        ) from error
