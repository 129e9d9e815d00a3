"""The parts of lab 03's answers: which of depth, rays and colours is wrong, and which camera the points belong to."""

from __future__ import annotations

import math

import numpy as np

from course_lib.tasks.core import Case
from course_lib.tasks.diagnosis.anatomy import of_rounding
from course_lib.tasks.plain import Plain

Found = tuple[str, str]
NEAR = 2e-4  # metres


def deproject_anatomy(case: Case, answer: Plain) -> Found | None:
    """Which part of an image of points is wrong: z first, then x, then y."""
    image, fx, fy, cx, cy, left, top = case.given.values()
    v, u = np.nonzero(image > 0)
    points = np.asarray(answer, float)[v, u]
    return _of_points(points, case.truth[v, u], u + left, v + top, (fx, fy, cx, cy))


def cloud_anatomy(case: Case, answer: Plain) -> Found | None:
    """Which part of a cloud is wrong: its points (z first), else its colours."""
    K = case.given["camera_matrix"]
    v, u = np.nonzero(case.given["raw"])
    points, colors = np.asarray(answer["points"], float), np.asarray(answer["colors"])
    found = _of_points(points, case.truth["points"], u, v, (K[0, 0], K[1, 1], K[0, 2], K[1, 2]))
    if found is None and (np.abs(points - case.truth["points"]) <= NEAR).all():
        if (np.sort(colors, axis=0) == np.sort(case.truth["colors"], axis=0)).all():
            return "only the colours", (
                "The points are right, and so are the colours, but in another order: colour i belongs to point i."
            )
        return "only the colours", "The points are right; only the colours are wrong."
    return found


def _of_points(
    p: np.ndarray, true: np.ndarray, u: np.ndarray, v: np.ndarray, camera: tuple[float, float, float, float]
) -> Found | None:
    off = np.abs(p - true).max(axis=0)
    z = true[:, 2]
    if (off <= NEAR).all():
        return None
    if sorted(map(tuple, np.round(p, 4))) == sorted(map(tuple, np.round(true, 4))):
        return "points in another order", "These are the right points in another order: row by row is asked."
    shift = np.median(p - true, axis=0)
    if np.abs(p - true - shift).max() <= NEAR and np.ptp(z) > 0.01:
        words = ", ".join(f"{value:.3g} m in {axis}" for axis, value in zip("xyz", shift, strict=True))
        return (
            "one shift for all",
            f"All points are moved by one shift, {words}: is a mean subtracted?",
        )
    if found := of_rounding(p, true):
        return found
    if off[2] > NEAR:
        if found := of_rounding(p[:, 2], z):
            return f"z {found[0]}", f"Of z: {found[1][0].lower()}{found[1][1:]}"
        with np.errstate(divide="ignore", invalid="ignore"):
            factor, rays = p[:, 2] / z, p[:, :2] / p[:, 2:] - true[:, :2] / true[:, 2:]
        along = np.isfinite(rays).all() and np.abs(rays * z[:, None]).max() <= 10 * NEAR
        one = f", by one factor, {np.median(factor):.4g}" if np.ptp(factor) <= 1e-4 * abs(np.median(factor)) else ""
        if along:
            return "only the depth", f"Each point lies on its right ray, but z is wrong{one}: mend the depth alone."
        alone = (off[:2] <= NEAR).all()
        rest = "x and y are right." if alone else "x and y may only follow from it: mend z first."
        return ("only z" if alone else "z first"), f"z is wrong{one}; {rest}"
    for axis, (values, own, other, f, c) in {
        "x": (p[:, 0] / z, u, v, camera[0], camera[2]),
        "y": (p[:, 1] / z, v, u, camera[1], camera[3]),
    }.items():
        if off["xy".index(axis)] > NEAR:
            if np.ptp(own) and np.abs(p[:, "xy".index(axis)] - (own - c) / f).max() <= NEAR:
                return f"{axis} without depth", f"z is right; {axis} was never multiplied by it: {axis} grows with z."
            return _of_axis(axis, values, own, other, f, c)
    return None


