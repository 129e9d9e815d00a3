"""`start` and `reset`: copies that are never overwritten, trust, and a JupyterLab that really answers."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import nbformat
import psutil
import pytest
from click.testing import CliRunner
from jupyter_client.manager import start_new_kernel
from nbformat.sign import NotebookNotary

from course_lib.authoring import notebooks as nbs
from course_lib.authoring.tree import CourseError, Tree
from course_lib.launch import my_work, reset, server, start

ROOT = Path(__file__).resolve().parents[2]
SECONDS = 120  # a guard against hanging, nothing is judged by it
PROSE = (
    "See [the glossary](../docs/glossary.md#depth), [the lab](../exercises/01_rgbd_images.ipynb#task-1), "
    "[web](https://a.b/../c), [readme](../README.md), [next](02_point_clouds.ipynb), [here](#card)"
)
NAMES = ("00_start_here", "01_rgbd_images", "02_point_clouds")


def notebook(*cells: tuple[str, str]) -> str:
    made = []
    for number, (kind, source) in enumerate(cells):
        cell = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": source.splitlines(keepends=True)}
        if kind == "code":
            cell.update(execution_count=None, outputs=[])
        made.append(cell)
    kernel = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}
    whole = {"cells": made, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(whole, indent=1, sort_keys=True) + "\n"


def lab(name: str, second: str = "def g(): ...") -> str:
    return notebook(
        ("markdown", f"# Lab {name}\n[lesson](../notebooks/{name}.ipynb)"),
        ("markdown", "## Task 1 — first thing (2 points)"),
        ("code", "def f(): ..."),
        ("markdown", "## Task 2 — second thing (3 points)"),
        ("code", second),
    )


@pytest.fixture
def tree(tmp_path):
    made = Tree(tmp_path / "course")
    for folder in (made.lessons_folder, made.exercises_folder, made.solutions_folder):
        folder.mkdir(parents=True)
    made.docs_folder.mkdir()
    glossary = "[lesson 01](../notebooks/01_rgbd_images.ipynb#2-Depth), [words](glossary/), [all](conventions.md)\n"
    (made.docs_folder / "glossary.md").write_text(glossary, "utf-8")
    (made.docs_folder / "conventions.md").write_text("x right\n", "utf-8")
    (made.docs_folder / "instructors.md").write_text("no lesson links here\n", "utf-8")
    for name in NAMES:
        (made.lessons_folder / f"{name}.ipynb").write_text(notebook(("markdown", PROSE), ("code", "6 * 7")), "utf-8")
        (made.exercises_folder / f"{name}.ipynb").write_text(lab(name), "utf-8")
    return made


def contents(tree: Tree) -> dict[str, str]:
    folder = my_work.work_folder(tree)
    return {path.relative_to(folder).as_posix(): path.read_text("utf-8") for path in folder.rglob("*.ipynb")}


def test_lessons_and_labs_are_copied_once(tree):
    said = my_work.update(tree)
    assert sorted(contents(tree)) == [f"labs/{n}.ipynb" for n in NAMES] + [f"lessons/{n}.ipynb" for n in NAMES]
    assert len(said) == 1 and "lesson 00" in said[0] and "lab 02" in said[0]
    before = contents(tree)
    assert my_work.update(tree) == [] and contents(tree) == before


def test_links_of_a_copy_lead_where_those_of_the_original_led(tree):
    my_work.update(tree)
    text = nbformat.reads(contents(tree)["lessons/01_rgbd_images.ipynb"], as_version=4).cells[0].source
    assert "(../docs/glossary.md#depth)" in text
    assert "(../../README.md)" in text and "(02_point_clouds.ipynb)" in text
    assert "(../labs/01_rgbd_images.ipynb#task-1)" in text
    assert "(https://a.b/../c)" in text
    text = nbformat.reads(contents(tree)["labs/01_rgbd_images.ipynb"], as_version=4).cells[0].source
    assert "(../lessons/01_rgbd_images.ipynb)" in text


def test_pages_that_lessons_lead_to_are_copied_and_lead_on_to_copies(tree):
    my_work.update(tree)
    pages = my_work.work_folder(tree) / "docs"
    assert sorted(page.name for page in pages.iterdir()) == ["conventions.md", "glossary.md"]
    assert (pages / "glossary.md").read_text("utf-8") == (
        "[lesson 01](../lessons/01_rgbd_images.ipynb#2-Depth), [words](../../docs/glossary/), [all](conventions.md)\n"
    )
    (tree.docs_folder / "glossary.md").write_text("new: [all](conventions.md)\n", "utf-8")
    (pages / "conventions.md").write_text("my own remark\n", "utf-8")
    (tree.docs_folder / "conventions.md").write_text("new, too\n", "utf-8")
    assert my_work.update(tree) == []
    assert (pages / "glossary.md").read_text("utf-8") == "new: [all](conventions.md)\n"
    assert (pages / "conventions.md").read_text("utf-8") == "my own remark\n"


def test_a_learners_file_is_never_overwritten_and_what_changed_is_named_once(tree):
    my_work.update(tree)
    mine = my_work.work_folder(tree) / "labs" / "01_rgbd_images.ipynb"
    answered = mine.read_text("utf-8").replace("def f(): ...", "def f(): return 1")
    mine.write_text(answered, "utf-8")
    (tree.exercises_folder / "01_rgbd_images.ipynb").write_text(lab("01", "def g(): 'reworded'"), "utf-8")
    said = my_work.update(tree)
    assert mine.read_text("utf-8") == answered
    assert len(said) == 1 and "Lab 01 has changed" in said[0] and "course.py reset 01" in said[0]
    assert "Task 2 — second thing" in said[0] and "Task 1" not in said[0]
    assert my_work.update(tree) == [] and mine.read_text("utf-8") == answered


def test_a_copy_in_which_nothing_was_written_follows_its_original(tree):
    my_work.update(tree)
    mine = my_work.work_folder(tree) / "labs" / "02_point_clouds.ipynb"
    run = nbformat.read(mine, as_version=4)
    run.cells[2].execution_count = 3  # run, not edited
    nbformat.write(run, mine)
    (tree.exercises_folder / "02_point_clouds.ipynb").write_text(lab("02", "def g(): 'new'"), "utf-8")
    said = my_work.update(tree)
    assert len(said) == 1 and "it is the new one" in said[0]
    assert "'new'" in mine.read_text("utf-8")


def test_a_file_of_unknown_origin_or_no_notebook_any_more_is_left_alone(tree):
    mine = my_work.work_folder(tree) / "labs" / "00_start_here.ipynb"
    mine.parent.mkdir(parents=True)
    mine.write_text("my own notes", "utf-8")
    my_work.update(tree)
    other = my_work.work_folder(tree) / "lessons" / "00_start_here.ipynb"
    other.write_text("", "utf-8")
    (tree.lessons_folder / "00_start_here.ipynb").write_text(notebook(("markdown", "new")), "utf-8")
    (tree.exercises_folder / "00_start_here.ipynb").write_text(lab("00", "new = 1"), "utf-8")
    my_work.update(tree)
    assert (mine.read_text("utf-8"), other.read_text("utf-8")) == ("my own notes", "")


def test_a_lost_record_overwrites_nothing(tree):
    my_work.update(tree)
    before = contents(tree)
    (my_work.private_folder(tree) / "copies.json").write_text("{", "utf-8")
    for name in NAMES:
        (tree.exercises_folder / f"{name}.ipynb").write_text(lab(name, "other = 1"), "utf-8")
    my_work.update(tree)
    assert contents(tree) == before


def test_a_copy_that_was_deleted_comes_back(tree):
    my_work.update(tree)
    gone = my_work.work_folder(tree) / "lessons" / "00_start_here.ipynb"
    gone.unlink()
    assert my_work.update(tree) == ["Copied to my_work/ for you to work in: lesson 00."]
    assert gone.exists()


def test_fresh_copies_stand_beside_and_overwrite_nothing(tree):
    my_work.update(tree)
    mine = my_work.work_folder(tree) / "labs" / "01_rgbd_images.ipynb"
    mine.write_text("mine", "utf-8")
    one = my_work.find(tree, "lab", "1")
    names = [my_work.fresh_copy(tree, one).name for _ in range(3)]
    assert names == ["01_rgbd_images-fresh.ipynb", "01_rgbd_images-fresh-2.ipynb", "01_rgbd_images-fresh-3.ipynb"]
    assert mine.read_text("utf-8") == "mine"
    assert mine.with_name(names[2]).read_text("utf-8") == my_work.copy_text(one, my_work.copies(tree))
    other = my_work.find(tree, "lab", "02_point_clouds")
    assert my_work.fresh_copy(tree, other).name == "02_point_clouds-fresh.ipynb"


def test_a_first_fresh_copy_takes_the_plain_name(tree):
    mine = my_work.fresh_copy(tree, my_work.find(tree, "lab", "0"))
    assert mine.name == "00_start_here.ipynb"
    mine.write_text(mine.read_text("utf-8").replace("def f(): ...", "def f(): return 1"), "utf-8")
    (tree.exercises_folder / mine.name).write_text(lab("00", "new = 1"), "utf-8")
    assert any("Lab 00 has changed" in sentence for sentence in my_work.update(tree))  # it counts as a copy


def test_a_fresh_copy_on_a_full_disk_leaves_nothing_half_written(tree, monkeypatch):
    def full(*arguments, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(my_work.Path, "write_text", full)
    with pytest.raises((OSError, ValueError)):
        my_work.fresh_copy(tree, my_work.find(tree, "lab", "0"))
    assert list(my_work.work_folder(tree).rglob("*.ipynb*")) == []


@pytest.mark.parametrize(
    "word", ["1", "01", "rgbd_images", "01_rgbd_images", "01-rgbd-images.ipynb", "lab01", "RGBD images"]
)
def test_labs_are_found_by_number_and_name(tree, word):
    assert my_work.find(tree, "lab", word).name == "01_rgbd_images"


@pytest.mark.parametrize(
    ("word", "near"), [("rgbd_image", "Did you mean rgbd_images?"), ("77", "There are: 00, 01, 02.")]
)
def test_an_unknown_lab_is_one_sentence(tree, word, near):
    with pytest.raises(CourseError, match=f"There is no lab '{word}'") as refused:
        my_work.find(tree, "lab", word)
    assert str(refused.value).endswith(near)


def test_what_the_course_ships_is_trusted_and_what_is_brought_is_not(tree):
    my_work.update(tree)
    originals = {one.original.read_text("utf-8") for one in my_work.materials(tree)}
    assert my_work.sign(tree) == len(originals | set(contents(tree).values()))
    assert my_work.sign(tree) == 0
    notary = NotebookNotary(data_dir=str(my_work.private_folder(tree) / "data"))
    for text in contents(tree).values():
        assert notary.check_signature(nbformat.reads(text, as_version=4))
    brought = nbformat.reads(notebook(("code", "import os")), as_version=4)
    assert not notary.check_signature(brought)
    notary.store.close()


def test_reset_by_the_command_line(tree, monkeypatch):
    monkeypatch.setattr(reset, "course_tree", lambda: tree)
    done = CliRunner().invoke(reset.command, ["02"])
    assert done.exit_code == 0 and done.output == "A fresh lab 02: my_work/labs/02_point_clouds.ipynb\n"
    done = CliRunner().invoke(reset.command, ["02", "--lesson"])
    assert done.output == "A fresh lesson 02: my_work/lessons/02_point_clouds.ipynb\n"


def test_pages_to_open(tree):
    assert start.start_page(tree, None) == "lab/tree/my_work/lessons/00_start_here.ipynb"
    assert start.start_page(tree, "2") == "lab/tree/my_work/lessons/02_point_clouds.ipynb"
    assert start.start_page(Tree(tree.root / "empty"), None) == "lab"


def test_settings_bind_to_this_machine_and_keep_pop_ups_away(tree):
    file = server.settings(tree, 8901, "lab")
    app = json.loads(file.read_text("utf-8"))["ServerApp"]
    assert app["ip"] == "127.0.0.1" and app["port"] == 8901 and app["allow_root"] is True
    assert app["root_dir"] == str(tree.root) and "token" not in app and "password" not in app
    page = json.loads((file.parent / "labconfig" / "page_config.json").read_text("utf-8"))
    assert page["buildCheck"] is False and page["buildAvailable"] is False
    assert page["disabledExtensions"]["@jupyterlab/apputils-extension:announcements"] is True


def test_a_kernel_tells_no_version_that_would_be_written_into_what_is_opened(tree, monkeypatch):
    server.settings(tree, 8901, "lab")
    for key, value in server.environment(tree).items():
        monkeypatch.setenv(key, value)
    manager, client = start_new_kernel(kernel_name="python3")
    try:
        told = client.kernel_info(reply=True, timeout=SECONDS)["content"]["language_info"]
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
    assert told == nbs.LANGUAGE  # what a stored notebook has: JupyterLab sees nothing to change


def test_nobodys_own_jupyter_settings_take_part(tree, monkeypatch):
    monkeypatch.setenv("JUPYTER_TOKEN", "guess")
    monkeypatch.setenv("JUPYTER_CONFIG_DIR", "/home/kim/.jupyter")
    environment = server.environment(tree)
    assert "JUPYTER_TOKEN" not in environment
    private = str(my_work.private_folder(tree))
    for key in ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR"):
        assert environment[key].startswith(private)


@pytest.mark.parametrize(
    ("variables", "expected"),
    [({"DISPLAY": ":0"}, True), ({}, False), ({"DISPLAY": ":0", "SSH_CONNECTION": "x"}, False)],
)
def test_a_browser_is_opened_only_where_there_is_a_window(monkeypatch, variables, expected):
    monkeypatch.setattr(start.sys, "platform", "linux")
    monkeypatch.setattr(start.shutil, "which", lambda name: None)
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert start.has_browser() is expected


def test_the_browser_is_led_on_by_a_private_file(tree, monkeypatch):
    opened = []
    monkeypatch.setattr(start.webbrowser, "open", lambda url: opened.append(url) or True)
    my_work.private_folder(tree).mkdir(parents=True)
    start._open(tree, "http://127.0.0.1:1/lab?token=abc")
    assert "abc" not in opened[0] and opened[0].startswith("file:")
    page = my_work.private_folder(tree) / "open.html"
    assert "token=abc" in page.read_text("utf-8")
    assert os.name == "nt" or page.stat().st_mode & 0o077 == 0


RUN = """
import sys
from pathlib import Path
from course_lib.launch import start
from course_lib.authoring.tree import Tree
folder, port, lesson = [*sys.argv[1:], None][:3]
sys.exit(start.start(Tree(Path(folder)), lesson, int(port), browser=False))
"""


def begin(tree: Tree, port: int, *lesson: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        [sys.executable, "-c", RUN, str(tree.root), str(port), *lesson],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
    )


def address_of(process: subprocess.Popen[str]) -> tuple[str, list[str]]:
    """The address that a `start` prints, and the lines up to it."""
    lines = []
    for line in process.stdout:
        lines.append(line)
        if line.strip().startswith("http://127.0.0.1:"):
            return line.strip(), lines
    raise AssertionError("no address: " + "".join(lines))


def status(address: str) -> int:
    try:
        with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(address, timeout=SECONDS) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C cannot be sent to one process on Windows")
def test_jupyterlab_answers_once_a_folder_and_stops_with_its_start(tree):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        both = [begin(tree, port), begin(tree, port, "02")]
        try:
            found = [address_of(process) for process in both]
            addresses = [address for address, _ in found]
            bases = {address.partition("/lab/tree/")[0] for address in addresses}
            assert len(bases) == 1, "two servers for one folder"
            assert bases != {f"http://127.0.0.1:{port}"}, "the port is another's"
            assert all(status(address) == 200 for address in addresses)
            assert addresses[1].split("?")[0].endswith("/my_work/lessons/02_point_clouds.ipynb")
            contents_page = bases.pop() + "/api/contents/my_work/labs"
            assert status(contents_page) == 403
            assert status(contents_page + "?" + addresses[0].partition("?")[2]) == 200
            there = server.running(tree)
            connections = psutil.Process(there.pid).net_connections(kind="inet")
            listening = {one.laddr.ip for one in connections if one.status == psutil.CONN_LISTEN}
            assert listening == {"127.0.0.1"}
            said = ["".join(lines) for _, lines in found]
            assert sum("already open" in text for text in said) == 1
            second = both[[("already open" in text) for text in said].index(True)]
            assert second.wait(SECONDS) == 0
            first = next(process for process in both if process is not second)
            first.send_signal(signal.SIGINT)
            rest = first.communicate(timeout=SECONDS)[0]
            assert first.returncode == 0 and "Stopped." in rest and "Traceback" not in rest
            assert server.running(tree) is None and not psutil.pid_exists(there.pid)
        finally:
            for process in both:
                if process.poll() is None:
                    process.terminate()
                process.communicate(timeout=SECONDS)


def test_a_server_that_cannot_start_is_one_sentence(tree, monkeypatch):
    my_work.private_folder(tree).mkdir(parents=True)
    (my_work.private_folder(tree) / "server.log").write_text("a\nthe last line\n", "utf-8")
    child = subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"])
    child.wait(SECONDS)
    with pytest.raises(CourseError, match="ended with code 3.*my_work/.jupyter/server.log.*the last line"):
        server.wait_until_it_answers(tree, child, "lab")


def test_a_folder_that_cannot_be_written_is_one_sentence(tree):
    (tree.root / "my_work").write_text("a file in the way", "utf-8")
    with pytest.raises(CourseError, match="cannot be written"), start._one_at_a_time(tree):
        pass
