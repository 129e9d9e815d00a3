"""Task cells: from the solution to the stub, to the reference, to the given wrong code."""

from __future__ import annotations

import ast

import pytest

from course_lib.authoring.stubs import MEND, exercise_source, reference_source
from course_lib.authoring.tree import CourseError

WRITE = '''def lift(u, z, f):
    """Metres from pixels. # no comment"""
    a = 1  # stays
    # BEGIN SOLUTION
    # first the ray
    ray = u / f  # not a plan
    text = """
    # inside a text
    """
    for _ in range(1):
        # then the point
        point = ray * z
    return point
    # END SOLUTION'''
MENDED = """def half(x):
    # BEGIN SOLUTION
    # half of it
    return x / 2
    # INSTEAD
    #| for _ in range(2):
    #|     x = x * 2
    #|
    #| return x
    # END SOLUTION"""


def test_stub_keeps_the_plan() -> None:
    assert (
        exercise_source(WRITE, 2, 'lift "it"')
        == '''def lift(u, z, f):
    """Metres from pixels. # no comment"""
    a = 1  # stays
    # first the ray
    # then the point
    raise NotImplementedError("Task 2: lift \\"it\\"")'''
    )


def test_stub_without_the_plan() -> None:
    stub = exercise_source(WRITE, 5, "häuser", keep_plan=False)
    assert stub.endswith('    a = 1  # stays\n    raise NotImplementedError("Task 5: häuser")')
    assert "first the ray" not in stub


def test_stub_of_a_mend_task_holds_the_wrong_code() -> None:
    assert (
        exercise_source(MENDED, 3, "mend")
        == f"""def half(x):
    # half of it
    {MEND}
    raise NotImplementedError("Task 3: mend")
    for _ in range(2):
        x = x * 2

    return x"""
    )


def test_nothing_of_the_solution_is_left() -> None:
    for source in (WRITE, MENDED):
        stub = exercise_source(source, 1, "t")
        assert "SOLUTION" not in stub and "INSTEAD" not in stub and "#|" not in stub
        ast.parse(stub)
    assert "ray = u / f" not in exercise_source(WRITE, 1, "t")
    assert "x / 2" not in exercise_source(MENDED, 1, "t")


def test_reference_is_the_solution_without_markers() -> None:
    space: dict = {}
    exec(reference_source(MENDED), space)
    assert space["half"](8) == 4
    exec(reference_source(WRITE), space)
    assert space["lift"](10, 2, 5) == 4
    assert "#|" not in reference_source(MENDED) and "SOLUTION" not in reference_source(MENDED)


def test_two_gaps_in_one_cell() -> None:
    source = WRITE + "\n\n\n" + MENDED
    stub = exercise_source(source, 1, "t")
    assert stub.count("raise NotImplementedError") == 2
    ast.parse(stub)


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("def f():\n    pass", "has no '# BEGIN SOLUTION'"),
        ("def f():\n    # BEGIN SOLUTION\n    pass", "line 2 .* without '# END SOLUTION'"),
        ("def f():\n    # END SOLUTION", "line 2 .* without '# BEGIN SOLUTION'"),
        ("def f():\n    # BEGIN SOLUTION\n    # BEGIN SOLUTION\n    # END SOLUTION", "a second"),
        ("def f():\n    # INSTEAD\n    pass", "belongs once between"),
        ("def f():\n    # BEGIN SOLUTION\n    # INSTEAD\n    wrong\n    # END SOLUTION", "every line starts with"),
        ("def f():\n    # BEGIN SOLUTION\n    x = (\n    # END SOLUTION", "is not Python"),
    ],
)
def test_bad_markers_are_named(source: str, words: str) -> None:
    with pytest.raises(CourseError, match=words):
        exercise_source(source, 1, "t")
