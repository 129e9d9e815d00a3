"""The kind message for an answer that calls what the task asks to write."""

from __future__ import annotations

import pytest
import task_proofs as proofs
from tiny_tasks import TASK

from course_lib.tasks.sources import forbidden

ALLOWED = "allowed here: numpy."


@pytest.fixture(scope="module")
def shell() -> proofs.Shell:
    shell = proofs.Shell()
    shell.run("from course_lib.geometry import transforms\nfrom course_lib.geometry.transforms import invert as flip")
    shell.run("from scipy import ndimage as nd")
    shell.run("from numpy.linalg import inv\nimport collections\nT = np.eye(4)")
    shell.run("def own(T):\n    return flip(T)\n\ndef again(T):\n    return again(T)")
    return shell


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("return transforms.invert(pixels)", "Task 1 asks you to write it yourself: transforms.invert is the answer; "),
        ("return flip(pixels)", "transforms.invert is the answer"),
        ("return own(pixels)", "transforms.invert is the answer"),
        (
            "from course_lib.geometry.transforms import invert\n    return invert(pixels)",
            "transforms.invert is the answer",
        ),
        (
            "from course_lib.geometry import transforms as t\n    return t.invert(pixels)",
            "transforms.invert is the answer",
        ),
        (
            "import course_lib.geometry.transforms\n    return course_lib.geometry.transforms.invert(pixels)",
            "transforms.invert is the answer",
        ),
        ("return np.linalg.inv(pixels)", "numpy.linalg.inv is the answer"),
        ("return inv(pixels)", "numpy.linalg.inv is the answer"),
        ("return nd.zoom(pixels, 2)", "Task 1 does not take scipy.ndimage.zoom; "),
        ("import scipy\n    return pixels", "Task 1 does not take scipy; "),
        ("return [nd.zoom(p, 2) for p in pixels]", "does not take scipy.ndimage.zoom"),
        ("return (lambda p: nd.zoom(p, 2))(pixels)", "does not take scipy.ndimage.zoom"),
    ],
)
def test_found(shell: proofs.Shell, body: str, words: str) -> None:
    shell.run(f"def lift(pixels, z, f):\n    {body}")
    sentence = forbidden(TASK, shell.run("lift"))
    assert words in sentence
    assert sentence.endswith(ALLOWED)


@pytest.mark.parametrize(
    "body",
    [
        "return np.asarray(pixels) * z / f",
        "import math\n    return math.pi * pixels",
        "return collections.Counter(pixels)",
        "return sum(len(x) for x in pixels) + T[0, 0]",
        "transforms = 3\n    return transforms",
        "return again(pixels)",
        "return np.linalg.norm(pixels) + undefined",
        "return pixels.invert.inv",
    ],
)
def test_allowed(shell: proofs.Shell, body: str) -> None:
    shell.run(f"def lift(pixels, z, f):\n    {body}")
    assert forbidden(TASK, shell.run("lift")) == ""


def test_what_cannot_be_read_is_left_to_the_grader(shell: proofs.Shell) -> None:
    assert forbidden(TASK, proofs.defined("def lift(a):\n    import scipy\n", "lift")) == ""
    assert forbidden(TASK, len) == ""
    assert forbidden(TASK, shell.run("lambda pixels, z, f: np.sin(pixels)")) == ""
    assert "scipy.ndimage" in forbidden(TASK, shell.run("lambda pixels, z, f: nd.zoom(pixels)"))
