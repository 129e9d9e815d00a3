"""The wrong answers of lab 00, as learner code: what each looks like, and what to do about it."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong(value: str, before: str = "") -> str:
    return f"def metres(depth_mm):\n{f'    {before}{chr(10)}' if before else ''}    return {value}\n"


MISTAKES = (
    Misconception(
        "left in millimetres",
        "raw millimetres handed on as metres, which makes a desk a mountain: divide by 1000",
        _wrong("depth_mm"),
    ),
    Misconception(
        "multiplied",
        "a multiplication where a division belongs: one millimetre is a thousandth of a metre",
        _wrong("depth_mm * 1000.0"),
        variants=(_wrong("depth_mm * 1000"),),  # uint16 overflows, silently
    ),
    Misconception(
        "whole metres",
        "a division that drops what is behind the point: // and types of whole numbers keep whole metres only, / and "
        "floats keep the millimetres",
        _wrong("depth_mm // 1000"),
        variants=(  # only images are cut, as they lie in an array of whole numbers
            _wrong("(depth_mm / 1000).astype(depth_mm.dtype) if isinstance(depth_mm, np.ndarray) else depth_mm / 1000"),
        ),
    ),
    Misconception(
        "rounded",
        "metres that were rounded, which drops the millimetres: return the quotient as it is",
        _wrong("np.round(np.asarray(depth_mm) / 1000)"),
        variants=tuple(_wrong(f"np.round(np.asarray(depth_mm) / 1000, {digits})") for digits in (1, 2)),
    ),
    Misconception(
        "centimetres",
        "millimetres taken for centimetres: a metre has 100 centimetres and 1000 millimetres",
        _wrong("depth_mm / 100"),
    ),
    Misconception(
        "1024 for 1000",
        "a division by 1024, which is for bytes: a metre has 1000 millimetres",
        _wrong("depth_mm / 1024"),
    ),
    Misconception(
        "another camera's scale",
        "the depth scale of the TUM images, 5000 units a metre: a RealSense stores 1000 units a metre",
        _wrong("depth_mm / 5000"),
    ),
    Misconception(
        "the remainder",
        "the rest of a division, which % gives: the quotient is asked, with /",
        _wrong("depth_mm % 1000"),
        variants=(_wrong("depth_mm % 1000 / 1000"),),
    ),
    Misconception(
        "zeros left out",
        "an image without its pixels of 0: every pixel keeps its place, and 0 stays 0",
        _wrong("d[d > 0] / 1000", "d = np.asarray(depth_mm)"),
    ),
    Misconception(
        "16-bit floats",
        "floats of 16 bits, which keep three digits only: let / choose the type",
        _wrong("np.asarray(depth_mm, np.float16) / np.float16(1000)"),
        variants=(
            _wrong("(np.asarray(depth_mm) / 1000).astype(np.float16)"),
            _wrong("np.asarray(depth_mm, np.float16) / 1000.0"),
        ),
    ),
    Misconception(
        "8 bits",
        "depth read as 8 bits, which hold 0 to 255 only: leave the numbers as they came",
        _wrong("np.asarray(depth_mm).astype(np.uint8) / 1000"),
    ),
    Misconception(
        "a minus",
        "a minus before the depth, which in unsigned whole numbers even runs round to large ones: depth is positive",
        _wrong("-depth_mm / 1000"),
        variants=(_wrong("-(depth_mm / 1000)"),),
    ),
)
