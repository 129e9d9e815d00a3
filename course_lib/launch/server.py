"""JupyterLab for this copy of the course: private settings, one server a folder, bound to this machine with a token."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from dataclasses import dataclass
from pathlib import Path

import psutil

from course_lib.authoring.tree import CourseError, Tree

from .my_work import private_folder

START_SECONDS = 90
KERNEL = """\
# A kernel that does not tell JupyterLab its version: it would be written into every notebook that is opened.
from ipykernel.ipkernel import IPythonKernel


class CourseKernel(IPythonKernel):
    language_info = {key: value for key, value in IPythonKernel.language_info.items() if key != "version"}


c.IPKernelApp.kernel_class = CourseKernel  # noqa: F821 - traitlets gives c
"""
_DIRECT = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # loopback never goes through a proxy


@dataclass(frozen=True)
class Server:
    """A running JupyterLab."""

    url: str
    token: str
    port: int
    pid: int

    def address(self, page: str) -> str:
        """What a browser opens: a page below the server's root, with the token."""
        return f"{self.url}{page}?token={self.token}"

    def answers(self, page: str = "api/status") -> bool:
        """Whether a page is served to who holds the token."""
        return _ask(self.address(page)) == 200

    def stop(self) -> None:
        """Ask the server to save nothing more, end its kernels and go; end it where it does not."""
        _ask(self.address("api/shutdown"), b"")
        with contextlib.suppress(psutil.NoSuchProcess):  # gone already
            try:
                psutil.Process(self.pid).wait(15)
            except psutil.TimeoutExpired:
                psutil.Process(self.pid).kill()


def _ask(address: str, post: bytes | None = None) -> int:
    """The status that an address answers with; 0 where nobody answers."""
    try:
        with _DIRECT.open(urllib.request.Request(address, data=post), timeout=10) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return 0


def settings(tree: Tree, port: int, page: str) -> Path:
    """Write Jupyter's and the kernel's settings for this course into my_work/.jupyter; return the server's file."""
    config = private_folder(tree) / "config"
    server = {
        "ServerApp": {
            "ip": "127.0.0.1",
            "port": port,
            "port_retries": 50,
            "open_browser": False,
            "allow_root": True,
            "root_dir": str(tree.root),
            "default_url": "/" + page,
            # jupytext's would write a second file beside each notebook that it saves
            "jpserver_extensions": {"jupyterlab": True, "jupytext": False, "jupyterlab_jupytext": False},
        },
        "LabApp": {"extension_manager": "readonly", "check_for_updates_class": "jupyterlab.NeverCheckForUpdate"},
        "KernelSpecManager": {"allowed_kernelspecs": ["python3"]},
    }
    # No pop-ups: no offer to build, no news.
    pages = {
        "buildCheck": False,
        "buildAvailable": False,
        "disabledExtensions": {"@jupyterlab/apputils-extension:announcements": True, "jupyterlab-jupytext": True},
    }
    for name, content in (("jupyter_server_config.json", server), ("labconfig/page_config.json", pages)):
        path = config / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    kernel = private_folder(tree) / "ipython" / "profile_default" / "ipython_kernel_config.py"
    kernel.parent.mkdir(parents=True, exist_ok=True)
    kernel.write_text(KERNEL, encoding="utf-8")
    return config / "jupyter_server_config.json"


def environment(tree: Tree) -> dict[str, str]:
    """The environment of the server and its kernels: nobody's own Jupyter or IPython settings take part."""
    home = private_folder(tree)
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("JUPYTER", "JPY_", "IPYTHON"))}
    return {
        **kept,
        "JUPYTER_CONFIG_DIR": str(home / "config"),
        "JUPYTER_DATA_DIR": str(home / "data"),
        "JUPYTER_RUNTIME_DIR": str(home / "runtime"),
        "JUPYTER_PREFER_ENV_PATH": "1",
        "IPYTHONDIR": str(home / "ipython"),
        "COURSE_LIVE": "1",  # somebody is there: sliders move, as show.slider says
    }


def running(tree: Tree) -> Server | None:
    """The server of this folder, if one runs and answers."""
    for note in sorted((private_folder(tree) / "runtime").glob("jpserver-*.json")):
        try:
            known = json.loads(note.read_text(encoding="utf-8"))
            server = Server(known["url"], known["token"], known["port"], known["pid"])
        except (OSError, ValueError, KeyError):
            continue  # being written, or being removed
        if psutil.pid_exists(server.pid) and server.answers():
            return server
    return None


def begin(tree: Tree, port: int, page: str) -> subprocess.Popen[bytes]:
    """Start JupyterLab as a process of its own; what it says goes to my_work/.jupyter/server.log."""
    config = settings(tree, port, page)
    words = [sys.executable, "-P", "-m", "jupyterlab", "--config", str(config)]
    with open(private_folder(tree) / "server.log", "wb") as log:
        # A group of its own: Ctrl-C reaches `start`, which then stops the server in order.
        group = {"creationflags": 0x200} if sys.platform == "win32" else {"start_new_session": True}
        return subprocess.Popen(
            words, env=environment(tree), cwd=tree.root, stdin=subprocess.DEVNULL, stdout=log, stderr=log, **group
        )


def wait_until_it_answers(tree: Tree, child: subprocess.Popen[bytes], page: str) -> Server:
    """Wait until the server serves a page.

    Raises
    ------
    CourseError
        If it ends, or does not answer in time; with the last line of its log.
    """
    until = time.monotonic() + START_SECONDS
    while time.monotonic() < until and child.poll() is None:
        server = running(tree)
        if server and server.answers(page):
            return server
        time.sleep(0.1)
    child.kill()
    log = private_folder(tree) / "server.log"
    lines = [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
    why = f"ended with code {child.returncode}" if child.returncode else f"did not answer in {START_SECONDS} s"
    last = f" Its last words: {lines[-1].strip()}" if lines else ""
    raise CourseError(f"JupyterLab {why}; what it said is in {tree.relative(log)}.{last}")
