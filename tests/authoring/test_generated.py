"""Rows between markers are written from files; what stands around them is a person's."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from nbformat.v4 import new_output

from course_lib.authoring import notebooks as nbs
from course_lib.authoring.build import check_all
from course_lib.authoring.generated import COUNTED, _map, stale, write_generated
from course_lib.authoring.lesson_files import WANTED, lacking
from course_lib.authoring.minutes import counted
from course_lib.authoring.tree import CourseError, Tree

GOOD = Path(__file__).parent / "fixtures" / "tree"
BEGIN, END = "<!-- lessons -->\n", "<!-- /lessons -->"
HEAD, FOOT = f"# The course\n\nBy *hand*.\n\n{BEGIN}", f"{END}\n\nMore by hand; no end of line"


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    """A copy of the tiny course, with a README whose rows are old."""
    shutil.copytree(GOOD, tmp_path / "course")
    (tmp_path / "course" / "README.md").write_text(f"{HEAD}| of yesterday |\n{FOOT}", encoding="utf-8")
    return Tree(tmp_path / "course")


def test_rows_are_written_and_the_text_around_them_is_left(tree: Tree) -> None:
    readme = tree.root / "README.md"
    assert write_generated(tree) == [readme]
    text = readme.read_text(encoding="utf-8")
    assert text.startswith(HEAD) and text.endswith(FOOT)
    lesson, lab = (counted(source.notebook, tree) for source in tree.sources())
    assert lesson != lab
    assert text[len(HEAD) : -len(FOOT)].splitlines() == [
        "| Lesson | What you can do after it | Lesson, minutes | Lab, minutes |",
        "|---|---|---|---|",
        f"| [01 Tiny](notebooks/01_tiny.ipynb) | know what a pixel is | {lesson} | {lab} |",
        "",
        COUNTED,
    ]
    assert write_generated(tree) == [] and stale(tree) == []


def test_a_lesson_of_which_only_the_first_file_is_there_is_to_come(tree: Tree) -> None:
    (tree.lessons_folder / "source" / "02_next.toml").write_text('title = "Next"\n', encoding="utf-8")
    write_generated(tree)
    assert "| 02 Next | *to come* | | |\n" in (tree.root / "README.md").read_text(encoding="utf-8")


def test_old_rows_are_found_by_the_check(tree: Tree) -> None:
    said: list[str] = []
    assert check_all([], None, tree, said.append) == 1
    assert said == [
        "README.md: its rows are old; mend: python3 course.py build",
        "2 sources, 1 differences",
    ]
    write_generated(tree)
    assert check_all([], None, tree, said.append) == 0


@pytest.mark.parametrize("lost", [BEGIN, END, BEGIN + END])
@pytest.mark.parametrize("do", [write_generated, stale])
def test_a_lost_marker_is_said_in_a_sentence_and_nothing_is_written(tree: Tree, lost: str, do: Callable) -> None:
    readme = tree.root / "README.md"
    old = f"{HEAD}{FOOT}".replace(lost, "")
    assert old != f"{HEAD}{FOOT}"
    readme.write_text(old, encoding="utf-8")
    with pytest.raises(CourseError) as error:
        do(tree)
    assert str(error.value) == "README.md: it needs the lines <!-- lessons --> and <!-- /lessons -->, once each."
    assert readme.read_text(encoding="utf-8") == old


def test_a_marker_that_stands_twice_is_said_too(tree: Tree) -> None:
    (tree.root / "README.md").write_text(f"{HEAD}{FOOT}\n{HEAD}{FOOT}", encoding="utf-8")
    with pytest.raises(CourseError, match="once each"):
        write_generated(tree)


def test_a_word_without_its_form_is_said_in_a_sentence(tree: Tree) -> None:
    (tree.docs_folder / "glossary" / "01_tiny.md").write_text("**Pixel**: a cell.\n", encoding="utf-8")
    with pytest.raises(CourseError, match=r"docs/glossary/01_tiny.md: an entry reads .* and not '\*\*Pixel"):
        stale(tree)


@pytest.mark.parametrize("place", WANTED)
def test_a_lesson_that_lacks_a_file_is_told_of(tree: Tree, place: str) -> None:
    assert lacking(tree) == []
    (tree.root / place.format("01_tiny")).unlink()
    assert [line.partition(" is missing: ")[0] for line in lacking(tree)] == [place.format("01_tiny")]


def test_a_lesson_without_minutes_and_a_dataset_without_a_card_are_told_of(tree: Tree) -> None:
    (tree.lessons_folder / "source" / "01_tiny.toml").write_text('title = "Tiny"\n', encoding="utf-8")
    (tree.root / "datasets").mkdir()
    (tree.root / "datasets" / "square.toml").touch()
    assert lacking(tree) == [
        "notebooks/source/01_tiny.toml: a lesson that is there has does, minutes and lab_minutes",
        "datasets/square.md is missing: the card of this dataset",
    ]


def test_the_map_of_lesson_00_reaches_its_notebook_without_running_it(tree: Tree) -> None:
    source = tree.lessons_folder / "source" / "00_start_here.py"
    cells = "# %% [markdown]\n# # 00 Start here\n#\n# <!-- map -->\n# <!-- /map -->\n\n# %%\n6 * 7\n"
    source.write_text(cells, encoding="utf-8")
    facts = 'title = "Start here"\ndoes = "see it all"\nminutes = 15\nlab_minutes = 5\n'
    source.with_suffix(".toml").write_text(facts, encoding="utf-8")
    lesson = tree.find(["00"])[0]
    stored = nbs.read_source(source)
    stored.cells[1].execution_count = 1
    stored.cells[1].outputs = [new_output("execute_result", {"text/plain": "42"}, execution_count=1)]
    nbs.write_notebook(lesson.notebook, stored)
    before = nbs.read_notebook(lesson.notebook)
    write_generated(tree)
    first, lab = (counted(folder / "01_tiny.ipynb", tree) for folder in (tree.lessons_folder, tree.solutions_folder))
    start = counted(lesson.notebook, tree)  # its own map included
    rows = [
        "| Lesson | Lab | Minutes, lesson + lab | You will be able to |",
        "|---|---|---|---|",
        f"| [00 Start here](00_start_here.ipynb) | [lab](../exercises/00_start_here.ipynb) | {start} | see it all |",
        f"| [01 Tiny](01_tiny.ipynb) | [lab](../exercises/01_tiny.ipynb) | {first} + {lab} | know what a pixel is |",
    ]
    table = "".join(f"# {row}\n" for row in rows)
    assert source.read_text(encoding="utf-8") == cells.replace("# <!-- /map", f"{table}# <!-- /map")
    after = nbs.read_notebook(lesson.notebook)
    assert after.cells[0].source.splitlines()[3:-1] == rows
    assert after.cells[0].id == before.cells[0].id and after.cells[1] == before.cells[1]
    assert write_generated(tree) == []
    assert counted(lesson.notebook, tree) == 2, "a table; its rows are looked up and count for no words"


def test_a_lesson_to_come_is_on_the_map_without_a_link(tree: Tree) -> None:
    (tree.lessons_folder / "source" / "02_next.toml").write_text('title = "Next"\ndoes = "go on"\n', encoding="utf-8")
    assert _map(tree).splitlines()[-1] == "| 02 Next | | | go on |"
