"""The numbers that lesson 01 and its lab live on, each with a tolerance; the functions are the lesson's own."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from lesson_helpers import functions_in, functions_of, load

from course_lib import tasks
from course_lib.camera import rgbd
from course_lib.tasks import registry
from course_lib.tasks.diagnosis.recognition import load_source
from course_lib.tasks.labs.lab_01_rgbd_images.causes import CAUSE_OF
from course_lib.tasks.labs.lab_01_rgbd_images.flying_pixels import NOISE, flying_scene

ROOT = Path(__file__).parents[2]
LAB = ROOT / "solutions" / "source" / "01_rgbd_images.py"
NAIVE = (
    "the lesson's own code", "one limit for all depths", "a limit that grows with z", "a limit within the noise",
    "a limit far above the noise", "itself counted", "too many neighbours asked", "compared with a mean",
)  # fmt: skip


@pytest.fixture(scope="module")
def lesson() -> dict:
    """The functions that the lesson defines, by name."""
    return functions_of("01", "measured range_from_depth to_metres rescale_for_display invented", np=np)


@pytest.fixture(scope="module")
def room() -> tuple[np.ndarray, np.ndarray]:
    """Depth and true depth of the lesson's frame."""
    dataset = load("living_room")
    return dataset.frames[0].depth, dataset.truth["depth"][0]


def earned(task_id: str, function, seed: int) -> float:
    task = tasks.get(task_id)
    cases = tasks.fresh(task, seed)
    return tasks.judge_all(task, cases, tasks.run_all(function, cases)).score


def test_the_corner_of_a_wall_is_half_a_metre_farther_in_range(lesson):
    string = lesson["range_from_depth"](np.full((480, 640), 2.0), 525, 319.5, 239.5)
    assert string[0, 0] == pytest.approx(2.513, abs=1e-3) == pytest.approx(string.max(), abs=1e-3)
    assert np.degrees(np.arccos(2 / string[0, 0])) == pytest.approx(37.3, abs=0.1)
    assert string.min() == pytest.approx(2, abs=1e-5)


def test_the_lessons_division_reads_what_is_linear(lesson):
    raw = np.array([[0, 1, 5000, 60000]], np.uint16)
    for name in ("tum", "redwood", "realsense"):
        steps = rgbd.ENCODINGS[name].units_per_metre
        assert np.allclose(lesson["to_metres"](raw, steps), rgbd.decode_depth(raw, name))
    assert not np.allclose(lesson["to_metres"](raw, 1000), rgbd.decode_depth(raw, "sun"))


def test_eight_bits_err_by_half_a_grey_level(lesson, room):
    _, truth = room
    back = lesson["rescale_for_display"](truth, 0, 6) / 255 * 6
    lost = np.abs(back - truth)[lesson["measured"](truth)].max()
    assert 0.95 * 3 / 255 < lost <= 3 / 255 + 1e-6


def test_noise_grows_with_the_square_of_the_depth(lesson, room):
    depth, truth = room
    inside = lesson["measured"](depth) & lesson["measured"](truth) & (np.abs(depth - truth) <= 0.03 * truth)
    for start in (1.5, 2.0, 2.5, 3.0):
        band = inside & (truth >= start) & (truth < start + 0.5)
        assert (depth - truth)[band].std() / (start + 0.25) ** 2 == pytest.approx(0.0021, abs=1.5e-4)


def test_mixing_invents_depths_and_picking_none(lesson, room):
    depth, _ = room
    mixed = cv2.resize(depth, (320, 240), interpolation=cv2.INTER_LINEAR)
    assert lesson["invented"](mixed, depth).sum() > 3000
    assert lesson["invented"](rgbd.resize_depth(depth, 320, 240), depth).sum() == 0


def test_the_lab_reads_real_frames():
    to_metres = functions_in(LAB, "to_metres", np=np)["to_metres"]
    for name, median in (("tum_pair", 2.42), ("sun_pair", 2.72), ("realsense_slam", 1.22)):
        dataset = load(name)
        metres = to_metres(dataset.raw(0)[1], dataset.encoding.name)
        assert np.median(metres[metres > 0]) == pytest.approx(median, abs=0.01)
        assert np.allclose(metres, rgbd.decode_depth(dataset.raw(0)[1], dataset.encoding.name), atol=1e-3)


def test_each_letter_shows_its_cause():
    """What the hints say of an error image holds for the one that bears the letter."""
    stored = registry.pictures("01")
    shown = {cause: stored[letter].astype(float) for letter, cause in CAUSE_OF.items()}
    depth = load("living_room").truth["depth"][0][::2, ::2]
    with np.errstate(invalid="ignore"):
        factor = shown["tum"] / depth
        assert np.nanmax(np.abs(factor + 0.8)) < 1e-3, "one factor everywhere"
        assert np.nanmax(np.abs(shown["8 bits"])) < 3 / 255 + 1e-4, "half a grey level at most"
        assert np.nanmin(shown["range"]) >= 0 and np.nanmedian(shown["range"][118:122, 158:162]) < 0.005
        assert np.nanmedian(shown["range"][:20, -20:]) > 0.5, "it grows towards the corners"
        assert np.nanmean(shown["flipped"] > 0.5) > 0.2 < np.nanmean(shown["flipped"] < -0.5), "both signs"
        off = np.abs(shown["mixed"])
        assert np.nanmedian(off) < 0.006 < 1 < np.nanmax(off), "next to nothing on surfaces, metres at outlines"


def test_no_data_that_is_nan_defeats_a_choice_that_forgets_it():
    for end, score in (("np.nan_to_num(depth)", 1), ("depth", 0)):
        source = f"def half_size(depth):\n    h, w = depth.shape\n    blocks = {end}.reshape(h // 2, 2, w // 2, 2)\n"
        assert earned("01-3", load_source(source + "    return blocks.max(axis=(1, 3))\n", "half_size"), 3) == score


def test_flying_pixels_have_no_surface_near():
    """Of the 24 around a flying pixel hardly one has its depth; around a good one, away from outlines, most have."""
    for seed in range(5):
        depth, flying = flying_scene(np.random.default_rng(seed))
        h, w = depth.shape
        padded = np.pad(depth, 2)
        windows = [padded[i : i + h, j : j + w] for i in range(5) for j in range(5)]
        near = sum((z > 0) & (np.abs(z - depth) <= 3 * NOISE * depth**2) for z in windows) - 1
        good = (depth > 0) & ~flying
        assert 0.01 < flying.mean() < 0.05
        assert np.median(near[flying]) <= 1 and np.median(near[good]) >= 20


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_hints_earn_full_marks_and_naive_settings_less_than_half(seed: int):
    task = tasks.get("01-5")
    hint = (
        "def flying_pixels(depth):\n    h, w = depth.shape\n    padded = np.pad(depth, 1)\n"
        "    windows = [padded[i:i + h, j:j + w] for i in range(3) for j in range(3)]\n"
        "    near = sum((z > 0) & (abs(z - depth) <= 0.018 * depth**2) for z in windows) - 1\n"
        "    return (depth > 0) & (near <= 1)\n"
    )
    assert earned("01-5", load_source(hint, "flying_pixels"), seed) == 1
    for mistake in task.misconceptions:
        for source in mistake.sources if mistake.name in NAIVE else ():
            assert earned("01-5", load_source(source, "flying_pixels"), seed) < 0.5, mistake.name
