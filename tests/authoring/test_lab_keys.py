"""A lab tells neither a line of a solution nor the key of a choice."""

from __future__ import annotations

import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from course_lib.authoring.choice_keys import told_keys
from course_lib.authoring.lab_keys import lab_tasks, told_lines


def _task(number: int, solution: str, given: str = "") -> list[NotebookNode]:
    """A heading and a task cell with its solution, and with wrong code to mend where some is given."""
    body = ["# BEGIN SOLUTION", *solution.splitlines()]
    body += ["# INSTEAD", *(f"#| {line}" for line in given.splitlines())] if given else []
    source = "def answer(a, b):\n" + "\n".join(f"    {line}" for line in [*body, "# END SOLUTION"])
    heading = new_markdown_cell(f"## Task {number} — Title (1 point)")
    return [heading, new_code_cell(source, metadata={"tags": ["task"]})]


def _told(*cells: str | list[NotebookNode]) -> list[str]:
    """Findings in a lab of given cells and tasks."""
    made = [cell for one in cells for cell in ([new_code_cell(one)] if isinstance(one, str) else one)]
    return [line for _, line in told_lines(new_notebook(cells=made))]


def _lines(solution: str) -> set[str]:
    (task,) = lab_tasks(new_notebook(cells=_task(1, solution)))
    return set(task.secrets.values())


@pytest.mark.parametrize(
    ("solution", "lines"),
    [
        ("return a + b", set()),
        ("return -1 * a", set()),
        ("return -(a + b)", {"-(a + b)"}),
        ("return len(a) + 1", {"len(a) + 1"}),
        ("return f(g(a))", {"f(g(a))"}),
        ("return a < b < 1", {"a < b < 1"}),
        ("return a and b and c", {"a and b and c"}),
        ("a += f(b)", {"a + f(b)"}),
        ("a[0], b = c, d * e + 1", {"(c, d * e + 1)", "d * e + 1"}),
        ("return {'T': a @ b, 'fit': f(a) / 2}", {"{'T': a @ b, 'fit': f(a) / 2}", "f(a) / 2"}),
        ("for c in f(a):\n    if g(c) > 2:\n        b = c * c + 1", {"g(c) > 2", "c * c + 1"}),
        ("# a * a + a\nreturn a", set()),
    ],
)
def test_lines_of_a_solution_are_what_it_computes_in_two_steps_or_more(solution: str, lines: set[str]) -> None:
    assert _lines(solution) == lines


FIT = _task(1, "c = np.linalg.svd(a.T @ b)\nreturn c")


@pytest.mark.parametrize(
    "told",
    [
        "np.linalg.svd(P.T @ Q)",
        "U, _, Vt = np.linalg.svd(P.T @ Q)",
        "def f(p, q):\n    return np.abs(np.linalg.svd(p.T @ q)[0])",
        "%matplotlib inline\nx = [np.linalg.svd(p.T @ q) for p in q]",
        "# np.linalg.svd(P.T @ Q)",
        "x = 1  # the rotation: np.linalg.svd(P.T @ Q)",
        "# first `np.linalg.svd(P.T @ Q)`, then the guard",
    ],
)
def test_a_line_is_found_under_other_names(told: str) -> None:
    where = " in a comment" if "#" in told else ""
    assert _told(told, FIT) == [f"it holds a line of task 1's solution{where}: np.linalg.svd(a.T @ b)"]


@pytest.mark.parametrize(
    "harmless",
    [
        "np.linalg.svd(P @ Q)",
        "np.linalg.eigh(P.T @ Q)",
        "P.T @ Q",
        "np.linalg.svd(P.T @ 2)",
        "# the svd of P.T @ Q",
        "'np.linalg.svd(P.T @ Q)'",
    ],
)
def test_another_line_is_none(harmless: str) -> None:
    assert _told(harmless, FIT) == []


def test_plans_and_stubs_are_looked_at_as_learners_get_them() -> None:
    plan = "# np.linalg.svd(a.T @ b)\nc = np.linalg.svd(a.T @ b)\nreturn c"
    assert len(_told(_task(1, plan))) == 1
    assert _told(_task(4, plan)) == [], "a later task keeps no plan"
    assert _told(_task(1, "c = np.linalg.svd(a.T @ b)\nreturn c", "c = np.linalg.svd(a.T @ b)\nreturn b")) == []
    other = _task(2, "return 1", "c = np.linalg.svd(a.T @ b)\nreturn c")
    assert _told(FIT, other) == ["it holds a line of task 1's solution: np.linalg.svd(a.T @ b)"]
    assert len(_told(_task(1, "a += f(b)"), "c += f(d)")) == len(_told(_task(1, "a[0] += f(b)"), "c[0] + f(d)")) == 1


