"""The parts of lab 01's answers: what is wrong with a range, a small image or a mask that nobody has a name for."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case
from course_lib.tasks.diagnosis.anatomy import of_rounding
from course_lib.tasks.labs.lab_01_rgbd_images.wall import MILLIMETRE
from course_lib.tasks.plain import Plain

Found = tuple[str, str]
MANY = 0.25
"""A kind of pixel is spoken of where it makes so large a share of the wrong ones."""
OUTLINE = 0.08
"""Of 1 / z, 1 / metres: neighbours that differ by more, 13 times task 5's noise, are on two sides of an outline."""


def range_anatomy(case: Case, answer: Plain) -> Found | None:
    """Which part of a range image is wrong: its holes, what it depends on, where it is shortest, its outer part."""
    depth, f, cx, cy = case.given.values()
    a, held = np.asarray(answer, float), depth > 0
    if (np.abs(a - case.truth)[held] <= MILLIMETRE).all():
        count = int((a[~held] != 0).sum())
        return "holes filled", f"Only pixels without a measurement are wrong ({count:,}): 0 stays 0."
    if not (np.abs(a - case.truth) > MILLIMETRE)[1:-1, 1:-1].any():
        return None  # only at the border
    v, u = np.nonzero(held)
    z, longer, right = depth[held], a[held] / depth[held], case.truth[held] / depth[held]
    if np.ptp(longer / right) < 1e-4 or not longer.any():
        return None
    same = np.abs(longer - 1) < 1e-9
    if MANY < same.mean() < 1:
        return "depths left as they were", (
            f"In {np.mean(same):.0%} of the pixels the depth came back as it was: multiply each by the length "
            "of its string."
        )
    if _follows(longer, (u - cx) / f, (v - cy) / f, z):
        return "depends on the depth", (
            "Range divided by depth differs between pixels beside each other where their depths differ: it must "
            "follow from the pixel alone. Is every side at depth z?"
        )
    if (longer < 1 - 1e-3).mean() > 0.05:
        return "shorter than the depth", (
            f"In {np.mean(longer < 1):.0%} of the pixels the string is shorter than z, which is one of its own sides: "
            "add to z squared, never take away."
        )
    least = np.argsort(longer)[:3]
    alone = np.count_nonzero(longer < longer.min() + 1e-3) < 0.01 * len(longer) + 4
    place = np.mean(u[least]), np.mean(v[least])
    if alone and np.hypot(place[0] - cx, place[1] - cy) > 2:
        return "shortest at another pixel", (
            f"Your string is shortest, beside z, about column {place[0]:.0f}, row {place[1]:.0f}: it must be at the "
            f"principal point, column {cx:.0f}, row {cy:.0f}."
        )
    off = np.abs(longer / right - 1)
    near = np.hypot(u - cx, v - cy) < 0.2 * max(depth.shape)
    if near.any() and off[near].mean() < 0.5 * off[~near].mean():
        side = "long" if np.median(longer - right) > 0 else "short"
        return "wrong away from the middle", (
            f"Straight ahead the range is right; away from there the string is too {side}: look at how the two sides "
            "across the image go into the root."
        )
    return None


def _follows(longer: np.ndarray, a: np.ndarray, b: np.ndarray, z: np.ndarray) -> bool:
    """Whether range over depth follows from the depth, too, and not from the pixel alone."""
    pixel = np.stack([np.ones(len(a)), a, b, a * a, b * b, a * b, abs(a), abs(b), np.hypot(a, b)], axis=1)
    more = np.concatenate([pixel, np.stack([z, 1 / z, a * a / z**2, b * b / z**2], axis=1)], axis=1)
    alone, both = (_left(terms, longer) for terms in (pixel, more))
    return alone > 0.02 * np.ptp(longer) and both < alone / 4


def _left(terms: np.ndarray, values: np.ndarray) -> float:
    return float(np.std(values - terms @ np.linalg.lstsq(terms, values, rcond=None)[0]))


