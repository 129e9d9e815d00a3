from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest

from course_lib.simulate import shapes
from course_lib.simulate.implicit import closed_surface


def winding_agrees(vertices: np.ndarray, normals: np.ndarray, triangles: np.ndarray) -> bool:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return bool((np.sum(np.cross(b - a, c - a) * normals[triangles].mean(1), 1) > 0).all())


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.sum(a * np.cross(b, c)) / 6)


def as_open3d(vertices: np.ndarray, triangles: np.ndarray) -> o3d.geometry.TriangleMesh:
    return o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(triangles))


def test_box_faces_look_outwards_and_enclose_the_volume():
    total, area = 0.0, 0.0
    for face, patch in shapes.box((0.3, 0.2, 0.5)).items():
        points, normals, triangles = patch.points.reshape(-1, 3), patch.normals.reshape(-1, 3), patch.triangles()
        assert winding_agrees(points, normals, triangles), face
        assert np.sum(normals[0] * (points.mean(0) - (0, 0, 0.25))) > 0, face
        total += volume(points, triangles)
        a, b, c = (points[triangles[:, k]] for k in range(3))
        area += np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert total == pytest.approx(0.3 * 0.2 * 0.5)
    assert area == pytest.approx(2 * (0.06 + 0.15 + 0.10))


def test_pictures_on_a_box_are_upright():
    front = shapes.box((1.0, 1.0, 1.0))["front"].points
    assert front[0, 0].tolist() == [-0.5, -0.5, 1.0]  # top left as seen from -y
    assert front[0, -1].tolist() == [0.5, -0.5, 1.0]
    assert front[-1, 0].tolist() == [-0.5, -0.5, 0.0]


def test_sphere_lies_on_its_radius_and_looks_outwards():
    ball = shapes.sphere(0.4, 64)
    points, normals = ball.points.reshape(-1, 3), ball.normals.reshape(-1, 3)
    assert np.linalg.norm(points, axis=1) == pytest.approx(0.4)
    assert (np.sum(points * normals, 1) > 0.39).all()
    assert winding_agrees(points, normals, ball.triangles())
    assert volume(points, ball.triangles()) == pytest.approx(4 / 3 * np.pi * 0.4**3, rel=0.01)


def test_curved_patch_has_the_normals_of_its_plane():
    u, v = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 3))
    patch = shapes.curved(np.stack([u, 0 * u, -v], -1))  # right is +x, down is -z
    assert np.allclose(patch.normals, (0, -1, 0))


def test_closed_surface_of_a_sphere_is_closed_and_exact():
    vertices, triangles = closed_surface(lambda p: np.linalg.norm(p, axis=1) - 0.5, [-0.6] * 3, [0.6] * 3, 0.05)
    mesh = as_open3d(vertices, triangles)
    assert mesh.is_watertight() and mesh.is_orientable()
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.5, abs=1e-5)
    assert volume(vertices, triangles) == pytest.approx(4 / 3 * np.pi * 0.5**3, rel=0.01)
    assert winding_agrees(vertices, vertices, triangles)


def test_closed_surface_refuses_a_surface_that_leaves_the_box():
    with pytest.raises(ValueError, match="inside the box"):
        closed_surface(lambda p: np.linalg.norm(p, axis=1) - 0.5, [-0.4] * 3, [0.4] * 3, 0.05)


@pytest.fixture(scope="module")
def animal() -> shapes.Solid:
    return shapes.organic_shape(seed=7)


@pytest.mark.slow
def test_animal_is_closed_oriented_and_in_one_piece(animal):
    mesh = as_open3d(animal.vertices, animal.triangles)
    assert 35_000 <= len(animal.vertices) <= 37_500
    assert mesh.is_edge_manifold(allow_boundary_edges=False) and mesh.is_vertex_manifold() and mesh.is_orientable()
    assert len(mesh.cluster_connected_triangles()[1]) == 1
    assert 0.0005 < volume(animal.vertices, animal.triangles) < 0.0010  # cubic metres: positive, so outwards
    assert winding_agrees(animal.vertices, animal.normals, animal.triangles)
    assert np.linalg.norm(animal.normals, axis=1) == pytest.approx(1.0)


@pytest.mark.slow
def test_animal_has_the_size_of_the_bunny_and_no_symmetry(animal):
    extent = np.ptp(animal.vertices, axis=0)
    assert extent.max() < 0.20 and extent[0] == pytest.approx(0.15, abs=0.01)
    assert animal.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    mirrored = animal.vertices * (1, -1, 1)
    distance = np.abs(shapes.animal_distance(mirrored, 7))
    assert np.percentile(distance, 90) > 0.003  # a mirrored animal does not fit
    assert set(np.unique(animal.part)) == set(range(len(shapes.PARTS)))


@pytest.mark.slow
@pytest.mark.parametrize("spacing", [0.0026, 0.004])
@pytest.mark.parametrize("seed", [0, 1])
def test_coarser_animals_are_closed_too(spacing, seed):
    solid = shapes.organic_shape(spacing, seed)
    mesh = as_open3d(solid.vertices, solid.triangles)
    assert mesh.is_edge_manifold(allow_boundary_edges=False) and mesh.is_orientable()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: shapes.sphere(0.0), "positive radius"),
        (lambda: shapes.box((1, 0, 1)), "three positive lengths"),
        (lambda: shapes.rectangle((0, 0, 0), (1, 0, 0), (2, 0, 0)), "not parallel"),
        (lambda: shapes.turned([(0.1, 0.0)]), "at least two"),
        (lambda: shapes.organic_shape(0.05), "spacing"),
    ],
)
def test_bad_shapes_are_refused_in_one_sentence(call, words):
    with pytest.raises(ValueError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)
