"""course.py: which Pythons and machines it refuses and how, its verbs, its help, its exit codes."""

from __future__ import annotations

import ast
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from launcher_helpers import ROOT, SECONDS

from course_lib import cli
from course_lib.launch.bootstrap import (
    command,
    interpreter,
    messages,
    places,
    platform_check,
    platform_facts,
    report,
    verbs,
)

LOCK = (ROOT / "uv.lock").read_text(encoding="utf-8")

FOUND: list[str] = ["/opt/python3.12"]
ask_pythons = interpreter.usable_pythons


@pytest.fixture(autouse=True)
def command_line(monkeypatch):
    """What the learner typed: it comes back in the command that mends."""
    monkeypatch.setattr(sys, "argv", ["course.py", "start"])
    monkeypatch.setattr(interpreter, "usable_pythons", lambda environment: iter(FOUND))


GOOD = platform_facts.Facts((3, 12, 4), 64, "Linux", "x86_64", ("glibc", (2, 36)))


BOOTSTRAP = sorted((ROOT / "course_lib/launch/bootstrap").glob("*.py"))
OLD_SYNTAX = [ROOT / "course.py", ROOT / "course_lib/__init__.py", ROOT / "course_lib/launch/__init__.py", *BOOTSTRAP]


@pytest.mark.parametrize("path", OLD_SYNTAX, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_what_runs_before_the_environment_is_old_python_and_imports_only_the_standard_library(path):
    imported = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 8))):
        if isinstance(node, ast.Import):
            imported |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level:
            assert node.level == 1 and path in BOOTSTRAP  # from its own folder only
        elif isinstance(node, ast.ImportFrom):
            imported.add(node.module)
    allowed = {"course_lib.launch.bootstrap"} if path.name == "course.py" else set()
    assert {name for name in imported - allowed if name.partition(".")[0] not in sys.stdlib_module_names} == set()


def test_the_launcher_is_short_and_its_modules_are_of_one_purpose():
    assert len((ROOT / "course.py").read_text(encoding="utf-8").splitlines()) < 60
    assert all(len(path.read_text(encoding="utf-8").splitlines()) < 250 for path in BOOTSTRAP)


def test_a_python_that_cannot_read_the_launcher_is_told_so(monkeypatch, capsys):
    entry = runpy.run_path(str(ROOT / "course.py"))
    monkeypatch.setattr(sys, "version_info", (3, 6, 9))
    assert entry["main"]() == messages.EXIT["python"]
    assert capsys.readouterr().err.startswith("course: This is Python 3.6; the course needs CPython 3.11 to 3.14")


@pytest.mark.parametrize(
    "known",
    [
        GOOD,
        GOOD._replace(version=(3, 11, 0)),
        GOOD._replace(version=(3, 14, 2)),
        GOOD._replace(machine="aarch64"),
        GOOD._replace(libc=("glibc", (2, 35))),
        platform_facts.Facts((3, 13, 0), 64, "Darwin", "arm64"),
        platform_facts.Facts((3, 13, 0), 64, "Windows", "AMD64"),
    ],
)
def test_the_machines_of_the_lock_are_accepted(known):
    assert platform_check.check_machine(known, LOCK) is None


