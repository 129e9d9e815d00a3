"""`start`: open JupyterLab on the course's start page, lessons and labs as the learner's own copies."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import webbrowser
from pathlib import Path

import click
from filelock import AcquireReturnProxy

from course_lib import compiled
from course_lib.authoring.tree import CourseError, Tree, course_tree
from course_lib.notebook._atomic import locked

from . import my_work, server

PORT = 8888


@click.command("start")
@click.argument("lesson", required=False)
@click.option("--no-browser", is_flag=True, help="Only print the address.")
@click.option(
    "--port", type=click.IntRange(1, 65535), default=PORT, show_default=True, help="The next free one is taken."
)
@click.option("--stop", is_flag=True, help="Stop the JupyterLab of this folder.")
def command(lesson: str | None, no_browser: bool, port: int, stop: bool) -> None:
    """Open JupyterLab on the course's start page, or on LESSON (a number or a name).

    You work in my_work/: lessons and labs are copies there, and nothing of yours is ever overwritten.
    """
    tree = course_tree()
    if stop:
        there = server.running(tree)
        if there:
            there.stop()
        click.echo("JupyterLab is stopped." if there else "No JupyterLab of this folder is running.")
        return
    sys.exit(start(tree, lesson, port, browser=not no_browser and has_browser()))


def start(tree: Tree, lesson: str | None, port: int, *, browser: bool) -> int:
    """Make the copies, find or begin the server, say its address, and stay until it is stopped."""
    page = start_page(tree, lesson)
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.default_int_handler)
    child = compiling = None
    try:
        with _one_at_a_time(tree):
            for sentence in my_work.update(tree):
                click.echo(sentence)
            there = server.running(tree)
            if there is None:
                child = server.begin(tree, port, page)
            my_work.sign(tree)  # while the server starts
            if child:
                there = server.wait_until_it_answers(tree, child, page)
                # loops are compiled while the learner reads the start page; at once done where they are
                words, nothing = [sys.executable, "-P", "-m", compiled.__name__], subprocess.DEVNULL
                compiling = subprocess.Popen(words, stdin=nothing, stdout=nothing, stderr=nothing)
        _tell(there, page, port, mine=child is not None)
        if browser:
            _open(tree, there.address(page))
        if child is None:
            return 0
        code = child.wait()
        click.echo("JupyterLab has stopped." if not code else f"JupyterLab ended with code {code}.")
        return code
    except KeyboardInterrupt:
        if child and child.poll() is None:
            click.echo("\nStopping JupyterLab …")
            there = server.running(tree)
            there.stop() if there else child.terminate()
            child.wait(20)
        click.echo("Stopped. What you saved is in my_work/.")
        return 0
    finally:
        for process in (child, compiling):
            if process and process.poll() is None:
                process.kill()


def start_page(tree: Tree, lesson: str | None) -> str:
    """The page to open, below the server's root: a lesson's copy, or JupyterLab itself where no lesson is there."""
    lessons = my_work.materials(tree, "lesson")
    if lesson is None and not lessons:
        return "lab"
    one = my_work.find(tree, "lesson", lesson) if lesson is not None else lessons[0]
    return "lab/tree/" + one.copy.relative_to(tree.root).as_posix()


def _one_at_a_time(tree: Tree) -> AcquireReturnProxy:
    """The lock of `start`: the second of two waits, and then finds the server of the first."""
    folder = my_work.private_folder(tree)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CourseError(
            f"The folder {tree.root} cannot be written ({error.strerror}): copy the course to a folder of your own."
        ) from error
    return locked(folder / "start.lock", "Another `start` of this folder is under way; waiting for it.", click.echo)


def _tell(there: server.Server, page: str, port: int, *, mine: bool) -> None:
    if not mine:
        click.echo("The course is already open in another terminal.")
    elif there.port != port:
        click.echo(f"Port {port} is taken, so it is port {there.port}.")
    click.echo(f"\n    {there.address(page)}\n")
    if os.environ.get("SSH_CONNECTION"):
        click.echo(f"From your own machine, first: ssh -L {there.port}:127.0.0.1:{there.port} this-machine")
    stop = "`python3 course.py start --stop`"
    click.echo(f"Stop it with Ctrl-C here, or with {stop} anywhere." if mine else f"Stop it with {stop}.")


def has_browser() -> bool:
    """Whether a window can be opened here; never a browser inside the terminal, never one at the far end of ssh."""
    if os.environ.get("SSH_CONNECTION"):
        return False
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or shutil.which("wslview"))


def _open(tree: Tree, address: str) -> None:
    """Open a browser by a private file that leads on, so that the token stands in nobody's list of processes."""
    page = my_work.private_folder(tree) / "open.html"
    page.unlink(missing_ok=True)
    with open(os.open(page, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as file:
        file.write(f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={address}">\n')
    if not webbrowser.open(Path(page).as_uri()):
        click.echo("No browser could be opened: copy the address above into one.")
