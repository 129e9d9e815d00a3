from __future__ import annotations

import numpy as np
import pytest

from course_lib.camera.pinhole import deproject_compact, preset
from course_lib.geometry.transforms import apply
from course_lib.simulate import camera as virtual
from course_lib.simulate import d455
from course_lib.simulate.recipes.living_room import living_room_path
from course_lib.simulate.scenes import TABLE, desk, living_room
from course_lib.surface.metrics import distance_to_surface

SMALL = preset("d455_depth_640x480").scaled(160, 120)


@pytest.mark.slow
def test_the_true_surface_of_the_room_is_small_enough_to_pass_around(room):
    mesh, labels = room.labelled_mesh()
    assert 20_000 < len(mesh.triangles) < 40_000
    assert len(labels) == len(mesh.vertices) and labels.min() == 1
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.vertices)))
    table = room.mesh("table")
    assert table.vertices[:, 2].max() == pytest.approx(TABLE[2] - 0.005)


@pytest.mark.slow
def test_the_path_around_the_table_reveals_its_things_between_half_a_metre_and_five(room):
    poses = living_room_path(7)
    near, far, seen = np.inf, 0.0, set()
    for T in poses[::3]:
        frame, labels = virtual.render_labelled(room, SMALL, T)
        near, far = min(near, frame.depth[frame.depth > 0].min()), max(far, frame.depth.max())
        seen |= {room.label_names[k] for k in np.unique(labels)}
        assert (frame.depth > 0).all()  # the room is closed
    assert 0.45 < near < 0.65 and 4.8 < far < 5.6
    assert {"table", "box", "globe", "animal", "mug", "books", "poster", "chair", "bookshelf", "lamp"} <= seen
    assert np.linalg.norm(poses[15][:3, 3] - TABLE) == pytest.approx(1.5, abs=0.05)


@pytest.mark.slow
def test_rendered_points_lie_on_the_true_surface(room):
    T = room.views["table"]
    frame = virtual.render(room, SMALL, T)
    points = apply(T, deproject_compact(frame.depth, SMALL))
    assert distance_to_surface(points, room.mesh()).mean() < 1e-5


def test_the_views_of_failure_show_their_failure(room):
    blank, labels = virtual.render_labelled(room, SMALL, room.views["blank_wall"])
    assert (labels == room.label("wall")).all() and np.ptp(blank.depth) < 1e-4  # one plane, and nothing else
    inner = blank.color[30:70, 40:120].astype(float)
    assert inner.std(axis=(0, 1)).max() < 6  # hardly any texture
    camera = preset("d455_depth_640x480")
    near = virtual.render(room, camera, room.views["too_near"])
    measured = d455.measure(near.depth, camera, np.random.default_rng(0))
    assert (measured.artefacts == d455.OUT_OF_RANGE).mean() > 0.2
    slats = virtual.render(room, camera, room.views["slats"])
    measured = d455.measure(slats.depth, camera, np.random.default_rng(0))
    assert (measured.artefacts == d455.FLYING).mean() > 0.005


@pytest.mark.slow
def test_the_desk_is_a_close_up(desk_scene):
    camera = preset("d455_depth_848x480").scaled(212, 120)
    frame, labels = virtual.render_labelled(desk_scene, camera, desk_scene.views["first"])
    assert 0.4 < frame.depth.min() and np.median(frame.depth) < 1.1
    seen = {desk_scene.label_names[k] for k in np.unique(labels)}
    assert {"animal", "box", "keyboard", "mat", "mug", "books", "globe", "notebook"} <= seen


@pytest.mark.parametrize("make", [living_room, desk])
@pytest.mark.parametrize("seed", [-1, 1.5, "seven", True])
def test_bad_seeds_are_refused(make, seed):
    with pytest.raises(ValueError, match="non-negative integer"):
        make(seed)
