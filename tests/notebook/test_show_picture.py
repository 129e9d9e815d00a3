"""Picture and picture(fig, alt): small palette PNGs on white, with alt text that holds a number."""

import io
import warnings

import numpy as np
import pytest
from matplotlib import pyplot as plt
from PIL import Image

from course_lib.notebook import picture, show
from course_lib.notebook._colours import COLOURS, CYCLE, colour_map, rgb
from course_lib.notebook._picture import MOST_BYTES, picture_of


def plot():
    fig, axes = plt.subplots(figsize=(5, 3))
    axes.plot([0, 1, 2], [0, 1, 4])
    return fig, axes


def test_a_figure_becomes_a_palette_png_and_is_closed():
    fig, _ = plot()
    made = picture(fig, alt="A parabola up to 4")
    assert not plt.fignum_exists(fig.number)
    image = Image.open(io.BytesIO(made.png))
    assert image.format == "PNG" and image.mode == "P" and len(made.png) < 40_000
    assert repr(made) == made.alt == "A parabola up to 4"
    assert 300 < made.width <= 500 and made.pixels.shape[1] == pytest.approx(1.6 * made.width, abs=1)


def test_a_cell_shows_a_picture_and_below_it_a_folded_line_that_says_it_in_words(monkeypatch):
    shown = []
    monkeypatch.setattr("IPython.display.display", lambda data, **how: shown.append((data, how.get("metadata"))))
    fig, _ = plot()
    made = picture(fig, alt="1 parabola < 4 & up")
    made._ipython_display_()
    (data, about), (words, _) = shown
    assert data == {"image/png": made.png, "text/plain": "1 parabola < 4 & up"}
    assert about == {"image/png": {"alt": "1 parabola < 4 & up", "width": made.width}}
    assert list(words) == ["text/html"]  # its plain text was said already
    assert words["text/html"].endswith("<summary>In words</summary>1 parabola &lt; 4 &amp; up</details>")


def test_a_figure_wider_than_the_notebook_is_drawn_as_large_as_it_is_shown():
    fig, axes = plt.subplots(figsize=(14, 4), layout="constrained")
    axes.plot([0, 1, 2], [0, 1, 4])
    made = picture(fig, alt="A parabola up to 4")
    assert 680 < made.width <= 700 and made.pixels.shape[1] == pytest.approx(1.6 * made.width, abs=1)


def test_the_first_digit_rule():
    fig, _ = plot()
    with pytest.raises(ValueError, match="has no number: say a number in it that was computed"):
        picture(fig, alt="A parabola")
    assert not plt.fignum_exists(fig.number)


def test_empty_axes_are_refused():
    fig, axes = plt.subplots(1, 2)
    axes[0].plot([0, 1])
    axes[1].set_title("nothing here")
    with pytest.raises(ValueError, match="The axes 'nothing here' of this figure is empty"):
        picture(fig, alt="1 line")
    assert not plt.fignum_exists(fig.number)


@pytest.mark.parametrize(
    "draw",
    [
        lambda axes: axes.plot([0, 1], [np.nan, np.nan]),
        lambda axes: axes.plot([], []),
        lambda axes: axes.scatter([], []),
        lambda axes: axes.text(0.5, 0.5, "words"),
    ],
)
def test_what_looks_like_data_but_is_none(draw):
    fig, axes = plt.subplots()
    draw(axes)
    with pytest.raises(ValueError, match="is empty"):
        picture(fig, alt="0 of it")


@pytest.mark.parametrize(
    "draw",
    [
        lambda axes: axes.scatter([1], [2]),
        lambda axes: axes.bar([1, 2], [3, 4]),
        lambda axes: axes.hist(np.arange(10)),
        lambda axes: axes.imshow(np.eye(3)),
        lambda axes: axes.pcolormesh(np.eye(3)),
        lambda axes: axes.fill_between([0, 1], [0, 1]),
        lambda axes: axes.axhline(1.0),
        lambda axes: axes.contour(np.outer(np.arange(5), np.arange(5))),
        lambda axes: axes.quiver([0], [0], [1], [1]),
        lambda axes: axes.figure.colorbar(axes.imshow(np.eye(3))),
        lambda axes: axes.hlines([1], 0, 1),
        lambda axes: axes.errorbar([1], [1], yerr=[0.1]),
    ],
)
def test_every_kind_of_plot_counts_as_data(draw):
    fig, axes = plt.subplots()
    draw(axes)
    assert picture(fig, alt="1 plot").alt == "1 plot"


def test_figures_without_axes_and_blank_pixels_are_refused():
    with pytest.raises(ValueError, match="no axes"):
        picture(plt.figure(), alt="0")
    with pytest.raises(ValueError, match="This picture is blank"):
        picture_of(np.full((50, 50, 3), 255, np.uint8), "0 things")


