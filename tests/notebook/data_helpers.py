"""Small stand-ins for the data tests: a recipe that takes no time, a catalogue entry, a server of one file."""

import hashlib
import http.server
import os
import threading
from contextlib import contextmanager

import numpy as np
import pytest

from course_lib.notebook._catalog import Entry, RemoteFile
from course_lib.simulate.recipes.recipe import Recipe, RecipeOutput

MIRROR = os.environ.get("COURSE_DATA_MIRROR", "")
needs_mirror = pytest.mark.skipif(not MIRROR, reason="real data: COURSE_DATA_MIRROR is not set")

ENTRY = Entry(
    name="tiny_room",
    kind="synthetic",
    title="a tiny room",
    licence="MIT",
    credit="this test",
    units="metres",
    recipe="tiny_room",
    version=3,
    seed=7,
)

CAMERA = {"width": 8, "height": 6, "fx": 10.0, "fy": 10.0, "cx": 3.5, "cy": 2.5, "source": "true by construction"}


def tiny_output(seed: int) -> RecipeOutput:
    """Two frames of 8x6 pixels with everything that a recipe may return."""
    rng = np.random.default_rng(seed)
    frames = [
        {
            "color": rng.integers(0, 256, (6, 8, 3), dtype=np.uint8),
            "depth_raw": rng.integers(500, 3000, (6, 8), dtype=np.uint16),
            "depth_truth": rng.uniform(0.5, 3, (6, 8)).astype(np.float32),
            "labels": rng.integers(0, 3, (6, 8), dtype=np.uint8),
            "artefacts": np.zeros((6, 8), np.uint8),
        }
        for _ in range(2)
    ]
    poses = np.stack([np.eye(4), np.eye(4)])
    poses[1, 0, 3] = 0.25
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    return RecipeOutput(
        frames=frames,
        encoding="realsense",
        camera=CAMERA,
        poses=poses,
        meshes={"surface": {"vertices": corners, "triangles": np.int32([[0, 1, 2]]), "labels": np.uint8([1, 1, 2])}},
        clouds={"cloud": {"points": corners, "colors": np.zeros((3, 3), np.uint8)}},
        truth={"box_size": np.array([0.1, 0.2, 0.3])},
        meta={"title": "a tiny room", "label_names": ["nothing", "floor", "box"], "baseline": np.float64(0.095)},
    )


def tiny_recipe(maker=None) -> Recipe:
    """A recipe that fits ENTRY."""

    def quick(seed, progress):
        progress(1, 1)
        return tiny_output(seed)

    return Recipe(7, 3, "a tiny room", maker or quick)


def remote(content: bytes, url: str, path: str = "folder/file.bin") -> RemoteFile:
    """A catalogue's file with this content."""
    return RemoteFile("file.bin", path, url, hashlib.sha256(content).hexdigest(), len(content))


def real_entry(*files: RemoteFile) -> Entry:
    """A catalogue's real entry of these files."""
    return Entry("tiny_real", "real", "a tiny real one", "MIT", "this test", "metres", reader="frames", files=files)


class _Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        server = self.server
        server.requests.append(self.headers.get("Range"))
        plan = server.plans.pop(0) if server.plans else {}
        status, content = plan.get("status", 200), plan.get("content", server.content)
        start = 0
        asked = self.headers.get("Range")
        if asked and status == 200 and plan.get("ranges", True):
            start, status = int(asked.removeprefix("bytes=").rstrip("-")), 206
        body = content[start:]
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        if status == 206:
            self.send_header("Content-Range", f"bytes {start}-{len(content) - 1}/{len(content)}")
        self.end_headers()
        self.wfile.write(body[: plan.get("cut", len(body))])

    def log_message(self, *args):
        pass


@contextmanager
def serving(content: bytes, *plans: dict):
    """Serve one content on 127.0.0.1; each plan changes one answer: status, content, cut (bytes sent), ranges."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), _Handler)
    server.content, server.plans, server.requests = content, list(plans), []
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    try:
        yield server, f"http://127.0.0.1:{server.server_port}/file.bin"
    finally:
        server.shutdown()
        server.server_close()
        thread.join(10)
