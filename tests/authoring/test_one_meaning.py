"""Which names a cell reads and binds, and which of them get a second meaning in a later section."""

from __future__ import annotations

import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from course_lib.authoring.one_meaning import names_of, second_meanings


@pytest.mark.parametrize(
    ("source", "read", "bound"),
    [
        ("a = b", "b", "a"),
        ("a = a + 1", "a", "a"),
        ("a = 1\na = a + 1", "", "a"),
        ("a += 1", "a", "a"),
        ("a[i] = b.c", "a b i", ""),
        ("a, (b, *c) = d", "d", "a b c"),
        ("a: int = b", "b", "a"),
        ("if (a := b): c = a", "b", "a c"),
        ("for a in b:\n    c = a", "b", "a c"),
        ("import a.b as c, d.e\nfrom f import g", "", "c d g"),
        ("with a as b:\n    b.c", "a", "b"),
        ("try:\n    a\nexcept b as c:\n    c", "a b", "c"),
        ("a = [b + c for b in d for e in b]", "c d", "a"),
        ("a = [a for a in a]", "a", "a"),
        ("a = {b: c for b, c in d}", "d", "a"),
        ("def a(b, c=d):\n    e = b\n    return e + f", "d f", "a"),
        ("def a():\n    return b\nb = 1", "", "a b"),
        ("def a(b):\n    def c(d):\n        return b + d + e\n    return c", "e", "a"),
        ("a = lambda b, c=d: b + e", "d e", "a"),
        ("class a(b):\n    c = d\n    e = c\n    def f(self):\n        return g", "b d g", "a"),
        ("%matplotlib inline\n!ls\na?\nb = c", "c", "b"),
        ("a = (", "", ""),
    ],
)
def test_what_a_cell_reads_before_it_binds_it(source: str, read: str, bound: str) -> None:
    names = names_of(source)
    assert names.read == set(read.split())
    assert names.bound == set(bound.split())


def test_loops_and_imports_bind_nothing_that_lasts() -> None:
    source = "import a\nfor b, c[0] in d:\n    e = 1\ntry:\n    f = 1\nexcept ValueError as g:\n    pass"
    assert names_of(source).lasting == {"e", "f"}


def _found(*cells: str, tags: tuple[str, ...] = ()) -> list[str]:
    """Findings in a notebook of such cells; a text that starts with ## is a heading, and the last cell has the tags."""
    made = [new_markdown_cell(one) if one.startswith("#") else new_code_cell(one) for one in cells]
    made[-1].metadata["tags"] = list(tags)
    return [f"{number}: {line}" for number, line in second_meanings(new_notebook(cells=made))]


ONE, TWO, THREE = "## 1 One", "## 2 Two", "## 3 Three"


def test_a_name_bound_anew_is_named_with_both_places() -> None:
    found = _found(ONE, "a = 1", "b = a", TWO, "a = 2", "c = a", THREE, "a = 3")
    assert found == ["4: `a` is bound anew in “2 Two”, cell 7; from “1 One” on cells 2, 5 read it"]


@pytest.mark.parametrize(
    "reader",
    ["b = a", "def b():\n    return a", "b = [a for _ in c]", "a = a + 1", "class b:\n    c = a", "b = lambda: a"],
)
def test_a_cell_that_reads_it_would_read_another_thing_when_run_again(reader: str) -> None:
    assert len(_found(ONE, "a = 1", reader, TWO, "a = 2")) == 1
    assert _found(ONE, "a = 1", reader, "a = 2", TWO, "b = a") == [], "within one section it may"
    assert _found(ONE, f"a = 1\n{reader}", TWO, "a = 2") == [], "a cell that binds it itself finds it"


def test_a_function_reads_for_the_cell_that_calls_it() -> None:
    assert _found(ONE, "a = 1\ndef f():\n    return a", TWO, "a = 2") == []
    assert len(_found(ONE, "a = 1\ndef f():\n    return a", "f()", TWO, "a = 2")) == 1
    assert len(_found(ONE, "a = 1\ndef f():\n    return a", "def g():\n    return f()", "g()", TWO, "a = 2")) == 1


@pytest.mark.parametrize(
    "harmless",
    ["for a in (1, 2):\n    pass", "import a", "b = [a for a in (1, 2)]", "def b(a):\n    a = 2", "b = lambda a: a"],
)
def test_loops_imports_and_what_is_local_are_excepted(harmless: str) -> None:
    assert _found(ONE, "a = 1", "b = a", TWO, harmless) == []


def test_a_generator_and_a_learners_function_may_be_bound_anew() -> None:
    assert _found(ONE, "rng = 1", "b = rng", TWO, "rng = 2") == []
    task = "def f():\n    return 1"
    assert len(_found(ONE, "f = max", "f(1, 2)", TWO, task)) == 1
    assert _found(ONE, "f = max", "f(1, 2)", TWO, task, tags=("task",)) == []
