"""docs/add_a_lesson.md, followed to the letter in a copy of the course: a lesson is files, and nothing else changes."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from tracked_files import ROOT, git, tracked

from course_lib.authoring.generated import PAGES, margin
from course_lib.authoring.kernels import kernel_environment
from course_lib.authoring.lesson_files import WANTED
from course_lib.authoring.prove import COPIES, copy_notebooks, pytest_words
from course_lib.authoring.tree import Tree
from course_lib.notebook import show
from course_lib.notebook.lessons import lessons

PAGE = (ROOT / "docs" / "add_a_lesson.md").read_text(encoding="utf-8")
FILES = Path(__file__).parent / "fixtures" / "new_lesson"
TABLE = re.findall(r"^\| `([^`]+)` \|", PAGE, re.M)
COMMANDS = [shlex.split(line, comments=True)[2:] for line in PAGE.splitlines() if line.startswith("python3 course.py ")]
NUMBER = f"{max(int(lesson.number) for lesson in lessons()) + 1:02}"  # the first that is free
NAME, DATASET = f"{NUMBER}_tiny", "tiny_square"
BUDGET = "import course_lib; print(course_lib.__file__); from course_lib.notebook import show; show.error_budget()"
PROOFS = (
    "tests/tasks/test_every_task.py",
    f"tests/tasks/test_lab_{NUMBER}.py",
    "tests/bench/test_bench_cases.py",
)


def _named(text: str) -> str:
    """The page's words, or the fixture's, with the new lesson's own names."""
    return text.replace("NN_name", NAME).replace("NAME", DATASET).replace("NN", NUMBER)


def _python(copy: Path, *words: str, environment: Mapping[str, str] = os.environ) -> str:
    """What the copy's own library prints; an error, with its words, where it fails."""
    own = {"PYTHONPATH": str(copy), "COURSE_CACHE": str(copy.parent / "cache"), "COURSE_PROOF": "all"}
    run = subprocess.run(
        [sys.executable, "-P", *words],
        cwd=copy,
        env={**environment, **own},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert run.returncode == 0, run.stdout
    return run.stdout


def _proof(tree: Tree, expression: str, folder: Path) -> dict[str, set[str]]:
    """The new lesson's part of `course test`: the names of its tests, which all pass, below the file of each."""
    folder.mkdir()
    copy_notebooks([source.notebook for source in tree.find([NUMBER])], tree, folder / COPIES, lambda names: set())
    (folder / "ipython").mkdir()
    environment = kernel_environment(tree.root, folder / "ipython")
    environment["JUPYTER_RUNTIME_DIR"] = str(folder / "run")
    words = pytest_words(tree, folder, "all", 0, ["-k", expression, "-rA"])
    words.remove(str(tree.tests_folder))  # enough proofs to show that all of it is seen
    words += [str(tree.root / proof) for proof in PROOFS]
    said = _python(tree.root, *words[2:], environment=environment)
    found: dict[str, set[str]] = {}
    for outcome, path, name in re.findall(r"^([A-Z]+) ([\w/.]+)::(.+)$", said, re.M):
        assert outcome == "PASSED", said
        found.setdefault(path, set()).add(name)
    return found


def test_the_table_names_each_file_of_the_tiny_lesson_and_no_other() -> None:
    there = {path.relative_to(FILES).as_posix() for path in FILES.rglob("*") if path.is_file()}
    assert len(TABLE) == len(set(TABLE)) >= 10
    assert {row for row in TABLE if row not in there} == set(), "rows of the page without a file"
    assert {path for path in there - set(TABLE) if "__pycache__" not in path} == set(), "files without a row"


def test_what_build_asks_of_every_lesson_stands_in_the_table() -> None:
    assert {place.format("NN_name") for place in WANTED} <= set(TABLE)


@pytest.fixture
def copy(tmp_path: Path) -> Tree:
    """The tracked files in a repository of their own, and the tiny lesson's, placed by the page's table."""
    root = tmp_path / "copy" / "course"
    for path in tracked():
        to = root / path.relative_to(ROOT)
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, to)
    git(root, "init", "--quiet")
    git(root, "add", "--all", "--force")
    git(root, "commit", "--quiet", "--message", "The course")
    for row in TABLE:
        to = root / _named(row)
        assert not to.exists()
        to.parent.mkdir(parents=True, exist_ok=True)
        to.write_text(_named((FILES / row).read_text(encoding="utf-8")), encoding="utf-8", newline="\n")
    return Tree(root)


@pytest.mark.slow
@pytest.mark.skipif(not tracked(), reason="git does not know this copy of the course")
def test_a_lesson_is_added_by_the_page(copy: Tree, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    root = copy.root
    used, _, budget = _python(root, "-c", BUDGET).partition("\n")
    assert Path(used).resolve() == (root / "course_lib" / "__init__.py").resolve()
    show.error_budget()
    assert budget == capsys.readouterr().out != "", "the new row changes what earlier lessons have stored"

    build, check, test = ([_named(word) for word in words] for words in COMMANDS)
    assert build == ["build", NUMBER] and check == ["build", "--check"] and test[:3] == ["test", "--", "-k"]
    _python(root, "-m", "course_lib.cli", *build)  # fails where a gate finds something
    assert " 0 differences" in _python(root, "-m", "course_lib.cli", *check)

    # What git shows: new files, and new rows between the markers of the pages that the page names.
    built = {f"{folder}/{NAME}.ipynb" for folder in ("notebooks", "solutions", "exercises")}
    built.add(str(_named("course_lib/tasks/labs/lab_NN_name/public.npz")))
    assert set(git(root, "ls-files", "--others", "--exclude-standard")) == built | {_named(row) for row in TABLE}
    changed = [line.split("\t") for line in git(root, "diff", "--numstat")]
    rows = [*PAGES, "notebooks/00_start_here.ipynb"]  # made from one of the pages
    assert {name: lost for _, lost, name in changed} == dict.fromkeys(rows, "0"), "pages, and the lines each lost"
    for name, (marker, _) in PAGES.items():
        assert f"`{name}`" in PAGE
        old = git(root, "show", f"HEAD:{name}")
        new = (root / name).read_text(encoding="utf-8").splitlines()
        ends = [f"{margin(name)}<!-- {marker} -->", f"{margin(name)}<!-- /{marker} -->"]
        (first, last), (now_first, now_last) = ([text.index(end) for end in ends] for text in (old, new))
        assert new[: now_first + 1] == old[: first + 1] and new[now_last:] == old[last:], name
    assert f"- [{NUMBER} Tiny](notes/{NAME}.md)" in (root / "solutions" / "README.md").read_text(encoding="utf-8")

    # The new lesson's own proof, by the words of the page.
    found = _proof(copy, test[3], tmp_path / "proof")
    for folder in ("notebooks", "solutions"):
        assert len(found[f"{folder}/{NAME}.ipynb"]) >= 5, "its cells, by nbval"
    every, own, bench = (found[path] for path in PROOFS)
    for task in range(1, 5):
        assert f"test_reference_passes_in_a_notebook[{NUMBER}-{task}]" in every
        assert any(name.startswith(f"test_misconception[{NUMBER}-{task}-") for name in every)
    assert f"test_lab_is_sound[{NUMBER}]" in every
    assert own == {"test_the_centre_is_off_by_less_than_each_corner"}, "its dataset is made and loaded"
    assert [name.rpartition(".")[2] for name in bench] == [f"bench_{NUMBER}]"], "its case is listed; sides agree"
