"""The command line: quick help, a missing part that breaks nothing else, the nearest verb."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import click
import pytest

from course_lib import cli
from course_lib.authoring.tree import CourseError
from course_lib.launch.bootstrap.verbs import Verb

ROOT = Path(__file__).parents[2]


def _run(args: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as end:
        cli.main(args)
    said = capsys.readouterr()
    return end.value.code or 0, said.out, said.err


def test_help_names_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = _run(["--help"], capsys)
    assert code == 0
    assert [verb for verb in cli.VERBS if f"\n  {verb} " in out] == list(cli.VERBS)


@pytest.mark.parametrize("verb", list(cli.VERBS))
def test_every_verb_has_help(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = _run([verb, "--help"], capsys)
    assert code == 0
    assert out.startswith(f"Usage: python3 course.py {verb}")
    assert len(out.split("Options:")[0].strip().splitlines()) > 2


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\nfrom course_lib import cli\n"
        "try:\n    cli.main(['--help'])\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'nbformat', 'nbclient', 'open3d', 'pytest'}\n"
        "print(sorted({name.split('.')[0] for name in sys.modules} & heavy))"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(("word", "says"), [("buld", "Did you mean build?"), ("tset", "Did you mean test?")])
def test_unknown_verb_suggests_the_nearest(word: str, says: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = _run([word], capsys)
    assert code == 2
    assert f"there is no verb '{word}'. {says}" in err
    assert "Traceback" not in err


def test_missing_part_is_one_sentence_and_breaks_no_other_verb(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(cli.VERBS, "grade", Verb("", "Grade.", "grading.of_later:command"))
    code, _, err = _run(["grade"], capsys)
    assert code == 1
    assert err == "the verb 'grade' is not part of this copy of the course.\n"
    assert _run(["--help"], capsys)[0] == 0


def test_what_a_person_can_mend_comes_without_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @click.command("fail")
    def fail() -> None:
        raise CourseError("the stick is not plugged in: plug it in.")

    monkeypatch.setattr(importlib.import_module("course_lib.launch.reset"), "command", fail)
    assert _run(["reset"], capsys) == (1, "", "the stick is not plugged in: plug it in.\n")


def test_unknown_lesson_suggests_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = _run(["build", "--check", "01_rgbd_image"], capsys)
    assert code == 1
    assert "Did you mean 01_rgbd_images?" in err
