"""Polygons become triangles of the same area and sense."""

import numpy as np
import pytest

from course_lib.surface.polygons import triangulate


def _area(points, triangles):
    a, b, c = points[triangles].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


def test_a_polygon_that_bulges_is_a_fan():
    angles = np.arange(6) * np.pi / 3
    points = np.stack([np.cos(angles), np.sin(angles), np.zeros(6)], 1)
    assert triangulate(points, [np.arange(6)]).tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    assert triangulate(points, [[5, 1, 3]]).tolist() == [[5, 1, 3]]


@pytest.mark.parametrize("first", range(8))
def test_a_polygon_with_bays_keeps_its_area_whichever_corner_is_first(first):
    outline = np.array([[0, 0], [4, 0], [4, 3], [3, 3], [3, 1], [1, 1], [1, 3], [0, 3]], float)
    tilt = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    points = np.c_[outline, np.zeros(8)] @ tilt
    triangles = triangulate(points, [np.roll(np.arange(8), first)])
    areas = _area(points, triangles)
    assert len(triangles) == 6
    np.testing.assert_allclose(areas.sum(axis=0), 8 * np.linalg.det(tilt) * tilt[2], atol=1e-12)
    assert (areas @ areas.sum(axis=0) > 0).all()  # none is turned over, so none lies outside


def test_several_polygons_keep_their_order():
    points = np.random.default_rng(2).random((8, 3))
    both = triangulate(points, [[0, 1, 2, 3], [4, 5, 6, 7]])
    np.testing.assert_array_equal(both[:2], triangulate(points, [[0, 1, 2, 3]]))
    np.testing.assert_array_equal(both[2:], triangulate(points, [[4, 5, 6, 7]]))


def test_two_corners_are_refused():
    with pytest.raises(ValueError, match="at least three corners, got shape .1, 2."):
        triangulate(np.eye(3), [[0, 1]])
