"""Both renderers put the same things at the same pixels; a machine that cannot draw gets a picture and a hint."""

import os
import re
import sys

import numpy as np
import pytest
from show_things import box_cloud, square_mesh, straight_path, wall_cloud

from course_lib.notebook import _fallback, _probe, show
from course_lib.notebook._paint import Colouring
from course_lib.notebook._scene import build
from course_lib.notebook._views import layout, look


@pytest.fixture(autouse=True)
def fresh_choice():
    _probe.rendering.cache_clear()
    yield
    _probe.rendering.cache_clear()


def renderers() -> list:
    """Both where this machine has OpenGL, else Matplotlib alone."""
    missing = bool(_probe.missing_libraries())
    no_opengl = pytest.mark.skipif(missing, reason="this machine has no OpenGL")
    return [pytest.param("matplotlib"), pytest.param("pyvista", marks=no_opengl)]


def drawn(renderer, things, view_names, frame=None, **how):
    """Draw things; return the images and the views."""
    scene = build(things, Colouring(**how), frame)
    looks = [look(name, scene.points, scene.frame) for name in view_names]
    views = layout(looks, [scene.points] * len(looks), 300)
    if renderer == "pyvista":
        from course_lib.notebook._render import draw
    else:
        draw = _fallback.draw
    return draw(scene.layers, views, 4.0), views


def where(image, red):
    """The mean (u, v) of the red or the green pixels."""
    red_more = image[..., 0].astype(int) - image[..., 1] > 60
    green_more = image[..., 1].astype(int) - image[..., 0] > 60
    v, u = np.nonzero(red_more if red else green_more)
    return np.array([u.mean(), v.mean()])


@pytest.mark.parametrize("renderer", renderers())
def test_points_land_where_the_view_says(renderer):
    wall = wall_cloud()
    left = wall.points[:, 0] < 0
    images, views = drawn(renderer, (wall,), ["camera", "front", "back", "top"], frame="camera")
    for image, view in zip(images[:3], views[:3], strict=True):
        assert image.shape == (view.height, view.width, 3) and image.dtype == np.uint8
        pixels, _ = view.project(wall.points)
        for red, chosen in ((True, left), (False, ~left)):
            np.testing.assert_allclose(where(image, red), pixels[chosen].mean(axis=0), atol=1.5)
        covered = (image < 250).any(axis=-1)
        u, v = pixels.T
        assert abs(np.flatnonzero(covered.any(axis=0)).max() - u.max()) < 5
        assert abs(np.flatnonzero(covered.any(axis=1)).max() - v.max()) < 5
    assert where(images[2], red=True)[0] > where(images[2], red=False)[0]


@pytest.mark.slow
@pytest.mark.parametrize("renderer", renderers())
def test_near_things_hide_far_ones(renderer):
    near = np.array([(x, y, 1.0) for x in np.linspace(-0.5, 0.5, 99) for y in np.linspace(-0.5, 0.5, 99)])
    far = near * 2
    (image,), _ = drawn(renderer, ((near, "#C80000"), (far, "#00A000")), ["camera"], frame="camera")
    middle = image[
        image.shape[0] // 2 - 20 : image.shape[0] // 2 + 20, image.shape[1] // 2 - 20 : image.shape[1] // 2 + 20
    ]
    assert (middle[..., 0].astype(int) > middle[..., 1].astype(int) + 30).mean() > 0.95


@pytest.mark.parametrize("renderer", renderers())
def test_meshes_and_paths_are_drawn(renderer):
    images, views = drawn(
        renderer, ({"floor": square_mesh(), "path": straight_path()},), ["top", "front"], frame="world"
    )
    covered = (images[0] < 250).any(axis=-1)
    corners, _ = views[0].project(square_mesh().vertices)
    low, high = corners.min(axis=0).astype(int) + 5, corners.max(axis=0).astype(int) - 5
    assert covered[low[1] : high[1], low[0] : high[0]].all()
    assert (images[1] < 250).any()


@pytest.mark.parametrize("renderer", renderers())
def test_faces_seen_from_behind_can_be_left_out(renderer):
    if renderer == "pyvista":
        from course_lib.notebook._render import draw
    else:
        draw = _fallback.draw
    scene = build((square_mesh(),), Colouring(), "world")
    below = np.diag([1.0, 1.0, 1.0, 1.0])
    below[:3, 3] = (0.5, 0.5, -2)  # looks along +z, at the floor's underside
    views = layout([look(below, scene.points, "world")], [scene.points], 200)
    assert (draw(scene.layers, views, 4.0)[0] < 250).any()
    assert not (draw(scene.layers, views, 4.0, cull=True)[0] < 250).any()