def _of_axis(axis: str, slope: np.ndarray, own: np.ndarray, other: np.ndarray, f: float, c: float) -> Found:
    """Which camera one coordinate over z belongs to: it must be (pixel - c) / f."""
    pixel, wrong_pixel = ("column", "row") if axis == "x" else ("row", "column")
    for counted, name in ((own, pixel), (other, wrong_pixel)):
        if np.ptp(counted) == 0:
            continue
        rate, start = np.polyfit(counted, slope, 1)
        if np.abs(slope - rate * counted - start).max() > 1e-3 * max(np.ptp(slope), 1e-9) or rate == 0:
            continue
        fitted, centre = 1 / rate, -start / rate
        if name == wrong_pixel:
            return f"{axis} from {name}s", f"z is right; {axis} follows the {name} of a pixel, not its {pixel}."
        if abs(fitted / f + 1) < 1e-3:
            return (
                f"{axis} the other way",
                f"z is right; {axis} runs the other way: was the last {name} number 0?",
            )
        if abs(fitted / f - 1) > 1e-3:
            more = "" if abs(centre - c) < 0.02 else f" and {centre:.4g} for c{axis}, which is {c:.4g}"
            says = f"z is right; {axis} is that of a camera with {fitted:.4g} for f{axis}, which is {f:.4g}{more}."
            return f"f{axis}", says
        return f"c{axis}", f"z is right; {axis} is that of a camera with {centre:.4g} for c{axis}, which is {c:.4g}."
    return f"{axis} not along rays", (
        f"z is right, but {axis} / z does not grow evenly with the {pixel}: {axis} must be "
        f"({pixel} − c{axis}) · z / f{axis}."
    )


def focal_anatomy(case: Case, answer: Plain) -> Found | None:
    """Where an estimate lies among those of the single things: one of them, outside of all, or pulled by nonsense."""
    pixels, depths, lengths, cx, cy = case.given.values()
    said, true = float(np.asarray(answer).reshape(())), case.truth
    known = {
        "times 1000": (1000 * true, "about 1000 times the right one: millimetres and metres are a factor of 1000"),
        "divided by 1000": (true / 1000, "about a thousandth of the right one: millimetres for metres"),
        "squared": (true**2, "about the square of the right one: a root is missing"),
        "upside down": (1 / true, "about 1 / f: a quotient is upside down"),
        "doubled": (2 * true, "about twice the right one: half of something is taken whole"),
        "halved": (true / 2, "about half of the right one: something is halved once too often"),
    }
    name = min(known, key=lambda n: abs(math.log(said / known[n][0])))
    if abs(math.log(said / known[name][0])) < (0.012 if name in ("doubled", "halved") else 0.3):
        return name, f"The focal length is {known[name][1]}."
    across = np.diff((pixels - [cx, cy]) * depths[..., None], axis=1)[:, 0]
    beside = lengths**2 - np.diff(depths, axis=1)[:, 0] ** 2
    each = np.sort(np.hypot(*across.T)[beside > 0] / np.sqrt(beside[beside > 0]))
    if np.abs(each - said).min() < 1e-6 * said and abs(said / true - 1) > 0.005:
        return "one thing alone", "This is what one of the things says alone: take the middle of all."
    if found := of_rounding(np.array([said]), np.array([true])):
        return found
    by = f"{100 * abs(said / true - 1):.1f} % too {'large' if said > true else 'small'}"
    if not each[0] <= said <= each[-1]:
        return "outside of all", (
            f"It is {by}, which no single thing says: the estimate of each is wrong before a middle is taken, or "
            "things are in it that are not possible (length² − Δz² below 0)."
        )
    if abs(said / true - 1) < 0.04:
        return "near, not yet right", (
            f"It is {by}: near, but some nonsense things still count, or each estimate is a little wrong "
            "(a depth of its own for each end?)."
        )
    if said > 1.4 * true:
        return (
            "far too large",
            f"It is {by}, more than most things say: look at the formula of each.",
        )
    if said > true:
        return "pulled by nonsense", (
            f"It is {by}, as things with the depth of the background at one end make it: they still count, take a "
            "middle that they do not move."
        )
    return "each too small", (
        f"It is {by}, and things with the depth of the background would make it too large: so the estimate of each is "
        "too small. Is all of its length across the image used, and its slant taken out?"
    )
