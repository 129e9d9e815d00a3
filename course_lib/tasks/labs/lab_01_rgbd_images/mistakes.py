"""The wrong answers of lab 01's tasks 1 and 2, as learner code: what each looks like, and what to do about it.

Each source is the plain solution with one thing wrong, built from parts, so that nothing else differs.
"""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _range(expression: str, a: str = "(u - cx) / f", b: str = "(v - cy) / f") -> str:
    return (
        "def range_from_depth(depth, f, cx, cy):\n"
        "    v, u = np.indices(depth.shape)\n"
        "    h, w = depth.shape\n"
        f"    a, b = {a}, {b}\n"
        f"    return {expression}\n"
    )


_RIGHT = "depth * np.sqrt(1 + a**2 + b**2)"
_MEASURED = "np.where(depth > 0, {}, 0)"

RANGE_MISTAKES = (
    Misconception(
        "depth for range",
        "depth handed back as it came: z is one side of the triangle, the string is the long one",
        _range("depth"),
    ),
    Misconception(
        "square root forgotten",
        "the squares added up, but no root taken: it would be right for (range / z) squared",
        _range("depth * (1 + a**2 + b**2)"),
        variants=(_range("depth**2 * (1 + a**2 + b**2)"),),
    ),
    Misconception(
        "rows for columns",
        "u and v exchanged: u counts columns and goes with cx, v counts rows and goes with cy",
        _range(_RIGHT, "(v - cx) / f", "(u - cy) / f"),
    ),
    Misconception(
        "principal point forgotten",
        "pixels counted from the image's corner: subtract cx from u and cy from v first",
        _range(_RIGHT, "u / f", "v / f"),
    ),
    Misconception(
        "principal point added",
        "cx and cy added: subtract them, so that the pixel straight ahead has no side",
        _range(_RIGHT, "(u + cx) / f", "(v + cy) / f"),
    ),
    Misconception(
        "principal point from the size",
        "the middle of the image used as the principal point: use the cx and cy that you are given",
        _range(_RIGHT, "(u - (w - 1) / 2) / f", "(v - (h - 1) / 2) / f"),
        variants=(
            _range(_RIGHT, "(u - w / 2) / f", "(v - h / 2) / f"),
            _range(_RIGHT, "(u - h / 2) / f", "(v - w / 2) / f"),
        ),
    ),
    Misconception(
        "pixels counted from one",
        "pixels counted from 1: the first row and the first column are number 0",
        _range(_RIGHT, "(u + 1 - cx) / f", "(v + 1 - cy) / f"),
    ),
    Misconception(
        "half a pixel",
        "half a pixel added to u and v, or taken away: the centres of pixels lie at whole numbers already",
        _range(_RIGHT, "(u + 0.5 - cx) / f", "(v + 0.5 - cy) / f"),
        variants=(_range(_RIGHT, "(u - 0.5 - cx) / f", "(v - 0.5 - cy) / f"),),
    ),
    Misconception(
        "one direction only",
        "only columns used: the string also runs up or down, so v belongs in the root too",
        _range("depth * np.sqrt(1 + a**2)"),
    ),
    Misconception(
        "rows only",
        "only rows used: the string also runs left or right, so u belongs in the root too",
        _range("depth * np.sqrt(1 + b**2)"),
    ),
    Misconception(
        "the side z left out",
        "only the two sides across the image: z is the third, so 1 + belongs in the root",
        _range("depth * np.hypot(a, b)"),
    ),
    Misconception(
        "pixels added to metres",
        "pixels squared added to metres squared: divide u - cx and v - cy by f first",
        _range(_MEASURED.format("np.sqrt(depth**2 + (u - cx)**2 + (v - cy)**2)")),
        variants=(_range("np.sqrt(depth**2 + (u - cx)**2 + (v - cy)**2)"),),
    ),
    Misconception(
        "sides not at depth z",
        "the sides at z = 1 beside the depth itself: how far a pixel looks to the side grows with z, multiply by it",
        _range(_MEASURED.format("np.sqrt(depth**2 + a**2 + b**2)")),
        variants=(_range("np.sqrt(depth**2 + a**2 + b**2)"),),
    ),
    Misconception(
        "depth not multiplied",
        "the length of the string at z = 1 alone: multiply each depth by it",
        _range(_MEASURED.format("np.sqrt(1 + a**2 + b**2)")),
        variants=(_range("np.sqrt(1 + a**2 + b**2)"),),
    ),
    Misconception(
        "what is added to z alone",
        "only what the string is longer than z: add z itself",
        _range("depth * np.sqrt(1 + a**2 + b**2) - depth"),
    ),
    Misconception(
        "f outside the square",
        "u - cx squared before it was divided by f: f belongs inside the square, it is squared too",
        _range(_RIGHT.replace("a**2 + b**2", "(u - cx)**2 / f + (v - cy)**2 / f")),
    ),
    Misconception(
        "multiplied by f",
        "u - cx multiplied by f: divide, a longer f makes the pixel look less far to the side",
        _range(_RIGHT, "(u - cx) * f", "(v - cy) * f"),
    ),
    Misconception(
        "sides added",
        "the three sides added up: of a right-angled triangle add the squares, then take the root",
        _range("depth * (1 + abs(a) + abs(b))"),
        variants=(
            _range("depth * (1 + np.hypot(a, b))"),
            _range("depth * (np.sqrt(1 + a**2) + abs(b))"),
            _range("depth * (np.sqrt(1 + a**2) + b**2)"),
        ),
    ),
    Misconception(
        "two angles, one after the other",
        "a division by two cosines: the angles to the side and down do not add up so; put both sides under one root",
        _range("depth / (np.cos(np.arctan(a)) * np.cos(np.arctan(b)))"),
        variants=(
            _range("depth / np.cos(np.arctan(a) + np.arctan(b))"),
            _range("depth / (np.cos(a) * np.cos(b))"),
        ),
    ),
    Misconception(
        "side taken for the angle",
        "(u - cx) / f taken for an angle: it is that angle's tangent, so no cosine is needed",
        _range("depth / np.cos(np.hypot(a, b))"),
    ),
    Misconception(
        "squares subtracted",
        "a square subtracted: both sides make the string longer, add both squares",
        _range("depth * np.sqrt(abs(1 - a**2 - b**2))"),
        variants=(_range("depth * np.sqrt(abs(1 + a**2 - b**2))"), _range("depth * np.sqrt(abs(1 - a**2 + b**2))")),
    ),
    Misconception(
        "range to depth",
        "a division where a multiplication belongs: the string is longer than z, never shorter",
        _range("depth / np.sqrt(1 + a**2 + b**2)"),
    ),
)


