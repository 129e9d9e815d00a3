"""Books: single ones, piles, and a shelf of them."""

from __future__ import annotations

import numpy as np

from course_lib.simulate import pictures, textures
from course_lib.simulate.furniture import WALNUT, Point, Rng, block, one_colour, painted, placed, wooden
from course_lib.simulate.scene_model import Surface
from course_lib.simulate.textures import Colour

TITLES = tuple(
    title.replace("-", " ")
    for title in (
        "MANY-VIEWS RIGID-MOTION VOXELS ODOMETRY LEAST-SQUARES STEREO POISSON NORMALS OUTLIERS QUATERNIONS RANSAC "
        "LASERS BUNDLES SURFACES NOISE CALIBRATION DEPTH ROBOTS MAPS KALMAN TWISTS EPIPOLES"
    ).split()
)


def book(rng: Rng, size: Point, at: Point, *, T: np.ndarray | None = None, title: str, colour: Colour) -> list[Surface]:
    """An upright book: ``size`` is thickness, depth and height; its back faces -y."""
    back = pictures.spine(rng, *textures.shape_of(size[0], size[2], 0.0012), title, colour)
    pages = textures.tint((236, 228, 206), 0.05 * rng.standard_normal((8, 40)).astype(np.float32))
    faces = {"front": back, "top": pages, "bottom": pages, "back": pages}
    return block(rng, "books", size, at, paint=one_colour(colour), faces=faces, T=T, detail=0.25)


def lying_books(rng: Rng, at: Point, yaw: float, count: int = 3) -> list[Surface]:
    """A pile of books, each turned a little, backs to the front."""
    out, height = [], at[2]
    titles = rng.permutation(len(TITLES))
    for k in range(count):
        thick, deep, long = rng.uniform(0.025, 0.045), 0.21 - 0.015 * k, 0.30 - 0.025 * k
        colour, title = pictures.INKS[(k + 1) % len(pictures.INKS)], TITLES[titles[k]]
        back = np.rot90(pictures.spine(rng, *textures.shape_of(thick, long, 0.001), title, colour))
        pages = textures.tint((236, 228, 206), 0.05 * rng.standard_normal((30, 8)).astype(np.float32))
        cover = pictures.printed_box(210, 300, (title, "a first course"), colour, (246, 238, 214))
        faces = {"front": np.ascontiguousarray(back), "left": pages, "right": pages, "back": pages, "top": cover}
        turn = yaw + rng.uniform(-9, 9)
        out += block(rng, "books", (long, deep, thick), (at[0], at[1], height), turn, painted(colour), faces, 0.01)
        height += thick
    return out


def bookshelf(rng: Rng, at: Point, yaw: float = 0.0, size: Point = (1.1, 0.30, 1.9), shelves: int = 5) -> list[Surface]:
    """An open shelf full of books."""
    T, (w, d, h), paint = placed(at, yaw), size, wooden(WALNUT)
    out = block(rng, "bookshelf", (w, 0.015, h), (0, d / 2 - 0.008, 0), paint=paint, texel=0.008, T=T)
    for x in (-1, 1):
        out += block(rng, "bookshelf", (0.025, d, h), (x * (w / 2 - 0.0125), 0, 0), paint=paint, texel=0.006, T=T)
    step = (h - 0.03) / shelves
    for k in range(shelves + 1):
        out += block(rng, "bookshelf", (w - 0.05, d - 0.02, 0.025), (0, 0, k * step), paint=paint, texel=0.006, T=T)
    for k in range(shelves):
        x, end = -w / 2 + 0.03, w / 2 - 0.05 - rng.uniform(0, 0.22)
        while x < end:
            thick, tall = rng.uniform(0.024, 0.052), step * rng.uniform(0.62, 0.88)
            colour = np.asarray(pictures.INKS[int(rng.integers(len(pictures.INKS)))]) * rng.uniform(0.75, 1.15)
            if rng.random() < 0.2:
                colour = np.array((224, 214, 190))
            spot = (x + thick / 2, -d / 2 + 0.11 + rng.uniform(0, 0.03), k * step + 0.025)
            title = TITLES[int(rng.integers(len(TITLES)))]
            out += book(rng, (thick, 0.19, tall), spot, T=T, title=title, colour=colour.clip(0, 255))
            x += thick + 0.001
    return out
