"""What a graded kernel can import: NumPy and what its tasks allow, without what answers them; nothing else."""

from __future__ import annotations

import ast
import dataclasses
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from grading_helpers import need_sandbox

from course_lib import tasks
from course_lib.authoring.tree import CourseError
from course_lib.grading.release.hiding import find_hidden, hidden_sources
from course_lib.grading.run import nbval_items
from course_lib.grading.run.inside.course_probe import MIME
from course_lib.grading.run.kernel import Kernel
from course_lib.grading.run.kernel_imports import ROOT, build_room, rooms_of
from course_lib.grading.run.limits import read_limits
from course_lib.grading.run.sandbox import probe_sandbox


def there(room, code: str) -> str:
    """What code prints with a room's library on its path, as in the kernel."""
    text = f"import sys; sys.path.insert(0, {str(room.folder / 'lib')!r})\n{code}"
    done = subprocess.run(
        [sys.executable, "-c", text], capture_output=True, text=True, timeout=60, check=False, cwd="/"
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_no_lab_of_today_brings_a_module_with_an_answer(tmp_path):
    for number in tasks.lab_numbers():
        place = tmp_path / number
        place.mkdir()
        room = build_room(place, tasks.lab(number), read_limits())
        files = sorted(path.relative_to(place / "lib").as_posix() for path in (place / "lib").rglob("*.py"))
        library = [name for name in files if name.startswith("course_lib/")]
        assert library == [
            f"course_lib/{name}.py"
            for name in ("__init__", "tasks/__init__", "tasks/core", "tasks/plain", "tasks/running")
        ]
        names = {name for name, _ in room.packages}
        allowed = {name.split(".")[0] for task in tasks.lab(number) for name in task.may_call}
        assert "numpy" in names and ("scipy" in names) == ("scipy" in allowed)
        assert not names & {"open3d", "cv2", "course_lib", "nbval", "pytest", "nbformat"}
        taken = json.loads((place / "room.json").read_text())["taken"]
        assert taken == sorted({h for t in tasks.lab(number) for h in t.hides if not h.startswith("course_lib.")})


def test_a_task_that_allows_a_module_gets_it_without_the_answer(tmp_path):
    first, second, *_ = tasks.lab("02")
    open_ = dataclasses.replace(
        second, may_call=("numpy", "course_lib.geometry.transforms"), hides=("course_lib.geometry.transforms.invert",)
    )
    assert [len(group) for group in rooms_of([first, open_])] == [1, 1]
    (tmp_path / "r").mkdir()
    room = build_room(tmp_path / "r", [open_], read_limits())
    code = "from course_lib.geometry import transforms as t; import numpy as np\nprint(t.rotation_vector.__name__)\n"
    code += "try:\n    t.invert(np.eye(4))\nexcept RuntimeError as error:\n    print(error)\n"
    name, sentence = there(room, code).splitlines()
    assert name == "rotation_vector" and "asks you to write" in sentence


def test_a_package_that_is_not_installed_is_named(tmp_path):
    one = dataclasses.replace(tasks.get("02-1"), may_call=("numpy", "no_such_package"))
    with pytest.raises(CourseError, match="no_such_package, which is not installed"):
        build_room(tmp_path, [one], read_limits())


def test_hidden_functions_are_gone_from_the_source():
    hidden = sorted({h for t in tasks.all_tasks() for h in t.hides if h.startswith("course_lib.")})
    found = find_hidden(hidden, ROOT)
    assert [one.public for one in found] == hidden
    for path, text in hidden_sources(hidden, ROOT).items():
        bodies = {node.name: node.body for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}
        for one in found:
            if one.path == path and one.is_function:
                code = [node for node in bodies[one.name] if not isinstance(node, ast.Expr)]
                assert [type(node) for node in code] == [ast.Raise], one.public
    guarded = hidden_sources(hidden, ROOT, hidden)
    for path, text in guarded.items():
        compile(text, str(path), "exec")
        assert any(one.path == path and not one.is_function for one in found) or "_getframe" in text


def test_a_name_that_does_not_exist_is_told():
    with pytest.raises(CourseError, match="does not exist"):
        find_hidden(["course_lib.camera.pinhole.no_such_thing"], ROOT)


def said_in_a_kernel(task_: tasks.Task, source: str, folder: Path):
    """What a statement publishes in a kernel of a task's room."""
    (folder / "room").mkdir()
    room = build_room(folder / "room", [task_], read_limits())
    with tempfile.TemporaryDirectory(prefix="k") as short:
        kernel = Kernel(probe_sandbox(), room, read_limits(), Path(short), lambda answer: answer)
        try:
            (said,) = kernel.ask(source, [])
        finally:
            kernel.stop()
    return said


def test_a_function_of_numpy_that_answers_a_task_is_not_there(tmp_path):
    need_sandbox()
    one = dataclasses.replace(tasks.get("02-1"), hides=("numpy.linalg.inv",))
    source = (
        "import numpy as np\ntry:\n    said = str(getattr(np.linalg, 'i' + 'nv')(np.eye(2)))\n"
        f"except RuntimeError as error:\n    said = str(error)\nget_ipython().display_pub.publish({{{MIME!r}: said}})"
    )
    assert "numpy.linalg.inv is not here" in said_in_a_kernel(one, source, tmp_path)
    one = dataclasses.replace(one, hides=())
    (tmp_path / "free").mkdir()
    assert "1." in said_in_a_kernel(one, source, tmp_path / "free")  # the control


def test_the_probe_looked_for_itself():
    need_sandbox()
    held = probe_sandbox()
    assert held.kind == "bwrap" and "--unshare-net" in held.words and "--cap-drop ALL" in held.words


def test_inputs_travel_beside_the_statement_that_asks():
    """In the statement they would be read, hashed and rewritten as source text, letter by letter."""
    one = tasks.get("05-5")
    statement, given = nbval_items._question(one, "0" * 32, tasks.fresh(one, 5))
    assert sum(map(len, given)) > 1_000_000 > 1_000 > len(statement)


@pytest.mark.slow
def test_loops_of_an_allowed_module_are_compiled_before_the_kernel_starts(tmp_path):
    need_sandbox()
    one = dataclasses.replace(tasks.get("02-1"), may_call=("numpy", "course_lib.cloud.normals"), hides=())
    source = (
        "import numpy as np\nfrom course_lib import compiled\n"
        "from course_lib.cloud.normals import estimate_normals\n"
        "points = np.random.default_rng(1).uniform(0, [1, 1, 0], (5000, 3))\n"
        "upright = float(np.abs(estimate_normals(points, 8)[:, 2]).min())\n"
        f"get_ipython().display_pub.publish({{{MIME!r}: [upright, compiled.states]}})"
    )
    upright, states = said_in_a_kernel(one, source, tmp_path)
    names = {place.name for place in (tmp_path / "room" / "site").iterdir()}
    assert {"numba", "llvmlite", "scipy"} <= names
    assert upright == pytest.approx(1.0) and states and set(states.values()) == {"cached"}, states
