"""Lateness, extensions, and which attempt counts."""

from __future__ import annotations

import pytest

from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.roster import kept_of
from course_lib.grading.ledger import policy as module
from course_lib.grading.ledger.policy import Attempt, Extensions, Policy, read_extensions, read_policy

TEXT = module.__doc__.split("::\n\n")[1].split("\nThe time of")[0]
TEXT = "\n".join(line[4:] for line in TEXT.splitlines())
ROWS = "\n".join(line.strip() for line in module.__doc__.split("::\n\n")[2].strip().splitlines())


@pytest.fixture
def policy(tmp_path) -> Policy:
    (tmp_path / "late.toml").write_text(TEXT)
    return read_policy(tmp_path / "late.toml")


@pytest.fixture
def extensions(tmp_path) -> Extensions:
    (tmp_path / "more.csv").write_text(ROWS)
    return read_extensions(tmp_path / "more.csv")


@pytest.mark.parametrize(
    ("received", "kept"),
    [
        ("2026-11-24T22:59:00+00:00", 1.0),  # one minute to midnight in Berlin
        ("2026-11-24T23:13:00+00:00", 1.0),  # within the grace
        ("2026-11-24T23:15:00+00:00", 0.8),
        ("2026-11-26T22:00:00+00:00", 0.8),
        ("2026-11-26T23:00:00+00:00", 0.0),
        ("2026-11-25T00:30:00", 0.8),  # no offset: Berlin
    ],
)
def test_the_documented_policy(policy, received, kept):
    share, why = policy.kept("03", "1", received, False, Extensions())
    assert share == kept and bool(why) == (kept < 1)


def test_an_extension_moves_one_students_date(policy, extensions):
    received = "2026-11-26T23:00:00+00:00"
    assert policy.kept("03", "12345", received, True, extensions) == (1.0, "")
    assert policy.kept("03", "1", received, True, extensions)[0] == 0.0
    assert extensions.excused("12346", "03") and not extensions.excused("12345", "03")
    assert read_extensions(kept_of(ROWS, module.COLUMNS)) == extensions and read_policy(TEXT) == policy
    assert read_extensions(kept_of(ROWS, module.COLUMNS, without="12345")).rows.keys() == {("12346", "03")}


def test_a_mark_of_lateness_counts_where_the_time_is_unknown(policy):
    assert policy.kept("03", "1", "", True, Extensions())[0] == 0.8
    assert policy.kept("03", "1", "", False, Extensions())[0] == 1.0
    assert Policy().kept("03", "1", "2030-01-01T00:00:00+00:00", False, Extensions()) == (1.0, "")


@pytest.mark.parametrize(("counts", "place"), [("last", 2), ("best", 1), ("first", 0), ("last-on-time", 1)])
def test_which_attempt_counts(counts, place):
    attempts = [Attempt(1, False, 3.0, 3.0), Attempt(2, False, 9.0, 9.0), Attempt(3, True, 5.0, 5.0)]
    assert Policy(counts=counts).choose(attempts) == place


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("duedate = 1", "no setting 'duedate'"),
        ("counts = 'newest'", "none of last, best"),
        ("timezone = 'Mars'", "no time zone 'Mars'"),
        ("grace_minutes = -1", "number of minutes"),
        ("[due]\n'03' = 'soon'", "no date"),
        ("[[steps]]\nhours = 1\nkeep = 120", "0 to 100 percent"),
        ("= 1", "cannot be read as TOML"),
    ],
)
def test_a_policy_that_is_wrong_says_so(tmp_path, text, sentence):
    (tmp_path / "late.toml").write_text(text)
    with pytest.raises(CourseError, match=sentence):
        read_policy(tmp_path / "late.toml")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("student,lab,due\n1,03,tomorrow\n", "line 2: the due date 'tomorrow'"),
        ("student,lab,due\n,03,excused\n", "line 2: the student is missing"),
        ("student,lab,due\n1,x,excused\n", "line 2: 'x' is no lab"),
    ],
)
def test_extensions_that_are_wrong_say_where(tmp_path, text, sentence):
    (tmp_path / "more.csv").write_text(text)
    with pytest.raises(CourseError, match=sentence):
        read_extensions(tmp_path / "more.csv")
