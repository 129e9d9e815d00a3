"""What a picture says: computed from the data, the same whichever renderer drew it."""

import re

import numpy as np
import pytest
from show_things import box_cloud, square_mesh, straight_path, wall_cloud

from course_lib.cloud.pointcloud import PointCloud
from course_lib.notebook import show
from course_lib.notebook._paint import Colouring
from course_lib.notebook._scene import MOST_POINTS, build


@pytest.fixture(autouse=True)
def flat(monkeypatch):
    """Draw with Matplotlib: these tests are about words."""
    from course_lib.notebook._probe import rendering

    monkeypatch.setenv("COURSE_RENDER", "matplotlib")
    rendering.cache_clear()
    yield
    rendering.cache_clear()


def text_of(*things, frame=None, **how) -> str:
    return build(things, Colouring(**how), frame).text


def test_a_cloud_says_how_many_points_and_how_large():
    assert text_of(box_cloud()) == "Point cloud of 1,331 points, 2.00 × 1.00 × 0.500 m (x × y × z), blue."


def test_an_array_and_open3d_say_the_same_as_a_cloud():
    import open3d

    points = box_cloud().points
    legacy = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    tensor = open3d.t.geometry.PointCloud(points)
    assert text_of(points) == text_of(legacy) == text_of(tensor) == text_of(box_cloud())


def test_the_last_bits_of_a_cloud_do_not_reach_the_page():
    cloud = box_cloud()
    noise = np.random.default_rng(0).normal(size=cloud.points.shape) * 1e-9
    assert text_of(cloud.points + noise) == text_of(cloud)


def test_points_without_measurement_are_left_out_and_counted():
    points = box_cloud().points.copy()
    points[:31] = np.nan
    assert "1,300 points" in text_of(points) and "31 points without measurement left out" in text_of(points)


def test_thinning_is_for_the_picture_only_and_is_said():
    points = np.random.default_rng(1).uniform(size=(MOST_POINTS + 1, 3))
    scene = build((points,), Colouring())
    assert scene.text.startswith(f"Point cloud of {MOST_POINTS + 1:,} points")
    assert scene.text.endswith("drawn: every 2nd point.")
    assert len(scene.layers[0].points) == MOST_POINTS // 2 + 1


def test_a_mesh_and_a_path_say_their_sizes():
    assert text_of(square_mesh()).startswith("Mesh of 4 vertices and 2 triangles, 1.00 × 1.00 × 0 m (x × y × z), grey")
    assert text_of(straight_path()) == "Trajectory of 5 poses, 1.00 m long, vermilion."
    assert text_of({"path": straight_path(), "floor": square_mesh()}).startswith("Trajectory 'path' of 5 poses")


def test_colours_are_explained():
    cloud = box_cloud()
    assert "coloured by height, 0 to 0.50 m (dark blue to yellow)" in text_of(cloud, color="height", frame="world")
    assert "coloured by error, 0 to 10 mm" in text_of(
        cloud, color=np.linspace(0, 10, 1331), label="error", unit="mm", limits=(0, 10)
    )
    errors = np.linspace(0.043, 10, 1331)  # the smallest error of a cloud differs between machines
    assert "coloured by error, 0 to 10 mm" in text_of(cloud, color=errors, label="error", unit="mm")
    assert "coloured by error, 1.0 to 11 mm" in text_of(cloud, color=errors + 0.957, label="error", unit="mm")
    assert "331 inliers blue, 1,000 outliers vermilion" in text_of(cloud, color=np.arange(1331) < 331)
    assert "coloured by label, 2 labels" in text_of(
        PointCloud(cloud.points, labels=np.arange(1331) % 3 - 1), color="label"
    )
    assert "in its own colours" in text_of(wall_cloud())
    assert "in its own colours" in text_of({"path": straight_path(), "wall": wall_cloud()})
    assert "in its own colours" not in text_of({"one": wall_cloud(), "two": wall_cloud()})


def test_height_follows_the_frame():
    cloud = box_cloud()
    spans = {frame: text_of(cloud, color="height", frame=frame) for frame in ("camera", "world", "object")}
    assert "-1.0 to 0 m" in spans["camera"] and "0 to 0.50 m" in spans["world"] and "0 to 1.0 m" in spans["object"]


