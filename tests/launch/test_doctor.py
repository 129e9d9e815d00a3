"""`doctor`: a verdict a line with its mend, from the installed packages to the datasets and ports."""

from __future__ import annotations

import csv
import io
import socket
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from launcher_helpers import wheel

from course_lib.authoring.tree import Tree, course_tree
from course_lib.launch import doctor, installed, server
from course_lib.launch.bootstrap.messages import Verdict
from course_lib.notebook import _cache, _catalog, _places, _real
from course_lib.notebook._errors import CannotWrite, DataDamaged

TREE = course_tree()
LOCK = (TREE.root / "uv.lock").read_text(encoding="utf-8")


@pytest.fixture
def site(tmp_path):
    """A folder of installed packages: a 1.0 with two files, b 2.0."""
    import zipfile

    for name, version in (("a", "1.0"), ("b", "2.0")):
        content = wheel(name, version, {f"{name}/__init__.py": b"x = 1\n", f"{name}/more.py": b"y = 2\n"})
        zipfile.ZipFile(io.BytesIO(content)).extractall(tmp_path)
    return tmp_path


def test_an_environment_as_locked_has_no_differences(site):
    assert installed.differences({"a": "1.0", "b": "2.0"}, [str(site)]) == []


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ({"a": "1.0", "b": "2.0", "c": "3"}, "c 3 is missing"),
        ({"a": "1.1", "b": "2.0"}, "a is 1.0, not 1.1"),
        ({"a": "1.0"}, "b 2.0 is too much"),
    ],
)
def test_each_difference_is_a_phrase(site, wanted, said):
    assert installed.differences(wanted, [str(site)]) == [said]


def test_a_package_that_lost_files_is_found(site):
    (site / "a" / "more.py").unlink()
    assert installed.differences({"a": "1.0", "b": "2.0"}, [str(site)]) == [
        "a has lost 1 of its files, such as a/more.py"
    ]


def test_the_lock_is_followed_for_each_machine():
    linux = {
        "sys_platform": "linux",
        "platform_machine": "x86_64",
        "python_full_version": "3.11.7",
        "python_version": "3.11",
    }
    here = installed.locked_versions(LOCK, linux)
    assert "open3d-cpu" in here and "open3d" not in here and "uv" not in here
    assert "ruff" in here  # the tests run it
    windows = {
        **linux,
        "sys_platform": "win32",
        "platform_system": "Windows",
        "os_name": "nt",
        "platform_machine": "AMD64",
        "python_full_version": "3.13.1",
        "python_version": "3.13",
    }
    there = installed.locked_versions(LOCK, windows)
    assert "open3d" in there and "open3d-cpu" not in there and "pywinpty" in there
    assert here["numpy"] != there["numpy"]  # the lock holds one for 3.11 and one for later Pythons


@pytest.mark.slow
def test_this_environment_is_the_locks():
    assert installed.differences(installed.locked_versions(LOCK)) == []


def verdicts_of(part, tree: Tree = TREE) -> list:
    return list(part(tree))


def test_what_ends_its_process_is_tried_in_another(monkeypatch):
    monkeypatch.setattr(doctor, "_OPEN3D", "import os; os.abort()")
    (verdict,) = verdicts_of(doctor._open3d)
    assert verdict.ok is False and "cannot be imported" in verdict.text and verdict.mend


@pytest.mark.slow
def test_open3d_is_imported_and_used():
    (verdict,) = verdicts_of(doctor._open3d)
    assert verdict.ok is True and verdict.text.endswith("holds a cloud of 3 points")


@pytest.mark.parametrize(("renderer", "ok"), [("pyvista", True), ("matplotlib", None)])
def test_rendering_without_a_driver_is_a_note(monkeypatch, renderer, ok):
    monkeypatch.setenv("COURSE_RENDER", renderer)
    (verdict,) = verdicts_of(doctor._rendering)
    assert verdict.ok is ok and "COURSE_RENDER" in verdict.text


def entry(name: str, kind: str) -> _catalog.Entry:
    files = (_catalog.RemoteFile("f", f"{name}/f", "https://x.invalid/f", "0" * 64, 1),) if kind == "real" else ()
    recipe = "r" if kind == "synthetic" else ""
    return _catalog.Entry(
        name, kind, "title", "licence", "credit", "metres", recipe=recipe, version=1, seed=7, files=files
    )


