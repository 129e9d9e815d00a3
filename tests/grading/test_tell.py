"""What is told: feedback shows nothing hidden and runs nothing, CSV files run nowhere, the report finds its way."""

from __future__ import annotations

import csv
import io
import random
from html.parser import HTMLParser

import pytest
from fakes import a_record, standing, task_record
from how_thorough import sample
from hypothesis import given, settings
from hypothesis import strategies as st

from course_lib.authoring import solutions
from course_lib.grading.records import Notice
from course_lib.grading.safe_text import clean, page_name, safe_cell
from course_lib.grading.tell.class_report import class_report
from course_lib.grading.tell.export import export_text, write_export
from course_lib.grading.tell.feedback import feedback_page, write_feedback
from course_lib.grading.tell.similar import similar_answers

EVIL = "<script>alert(1)</script><img src=x onerror=alert(2)>\u202e\x00{{ 7 * 7 }}<a href='javascript:1'>"
NAMES = ["Doe, Jane", "Zoë 🙂", "مها العلي", 'Bobby "; DROP', "=1+1", "na\udcefve", "x" * 300]


class Tags(HTMLParser):
    """Every tag and attribute of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs


def harmless(page: str) -> None:
    """Nothing that runs, nothing from elsewhere, and a policy that would forbid it."""
    found = Tags(page)
    assert "script" not in found.tags and "img" not in found.tags and "iframe" not in found.tags
    assert not [name for name, _ in found.attributes if name.startswith("on") or name == "src"]
    links = [value for name, value in found.attributes if name == "href"]
    assert all(value and ":" not in value for value in links)
    assert "default-src 'none'" in page and "\u202e" not in page and "\x00" not in page
    page.encode("utf-8")


def test_feedback_escapes_everything():
    task = task_record(title=EVIL, error=EVIL, looks_like=EVIL, where=EVIL, status="raised", reason="raised")
    page = feedback_page(standing(name=EVIL, student=EVIL, tasks=[task], late_reason=EVIL, kept=0.5))
    harmless(page)
    assert "&lt;script&gt;" in page and "{{ 7 * 7 }}" in page and "49" not in page
    assert EVIL.split("\u202e")[0] in task["error"]  # the control: unescaped, it would be a script


def test_feedback_shows_nothing_hidden():
    tasks = [
        task_record(1),
        task_record(2, status="raised", error="Line 1 raised ValueError: a. It was given SECRET-INPUT."),
        task_record(3, status="passed", points=3.0, error="x is within 0.2 mm.", looks_like=""),
    ]
    page = feedback_page(standing(tasks=tasks))
    assert "SECRET" not in page and "987654321" not in page and "f" * 12 not in page
    assert "x is off by 3 m." in page and "rows for columns" in page and "lesson 03" in page and "It moved." in page
    assert "ValueError: a." in page


def test_feedback_is_kind_to_an_untouched_task():
    page = feedback_page(
        standing(tasks=[task_record(status="not started", reason="not started", error="", looks_like="")])
    )
    assert "Not started" in page and "wrong" not in page.split("<h3>")[1].split("</article>")[0]


@pytest.mark.parametrize("status", ["excused", "unreadable"])
def test_feedback_of_other_states(status):
    page = feedback_page(standing(status=status, record=a_record([], reason="it was cut off.")))
    harmless(page)
    assert ("Excused" in page) == (status == "excused") and ("It was cut off." in page) == (status == "unreadable")


def test_feedback_tells_what_struck_once_and_does_not_call_it_free():
    struck = task_record(status="no answer", reason="timeout", error="Time was up (task_seconds = 30).", looks_like="")
    notices = [
        Notice(code="timeout", task="03-1", text="Time was up (task_seconds = 30)."),
        Notice(code="restarted", task="03-1", text="The kernel was started again once."),
    ]
    page = feedback_page(standing(tasks=[struck], record=a_record([struck], notices=notices)))
    assert page.count("Time was up") == 1 and page.count("started again once") == 1
    assert "None of this cost" not in page
    moved = a_record([struck], notices=[Notice(code="moved", task="03-1", text="it moved.")])
    page = feedback_page(standing(tasks=[struck], record=moved))
    assert "<li>It moved.</li>" in page and "None of this cost" in page


def test_a_comment_for_moodle_never_calls_0_what_nobody_has_marked():
    told = {row[0]: row[6] for row in csv.reader(io.StringIO(export_text(some(), "moodle")))}
    assert told["Participant 5"] == "Task 1: up to 3, to be marked"
    assert told["Participant 1"] == "Task 1: 3 of 3" and "0 of" not in told["Participant 4"]


@pytest.mark.parametrize("name", NAMES)
def test_names_survive_and_choose_no_path(name, tmp_path):
    paths = write_feedback([standing(student=f"../../{name}", name=name)], tmp_path / "feedback")
    assert [path.parent for path in paths] == [tmp_path / "feedback"] * 2
    harmless(paths[0].read_text(encoding="utf-8"))
    rows = list(csv.reader(io.StringIO(export_text([standing(student="1", name=name)], "csv"))))
    assert rows[1][1].lstrip("'")[:4] == clean(name)[:4] and len(rows[1]) == len(rows[0])


def test_page_names_differ_where_ids_do():
    ids = ["ann", "Ann", "ann ", "مها", "🙂", "a" * 200, "a" * 201]
    assert len({page_name(student, "03") for student in ids}) == len(ids)


@settings(max_examples=sample(300, 60), deadline=None)
@given(st.text(max_size=30))
def test_no_cell_runs_in_a_spreadsheet(text):
    cell = safe_cell(text)
    first = cell.lstrip("\u00a0\u200b\ufeff \t\r\n")[:1]
    assert first not in "=+-@\uff1d\uff0b\uff0d\uff20|%" or first == "" or _number(cell)


def _number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("text", ["=1+1", " =cmd|' /C calc'!A0", "+1", "-1+2", "@SUM(1)", "\t=1", "＝1", "%0A=1"])
def test_formulas_are_quoted(text):
    assert safe_cell(text).startswith("'")
    assert text.strip()[0] in "=+-@＝%"  # the control: as it came, a spreadsheet would run it


def test_numbers_stay_numbers():
    assert [safe_cell(value) for value in (3, 2.5, -1, None, "-3", "12345")] == ["3", "2.5", "-1", "", "-3", "12345"]


def some() -> list:
    return [
        standing("1", "Doe, Jane", [task_record(points=3.0, status="passed")]),
        standing("2", "Excused", [], status="excused"),
        standing("3", "Gone", [], status="nothing handed in", record=None, entry=None),
        standing("4", "Broken", [], status="unreadable"),
        standing("5", "To mark", [task_record(kind="explain", status="by hand", points=0.0)]),
        standing("", "Nobody", status="waiting", waits="It matches nobody in the roster."),
    ]


@pytest.mark.parametrize(("form", "column", "excused"), [("canvas", 5, "EX"), ("moodle", 4, "")])
def test_grades_that_a_person_must_decide_are_empty_and_never_0(form, column, excused):
    rows = {
        row[1 if form == "canvas" else 0]: row[column] for row in csv.reader(io.StringIO(export_text(some(), form)))
    }
    key = "{}" if form == "canvas" else "Participant {}"
    assert [rows[key.format(i)] for i in range(1, 6)] == ["3", excused, "0", "", ""]
    assert "" not in rows or form == "canvas"


def test_the_plain_table_has_a_column_a_task(tmp_path):
    assert write_export(some(), "csv", tmp_path / "x.csv") == 3
    data = (tmp_path / "x.csv").read_bytes()
    assert data.startswith(b"\xef\xbb\xbf")
    head, *rows = list(csv.reader(io.StringIO(data.decode("utf-8-sig"))))
    assert "03-1 lift" in head and rows[0][head.index("03-1 lift")] == "3"
    assert [row[head.index("total")] for row in rows] == ["3", "", "0", "", "", ""]


def test_class_report_counts_and_escapes():
    page = class_report([standing(str(i), EVIL, [task_record(error=EVIL)]) for i in range(5)] + some())
    harmless(page)
    assert "rows for columns" in page and "never a verdict" in page and "It matches nobody in the roster." in page
    counted = page.split("Mistakes that people made")[1].split("</tr>")[1]
    assert '<td class="n">7</td>' in counted  # of the five, and of two of the others


REFERENCE = solutions.reference("03-3")
OTHER = """def cloud_from_raw(raw, color, units_per_metre, camera_matrix):
    H, W = raw.shape
    cols, rows = np.meshgrid(np.arange(W), np.arange(H))
    metres = raw.astype(float).ravel() / units_per_metre
    ok = np.flatnonzero(metres)
    out = np.empty((ok.size, 3))
    out[:, 2] = metres[ok]
    out[:, 0] = out[:, 2] * (cols.ravel()[ok] - camera_matrix[0][2]) / camera_matrix[0][0]
    out[:, 1] = out[:, 2] * (rows.ravel()[ok] - camera_matrix[1][2]) / camera_matrix[1][1]
    return dict(points=out, colors=color.reshape(-1, 3)[ok])
