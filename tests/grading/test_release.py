"""`course release`: what students get works, and holds nothing of the solutions."""

from __future__ import annotations

import ast
import hashlib
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import nbformat
import pytest
from grading_helpers import ROOT, graded, need_sandbox, submission

from course_lib import MOVED, tasks
from course_lib.authoring import notebooks as nbs
from course_lib.authoring import solutions
from course_lib.authoring.tree import CourseError, course_tree
from course_lib.grading.intake.intake import IntakeLimits, notebook_of
from course_lib.grading.release.rebuild import older_release
from course_lib.grading.release.release import MANIFEST, fewer_hints, release
from course_lib.grading.release.released import released_lab
from course_lib.tasks.diagnosis.public_answers import unpack

LABS = tasks.lab_numbers()


@pytest.fixture(scope="module")
def tree(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("release") / "labs"
    release(LABS, folder, course_tree(), hints=1)
    return folder


def run_there(tree: Path, code: str) -> str:
    """What a learner's code prints in the released copy."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tree, env={"PYTHONPATH": str(tree)}, capture_output=True, text=True, timeout=400)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_nothing_of_the_solutions_is_in_it(tree):
    names = [path.relative_to(tree).as_posix() for path in tree.rglob("*") if path.is_file()]
    assert not [name for name in names if name.startswith(("solutions/", "tests/", "docs/", "notebooks/"))]
    assert not [name for name in names if "course_lib/grading" in name or "authoring/build" in name]
    assert sorted({n.split("/")[3][:6] for n in names if "/lab_" in n}) == [f"lab_{number}" for number in LABS]
    text = "\n".join(path.read_text(encoding="utf-8") for path in tree.rglob("*") if path.suffix in (".py", ".ipynb"))
    bodies = set()
    for path in tree.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                bodies.add(tuple(ast.dump(statement) for statement in node.body if not _is_text(statement)))
    assert "BEGIN SOLUTION" not in text
    checked = 0
    for number in LABS:
        for task in tasks.lab(number):
            node = next(
                n for n in ast.parse(solutions.reference(task.id)).body if getattr(n, "name", "") == task.function
            )
            body = tuple(ast.dump(statement) for statement in node.body if not _is_text(statement))
            assert body not in bodies, f"the answer of {task.id} is in the release"
            given = solutions.stub(task.id)  # a task that mends gives most of its lines
            own = [line for line in map(ast.unparse, node.body) if line.splitlines()[0] not in given]
            assert own or task.kind == "explain", f"{task.id} asks for nothing that it does not give"
            longest = max(own, key=len, default="")
            assert not own or longest not in text, f"{longest!r} of {task.id} is in the release"
            checked += 1
    assert checked == sum(len(tasks.lab(number)) for number in LABS)


def _is_text(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


@pytest.mark.slow
def test_hidden_functions_refuse_a_learner(tree):
    hides = sorted({h for n in LABS for task in tasks.lab(n) for h in task.hides if h.startswith("course_lib.")})
    assert len(hides) >= 5
    kept = json.loads((tree / MANIFEST).read_text(encoding="utf-8"))["kept for display"]
    code = f"""
import importlib, inspect
for public in {hides!r}:
    module, _, name = public.rpartition(".")
    thing = getattr(importlib.import_module(module), name)
    if thing is None or not callable(thing):  # a table that the library reads stays, and the manifest says so
        assert thing is None or public in {kept!r}, public
        continue
    try:
        found = thing(*[1 for p in inspect.signature(thing).parameters.values() if p.kind is p.POSITIONAL_OR_KEYWORD])
        list(found) if inspect.isgenerator(found) else None  # a generator refuses when it is asked for its first
    except RuntimeError as error:
        assert "asks you to write" in str(error), error
        continue
    print(public)
"""
    assert run_there(tree, code).split() == [], "these answer a learner"


@pytest.mark.slow
def test_checks_work_there(tree):
    stub, reference = solutions.stub("03-2"), solutions.reference("03-2")
    code = "import numpy as np\nfrom course_lib.notebook import check\n"
    assert "not started yet" in run_there(tree, f"{code}{stub}\nprint(check('03-2', deproject))")
    (tree.parent / "answer.py").write_text(f"{code}{reference}\nprint(check('03-2', deproject))")
    assert "passed" in run_there(tree, f"exec(open({str(tree.parent / 'answer.py')!r}).read())")


SAID = """
import json, os, sys
import numpy as np
from course_lib.notebook.check import check
from course_lib.tasks.diagnosis import diagnose, recognition
if sys.argv[2] == "there":
    diagnose.run = recognition.run = None  # no wrong answer is run
said = {}
for task_id, name, sources in json.load(open(sys.argv[1])):
    for source in sources:
        space = {"np": np, "math": __import__("math")}
        exec(source, space)
        sys.modules["course_lib.notebook.check"]._failures.clear()
        check(task_id, space[name])
        said.setdefault(task_id, []).append(check(task_id, space[name]).text)
print(json.dumps(said))
"""


@pytest.mark.slow
def test_checks_say_there_what_they_say_here(tree):
    """Of the right answer and of two mistakes of each task, from data alone; real cases, which are not there, apart."""
    asked = []
    for task in tasks.all_tasks():
        if task.kind != "explain" and not task.data:
            wrong = [task.misconceptions[0].source, task.misconceptions[-1].source]
            asked.append((task.id, task.function, [solutions.reference(task.id), *wrong]))
    assert len(asked) > 25
    (tree.parent / "asked.json").write_text(json.dumps(asked))
    (tree.parent / "said.py").write_text(SAID)
    said = {}
    for where, folder in (("here", ROOT), ("there", tree)):
        words = [sys.executable, str(tree.parent / "said.py"), str(tree.parent / "asked.json"), where]
        environment = {**os.environ, "PYTHONPATH": str(folder)}
        done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stderr
        said[where] = json.loads(done.stdout)
    assert said["there"] == said["here"]
    assert all(texts[0] != texts[1] for texts in said["there"].values())


@pytest.mark.slow
def test_no_function_of_a_released_lab_answers_one_of_its_tasks(tree):
    code = """
import importlib, inspect, itertools, pathlib, types
from course_lib import tasks
from course_lib.tasks.released_cases import public_cases
tried = 0
for number in tasks.lab_numbers():
    folder = tasks.registry.folder(number)
    functions = set()
    for path in folder.glob("*.py"):
        module = importlib.import_module(f"course_lib.tasks.labs.{folder.name}.{path.stem}")
        functions |= {f for f in vars(module).values() if isinstance(f, types.FunctionType)}
    for task in tasks.lab(number):
        cases, kept = public_cases(task, None)
        assert kept and len(cases) > 0, task.id
        if task.kind == "explain":
            continue
        for function in functions:
            tried += 1
            outcomes = [tasks.run(function, case) for case in cases[:2]]
            right = [o.kind == "answer" and task.judge(c, o.answer).passed for c, o in zip(cases, outcomes)]
            if all(right):
                print(task.id, function.__name__)
    text = "".join(path.read_text() for path in folder.glob("*.py"))
    assert "def _" + "lift" not in text and "rng.uniform" not in text.replace("def two_scans", "") or number in "05 07"
assert tried > 500
"""
    assert run_there(tree, code).split() == []


@pytest.mark.slow
def test_keys_stand_there_as_hashes(tree):
    for path in tree.glob("course_lib/tasks/labs/*/cases.npz"):
        number = path.parent.name[4:6]
        for task in tasks.lab(number):
            if task.kind == "which":
                (kept,) = unpack(path)[task.id]
                truth = task.public()[0].truth
                assert kept["cases"][0]["hidden"] == {} and len(kept["key"]["hashes"]) == len(truth)
                assert all(cause not in kept["key"]["hashes"].values() for cause in truth.values())
                dicts = [node for py in path.parent.glob("*.py") for node in ast.walk(ast.parse(py.read_text("utf-8")))]
                keys = [ast.unparse(node) for node in dicts if isinstance(node, ast.Dict)]
                assert not [text for text in keys if set(truth) <= set(ast.literal_eval(text) if "'A'" in text else ())]


@pytest.mark.slow
def test_checks_know_slips_there_and_run_no_wrong_answer(tree):
    code = (
        "from course_lib.notebook.check import check\n"
        "from course_lib.tasks.diagnosis import diagnose, recognition\n"
        "diagnose.run = recognition.run = None\n"
        "columns = lambda width, step: len(range(0, width, step))\n"
        "rows = lambda u, v, width, height, step: v // step * columns(width, step) + u // step\n"
        "bottom_up = lambda u, v, width, height, step: rows(u, height - 1 - v, width, height, step)\n"
        "edited = lambda u, v, width, height, step: 0 + bottom_up(u, v, width, height, step)\n"
        "print([check('02-1', answer).text for answer in (bottom_up, edited)][1])\n"
    )
    assert "This looks like `v` counted from the other end" in run_there(tree, code)


@pytest.mark.slow
def test_the_exercise_runs_there(tree):
    from course_lib.authoring.kernels import execute

    run_there(tree, "from course_lib.notebook import data\ndata.load('bunny_like')")  # no cell has to make it in time
    nb = nbs.read_notebook(tree / "exercises" / "02_point_clouds.ipynb")
    execute(nb, tree)
    assert any("not started yet" in str(cell.outputs) for cell in nb.cells if cell.cell_type == "code")


@pytest.mark.slow
def test_manifest_tells_version_slots_and_every_file(tree):
    manifest = json.loads((tree / MANIFEST).read_text(encoding="utf-8"))
    lab = manifest["labs"]["03"]
    assert lab["version"] == released_lab("03").version and lab["points"] == released_lab("03").points
    assert [slot["task"] for slot in lab["slots"]] == [task.id for task in tasks.lab("03")]
    made = ("__pycache__", "cache")  # by the tests that ran there
    there = {p.relative_to(tree) for p in tree.rglob("*") if p.is_file()}
    files = {path.as_posix() for path in there if not set(made) & set(path.parts)}
    assert set(manifest["files"]) == files - {MANIFEST}
    for name, digest in manifest["files"].items():
        assert hashlib.sha256((tree / name).read_bytes()).hexdigest() == digest, name


@pytest.mark.slow
def test_zip_holds_the_same_and_is_the_same_again(tree, tmp_path):
    again = release(LABS, tmp_path / "labs", course_tree(), hints=1)
    assert again.read_bytes() == tree.with_name("labs.zip").read_bytes()
    with zipfile.ZipFile(again) as file:
        assert "labs/exercises/03_depth_to_points.ipynb" in file.namelist()


@pytest.mark.parametrize("most", [0, 1, 2, 3])
def test_hints_beyond_the_number_are_gone(most):
    nb = nbs.read_notebook(ROOT / "exercises" / "03_depth_to_points.ipynb")
    text = "\n".join(cell.source for cell in fewer_hints(nb, most).cells)
    assert [number for number in (1, 2, 3) if f"Hint {number}" in text] == list(range(1, most + 1))
    assert text.count("<details>") == text.count("</details>")


def test_a_folder_with_other_files_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(CourseError, match="no release"):
        release(["00"], tmp_path, course_tree())
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.slow
def test_an_earlier_release_is_replaced(tmp_path):
    release(["00"], tmp_path / "r", course_tree())
    release(["01"], tmp_path / "r", course_tree())
    assert [path.name for path in (tmp_path / "r" / "exercises").iterdir()] == ["01_rgbd_images.ipynb"]


def test_verbs_that_are_not_there_say_so(tree):
    code = "import sys; sys.argv = ['x', 'grade']; from course_lib.cli import main; main(['grade', '.'])"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tree, env={"PYTHONPATH": str(tree)}, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and "not part of this copy" in done.stderr, done.stderr


OLDER = "This notebook was released by an earlier version of the course: it imports course_lib."
OLD_IMPORT = "from course_lib import {}".format("pointcloud")


def _as_before(lab: str, now: str, before: str) -> bytes:
    text = submission(lab).decode()
    assert now in text
    return text.replace(now, before).encode()


def test_a_lab_released_before_modules_moved_is_refused_and_never_scored():
    need_sandbox()
    record = graded("02", _as_before("02", "from course_lib.cloud import pointcloud", OLD_IMPORT))
    assert (record["status"], record["points"], record["tasks"]) == ("infrastructure", 0.0, [])
    assert record["reason"].startswith(f"{OLDER}pointcloud, now course_lib.cloud.pointcloud. ")


def test_names_below_a_package_moved_too():
    name = "tasks.scans_07"
    now = MOVED[name]
    data = _as_before("07", f"from course_lib.{now} import", f"from course_lib.{name} import")
    said = older_release(notebook_of(data, IntakeLimits()), released_lab("07"))
    assert said.startswith(f"{OLDER}{name}, now course_lib.{now}. ")


def test_an_old_import_in_a_learners_own_cell_of_todays_lab_costs_nothing():
    nb = notebook_of(submission("02"), IntakeLimits())
    nb.cells.append(nbformat.v4.new_code_cell(OLD_IMPORT))
    assert older_release(nb, released_lab("02")) == ""
