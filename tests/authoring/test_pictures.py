"""Seeing that a picture shows nothing, at any size and in few colours; keeping what did not change."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable

import matplotlib
import numpy as np
import pytest
from PIL import Image, ImageDraw

from course_lib.authoring.outputs import decode_png, same_picture
from course_lib.authoring.pictures import empty_axes, is_blank, what_is_empty

matplotlib.use("agg")
import matplotlib.pyplot as plt


def _pixels(draw: Callable[[plt.Figure], None], dpi: int, colours: int = 0) -> np.ndarray:
    figure = plt.figure(figsize=(5, 3))
    draw(figure)
    file = io.BytesIO()
    figure.savefig(file, dpi=dpi)
    plt.close(figure)
    image = Image.open(file).convert("RGB")
    return np.asarray(image.quantize(colours).convert("RGB") if colours else image)


def _empty(figure: plt.Figure) -> None:
    figure.add_subplot().set_title("Points")


def _empty_with_grid(figure: plt.Figure) -> None:
    figure.add_subplot().grid()


def _one_of_two_empty(figure: plt.Figure) -> None:
    first, _ = figure.subplots(1, 2)
    first.plot([1, 3, 2])


def _two_spines(figure: plt.Figure) -> None:
    figure.add_subplot().spines[["top", "right"]].set_visible(False)


def _title_alone(figure: plt.Figure) -> None:
    axes = figure.add_subplot()
    axes.axis("off")
    axes.set_title("Points")


def _line(figure: plt.Figure) -> None:
    figure.add_subplot().plot([1, 3, 2])


def _level_line_on_grid(figure: plt.Figure) -> None:
    axes = figure.add_subplot()
    axes.plot([1, 1, 1])
    axes.grid()


def _three_dots(figure: plt.Figure) -> None:
    figure.add_subplot().plot([1, 2, 3], [3, 1, 2], ".")


def _histogram(figure: plt.Figure) -> None:
    axes = figure.add_subplot()
    axes.hist(np.random.default_rng(1).normal(size=200), edgecolor="black")
    axes.spines[["top", "right"]].set_visible(False)


def _images(figure: plt.Figure) -> None:
    first, second = figure.subplots(1, 2)
    figure.colorbar(first.imshow(np.linspace(0, 1, 10_000).reshape(100, 100) ** 3, cmap="magma"))
    second.imshow(np.eye(9))


def _bars_and_legend(figure: plt.Figure) -> None:
    axes = figure.add_subplot()
    axes.bar([1, 2], [0.001, 3], label="a")
    axes.legend()


def _in_3d(figure: plt.Figure) -> None:
    figure.add_subplot(projection="3d").scatter([1, 2], [1, 3], [2, 3])


SIZES = [(100, 0), (200, 64)]  # the second is how a notebook stores it


@pytest.mark.parametrize(("dpi", "colours"), SIZES)
@pytest.mark.parametrize("draw", [_empty, _empty_with_grid, _one_of_two_empty, _two_spines, _title_alone])
def test_pictures_that_show_nothing(draw: Callable, dpi: int, colours: int) -> None:
    wanted = "the picture is blank" if draw is _title_alone else "1 axes in the picture is empty"
    assert what_is_empty(_pixels(draw, dpi, colours)) == wanted


@pytest.mark.parametrize(("dpi", "colours"), SIZES)
@pytest.mark.parametrize(
    "draw", [_line, _level_line_on_grid, _three_dots, _histogram, _images, _bars_and_legend, _in_3d]
)
def test_pictures_that_show_something(draw: Callable, dpi: int, colours: int) -> None:
    assert what_is_empty(_pixels(draw, dpi, colours)) == ""


def test_renders_are_blank_with_a_bar_or_title_beside_nothing() -> None:
    image = Image.new("RGB", (400, 300), "white")
    assert is_blank(np.asarray(image))
    ImageDraw.Draw(image).rectangle([20, 270, 380, 290], fill="navy")  # a colour bar
    assert is_blank(np.asarray(image))
    ImageDraw.Draw(image).ellipse([180, 130, 220, 170], fill="navy")
    assert not is_blank(np.asarray(image))


def test_a_dark_box_in_a_photograph_is_no_empty_axes() -> None:
    image = Image.new("RGB", (400, 300), "white")
    ImageDraw.Draw(image).rectangle([100, 80, 300, 220], fill="black")
    assert empty_axes(np.asarray(image)) == []


def _encoded(pixels: np.ndarray, mode: str = "RGB") -> str:
    file = io.BytesIO()
    Image.fromarray(pixels.astype(np.uint8), mode).save(file, "PNG")
    return base64.b64encode(file.getvalue()).decode()


def _scene() -> np.ndarray:
    image = Image.new("RGB", (400, 300), "white")
    ImageDraw.Draw(image).ellipse([100, 50, 300, 250], fill="navy")
    return np.asarray(image).astype(int)


def test_noise_of_another_renderer_is_the_same_picture() -> None:
    noise = np.random.default_rng(0).integers(-2, 3, size=(300, 400, 3))
    assert same_picture(_encoded(_scene()), _encoded(np.clip(_scene() + noise, 0, 255)))


def _rounded(pixels: np.ndarray) -> np.ndarray:
    """The same figure, cut to its contents a pixel narrower and two lower."""
    return np.asarray(Image.fromarray(pixels.astype(np.uint8)).resize((399, 298))).astype(int)


def test_a_figure_whose_size_was_rounded_otherwise_is_the_same_picture() -> None:
    assert same_picture(_encoded(_scene()), _encoded(_rounded(_scene())))


def test_small_changes_that_a_person_sees_are_another_picture() -> None:
    moved = np.roll(_scene(), 2, axis=1)
    dotted = _scene()
    dotted[10:30, 10:30] = 0
    paler = np.clip(_scene() + 10, 0, 255)
    for other in (moved, dotted, paler):
        assert not same_picture(_encoded(_scene()), _encoded(other))
        assert not same_picture(_encoded(_scene()), _encoded(_rounded(other)))
    assert not same_picture(_encoded(_scene()), _encoded(_scene()[:-3]))
    assert not same_picture(_encoded(_scene()), "iVBORw0KGgo=")


def test_transparent_pictures_are_seen_on_white() -> None:
    clear = np.zeros((4, 4, 4))
    assert (decode_png(_encoded(clear, "RGBA")) == 255).all()
    with pytest.raises(ValueError, match="cannot be decoded"):
        decode_png("no picture")