_ROTATED = "(raw >> 3) | (raw << 13)"


def _encoding(
    sun: str = _ROTATED,
    overflow: str = "np.where(raw == 65535, 0, raw)",
    steps: str = '{"tum": 5000, "sun": 1000, "realsense": 1000}[encoding]',
    divide: str = "/",
    rotates: str = '["sun"]',
) -> str:
    return (
        "def to_metres(raw, encoding):\n"
        f"    if encoding in {rotates}:\n        raw = {sun}\n"
        f'    if encoding == "realsense":\n        raw = {overflow}\n'
        f"    return raw {divide} {steps}\n"
    )


def _steps(tum: int, sun: int, realsense: int) -> str:
    return f'{{"tum": {tum}, "sun": {sun}, "realsense": {realsense}}}[encoding]'


ENCODING_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "a division by the steps a metre and nothing more, as the lesson does it for its own file: SUN's bits come "
        "rotated, and a RealSense also says no data by 65535",
        _encoding(sun="raw", overflow="raw"),
        variants=("def to_metres(raw, encoding):\n    return raw.astype(np.float32) / 1000\n",),
    ),
    Misconception(
        "TUM read as millimetres",
        "TUM's numbers divided by 1000: TUM stores 5000 steps a metre",
        _encoding(steps="1000"),
    ),
    Misconception(
        "steps exchanged",
        "the steps a metre exchanged: 5000 belong to TUM, 1000 to SUN and RealSense",
        _encoding(steps=_steps(1000, 5000, 5000)),
    ),
    Misconception(
        "RealSense read with TUM's steps",
        "RealSense's numbers divided by 5000: RealSense stores 1000 steps a metre",
        _encoding(steps=_steps(5000, 1000, 5000)),
    ),
    Misconception(
        "SUN read with TUM's steps",
        "SUN's numbers divided by 5000: SUN stores 1000 steps a metre",
        _encoding(steps=_steps(5000, 5000, 1000)),
    ),
    Misconception(
        "5000 steps for all",
        "all numbers divided by 5000: only TUM stores so many steps a metre, the other two 1000",
        _encoding(steps="5000"),
    ),
    Misconception(
        "SUN not rotated",
        "SUN's numbers divided without rotating their bits three places to the right",
        _encoding(sun="raw"),
    ),
    Misconception(
        "SUN shifted, not rotated",
        "SUN's numbers shifted right: the three bits that fall out must come back at the top",
        _encoding(sun="raw >> 3"),
    ),
    Misconception(
        "SUN rotated the wrong way",
        "SUN's bits rotated to the left: the file is rotated left already, turn it back right",
        _encoding(sun="(raw << 3) | (raw >> 13)"),
        variants=(_encoding(sun="raw << 3"),),
    ),
    Misconception(
        "SUN not kept to 16 bits",
        "SUN's bits shifted left in wider numbers, where nothing falls out at the top: stay with uint16, or cut with "
        "& 0xFFFF",
        _encoding(sun="(raw.astype(np.int64) >> 3) | (raw.astype(np.int64) << 13)"),
        variants=(_encoding(sun="(raw >> 3) + raw * 8192.0"),),
    ),
    Misconception(
        "SUN joined with and",
        "SUN's two halves joined with &, which keeps what both have: join them with |",
        _encoding(sun="(raw >> 3) & (raw << 13)"),
    ),
    Misconception(
        "SUN's low bits alone",
        "only the half of SUN's bits that comes back at the top: join it with raw >> 3",
        _encoding(sun="raw << 13"),
    ),
    Misconception(
        "SUN rotated by another number of bits",
        "SUN's bits rotated, but not by three: what goes 3 to the right comes back 16 - 3 = 13 to the left",
        _encoding(sun="(raw >> 3) | (raw << 12)"),
        variants=tuple(
            _encoding(sun=f"(raw >> {right}) | (raw << {left})")
            for right, left in ((2, 14), (4, 12), (3, 14), (3, 3), (3, 5), (8, 8), (13, 13))
        ),
    ),
    Misconception(
        "every image rotated",
        "the bits of every image rotated: only SUN's files need it",
        _encoding(rotates='["tum", "sun", "realsense"]'),
    ),
    Misconception(
        "65535 dropped in every encoding",
        "65535 taken for no data in every encoding: only a RealSense means that, elsewhere it is a depth like another",
        _encoding().replace('if encoding == "realsense"', "if True"),
        variants=(_encoding().replace('if encoding == "realsense"', 'if encoding != "sun"'),),
    ),
    Misconception(
        "65535 believed",
        "65535 taken for 65.5 m: it is the largest 16-bit number, an overflow, and means no data",
        _encoding(overflow="raw"),
    ),
    Misconception(
        "overflow cut to another depth",
        "65535 replaced by another depth: it means no data, so it becomes 0",
        _encoding(overflow="np.where(raw == 65535, raw[raw < 65535].max(), raw)"),
        variants=(
            _encoding(overflow="np.where(raw == 65535, 1, raw)"),
            _encoding(overflow="np.where(raw == 65535, -1000, raw.astype(float))"),
        ),
    ),
    Misconception(
        "0 for 65535 turned round",
        "everything but 65535 set to 0: np.where takes the value for True first",
        _encoding(overflow="np.where(raw == 65535, raw, 0)"),
    ),
    Misconception(
        "left in steps",
        "raw steps handed on as metres: divide by the steps per metre",
        _encoding(steps="1"),
    ),
    Misconception(
        "steps multiplied",
        "a product with the steps a metre where a quotient belongs: more steps make each one smaller, so divide",
        _encoding(divide="* 1.0 *"),
        variants=(_encoding(divide="*"),),
    ),
    Misconception(
        "whole metres",
        "whole metres: // and whole-number types drop what is behind the point; divide with / and keep floats",
        _encoding(divide="//"),
    ),
)
