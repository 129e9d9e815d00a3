"""Attacks from inside the notebook on the verdict: each gains its point where `check` judges in the same process."""

from __future__ import annotations

import nbformat
import numpy as np
import pytest
from grading_helpers import ROOT, exercise, graded, need_sandbox, submission, task
from how_thorough import some
from naive import green, run_nbval_on_each

from course_lib import tasks

pytestmark = pytest.mark.slow

WRONG = "def metres(depth_mm):\n    return depth_mm * 0.0\n"
RIGHT = "def metres(depth_mm):\n    return depth_mm / 1000\n"

# kind: code that goes before or around a wrong answer to the one task of lab 00
ATTACKS = {
    "traceback suppression": WRONG + "get_ipython().showtraceback = lambda *given, **named: None\n",
    "custom exception handler": WRONG
    + "get_ipython().set_custom_exc((BaseException,), lambda *given, **named: None)\n",
    "AST transformer": WRONG
    + "import ast\nclass Gone(ast.NodeTransformer):\n    def visit_Call(self, node):\n"
    + "        return ast.Constant(None) if getattr(node.func, 'id', '') == 'check' else node\n"
    + "get_ipython().ast_transformers.append(Gone())\n",
    "input transformer": WRONG + "get_ipython().input_transformers_post.append(lambda lines: ['pass\\n'])\n",
    "run_cell replaced": WRONG
    + "ip = get_ipython()\nfrom IPython.core.interactiveshell import ExecutionResult\n"
    + "async def fake(*given, **named):\n    return ExecutionResult(None)\n"
    + "ip.run_cell = lambda *given, **named: ExecutionResult(None)\nip.run_cell_async = fake\n",
    "do_execute replaced": WRONG
    + "kernel = get_ipython().kernel\nasync def fake(*given, **named):\n"
    + "    return {'status': 'ok', 'execution_count': 1, 'payload': [], 'user_expressions': {}}\n"
    + "kernel.do_execute = fake\n",
    "patched builtins": WRONG + "import builtins\nbuiltins.all = lambda things: True\n",
    "check replaced": WRONG + "check = lambda *given: None\n",
    "NBVAL_SKIP": WRONG,
}
FRAMES = """
tools = [__import__("sys"), __import__("gc")]


def metres(depth_mm):
    frame = tools[0]._getframe()
    while frame:
        case = frame.f_locals.get("case")
        if hasattr(case, "hidden") and "truth" in case.hidden:
            return case.hidden["truth"]
        frame = frame.f_back
    return depth_mm * 0.0
"""
COLLECTOR = """
tools = [__import__("gc")]


def metres(depth_mm):
    for case in tools[0].get_objects():
        if type(case).__name__ == "Case" and hasattr(case, "given") and "depth_mm" in case.given:
            if np.array_equal(case.given["depth_mm"], depth_mm) and "truth" in case.hidden:
                return case.hidden["truth"]
    return depth_mm * 0.0
"""
LIBRARY = """
import course_lib.camera.intrinsics

tools = [__import__("importlib"), __import__("sys"), check]


def focal_length(fov_degrees, pixels):
    REACH
    return place.focal_length(np.radians(fov_degrees), pixels)
"""
REACH = {
    "importlib": "place = tools[0].import_module('.'.join(['course_lib', 'camera', 'intrin' + 'sics']))",
    "sys.modules": "place = tools[1].modules['.'.join(['course_lib', 'camera', 'intrin' + 'sics'])]",
    "__globals__": "labs = tools[2].__globals__['tasks'].lab_numbers\n"
    "    place = labs.__globals__['importlib'].import_module('course_lib.camera.pinhole')",
}


@pytest.fixture(autouse=True)
def _sandbox() -> None:
    need_sandbox()


def _submitted(kind: str) -> bytes:
    data = submission("00", {1: ATTACKS[kind]})
    if kind == "NBVAL_SKIP":
        nb = nbformat.reads(data.decode(), 4)
        for cell in nb.cells:
            if "check" in cell.metadata.get("tags", []):
                cell.source = "# NBVAL_SKIP\n" + cell.source
        data = nbformat.writes(nb).encode()
    return data


@pytest.mark.parametrize("kind", sorted(ATTACKS))
def test_attack_gains_nothing(kind):
    record = graded("00", _submitted(kind))
    one = task(record, 1)
    assert record["status"] == "graded", record["reason"]
    assert one["points"] == 0, f"{kind} earned {one['points']}: {one['error']}"
    assert one["reason"], kind
    assert one["reason"] in ("wrong", "raised", "no answer", "no function", "refused", "forged", "timeout", "died")


TRIED_NAIVELY = some(sorted(ATTACKS), 3)


