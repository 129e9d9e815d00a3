"""The wrong answers of lab 03's task 5, as learner code: building blocks of an estimate, each with one thing wrong."""

from __future__ import annotations

from course_lib.tasks.core import Misconception

_SLANT = "lengths**2 - (depths[:, 0] - depths[:, 1]) ** 2"


def _wrong_estimate(
    middle: str = "np.nanmedian(f)",
    z: str = "depths",
    beside: str = f"np.sqrt({_SLANT})",
    across: str = "np.hypot(x[:, 0] - x[:, 1], y[:, 0] - y[:, 1])",
    x: str = "(pixels[..., 0] - cx) * z",
    y: str = "(pixels[..., 1] - cy) * z",
    each: str = "across / beside",
) -> str:
    return (
        "def estimate_focal(pixels, depths, lengths, cx, cy):\n"
        f"    z = {z}\n"
        f"    x, y = {x}, {y}\n"
        "    with np.errstate(invalid='ignore', divide='ignore'):\n"
        f"        beside = {beside}\n"
        f"        across = {across}\n"
        f"        f = {each}\n"
        f"        return {middle}\n"
    )


def _break_it(middle: str, guess: int = 525) -> str:
    """A guessed f times measured over true length, with the lengths measured in space."""
    return (
        "def estimate_focal(pixels, depths, lengths, cx, cy):\n"
        f"    x, y = (pixels[..., 0] - cx) * depths / {guess}, (pixels[..., 1] - cy) * depths / {guess}\n"
        "    ends = np.stack([x, y, depths], axis=-1)\n"
        "    measured = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)\n"
        f"    return {guess} * {middle}(measured / lengths)\n"
    )


_MEAN_DEPTH = "depths.mean(axis=1, keepdims=True)"