def encoding_anatomy(case: Case, answer: Plain) -> Found | None:
    """What is wrong with one encoding: pixels without data, the number of steps, or digits."""
    name, raw, a = case.given["encoding"], case.given["raw"], np.asarray(answer, float)
    empty, wrong = case.truth == 0, np.abs(a - case.truth) > 1e-4
    if not wrong[~empty].any():
        more = " (0 and 65535)" if name == "realsense" else ""
        return "only pixels without data", f"With {name!r} only pixels without data{more} are wrong: they become 0."
    if (a < 0).any():
        return "below zero", (
            f"With {name!r} {int((a < 0).sum()):,} depths are below 0: from 32,768 on numbers are negative in "
            "signed 16 bits (int16); stay with uint16."
        )
    if (a[wrong] == 0).all():
        least = case.truth[wrong].min()
        return (
            "measured ones lost",
            f"With {name!r} {int(wrong.sum()):,} measured depths, from {least:.2f} m on, became 0.",
        )
    factor = a[~empty] / case.truth[~empty]
    if np.ptp(factor) <= 1e-4 * abs(np.median(factor)) and np.median(factor) != 0:
        more = ", and pixels with 65535 are not 0" if (raw == 65535).any() and a[raw == 65535].any() else ""
        return "another number of steps", (
            f"With {name!r} every depth is {np.median(factor):.4g} times the right one{more}: how many steps a metre?"
        )
    return None


def half_anatomy(case: Case, answer: Plain) -> Found | None:
    """Which kind of pixel of a small image is wrong: from elsewhere, mixed (with zeros, near with far), a hole."""
    depth, small = np.asarray(case.given["depth"]), np.asarray(answer, float)
    four = np.stack([depth[i::2, j::2] for i in (0, 1) for j in (0, 1)], axis=-1)
    measured = (four > 0).any(axis=-1)
    nearest = np.where(four > 0, four, np.inf).min(axis=-1)
    off = np.where(four > 0, np.abs(four - small[..., None]), np.inf).min(axis=-1)
    wrong = np.where(measured, off, np.abs(small)) > MILLIMETRE
    known = depth[depth > 0]
    elsewhere = wrong & (small > 0) & (np.abs(known[:, None] - small.ravel()).min(axis=0) < 1e-9).reshape(small.shape)
    which = np.where(four > 0, np.abs(four - small[..., None]), np.inf).argmin(axis=-1)
    chosen = np.take_along_axis(four, which[..., None], axis=-1)[..., 0]
    if found := of_rounding(small[measured], chosen[measured]):
        return found
    kinds = {
        "depths of other pixels": (
            elsewhere,
            "are depths of pixels that they do not cover: take rows 2i, 2i + 1 and columns 2j, 2j + 1 for row i, "
            "column j",
        ),
        "whole numbers": (
            wrong & (small == np.round(small)).all() & small.any(),
            "are whole numbers: is the result kept in a whole-number type, or is it a place (argmax) and not a depth?",
        ),
        "farther than all": (
            wrong & measured & ~elsewhere & (small > four.max(axis=-1) + MILLIMETRE),
            "are farther than all that they cover: is something added up, or a stand-in left?",
        ),
        "mixed with zeros": (
            wrong & measured & ~elsewhere & (small > 0) & (small < nearest),
            "are nearer than all that they cover: zeros were mixed in, and 0 is no depth",
        ),
        "near and far mixed": (
            wrong & measured & ~elsewhere & (small > nearest),
            "lie between the depths that they cover: that is a mixture, choose one of them",
        ),
        "holes for measured ones": (
            wrong & measured & (small == 0),
            "are 0 though one of their four was measured: choose among the measured ones only",
        ),
        "holes filled": (wrong & ~measured, "are not 0 though none of their four was measured"),
    }
    for name, (which, words) in kinds.items():
        if which.sum() >= MANY * max(wrong.sum(), 1):
            return name, f"{int(which.sum()):,} of {int(wrong.sum()):,} wrong pixels {words}."
    return None