def test_datasets_are_proved_by_their_hashes(monkeypatch, tmp_path):
    names = {
        "here": "real",
        "gone": "real",
        "spoilt": "real",
        "unmade": "synthetic",
        "made": "synthetic",
        "torn": "synthetic",
    }
    monkeypatch.setattr(_catalog, "catalogue", lambda: {name: entry(name, kind) for name, kind in names.items()})
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path))
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)

    def locate(one):
        if one.name == "spoilt":
            raise DataDamaged("spoilt/f of dataset spoilt is damaged (its sha256 differs): run `x` to fetch it again.")
        return {"f": tmp_path / "f"}

    def proved(folder, fingerprint):
        if folder.name.startswith("torn"):
            raise DataDamaged("torn-1-7/depth.npz is damaged (its sha256 differs)")
        return {"files": {"a": {}, "b": {}}}

    monkeypatch.setattr(_real, "locate", locate)
    monkeypatch.setattr(_cache, "proved", proved)
    for name in ("made-1-7", "torn-1-7", "real/here", "real/spoilt"):
        (tmp_path / name).mkdir(parents=True)
        (tmp_path / name / "f").touch()
    found = {verdict.name: verdict for verdict in verdicts_of(doctor._datasets)}
    assert {name: verdict.ok for name, verdict in found.items()} == {
        "here": True, "gone": None, "spoilt": False, "unmade": True, "made": True, "torn": None,
    }  # fmt: skip
    assert found["gone"].mend == "python3 course.py data get gone"
    assert found["spoilt"].mend == "python3 course.py data get spoilt" and "`" not in found["spoilt"].text
    assert "made again" in found["torn"].text and "2 files" in found["made"].text


def test_a_mirror_that_is_not_there_is_a_failure(monkeypatch):
    def mirror():
        raise CannotWrite("COURSE_DATA_MIRROR names /x, which is no folder: plug it in, or unset the variable.")

    monkeypatch.setattr(_places, "mirror", mirror)
    (verdict,) = verdicts_of(doctor._datasets)
    assert verdict.ok is False and verdict.mend == "plug it in, or unset the variable"


def test_a_taken_port_names_the_next_free_one(monkeypatch):
    monkeypatch.setattr(server, "running", lambda tree: None)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        monkeypatch.setattr(doctor, "PORT", port)
        (verdict,) = verdicts_of(doctor._port)
    assert verdict.ok is True and f"({port} is taken)" in verdict.text


def test_a_running_server_is_named(monkeypatch):
    monkeypatch.setattr(server, "running", lambda tree: server.Server("http://127.0.0.1:8890/", "t0ken", 8890, 1))
    (verdict,) = verdicts_of(doctor._port)
    assert "127.0.0.1:8890" in verdict.text and "t0ken" not in verdict.text


def some_verdicts(*given):
    return lambda tree: iter([Verdict(*one) for one in given])


def test_the_exit_code_and_the_form_of_the_command(monkeypatch):
    good, bad = ("Python", True, "3.12"), ("wheels", False, f"{Path.home()}/x is missing", "python3 course.py start")
    monkeypatch.setattr(doctor, "verdicts", some_verdicts(good))
    done = CliRunner().invoke(doctor.command, [])
    assert (done.exit_code, done.output) == (0, "ok    Python           3.12\n")
    monkeypatch.setattr(doctor, "verdicts", some_verdicts(good, bad))
    done = CliRunner().invoke(doctor.command, ["--csv"])
    rows = list(csv.DictReader(io.StringIO(done.output)))
    assert done.exit_code == 1 and [row["verdict"] for row in rows] == ["ok", "FAIL"]
    assert rows[1]["mend"] == "python3 course.py start" and str(Path.home()) not in done.output


@pytest.mark.slow
def test_every_part_is_asked_on_this_machine(monkeypatch, tmp_path):
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path))
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)
    found = list(doctor.verdicts(TREE))
    names = [verdict.name for verdict in found]
    assert names[0] == "Python" and names[-1] == "port"
    assert {"disk", "wheels", "Open3D", "rendering", *_catalog.catalogue()} <= set(names)
    assert ("Linux libraries" in names) == sys.platform.startswith("linux")
    assert all(verdict.mend for verdict in found if verdict.ok is False)