@pytest.mark.parametrize(
    ("known", "code", "sentence", "mend"),
    [
        (
            GOOD._replace(version=(3, 10, 13)),
            "python",
            "This is Python 3.10.13; the course needs",
            "^/opt/python3.12 course.py start$",
        ),
        (
            GOOD._replace(version=(3, 15, 0)),
            "python",
            "This is Python 3.15.0; the course needs",
            "^/opt/python3.12 course.py start$",
        ),
        (GOOD._replace(bits=32), "python", "This is a 32-bit Python", "^/opt/python3.12 course.py start$"),
        (GOOD._replace(implementation="PyPy"), "python", "This is PyPy", "^/opt/python3.12 course.py start$"),
        (GOOD._replace(free_threaded=True), "python", "a free-threaded Python", "^/opt/python3.12 course.py start$"),
        (GOOD._replace(libc=("glibc", (2, 31))), "system", "glibc 2.31, and Open3D needs 2.35", "docker run"),
        (GOOD._replace(libc=("musl", ())), "system", "uses musl", "docker run"),
        (GOOD._replace(machine="riscv64"), "machine", "no build for Linux on riscv64", "ssh -L"),
        (platform_facts.Facts((3, 12, 0), 64, "Darwin", "x86_64"), "machine", "no build for Intel Macs", "ssh -L"),
        (
            platform_facts.Facts((3, 12, 0), 64, "Darwin", "x86_64", translated=True),
            "machine",
            "Intel Python on an Apple-silicon Mac",
            "arch -arm64 python3",
        ),
        (
            platform_facts.Facts((3, 12, 0), 64, "Windows", "ARM64"),
            "machine",
            "ARM Pythons on Windows",
            "winget install",
        ),
    ],
)
def test_what_cannot_work_gets_one_sentence_and_a_command(known, code, sentence, mend):
    with pytest.raises(messages.Stop) as stopped:
        platform_check.check_machine(known, LOCK)
    assert stopped.value.code == code
    assert sentence in stopped.value.sentence
    assert "\n" not in stopped.value.sentence and "Traceback" not in stopped.value.sentence
    assert re.search(mend, stopped.value.mend)


def test_what_cannot_be_mended_is_said_before_what_can():
    old_intel_mac = platform_facts.Facts((3, 8, 0), 64, "Darwin", "x86_64")
    with pytest.raises(messages.Stop, match="Intel Macs"):
        platform_check.check_machine(old_intel_mac, LOCK)


def test_the_running_python_is_described_and_accepted():
    known = platform_facts.facts()
    assert known.version == sys.version_info[:3] and known.bits == 64
    assert platform_check.check_machine(known, LOCK) is None


def test_the_oldest_glibc_is_read_from_the_lock():
    newer = LOCK.replace("manylinux_2_35_x86_64", "manylinux_2_99_x86_64")
    with pytest.raises(messages.Stop, match="needs 2.99"):
        platform_check.check_machine(GOOD, newer)


def test_pythons_to_use_are_asked_and_not_believed(tmp_path):
    liar, broken = tmp_path / "python3.14", tmp_path / "python3.13"
    liar.write_text("#!/bin/sh\necho 3 9 8 CPython\n", encoding="utf-8")
    broken.write_text("#!/bin/sh\nexit 127\n", encoding="utf-8")
    honest = tmp_path / "python3.12"
    honest.write_text("#!/bin/sh\necho 3 12 8 CPython\n", encoding="utf-8")
    for file in (liar, broken, honest):
        file.chmod(0o755)
    if os.name == "nt":
        pytest.skip("shell scripts are no programs on Windows")
    assert next(ask_pythons({"PATH": str(tmp_path)})) == str(honest)


@pytest.mark.parametrize(
    ("known", "family", "command"),
    [
        (GOOD, "debian", "apt-get install -y python3"),
        (GOOD._replace(libc=("glibc", (2, 35))), "debian", "apt-get install -y python3.11"),
        (GOOD, "fedora", "dnf install -y python3.12"),
        (
            platform_facts.Facts((3, 9, 0), 64, "Darwin", "arm64"),
            "",
            "brew install python@3.12 && python3.12 course.py start",
        ),
        (platform_facts.Facts((3, 9, 0), 64, "Windows", "AMD64"), "", "winget install Python.Python.3.12"),
    ],
)
def test_where_no_python_fits_the_line_installs_one(monkeypatch, known, family, command):
    monkeypatch.setattr(interpreter, "usable_pythons", lambda environment: iter(()))
    monkeypatch.setattr(interpreter, "linux_family", lambda: family)
    assert interpreter.python_to_use(known).removeprefix("sudo ") == command


OLD = sorted(Path.home().glob(".pyenv/versions/3.*/bin/python"))
OLD = [python for python in OLD if (3, 8) <= tuple(map(int, python.parts[-3].split(".")[:2])) < (3, 11)]