ESTIMATE_MISTAKES = (
    Misconception(
        "mean of all",
        "a mean over things of which some have the depth of the background at one end: use something that outliers do "
        "not move, such as the median",
        _wrong_estimate("np.nanmean(f)"),
        variants=(
            _wrong_estimate("np.mean(f)", beside=f"np.sqrt(np.abs({_SLANT}))"),
            _wrong_estimate("np.sqrt(np.nanmean(f**2))"),
            _wrong_estimate("np.exp(np.nanmean(np.log(f)))"),
            _wrong_estimate("1 / np.nanmean(1 / f)"),
        ),
    ),
    Misconception(
        "least squares over all",
        "sums over all things, to which those with the depth of the background add most: estimate f for each thing, "
        "then take the median",
        _wrong_estimate("np.nansum(across * np.isfinite(f)) / np.nansum(beside)"),
        variants=(
            _wrong_estimate("np.sqrt(np.nansum(across**2 * np.isfinite(f)) / np.nansum(beside**2))"),
            _wrong_estimate(f"np.sqrt(np.sum(across**2) / np.sum({_SLANT}))"),
            _wrong_estimate("np.sqrt(np.nansum(across**4 * np.isfinite(f)) / np.nansum(across**2 * beside**2))"),
        ),
    ),
    Misconception(
        "totals, slant and all",
        "totals of all things compared, with their slant and with nonsense: take the slant out, estimate f for each "
        "thing, then take the median",
        _wrong_estimate("np.sum(across) / np.sum(lengths)"),
        variants=(
            _wrong_estimate("np.median(across) / np.median(lengths)"),
            _wrong_estimate("np.sqrt(np.sum(across**2) / np.sum(lengths**2))"),
            _wrong_estimate("np.sum(across * lengths) / np.sum(lengths**2)"),
        ),
    ),
    Misconception(
        "the largest or smallest",
        "the largest or the smallest of all estimates, which is surely a nonsense one: take the middle one",
        _wrong_estimate("np.nanmax(f)"),
        variants=(_wrong_estimate("np.nanmin(f)"), _wrong_estimate("(np.nanmin(f) + np.nanmax(f)) / 2")),
    ),
    Misconception(
        "not the middle one",
        "a place other than the middle among the estimates: nonsense ones are all at one side, so the middle is the "
        "safest; take the median",
        _wrong_estimate("np.nanpercentile(f, 90)"),
        variants=(_wrong_estimate("np.nanpercentile(f, 95)"),),
    ),
    Misconception(
        "slant forgotten",
        "the whole length compared with what is seen across the image: part of it goes into the difference of the two "
        "depths",
        _wrong_estimate(beside="lengths"),
        variants=(_wrong_estimate("np.mean(f)", beside="lengths"),),
    ),
    Misconception(
        "slant added",
        "the square of the depth difference added to that of the length: the length is the longest side, subtract",
        _wrong_estimate(beside=f"np.sqrt({_SLANT.replace(' - (', ' + (', 1)})"),
        variants=(_wrong_estimate("np.mean(f)", beside=f"np.sqrt({_SLANT.replace(' - (', ' + (', 1)})"),),
    ),
    Misconception(
        "slant not squared",
        "the depth difference subtracted from the length: subtract the squares, then take the root",
        _wrong_estimate(beside="lengths - abs(depths[:, 0] - depths[:, 1])"),
        variants=(
            _wrong_estimate(beside="abs(lengths - (depths[:, 0] - depths[:, 1]))"),
            _wrong_estimate(beside="abs(lengths - (depths[:, 1] - depths[:, 0]))"),
            _wrong_estimate(beside=f"np.sqrt({_SLANT.replace('lengths**2', 'lengths')})"),
        ),
    ),
    Misconception(
        "root forgotten",
        "f squared handed back: length squared minus depth difference squared holds 1 / f squared, take the root",
        _wrong_estimate(each="(across / beside) ** 2"),
        variants=(
            _wrong_estimate("np.nanmean(f)", each="(across / beside) ** 2"),
            _wrong_estimate("np.median(f)", each=f"across**2 / ({_SLANT})"),
            _wrong_estimate("np.mean(f)", each=f"across**2 / ({_SLANT})"),
        ),
    ),
    Misconception(
        "a square left on one side",
        "a quotient of a square and a length: square both or neither",
        _wrong_estimate(each=f"across / ({_SLANT})"),
        variants=(_wrong_estimate(each="across**2 / beside"),),
    ),
    Misconception(
        "one depth for both ends",
        "one depth used for both ends: each end has its own, and their difference is part of the length",
        _wrong_estimate(beside="lengths", z=_MEAN_DEPTH),
        variants=(
            _wrong_estimate("np.mean(f)", beside="lengths", z=_MEAN_DEPTH),
            _wrong_estimate(beside="lengths", z="depths.mean()"),
            _wrong_estimate(beside="lengths", z="depths[:, :1]"),
            _wrong_estimate(beside="lengths", z="depths[:, 1:]"),
            _wrong_estimate(beside="lengths", z="depths.max(axis=1, keepdims=True)"),
            _wrong_estimate(beside="lengths", z="depths.min(axis=1, keepdims=True)"),
        ),
    ),
    Misconception(
        "depth left out",
        "pixels compared with lengths without any depth: multiply what is seen in pixels by the depth of each end",
        _wrong_estimate(z="1.0"),
        variants=(_wrong_estimate(z="1.0", beside="lengths"), _wrong_estimate(each="across / beside / depths.mean(1)")),
    ),
    Misconception(
        "divided by the depth",
        "pixels divided by the depth: x = (u - cx) z / f, so multiply",
        _wrong_estimate(x="(pixels[..., 0] - cx) / z", y="(pixels[..., 1] - cy) / z"),
        variants=(_wrong_estimate(x="(pixels[..., 0] - cx) / z", y="(pixels[..., 1] - cy) / z", beside="lengths"),),
    ),
    Misconception(
        "columns only",
        "only columns used: things also lie up and down in the image, so rows belong into the length as well",
        _wrong_estimate(across="abs(x[:, 0] - x[:, 1])"),
        variants=(
            _wrong_estimate(across="abs(y[:, 0] - y[:, 1])"),
            _wrong_estimate("np.nanmean(f)", across="abs(x[:, 0] - x[:, 1])"),
        ),
    ),
    Misconception(
        "sides added",
        "the two sides across the image added up: add their squares and take the root",
        _wrong_estimate(across="abs(x[:, 0] - x[:, 1]) + abs(y[:, 0] - y[:, 1])"),
    ),
    Misconception(
        "principal point forgotten",
        "pixels counted from the corner of the image: subtract cx and cy before the depths multiply them",
        _wrong_estimate(x="pixels[..., 0] * z", y="pixels[..., 1] * z"),
        variants=(_wrong_estimate("np.nanmean(f)", x="pixels[..., 0] * z", y="pixels[..., 1] * z"),),
    ),
    Misconception(
        "upside down",
        "1 / f handed back: the pixels stand above, the metres below",
        _wrong_estimate(each="beside / across"),
        variants=(_wrong_estimate("np.nanmean(f)", each="beside / across"),),
    ),
    Misconception(
        "principal point from the size",
        "the middle of a 640x480 image used as principal point: this camera's lies beside it, use cx and cy",
        _wrong_estimate(x="(pixels[..., 0] - 319.5) * z", y="(pixels[..., 1] - 239.5) * z"),
        variants=(
            _wrong_estimate(x="(pixels[..., 0] - 320) * z", y="(pixels[..., 1] - 240) * z"),
            _wrong_estimate("np.nanmean(f)", x="(pixels[..., 0] - 319.5) * z", y="(pixels[..., 1] - 239.5) * z"),
        ),
    ),
    Misconception(
        "rows for columns",
        "cy subtracted from columns and cx from rows: the first number of a pixel is its column u, which belongs to cx",
        _wrong_estimate(x="(pixels[..., 1] - cx) * z", y="(pixels[..., 0] - cy) * z"),
    ),
    Misconception(
        "one or a few things alone",
        "one thing, or the first few: some have the depth of the background, and nobody says which; use all of them",
        _wrong_estimate("f[np.isfinite(f)][0]"),
        variants=(_wrong_estimate("f[np.isfinite(f)][-1]"), _wrong_estimate("np.nanmean(f[:10])")),
    ),
    Misconception(
        "the lesson's own code",
        "Break it's rule, which holds for a length that lies across the image and was measured well: yours also slant "
        "in depth, so take Δz out first, and some are nonsense",
        _break_it("np.median"),
        variants=(
            _break_it("np.mean"),
            _break_it("np.median", 400),
            _break_it("np.median", 600),
            _break_it("np.mean", 400),
            _break_it("(lambda every: every[0])"),
        ),
    ),
)
