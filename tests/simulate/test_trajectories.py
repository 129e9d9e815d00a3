from __future__ import annotations

import numpy as np
import pytest

from course_lib.geometry.transforms import check_rigid, invert, pose_error
from course_lib.simulate.trajectories import handheld, path_length

ARGUMENTS = dict(start=(0.6, -1.1, 1.4), target=(0.0, 0.2, 0.8), length=1.2, sweep=-0.9)


def path(n=30, seed=0, **changes):
    return handheld(n, np.random.default_rng(seed), **{**ARGUMENTS, **changes})


def test_poses_are_rigid_and_the_path_has_its_length():
    poses = path()
    for T in poses:
        check_rigid(T)
    assert len(poses) == 30 and path_length(poses) == pytest.approx(1.2)


def test_the_path_is_smooth():
    poses = path()
    errors = [pose_error(a, b) for a, b in zip(poses[:-1], poses[1:], strict=True)]
    assert max(e.metres for e in errors) < 0.07 and max(e.degrees for e in errors) < 5
    at = np.array([T[:3, 3] for T in poses])
    assert np.linalg.norm(np.diff(at, 2, axis=0), axis=1).max() < 0.02


def test_the_target_stays_near_the_middle_of_the_view():
    for T in path():
        x, y, z = (invert(T) @ (*ARGUMENTS["target"], 1.0))[:3]
        assert z > 1.0 and np.hypot(x, y) / z < 0.12
        assert T[2, 1] < -0.5  # the image's down is the world's down


def test_a_seed_decides_the_path():
    assert np.array_equal(path(seed=3), path(seed=3))
    assert not np.allclose(path(seed=3), path(seed=4))


@pytest.mark.parametrize(("changes", "words"), [({"n": 1}, "at least 2"), ({"length": 0.0}, "positive metres")])
def test_bad_paths_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        path(**changes)
