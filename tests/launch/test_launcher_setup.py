"""course.py: the whole set-up of a tiny course, from an index on 127.0.0.1, with a private uv and real processes."""

from __future__ import annotations

import json
import os
import shutil
import signal

import pytest
from launcher_helpers import (
    SECONDS,
    TINY,
    TINY_NAME,
    UV_NAME,
    begin,
    clean_environment,
    mini_course,
    real_uv,
    run,
    serving,
    set_bytes_needed,
    uv_wheel,
    wheel,
)

from course_lib.launch.bootstrap import command, installer, package_index

pytestmark = [
    pytest.mark.skipif(os.name == "nt", reason="the stand-in for uv is a shell script"),
    pytest.mark.skipif(real_uv() is None, reason="this environment was set up without uv"),
]


@pytest.fixture
def index():
    with serving({TINY_NAME: TINY, UV_NAME: uv_wheel()}, password="pass") as there:
        yield there


@pytest.fixture
def course(tmp_path):
    return mini_course(tmp_path / "a course")


def environment_for(index, folder, **more):
    return clean_environment(folder / "home", UV_DEFAULT_INDEX=index.url, **more)


@pytest.mark.slow
def test_everything_comes_from_the_institutions_index_and_later_runs_ask_nobody(index, course, tmp_path):
    conf = tmp_path / "pip.conf"
    conf.write_text(f"[global]\nindex-url = {index.url}/\n", encoding="utf-8")
    environment = clean_environment(tmp_path / "home", PIP_CONFIG_FILE=str(conf))
    code, printed, said = run(course, environment, "reset", "7", "--flag=a b")
    assert code == 7, said  # the verb's own exit code
    told = json.loads(printed)
    assert told["arguments"] == ["reset", "7", "--flag=a b"] and told["answer"] == 42
    assert told["library"] == str(course / "course_lib" / "__init__.py")
    assert told["prefix"] == str(course / ".venv")
    assert "Setting up" in said and "pass" not in said
    assert {"/simple/uv/", f"/files/{UV_NAME}", "/simple/tiny/", f"/files/{TINY_NAME}"} <= set(index.paths())
    index.close()
    asked = len(index.asked)
    code, printed, said = run(course, environment, "reset")
    assert (code, said) == (0, "") and json.loads(printed)["answer"] == 42
    moved = course.rename(tmp_path / "moved")
    code, printed, said = run(moved, environment, "reset")
    assert (code, said) == (0, "") and json.loads(printed)["library"].startswith(str(moved))
    assert len(index.asked) == asked


@pytest.mark.slow
def test_a_changed_lock_is_followed_and_a_broken_environment_mended(index, course, tmp_path):
    environment = environment_for(index, tmp_path)
    assert run(course, environment, "reset")[0] == 0
    with open(course / "uv.lock", "a", encoding="utf-8") as lock:
        lock.write("# changed\n")
    code, _, said = run(course, environment, "reset")
    assert code == 0 and "Setting up" in said
    (course / ".venv" / "bin" / "python").unlink()
    code, printed, said = run(course, environment, "reset")
    assert code == 0 and json.loads(printed)["answer"] == 42 and "Setting up" in said


@pytest.mark.slow
def test_an_environment_made_by_uv_itself_is_completed(index, course, tmp_path):
    environment = environment_for(index, tmp_path)
    assert run(course, environment, "reset")[0] == 0
    (course / ".venv" / ".course.json").unlink()
    keep = course / ".venv" / "keep"
    keep.touch()
    assert run(course, environment, "reset")[0] == 0
    assert keep.exists()  # brought up to date, not made anew


def test_a_set_up_killed_in_the_middle_is_completed_by_the_same_command(index, course, tmp_path):
    environment = environment_for(index, tmp_path)
    assert run(course, environment, "reset")[0] == 0
    shutil.rmtree(course / ".venv")
    shutil.rmtree(tmp_path / "home" / "cache")
    index.held.clear()
    index.hold.clear()
    killed = begin(course, environment, "reset")
    assert index.held.wait(SECONDS)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.communicate(timeout=SECONDS)
    index.hold.set()
    # what a killed installer leaves: a package that looks installed and is not whole
    half = next((course / ".venv" / "lib").glob("python3.*/site-packages")) / "tiny-1.0.dist-info"
    half.mkdir()
    (half / "METADATA").write_text("Metadata-Version: 2.1\nName: tiny\nVersion: 1.0\n", encoding="utf-8")
    (half / "RECORD").write_text("", encoding="utf-8")
    code, printed, said = run(course, environment, "reset")
    assert code == 0, said
    assert json.loads(printed)["answer"] == 42