def test_margins_are_cut_and_class_colours_stay_exact():
    pixels = np.full((400, 400, 3), 255, np.uint8)
    pixels[100:300, 100:300] = np.random.default_rng(0).integers(0, 255, (200, 200, 3))
    pixels[100:120, 100:120] = rgb("outlier")
    made = picture_of(pixels, "1 square")
    assert made.pixels.shape[:2] == (224, 224)
    assert (made.pixels[:5] == 255).all()
    assert (made.pixels[20, 20] == rgb("outlier")).all()


@pytest.mark.slow
def test_a_photo_is_made_small_enough():
    rng = np.random.default_rng(0)
    coarse = rng.integers(0, 255, (44, 56, 3)).astype(np.uint8)
    photo = np.asarray(Image.fromarray(coarse).resize((1120, 900), Image.Resampling.BICUBIC))
    made = picture_of(photo, "1 photo")
    assert len(made.png) <= MOST_BYTES
    assert made.pixels.shape[1] >= made.width == 700


def test_what_is_no_photo_keeps_its_pixels():
    noise = np.random.default_rng(0).integers(0, 2, (500, 1100, 1), np.uint8)
    made = picture_of((noise * np.uint8([200, 30, 90])).astype(np.uint8), "2 colours of noise")
    assert made.pixels.shape[1] == pytest.approx(1.6 * made.width, abs=1)


@pytest.mark.parametrize("columns", [1, 2])
def test_no_picture_of_show_is_taller_than_a_screen(columns):
    image = np.linspace(0, 255, 400 * 300).reshape(400, 300).astype(np.uint8)
    tall = show.images({name: image for name in "abcd"}, columns=columns, title="Four")
    cloud = np.random.default_rng(0).uniform(size=(60, 3)) * [1, 1, 3]
    clouds = show.panels({name: cloud for name in "abcd"}, columns=columns, view="front", title="Four", color="height")
    for made in (tall, clouds):
        height = made.pixels.shape[0] * made.width / made.pixels.shape[1]
        assert 500 < height <= 640


def test_a_picture_can_be_saved(tmp_path):
    fig, _ = plot()
    made = picture(fig, alt="A parabola up to 4")
    assert made.save(tmp_path / "a.png").read_bytes() == made.png


def test_the_same_pixels_give_the_same_bytes():
    pixels = np.random.default_rng(0).integers(0, 255, (300, 400, 3)).astype(np.uint8)
    assert picture_of(pixels, "1").png == picture_of(pixels.copy(), "1").png


def test_classes_can_be_told_apart_without_red_and_green():
    """Simulated deuteranopia (Machado 2009, severity 1) keeps inlier/outlier and source/target far apart."""
    matrix = np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    )
    for a, b in (("inlier", "outlier"), ("source", "target"), ("truth", "estimate")):
        assert np.linalg.norm(matrix @ (np.array(rgb(a), float) - rgb(b))) > 90, (a, b)


def test_no_data_has_a_colour_that_the_map_of_magnitudes_has_not():
    ramp = colour_map("viridis", np.linspace(0, 1, 256), (0, 1)).astype(float)
    assert np.linalg.norm(ramp - rgb("no data"), axis=1).min() > 60
    assert (colour_map("viridis", np.array([np.nan]), (0, 1))[0] == rgb("no data")).all()


def test_style_sets_the_colour_cycle(monkeypatch):
    from matplotlib import rc_context, rcParams

    with rc_context():
        show.style()
        assert [entry["color"] for entry in rcParams["axes.prop_cycle"]] == [code for code, _ in CYCLE]
    assert set(COLOURS) >= {"inlier", "outlier", "source", "target"}


@pytest.mark.slow
def test_pictures_warn_of_nothing_and_look_the_same_under_the_style(monkeypatch):
    """Whatever rcParams a notebook has set: a warning would land in its stored output."""
    from matplotlib import rc_context

    from course_lib.notebook._probe import rendering

    monkeypatch.setenv("COURSE_RENDER", "matplotlib")
    rendering.cache_clear()
    image = {"a": np.linspace(0, 1, 600).reshape(20, 30)}
    points = np.random.default_rng(0).uniform(size=(200, 3))
    before = show.images(image), show(points)
    with rc_context(), warnings.catch_warnings():
        warnings.simplefilter("error")
        show.style()
        after = show.images(image), show(points)
        fig, axes = plt.subplots()
        axes.imshow(image["a"])
        picture(fig, alt="1 image")
    rendering.cache_clear()
    assert [made.alt for made in after] == [made.alt for made in before]
    for a, b in zip(after, before, strict=True):
        assert a.pixels.shape == b.pixels.shape
        assert np.abs(a.pixels.astype(int) - b.pixels).mean() < 1