CAUSES = ["range", "scale", "flip", "mean"]
KEY = dict(zip("ABCD", CAUSES, strict=True))


def _ways(*cells: str, prose: str = "") -> list[str]:
    """How a lab with these cells in its choice task tells its key."""
    heading, answer = _task(4, f"return {KEY!r}")
    heading.source += f"\n\n{prose}"
    nb = new_notebook(cells=[heading, *map(new_code_cell, cells), answer])
    return [line.removeprefix("it tells the key of task 4: ").partition("; ")[0] for _, line in told_keys(nb)]


@pytest.mark.parametrize(
    ("told", "way"),
    [
        ('spoiled = {"A": a / 5, "B": f(a), "C": -a, "D": g(a)}', "a dict says what each letter is"),
        ('made = {"A": by_range, "B": by_scale}', "a dict says what each letter is"),
        ('made = {"D": "mean", "A": "range"}', "a dict says what each letter is"),
        ('made = {"range": "A"}', "a dict says which letter each cause is"),
        ('names = ["range", "scale", "flip", "mean"]', "the causes stand in the order of the letters"),
        ('names = ("range", "scale", "mean")', "the causes stand in the order of the letters"),
        ('made = {"range": f, "scale": g, "flip": h}', "the causes stand in the order of the letters"),
        ("order = [2, 0, 1, 3]", "an order is written down"),
        ("order = (4, 1, 2, 3)", "an order is written down"),
        ('for letter in "BADC": pass', "an order is written down"),
        ("order = rng.permutation(4)", "the order is drawn here, and whoever runs it has it"),
        ("rng.shuffle(made)", "the order is drawn here, and whoever runs it has it"),
        ('dict(zip("ABCD", [a / 5, f(a), -a, g(a)]))', "the letters are laid beside what is made for each"),
        ('made = [f, g, h, k]\nzip(list("ABCD"), made)', "the letters are laid beside what is made for each"),
    ],
)
def test_a_key_is_found_in_code(told: str, way: str) -> None:
    assert _ways(told) == [way]


@pytest.mark.parametrize(
    "harmless",
    [
        'views = {"A": stored["A"], "B": stored["B"]}',
        'views = {letter: stored[letter] for letter in "ABCD"}',
        'titles = {"A": "first", "B": "second"}',
        'medians = {"A": 1.5, "B": 2.5}',
        'choices = ["scale", "range", "mean", "flip"]',
        "ticks = [0, 1, 2, 3]",
        "size = [3, 2, 7, 4]",
        "some = rng.permutation(200)[:50]",
        'for letter, view in zip("ABCD", stored): pass',
        'for letter, view in zip("ABCD", [1]): pass',
    ],
)
def test_pictures_from_stored_arrays_tell_nothing(harmless: str) -> None:
    assert _ways(harmless) == []


@pytest.mark.parametrize(
    ("prose", "ways"),
    [
        ('`"range"`, `"scale"`, `"flip"`, `"mean"`', ["it lists the causes in the order of the letters"]),
        ('`"scale"`, `"range"`, `"flip"`, `"mean"`', []),
        ('`"range"`, `"scale"` and others', []),
        ('Return a dict: `{"A": "range", "B": …}`.', ["it says what A is"]),
        ('Return a dict: `{"A": "mean", "B": …}`.', []),
    ],
)
def test_a_key_is_found_in_words(prose: str, ways: list[str]) -> None:
    assert _ways(prose=prose) == ways


def test_other_tasks_may_shuffle_and_answers_that_are_no_choice_have_no_key() -> None:
    before = new_code_cell("order = rng.permutation(4)")
    assert list(told_keys(new_notebook(cells=[before, *_task(4, f"return {KEY!r}")]))) == []
    numbers = _task(4, "return {'A': 1, 'B': 2, 'C': 3}")
    assert list(told_keys(new_notebook(cells=[new_code_cell('{"A": f(a), "B": g(a)}'), *numbers]))) == []
