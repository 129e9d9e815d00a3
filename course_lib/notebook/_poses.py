"""Trajectories from the text files that recordings come with."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from course_lib.geometry.transforms import from_quaternion_xyzw, invert, nearest_rigid
from course_lib.notebook._errors import Refusal, shown
from course_lib.notebook._pairing import nearest_in_time


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
    """Read an Open3D or Redwood .log as (N, 4, 4), metres; what its digits round off is put right.

    Raises
    ------
    Refusal
        If it is cut short, or a matrix is not rigid.
    """
    return np.stack([_rigid(T, path) for T in _log(path)[1]])


def _log(path: Path) -> tuple[list[int], np.ndarray]:
    """For each frame a line of three numbers, the first its own, then four lines of T_world_camera, as written."""
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    if not lines or len(lines) % 5 or any(len(line) != (4 if i % 5 else 3) for i, line in enumerate(lines)):
        raise Refusal(f"{shown(path)} is cut short or no .log: five lines a frame were expected.")
    try:
        matrices = np.array([[float(word) for word in line] for i, line in enumerate(lines) if i % 5])
        return [int(line[0]) for line in lines[::5]], matrices.reshape(-1, 4, 4)
    except ValueError as error:
        raise Refusal(f"{shown(path)} holds a word where a number was expected: write it again.") from error


Poses = list[np.ndarray | None]


def poses_of_folder(path: Path, frames: list[Path], times: np.ndarray | None) -> tuple[Poses | None, str, str]:
    """Poses of the frames where a recording has them.

    Parameters
    ----------
    path : the folder, with groundtruth.txt, trajectory.log, or a 4x4 matrix a frame, NAME.pose.txt beside its images.
    frames : the depth images.
    times : when they were taken, seconds, or None.

    Returns
    -------
    T_world_camera of each frame, None for one that has none; or None; the file that they come from; what to note.

    Raises
    ------
    Refusal
        If a file is damaged, or has poses of other frames.
    """
    truth, log, notes = path / "groundtruth.txt", path / "trajectory.log", []
    if truth.is_file() and times is not None:
        found, name = _tum_at(truth, times), truth.name
    elif log.is_file():
        found, name = _numbered(log, len(frames)), log.name
    elif beside := {frame: pose for frame in frames if (pose := _pose_file(frame)).is_file()}:
        tables = {frame: _rows(pose, 4, "a 4x4 matrix") for frame, pose in beside.items()}
        found, name = [tables.get(frame) for frame in frames], "*.pose.txt"
    else:
        return None, "", "groundtruth.txt is not used: the images have no times" if truth.is_file() else ""
    source = path / name
    found = [T if T is not None and np.isfinite(T).all() and T.any() else None for T in found]  # lost while tracking
    poses = [None if T is None else _rigid(T, source) for T in found]
    known = [(T, rigid) for T, rigid in zip(found, poses, strict=True) if rigid is not None]
    if not known:
        return None, "", f"{name} has no pose of these frames"
    missed = max(np.abs(T - rigid).max() for T, rigid in known)
    if len(known) < len(frames):
        notes.append(f"{len(frames) - len(known)} of {len(frames)} frames have no pose in {name}")
    if missed > 1e-6:
        notes.append(f"rotations of {name} made exact (they missed by up to {missed:.1g})")
    return poses, name, "; ".join(notes)


def _tum_at(path: Path, times: np.ndarray) -> Poses:
    rows = _rows(path, 8, "time tx ty tz qx qy qz qw on every line")
    chosen, near = nearest_in_time(rows[:, 0], times)
    return [
        from_quaternion_xyzw(_unit(row[4:], path), row[1:4]) if is_near else None
        for row, is_near in zip(rows[chosen], near, strict=True)
    ]


def _numbered(path: Path, count: int) -> Poses:
    numbers, matrices = _log(path)
    if len(matrices) == count:
        return list(matrices)
    by_number = dict(zip(numbers, matrices, strict=True))
    if len(by_number) < len(numbers) or len(numbers) > count or max(numbers) >= count:
        raise Refusal(f"{shown(path)} has {len(matrices)} poses and there are {count} frames: they must agree.")
    return [by_number.get(i) for i in range(count)]


def _pose_file(frame: Path) -> Path:
    """frame-000000.pose.txt of frame-000000.depth.png."""
    return frame.with_name(f"{frame.name.partition('.')[0]}.pose.txt")


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
    return _rigid(rows, path)


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


def _rigid(T: np.ndarray, path: Path) -> np.ndarray:
    """The rigid matrix that one written with few digits stands for; Refusal where none is near."""
    try:
        return nearest_rigid(T)
    except ValueError as error:
        why = str(error).removeprefix("T: ")
        raise Refusal(f"{shown(path)} holds a matrix that is no rotation and translation: {why}") from error
