"""Task 4 of lab 02: the causes, what each leaves behind, and what tells pairs of them apart."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import swapped

CAUSE_OF = {"A": "shift first", "B": "inverse", "C": "order", "D": "millimetres", "E": "stride"}
SIGNS = {
    "stride": "its shape is lost, and no turn or scale brings it back",
    "millimetres": "its shape is kept, but not its size",
    "inverse": "it is turned the other way",
    "shift first": "only its place is wrong, and its middle is as far from the origin as that of grey",
    "order": "grey is moved by two poses in its panel",
}

WHICH_MISTAKES = (
    Misconception(
        "order taken for inverse",
        "the inverse and the wrong order exchanged: put one point of the original, (0, 0, 0), through both by hand",
        swapped(CAUSE_OF, "inverse", "order"),
    ),
    Misconception(
        "shift first taken for inverse",
        "R (p + t) and the inverse exchanged: R (p + t) turns by the right angle, the inverse the other way",
        swapped(CAUSE_OF, "shift first", "inverse"),
    ),
    Misconception(
        "scale taken for stride",
        "millimetres and stride exchanged: a wrong unit keeps every shape, a wrong stride destroys it",
        swapped(CAUSE_OF, "millimetres", "stride"),
    ),
    Misconception(
        "order taken for shift first",
        "R (p + t) and the wrong order exchanged: in the panel of the wrong order grey is moved by two poses, so it is "
        "turned farther than in the first panel",
        swapped(CAUSE_OF, "order", "shift first"),
    ),
)