"""
THIRD = """def cloud_from_raw(raw, color, units_per_metre, camera_matrix):
    inverse = np.linalg.pinv(camera_matrix)
    found, seen = [], []
    for v in range(raw.shape[0]):
        for u in range(raw.shape[1]):
            if raw[v, u] == 0:
                continue
            ray = inverse @ np.array([u, v, 1.0])
            found.append(ray * raw[v, u] / units_per_metre)
            seen.append(color[v, u])
    return {"points": np.array(found), "colors": np.array(seen)}
"""


def test_renamed_answers_are_alike_and_independent_ones_are_not():
    renamed = OTHER.replace("cols", "us").replace("rows", "vs").replace("metres", "d").replace("ok", "good")
    renamed = renamed.replace("H, W = raw.shape\n", "# the size\n    H, W = raw.shape\n").replace("out", "pts")
    answers = {"a": OTHER, "b": renamed, "c": THIRD, "d": REFERENCE}
    assert [(pair.first, pair.second) for pair in similar_answers(answers, solutions.stub("03-3"))] == [("a", "b")]


def test_short_answers_and_common_ones_are_left_out():
    short = {str(i): "def focal_length(fov_degrees, pixels):\n    return pixels / 2\n" for i in range(30)}
    assert similar_answers(short) == []
    common = {str(i): REFERENCE for i in range(30)} | {"x": OTHER, "y": OTHER}
    assert [(pair.first, pair.second) for pair in similar_answers(common)] == [("x", "y")]


@pytest.mark.slow
def test_a_class_of_300():
    rng = random.Random(3)
    lines = OTHER.strip().split("\n")
    answers = {}
    for i in range(300):
        extra = [
            f"    extra{k} = np.{rng.choice(['sum', 'mean', 'max', 'min'])}(raw) + {rng.random()}" for k in range(5)
        ]
        answers[str(i)] = "\n".join([lines[0], *extra, *lines[1:]]) + "\n"
    answers["300"] = answers["7"].replace("metres", "meters")
    pairs = {(pair.first, pair.second) for pair in similar_answers(answers)}
    assert ("300", "7") in pairs and len(pairs) < 30
