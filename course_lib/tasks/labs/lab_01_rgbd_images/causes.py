"""Task 4 of lab 01: the causes, what each leaves behind, and what tells each pair apart."""

from __future__ import annotations

from collections.abc import Mapping

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import swapped

CAUSE_OF = {"A": "mixed", "B": "tum", "C": "8 bits", "D": "flipped", "E": "range"}
SIGNS = {
    "tum": "one factor everywhere, so the error has one sign and grows with the depth",
    "range": "the error is zero in the middle of the image and grows towards its corners",
    "flipped": "near things come out far and far things near, so both signs occur, in large patches",
    "mixed": "the error is next to nothing on every surface, and large along outlines and beside holes",
    "8 bits": "the error is never more than half a grey level, and runs in stripes over every surface",
}

_EXCHANGED = (
    (
        "outlines taken for stripes",
        "8 bits",
        "mixed",
        "8 bits and mixing exchanged: 8 bits make stripes on every surface, mixing only errs along outlines",
    ),
    (
        "scale taken for range",
        "range",
        "tum",
        "range and scale exchanged: range grows towards the corners, a scale errs by one factor everywhere",
    ),
    (
        "flip taken for scale",
        "flipped",
        "tum",
        "flip and scale exchanged: a flip errs with both signs, a scale with one",
    ),
    (
        "flip taken for range",
        "flipped",
        "range",
        "flip and range exchanged: range only adds, the more the nearer to a corner; a flip errs with both signs",
    ),
    (
        "stripes taken for a bowl",
        "8 bits",
        "range",
        "8 bits and range exchanged: range errs by a smooth bowl, 8 bits by stripes of centimetres at most",
    ),
    (
        "outlines taken for a bowl",
        "mixed",
        "range",
        "mixing and range exchanged: mixing errs along outlines only, range everywhere but in the middle",
    ),
    (
        "stripes taken for a scale",
        "8 bits",
        "tum",
        "8 bits and scale exchanged: 8 bits err by centimetres and to both sides, this scale by most of the depth",
    ),
    (
        "outlines taken for a scale",
        "mixed",
        "tum",
        "mixing and scale exchanged: mixing leaves surfaces right, a wrong scale leaves nothing right",
    ),
    (
        "stripes taken for a flip",
        "8 bits",
        "flipped",
        "8 bits and flip exchanged: both err to both sides, but 8 bits by centimetres and a flip by metres",
    ),
    (
        "outlines taken for a flip",
        "mixed",
        "flipped",
        "mixing and flip exchanged: mixing errs along outlines only, a flip on whole surfaces",
    ),
)


def which_mistakes(cause_of: Mapping[str, str]) -> tuple[Misconception, ...]:
    """Each pair of causes exchanged, for the letters of a picture."""
    return tuple(Misconception(name, message, swapped(cause_of, a, b)) for name, a, b, message in _EXCHANGED)