def _share(marked: np.ndarray, among: np.ndarray) -> float:
    return float(marked[among].mean()) if among.any() else 0.0


def half_refused(case: Case, answer: Plain) -> Found | None:
    """Whether a small image was chosen along other axes, or where NaN came out of it: beside measured depths or not."""
    depth, small = np.asarray(case.given["depth"]), np.asarray(answer)
    h, w = depth.shape[0] // 2, depth.shape[1] // 2
    if small.shape in ((2, 2), (h, 2), (w, 2), (h, w, 2), (h, 2, w)):
        return "other axes", (
            f"The answer's shape is {small.shape}: of the blocks' shape (h/2, 2, w/2, 2) other axes are gone than 1 "
            "and 3, on which the four of a pixel stand."
        )
    if small.dtype.kind != "f" or small.shape != (h, w):
        return None
    measured = np.any([depth[i::2, j::2] > 0 for i in (0, 1) for j in (0, 1)], axis=0)
    lost, left = int((np.isnan(small) & measured).sum()), int((np.isnan(small) & ~measured).sum())
    if lost:
        return "NaN beside measured ones", (
            f"{lost:,} pixels are NaN though one of their four was measured: NaN wins over every number in max, min, "
            "mean and median. It is no data, as 0 is."
        )
    return ("NaN for 0", f"{left:,} pixels are NaN where none of the four was measured: 0 is asked.") if left else None


def flying_anatomy(case: Case, answer: Plain) -> Found | None:
    """Which kind of pixel is marked or missed: holes, the image's border, outlines, surfaces far away, flying ones."""
    depth, true, marked = np.asarray(case.given["depth"]), case.truth, np.asarray(answer, bool)
    extra, missed = marked & ~true, true & ~marked
    hits = int((marked & true).sum())
    if not marked.any():
        return "nothing marked", "No pixel is marked."
    padded = np.pad(depth, 1)
    h, w = depth.shape
    around = np.stack([padded[i : i + h, j : j + w] for i in range(3) for j in range(3)])
    gap = np.abs(1 / np.maximum(around, 0.1) - 1 / np.maximum(depth, 0.1))  # its noise is the same everywhere
    jump = np.where(around > 0, gap, 0).max(axis=0) > OUTLINE
    border = np.ones(depth.shape, bool)
    border[1:-1, 1:-1] = False
    holes = depth == 0
    good = ~true & ~holes & ~border & ~jump
    middle = float(depth.max() / 2)
    far, close = good & (depth > middle), good & (depth <= middle)
    noisy = far & marked & (_share(marked, close) < _share(marked, far) / 4)
    kinds = (
        ("holes marked too", extra & holes, "are holes: they were not measured, so ask for depth > 0 as well"),
        (
            "the border marked",
            extra & border & ~holes & ~jump,
            "lie at the image's border, where neighbours are missing: ask for a share of those that are there",
        ),
        (
            "far ones marked",
            noisy,
            f"are good ones on surfaces farther than {middle:.1f} m: noise grows with the depth squared, and so must "
            "the limit",
        ),
        (
            "good ones beside outlines marked",
            extra & jump & ~holes,
            "are good ones beside an outline, which have a far neighbour, too, but several near ones: count those "
            "that are near in depth",
        ),
        (
            "surfaces marked",
            extra & ~jump & ~holes & ~border,
            "are good ones inside surfaces, away from outlines: their noise, or their depth alone, is taken for flying",
        ),
    )
    for name, which, words in kinds:
        if extra.sum() > missed.sum() / 2 and which.sum() > max(extra.sum() / 3, 0.1 * true.sum()):
            return name, f"{int(which.sum()):,} of the {int(marked.sum()):,} marked pixels {words}."
    if missed.sum() < 0.1 * true.sum():
        return None
    return "flying ones missed", (
        f"{int(missed.sum()):,} of {hits + int(missed.sum()):,} flying pixels are not marked: which part of your "
        "condition is too strict for them?"
    )