def test_ctrl_c_is_a_sentence_and_the_same_command_goes_on(index, course, tmp_path):
    environment = environment_for(index, tmp_path)
    index.hold.clear()
    stopped = begin(course, environment, "reset")
    assert index.held.wait(SECONDS)
    os.killpg(stopped.pid, signal.SIGINT)
    index.hold.set()
    _, said = stopped.communicate(timeout=SECONDS)
    assert stopped.returncode == 130
    assert "interrupted; the same command goes on" in said and "Traceback" not in said
    assert run(course, environment, "reset")[0] == 0


@pytest.mark.slow
def test_of_two_at_once_the_second_waits_and_says_so(index, course, tmp_path):
    environment = environment_for(index, tmp_path)
    index.hold.clear()
    first = begin(course, environment, "reset", "3")
    assert index.held.wait(SECONDS)
    second = begin(course, environment, "reset", "4")
    assert "waiting for it" in second.stderr.readline()
    index.hold.set()
    assert json.loads(first.communicate(timeout=SECONDS)[0])["answer"] == 42
    assert json.loads(second.communicate(timeout=SECONDS)[0])["answer"] == 42
    assert (first.returncode, second.returncode) == (3, 4)
    assert index.paths().count(f"/files/{UV_NAME}") == 1


@pytest.mark.slow
def test_a_package_of_another_hash_is_refused(course, tmp_path):
    other = wheel("tiny", "1.0", {"tiny.py": b"ANSWER = 666\n"})
    with serving({TINY_NAME: other, UV_NAME: uv_wheel()}) as index:
        code, printed, said = run(course, environment_for(index, tmp_path), "reset")
    assert code == 15 and printed == ""
    assert "another hash than uv.lock's" in said and "Traceback" not in said


def test_an_unreachable_index_is_one_sentence(course, tmp_path):
    with serving({}) as index:
        environment = environment_for(index, tmp_path)
    code, printed, said = run(course, environment, "reset")
    assert code == 14 and printed == ""
    assert "cannot be reached" in said and "Traceback" not in said


@pytest.mark.slow
def test_an_index_that_vanishes_after_uv_is_one_sentence(course, tmp_path):
    with serving({UV_NAME: uv_wheel()}) as index:
        code, _, said = run(course, environment_for(index, tmp_path), "reset")
    assert code == 16 and "uv: " in said and "Traceback" not in said  # it answers, but does not hold tiny


def test_a_full_disk_is_refused_before_anything_is_written(course, tmp_path):
    set_bytes_needed(course, "1_000_000", "10**18")
    code, _, said = run(course, clean_environment(tmp_path / "home"), "reset")
    assert code == 13 and f"The disk of {course} has" in said and "Traceback" not in said
    assert not (course / ".venv").exists()


def test_no_space_left_on_the_way_is_the_same_sentence(monkeypatch, tmp_path, capsys):

    def write(*arguments):
        raise OSError(28, "No space left on device", str(tmp_path / "x"))

    monkeypatch.setattr(command, "run", write)
    assert command.main(["start"]) == 13
    assert "GB free" in capsys.readouterr().err
    stop = installer.why_uv_failed(
        "error: No space left on device (os error 28)", 2, package_index.Index(), dict(os.environ)
    )
    assert stop.code == "disk"


@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_one_sentence(course, tmp_path):
    course.chmod(0o555)
    code, _, said = run(course, clean_environment(tmp_path / "home"), "reset")
    course.chmod(0o755)
    assert code == 18 and "cannot be written" in said and "cp -r" in said


@pytest.mark.slow
def test_a_verb_runs_without_other_pythons_settings(index, course, tmp_path):
    ros = tmp_path / "ros"
    ros.mkdir()
    (ros / "tiny.py").write_text("ANSWER = 'of another Python'\n", encoding="utf-8")
    environment = environment_for(index, tmp_path, PYTHONPATH=str(ros))
    code, printed, said = run(course, environment, "reset")
    assert code == 0, said
    assert json.loads(printed)["answer"] == 42
