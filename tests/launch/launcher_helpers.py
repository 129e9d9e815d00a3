"""A course of one tiny package, a package index on 127.0.0.1, and ways to run the launcher in them."""

from __future__ import annotations

import base64
import hashlib
import io
import os
import platform
import shutil
import subprocess
import sys
import threading
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SECONDS = 120  # a guard against hanging, nothing is judged by it


def real_uv() -> str | None:
    """The uv that set up this environment."""
    private = sorted((ROOT / ".uv").glob("uv-*/uv"))
    return shutil.which("uv") or (str(private[-1]) if private else None)


def wheel(name: str, version: str, files: dict[str, bytes]) -> bytes:
    """The bytes of a small wheel; the same for the same content."""
    info = f"{name}-{version}.dist-info"
    content = {
        **files,
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n".encode(),
        f"{info}/WHEEL": b"Wheel-Version: 1.0\nGenerator: tests\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    record = "".join(f"{path},,\n" for path in content) + f"{info}/RECORD,,\n"
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for path, data in {**content, f"{info}/RECORD": record.encode()}.items():
            archive.writestr(zipfile.ZipInfo(path, (2026, 1, 1, 0, 0, 0)), data)
    return buffer.getvalue()


class Index:
    """A package index (simple API in HTML, relative links) on a free port of 127.0.0.1.

    Attributes
    ----------
    asked : every path that was asked for, in order, with whether a password came along.
    hold : while cleared, wheels are not answered; `held` is set once one was asked for.
    """

    def __init__(self, files: dict[str, bytes], password: str = "") -> None:
        self.files, self.password = files, password
        self.asked: list[tuple[str, bool]] = []
        self.hold, self.held = threading.Event(), threading.Event()
        self.hold.set()
        index = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                index.answer(self)

            do_HEAD = do_GET

            def log_message(self, *args: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()

    @property
    def url(self) -> str:
        """The address to configure, with the password in it where there is one."""
        secret = f"reader:{self.password}@" if self.password else ""
        return f"http://{secret}127.0.0.1:{self.server.server_address[1]}/simple"

    def paths(self) -> list[str]:
        return [path for path, _ in self.asked]

    def answer(self, request: BaseHTTPRequestHandler) -> None:
        expected = "Basic " + base64.b64encode(f"reader:{self.password}".encode()).decode()
        allowed = not self.password or request.headers.get("Authorization") == expected
        self.asked.append((request.path, allowed))
        name = request.path.rpartition("/")[2]
        project = request.path.strip("/").rpartition("/")[2]
        if not allowed:
            return _send(request, 401, b"", {"WWW-Authenticate": 'Basic realm="index"'})
        if name.endswith(".whl") and name in self.files:
            self.held.set()
            self.hold.wait(SECONDS)
            return _send_file(request, self.files[name])
        links = [f'<a href="../../files/{file}#x">{file}</a>' for file in self.files if file.startswith(f"{project}-")]
        if not links:
            return _send(request, 404, b"no such project")
        return _send(request, 200, "<!doctype html><br>".join(["", *links]).encode(), {"Content-Type": "text/html"})

    def close(self) -> None:
        self.hold.set()
        self.server.shutdown()
        self.server.server_close()


def _send(request: BaseHTTPRequestHandler, status: int, body: bytes, headers: dict[str, str] | None = None) -> None:
    try:
        request.send_response(status)
        for key, value in {"Content-Length": str(len(body)), **(headers or {})}.items():
            request.send_header(key, value)
        request.end_headers()
        if request.command == "GET":
            request.wfile.write(body)
    except OSError:
        pass  # a killed client hears no answer


def _send_file(request: BaseHTTPRequestHandler, body: bytes) -> None:
    wanted = request.headers.get("Range", "")
    begin, _, end = wanted.removeprefix("bytes=").partition("-")
    if not begin.isdigit():
        return _send(request, 200, body, {"Content-Type": "application/octet-stream", "Accept-Ranges": "bytes"})
    first, last = int(begin), min(int(end) if end else len(body) - 1, len(body) - 1)
    return _send(request, 206, body[first : last + 1], {"Content-Range": f"bytes {first}-{last}/{len(body)}"})


@contextmanager
def serving(files: dict[str, bytes], password: str = "") -> Iterator[Index]:
    """An index for the length of a block."""
    index = Index(files, password)
    try:
        yield index
    finally:
        index.close()


TINY = wheel("tiny", "1.0", {"tiny.py": b"ANSWER = 42\n"})
TINY_NAME = "tiny-1.0-py3-none-any.whl"
UV_NAME = f"uv-0.99.0-py3-none-manylinux_2_17_{platform.machine().lower()}.whl"
CLI = """
import json, os, sys
import tiny
import course_lib
arguments = sys.argv[1:]
print(json.dumps({"arguments": arguments, "answer": tiny.ANSWER, "library": course_lib.__file__, "prefix": sys.prefix}))
sys.exit(int(arguments[1]) if arguments[1:2] and arguments[1].isdigit() else 0)
"""


def uv_wheel() -> bytes:
    """A wheel called uv whose program hands on to the real one."""
    script = f'#!/bin/sh\nPATH="$PATH:/usr/bin:/bin" exec "{real_uv()}" "$@"\n'.encode()
    return wheel("uv", "0.99.0", {"uv-0.99.0.data/scripts/uv": script})


def _entry(name: str, version: str, filename: str, content: bytes) -> str:
    digest = hashlib.sha256(content).hexdigest()
    wheels = f'{{ url = "https://files.invalid/{filename}", hash = "sha256:{digest}", size = {len(content)} }}'
    return (
        f'[[package]]\nname = "{name}"\nversion = "{version}"\nsource = {{ registry = "https://pypi.org/simple" }}\n'
        f"wheels = [\n    {wheels},\n]\n\n"
    )


def mini_course(folder: Path) -> Path:
    """Make a course that needs one tiny package, whose lock names an address that does not exist."""
    folder.mkdir(parents=True)
    shutil.copyfile(ROOT / "course.py", folder / "course.py")
    library = folder / "course_lib"
    shutil.copytree(
        ROOT / "course_lib/launch/bootstrap", library / "launch/bootstrap", ignore=shutil.ignore_patterns("__pycache__")
    )
    for package in (library, library / "launch"):
        (package / "__init__.py").write_text("", encoding="utf-8")
    set_bytes_needed(folder, "2_500_000_000", "1_000_000")  # the tiny package fits on any disk
    (library / "cli.py").write_text(CLI, encoding="utf-8")
    (folder / "pyproject.toml").write_text(
        '[project]\nname = "mini-course"\nversion = "0.1.0"\nrequires-python = ">=3.11,<3.15"\n'
        'dependencies = ["tiny==1.0"]\n[tool.uv]\npackage = false\n',
        encoding="utf-8",
    )
    machine = platform.machine()
    (folder / "uv.lock").write_text(
        'version = 1\nrevision = 3\nrequires-python = ">=3.11, <3.15"\n\n'
        '[[package]]\nname = "mini-course"\nversion = "0.1.0"\nsource = { virtual = "." }\n'
        'dependencies = [\n    { name = "tiny" },\n]\n\n'
        '[package.metadata]\nrequires-dist = [{ name = "tiny", specifier = "==1.0" }]\n\n'
        + _entry("open3d", "0.20.0", f"open3d-0.20.0-cp311-cp311-manylinux_2_17_{machine}.whl", b"never fetched")
        + _entry("tiny", "1.0", TINY_NAME, TINY)
        + _entry("uv", "0.99.0", UV_NAME, uv_wheel()),
        encoding="utf-8",
    )
    return folder


def set_bytes_needed(course: Path, before: str, after: str) -> None:
    """Let a course believe that it needs another number of bytes."""
    disk = course / "course_lib/launch/bootstrap/disk.py"
    text = disk.read_text(encoding="utf-8")
    assert f"BYTES_NEEDED = {before}" in text
    disk.write_text(text.replace(f"BYTES_NEEDED = {before}", f"BYTES_NEEDED = {after}"), encoding="utf-8")


def clean_environment(folder: Path, **variables: str) -> dict[str, str]:
    """An environment without uv on PATH, without anybody's settings, with a cache of its own."""
    (folder / "bin").mkdir(parents=True, exist_ok=True)
    return {
        "PATH": str(folder / "bin"),
        "HOME": str(folder),
        "LANG": "C.UTF-8",
        "UV_CACHE_DIR": str(folder / "cache"),
        "PIP_CONFIG_FILE": os.devnull,
        "NO_PROXY": "127.0.0.1",
        **variables,
    }


def begin(course: Path, environment: dict[str, str], *words: str) -> subprocess.Popen[str]:
    """Start the launcher in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, str(course / "course.py"), *words],
        env=environment,
        cwd=course,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        start_new_session=True,
    )


def run(course: Path, environment: dict[str, str], *words: str) -> tuple[int, str, str]:
    """Run the launcher; its exit code, what it printed, and what it said."""
    process = begin(course, environment, *words)
    printed, said = process.communicate(timeout=SECONDS)
    return process.returncode, printed, said
