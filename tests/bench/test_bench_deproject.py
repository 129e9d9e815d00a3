"""Both sides of the deprojection benchmark make the same points; its times are judged by `course bench`, not here."""

from __future__ import annotations

import numpy as np
import pytest

from course_lib.bench import bench_03
from course_lib.camera import pinhole

CASES = bench_03.cases()


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_both_sides_agree(case):
    case.agree()
    assert case.ours() is not None and case.theirs() is not None
    assert 0 < case.bound <= 1.5


def test_the_image_has_the_stated_holes():
    depth = bench_03.depth_image(pinhole.preset("d455_depth_1280x720"))
    assert np.mean(depth == 0) == pytest.approx(bench_03.HOLES, abs=0.002)
