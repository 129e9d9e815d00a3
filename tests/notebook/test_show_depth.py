"""Depth and image rows: what was not measured has a colour, a legend entry and a percentage."""

import re

import numpy as np
import pytest

from course_lib.camera.pinhole import PinholeCamera
from course_lib.camera.rgbd import RGBDFrame
from course_lib.notebook import show
from course_lib.notebook._colours import rgb


def slope() -> np.ndarray:
    """100 x 200 depth image, 1 to 3 m from left to right, its left quarter without data."""
    depth = np.tile(np.linspace(1, 3, 200, dtype=np.float32), (100, 1))
    depth[:, :50] = 0
    return depth


def has_colour(picture, colour, at_least=200) -> bool:
    return int((picture.pixels == rgb(colour)).all(axis=-1).sum()) >= at_least


def test_depth_says_its_range_and_its_holes():
    picture = show.depth(slope(), alt="A slope")
    assert picture.alt.startswith("A slope. Depth image of 200 × 100 pixels: median 2.25 m, 98 % of it between")
    assert "no data in 25 % (pale pink)" in picture.alt
    assert has_colour(picture, "no data")


def test_nan_is_no_data_too():
    depth = np.where(slope() > 0, slope(), np.nan)
    assert show.depth(depth).alt == show.depth(slope()).alt


def test_depth_without_holes_has_no_such_legend():
    picture = show.depth(np.full((20, 30), 1.5, np.float32))
    assert "every pixel measured" in picture.alt and not has_colour(picture, "no data")


def test_several_depths_share_one_scale():
    picture = show.depth({"near": slope(), "far": slope() * 2}, near=1, far=6)
    assert "Colours: 1.0 m dark blue to 6.0 m yellow" in picture.alt
    assert "'near'" in picture.alt and "'far'" in picture.alt


@pytest.mark.parametrize(
    ("depth", "sentence"),
    [
        (np.zeros((4, 4), np.float32), "every pixel of this depth image is without data"),
        (np.ones((4, 4), np.uint16), "holds uint16 numbers, not metres: decode it first"),
        (np.ones((4, 4), np.uint8), "holds uint8 numbers, not metres"),
        (np.ones((4, 4, 3), np.float32), "(H, W) and this has shape (4, 4, 3)"),
    ],
)
def test_what_is_no_depth_in_metres_is_refused(depth, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        show.depth(depth)


def test_a_frame_is_shown_as_colour_beside_depth():
    color = np.zeros((100, 200, 3), np.uint8)
    color[..., 2] = 200
    frame = RGBDFrame(color, slope(), PinholeCamera(200, 100, 150, 150, 99.5, 49.5), name="first")
    picture = show(frame)
    assert picture.alt.startswith(
        "Colour image 'first' of 200 × 100 pixels. Depth image of 200 × 100 pixels: median 2.25 m"
    )
    assert show(frame, frame).alt.count("Colour image") == 2
    assert show(frame, view="iso").alt.startswith("Point cloud of 15,000 points")


def test_images_of_every_kind():
    rng = np.random.default_rng(0)
    small = show.images({"inner": rng.integers(0, 255, (20, 30, 3)).astype(np.uint8)})
    picture = show.images(
        {
            "colour": rng.integers(0, 255, (20, 30, 3)).astype(np.uint8),
            "grey": np.arange(200, dtype=np.uint8).reshape(10, 20),
            "mask": np.arange(200).reshape(10, 20) < 50,
            "raw": (np.arange(200, dtype=np.uint16) * 10).reshape(10, 20),
            "error": np.where(np.eye(10) > 0, np.nan, 1.0),
            "picture": small,
        },
        unit="m",
    )
    for part in (
        "Image 'colour' of 30 × 20 pixels, in colour.",
        "Image 'grey' of 20 × 10 pixels, grey, 0 to 199 of 255.",
        "Image 'mask' of 20 × 10 pixels: yes in 25 % (blue).",
        "Image 'raw' of 20 × 10 pixels: median 995 m",
        "no data in 10 % (pale pink)",
        "picture: Image 'inner' of 30 × 20 pixels",
    ):
        assert part in picture.alt


def test_signed_images_have_zero_in_the_middle():
    picture = show.images({"error": np.tile(np.linspace(-1.0, 1.0, 101), (20, 1))}, signed=True)
    row = picture.pixels[picture.pixels.shape[0] // 2].astype(int)
    blue, red = np.argmax(row[:, 2] - row[:, 0]), np.argmax(row[:, 0] - row[:, 2])
    assert blue < red


@pytest.mark.parametrize(
    ("images", "sentence"),
    [
        ({}, "show.images needs at least one image"),
        ({"a": np.zeros(5)}, "The image 'a' has shape (5,)"),
        ({"a": np.zeros((2, 2, 7))}, "The image 'a' has shape (2, 2, 7)"),
        ({"a": np.full((3, 3), np.nan)}, "every pixel of 'a' is NaN"),
    ],
)
def test_what_is_no_image_is_refused(images, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        show.images(images)


def test_images_of_one_unit_share_one_colour_bar():
    """With a bar each, four images in a row would be too small to read."""
    images = {name: np.full((30, 40), float(k)) for k, name in enumerate("abcd", start=1)}
    shared, own = show.images(images, columns=4, unit="m"), show.images(images, columns=4)
    assert shared.pixels.shape[0] > 1.3 * own.pixels.shape[0]
