"""Meshes are checked when made; distances agree with what is known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from course_lib.surface import metrics
from course_lib.surface.meshes import Mesh

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
SQUARE = Mesh([[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]], [[0, 1, 2], [0, 2, 3]])


def test_a_mesh_keeps_its_types():
    mesh = Mesh(TETRAHEDRON.astype(np.float32), FACES, np.zeros((4, 3), np.uint8), TETRAHEDRON)
    assert mesh.triangles.dtype == np.int32 and mesh.vertices.dtype == np.float32
    assert repr(mesh) == "Mesh(4 vertices, 4 triangles)"


def test_distance_to_a_square_is_height_inside_and_slanted_outside():
    rng = np.random.default_rng(1)
    points = rng.uniform([-3.9, -3.9, -2], [3.9, 3.9, 2], (1000, 3))
    np.testing.assert_allclose(metrics.distance_to_surface(points, SQUARE), np.abs(points[:, 2]), atol=2e-6)
    np.testing.assert_allclose(metrics.distance_to_surface([[7.0, 0, 4.0]], SQUARE), [5.0], rtol=1e-6)


def test_distance_stays_fine_far_from_the_origin():
    far = np.array([5000.0, -3000.0, 200.0])  # a map's coordinates, where single precision has half a millimetre
    moved = Mesh(SQUARE.vertices + far, SQUARE.triangles)
    points = np.array([[0.3, 0.2, 0.001], [1.0, -2.0, 0.5]])
    np.testing.assert_allclose(metrics.distance_to_surface(points + far, moved), [0.001, 0.5], atol=2e-6)


def test_nearest_distances_against_every_pair():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(50, 3)), rng.normal(size=(70, 3))
    every = np.linalg.norm(a[:, None] - b, axis=2)
    np.testing.assert_allclose(metrics.nearest_distances(a, b), every.min(axis=1), atol=1e-14)
    np.testing.assert_allclose(metrics.nearest_distances(b, a), every.min(axis=0), atol=1e-14)


def test_rms_in_the_head():
    assert metrics.rms([[3.0, 4.0], [0.0, 0.0]]) == 2.5


@pytest.mark.parametrize(
    "call, words",
    [
        (lambda: Mesh(TETRAHEDRON, FACES + 1), "index 4 names no vertex"),
        (lambda: Mesh(TETRAHEDRON, FACES - 1), "index -1"),
        (lambda: Mesh(TETRAHEDRON, FACES / 2), "integer"),
        (lambda: Mesh(TETRAHEDRON, np.zeros((0, 3), int)), "at least one row"),
        (lambda: Mesh(TETRAHEDRON * np.nan, FACES), "finite"),
        (lambda: Mesh(TETRAHEDRON[:0], FACES), "none"),
        (lambda: Mesh(TETRAHEDRON, FACES, colors=TETRAHEDRON), "uint8"),
        (lambda: Mesh(TETRAHEDRON, FACES, normals=TETRAHEDRON[:2]), "normals"),
        (lambda: metrics.rms([]), "none"),
        (lambda: metrics.rms([1, np.nan]), "1 are NaN"),
        (lambda: metrics.rms(["a"]), "real numbers"),
        (lambda: metrics.distance_to_surface(TETRAHEDRON, TETRAHEDRON), "Mesh"),
        (lambda: metrics.distance_to_surface(TETRAHEDRON * np.nan, SQUARE), "NaN"),
        (lambda: metrics.nearest_distances(TETRAHEDRON, TETRAHEDRON[:0]), "none"),
        (lambda: metrics.nearest_distances(TETRAHEDRON[0], TETRAHEDRON), r"\(N, 3\)"),
    ],
)
def test_bad_input_gets_one_sentence(call, words):
    with pytest.raises(ValueError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value) and str(caught.value).endswith((".", "?", ")."))