@pytest.mark.parametrize("renderer", renderers())
def test_the_text_does_not_depend_on_the_renderer(renderer, monkeypatch):
    monkeypatch.setenv("COURSE_RENDER", renderer)
    picture = show({"path": straight_path(), "box": box_cloud()}, views=["front", "iso"])
    assert picture.alt == (
        "Trajectory 'path' of 5 poses, 1.00 m long, vermilion. Point cloud 'box' of 1,331 points, "
        "2.00 × 1.00 × 0.500 m (x × y × z), blue. Seen from the front and above at an angle."
    )
    assert (picture.pixels < 250).any()


def test_an_unknown_renderer_is_refused(monkeypatch):
    monkeypatch.setenv("COURSE_RENDER", "filament")
    with pytest.raises(ValueError, match="set it to 'pyvista' or 'matplotlib'"):
        show(box_cloud())


@pytest.mark.slow
def test_without_opengl_matplotlib_draws_and_the_picture_says_so(monkeypatch):
    monkeypatch.delenv("COURSE_RENDER", raising=False)
    monkeypatch.setattr(_probe, "missing_libraries", lambda: ["libEGL.so.1"])
    assert show.rendering() == ("matplotlib", "libEGL.so.1 not found")
    hinted = show(box_cloud())
    _probe.rendering.cache_clear()
    monkeypatch.setenv("COURSE_RENDER", "matplotlib")
    plain = show(box_cloud())
    assert hinted.alt == plain.alt
    assert hinted.pixels.shape[0] > plain.pixels.shape[0]


def test_a_trial_that_dies_means_matplotlib_and_is_tried_again_next_time(monkeypatch, tmp_path):
    monkeypatch.delenv("COURSE_RENDER", raising=False)
    monkeypatch.setattr(_probe, "missing_libraries", lambda: [])
    monkeypatch.setattr(_probe, "note_file", lambda: tmp_path / "cache" / "note")
    monkeypatch.setattr(_probe, "_TRIAL", "import os; os.abort()")
    name, reason = _probe.rendering()
    assert name == "matplotlib" and "failed with code" in reason
    assert not (tmp_path / "cache").exists()


def test_a_trial_that_hangs_is_stopped(monkeypatch):
    monkeypatch.setattr(_probe, "_TRIAL", "import time; time.sleep(60)")
    assert _probe.probe(seconds=0.5) == "a trial picture took more than 0.5 s"


def test_a_success_is_remembered_and_costs_nothing(monkeypatch, tmp_path):
    monkeypatch.delenv("COURSE_RENDER", raising=False)
    monkeypatch.setattr(_probe, "missing_libraries", lambda: [])
    monkeypatch.setattr(_probe, "note_file", lambda: tmp_path / "cache" / "note")
    monkeypatch.setattr(_probe, "_TRIAL", "pass")
    assert _probe.rendering() == ("pyvista", "a trial picture was drawn")
    _probe.rendering.cache_clear()
    monkeypatch.setattr(_probe, "probe", lambda: pytest.fail("tried again"))
    assert _probe.rendering() == ("pyvista", "a trial picture was drawn before")


def test_a_cache_folder_that_cannot_be_written_is_no_failure(monkeypatch, tmp_path):
    monkeypatch.delenv("COURSE_RENDER", raising=False)
    monkeypatch.setattr(_probe, "missing_libraries", lambda: [])
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setattr(_probe, "note_file", lambda: tmp_path / "file" / "note")
    monkeypatch.setattr(_probe, "_TRIAL", "pass")
    assert _probe.rendering()[0] == "pyvista"


def test_the_note_is_of_this_machine_and_environment(monkeypatch):
    before = _probe.note_file()
    assert re.fullmatch(r"rendering-[0-9a-f]{16}", before.name)
    monkeypatch.setenv("LIBGL_ALWAYS_SOFTWARE", os.environ.get("LIBGL_ALWAYS_SOFTWARE", "") + "1")
    assert _probe.note_file() != before


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux lacks libraries one by one")
def test_libraries_are_looked_for_by_name(monkeypatch):
    monkeypatch.setattr(_probe, "_LIBRARIES", ("libc.so.6", "libnothing.so.9"))
    assert _probe.missing_libraries() == ["libnothing.so.9"]
