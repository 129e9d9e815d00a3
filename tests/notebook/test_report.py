"""report and report_table: numbers as text that repeats on any machine."""

import numpy as np
import pytest

from course_lib.notebook import report, report_table
from course_lib.notebook._words import count, number, sentence_list


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (35947, "35,947"),
        (np.int64(0), "0"),
        (3.14159, "3.14"),
        (0.5, "0.500"),
        (12345.6, "12,300"),
        (0.00123456, "0.00123"),
        (999.6, "1,000"),
        (-0.0, "0"),
        (np.float32(2.5), "2.50"),
        (np.array(7.0), "7.00"),
        (True, "yes"),
        (np.bool_(False), "no"),
        (float("nan"), "not measured"),
        (float("inf"), "infinite"),
        ("word", "word"),
        (1.25e-8, "1.25 × 10^-8"),
        (3e-17, "below 1 × 10^-9"),
    ],
)
def test_numbers_are_written_for_people(value, text):
    assert number(value) == text


def test_the_last_bits_of_a_result_do_not_reach_the_page(capsys):
    for value in (0.1 + 0.2, 0.3, 0.3 - 1e-14):
        report("sum", value, "m")
    assert capsys.readouterr().out == "sum: 0.300 m\n" * 3


def test_digits_and_the_smallest_number_that_means_something(capsys):
    report("error", 0.0123456, "m", digits=2)
    report("difference", 4e-8, "m", smallest=1e-6)
    report("points", 35947)
    report("missing", float("nan"), "mm")
    assert capsys.readouterr().out == (
        "error: 0.012 m\ndifference: below 0.000001 m\npoints: 35,947\nmissing: not measured\n"
    )


def test_nought_where_smallest_is_told_reads_as_what_another_machine_gets(capsys):
    for value in (0.0, 1e-17, -1e-9, 0.009):
        report("angle", value, "degrees", smallest=0.01)
    assert capsys.readouterr().out == "angle: below 0.01 degrees\n" * 4
    report("float", 1.4e-13, digits=2, smallest=0)
    report("points", 0, smallest=0.01)
    report("moved by", 0.0, "mm")
    assert capsys.readouterr().out == "float: 1.4 × 10^-13\npoints: 0\nmoved by: 0 mm\n"


def test_report_refuses_arrays_and_nothing():
    with pytest.raises(ValueError, match=r"'error' is an array of shape \(3,\): pass its norm"):
        report("error", np.zeros(3))
    with pytest.raises(ValueError, match="'error' is a list"):
        report("error", [1, 2])
    with pytest.raises(ValueError, match="it is None, so compute it first"):
        report("error", None)
    with pytest.raises(ValueError, match="this is a complex"):
        report("error", 1j)


def test_tables_align_words_left_and_numbers_right(capsys):
    report_table([["a", 1, 2.5], ["bb", 1000, None]], columns=["name", "points", "error (mm)"], title="Two clouds")
    assert capsys.readouterr().out.splitlines() == [
        "Two clouds",
        "name  points  error (mm)",
        "----  ------  ----------",
        "a          1        2.50",
        "bb     1,000",
    ]


def test_tables_take_dicts(capsys):
    report_table([{"view": "front", "mm": 1.0}, {"view": "back", "mm": 2.0}])
    report_table({"front": 1.0, "back": 2.0}, columns=["view", "mm"])
    first, second = capsys.readouterr().out.splitlines()[:4], capsys.readouterr().out
    assert first[0] == "view     mm" and first[2] == "front  1.00"
    assert second == ""


def test_tables_refuse_what_is_no_table():
    with pytest.raises(ValueError, match="no rows"):
        report_table([], columns=["a"])
    with pytest.raises(ValueError, match="needs columns"):
        report_table([[1, 2]])
    with pytest.raises(ValueError, match="1 cells for 2 columns"):
        report_table([[1]], columns=["a", "b"])


def test_html_of_a_table_is_escaped_and_has_headings():
    from course_lib.notebook.report import Table

    text = Table([["<b>", "1"]], ["what", "n"], [False, True], "a & b")._repr_html_()
    assert "&lt;b&gt;" in text and "<b>" not in text
    assert '<th scope="col"' in text and "a &amp; b" in text


def test_counts_say_when_they_are_rounded():
    assert count(1, "point") == "1 point"
    assert count(35947, "point") == "35,947 points"
    assert count(35947, "point", about=True) == "about 36,000 points"
    assert count(12, "point", about=True) == "12 points"
    assert count(2, "vertex") == "2 vertices"
    assert sentence_list(["a", "b", "c"]) == "a, b and c"
