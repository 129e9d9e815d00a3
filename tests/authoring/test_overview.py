"""The README's picture is made of what lesson 00 stores."""

import re

import numpy as np
from PIL import Image

from course_lib.authoring import overview


def test_the_picture_of_the_readme_is_the_lessons() -> None:
    made = overview.overview(overview.ROOT / overview.NOTEBOOK).convert("RGB")
    kept = Image.open(overview.ROOT / overview.PICTURE).convert("RGB")
    assert made.size == kept.size, "run `python -m course_lib.authoring.overview`"
    difference = np.abs(np.asarray(made, int) - np.asarray(kept, int)).mean()
    assert difference < 3, f"off by {difference:.1f} grey levels: run `python -m course_lib.authoring.overview`"


def test_the_readme_shows_it_with_an_alt_text() -> None:
    readme = (overview.ROOT / "README.md").read_text(encoding="utf-8")
    alt = re.search(rf"!\[(.*)\]\({re.escape(overview.PICTURE)}\)", readme)
    assert alt and len(alt.group(1).split()) > 15