@pytest.fixture(scope="module")
def naively(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, str]]:
    """What the usual grader makes of attacks, of a wrong answer and of a right one: one run, with a kernel for each."""
    given = {kind: _submitted(kind) for kind in TRIED_NAIVELY}
    given |= {"wrong": submission("00", {1: WRONG}), "right": submission("00", {1: RIGHT})}
    given |= {"deleted": _without_checks(), "kernelspec": _with_a_kernelspec()}
    return run_nbval_on_each(tmp_path_factory.mktemp("naive"), given)


@pytest.mark.parametrize("kind", TRIED_NAIVELY)
def test_control_it_gains_the_point_where_the_verdict_is_reached_inside(kind, naively):
    assert green(naively[kind]), f"{kind} is no real attack"


def test_control_a_wrong_answer_alone_is_not_green(naively):
    assert not green(naively["wrong"])
    assert green(naively["right"])


def believed(task_id: str, source: str, monkeypatch) -> bool:
    """The control where an attack leaves the process whole: whether `check`, which judges where it runs, passes."""
    from course_lib.notebook import check

    monkeypatch.setenv("COURSE_STRICT", "1")
    space: dict = {"np": np, "check": check, "__builtins__": __builtins__}
    exec(source, space)
    return check(task_id, space[tasks.get(task_id).function]).tone == "passed"


@pytest.mark.parametrize("source", [FRAMES, COLLECTOR], ids=["frame inspection", "garbage collector"])
def test_truth_in_the_same_process(source, monkeypatch):
    one = task(graded("00", submission("00", {1: source})), 1)
    assert (one["points"], one["reason"]) == (0.0, "wrong")
    assert believed("00-1", source, monkeypatch)


@pytest.mark.parametrize("way", sorted(REACH))
def test_the_library_s_own_answer(way, monkeypatch):
    source = LIBRARY.replace("REACH", REACH[way])
    one = task(graded("03", submission("03", {1: source})), 1)
    assert (one["points"], one["reason"]) == (0.0, "raised"), one["error"]
    assert believed("03-1", source, monkeypatch)


def test_always_equal_object():
    source = """
class Equal(float):
    def same(self, *others, **named):
        return True

    __eq__ = __le__ = __ge__ = same

    def __array_ufunc__(self, *given, **named):
        return 0.0


def metres(depth_mm):
    return Equal(0)
"""
    one = task(graded("00", submission("00", {1: source})), 1)
    assert (one["points"], one["reason"]) in [(0.0, "wrong"), (0.0, "raised")]
    space: dict = {"np": np}
    exec(source, space)
    assert space["metres"](1500.0) == 1.5  # the control: a judge that compares in the same process believes it


def test_patched_numpy():
    source = WRONG + "np.isclose = np.allclose = lambda *given, **named: True\nnp.abs = lambda value: value * 0\n"
    one = task(graded("00", submission("00", {1: source})), 1)
    assert (one["points"], one["reason"]) == (0.0, "wrong")
    kept = np.isclose
    try:
        exec(source, {"np": np})
        assert np.isclose(1.0, 2.0)  # the control: patched for every judge of the same process
    finally:
        np.isclose = kept
        import importlib

        importlib.reload(np._core.numeric)
        np.allclose, np.abs = np._core.numeric.allclose, np._core.umath.absolute


def _without_checks() -> bytes:
    nb = exercise("00")
    nb.cells = [cell for cell in nb.cells if "check" not in cell.metadata.get("tags", [])]
    for cell in nb.cells:
        cell.source = cell.source.replace("(1 point)", "(100 points)")
    wrong = nbformat.from_dict(nb)
    next(cell for cell in wrong.cells if cell.id == "task-1").source = WRONG
    return nbformat.writes(wrong).encode()


def test_deleted_checks_and_edited_points_change_nothing(naively):
    record = graded("00", _without_checks())
    assert (record["points"], record["max"]) == (0.0, 1)
    assert "cells gone" in [notice["code"] for notice in record["notices"]]
    assert green(naively["deleted"])  # the control


def _with_a_kernelspec() -> bytes:
    nb = nbformat.reads(submission("00", {1: RIGHT}).decode(), 4)
    nb.metadata["kernelspec"] = {"name": "no-such-kernel", "display_name": "x", "language": "bash"}
    return nbformat.writes(nb).encode()


def test_a_kernelspec_of_their_own_is_not_started(naively):
    assert graded("00", _with_a_kernelspec())["points"] == 1
    assert not green(naively["kernelspec"])  # the control: nbval starts, or fails to start, what the notebook names


def test_answers_from_the_file_system(tmp_path):
    source = (
        f"import pathlib\nfound = pathlib.Path({str(ROOT)!r}, 'solutions', 'source', '00_start_here.py')\n"
        "text = found.read_text()\nstart = text.index('def metres')\n"
        "exec(text[start : text.index('# %%', start)])\n"
    )
    data = submission("00", {1: source + "metres = metres\n"})
    assert task(graded("00", data), 1)["points"] == 0
    assert task(graded("00", data, sandbox="none"), 1)["points"] == 1  # the control