def test_pairs_and_dicts_name_and_colour():
    points = box_cloud().points
    scene = build(((points, "source"), (points + 1, "target")), Colouring())
    assert [name for name, _ in scene.legend] == ["source", "target"]
    assert scene.legend[0][1] == show.COLOURS["source"] and "'source'" in scene.text and "orange" in scene.text
    colours = np.tile(np.array([[1, 2, 3]], np.uint8), (len(points), 1))
    assert (build(((points, colours),), Colouring()).layers[0].rgb == [1, 2, 3]).all()
    assert (build(((points, "#010203"),), Colouring()).layers[0].rgb == [1, 2, 3]).all()
    named = build(({"mine": (points, "outlier")},), Colouring())
    assert named.legend == (("mine", show.COLOURS["outlier"]),)


def test_counts_that_may_differ_between_machines_are_rounded():
    text = text_of(box_cloud(), about=True)
    assert text.startswith("Point cloud of about 1,300 points, 2.0 × 1.0 × 0.50 m")


def test_the_picture_says_what_to_see_first_then_what_was_computed():
    picture = show(box_cloud(), views=["front", "top"], alt="A box of points")
    assert picture.alt == (
        "A box of points. Point cloud of 1,331 points, 2.00 × 1.00 × 0.500 m (x × y × z), blue. "
        "Seen from the front and above."
    )
    assert repr(picture) == picture.alt


@pytest.mark.slow
def test_no_address_and_no_hash_is_in_any_text():
    for picture in (show(box_cloud()), show(square_mesh()), show(straight_path())):
        assert not re.search(r"0x[0-9a-f]{4,}|[0-9a-f]{12,}", picture.alt)


def test_panels_name_each_thing():
    picture = show.panels({"all": box_cloud(), "few": box_cloud(3)}, view="front")
    assert picture.alt.startswith("all: Point cloud of 1,331 points") and "few: Point cloud of 27 points" in picture.alt


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: show(), "show needs something to show"),
        (lambda: show(np.zeros((0, 3))), "There is nothing to show: the cloud has no points"),
        (lambda: show({"left over": np.full((5, 3), np.nan)}), "the cloud 'left over' has no points"),
        (lambda: show("bunny"), "does not know what a str is"),
        (lambda: show([box_cloud(), square_mesh()]), "A list is shown as a trajectory"),
        (lambda: show(np.zeros((4, 5, 3), np.uint8)), "for pictures use show.images"),
        (lambda: show(np.zeros((4, 5))), "is not a cloud"),
        (lambda: show(box_cloud(), view="left"), "There is no view 'left'"),
        (lambda: show(box_cloud(), view=np.eye(3)), "a 4x4 T_world_camera, and this has shape"),
        (lambda: show(box_cloud(), view="camera"), "view='camera' needs to know where the sensor was"),
        (lambda: show(box_cloud(), frame="sensor"), "There is no frame 'sensor'"),
        (lambda: show(box_cloud(), color="rgb"), "has no colours of its own"),
        (lambda: show(box_cloud(), color="label"), "has no labels"),
        (lambda: show(box_cloud(), color="red"), "'red' is no colour of the course"),
        (lambda: show(box_cloud(), color="depth", frame="world"), "color='depth' is for clouds in the camera's frame"),
        (lambda: show(box_cloud(), color=np.zeros(3)), "3 numbers for 1,331 points"),
        (lambda: show(box_cloud(), color=np.zeros((3, 3), np.uint8)), "do not fit 1,331 points"),
        (lambda: show(box_cloud(), color=np.full(1331, np.nan)), "every value is NaN"),
        (lambda: show(wall_cloud(), view=np.diag([1.0, -1.0, -1.0, 1.0])), "Nothing lies in front of this camera"),
        (lambda: show((box_cloud(), "#FFFFFF")), "came out blank"),
        (lambda: show.panels({}), "show.panels needs at least one thing"),
        (lambda: show.slider(lambda k: box_cloud(k), [3], label="n"), "A slider has 2 to 8 values"),
        (lambda: show.error_budget({"depth": (1.0, 1.0)}), "The error budget has no row 'depth'"),
    ],
)
def test_what_cannot_be_shown_gets_one_sentence(call, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)) as caught:
        call()
    assert "\n" not in str(caught.value)
