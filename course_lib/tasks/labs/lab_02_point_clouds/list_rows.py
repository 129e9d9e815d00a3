"""Task 1 of lab 02: where a pixel stands in the list of a cloud that was thinned before it was sent."""

from __future__ import annotations

import numpy as np

from course_lib.tasks.core import Case, Misconception, Task
from course_lib.tasks.judges import judge_number

_ROW = "def row_of(u, v, width, height, step):\n    return "
_KEPT = "len(range(0, width, step))"
MISTAKES = (
    Misconception(
        "the lesson's own code",
        "v · width + u, the row in the list of all pixels: here only every `step`-th column and row are in the list",
        _ROW + "v * width + u\n",
    ),
    Misconception(
        "width of the whole image",
        "rows as long as the image is wide: a row of the list has only as many points as columns were kept",
        _ROW + "v // step * width + u // step\n",
        variants=(_ROW + "(v * width + u) // step\n",),
    ),
    Misconception(
        "divided at the end",
        "the row in the whole list divided by step²: rows and columns are thinned each by itself, and a part of a step "
        "at the end of a row still keeps a column",
        _ROW + "(v * width + u) // step**2\n",
        variants=(_ROW + "(v * width + u) / step**2\n",),
    ),
    Misconception(
        "the last column lost",
        "width / step rounded down or to the nearest: a part of a step at the end of a row keeps one more column, so "
        "the kept columns are rounded up",
        _ROW + "v // step * (width // step) + u // step\n",
        variants=(_ROW + "v // step * round(width / step) + u // step\n",),
    ),
    Misconception(
        "column 0 forgotten",
        "(width - 1) // step columns kept: so many come after column 0, which is kept, too: add 1",
        _ROW + "v // step * ((width - 1) // step) + u // step\n",
    ),
    Misconception(
        "rounded too late",
        "width / step multiplied before it is rounded: a row of the list has a whole number of points, so round the "
        "kept columns up first, and multiply then",
        _ROW + "int(v / step * (width / step) + u / step)\n",
        variants=(
            _ROW + "math.ceil(v / step * (width / step) + u / step)\n",
            _ROW + "round(v / step * (width / step) + u / step)\n",
            _ROW + "v / step * (width / step) + u / step\n",
        ),
    ),
    Misconception(
        "one column too many",
        "width // step + 1 columns kept: where `step` divides `width`, that is one too many",
        _ROW + "v // step * (width // step + 1) + u // step\n",
    ),
    Misconception(
        "rows not thinned",
        "all image rows counted: above the pixel stand v // step rows of the list",
        _ROW + f"v * {_KEPT} + u // step\n",
    ),
    Misconception(
        "columns not thinned",
        "all columns counted beside it: to the left of the pixel stand u // step points of the list",
        _ROW + f"v // step * {_KEPT} + u\n",
    ),
    Misconception(
        "columns first",
        "counted column by column: images are stored row by row, and the kept rows come one after the other",
        _ROW + "u // step * len(range(0, height, step)) + v // step\n",
    ),
    Misconception(
        "height for width",
        "rows as long as the image is high: a row of the list has as many points as columns were kept",
        _ROW + "v // step * len(range(0, height, step)) + u // step\n",
    ),
    Misconception(
        "u and v exchanged",
        "u and v exchanged: v counts the rows that lie above, and each of them has as many points as columns were kept",
        _ROW + f"u // step * {_KEPT} + v // step\n",
    ),
    Misconception(
        "counted from one",
        "rows counted from one: the first pixel is row 0 of the list, and the first row is v = 0",
        _ROW + f"(v // step - 1) * {_KEPT} + u // step\n",
        variants=(_ROW + f"v // step * {_KEPT} + u // step + 1\n",),
    ),
)


def _cases(rng: np.random.Generator) -> list[Case]:
    cases = []
    for name, (width, height), step in (
        ("640 columns, every second kept", (640, 480), 2),
        ("a tall image, whose width is no multiple of the step", (3 * rng.integers(140, 160) + 1, 640), 3),
        ("a wide image, whose width is no multiple of the step", (4 * rng.integers(200, 220) + 3, 480), 4),
    ):
        kept = np.full((height, width), -1)
        thinned = kept[::step, ::step]
        thinned[:] = np.arange(thinned.size).reshape(thinned.shape)  # a view: written into `kept`
        v, u = step * int(rng.integers(105, 115)), step * int(rng.integers(40, 100))
        given = {"u": u, "v": v, "width": int(width), "height": int(height), "step": step}
        cases.append(Case(given, {"truth": int(kept[v, u])}, name))
    return cases


TASK = Task(
    id="02-1",
    title="Where is the pixel in the thinned list?",
    points=1,
    version=2,
    kind="fill",
    signature="def row_of(u, v, width, height, step)",
    cases=_cases,
    judge=lambda case, answer: judge_number(answer, case.truth, 0.1, "rows", "the row"),
    misconceptions=MISTAKES,
    where="lesson 02, section 2 (ordered and unordered)",
)
