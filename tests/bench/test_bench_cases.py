"""What the benchmarks compare is the same; no time is judged here."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

from course_lib.bench import bench_03, inputs, run_cases, scaling
from course_lib.camera import pinhole

NAMES = run_cases.case_modules()


def test_cases_of_some_lessons_are_found():
    assert bench_03.__name__ in NAMES and len(NAMES) > 3


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_all_sides_give_the_same(name):
    cases = importlib.import_module(name).cases()
    assert len({case.name for case in cases}) == len(cases) > 0
    for case in cases:
        case.agree()
        assert case.peers and all(0 < bound <= 1 for bound in case.bounds), case.name


def test_every_algorithm_grows_as_asked():
    scalings = [one for name in NAMES for one in getattr(importlib.import_module(name), "scalings", list)()]
    assert len(scalings) >= 8 and {one.bound for one in scalings} == {scaling.EXPONENT}
    assert all(min(one.sizes) == 10_000 and max(one.sizes) == 1_000_000 and len(one.sizes) >= 5 for one in scalings)
    for one in scalings:
        one.make(400)()  # it runs, and accepts what it is given


def test_the_image_has_the_stated_holes():
    depth = bench_03.depth_image(pinhole.preset("d455_depth_1280x720"))
    assert np.mean(depth == 0) == pytest.approx(bench_03.HOLES, abs=0.002)


@pytest.mark.parametrize("n", [1000, 4000])
def test_density_stays(n):
    points = inputs.field(n, 1, per_area=50.0)
    side = np.sqrt(n / 50.0)
    assert points[:, :2].min() >= 0 and points[:, :2].max() <= side
    assert np.abs(points[:, 2] - inputs.height(points[:, 0], points[:, 1])).max() < 6 * inputs.NOISE


def test_two_in_a_hundred_stray():
    points = inputs.field_with_strays(10_000, 2)
    off = np.abs(points[:, 2] - inputs.height(points[:, 0], points[:, 1]))
    assert np.count_nonzero(off > 6 * inputs.NOISE) == pytest.approx(200, abs=20)


def test_sixty_in_a_hundred_lie_on_the_plane():
    points = inputs.plane_among_points(10_000, 3)
    off = np.abs(points[:, 2] - 0.3 * points[:, 0] + 0.2 * points[:, 1] - 1.0)
    assert np.count_nonzero(off < 0.025) == pytest.approx(6000, abs=60)


def test_the_normals_of_the_surface_are_those_of_its_slope():
    points = inputs.field(50, 4, noise=0.0)
    normals = inputs.slope_normals(points)
    for axis, step in ((0, [1e-6, 0]), (1, [0, 1e-6])):
        rise = inputs.height(points[:, 0] + step[0], points[:, 1] + step[1]) - points[:, 2]
        along = np.array([*step, 0]) + np.stack([0 * rise, 0 * rise, rise], axis=1)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        assert np.abs((along * normals).sum(axis=1)).max() < 1e-5, axis