@pytest.mark.slow
@pytest.mark.skipif(not OLD, reason="no Python 3.8 to 3.10 is installed by pyenv here")
@pytest.mark.parametrize("python", OLD, ids=lambda python: python.parts[-3])
def test_an_old_python_prints_the_command_with_a_newer_one(python):
    run = subprocess.run(
        [python, ROOT / "course.py", "start", "02"], capture_output=True, text=True, timeout=SECONDS, cwd="/"
    )
    assert run.returncode == messages.EXIT["python"]
    first, second = run.stderr.splitlines()
    assert first.startswith(f"course: This is Python {python.parts[-3]};")
    newer, *rest = second.split()
    assert Path(newer).exists() and newer != str(python)
    assert rest == [str(ROOT / "course.py"), "start", "02"]
    asked = subprocess.run([python, ROOT / "course.py", "--help"], capture_output=True, text=True, timeout=SECONDS)
    assert asked.returncode == 0 and "python3 course.py start" in asked.stdout


def test_an_unknown_verb_suggests_the_nearest(capsys):
    assert command.main(["strat", "--port", "9000"]) == messages.EXIT["usage"]
    said = capsys.readouterr().err
    assert "There is no verb 'strat'" in said and said.endswith("python3 course.py start --port 9000\n")
    assert command.main(["zzz"]) == messages.EXIT["usage"]
    assert "python3 course.py --help" in capsys.readouterr().err


def test_help_names_every_verb_and_every_exit_code(capsys):
    assert command.main(["--help"]) == 0
    text = capsys.readouterr().out
    for verb in verbs.VERBS:
        assert f"\n  {verb} " in text
    for code in messages.EXIT.values():
        assert re.search(rf"(^|\s){code}  ", text, re.M), code
    assert len(set(messages.EXIT.values())) == len(messages.EXIT)


@pytest.mark.parametrize("verb", sorted(verbs.VERBS))
def test_the_launcher_names_options_that_the_verb_has(verb):
    command = cli.course.get_command(None, verb)
    options = {option for parameter in command.params for option in parameter.opts}
    named = set(re.findall(r"--[a-z-]+", verbs.VERBS[verb].arguments))
    assert named <= options


@pytest.mark.parametrize("verb", sorted(verbs.VERBS))
def test_help_of_a_verb_needs_no_set_up(verb, capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(places, "VENV", tmp_path / "none")
    assert command.main([verb, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"Usage: python3 course.py {verb} ")


def test_a_lost_lock_file_is_a_sentence(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(places, "LOCK_FILE", tmp_path / "uv.lock")
    monkeypatch.setattr(places, "VENV", tmp_path / ".venv")
    assert command.main(["start"]) == messages.EXIT["install"]
    assert "git checkout uv.lock" in capsys.readouterr().err


def test_doctor_before_the_set_up_installs_nothing(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(places, "VENV", tmp_path / ".venv")
    monkeypatch.setenv("UV_DEFAULT_INDEX", "http://127.0.0.1:9/simple")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    assert command.main(["doctor"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("ok    Python ") for line in lines)
    assert any(line.startswith("FAIL  environment ") and line.endswith("python3 course.py start") for line in lines)
    assert any(line.startswith("FAIL  package index ") for line in lines)
    assert not (tmp_path / ".venv").exists()
    assert command.main(["doctor", "--csv"]) == 1
    rows = capsys.readouterr().out.splitlines()
    assert rows[0] == "verdict,name,text,mend" and len(rows) == len(lines) + 1


def test_verdicts_name_no_user_and_no_place(capsys, monkeypatch):
    monkeypatch.setenv("HOME", "/home/kim")
    verdict = messages.Verdict("x", False, f"{ROOT}/a and /home/kim/b", "mend /home/kim/c")
    report.print_verdicts([verdict], as_csv=False)
    report.print_verdicts([verdict], as_csv=True)
    text = capsys.readouterr().out
    assert "kim" not in text and str(ROOT) not in text and "course/a and ~/b" in text
