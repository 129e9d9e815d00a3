"""What moves, and the error budget: stored as text and still pictures, live in a session."""

import numpy as np
import pytest
from show_things import box_cloud, square_mesh, straight_path

from course_lib.notebook import lessons, show
from course_lib.notebook._picture import Picture


@pytest.fixture(autouse=True)
def flat(monkeypatch):
    from course_lib.notebook._probe import rendering

    monkeypatch.setenv("COURSE_RENDER", "matplotlib")
    monkeypatch.delenv("COURSE_LIVE", raising=False)
    rendering.cache_clear()
    yield
    rendering.cache_clear()


def test_the_stored_form_of_a_slider_is_a_strip():
    strip = show.slider(box_cloud, [3, 5, 7], label="points a side", view="front")
    assert isinstance(strip, Picture)
    assert strip.alt.startswith("points a side 3: Point cloud of 27 points")
    assert "points a side 7: Point cloud of 343 points" in strip.alt
    images = show.slider(lambda k: np.full((10, 10), k, np.uint8), [10, 250], label="grey")
    assert "Image 'grey 250' of 10 × 10 pixels" in images.alt


@pytest.mark.slow
def test_a_live_slider_turns_through_the_same_frames(monkeypatch):
    monkeypatch.setenv("COURSE_LIVE", "1")
    box = show.slider(lambda k: np.full((10, 10), k, np.uint8), [10, 250], label="grey")
    slider, image, words = box.children
    first = image.value
    slider.value = "grey 250"
    assert image.value != first and "250" in words.value


def test_a_turnable_view_is_whole_and_needs_no_network():
    view = show({"path": straight_path(), "floor": square_mesh(), "box": box_cloud()}, interactive=True)
    figure = view.figure
    assert [trace.type for trace in figure.data] == ["scatter3d", "mesh3d", "scatter3d"]
    assert len(figure.data[2].x) == 1331
    assert figure.layout.scene.aspectmode == "data"
    assert figure.layout.scene.camera.up.z > 0.7
    bundle = view._repr_mimebundle_()
    assert set(bundle) == {"application/vnd.plotly.v1+json", "text/plain"}
    assert "http" not in str(bundle) and "1,331 points" in bundle["text/plain"]


def test_the_error_budget_waits_and_fills(capsys):
    show.error_budget()
    waiting = capsys.readouterr().out
    assert waiting.startswith("Error budget\n")
    for stage in [stage for stage in lessons.stages() if stage.announced]:
        assert stage.name in waiting and f"waits for lesson {stage.lesson[:2]}" in waiting
    first = lessons.stages()[0]
    show.error_budget({first.key: (1.0, 0.29)})
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith(first.name))
    assert f"1.0 {first.unit}" in line and line.endswith("0.29")


def test_a_row_that_is_not_announced_stands_in_its_own_lesson_and_in_later_ones(monkeypatch, capsys):
    rows = [("01", "step", True), ("05", "strays", False), ("07", "fit", True)]
    stages = [lessons.Stage(10, name, name, "mm", f"{number}_x", announced) for number, name, announced in rows]
    monkeypatch.setattr(lessons, "stages", lambda: stages)
    shown = {}
    for measured in ((), ("step",), ("strays",), ("fit",)):
        show.error_budget({key: (1.0, 1.0) for key in measured})
        lines = capsys.readouterr().out.splitlines()[3:]
        shown["".join(measured)] = [line.split()[0] for line in lines if line.strip()]
    assert shown == {
        "": ["step", "fit"],
        "step": ["step", "fit"],
        "strays": ["step", "strays", "fit"],
        "fit": ["step", "strays", "fit"],
    }


def test_each_stage_has_a_key_and_a_place_of_its_own():
    stages = lessons.stages()
    assert len(stages) >= 12
    assert len({stage.key for stage in stages}) == len({stage.order for stage in stages}) == len(stages)
